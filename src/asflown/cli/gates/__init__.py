"""The verbs on maneuvers: `gates` (fit and judge), `gates watch`, `predict`, `history` and `simulate`."""

import typer

from ..groups import FitUnlessNamed
from .fit import fit
from .history import history
from .predict import predict
from .simulate import simulate
from .watch import watch

__all__ = ["app"]

app = typer.Typer(
    cls=FitUnlessNamed,
    help="How well an engine executes its maneuvers: `asflown gates FILE` fits a Gates model and judges it.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.command("fit", short_help="Fit a model and judge it; `fit` may be left out.")(fit)
app.command("watch", short_help="Each new burn against the model before it: exit 3 on alarm.")(watch)
app.command("simulate", short_help="Maneuvers executed by a model, as a table.")(simulate)
app.command("predict", short_help="Errors to be expected of burns yet to be flown.")(predict)
app.command("history", short_help="Cassini's models and biases through the years.")(history)
