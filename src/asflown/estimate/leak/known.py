"""What the leak monitor takes as known before it looks at a record, each with its sigma: all of it can be changed."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from ...kit.errors import BadInput
from ..firing import CENTER_SIGMA
from ..subject import INERTIA_SHARE, SPIN_SHARE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft

_HOUR_S = 3600.0


@dataclass(frozen=True)
class Known:
    """One sigma of each; all assumed.  Shares are of the value itself."""

    thrust_share: float = 0.10  # of all thrusters together: blow-down, and fall time (13 of 170 ms a pulse)
    each_share: float = 0.03  # of one against the others
    pulse_share: float = 0.03  # of one pulse against another (Feldman & Lee 2006: 1 to 3 %)
    center_of_mass_m: tuple[float, float, float] = (0.02, 0.02, 0.02)  # an assumed one: CENTER_SIGMA
    inertia_share: float = INERTIA_SHARE
    spin_share: float = SPIN_SHARE
    torque_Nm: float = 3e-6  # external, steady; Feldman & Lee 2006 Table A1: 2.11 uN m
    torque_in_an_hour_Nm: float = 1e-6  # by which it walks

    @property
    def torque_walk_Nm_per_sqrt_s(self) -> float:
        return self.torque_in_an_hour_Nm / _HOUR_S**0.5

    def record(self) -> dict:
        return asdict(self) | {"center_of_mass_m": list(self.center_of_mass_m)}

    def __str__(self) -> str:
        center = ", ".join(f"{v:g}" for v in self.center_of_mass_m)
        return (
            f"thrust of all to {100 * self.thrust_share:g} %, of each to {100 * self.each_share:g} %, of a pulse to {100 * self.pulse_share:g} %; "
            f"centre of mass to {center} m; inertia to {100 * self.inertia_share:g} %; spin inertia to {100 * self.spin_share:g} %; external torque "
            f"to {1e6 * self.torque_Nm:g} µN m, walking {1e6 * self.torque_in_an_hour_Nm:g} µN m in an hour"
        )


#: Which option of the command line gives each.
_OPTIONS = {
    "thrust_share": "--thrust-sigma",
    "each_share": "--unlike",
    "pulse_share": "--pulse-scatter",
    "center_of_mass_m": "--cm-sigma",
    "inertia_share": "--inertia-sigma",
    "spin_share": "--spin-sigma",
    "torque_Nm": "--torque-sigma",
    "torque_in_an_hour_Nm": "--torque-walk",
}


def leak_known(
    craft: Craft,
    *,
    thrust_share: float | None = None,
    each_share: float | None = None,
    pulse_share: float | None = None,
    center_of_mass_m: Sequence[float] | None = None,
    inertia_share: float | None = None,
    spin_share: float | None = None,
    torque_Nm: float | None = None,
    torque_in_an_hour_Nm: float | None = None,
) -> Known:
    """What a leak monitor takes as known of a craft: the defaults, with what the user gives instead.

    Parameters
    ----------
    craft : Craft
        Whose centre of mass is known, or only assumed and then to 0.1, 0.1, 0.5 m.
    thrust_share, each_share, pulse_share : float, optional
        One sigma of the thrust of all thrusters together, of one against the others, and of one pulse against another, as shares.
    center_of_mass_m : sequence of 3 floats, optional
        One sigma of the centre of mass, axes of the thrusters' positions [m].
    inertia_share, spin_share : float, optional
        One sigma of the inertia and of each wheel's spin inertia, as shares.
    torque_Nm, torque_in_an_hour_Nm : float, optional
        One sigma of the steady external torque about each axis, and of its change in an hour [N m].

    Returns
    -------
    Known
        One sigma of each.

    Raises
    ------
    BadInput
        For a share outside 0 to 1, or another sigma that is not positive.
    """
    said: dict[str, Any] = {
        "thrust_share": thrust_share, "each_share": each_share, "pulse_share": pulse_share,
        "center_of_mass_m": None if center_of_mass_m is None else tuple(center_of_mass_m),
        "inertia_share": inertia_share, "spin_share": spin_share, "torque_Nm": torque_Nm, "torque_in_an_hour_Nm": torque_in_an_hour_Nm,
    }  # fmt: skip
    given = {k: v for k, v in said.items() if v is not None}
    for name, value in given.items():
        largest = 1.0 if name.endswith("_share") else float("inf")
        for v in value if isinstance(value, tuple) else [value]:
            if not 0 < v < largest:
                raise BadInput(
                    f"a sigma of {v:g} ({_OPTIONS[name]}) is not possible",
                    remedy="A share lies between 0 and 1 (0.02 is 2 %), any other sigma above zero.",
                )
    if craft.inertia_share is not None:
        given.setdefault("inertia_share", craft.inertia_share)
    if craft.center_of_mass is None:
        given.setdefault("center_of_mass_m", CENTER_SIGMA)
    return Known(**given)
