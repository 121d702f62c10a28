"""What is left of a bias after a patch: the epochs before and after it, under one model (Wagner 2014 Figures 1, 3, 5, 7)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy

from ...kit.digits import plus_minus
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.result import Estimate, recorded, with_old_keys
from ...kit.schema import Annotated, Doc, Number, TypedDict
from ...kit.table import Table
from ...maneuvers.model import Quantity
from .checks import sign_test
from .likelihoods import problems

if TYPE_CHECKING:
    from ...maneuvers.table import Maneuvers
    from .likelihood import Point

#: Burns on either side that a comparison takes: two biases, and something to spare.
_FEWEST = 4
#: p-value below which a difference is doubted to be chance.
_P = 0.05

BIAS_LEFT = Kind(
    "gates.bias-left", Severity.SUSPECT, "a bias is left after the patch before {burn} (p = {p:.2g})", "See the epoch 'after'.",
)  # fmt: skip
EPOCHS_DIFFER = Kind(
    "gates.epochs-differ", Severity.SUSPECT,
    "with the bias taken out, the errors before and after {burn} still differ (p = {p:.2g}): the patch changed something else, "
    "or the two epochs do not have one model",
    "Fit the epochs apart.",
)  # fmt: skip


class EpochRecord(TypedDict):
    name: str
    count: int
    below_zero: int
    above_zero: int
    sign_p: Number
    bias_fixed_mps: Number
    bias_fixed_sigma_mps: Number
    bias_proportional: Number
    bias_proportional_sigma: Number
    bias_p: Annotated[Number, Doc("of no bias at all")]


class PatchRecord(TypedDict):
    first_after: str
    removed_fixed_mps: Number
    removed_proportional: Number
    epochs: Annotated[list[EpochRecord], Doc("before as flown, before with the bias taken out, after")]
    difference_p: Annotated[Number, Doc("of one bias in the last two epochs")]


@dataclass(frozen=True)
class Epoch:
    """Magnitude errors on one side of a patch, with the bias that is in them; ``bias_p``: of no bias at all."""

    name: str
    count: int
    below: int
    sign_p: float
    bias_fixed_mps: float
    bias_fixed_sigma_mps: float
    bias_proportional: float
    bias_proportional_sigma: float
    bias_p: float

    def record(self) -> dict:
        return {
            "name": self.name, "count": self.count, "below_zero": self.below, "above_zero": self.count - self.below, "sign_p": self.sign_p,
            "bias_fixed_mps": self.bias_fixed_mps, "bias_fixed_sigma_mps": self.bias_fixed_sigma_mps,
            "bias_proportional": self.bias_proportional, "bias_proportional_sigma": self.bias_proportional_sigma, "bias_p": self.bias_p,
        }  # fmt: skip

    def row(self) -> tuple[str, ...]:
        fixed = plus_minus(1e3 * self.bias_fixed_mps, 1e3 * self.bias_fixed_sigma_mps)
        proportional = plus_minus(100 * self.bias_proportional, 100 * self.bias_proportional_sigma)
        below = f"{self.below} of {self.count}"
        return (self.name, below, f"{self.sign_p:.2g}", fixed, proportional, f"{self.bias_p:.2g}")


@dataclass(frozen=True, kw_only=True, repr=False)
class GatesPatch(Estimate):
    """Epochs before (as flown), before (bias taken out) and after; ``difference_p``: of one bias in the last two.

    ``maneuvers``: all of them as if the patch had been there from the start."""

    RECORD: ClassVar[type] = PatchRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {
        "epochs[].sigma_bias_fixed_mps": "bias_fixed_sigma_mps",
        "epochs[].sigma_bias_proportional": "bias_proportional_sigma",
    }

    first_after: str
    removed_fixed_mps: float
    removed_proportional: float
    epochs: tuple[Epoch, Epoch, Epoch]
    difference_p: float
    maneuvers: Maneuvers

    def _record(self) -> dict:
        record = {
            "first_after": self.first_after, "removed_fixed_mps": self.removed_fixed_mps, "removed_proportional": self.removed_proportional,
            "epochs": [e.record() for e in self.epochs], "difference_p": self.difference_p,
        }  # fmt: skip
        with_old_keys(record, self.OLD_KEYS)  # it also stands within the record of a fit
        return record

    def _tables(self) -> tuple[Table, ...]:
        removed = f"{1e3 * self.removed_fixed_mps:+.3g} mm/s and {100 * self.removed_proportional:+.3g} %"
        head = ("epoch", "below zero", "p of signs", "bias [mm/s]", "bias [%]", "p of no bias")
        same = f"p of one bias in the last two: {self.difference_p:.2g}"
        title = f"Patch before {self.first_after}, which took out {removed}"
        return (Table(title, tuple(e.row() for e in self.epochs), head, (same,)),)


@recorded
def gates_patch(
    maneuvers: Maneuvers, first_after: str, *, removed_fixed_mps: float = 0.0, removed_proportional: float = 0.0
) -> GatesPatch:
    """What became of the magnitude bias by a patch.

    Parameters
    ----------
    maneuvers : Maneuvers
        Burns of one engine, before and after the patch.
    first_after : str
        Id of the first burn flown with the patch.
    removed_fixed_mps, removed_proportional : float
        The bias that the patch took out; it is taken out of the burns before it, whose magnitude error falls by
        fixed + proportional v.

    Returns
    -------
    GatesPatch
        With all burns adjusted.  Sigmas are those of a fit to all of these.

    Raises
    ------
    BadInput
        Where either side has fewer than four burns, or the ledger says that this bias was taken out before.
    """
    m, at = maneuvers, maneuvers.place(first_after)
    if min(at, len(m) - at) < _FEWEST:
        raise BadInput(
            f"{at} burns before {first_after} and {len(m) - at} from it on: too few to compare", file=m.source or None,
            remedy=f"It takes {_FEWEST} on either side.",
        )  # fmt: skip
    adjusted = m.with_bias_removed(at, removed_fixed_mps, removed_proportional, f"patch before {first_after}")
    point = problems(adjusted)[Quantity.MAGNITUDE].minimum()
    spare = len(m) - 4
    flown, _, _ = _epoch("before, as flown", m.take(slice(0, at)), point, spare)
    before, b, B = _epoch("before, adjusted", adjusted.take(slice(0, at)), point, spare)
    after, a, A = _epoch("after", adjusted.take(slice(at, None)), point, spare)
    off = a - b
    difference = float(scipy.stats.f.sf(off @ np.linalg.solve(A + B, off) / 2, 2, spare))
    return GatesPatch(
        first_after=first_after,
        removed_fixed_mps=removed_fixed_mps,
        removed_proportional=removed_proportional,
        epochs=(flown, before, after),
        difference_p=difference,
        maneuvers=adjusted,
        doubts=Doubts(_doubts(first_after, after, difference)),
    )


def _doubts(burn: str, after: Epoch, difference_p: float) -> list[Doubt | None]:
    return [
        BIAS_LEFT(burn=burn, p=after.bias_p) if after.bias_p < _P else None,
        EPOCHS_DIFFER(burn=burn, p=difference_p) if difference_p < _P else None,
    ]


def _epoch(name: str, m: Maneuvers, point: Point, spare: int) -> tuple[Epoch, np.ndarray, np.ndarray]:
    """One epoch, its biases by weighted least squares at the sigmas of ``point``, and their covariance."""
    v = m.dv_mps
    w = 1 / (point.fixed**2 + (point.proportional * v) ** 2 + m.sigma_magnitude_mps**2 + 1e-18)
    X = np.stack([np.ones_like(v), v], axis=1)
    covariance = np.linalg.pinv(X.T @ (w[:, None] * X), hermitian=True)
    bias = covariance @ X.T @ (w * m.magnitude_error_mps)
    p = float(scipy.stats.f.sf(bias @ np.linalg.pinv(covariance, hermitian=True) @ bias / 2, 2, spare))
    (fixed, proportional), sigma = bias.tolist(), np.sqrt(np.diag(covariance)).tolist()
    below = int(np.sum(m.magnitude_error_mps < 0))
    epoch = Epoch(name, len(m), below, sign_test(below, len(m)), fixed, sigma[0], proportional, sigma[1], p)
    return epoch, bias, covariance
