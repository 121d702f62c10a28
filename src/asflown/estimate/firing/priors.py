"""Priors of the thrusters and of the craft, each with its sigma; the user can change all of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ..subject import GYRO_BIAS, INERTIA_SHARE, SPIN_SHARE

if TYPE_CHECKING:
    from ...craft.model import Craft

#: Feldman & Lee, section V: tests gave fall times of 40 to 90 ms, with a mean of 65 ms. [s]
FALL, FALL_SIGMA = 0.065, 0.013
#: Across the craft, and along z: assumed.  Where the centre of mass is not known it is the middle of the thrusters. [m]
CENTER_SIGMA, CENTER_UNKNOWN = (0.1, 0.1, 0.5), (0.1, 0.1, 2.0)
#: Assumed shares: one sigma from pulse to pulse; scale of the half-normal prior on the spread of the thrusters; mass.
PULSE_SCATTER, UNLIKE, MASS_SHARE = 0.02, 0.05, 0.001


@dataclass(frozen=True)
class Priors:
    """What is known beforehand; there is no prior on the thrust, which is what is estimated.

    ``pulse_scatter``, ``unlike``, ``spin_share``, ``inertia_share``, ``mass_share``: one sigma, as a share."""

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
    doubts: Doubts = Doubts()

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
        middle = ", ".join(f"{a:g} ± {b:g}" for a, b in zip(x, s, strict=True))
        mass = "" if self.mass_kg is None else f"; mass {self.mass_kg:g} kg to {100 * self.mass_share:g} %"
        return (
            f"fall time {1e3 * self.fall_s:g} ± {1e3 * self.fall_sigma_s:g} ms; centre of mass {middle} m; pulses to "
            f"{100 * self.pulse_scatter:g} %, thrusters alike to {100 * self.unlike:g} %; spin inertia to {100 * self.spin_share:g} %, inertia to {100 * self.inertia_share:g} %{mass}"
        )


CENTER_NOT_KNOWN = Kind(
    "firing.center-of-mass-not-known", Severity.NOTE,
    "the centre of mass is not known: {taken}, with a sigma of {sigma} m", "Give --cm.",
)  # fmt: skip


def center_doubts(craft: Craft, sigma_m) -> list[Doubt]:
    """That the centre of mass is not known, and what is assumed; nothing where it is known."""
    if craft.center_of_mass is not None:
        return []
    meters, place = (", ".join(f"{v:g}" for v in x) for x in (sigma_m, craft.likely_center))
    taken = (
        "the middle of the thrusters is assumed" if craft.center_of_mass_assumed is None else f"{place} m is assumed"
    )
    return [CENTER_NOT_KNOWN(taken=taken, sigma=meters)]


def thrust_priors(
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
    """Priors of a craft, with what the user says instead.

    Parameters
    ----------
    craft : Craft
        One with thrusters.
    fall_s, fall_sigma_s : float, optional
        Fall time of the valves and its sigma [s]; the craft's and 0.013 s unless given.
    center_sigma_m : array_like of shape (3,), optional
        Sigma of the centre of mass along each axis [m].
    pulse_scatter, unlike, spin_share, inertia_share, mass_share : float, optional
        One sigma, as a share: from pulse to pulse, of one thruster against the others, of a wheel's spin inertia, of the
        inertia, of the mass.
    mass_kg : float, optional
        Mass of the craft, which accelerometer counts need.

    Returns
    -------
    Priors

    Raises
    ------
    BadInput
        For a craft without thrusters, and for a value that is out of its range.
    """
    if not craft.thrusters:
        raise BadInput(f"{craft.name} has no thrusters", remedy="Give its file [[thrusters]], or name another --craft.")
    _check_positive({
        "fall time (--fall-time)": fall_s, "sigma of the fall time (--fall-sigma)": fall_sigma_s, "mass (--mass)": mass_kg,
    })  # fmt: skip
    _check_shares({
        "--unlike": unlike, "--spin-sigma": spin_share, "--inertia-sigma": inertia_share, "--mass-sigma": mass_share,
    })  # fmt: skip
    if pulse_scatter is not None and not 0 <= pulse_scatter < 1:
        raise BadInput(
            f"a pulse scatter of {pulse_scatter:g} is not between 0 and 1", remedy="Give a share: 0.02 is 2 %."
        )
    if center_sigma_m is not None and not min(center_sigma_m) > 0:
        raise BadInput("a sigma of the centre of mass is not positive", remedy="Give three lengths above zero.")
    if inertia_share is None:
        inertia_share = craft.inertia_share
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
        doubts=Doubts(center_doubts(craft, center_sigma_m)),
    )


def _check_positive(values: dict[str, float | None]) -> None:
    for what, value in values.items():
        if value is not None and not value > 0:
            raise BadInput(f"{what} {value:g} is not positive", remedy="Give a value above zero.")


def _check_shares(shares: dict[str, float | None]) -> None:
    for option, value in shares.items():
        if value is not None and not 0 < value < 1:
            raise BadInput(f"{option} {value:g} is not between 0 and 1", remedy="Give a share: 0.02 is 2 %.")
