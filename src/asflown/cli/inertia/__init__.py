"""The verbs of the inertia tensor: `inertia FILE` (or `inertia fit FILE`), `inertia plan` and `inertia history`."""

import typer

from ..groups import FitUnlessNamed
from .fit import fit
from .history import history
from .plan import plan

app = typer.Typer(
    cls=FitUnlessNamed,
    help="The inertia tensor and the external torque from slews: `asflown inertia FILE` (its options: asflown inertia FILE --help).",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.command("history", short_help="Tensors estimated and predicted over the mission.")(history)
app.command("plan", short_help="Which slew would tell most of what is not known yet.")(plan)
app.command("fit", short_help="What `asflown inertia FILE` does: the tensor from a file.")(fit)
