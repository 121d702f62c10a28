"""A satellite that no one flies, in low orbit: four wheels in a pyramid, pointed to nadir by a law of the tests' own.

Nothing here is the simulator's or the estimators': a rigid body, its wheels, a law on board, and a torque."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from asflown.craft.load import load_craft
from asflown.dynamics.magnetic_field import field_at
from asflown.dynamics.sun import sun_direction, sunlit
from asflown.kit.timeline import NS, utc_to_tai_ns
from flights import telemetry_of, with_values

EPOCH = utc_to_tai_ns("2026-05-04T06:00:00")
INERTIA = np.array([[12.4, 0.15, -0.22], [0.15, 14.1, 0.08], [-0.22, 0.08, 9.7]])
AXES = np.array([[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]) / np.sqrt(3)
SPIN = 4.2e-4  # kg m2
RADIUS = 6.871e6  # m
RATE = float(np.sqrt(3.986004418e14 / RADIUS**3))  # of the orbit [rad/s]
_INCLINATION = 1.7  # rad
_NODE = 0.9
_SETTLED_S = 150.0  # flown before the record


@dataclass(frozen=True)
class Law:
    """u = D (KD e_rate + KD KP e) [+ w x (J w + h)] [+ J w_c'], every ``period`` seconds; D is J's diagonal."""

    bandwidth_Hz: float = 0.02
    damping: float = 0.8
    gyroscopic: bool = True
    tracking: bool = True
    inertia: np.ndarray = field(default_factory=lambda: INERTIA)
    period_s: float = 0.25

    @property
    def gains(self) -> tuple[float, float]:
        w = 2 * np.pi * self.bandwidth_Hz
        return 2 * self.damping * w, w**2

    def described(self, *keys: str) -> str:
        """The table of the craft file, with some of its optional keys."""
        J = self.inertia
        elements = " ".join(f"{J[i, j]:.8g}" for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        lines = {"gyroscopic": str(self.gyroscopic).lower(), "tracking": str(self.tracking).lower(),
                 "inertia": f'"{elements} kg m2"', "period": f'"{self.period_s} s"'}  # fmt: skip
        return "\n".join(["[wheel_controller]", f'bandwidth = "{2 * np.pi * self.bandwidth_Hz:.10g} rad/s"',
                          f"damping = {self.damping}", *(f"{k} = {lines[k]}" for k in keys)]) + "\n"  # fmt: skip


def craft_file(folder: Path, controller: str = "", inertia: np.ndarray = INERTIA, more: str = "") -> Path:
    elements = " ".join(f"{inertia[i, j]:.8g}" for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    text = ['name = "orbiter"', "[[mass_properties]]", 'date = "2026-01-01"', 'piece = "flight"', 'basis = "estimated"',
            'sigma = "0.5 %"', f'inertia = "{elements} kg m2"', 'source = "test"']  # fmt: skip
    for k, a in enumerate(AXES):
        text += ["[[wheels]]", f'name = "W{k + 1}"', f'axis = "{a[0]:.12f} {a[1]:.12f} {a[2]:.12f}"', f'spin_inertia = "{SPIN} kg m2"',
                 'torque_constant = "0.05 N m / A"']  # fmt: skip
    path = folder / "orbiter.toml"
    path.write_text("\n".join(text) + "\n" + controller + more)
    return path


def craft(folder: Path, controller: str = "", **described):
    return load_craft(str(craft_file(folder, controller, **described)))


def orbit(time_s):
    """Position and velocity (N, 3), inertial axes, of a circular orbit."""
    u = RATE * np.asarray(time_s, float)[:, None]
    plane = Rotation.from_euler("ZX", [_NODE, _INCLINATION])
    along = plane.apply(np.hstack([np.cos(u), np.sin(u), 0 * u]))
    across = plane.apply(np.hstack([-np.sin(u), np.cos(u), 0 * u]))
    return RADIUS * along, RADIUS * RATE * across


def nadir(time_s) -> Rotation:
    """x along-track, y against the orbit's normal, z down -> inertial."""
    r, v = orbit(time_s)
    z, y = -r / RADIUS, -np.cross(r, v) / (RADIUS**2 * RATE)
    return Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=2))


def torque_at(time_s) -> np.ndarray:
    """(N, 3) [N m]: as of sunlight and drag, slow, with a step."""
    t = np.asarray(time_s, float)
    slow = np.column_stack([2e-5 * np.cos(RATE * t), -1e-5 * np.sin(RATE * t + 1), 1.5e-5 * np.cos(RATE * t - 0.5)])
    return slow + np.outer(t > 300, [1e-5, 0.5e-5, -1e-5])


def fly(duration_s=600.0, law: Law | None = None, seed=1, cadence_s=0.5):
    """Telemetry, and what it was made of: the torque at (N, 3) the samples' times (N,)."""
    law, step = law or Law(), 0.25
    kd, k0 = law.gains
    J, inverse, share = law.inertia, np.linalg.inv(INERTIA), np.linalg.pinv(AXES.T)
    n = int((duration_s + _SETTLED_S) / step) + 1
    t = step * np.arange(n) - _SETTLED_S
    command, given, omega_c = nadir(t).as_matrix(), torque_at(t + step / 2), np.array([0.0, -RATE, 0.0])
    R, w = command[0], omega_c.copy()
    wheel = share @ np.array([0.05, -0.03, 0.08]) + 0.15 * np.array([1.0, -1.0, 1.0, -1.0])  # momentum [N m s]
    q, rate, error, momenta = np.zeros((n, 4)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 4))
    rng = np.random.default_rng(seed)
    noise = rng.normal(0, 1, (n, 2, 3)) * np.array([[5e-6], [1e-5]])  # of rates [rad/s] and attitude [rad]
    for k in range(n):
        off = R.T @ command[k]
        e = 0.5 * np.array([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]])
        seen, e = w + noise[k, 0], e + noise[k, 1]
        rate[k], error[k], momenta[k] = seen, e, wheel
        q[k] = _quaternion(R, noise[k, 1])
        h = AXES.T @ wheel
        u = np.diag(J) * (kd * (omega_c * law.tracking - seen) + k0 * e)
        u = u + np.cross(seen, J @ seen + h) * law.gyroscopic
        turn = -share @ u  # of the wheels
        for _ in range(2):  # midpoint rule
            middle = w + 0.5 * (step / 2) * (inverse @ (given[k] + u - np.cross(w, INERTIA @ w + AXES.T @ wheel)))
            half = wheel + 0.25 * step * turn
            w = w + step / 2 * (inverse @ (given[k] + u - np.cross(middle, INERTIA @ middle + AXES.T @ half)))
            R = R @ Rotation.from_rotvec(step / 2 * middle).as_matrix()
            wheel = wheel + step / 2 * turn
    use = slice(int(_SETTLED_S / step), None, round(cadence_s / step))
    at = t[use]
    made = {f"wheel_rate_W{k + 1}": (at, _counted(momenta[use, k] / SPIN, 0.1 * np.pi / 30)) for k in range(4)}
    made |= {f"quaternion_{m}": (at, q[use, k]) for k, m in enumerate("xyzw")}
    position, velocity = orbit(at)
    for j, a in enumerate("xyz"):
        made[f"body_rate_{a}"] = at, rate[use, j]
        made[f"attitude_error_{a}"] = at, error[use, j]
        made[f"orbit_position_{a}"], made[f"orbit_velocity_{a}"] = (at, position[:, j]), (at, velocity[:, j])
    return telemetry_of(EPOCH, **made), at, torque_at(at)


def _quaternion(R, off) -> np.ndarray:
    return (Rotation.from_matrix(R) * Rotation.from_rotvec(-off)).as_quat(canonical=False)


def _counted(values, count):
    return count * np.round(values / count)


def coverage(result, at, torque) -> np.ndarray:
    """Share of instants whose 95 % band holds the truth, per axis."""
    true = np.column_stack([np.interp(result.time_s, at, torque[:, j]) for j in range(3)])
    return np.mean(np.abs(result.torque_Nm - true) <= 1.96 * result.torque_sigma_Nm, axis=0)


def pointed(duration_s=2400.0, cadence_s=4.0, turn: Rotation | None = None, seed=2, *, yawing=True):
    """Telemetry without dynamics: attitude (nadir, slowly yawing, then turned), rates, orbit, field and Sun in body axes, wheels at rest."""
    at = np.arange(0, duration_s, cadence_s)
    yaw = 0.4 * yawing * np.sin(2 * np.pi * at / 900)
    R = nadir(at) * Rotation.from_rotvec(np.outer(yaw, [0, 0, 1]))
    turn = turn or Rotation.identity()
    R = R * turn
    position, velocity = orbit(at)
    rng = np.random.default_rng(seed)
    tai_s = EPOCH / NS + at
    B_N, s_N = field_at(position, tai_s), sun_direction(tai_s)
    lit = sunlit(position, s_N)[:, None] > 0.5
    rate = turn.inv().apply(nadir_rate(at, yaw))
    vectors = {"orbit_position": position, "orbit_velocity": velocity, "body_rate": rate + 2e-6 * rng.normal(size=(len(at), 3)),
               "magnetic_field": R.inv().apply(B_N) + 1e-7 * rng.normal(size=(len(at), 3)),
               "sun_direction": lit * R.inv().apply(s_N)}  # fmt: skip
    made = {f"{n}_{a}": (at, v[:, j]) for n, v in vectors.items() for j, a in enumerate("xyz")}
    made |= {f"quaternion_{m}": (at, R.as_quat()[:, k]) for k, m in enumerate("xyzw")}
    made |= {f"wheel_rate_W{k}": (at, 100.0 + 0.01 * rng.normal(size=len(at))) for k in (1, 2, 3, 4)}
    return telemetry_of(EPOCH, **made)


def nadir_rate(at, yaw):
    """Body rates of nadir pointing turned by ``yaw`` about z."""
    back = Rotation.from_rotvec(np.outer(-yaw, [0, 0, 1]))
    return back.apply([0.0, -RATE, 0.0]) + np.outer(np.gradient(yaw, at), [0, 0, 1])


def vectors_of(telemetry, stem: str) -> np.ndarray:
    return np.column_stack([telemetry.channel(f"{stem}_{a}").values for a in "xyz"])


def with_vectors(telemetry, stem: str, values: np.ndarray):
    for j, a in enumerate("xyz"):
        telemetry = with_values(telemetry, f"{stem}_{a}", values[:, j])
    return telemetry


def attitude_of(telemetry) -> Rotation:
    return Rotation.from_quat(np.column_stack([telemetry.channel(f"quaternion_{m}").values for m in "xyzw"]))


def with_attitude(telemetry, R: Rotation):
    for k, m in enumerate("xyzw"):
        telemetry = with_values(telemetry, f"quaternion_{m}", R.as_quat()[:, k])
    return telemetry
