"""A made-up slew, and noise."""

import numpy as np

from asflown.kit.rotations import quaternion
from asflown.telemetry.telemetry import Telemetry
from flights import telemetry_of


def noise(n, sigma=1.0, seed=0):
    return sigma * np.random.default_rng(seed).standard_normal(n)


def slew(n=240, seed=1):
    """A slew about a skew axis at 1 Hz: seconds, body rates (n, 3), attitude q_NB (n, 4), with small noise."""
    from scipy.spatial.transform import Rotation

    t = np.arange(float(n))
    rate = 2e-3 * np.exp(-(((t - n / 2) / (n / 8)) ** 2))[:, None] * np.array([0.6, -0.3, 0.74])
    turns = [Rotation.from_rotvec([0.4, -1.1, 0.7])]
    for w in (rate[:-1] + rate[1:]) / 2:
        turns.append(turns[-1] * Rotation.from_rotvec(w))
    rng = np.random.default_rng(seed)
    q = quaternion(Rotation.concatenate(turns) * Rotation.from_rotvec(2e-6 * rng.standard_normal((n, 3))))
    return t, rate + 1e-6 * rng.standard_normal((n, 3)), q


def slewing(q_sign=(1, 1, 1, 1), rate_scale=1.0) -> Telemetry:
    t, w, q = slew()
    columns = {f"body_rate_{a}": (t, rate_scale * w[:, k]) for k, a in enumerate("xyz")}
    columns |= {f"quaternion_{m}": (t, s * q[:, k]) for k, (m, s) in enumerate(zip("wxyz", q_sign, strict=True))}
    return telemetry_of(**columns)
