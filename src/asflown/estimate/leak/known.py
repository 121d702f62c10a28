"""What the leak monitor takes as known before it looks at a record, each with its sigma: all of it can be changed."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

from ...kit.errors import BadInput
from ..firing import CENTER_SIGMA

if TYPE_CHECKING:
    from ...craft.model import Craft

_HOUR_S = 3600.0


@dataclass(frozen=True)
class Known:
    """One sigma of each; all assumed.  Shares are of the value itself."""

    thrust_share: float = 0.10  # of all thrusters together: blow-down, and fall time (13 of 170 ms a pulse)
    each_share: float = 0.03  # of one against the others
    pulse_share: float = 0.03  # of one pulse against another (001: 1 to 3 %)
    center_of_mass_m: tuple[float, float, float] = (0.02, 0.02, 0.02)  # an assumed one: CENTER_SIGMA
    inertia_share: float = 0.01  # 001 Table 1
    spin_share: float = 0.0024  # 001: 0.161 for 0.16138
    torque_Nm: float = 3e-6  # from outside, steady; 001 Table A1: 2.11 uN m
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
            f"centre of mass to {center} m; inertia to {100 * self.inertia_share:g} %; spin inertia to {100 * self.spin_share:g} %; torque from outside "
            f"to {1e6 * self.torque_Nm:g} µN m, walking {1e6 * self.torque_in_an_hour_Nm:g} in an hour"
        )


#: Which option of the command line gives each.
OPTIONS = {
    "thrust_share": "--thrust-sigma",
    "each_share": "--unlike",
    "pulse_share": "--pulse-scatter",
    "center_of_mass_m": "--cm-sigma",
    "inertia_share": "--inertia-sigma",
    "spin_share": "--spin-sigma",
    "torque_Nm": "--torque-sigma",
    "torque_in_an_hour_Nm": "--torque-walk",
}


def known_for(craft: Craft, **said) -> Known:
    """The defaults for a craft, with what the user says instead (None: nothing).  Raises BadInput for a sigma that is none."""
    given = {k: v for k, v in said.items() if v is not None}
    for name, value in given.items():
        for v in value if isinstance(value, (tuple, list)) else [value]:
            if not 0 < v < (1.0 if name.endswith("_share") else float("inf")):
                raise BadInput(
                    f"{OPTIONS[name]} {v:g} is no sigma of something known",
                    remedy="A share lies between 0 and 1 (0.02 is 2 %), any other sigma above zero.",
                )
    if "center_of_mass_m" in given:
        given["center_of_mass_m"] = tuple(given["center_of_mass_m"])
    elif craft.center_of_mass is None:
        given["center_of_mass_m"] = CENTER_SIGMA
    return replace(Known(), **given)
