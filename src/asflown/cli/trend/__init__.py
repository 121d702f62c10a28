"""The verbs of the trend store: `trend add`, `list`, `show`, `compare` and `watch`."""

import typer

from .add import add
from .compare import compare
from .list import list_
from .show import show
from .watch import watch

app = typer.Typer(
    help="Figures of merit of an actuator over years: store, show, compare, watch.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.command("add", short_help="Analyse a list of actuations and store the results.")(add)
app.command("list", short_help="Events in the store, with rests and cycles.")(list_)
app.command("show", short_help="A figure over the years, with its trend.")(show)
app.command("compare", short_help="Compare cold and warm actuations, or any two events.")(compare)
app.command("watch", short_help="Test the newest actuation against the earlier ones; exit code 3 on alarm.")(watch)
