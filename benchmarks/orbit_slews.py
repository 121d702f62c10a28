"""Slews of a small satellite in low orbit, made from the conservation of momentum alone: for calibrating `asflown inertia`.

The body's motion is prescribed (ramps, holds and the jitter of a loop), the torques of gravity, field, sunlight and drag are added up
along it, and the four wheels hold what is left.  Nothing of the project's simulator or estimators is in it but the spacecraft's file.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy import signal
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from asflown.craft.load import load_craft
from asflown.telemetry.channels import kind_of
from asflown.telemetry.telemetry import Channel, Telemetry

MU, EARTH_M = 3.986004418e14, 6.371e6
EPOCH_NS = 826_876_837 * 10**9
STEP_S = 0.1  # of the integration
FIELD_T = 3.0e-5  # of the dipole on the equator of the Earth's surface
WHEELS = ("RW1", "RW2", "RW3", "RW4")


@dataclass
class Drawn:
    """One craft, orbit and set of sensors."""

    seed: int
    inertia: np.ndarray
    levers: dict[str, np.ndarray]  # sunlight [N m], dipole [A m2], drag [N m]
    swing: float  # of the density, by day and night
    rate: float
    angles: tuple[float, ...]
    ramp_s: float
    gap_s: float
    cadence_s: float
    noise: dict[str, float]
    modes: list[tuple[np.ndarray, float, float]] = field(default_factory=list)  # coupling, frequency [Hz], damping
    kick_Nms: float = 0.0  # about x, in the third hold

    @property
    def spin(self) -> float:
        return 4.2e-4


def drawn(seed: int, **given) -> Drawn:
    """A craft of 3 to 30 kg m2 with torques of its size, slews of 25 to 60 degrees; ``given`` in place of what is drawn."""
    rng = np.random.default_rng([seed, 20])
    size = 10 ** rng.uniform(0.5, 1.5)
    moments = size * rng.uniform(0.75, 1.25, 3)
    product = 0.02 * size * rng.standard_normal(3)
    a, b, c = product
    inertia = np.diag(moments) + np.array([[0, a, b], [a, 0, c], [b, c, 0]])
    torque = (size / 12) ** 0.75
    levers = {
        "dipole": 0.3 * torque * rng.standard_normal(3),
        "sunlight": 8e-6 * torque * rng.standard_normal(3),
        "drag": 8e-6 * torque * rng.standard_normal(3),
    }
    noise = {
        "wheel": 0.0157 * 10 ** rng.uniform(-0.3, 0.3),
        "gyro": 1e-5 * 10 ** rng.uniform(-0.5, 0.3),
        "attitude": 2e-5 * 10 ** rng.uniform(-0.3, 0.3),
        "coloured": 0.0,
    }
    made = Drawn(
        seed, inertia, levers, rng.uniform(0.1, 0.5), 10 ** rng.uniform(-2.6, -2.1), tuple(np.radians(rng.uniform(25, 60, 4))),
        rng.uniform(5, 20), rng.uniform(60, 150), 0.5, noise,
    )  # fmt: skip
    for name, value in given.items():
        setattr(made, name, value)
    return made


def craft_of(d: Drawn):
    """As the analyst describes it, with a tensor one per cent off."""
    rng = np.random.default_rng([d.seed, 21])
    near = d.inertia * (1 + 0.01 * rng.standard_normal((3, 3)))
    text = ['name = "drawn"', 'description = "drawn"', "[[mass_properties]]", 'date = "2026-01-01"', 'piece = "flight"']
    text += ['basis = "predicted"', f'inertia = "{near[0, 0]} {near[1, 1]} {near[2, 2]} {near[0, 1]} {near[0, 2]} {near[1, 2]} kg m2"', 'source = "CAD"']  # fmt: skip
    for name, axis in zip(WHEELS, _axes(), strict=True):
        text += [
            "[[wheels]]",
            f'name = "{name}"',
            f'axis = "{axis[0]} {axis[1]} {axis[2]}"',
            f'spin_inertia = "{d.spin} kg m2"',
        ]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "drawn.toml"
        path.write_text("\n".join(text))
        return load_craft(path)


def _axes() -> np.ndarray:
    return np.array([[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]) / np.sqrt(3)


def flight(d: Drawn) -> Telemetry:
    """Its telemetry: wheels, rates, quaternion, orbit, field, Sun."""
    rng = np.random.default_rng([d.seed, 22])
    t, omega, alpha = _motion(d, rng)
    turn = Rotation.from_rotvec(0.5 * (omega[1:] + omega[:-1]) * STEP_S).as_quat()
    q = np.empty((len(t), 4))
    q[0] = Rotation.random(random_state=rng).as_quat()
    for k in range(len(turn)):
        q[k + 1] = _product(q[k], turn[k])
    R = Rotation.from_quat(q)
    r, v, sun, B = _world(t, rng)
    into = R.inv()
    r_B, s_B, B_B = into.apply(r), into.apply(np.tile(sun, (len(t), 1))), into.apply(B)
    stream = -into.apply(v) / np.linalg.norm(v, axis=1, keepdims=True)
    n = np.sqrt(MU / np.linalg.norm(r[0]) ** 3)
    density = 1 + d.swing * np.cos(n * t - rng.uniform(0, 2 * np.pi))
    radius = np.linalg.norm(r_B, axis=1, keepdims=True)
    torque = 3 * MU / radius**5 * np.cross(r_B, r_B @ d.inertia)
    torque += np.cross(d.levers["sunlight"], s_B) + np.cross(d.levers["dipole"], B_B)
    torque += np.cross(d.levers["drag"], stream) * density[:, None]
    H = cumulative_trapezoid(R.apply(torque), t, axis=0, initial=0) + _first(d, rng, R[0], omega[0])
    H[t > 0.5 * (_starts(d)[2] + _stops(d)[1])] += np.array([d.kick_Nms, 0, 0])
    h = into.apply(H) - omega @ d.inertia - _swinging(d, t, alpha)
    null = np.array([1.0, -1, 1, -1]) * 150.0
    wheels = h @ np.linalg.pinv(_axes()) / d.spin + null
    return _sensed(d, rng, t, {"wheel": wheels, "omega": omega, "q": q, "r": r, "v": v, "B": B_B, "s": s_B})


def _first(d: Drawn, rng, R0: Rotation, omega0) -> np.ndarray:
    return R0.apply(omega0 @ d.inertia + 0.1 * d.spin * 150 * rng.standard_normal(3))


def _starts(d: Drawn) -> np.ndarray:
    stops = _lasts(d)
    return d.gap_s + np.concatenate([[0], np.cumsum(stops + d.gap_s)[:-1]])


def _stops(d: Drawn) -> np.ndarray:
    return _starts(d) + _lasts(d)


def _lasts(d: Drawn) -> np.ndarray:
    return np.array(d.angles) / d.rate + d.ramp_s


def _motion(d: Drawn, rng):
    t = np.arange(0.0, _stops(d)[-1] + d.gap_s, STEP_S)
    skew = rng.uniform(0.4, 1, 3) * rng.choice([-1, 1], 3)
    axes = [np.array(a, float) for a in ([1, 0, 0], [0, -1, 0], [0, 0, -1])] + [skew / np.linalg.norm(skew)]
    omega = np.zeros((len(t), 3))
    for axis, a, b in zip(axes, _starts(d), _stops(d), strict=True):
        omega += np.outer(d.rate * np.clip(np.minimum(t - a, b - t) / d.ramp_s, 0, 1), axis)
    # the loop's answer to its sensors, and its lag at the corners
    low = signal.butter(2, 0.06, fs=1 / STEP_S)
    jitter = signal.lfilter(*low, 3 * d.noise["gyro"] * rng.standard_normal((len(t), 3)), axis=0)
    omega = signal.lfilter(*low, omega, axis=0) + jitter
    return t, omega, np.gradient(omega, STEP_S, axis=0)


def _swinging(d: Drawn, t, alpha) -> np.ndarray:
    """Momentum of what swings, body axes: eta'' + 2 z W eta' + W^2 eta = -delta . alpha brings delta eta'."""
    total = np.zeros_like(alpha)
    for delta, frequency, damping in d.modes:
        W = 2 * np.pi * frequency
        system = signal.lti([1.0, 0.0], [1.0, 2 * damping * W, W**2])
        total += np.outer(signal.lsim(system, -alpha @ delta, t)[1], delta)
    return total


def _world(t, rng):
    """A circular orbit, the Sun, and a dipole field tilted by eleven degrees that turns with the Earth."""
    radius = EARTH_M + rng.uniform(4.2e5, 7.5e5)
    n = np.sqrt(MU / radius**3)
    plane = Rotation.from_euler("ZX", [rng.uniform(0, 2 * np.pi), rng.uniform(0.4, 1.75)])
    u = n * t + rng.uniform(0, 2 * np.pi)
    r = radius * plane.apply(np.stack([np.cos(u), np.sin(u), 0 * u], axis=1))
    v = radius * n * plane.apply(np.stack([-np.sin(u), np.cos(u), 0 * u], axis=1))
    sun = rng.standard_normal(3)
    turn = 7.292e-5 * t + rng.uniform(0, 2 * np.pi)
    pole = np.stack([np.sin(0.2) * np.cos(turn), np.sin(0.2) * np.sin(turn), np.full(len(t), np.cos(0.2))], axis=1)
    e = r / radius
    B = FIELD_T * (EARTH_M / radius) ** 3 * (pole - 3 * np.sum(pole * e, axis=1, keepdims=True) * e)
    return r, v, sun / np.linalg.norm(sun), B


def _sensed(d: Drawn, rng, t, true) -> Telemetry:
    every = slice(0, None, round(d.cadence_s / STEP_S))
    at = t[every]
    shape = (len(at), 3)
    count = 2 * np.pi / 600  # 0.1 rpm
    wheel = true["wheel"][every] + d.noise["wheel"] * rng.standard_normal((len(at), 4))
    wheel = count * np.round(wheel / count)
    gyro = true["omega"][every] + d.noise["gyro"] * rng.standard_normal(shape)
    off = d.noise["attitude"] * rng.standard_normal(shape)
    if d.noise["coloured"]:
        keep = np.exp(-d.cadence_s / 30.0)
        slow = signal.lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal(shape), axis=0)
        off += d.noise["coloured"] * slow
    q = (Rotation.from_quat(true["q"][every]) * Rotation.from_rotvec(off)).as_quat()
    B = true["B"][every] + 5e-8 * rng.standard_normal(shape)
    s = true["s"][every] + 4e-3 * rng.standard_normal(shape)
    columns = {f"wheel_rate_{w}": wheel[:, k] for k, w in enumerate(WHEELS)}
    columns |= {f"quaternion_{m}": q[:, k] for k, m in enumerate("xyzw")}
    for stem, values in (("body_rate", gyro), ("orbit_position", true["r"][every]), ("orbit_velocity", true["v"][every]),
                         ("magnetic_field", B), ("sun_direction", s)):  # fmt: skip
        columns |= {f"{stem}_{a}": values[:, k] for k, a in enumerate("xyz")}
    tai_ns = np.rint(at * 1e9).astype(np.int64) + EPOCH_NS
    known = np.ones(len(at), bool)
    return Telemetry({n: Channel(n, tai_ns, v, known, kind_of(n).unit) for n, v in columns.items()}, EPOCH_NS)


def _product(p, q) -> np.ndarray:
    a, b, c, w = p
    x, y, z, u = q
    return np.array([w * x + a * u + b * z - c * y, w * y - a * z + b * u + c * x, w * z + a * y - b * x + c * u, w * u - a * x - b * y - c * z])  # fmt: skip
