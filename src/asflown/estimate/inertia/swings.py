"""What swings in the craft while it slews, propellant in its tanks and slow booms: described in the craft file, or found.

A mode of coupling delta [kg(1/2) m], frequency W and damping z answers the body's acceleration and holds momentum of its own,

    eta'' + 2 z W eta' + W^2 eta = -delta . alpha        h = delta eta'

which the wheels give and take.  It is driven by the motion alone, so that its course is known and only its size is fitted: the
telemetry hardly shows it, and the tensor feels it in every ramp.  Of what the craft file does not describe frequency and damping are
searched, and all of delta delta^T is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.rigid_body import momentum_regressor
from ...kit.doubts import Kind, Severity

if TYPE_CHECKING:
    from ...craft.model import CraftAt, Pendulum

#: The motion is taken at steps of this share of the shortest period.
_STEP = 0.02
#: Quicker modes follow the body: what they hold falls with the square of their frequency. [Hz]
_SLOW_HZ = 0.1

SWINGS = Kind(
    "inertia.swings", Severity.NOTE,
    "{name} is part of the model: it swings by {share:.2f} +- {sigma:.2f} of what the craft file says",
)  # fmt: skip
SWING_FOUND = Kind(
    "inertia.swing-found", Severity.CAUTION,
    "something swings at {frequency_Hz:.2g} Hz that the craft file does not describe, with {percent:.2g} % of the mean moment of inertia: it is "
    "part of the model, its frequency and damping searched and its size fitted",
    "Describe it in the craft file as [[slosh]] or [[flexible_modes]].",
)  # fmt: skip


@dataclass(frozen=True)
class Swing:
    """A pendulum or a boom: couplings (2 or 1, 3) [kg(1/2) m], natural frequency [rad/s], damping ratio."""

    name: str
    coupling: np.ndarray
    frequency: float
    damping: float

    FREE = 1

    def columns(self, time_s: np.ndarray, alpha_B: np.ndarray) -> np.ndarray:
        """What it holds, body axes (N, 3, 1), where the body is accelerated so (N, 3), from rest."""
        rate = answer(time_s, alpha_B, self.frequency, self.damping)
        return (rate @ (self.coupling.T @ self.coupling))[:, :, None]


@dataclass(frozen=True)
class FoundSwing:
    """One that the craft file does not describe: ``size`` [kg m2] times each element of a symmetric delta delta^T."""

    size: float
    frequency: float
    damping: float

    FREE = 6

    def columns(self, time_s: np.ndarray, alpha_B: np.ndarray) -> np.ndarray:
        """What it holds per element, body axes (N, 3, 6), where the body is accelerated so (N, 3), from rest."""
        return self.size * momentum_regressor(answer(time_s, alpha_B, self.frequency, self.damping))


def answer(time_s: np.ndarray, alpha_B: np.ndarray, frequency: float, damping: float) -> np.ndarray:
    """Rate eta' of a mode that each component of the body's acceleration drives by itself, coupling one. (N, 3)"""
    step = _STEP * 2 * np.pi / frequency
    even = np.arange(time_s[0], time_s[-1] + step, step)
    alpha = np.stack([np.interp(even, time_s, a) for a in alpha_B.T], axis=1)
    b, a, _ = scipy.signal.cont2discrete(
        ([-1.0, 0.0], [1.0, 2 * damping * frequency, frequency**2]), step, method="foh"
    )
    rate = scipy.signal.lfilter(np.atleast_1d(np.squeeze(b)), a, alpha, axis=0)
    return np.stack([np.interp(time_s, even, r) for r in rate.T], axis=1)


def swings_of(now: CraftAt) -> tuple[Swing, ...]:
    """The pendulums and slow modes that the craft file describes."""
    slow = [m for m in now.craft.flexible_modes if m.frequency < _SLOW_HZ]
    modes = [Swing(m.name, np.array([m.coupling], float), 2 * np.pi * m.frequency, m.damping) for m in slow]
    return (*(_swing(p) for p in now.craft.slosh), *modes)


def _swing(p: Pendulum) -> Swing:
    """delta = sqrt(m) r x e for both directions e across the rod, r to the mass hanging still: small swings in a heavy craft."""
    down = np.array(p.direction) / np.linalg.norm(p.direction)
    r = np.array(p.pivot) + p.length * down
    across = np.linalg.svd(down[None])[2][1:]
    return Swing(p.name, np.sqrt(p.mass) * np.cross(r, across), 2 * np.pi * p.frequency, p.damping)
