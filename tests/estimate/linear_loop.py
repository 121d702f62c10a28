"""A one-axis linear closed loop, written from the papers' block diagram for the tests alone.

It shares no line with asflown's simulator or with asflown.dynamics: state space, exact for a torque
that is linear between steps.
"""

import numpy as np
from scipy import linalg

from asflown.kit.timeline import NS, utc_to_tai_ns
from asflown.telemetry.telemetry import Channel, Telemetry

WN, ZN, WF, ZF = 2 * np.pi * 0.0299, 0.4138, 2.34048, 0.4000
KP, KD = WN / (2 * ZN), 2 * ZN * WN
AXES = np.array([[0, np.sqrt(2 / 3), 1 / np.sqrt(3)], [-1 / np.sqrt(2), -1 / np.sqrt(6), 1 / np.sqrt(3)],
                 [1 / np.sqrt(2), -1 / np.sqrt(6), 1 / np.sqrt(3)]])  # fmt: skip
SPIN = np.array([0.16138, 0.15947, 0.16138])


def triangles(t, rise, amplitude, count=6, start=60.0):
    """Alternating triangular pulses and their peak times."""
    centres = [start + rise + 2 * rise * k for k in range(count)]
    pulses = sum((-1) ** k * amplitude * np.clip(1 - np.abs(t - c) / rise, 0, None) for k, c in enumerate(centres))
    return pulses, centres


def respond(t, torque, inertia):
    """Attitude [rad], rate [rad/s] and wheel momentum [N m s] about one axis."""
    A = np.zeros((7, 7))
    A[0, 1] = 1
    A[1, 0], A[1, 4] = -KD * KP, -KD
    A[2, 3], A[3, 2], A[3, 3], A[3, 1] = 1, -(WF**2), -2 * ZF * WF, WF**2
    A[4, 5], A[5, 4], A[5, 5], A[5, 2] = 1, -(WF**2), -2 * ZF * WF, WF**2
    A[6, 0], A[6, 4] = inertia * KD * KP, inertia * KD
    dt = t[1] - t[0]
    M = np.zeros((9, 9))
    M[:7, :7], M[1, 7], M[7, 8] = A * dt, dt / inertia, 1.0
    E = linalg.expm(M)
    x = np.zeros((len(t), 7))
    for k in range(len(t) - 1):
        x[k + 1] = E[:7, :7] @ x[k] + E[:7, 7] * torque[k] + E[:7, 8] * (torque[k + 1] - torque[k])
    return x[:, 0], x[:, 1], x[:, 6]


def telemetry(t, attitude, rate, momentum, *, rng=None, offset=(60.0, -45.0, 30.0)):
    """Y-axis motion as Cassini telemetry: wheels and rates every 4 s, attitude error every 2 s."""
    epoch = utc_to_tai_ns("2015-09-29T00:00:00")
    dt = t[1] - t[0]

    def channel(name, every, values, noise=0.0):
        step = round(every / dt)
        v = values[::step].copy()
        if rng is not None and noise:
            v += noise * rng.normal(size=len(v))
        ns = epoch + np.rint(t[::step] * NS).astype(np.int64)
        return Channel(name, ns, v, np.ones(len(v), bool))

    h = np.column_stack([np.zeros_like(t), momentum, np.zeros_like(t)])
    rates = np.linalg.solve(AXES.T * SPIN, h.T).T
    channels = [
        channel(f"wheel_rate_{n}", 4, rates[:, k] + offset[k], 0.005) for k, n in enumerate(("RWA1", "RWA2", "RWA4"))
    ]
    for a, on in (("x", 0.0), ("y", 1.0), ("z", 0.0)):
        channels += [
            channel(f"body_rate_{a}", 4, on * rate, 2e-6),
            channel(f"attitude_error_{a}", 2, -on * attitude, 5e-6),
        ]
    return Telemetry({c.name: c for c in channels}, epoch)


def flown(profile, inertia=5226.0, noise=None):
    """Profile 1 or 2 of 000 section VI: telemetry, times, torque, peaks [(time, torque)]."""
    t = np.arange(0, 480 + 1e-9, 0.125)
    rise, amplitude = {1: (30.0, 0.0198), 2: (15.0, 0.0197)}[profile]
    torque, centres = triangles(t, rise, amplitude)
    tlm = telemetry(t, *respond(t, torque, inertia), rng=noise)
    return tlm, t, torque, [(c, (-1) ** k * amplitude) for k, c in enumerate(centres)]
