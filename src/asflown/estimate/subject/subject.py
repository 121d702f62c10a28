"""What an estimate is about: telemetry together with the craft as it was then."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput, some_of
from ...kit.timeline import utc_label
from .activity import slews, thrusters_firing
from .assumed import INERTIA_SHARE
from .sky import OF_THE_SUN, sky_doubts

if TYPE_CHECKING:
    from ...craft.model import Craft, CraftAt, Wheel
    from ...telemetry.telemetry import Channel, Telemetry

#: A mechanism counts as moving when its angle changes by more than this. [rad]
_MOVED = 0.05


@dataclass(frozen=True)
class Subject:
    """Telemetry, the craft on its date, and the inertia that moves with the body axes."""

    telemetry: Telemetry
    craft: CraftAt
    inertia_kgm2: np.ndarray | None  # (3, 3); without a moving mechanism; per unit spin inertia if relative
    moving: str | None
    doubts: Doubts

    @property
    def relative(self) -> bool:
        return any(w.spin_inertia is None for w in self.craft.wheels)

    @cached_property
    def slewing(self) -> bool:
        """Whether the craft slews in this record."""
        return slews(self.telemetry)

    @cached_property
    def firing(self) -> list[str]:
        """Thrusters that fire in this record."""
        return thrusters_firing(self.telemetry)

    @property
    def inertia_share(self) -> float:
        """One sigma of the inertia as a share: as the craft's file states it, else as assumed."""
        stated = self.craft.craft.inertia_share
        return INERTIA_SHARE if stated is None else stated

    def known_inertia(self) -> np.ndarray:
        """Raises BadInput where the craft's inertia is not known."""
        if self.inertia_kgm2 is None:
            raise BadInput(
                f"the inertia of {self.craft.craft.name} is not known, and this method needs it",
                remedy='Give it: --inertia "Ixx,Iyy,Izz,Ixy,Ixz,Iyz" in kg m2.',
            )
        return self.inertia_kgm2

    def controller(self):
        k = self.craft.craft.wheel_controller
        if k is None:
            raise BadInput(
                "this craft has no wheel controller, which the method needs",
                file=self.craft.craft.name,
                remedy="Describe it under [wheel_controller] in the craft file, or use --method momentum.",
            )
        return k

    def wheels(self) -> list[tuple[Channel, Wheel]]:
        """Each wheel in service with its rate channel.

        Raises BadInput for a wheel the craft does not have and for one without telemetry."""
        tlm, craft = self.telemetry, self.craft.craft
        for name in tlm.members("wheel_rate"):
            if name not in craft.wheel_names:
                raise BadInput(
                    f"{craft.name} has no wheel {name!r}",
                    file=tlm.source or None,
                    channel=f"wheel_rate_{name}",
                    remedy=f"Its wheels: {some_of(craft.wheel_names)}. Rename the column, or name the right --craft.",
                )
        missing = [w.name for w in self.craft.wheels if f"wheel_rate_{w.name}" not in tlm]
        if missing:
            raise BadInput(
                f"no rate of wheel {some_of(missing)}, so the momentum is not complete",
                file=tlm.source or None,
                channel=f"wheel_rate_{missing[0]}",
                remedy="Add the channel; a wheel out of service needs valid_to in the craft file.",
            )
        return [(tlm.channel(f"wheel_rate_{w.name}"), w) for w in self.craft.wheels]


UNDATED = Kind(
    "subject.undated", Severity.CAUTION,
    "the telemetry has no epoch: the craft's latest known mass properties and wheel set are used",
    "Put '# epoch: 2015-09-29T00:00:00 UTC' at the head of the file.",
)  # fmt: skip
NOT_IN_SERVICE = Kind(
    "subject.wheel-not-in-service",
    Severity.NOTE,
    "wheel {wheel} was not in service then ({date}): its rate is not used",
)
PER_SPIN_INERTIA = Kind(
    "subject.per-spin-inertia", Severity.NOTE,
    "the wheels' spin inertia is not known: {what} per unit spin inertia (rad/s^2, rad/s), not in N m",
    "Give the wheels' spin_inertia in the craft file.",
)  # fmt: skip


def subject_of(telemetry: Telemetry, craft: Craft, moving: str | None = "auto") -> Subject:
    """The craft on the telemetry's date.

    ``moving``: a mechanism whose inertia is taken off (000 eqs 4, 5), None for no one, or 'auto': the
    one whose angle is seen to move.  An inertia given by the user is used as given."""
    now = craft.at(telemetry.date_ns)
    given = any(m.piece == "given" for m in craft.mass_properties)
    # the Sun is doubted by those who use it; a field or an attitude that is wrong says that the axes are
    doubts = [*telemetry.doubts, *now.doubts, *sky_doubts(telemetry, craft).without(*OF_THE_SUN)]
    if not telemetry.dated and not given and len(craft.mass_properties) > 1:
        doubts.append(UNDATED())
    idle = [n for n in telemetry.members("wheel_rate") if n in craft.wheel_names and now.wheel(n) is None]
    doubts += [NOT_IN_SERVICE(wheel=name, date=_when(telemetry)) for name in idle]
    part = None if given else (_moved(telemetry, craft) if moving == "auto" else moving)
    I_B = now.inertia_kgm2
    if part is not None and I_B is not None:
        I_B = now.effective_inertia(part)
    return Subject(telemetry, now, I_B, part, Doubts(doubts))


def _when(telemetry: Telemetry) -> str:
    return utc_label(telemetry.epoch_ns)[:10] if telemetry.dated else "latest set"


def _moved(telemetry: Telemetry, craft: Craft) -> str | None:
    for m in craft.mechanisms:
        for channel in (f"cover_angle_{m.name}", "cover_angle" if len(craft.mechanisms) == 1 else ""):
            if channel in telemetry and np.ptp(telemetry.channel(channel).usable.values) > _MOVED:
                return m.name
    return None
