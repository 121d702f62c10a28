"""Disturbance torque from all channels at once (``estimate.fused``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from ...kit.errors import BadInput, check_choice
from .answer import Answer, Method

if TYPE_CHECKING:
    from ..fused import Foreknown
    from ..subject import Subject


@dataclass(frozen=True, kw_only=True)
class Fused(Method):
    """One smoothing of the loop with a torque in it.

    ``prior``: edges, matern or wiener; ``loop``: modelled or measured; ``considered``: one sigma of quantities taken as known,
    by name; see ``estimate.fused.fused`` for what None means.  ``foreknown``: torques known beforehand, by instants."""

    name: ClassVar[str] = "fused"
    prior: str | None = None
    loop: str | None = None
    considered: dict[str, float] | None = None
    foreknown: Foreknown | None = None

    def __post_init__(self):
        from ..fused import CONSIDERED, LOOPS, PRIORS  # nothing of it is loaded for another method

        check_choice(self.prior, (None, *PRIORS), "prior")
        check_choice(self.loop, (None, *LOOPS), "loop")
        for name, sigma in (self.considered or {}).items():
            check_choice(name, CONSIDERED, "considered quantity")
            if not 0 <= sigma < 1:
                raise BadInput(
                    f"a sigma of {sigma} for {name} is not possible",
                    remedy="Give a share such as 0.02 (delay_s: seconds); 0 takes the quantity as exact.",
                )

    def estimate(self, subject: Subject, axes: tuple[int, ...]) -> Answer:
        """Raises CannotFuse where the record lacks what the method needs."""
        from ..fused import fused

        f = fused(subject, axes, prior=self.prior, loop=self.loop, considered=self.considered, foreknown=self.foreknown)
        return Answer(
            by=self, grid=f.grid, torque_Nm=f.torque_Nm, sigma_Nm=f.sigma_Nm, momentum_Nms=f.momentum_Nms,
            settings=f.settings, doubts=f.doubts, paths_Nm=f.paths_Nm, peak_scales=f.peak_scales, evidence=f.evidence,
        )  # fmt: skip
