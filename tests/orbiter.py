"""A craft in low orbit for tests of the environment's torques: attitude is prescribed, so its wheels hold what the torques bring.

Nothing of asflown's simulator or of its environment's laws is used: the torques are written out here.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.spatial.transform import Rotation

from asflown.craft.load import load_craft
from asflown.kit.timeline import utc_to_tai_ns
from flights import telemetry_of

MU, R_EARTH = 3.986004418e14, 6.378137e6
INERTIA = np.array([[9.2, 0.2, -0.1], [0.2, 11.5, 0.15], [-0.1, 0.15, 13.0]])
AXES4 = np.array([[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]) / np.sqrt(3)
SPIN = 4e-4
EPOCH_NS = utc_to_tai_ns("2026-06-21T03:00:00")


@dataclass
class Flight:
    """What acts; everything drawn by ``drawn``."""

    seed: int = 0
    span_s: float = 3600.0
    step_s: float = 0.5
    height_m: float = 520e3
    inclination_deg: float = 97.5
    node_deg: float = 40.0
    argument_deg: float = 0.0
    sun: tuple = (0.3, 0.86, 0.41)
    dipole: np.ndarray = field(default_factory=lambda: np.array([0.2, -0.3, 0.25]))
    sunlight: np.ndarray = field(default_factory=lambda: np.array([3e-6, -2e-6, 1.2e-5]))
    drag: np.ndarray = field(default_factory=lambda: np.array([1e-6, 7e-6, -8e-6]))
    swing: float = 0.35
    swing_phase: float = 1.0
    second: float = 0.0  # the density's second harmonic, which the model has not
    constant: np.ndarray = field(default_factory=lambda: np.zeros(3))
    inertia_error: float = 0.01
    gyro: float = 8e-6  # rad/s a sample
    rms_deg: float = 0.02  # of the attitude about nadir


def drawn(seed: int, **changes) -> Flight:
    """Levers, orbit, Sun and density of a seed."""
    rng = np.random.default_rng(1000 + seed)
    sun = rng.standard_normal(3)
    return Flight(
        **{
            "seed": seed, "height_m": rng.uniform(450e3, 600e3), "inclination_deg": rng.uniform(50, 100),
            "node_deg": rng.uniform(0, 360), "argument_deg": rng.uniform(0, 360), "sun": tuple(sun / np.linalg.norm(sun)),
            "dipole": rng.normal(0, 0.25, 3), "sunlight": rng.normal(0, 8e-6, 3), "drag": rng.normal(0, 7e-6, 3),
            "swing": rng.uniform(0.1, 0.6), "swing_phase": rng.uniform(0, 2 * np.pi), **changes,
        }
    )  # fmt: skip


def orbit(f: Flight, t):
    r = R_EARTH + f.height_m
    u = np.radians(f.argument_deg) + np.sqrt(MU / r**3) * t
    turn = Rotation.from_euler("ZX", np.radians([f.node_deg, f.inclination_deg]))
    speed = np.sqrt(MU / r)
    return r * turn.apply(np.stack([np.cos(u), np.sin(u), 0 * u], 1)), speed * turn.apply(
        np.stack([-np.sin(u), np.cos(u), 0 * u], 1)
    )


def field_N(r):
    """A dipole along the pole, tilted by 10 degrees. [T]"""
    m = Rotation.from_euler("x", 10, degrees=True).apply([0, 0, -1.0]) * 7.8e15
    size = np.linalg.norm(r, axis=1, keepdims=True)
    n = r / size
    return (3 * n * (n @ m)[:, None] - m) / size**3


def light(r, sun):
    """Share of the Sun, a linear penumbra of 0.53 degrees. (N,)"""
    size = np.linalg.norm(r, axis=1)
    off = np.degrees(np.arccos(np.clip(-(r @ sun) / size, -1, 1)) - np.arcsin(R_EARTH / size))
    return np.clip(0.5 + off / 0.53, 0, 1)


def attitude(f: Flight, t, r, v, rng):
    """Nadir with slow wobbles of some hundredths of a degree."""
    z = -r / np.linalg.norm(r, axis=1, keepdims=True)
    y = -np.cross(r, v)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    lvlh = Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=2))
    off = sum(
        rng.normal(0, np.radians(f.rms_deg) / 2, 3) * np.sin(2 * np.pi * t / p + rng.uniform(0, 6.28, 3)[:, None]).T
        for p in rng.uniform(60, 900, 4)
    )
    return lvlh * Rotation.from_rotvec(off)


def torques(f: Flight, t, r, v, q):
    """By name, body axes (N, 3)."""
    s, B = q.inv().apply(np.tile(f.sun, (len(r), 1))), q.inv().apply(field_N(r))
    r_B, w = q.inv().apply(r), q.inv().apply(-v / np.linalg.norm(v, axis=1, keepdims=True))
    lit = light(r, np.array(f.sun))
    n = np.sqrt(MU / (R_EARTH + f.height_m) ** 3)
    rho = 1 + f.swing * np.cos(n * t - f.swing_phase) + f.second * np.cos(2 * n * t + 1)
    return (
        {
            "gravity-gradient": 3 * MU / (R_EARTH + f.height_m) ** 5 * np.cross(r_B, r_B @ INERTIA),
            "dipole": np.cross(f.dipole, B),
            "sunlight": lit[:, None] * np.cross(f.sunlight, s),
            "drag": rho[:, None] * np.cross(f.drag, w),
            "constant": np.tile(f.constant, (len(r), 1)),
        },
        B,
        s,
        lit,
    )


def fly(f: Flight):
    """Telemetry, craft, and the torques by name (N, 3)."""
    rng = np.random.default_rng(f.seed)
    t = np.arange(0.0, f.span_s + f.step_s / 2, f.step_s)
    r, v = orbit(f, t)
    q = attitude(f, t, r, v, rng)
    acting, B, s, lit = torques(f, t, r, v, q)
    h = 0.01
    later, sooner = orbit(f, t + h), orbit(f, t - h)
    state = rng.bit_generator.state
    rng2 = np.random.default_rng(f.seed)
    qa = attitude(f, t + h, *later, rng2)
    rng2 = np.random.default_rng(f.seed)
    qb = attitude(f, t - h, *sooner, rng2)
    rng.bit_generator.state = state
    w = (qb.inv() * qa).as_rotvec() / (2 * h)
    H_N = cumulative_simpson(q.apply(sum(acting.values())), x=t, axis=0, initial=0)
    h_w = q.inv().apply(H_N + q[0].apply([0.01, -0.02, 0.015])) - w @ INERTIA
    null = np.array([1.0, -1.0, 1.0, -1.0])
    rates = h_w @ np.linalg.pinv(AXES4 * SPIN) + 180.0 * null
    quaternion = (q * Rotation.from_rotvec(rng.normal(0, 1e-5, (len(t), 3)))).as_quat()
    made = {f"wheel_rate_RW{k + 1}": (t, np.round(rates[:, k] / 0.0105) * 0.0105) for k in range(4)}
    made |= {f"quaternion_{m}": (t, quaternion[:, k]) for k, m in enumerate("xyzw")}
    seen = np.where(lit[:, None] > 0.5, s + rng.normal(0, 0.005, s.shape), 0.0)
    seen = np.where(lit[:, None] > 0.5, seen / np.maximum(np.linalg.norm(seen, axis=1, keepdims=True), 1e-9), 0.0)
    for j, a in enumerate("xyz"):
        made[f"body_rate_{a}"] = (t, w[:, j] + 3e-6 * (j - 1) + rng.normal(0, f.gyro, len(t)))
        made[f"orbit_position_{a}"], made[f"orbit_velocity_{a}"] = (t, r[:, j]), (t, v[:, j])
        made[f"magnetic_field_{a}"] = (t, B[:, j] + rng.normal(0, 2e-8, len(t)))
        made[f"sun_direction_{a}"] = (t, seen[:, j])
    known = INERTIA * (1 + f.inertia_error * np.diag(rng.standard_normal(3)))
    known = 0.5 * (known + known.T)
    return telemetry_of(EPOCH_NS, **made), craft_of(known), acting


def craft_of(inertia, more: str = ""):
    from pathlib import Path
    from tempfile import mkdtemp

    I = inertia  # noqa: E741
    six = " ".join(f"{v:.8g}" for v in (I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]))
    text = [
        'name = "orbiter"',
        "[[mass_properties]]",
        'date = "2026-01-01"',
        'piece = "flight"',
        'basis = "estimated"',
        f'inertia = "{six} kg m2"',
    ]
    for k, axis in enumerate(AXES4):
        text += [
            "[[wheels]]",
            f'name = "RW{k + 1}"',
            'axis = "{:.12f} {:.12f} {:.12f}"'.format(*axis),
            f'spin_inertia = "{SPIN} kg m2"',
        ]
    path = Path(mkdtemp()) / "orbiter.toml"
    path.write_text("\n".join(text) + "\n" + more)
    return load_craft(str(path))
