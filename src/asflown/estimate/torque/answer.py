"""What a way to reconstruct the torque is, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from ...kit.doubts import Doubts
from ...kit.errors import BadInput

if TYPE_CHECKING:
    import numpy as np

    from ..firing import Gained
    from ..fused import AxisData
    from ..subject import Grid, Subject

VARIANTS = ("corrected", "printed")


@dataclass(frozen=True, kw_only=True)
class Answer:
    """A torque on a grid, in body axes; NaN where nothing is known.

    ``by``: the method that gave it.  ``torque_Nm``, ``sigma_Nm``, ``momentum_Nms``: (M, 3); ``paths_Nm``: (K, F, 3), drawn
    jointly from the posterior, on the grid or one twice as fine.  ``fits``: orders and misfits of polynomials.  By axis:
    ``evidence``, what the fused method prepared, and ``peak_scales``, by what the spread of drawn peaks is to be multiplied;
    ``gained``: what on-times were set against."""

    by: Method
    grid: Grid
    torque_Nm: np.ndarray
    sigma_Nm: np.ndarray | None = None
    momentum_Nms: np.ndarray | None = None
    settings: dict = field(default_factory=dict)
    doubts: Doubts = Doubts()
    fits: tuple[dict, ...] = ()
    paths_Nm: np.ndarray | None = None
    peak_scales: dict[str, float] = field(default_factory=dict)
    evidence: dict[str, AxisData] = field(default_factory=dict)
    gained: Gained | None = None


@dataclass(frozen=True, kw_only=True)
class Method:
    """One way to reconstruct the torque, with its options; an option that cannot be raises BadInput when it is made."""

    name: ClassVar[str]
    variant: str = field(default="corrected", init=False)

    def estimate(self, subject: Subject, axes: tuple[int, ...]) -> Answer:
        """The torque about some axes (0: x); where a method answers for all, the others come too.

        Raises BadInput where the telemetry lacks what the method needs or is too short."""
        raise NotImplementedError


def check_window(window_s: float | None, variant: str) -> None:
    """Raises BadInput for a width that cannot be, and for one of a printed method."""
    if window_s is None:
        return
    if not 0 < window_s < 1e9:
        raise BadInput(f"a window of {window_s} s is not possible", remedy="Give a positive number of seconds.")
    if variant == "printed":
        raise BadInput("a printed method has no window to choose", remedy="Leave --window out.")
