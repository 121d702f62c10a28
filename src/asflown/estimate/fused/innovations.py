"""Innovations of each channel, measured less predicted over their sigma: white and of unit size where the model holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ...kit.doubts import Doubt, Kind, Severity
from .series import ROWS

#: A channel is not explained when neighbours correlate this much, and chance would do so this rarely.
_CORRELATED, _CHANCE = 0.35, 1e-3
#: A quantity taken as known is doubted when the data put it this far off, in units of its own sigma.
_FAR_OFF = 2.5

UNEXPLAINED = Kind(
    "fused.unexplained", Severity.SUSPECT,
    "the model does not explain {channel} about {axis}: its innovations are correlated ({correlation:+.2f})",
    "Check inertia and gains, and whether the span holds a commanded motion or a thruster firing.",
)  # fmt: skip
KNOWN_OFF = Kind(
    "fused.known-off", Severity.SUSPECT,
    "the data about {axis} suggest that {quantity} differs from the value given by {off_percent:+.1f} ± {sigma_percent:.1f} %",
    "Check the craft file, or give --consider {name} a larger sigma.",
)  # fmt: skip
DELAY_OFF = Kind(
    "fused.delay-off", Severity.SUSPECT, "the data about {axis} suggest that {quantity} differs from the value given by {off_s:+.2f} ± {sigma_s:.2f} s",
    "Check the time stamps, or give --consider {name} a larger sigma.",
)  # fmt: skip


@dataclass(frozen=True)
class Innovations:
    """Of one channel."""

    samples: int
    chi_square: float  # mean square of the innovations over their predicted variance
    correlation: float  # of neighbours
    p: float  # Ljung-Box test of the first eight correlations

    @classmethod
    def of(cls, whitened: np.ndarray) -> Innovations:
        n = len(whitened)
        lags = np.arange(1, min(8, n // 4) + 1)
        centred = whitened - whitened.mean()
        power = float(np.sum(centred**2))
        r = np.array([np.sum(centred[k:] * centred[:-k]) for k in lags]) / power
        Q = n * (n + 2) * np.sum(r**2 / (n - lags))
        return cls(n, float(np.mean(whitened**2)), float(r[0]), float(scipy.stats.chi2.sf(Q, len(lags))))


def by_channel(whitened: np.ndarray, row: np.ndarray) -> dict[str, Innovations]:
    """Of every channel with enough samples to say anything."""
    channels = {name: whitened[row == k] for k, name in enumerate(ROWS)}
    return {name: Innovations.of(v) for name, v in channels.items() if len(v) > 20}


def innovation_doubts(axis: str, found: dict[str, Innovations]) -> list[Doubt]:
    """Channels whose innovations are correlated: the model does not explain them."""
    return [
        UNEXPLAINED(channel=channel, axis=axis, correlation=i.correlation)
        for channel, i in found.items()
        if abs(i.correlation) > _CORRELATED and i.p < _CHANCE
    ]


_NAMES = {
    "inertia": "the inertia",
    "spin_inertia": "the wheels' spin inertia",
    "kp": "the controller's KP",
    "kd": "the controller's KD",
    "delay_s": "the loop's delay",
    "control_torque": "the control torque delivered",
}


def considered_doubts(axis: str, considered: dict[str, float], drawn: np.ndarray) -> list[Doubt]:
    """Where the data contradict what was taken as known; ``drawn``: (K, P), in units of each one's sigma, these first."""
    doubts = []
    for (name, sigma), column in zip(considered.items(), drawn.T, strict=False):
        mean, spread = float(column.mean()), float(column.std())
        if abs(mean) < _FAR_OFF or spread > 0.8:
            continue
        told = {"axis": axis, "quantity": _NAMES[name], "name": name}
        if name == "delay_s":
            doubts.append(DELAY_OFF(off_s=sigma * mean, sigma_s=sigma * spread, **told))
        else:
            doubts.append(KNOWN_OFF(off_percent=100 * sigma * mean, sigma_percent=100 * sigma * spread, **told))
    return doubts
