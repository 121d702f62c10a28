"""What a density is asked for, and where its record passes the moon."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...kit.errors import BadInput, check_choice
from ...kit.timeline import utc_label
from ..torque import METHODS, VARIANTS

if TYPE_CHECKING:
    from ...dynamics.flyby import Flyby
    from ...dynamics.plume import Jet
    from ...telemetry.telemetry import Telemetry
    from .drag import DragGiven

#: The part of a record that a result shows, either side of closest approach. [s]
REACH_S = 600.0


@dataclass(frozen=True)
class Asked:
    """What ``density`` is asked for.  Raises BadInput for choices that are not there, and for one direction without the other."""

    flyby: Flyby
    closest_approach: str | float
    drag: DragGiven
    method: str | None = None
    variant: str = "corrected"
    order: int = 12
    velocity_B: object = None
    up_B: object = None
    sources: tuple[Jet, ...] | None = None
    cusps: bool = True

    def __post_init__(self):
        check_choice(self.method, (None, *METHODS), "method")
        check_choice(self.variant, VARIANTS, "variant")
        if (self.velocity_B is None) != (self.up_B is None):
            raise BadInput(
                "the gravity gradient needs the direction of flight and the vertical, and only one is given",
                remedy="Give both (--velocity and --up), or none: then it is bounded.",
            )

    @property
    def printed(self) -> bool:
        return self.variant == "printed"

    @property
    def takes_gravity_off(self) -> bool:
        """Whether the gravity gradient is modelled, not bounded."""
        return self.velocity_B is not None and not self.printed


@dataclass(frozen=True)
class Passage:
    """A flyby in a record: ``closest_s`` is closest approach from the telemetry's epoch, ``label`` the same as text."""

    flyby: Flyby
    closest_s: float
    label: str


def passage_of(telemetry: Telemetry, asked: Asked) -> Passage:
    """Raises BadInput where the record is not of the flyby's closest approach."""
    closest_ns = telemetry.moment(asked.closest_approach)
    first, last = (float(telemetry.seconds(t)) for t in telemetry.span())
    closest_s = float(telemetry.seconds(closest_ns))
    if not first - REACH_S < closest_s < last + REACH_S:
        raise BadInput(
            f"closest approach ({telemetry.describe_time(closest_ns)}) is not in this record",
            file=telemetry.source or None,
            remedy=f"The telemetry runs from {first:g} to {last:g} s of its epoch, {telemetry.epoch_label}.",
        )
    label = f"{utc_label(closest_ns)} UTC" if telemetry.dated else f"{closest_s:g} s"
    return Passage(asked.flyby, closest_s, label)
