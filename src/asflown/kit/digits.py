"""Numbers as text: to the digits that the sigma supports, in a unit scaled to their size."""

from __future__ import annotations

import math

#: Prefixes by power of a thousand.
_PREFIXES = {-4: "p", -3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M"}
#: Units that take a prefix, and the usual powers.
_SCALED = {
    "N m": range(-4, 2), "N m s": range(-4, 2), "N": range(-4, 2), "N s": range(-4, 2), "s": range(-4, 1),
    "m": range(-4, 2), "m/s": range(-4, 2), "m/s2": range(-4, 1), "rad": range(-4, 1), "rad/s": range(-4, 1),
    "A m2": range(-4, 1), "A": range(-4, 1), "Hz": range(-4, 2),
}  # fmt: skip


def scaled_unit(size: float, unit: str) -> tuple[float, str]:
    """Factor and label of the unit that suits numbers of a size: (1e6, 'µN m') for 3e-5 N m.

    A unit that takes no prefix, an unknown size and zero leave the unit as it is."""
    powers = _SCALED.get(unit)
    size = abs(size)
    if powers is None or not math.isfinite(size) or size == 0 or 1 <= size < 1e4:
        return 1.0, unit
    power = min(max(math.floor(math.log10(size) / 3 + 1e-9), powers[0]), powers[-1])
    return 1000.0**-power, _PREFIXES[power] + unit


def plus_minus(value: float, sigma: float | None, unit: str = "") -> str:
    """Value and sigma to two digits of the sigma: '2.013 ± 0.012'; with a unit, in one scaled to the value: '-31.2 ± 1.4 µN m'.

    Without a finite positive sigma: four digits of the value."""
    if unit:
        larger = max((abs(v) for v in (value, sigma) if v is not None and math.isfinite(v)), default=0.0)
        factor, label = scaled_unit(larger, unit)
        return f"{plus_minus(factor * value, None if sigma is None else factor * sigma)} {label}"
    if not math.isfinite(value):
        return "unknown"
    if sigma is None or not (math.isfinite(sigma) and sigma > 0):
        return f"{value:.4g}"
    digits = 1 - math.floor(math.log10(sigma))
    if digits < 0 and abs(value) < 1e6:
        return f"{value:.0f} ± {sigma:.0f}"
    if not -1 < digits <= 7:
        return f"{value:.4g} ± {sigma:.2g}"
    return f"{value:.{digits}f} ± {sigma:.{digits}f}"


def interval(low: float | None, high: float | None, digits: int = 3) -> str:
    """'-1.2 to 3.4'; with open ends 'below 3.4', 'above -1.2', 'unlimited'."""
    if low is None and high is None:
        return "unlimited"
    if low is None:
        return f"below {high:.{digits}g}"
    if high is None:
        return f"above {low:.{digits}g}"
    return f"{low:.{digits}g} to {high:.{digits}g}"
