"""What was done to the expected dV of a maneuver, kept in a ledger so that nothing is done twice (Wagner 2014 Appendix C)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kit.errors import BadInput

#: Name of the correction for accelerometer scale factor or thrust, in ledgers and in the column ``adjusted``.
SCALE = "scale"


@dataclass(frozen=True)
class Adjustment:
    """One change of one maneuver's expected dV."""

    name: str


Ledger = tuple[Adjustment, ...]


def entered(ledger: Ledger, adjustment: Adjustment, maneuver: str) -> Ledger:
    """The ledger with a further entry.  Raises BadInput where one of that name stands in it already."""
    if any(a.name == adjustment.name for a in ledger):
        raise BadInput(
            f"maneuver {maneuver}: the adjustment {adjustment.name!r} has been made already",
            remedy="Name it once: leave it out of the column 'adjusted' where it is still to be made, or out of the request.",
        )
    return (*ledger, adjustment)


def scale_corrected(expected_dv, burn_dv, ratio) -> np.ndarray:
    """Expected dV as the craft would have flown it with the right scale factor or thrust. [m/s], (N, 3)

    expected + (c - 1) burn: Wagner 2014 eq 6 with c = estimated / onboard accelerometer scale factor for an engine cut off by
    an accelerometer, eq 7 with c = predicted / onboard thrust for one cut off by time.  Turns and deadband firing are
    not measured by the accelerometer and stay as they are."""
    return np.asarray(expected_dv) + (np.asarray(ratio, float)[:, None] - 1) * np.asarray(burn_dv)
