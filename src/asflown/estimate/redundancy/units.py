"""Words for a factor between channels: the unit or sign whose mistake gives it."""

from __future__ import annotations

import numpy as np

from ...telemetry.attitude import MISTAKEN_UNITS
from .motion import ERROR, GYRO, NAMES

#: Wrong units of an attitude error by the factor that they make.
ERROR_UNITS = {
    648_000 / np.pi: "arcsec labelled rad", 180 / np.pi: "deg labelled rad", 1e3: "mrad labelled rad", 1e6: "microrad labelled rad",
    np.pi / 648_000: "rad labelled arcsec", np.pi / 180: "rad labelled deg", 1e-3: "rad labelled mrad",
}  # fmt: skip
#: The same of wheels, by the factor that takes it back, and how near a factor is to a unit's.
_WHEEL_UNITS = {np.pi / 30: "wheel rates in rpm labelled rad/s", 30 / np.pi: "wheel rates in rad/s labelled rpm"}
_NEAR = 0.15


def units_of(source: str) -> dict[float, str]:
    """What each factor too large would be."""
    return {ERROR: ERROR_UNITS, GYRO: MISTAKEN_UNITS}.get(source, {})


def of_factor(factor: float, source: str, *, all_wheels: bool) -> str:
    """What else would explain that the wheels, or one of them, should hold a factor times their momentum, of a source's motion."""
    if factor == 1.0:
        return ""
    size, name = abs(factor), NAMES[source]
    said = (
        [f"the {name} has the other sign, or what is not in the telemetry holds the craft"]
        if all_wheels and factor < 0
        else []
    )
    known = {f: f"{name} in {unit}" for f, unit in units_of(source).items()} | _WHEEL_UNITS
    units = [unit for f, unit in known.items() if abs(np.log(size / f)) < _NEAR]
    if size != 1.0 and not units:
        units = ["a wrong spin inertia" + (f", or a wrong scale of the {name}" if all_wheels else "")]
    return f" ({' or '.join(said + units)}?)" if said or units else ""
