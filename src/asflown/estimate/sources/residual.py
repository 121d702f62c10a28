"""What the sources leave: residual torque over windows, its noise, its spectrum, and whether the whitened readings are noise."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

if TYPE_CHECKING:
    from .whitened import Whitened

#: Windows over the record that a residual torque is a mean over.
_WINDOWS = 60
#: Lags of the test that whitened readings are independent.
_LAGS = 12


@dataclass(frozen=True)
class Residual:
    """Residual torque over windows.

    ``time_s`` (W,): middles, from the first sample; ``torque_Nm`` (W, 3) mean residual torque, body axes; ``noise_Nm`` (3,): what
    the readings' noise makes of it; ``frequency_Hz`` (F,), ``spectrum_Nm2_Hz`` (F, 3); ``white_p`` (3,): chance of whitened readings as
    correlated as these, were they noise."""

    time_s: np.ndarray
    torque_Nm: np.ndarray
    noise_Nm: np.ndarray
    frequency_Hz: np.ndarray
    spectrum_Nm2_Hz: np.ndarray
    white_p: np.ndarray
    jumps_s: np.ndarray

    @property
    def rms_Nm(self) -> np.ndarray:
        """(3,)"""
        return np.sqrt(np.mean(self.torque_Nm**2, axis=0))


def residual_of(white: Whitened, theta: np.ndarray) -> Residual:
    """theta (p,): every column of the arc, in its own sigma."""
    arc = white.arc
    left = arc.momentum - arc.Z @ theta
    K, windows = len(arc.time_s), min(_WINDOWS, max(len(arc.time_s) // 4, 2))
    parts = np.array_split(np.arange(K), windows + 1)
    turned = np.einsum("kij,kj->ki", arc.turn, left)
    variance = (white.levels.white * arc.white) ** 2 / arc.count[:, None]
    mean = np.array([np.average(turned[p], axis=0, weights=white.kept[p].all(axis=1) + 1e-9) for p in parts])
    middle = np.array([arc.time_s[p].mean() for p in parts])
    noise = np.array([variance[p].mean(axis=0) / len(p) for p in parts])
    step = np.diff(middle)
    whole = np.array([not (arc.jump[a[0] + 1 : b[-1] + 1] > 0).any() for a, b in pairwise(parts)])
    torque_N = np.diff(mean, axis=0) / step[:, None]
    at = np.array([arc.turn[p[-1]] for p in parts[:-1]])
    torque = np.einsum("wji,wj->wi", at, torque_N)
    when = 0.5 * (middle[1:] + middle[:-1])
    sigma = np.sqrt(np.median((noise[1:] + noise[:-1]) / step[:, None] ** 2, axis=0))
    filled = np.where(whole[:, None], torque, 0.0)
    from scipy.signal import periodogram  # a second of import that only this needs

    f, density = periodogram(filled, 1 / float(np.median(step)), axis=0, detrend="constant")
    keep = whole if whole.sum() >= 2 else np.ones(len(whole), bool)
    e = (white.E[:, 0] - white.E[:, 1:] @ theta).reshape(-1, 3)
    out = arc.time_s[np.flatnonzero(~white.kept.all(axis=1))]
    return Residual(when[keep], torque[keep], sigma, f[1:], density[1:], np.array([_white(v) for v in e.T]), out)


def _white(e: np.ndarray) -> float:
    """Ljung and Box's test of no correlation up to some lags."""
    e, n = e - e.mean(), len(e)
    lags = min(_LAGS, n // 5)
    power = float(e @ e)
    if lags < 1 or power == 0:
        return 1.0
    r = np.array([float(e[:-k] @ e[k:]) / power for k in range(1, lags + 1)])
    return float(scipy.special.chdtrc(lags, n * (n + 2) * np.sum(r**2 / (n - np.arange(1, lags + 1)))))
