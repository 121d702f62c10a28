"""What is taken as known before a record is looked at, each with its sigma: all of it can be changed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput
from ..subject import GYRO_BIAS, INERTIA_SHARE, SPIN_SHARE

if TYPE_CHECKING:
    from ...craft.model import Craft

#: 001 section V: tests gave fall times of 40 to 90 ms, 65 in the mean. [s]
FALL, FALL_SIGMA = 0.065, 0.013
#: Across the craft, and along z: assumed.  Where nothing tells the place it is the middle of the thrusters. [m]
CENTER_SIGMA, CENTER_UNKNOWN = (0.1, 0.1, 0.5), (0.1, 0.1, 2.0)
#: One sigma from pulse to pulse, as a share; how unlike thrusters are, the scale of a half-normal distribution; mass: assumed.
PULSE_SCATTER, UNLIKE, MASS_SHARE = 0.02, 0.05, 0.001


@dataclass(frozen=True)
class Priors:
    """There is none on the thrust itself: it is what is looked for."""

    fall_s: float
    fall_sigma_s: float
    center_m: tuple[float, float, float]
    center_sigma_m: tuple[float, float, float]
    pulse_scatter: float = PULSE_SCATTER
    unlike: float = UNLIKE
    spin_share: float = SPIN_SHARE
    inertia_share: float = INERTIA_SHARE
    gyro_bias_rad_s: float = GYRO_BIAS
    mass_kg: float | None = None
    mass_share: float = MASS_SHARE
    doubts: tuple[str, ...] = ()

    def record(self) -> dict:
        return {
            "fall_time_s": [self.fall_s, self.fall_sigma_s],
            "center_of_mass_m": [list(self.center_m), list(self.center_sigma_m)],
            "pulse_scatter": self.pulse_scatter,
            "thrusters_unlike": self.unlike,
            "wheel_inertia_share": self.spin_share,
            "inertia_share": self.inertia_share,
            "gyro_bias_rad_s": self.gyro_bias_rad_s,
            "mass_kg": None if self.mass_kg is None else [self.mass_kg, self.mass_share * self.mass_kg],
        }

    def __str__(self) -> str:
        x, s = self.center_m, self.center_sigma_m
        middle = ", ".join(f"{a:g} +- {b:g}" for a, b in zip(x, s, strict=True))
        mass = "" if self.mass_kg is None else f"; mass {self.mass_kg:g} kg to {100 * self.mass_share:g} %"
        return (
            f"fall time {1e3 * self.fall_s:g} +- {1e3 * self.fall_sigma_s:g} ms; centre of mass {middle} m; pulses to "
            f"{100 * self.pulse_scatter:g} %, thrusters alike to {100 * self.unlike:g} %; spin inertia to {100 * self.spin_share:g} %, inertia to {100 * self.inertia_share:g} %{mass}"
        )


def center_doubts(craft: Craft, sigma_m) -> list[str]:
    """That the centre of mass is not known, and what is taken; nothing where it is known."""
    if craft.center_of_mass is not None:
        return []
    meters, place = (", ".join(f"{v:g}" for v in x) for x in (sigma_m, craft.likely_center))
    where = "the middle of the thrusters is taken" if craft.center_of_mass_assumed is None else f"{place} m is assumed"
    return [f"the centre of mass is not known: {where}, to {meters} m. Give --cm"]


def priors_for(
    craft: Craft,
    *,
    fall_s: float | None = None,
    fall_sigma_s: float | None = None,
    center_sigma_m=None,
    pulse_scatter: float | None = None,
    unlike: float | None = None,
    spin_share: float | None = None,
    inertia_share: float | None = None,
    mass_kg: float | None = None,
    mass_share: float | None = None,
) -> Priors:
    """Those of a craft, with what the user says instead.  Raises BadInput for a craft without thrusters and for a value that
    no prior can have."""
    if not craft.thrusters:
        raise BadInput(f"{craft.name} has no thrusters", remedy="Give its file [[thrusters]], or name another --craft.")
    for value, what, option in (
        (fall_s, "fall time", "--fall-time"),
        (fall_sigma_s, "sigma of the fall time", "--fall-sigma"),
        (mass_kg, "mass", "--mass"),
    ):
        if value is not None and not value > 0:
            raise BadInput(f"a {what} of {value:g} is not positive", remedy=f"Give {option} a value above zero.")
    if pulse_scatter is not None and not 0 <= pulse_scatter < 1:
        raise BadInput(
            f"a pulse scatter of {pulse_scatter:g} is no share", remedy="Give a number from 0 to 1: 0.02 is 2 %."
        )
    for value, option in (
        (unlike, "--unlike"),
        (spin_share, "--spin-sigma"),
        (inertia_share, "--inertia-sigma"),
        (mass_share, "--mass-sigma"),
    ):
        if value is not None and not 0 < value < 1:
            raise BadInput(f"{option} {value:g} is no share", remedy="Give a number between 0 and 1: 0.02 is 2 %.")
    if center_sigma_m is not None and not min(center_sigma_m) > 0:
        raise BadInput("a sigma of the centre of mass is not positive", remedy="Give three lengths above zero.")
    own = [t.fall for t in craft.thrusters if t.fall > 0]
    center_sigma_m = tuple(center_sigma_m or (CENTER_UNKNOWN if craft.stated_center is None else CENTER_SIGMA))
    return Priors(
        fall_s=fall_s if fall_s is not None else (float(np.mean(own)) if own else FALL),
        fall_sigma_s=fall_sigma_s if fall_sigma_s is not None else FALL_SIGMA,
        center_m=craft.likely_center,
        center_sigma_m=center_sigma_m,
        pulse_scatter=PULSE_SCATTER if pulse_scatter is None else pulse_scatter,
        unlike=UNLIKE if unlike is None else unlike,
        spin_share=SPIN_SHARE if spin_share is None else spin_share,
        inertia_share=INERTIA_SHARE if inertia_share is None else inertia_share,
        mass_kg=mass_kg,
        mass_share=MASS_SHARE if mass_share is None else mass_share,
        doubts=tuple(center_doubts(craft, center_sigma_m)),
    )
