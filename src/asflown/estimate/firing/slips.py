"""What a wrong unit makes of a thrust."""

from __future__ import annotations

import numpy as np

#: Thrust found over thrust expected -> the unit that would make it.
_SLIPS = {
    1e-3: "on-times in ms labelled s, or thrusters' places in mm labelled m",
    1e3: "on-times in s labelled ms",
    1 / 60: "on-times in s labelled min",
    60.0: "on-times in min labelled s",
    0.3048: "thrusters' places in ft labelled m",
    0.0254: "thrusters' places in inches labelled m",
    60 / (2 * np.pi): "wheel rates in rpm labelled rad/s",
    2 * np.pi / 60: "wheel rates in rad/s labelled rpm",
    1 / (2 * np.pi): "wheel rates in rev/s labelled rad/s",
    180 / np.pi: "wheel rates in deg/s labelled rad/s",
    4.448: "a thrust in lbf labelled N in the craft file",
    -1.0: "the senses of all wheels, or the thrusters' directions, reversed",
}
#: A slip is named where the ratio is that close to its factor.
_CLOSE = 1.25


def thrust_slip(ratio: float) -> str:
    """': on-times in ms labelled s?' where a wrong unit makes a thrust ``ratio`` times the one expected, else ''."""
    slips = [what for factor, what in _SLIPS.items() if 1 / _CLOSE < ratio / factor < _CLOSE]
    return f": {' or '.join(slips)}?" if slips else ""
