"""What swings in the craft while it slews, as the craft file describes it: propellant in its tanks, and slow booms.

A mode of coupling delta [kg(1/2) m], frequency W and damping z answers the body's acceleration and holds momentum of its own,

    eta'' + 2 z W eta' + W^2 eta = -delta . alpha        h = delta eta'

which the wheels give and take.  It is driven by the motion alone, so that its course is known and only its size is fitted: the
telemetry hardly shows it, and the tensor feels it in every ramp.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

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


@dataclass(frozen=True)
class Swing:
    """A pendulum or a boom: couplings (2 or 1, 3) [kg(1/2) m], natural frequency [rad/s], damping ratio."""

    name: str
    coupling: np.ndarray
    frequency: float
    damping: float

    def momentum(self, time_s: np.ndarray, alpha_B: np.ndarray) -> np.ndarray:
        """What it holds, body axes (N, 3), where the body is accelerated so (N, 3), from rest."""
        step = _STEP * 2 * np.pi / self.frequency
        even = np.arange(time_s[0], time_s[-1] + step, step)
        alpha = np.stack([np.interp(even, time_s, a) for a in alpha_B.T], axis=1)
        W = self.frequency
        system = scipy.signal.lti([1.0, 0.0], [1.0, 2 * self.damping * W, W**2])
        total = sum(
            np.outer(scipy.signal.lsim(system, -alpha @ delta, even - even[0])[1], delta) for delta in self.coupling
        )
        return np.stack([np.interp(time_s, even, h) for h in np.asarray(total).T], axis=1)


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
