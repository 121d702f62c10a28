"""Equations of motion and the control cycle, integrated: every compiled kernel lives in this file.

They share one module because numba's cache does not notice a callee that changed in another file.
Everything also runs, slowly, as plain Python (without numba, or with NUMBA_DISABLE_JIT=1).

Momentum about the centre of mass, body axes, wheel rates rho relative to the body:

    H = I w + sum a_i J_i rho_i + sum delta_k eta_dot_k + h_rel,     dH/dt + w x H = T
    J_i (rho_dot_i + a_i.w_dot) = motor_i - drag_i
    eta_ddot_k + 2 z W eta_dot_k + W^2 eta_k = -delta_k.w_dot

I holds the wheels as if they did not spin, and the moving part where it is; h_rel is the moving
part's momentum relative to the body.  Wheel and mode accelerations are eliminated exactly, which
leaves a 3 x 3 system for w_dot.

Thrusters push from outside.  Each is a delay and two first-order lags (Feldman & Lee, section V), so its impulse over
any step is known exactly, and the step gets that impulse as a constant torque.

An orbiting craft also feels the world that it flies through (``World``): its place, the air's flow, the magnetic field and the
Sun are cubics in time along the orbit, and the torque laws turn them into the body's axes at every stage of a step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kit.compiled import jit

#: Coulomb drag changes sign over this rate or more (``disturbances.bearing_drag``), for a step in it cannot be integrated. [rad/s]
DRAG_REVERSAL_RATE = 0.02
#: Under thruster control a wheel's rate is brought to the one ordered with this gain. Assumed. [1/s]
WHEEL_RATE_GAIN = 0.5
#: Stiction has fallen to 1/e of its excess over Coulomb drag at this rate (Stribeck). [rad/s]
STRIBECK_RATE = 0.5


#: What an orbit's torques come from, in the order of the kernel's rows.
SOURCES = ("gravity_gradient", "sunlight", "dipole", "drag", "rods")
#: Columns of ``World.curves``, inertial axes: place from the planet's centre [m], velocity [m/s], the same through the air
#: [m/s], magnetic field [T], unit vector to the Sun, share of its disc that is seen, density of the air [kg/m3].
PLACE, SPEED, WIND, FIELD, SUN, LIT, AIR = 0, 3, 6, 9, 12, 15, 16
CURVES = 17


class World(NamedTuple):
    """The surroundings along the orbit, and what of the craft they act on; no curves where a flight has none.

    Facets stand in rows: size, normal (3), centre (3), then for sunlight the shares reflected as by a mirror and diffusely.
    Size is a sunlit facet's area times the Sun's pressure [N], a facet in the air has area times drag coefficient [m2]."""

    first: float = 0.0  # time of the first knot [s]
    step: float = 1.0  # from knot to knot [s]
    curves: np.ndarray = np.empty((4, 0, CURVES))  # cubics between knots, highest power first
    mu: float = 0.0  # of the planet, 0: no gravity gradient [m3/s2]
    dipole: np.ndarray = np.zeros(3)  # [A m2]
    sunlight_lever: np.ndarray = np.zeros(3)  # [N m]
    sunlit_facets: np.ndarray = np.empty((0, 9))
    drag_lever: np.ndarray = np.zeros(3)  # per density [N m / (kg/m3)]
    air_facets: np.ndarray = np.empty((0, 7))


class Plant(NamedTuple):
    """What moves.  Arrays only, so that kernels take it whole; empty arrays where there is nothing."""

    fixed_inertia: np.ndarray  # (3, 3), without the moving part where there is one
    wheel_axes: np.ndarray  # (n, 3)
    spin_inertia: np.ndarray  # (n,)
    drag: np.ndarray  # (n, 4): viscous, Coulomb, stiction, rate over which the sign changes
    coupling: np.ndarray  # (m, 3), delta
    mode_damping: np.ndarray  # (m,), 2 z W
    mode_stiffness: np.ndarray  # (m,), W^2
    torque_time: np.ndarray  # (k,), external torque, linear between, held outside
    torque: np.ndarray  # (k, 3)
    hinge_axis: np.ndarray  # (3,)
    hinge: np.ndarray  # (3,), from the rest's centre of mass
    arm: np.ndarray  # (3,), hinge to the moving part's centre of mass at angle 0
    part_inertia: np.ndarray  # (3, 3), its own, at angle 0
    reduced_mass: float
    motion_time: np.ndarray  # (b + 1,); (0,) without a moving part
    motion_angle: np.ndarray  # (5, b), quartics, highest power first
    extra_drag_time: np.ndarray = np.empty(0)  # (s,), drag spikes, linear between, zero at its ends; (0,) without any
    extra_drag: np.ndarray = np.empty((0, 0))  # (s, n), opposing each wheel's rate
    world: World = World()


class Loop(NamedTuple):
    """The flight software's numbers, per control cycle."""

    period: float
    substeps: int
    kp: float
    kd: float
    inertia: np.ndarray  # (3, 3), as the controller believes it
    filter_a: np.ndarray  # (2, 2), one section, discrete
    filter_b: np.ndarray  # (2,)
    filter_c: np.ndarray  # (2,)
    filter_d: float
    delay_cycles: int
    gyroscopic_feedforward: bool
    acceleration_feedforward: bool
    tracking: bool  # the rate's error is against the commanded rate, else against none
    turning: np.ndarray  # (N,), which of the sets of wheels below turns the craft in each cycle
    axes_inverse: np.ndarray  # (p, n, 3), pseudo-inverse of a set's axes, zero rows for wheels not in it
    from_outside: np.ndarray  # (p,) bool, what a coasting wheel would have given comes from outside
    null_space: np.ndarray  # (p, n, n), projector on torques that cancel on the body, times their gain [1/s]
    null_rate: np.ndarray  # (n,), to which wheels are brought in the null space [rad/s]
    null_limit: float  # largest torque of a wheel for it [N m]
    torque_limit: np.ndarray  # (n,)
    rate_limit: np.ndarray  # (n,)
    friction_kp: float  # [1/s], 0: no compensation
    friction_ki: float  # [1/s^2]


class Errors(NamedTuple):
    """Every random number of a flight, drawn beforehand; one row a cycle."""

    gyro: np.ndarray  # (N, 3), rate error, bias included
    start: np.ndarray  # (3,), attitude estimation error at the start
    star_tracker: np.ndarray  # (N, 3)
    star_tracker_every: int  # cycles
    star_tracker_gain: float
    tachometer: np.ndarray  # (N, n)
    magnetometer: np.ndarray = np.empty((0, 3))  # (N, 3), bias included; no rows without an orbit [T]


class Rods(NamedTuple):
    """Torque rods and the law by which they unload the wheels; no rows where a flight has none."""

    axes: np.ndarray = np.empty((0, 3))  # (r, 3)
    axes_inverse: np.ndarray = np.empty((0, 3))  # (r, 3)
    limit: np.ndarray = np.empty(0)  # (r,) [A m2]
    gain: float = 0.0  # [1/s]
    target: np.ndarray = np.zeros(3)  # stored momentum to be kept, body axes [N m s]
    every: int = 1  # cycles from one order to the next
    acting: int = 1  # of these, in which the rods are on


class Thrusters(NamedTuple):
    """Thrusters and what is ordered of them; no rows where a flight has none.  N counts cycles, j thrusters."""

    in_control: np.ndarray  # (N,) bool, they hold the attitude, and the wheels' rates are ordered; else the wheels do
    arms: np.ndarray  # (j, 3), torque about the centre of mass per newton [m]
    steady: np.ndarray  # (N, j), what a pulse that starts in this cycle rises to [N]
    leak: np.ndarray  # (N, j), thrust whatever is ordered [N]
    delay: np.ndarray  # (j,), from an order to the valve's moving; shorter than a cycle [s]
    rise: np.ndarray  # (2, j), time constants of a hot and of a cold catalyst bed [s]
    fall: np.ndarray  # (2, j)
    heating: float  # time constants of the beds themselves, firing and not [s]
    cooling: float
    serves: np.ndarray  # (j, 3): 1 or -1 where a thruster is fired for torque about that axis, else 0
    lead: float  # seconds of rate that count as angle
    approach_rate: float  # back to the deadband from far away [rad/s]
    hysteresis: float  # how far inside the deadband firing ends [rad]
    deadband: np.ndarray  # (1 + b, 3), between burns and in each of them [rad]
    burn_start: np.ndarray  # (b,), cycle
    burn_on_time: np.ndarray  # (b,), over all that burn, after which the burn is over [s]
    burns: np.ndarray  # (j,) bool, fired in a burn unless the attitude forbids
    spin_order: np.ndarray  # (N, n), rates the wheels are on their way to; nan: stay [rad/s]
    spin_cycles: np.ndarray  # (N, n), how many cycles are left for it


@jit
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@jit
def _solve3(m, b, out):
    """Symmetric 3 x 3 by cofactors."""
    c00 = m[1, 1] * m[2, 2] - m[1, 2] * m[1, 2]
    c01 = m[0, 2] * m[1, 2] - m[0, 1] * m[2, 2]
    c02 = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
    c11 = m[0, 0] * m[2, 2] - m[0, 2] * m[0, 2]
    c12 = m[0, 1] * m[0, 2] - m[0, 0] * m[1, 2]
    c22 = m[0, 0] * m[1, 1] - m[0, 1] * m[0, 1]
    det = m[0, 0] * c00 + m[0, 1] * c01 + m[0, 2] * c02
    out[0] = (c00 * b[0] + c01 * b[1] + c02 * b[2]) / det
    out[1] = (c01 * b[0] + c11 * b[1] + c12 * b[2]) / det
    out[2] = (c02 * b[0] + c12 * b[1] + c22 * b[2]) / det


@jit
def drag_torque(rate, viscous, coulomb, stiction, reversal):
    """Bearing drag opposing the rate: viscous, Coulomb, and stiction that fades (Stribeck). [N m]

    The sign change at rest is a tanh over ``reversal``: a wheel 'sticks' as a slow creep."""
    excess = (stiction - coulomb) * np.exp(-((rate / STRIBECK_RATE) ** 2)) if stiction > coulomb else 0.0
    return viscous * rate + (coulomb + excess) * np.tanh(rate / reversal)


@jit
def world_at(t, world, out):
    """Row of the curves at an instant; the first and last cubic hold beyond the ends."""
    x = (t - world.first) / world.step
    k = min(max(int(np.floor(x)), 0), world.curves.shape[1] - 1)
    u = (x - k) * world.step
    c = world.curves
    for i in range(len(out)):
        out[i] = ((c[0, k, i] * u + c[1, k, i]) * u + c[2, k, i]) * u + c[3, k, i]


@jit
def _to_body(q, v, out):
    """An inertial vector in body axes: R(q)^T v."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    x, y, z = v[0], v[1], v[2]
    out[0] = (a * a + b * b - c * c - d * d) * x + 2 * (b * c + a * d) * y + 2 * (b * d - a * c) * z
    out[1] = 2 * (b * c - a * d) * x + (a * a - b * b + c * c - d * d) * y + 2 * (c * d + a * b) * z
    out[2] = 2 * (b * d + a * c) * x + 2 * (c * d - a * b) * y + (a * a - b * b - c * c + d * d) * z


@jit
def _to_inertial(q, v, out):
    """A body vector in inertial axes: R(q) v."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    x, y, z = v[0], v[1], v[2]
    out[0] = (a * a + b * b - c * c - d * d) * x + 2 * (b * c - a * d) * y + 2 * (b * d + a * c) * z
    out[1] = 2 * (b * c + a * d) * x + (a * a - b * b + c * c - d * d) * y + 2 * (c * d - a * b) * z
    out[2] = 2 * (b * d - a * c) * x + 2 * (c * d + a * b) * y + (a * a - b * b - c * c + d * d) * z


@jit
def outside_torques(t, q, inertia, rods, world, out):
    """Torque on the body from each of SOURCES, body axes.  (5, 3) [N m]   ``rods``: their dipole (3,) [A m2]

    gravity gradient  3 mu / r^5  r x (I r)                    sunlight  lit x (lever x s), or of facets
    dipole, rods      m x B                                    drag      density x (lever x -v/|v|), or of facets

    A sunlit facet feels -P A cos [(1 - mirror) s + 2 (mirror cos + diffuse / 3) n] where cos = n.s > 0 (Wertz 1978, eq 17-27),
    one in the air -1/2 rho v^2 C A cos v/|v| where cos = n.v/|v| > 0 (eq 17-57).  No facet shades another."""
    row, r, v, B, s = np.empty(CURVES), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    moment, force, lever = np.empty(3), np.empty(3), np.empty(3)
    world_at(t, world, row)
    _to_body(q, row[PLACE : PLACE + 3], r)
    _to_body(q, row[WIND : WIND + 3], v)
    _to_body(q, row[FIELD : FIELD + 3], B)
    _to_body(q, row[SUN : SUN + 3], s)
    for i in range(3):
        moment[i] = inertia[i, 0] * r[0] + inertia[i, 1] * r[1] + inertia[i, 2] * r[2]
    distance2 = r[0] ** 2 + r[1] ** 2 + r[2] ** 2
    speed = np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    pull = 3 * world.mu / (distance2 * distance2 * np.sqrt(distance2))
    _cross(r, moment, out[0])
    _cross(world.sunlight_lever, s, out[1])
    _cross(world.dipole, B, out[2])
    _cross(world.drag_lever, v, out[3])
    _cross(rods, B, out[4])
    for i in range(3):
        out[0, i] *= pull
        out[1, i] *= row[LIT]
        out[3, i] *= -row[AIR] / speed if speed > 0.0 else 0.0
    for k in range(len(world.sunlit_facets)):
        f = world.sunlit_facets[k]
        cosine = f[1] * s[0] + f[2] * s[1] + f[3] * s[2]
        if cosine <= 0.0:
            continue
        for i in range(3):
            along = (1 - f[7]) * s[i] + 2 * (f[7] * cosine + f[8] / 3) * f[1 + i]
            force[i] = -row[LIT] * f[0] * cosine * along
            lever[i] = f[4 + i]
        _cross(lever, force, moment)
        out[1] += moment
    for k in range(len(world.air_facets)):
        f = world.air_facets[k]
        cosine = (f[1] * v[0] + f[2] * v[1] + f[3] * v[2]) / speed if speed > 0.0 else 0.0
        if cosine <= 0.0:
            continue
        for i in range(3):
            force[i] = -0.5 * row[AIR] * speed * f[0] * cosine * v[i]
            lever[i] = f[4 + i]
        _cross(lever, force, moment)
        out[3] += moment


@jit
def outside_history(times, attitudes, rods, inertia, world):
    """Torques of all SOURCES at instants, body axes (N, 5, 3) [N m]; ``rods`` (N, 3) [A m2], ``inertia`` (3, 3)."""
    out = np.empty((len(times), len(SOURCES), 3))
    for i in range(len(times)):
        outside_torques(times[i], attitudes[i], inertia, rods[i], world, out[i])
    return out


@jit
def table_at(t, times, values, out):
    """Row of a table at an instant: linear between the table's own, held before and after; zero without any."""
    n = len(times)
    if n == 0:
        out[:] = 0.0
        return
    j = np.searchsorted(times, t)
    if j == 0:
        out[:] = values[0]
    elif j == n:
        out[:] = values[n - 1]
    else:
        x = (t - times[j - 1]) / (times[j] - times[j - 1])
        for i in range(len(out)):
            out[i] = (1 - x) * values[j - 1, i] + x * values[j, i]


@jit
def moving_part_motion(t, times, quartic):
    """Angle, rate and acceleration of the moving part: quartics between breaks, at rest outside."""
    last = len(times) - 1
    if t < times[0]:
        return quartic[4, 0], 0.0, 0.0
    j = min(np.searchsorted(times, t, side="right") - 1, last - 1)
    x = min(t, times[last]) - times[j]
    a, b, c, d, e = quartic[0, j], quartic[1, j], quartic[2, j], quartic[3, j], quartic[4, j]
    angle = (((a * x + b) * x + c) * x + d) * x + e
    if t > times[last]:
        return angle, 0.0, 0.0
    return angle, ((4 * a * x + 3 * b) * x + 2 * c) * x + d, (12 * a * x + 6 * b) * x + 2 * c


@jit
def moving_part(t, plant):
    """Inertia (3, 3) of a part turning about a hinge, its slope in time, and h_rel (3,) with its slope.

    mu = m_c m_s / (m_c + m_s) and r from the rest's centre of mass to the part's:
    I = C + mu (r.r 1 - r r^T),  h_rel = (C k + mu r x r') phi_dot,  C = R(phi) C_0 R(phi)^T."""
    angle, rate, acceleration = moving_part_motion(t, plant.motion_time, plant.motion_angle)
    k, mu = plant.hinge_axis, plant.reduced_mass
    K = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    R = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * np.dot(K, K)
    C = np.dot(np.dot(R, plant.part_inertia), np.ascontiguousarray(R.T))
    dC = np.dot(K, C) - np.dot(C, K)
    arm = np.dot(R, plant.arm)
    r, dr = plant.hinge + arm, np.dot(K, arm)
    ddr = np.dot(K, dr)
    swept, dswept = np.empty(3), np.empty(3)
    _cross(r, dr, swept)
    _cross(r, ddr, dswept)
    inertia, slope = np.empty((3, 3)), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            inertia[i, j] = C[i, j] - mu * r[i] * r[j]
            slope[i, j] = dC[i, j] - mu * (dr[i] * r[j] + r[i] * dr[j])
        inertia[i, i] += mu * np.dot(r, r)
        slope[i, i] += 2 * mu * np.dot(r, dr)
    g, dg = np.dot(C, k) + mu * swept, np.dot(dC, k) + mu * dswept
    return inertia, slope * rate, g * rate, dg * rate**2 + g * acceleration


@jit
def moving_part_history(times, rates, plant):
    """At each instant: angle (N,), momentum of the moving part with the body's rate (N, 3), reaction torque (N, 3)."""
    angle, momentum, reaction = np.empty(len(times)), np.empty((len(times), 3)), np.empty((len(times), 3))
    for i in range(len(times)):
        inertia, _, h_rel, h_rel_dot = moving_part(times[i], plant)
        angle[i] = moving_part_motion(times[i], plant.motion_time, plant.motion_angle)[0]
        momentum[i] = h_rel
        for j in range(3):
            for k in range(3):
                momentum[i, j] += inertia[j, k] * rates[i, k]
            reaction[i, j] = -h_rel_dot[j]
    return angle, momentum, reaction


@jit
def _derivative(t, x, motor, outside, rods, plant, dx):
    """State: q (4), w (3), rho (n), eta (m), eta_dot (m), then the energy ledger of four: work by the
    external torque, work by the motors, loss in the bearings, loss in the modes [J]; in an orbit then the impulse of each of
    SOURCES in inertial axes (15) [N m s]."""
    n, m = len(plant.spin_inertia), len(plant.mode_damping)
    w, rho = x[4:7], x[7 : 7 + n]
    eta, eta_dot = x[7 + n : 7 + n + m], x[7 + n + m : 7 + n + 2 * m]
    ledger = dx[7 + n + 2 * m :]

    q0, q1, q2, q3 = x[0], x[1], x[2], x[3]
    dx[0] = -0.5 * (q1 * w[0] + q2 * w[1] + q3 * w[2])
    dx[1] = 0.5 * (q0 * w[0] + q2 * w[2] - q3 * w[1])
    dx[2] = 0.5 * (q0 * w[1] + q3 * w[0] - q1 * w[2])
    dx[3] = 0.5 * (q0 * w[2] + q1 * w[1] - q2 * w[0])

    torque, gyroscopic, H, right = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    table_at(t, plant.torque_time, plant.torque, torque)
    torque += outside
    ledger[0] = torque[0] * w[0] + torque[1] * w[1] + torque[2] * w[2]
    mass = plant.fixed_inertia.copy()
    H[:] = 0.0
    right[:] = torque
    if len(plant.motion_time) > 0:
        inertia, slope, h_rel, h_rel_dot = moving_part(t, plant)
        mass += inertia
        for i in range(3):
            H[i] += h_rel[i]
            right[i] -= h_rel_dot[i] + slope[i, 0] * w[0] + slope[i, 1] * w[1] + slope[i, 2] * w[2]
    for i in range(3):
        H[i] += mass[i, 0] * w[0] + mass[i, 1] * w[1] + mass[i, 2] * w[2]
    if plant.world.curves.shape[1] > 0:
        felt = np.empty((len(SOURCES), 3))
        outside_torques(t, x[:4], mass, rods, plant.world, felt)
        for k in range(len(SOURCES)):
            _to_inertial(x[:4], felt[k], ledger[4 + 3 * k : 7 + 3 * k])
            for i in range(3):
                right[i] += felt[k, i]
                ledger[0] += felt[k, i] * w[i]

    ledger[1] = 0.0
    ledger[2] = 0.0
    ledger[3] = 0.0
    spikes = len(plant.extra_drag_time) > 0
    extra = np.zeros(n if spikes else 0)
    if spikes:
        table_at(t, plant.extra_drag_time, plant.extra_drag, extra)
    for k in range(n):
        J, a = plant.spin_inertia[k], plant.wheel_axes[k]
        drag = drag_torque(rho[k], plant.drag[k, 0], plant.drag[k, 1], plant.drag[k, 2], plant.drag[k, 3])
        if spikes:
            drag += extra[k] * np.tanh(rho[k] / plant.drag[k, 3])
        dx[7 + k] = (motor[k] - drag) / J
        ledger[1] += motor[k] * rho[k]
        ledger[2] += drag * rho[k]
        for i in range(3):
            H[i] += J * rho[k] * a[i]
            right[i] -= (motor[k] - drag) * a[i]
            for j in range(3):
                mass[i, j] -= J * a[i] * a[j]
    for k in range(m):
        restoring = plant.mode_damping[k] * eta_dot[k] + plant.mode_stiffness[k] * eta[k]
        ledger[3] += plant.mode_damping[k] * eta_dot[k] ** 2
        dx[7 + n + k] = eta_dot[k]
        dx[7 + n + m + k] = -restoring
        for i in range(3):
            d = plant.coupling[k, i]
            H[i] += d * eta_dot[k]
            right[i] += d * restoring
            for j in range(3):
                mass[i, j] -= d * plant.coupling[k, j]

    _cross(w, H, gyroscopic)
    for i in range(3):
        right[i] -= gyroscopic[i]
    w_dot = dx[4:7]
    _solve3(mass, right, w_dot)
    for k in range(n):
        a = plant.wheel_axes[k]
        dx[7 + k] -= a[0] * w_dot[0] + a[1] * w_dot[1] + a[2] * w_dot[2]
    for k in range(m):
        d = plant.coupling[k]
        dx[7 + n + m + k] -= d[0] * w_dot[0] + d[1] * w_dot[1] + d[2] * w_dot[2]


@jit
def advance(t, x, motor, outside, rods, plant, step, steps, work):
    """``steps`` Runge-Kutta steps of fourth order, the motor torques (n,), a torque on the body from ``outside`` (3,) and the
    dipole of the ``rods`` (3,) held; ``work`` is (5, len(x))."""
    k1, k2, k3, k4, y = work[0], work[1], work[2], work[3], work[4]
    for s in range(steps):
        ts = t + s * step
        _derivative(ts, x, motor, outside, rods, plant, k1)
        y[:] = x + 0.5 * step * k1
        _derivative(ts + 0.5 * step, y, motor, outside, rods, plant, k2)
        y[:] = x + 0.5 * step * k2
        _derivative(ts + 0.5 * step, y, motor, outside, rods, plant, k3)
        y[:] = x + step * k3
        _derivative(ts + step, y, motor, outside, rods, plant, k4)
        x += step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        # rounding and truncation only (below 1e-12 a step): momentum does not depend on it
        x[:4] /= np.sqrt(x[0] ** 2 + x[1] ** 2 + x[2] ** 2 + x[3] ** 2)


@jit
def _attitude_error(q, offset, q_c, out):
    """Commanded minus estimated, as a rotation vector; the estimate is q turned by the small ``offset``."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    x, y, z = 0.5 * offset[0], 0.5 * offset[1], 0.5 * offset[2]
    e0, e1 = a - b * x - c * y - d * z, b + a * x + c * z - d * y
    e2, e3 = c + a * y + d * x - b * z, d + a * z + b * y - c * x
    p0 = e0 * q_c[0] + e1 * q_c[1] + e2 * q_c[2] + e3 * q_c[3]
    out[0] = e0 * q_c[1] - e1 * q_c[0] - e2 * q_c[3] + e3 * q_c[2]
    out[1] = e0 * q_c[2] - e2 * q_c[0] - e3 * q_c[1] + e1 * q_c[3]
    out[2] = e0 * q_c[3] - e3 * q_c[0] - e1 * q_c[2] + e2 * q_c[1]
    size = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    if size > 0.0:
        # q and -q are one attitude: take the short way round
        angle = 2 * np.arctan2(size, abs(p0))
        out *= angle / size if p0 >= 0 else -angle / size


@jit
def settle(thrust, towards, lag, duration):
    """Thrust after a first-order approach, and its impulse on the way. [N], [N s]"""
    left = (towards - thrust) * np.exp(-duration / lag) if lag > 0.0 else 0.0
    return towards - left, towards * duration - lag * (towards - thrust - left)


@jit
def impulses(thrusters, cycle, on, was_on, level, chill, thrust, start, stop, out):
    """Impulse (j,) of each thruster between two moments of a cycle, counted from its start; ``thrust`` moves on. [N s]

    Until the order is felt the valve does what it was told a cycle ago, but one told to close holds its thrust, as Feldman & Lee
    (section V) say.  A lone pulse of D then gives, with E = exp(-(D - delay) / rise),

        J / F = D + fall - rise + (rise - delay - fall) E"""
    for k in range(len(thrust)):
        rise = thrusters.rise[0, k] + chill[k] * (thrusters.rise[1, k] - thrusters.rise[0, k])
        fall = thrusters.fall[0, k] + chill[k] * (thrusters.fall[1, k] - thrusters.fall[0, k])
        felt = min(max(thrusters.delay[k], start), stop)
        before = 0.0
        if was_on[k] and on[k]:
            thrust[k], before = settle(thrust[k], level[k], rise, felt - start)
        elif was_on[k]:
            before = thrust[k] * (felt - start)
        else:
            thrust[k], before = settle(thrust[k], 0.0, fall, felt - start)
        if on[k]:
            thrust[k], after = settle(thrust[k], level[k], rise, stop - felt)
        else:
            thrust[k], after = settle(thrust[k], 0.0, fall, stop - felt)
        out[k] = before + after + thrusters.leak[cycle, k] * (stop - start)


@jit
def _order_rods(rods, field, stored, dipole):
    """Dipole (3,) that takes away stored momentum: m = k (h - target) x B / B^2 (Markley and Crassidis 2014, section 7.5).

    m x B = -k (h - target) across the field.  All rods are weakened alike where one would exceed its limit."""
    excess, wanted = np.empty(3), np.empty(3)
    size2 = field[0] ** 2 + field[1] ** 2 + field[2] ** 2
    for i in range(3):
        excess[i] = stored[i] - rods.target[i]
    _cross(excess, field, wanted)
    strength, most = np.zeros(len(rods.limit)), 1.0
    for k in range(len(strength)):
        for i in range(3):
            strength[k] += rods.axes_inverse[k, i] * rods.gain * wanted[i] / size2
        most = max(most, abs(strength[k]) / rods.limit[k])
    dipole[:] = 0.0
    for k in range(len(strength)):
        for i in range(3):
            dipole[i] += rods.axes[k, i] * strength[k] / most


@jit
def _null_space_torque(loop, set_of_wheels, rates, spin_inertia, out):
    """Motor torques (n,) that bring the wheels to their rates and cancel on the body, none beyond the limit. [N m]"""
    most = 0.0
    for k in range(len(out)):
        out[k] = 0.0
        for j in range(len(out)):
            out[k] += loop.null_space[set_of_wheels, k, j] * spin_inertia[j] * (loop.null_rate[j] - rates[j])
        most = max(most, abs(out[k]))
    if most > loop.null_limit:
        out *= loop.null_limit / most


@jit
def _order_pulses(thrusters, e, rate_error, burn, push, on):
    """Which thrusters fire for a cycle: outside the deadband those that push back, in a burn all that may.

    ``push`` (3,) has the sense about each axis from one cycle to the next, for hysteresis.  A thruster that serves two
    axes at odds stays off, or in a burn on."""
    for i in range(3):
        edge = thrusters.deadband[burn + 1, i]
        near = edge + thrusters.lead * thrusters.approach_rate  # from farther off it comes no faster
        beyond = min(max(e[i], -near), near) + thrusters.lead * rate_error[i]
        if push[i] * beyond <= edge - thrusters.hysteresis:
            push[i] = np.sign(beyond) if abs(beyond) > edge else 0.0
    for k in range(len(on)):
        use = thrusters.serves[k, 0] * push[0] + thrusters.serves[k, 1] * push[1] + thrusters.serves[k, 2] * push[2]
        on[k] = use > 0 or (burn >= 0 and thrusters.burns[k] and use == 0)


@jit
def fly_cycles(plant, loop, errors, thrusters, rods, coasting, q_c, w_c, alpha_c, first_time, x, record):
    """Control cycles from ``first_time`` on, one row of ``record`` each, before its torque acts.

    Row: state, then estimation error (3), attitude error (3), estimated rate (3), controller rate
    error (3), commanded torque on the body (3), motor torques (n), drag estimates (n), measured wheel
    rates (n), torque from outside in place of coasting wheels (3), of each thruster whether it is on, thrust,
    impulse so far, leaks included, and how cold its bed is (j each), and the rods' dipole (3).  Where ``coasting``, (N, n) bool,
    a wheel's motor is off: the others turn the craft where they can, else what it would have given the body comes from outside,
    exactly and at once.  A wheel at its rate limit ends the flight
    where the wheels hold the attitude; under thruster control its motor takes it no further.  Returns the rows written and the
    wheel that ended the flight (-1: none)."""
    n, size = len(plant.spin_inertia), len(x)
    cycles = len(record)
    work = np.empty((5, size))
    offset, e, w_est, c, torque = errors.start.copy(), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    h, believed, feed = np.empty(3), np.empty(3), np.empty(3)
    z = np.zeros((3, 2, 2))  # axis, filter section, state
    for i in range(3):  # the filter starts settled on the first rate
        for section in range(2):
            z[i, section, 0] = x[4 + i]
    motor, drag_estimate, measured = np.zeros(n), np.zeros(n), np.zeros(n)
    waiting = np.zeros((loop.delay_cycles + 1, n))
    expected = plant.spin_inertia * x[7 : 7 + n]  # wheel momentum the commands alone would give
    integral, ordered, outside = np.zeros(n), np.zeros(n), np.zeros(3)
    step = loop.period / loop.substeps
    fired = len(thrusters.delay)
    on, was_on, level, chill = np.zeros(fired, np.bool_), np.zeros(fired, np.bool_), np.zeros(fired), np.ones(fired)
    thrust, given, impulse = np.zeros(fired), np.zeros(fired), np.zeros(fired)
    push, rate_error, total = np.zeros(3), np.zeros(3), np.zeros(3)
    burn, next_burn, burnt = -1, 0, 0.0
    spin = x[7 : 7 + n].copy()  # wheel rates ordered
    dipole, row_of_world, field, balancing = np.zeros(3), np.empty(CURVES), np.empty(3), np.zeros(n)

    for cycle in range(cycles):
        held = fired > 0 and thrusters.in_control[cycle]
        t = first_time + cycle * loop.period
        if cycle > 0:
            offset += errors.gyro[cycle] * loop.period
        if cycle % errors.star_tracker_every == 0 and cycle > 0:
            offset += errors.star_tracker_gain * (errors.star_tracker[cycle] - offset)
        _attitude_error(x[:4], offset, q_c[cycle], e)
        w_est[:] = x[4:7] + errors.gyro[cycle]
        measured[:] = x[7 : 7 + n] + errors.tachometer[cycle]

        for i in range(3):
            signal = w_est[i]
            for section in range(2):
                s = z[i, section]
                out = loop.filter_c[0] * s[0] + loop.filter_c[1] * s[1] + loop.filter_d * signal
                s0 = loop.filter_a[0, 0] * s[0] + loop.filter_a[0, 1] * s[1] + loop.filter_b[0] * signal
                s[1] = loop.filter_a[1, 0] * s[0] + loop.filter_a[1, 1] * s[1] + loop.filter_b[1] * signal
                s[0] = s0
                signal = out
            c[i] = (w_c[cycle, i] if loop.tracking else 0.0) + loop.kp * e[i] - signal
        h[:] = 0.0
        for k in range(n):
            for i in range(3):
                h[i] += plant.wheel_axes[k, i] * plant.spin_inertia[k] * measured[k]
        for i in range(3):
            believed[i] = h[i]
            torque[i] = loop.inertia[i, i] * loop.kd * c[i]
            for j in range(3):
                believed[i] += loop.inertia[i, j] * w_c[cycle, j]
                if loop.acceleration_feedforward:
                    torque[i] += loop.inertia[i, j] * alpha_c[cycle, j]
        if loop.gyroscopic_feedforward:
            _cross(w_c[cycle], believed, feed)
            torque += feed
        if held:
            torque[:] = 0.0
        turning = loop.turning[cycle]
        if loop.null_limit > 0.0:
            _null_space_torque(loop, turning, measured, plant.spin_inertia, balancing)
        if len(rods.limit) > 0:
            if cycle % rods.every == 0:
                world_at(t, plant.world, row_of_world)
                _to_body(x[:4], row_of_world[FIELD : FIELD + 3], field)
                field += errors.magnetometer[cycle]
                _order_rods(rods, field, h, dipole)
            elif cycle % rods.every >= rods.acting:
                dipole[:] = 0.0

        for k in range(n):
            wanted = balancing[k]
            for i in range(3):
                wanted -= loop.axes_inverse[turning, k, i] * torque[i]
            if loop.friction_kp > 0.0:
                # what the commands explain of the wheel's momentum, against what its rate says
                lag = expected[k] - plant.spin_inertia[k] * measured[k]
                integral[k] += loop.friction_ki * lag * loop.period
                drag_estimate[k] = loop.friction_kp * lag + integral[k]
            waiting[cycle % (loop.delay_cycles + 1), k] = wanted
        now = (cycle + 1) % (loop.delay_cycles + 1)
        outside[:] = 0.0
        for k in range(n):
            ordered[k] = waiting[now, k] if cycle >= loop.delay_cycles else 0.0
            if coasting[cycle, k]:
                motor[k] = 0.0
                spin[k] = measured[k]
                if loop.from_outside[turning]:
                    for i in range(3):
                        outside[i] -= ordered[k] * plant.wheel_axes[k, i]
                continue
            if not held:
                spin[k] = measured[k]  # where thrusters take over the wheels stay at the rates they have
            else:
                speed_up = WHEEL_RATE_GAIN * (spin[k] - measured[k])
                if not np.isnan(thrusters.spin_order[cycle, k]):
                    slope = (thrusters.spin_order[cycle, k] - spin[k]) / (thrusters.spin_cycles[cycle, k] * loop.period)
                    spin[k] += slope * loop.period
                    speed_up += slope
                ordered[k] = plant.spin_inertia[k] * speed_up
            motor[k] = min(max(ordered[k] + drag_estimate[k], -loop.torque_limit[k]), loop.torque_limit[k])
            if held and abs(x[7 + k]) >= loop.rate_limit[k] and motor[k] * x[7 + k] > 0.0:
                motor[k] = 0.0

        if fired > 0 and not held:
            on[:] = False
            push[:] = 0.0
            burn = -1
        if held:
            if burn < 0 and next_burn < len(thrusters.burn_start) and cycle >= thrusters.burn_start[next_burn]:
                burn, next_burn, burnt = next_burn, next_burn + 1, 0.0
            if burn >= 0 and burnt >= thrusters.burn_on_time[burn]:
                burn = -1
            rate_error[:] = w_c[cycle] - w_est
            _order_pulses(thrusters, e, rate_error, burn, push, on)
        for k in range(fired):
            if on[k] and not was_on[k]:
                level[k] = thrusters.steady[cycle, k]
            if on[k] and thrusters.burns[k]:
                burnt += loop.period

        row = record[cycle]
        row[:size] = x
        row[size : size + 3] = offset
        row[size + 3 : size + 6] = e
        row[size + 6 : size + 9] = w_est
        row[size + 9 : size + 12] = c
        row[size + 12 : size + 15] = torque
        row[size + 15 : size + 15 + n] = motor
        row[size + 15 + n : size + 15 + 2 * n] = drag_estimate
        row[size + 15 + 2 * n : size + 15 + 3 * n] = measured
        row[size + 15 + 3 * n : size + 18 + 3 * n] = outside
        row[size + 18 + 3 * n : size + 18 + 3 * n + fired] = on
        row[size + 18 + 3 * n + fired : size + 18 + 3 * n + 2 * fired] = thrust
        row[size + 18 + 3 * n + 2 * fired : size + 18 + 3 * n + 3 * fired] = impulse
        row[size + 18 + 3 * n + 3 * fired : size + 18 + 3 * n + 4 * fired] = chill
        row[size + 18 + 3 * n + 4 * fired :] = dipole
        for k in range(n):
            if not held and abs(x[7 + k]) >= loop.rate_limit[k]:
                return cycle + 1, k
        if fired == 0:
            advance(t, x, motor, outside, dipole, plant, step, loop.substeps, work)
        else:
            for s in range(loop.substeps):
                impulses(thrusters, cycle, on, was_on, level, chill, thrust, s * step, (s + 1) * step, given)
                total[:] = outside
                for k in range(fired):
                    impulse[k] += given[k]
                    for i in range(3):
                        total[i] += thrusters.arms[k, i] * given[k] / step
                advance(t + s * step, x, motor, total, dipole, plant, step, 1, work)
            for k in range(fired):
                was_on[k] = on[k]
                if on[k]:
                    chill[k] *= np.exp(-loop.period / thrusters.heating)
                else:
                    chill[k] = 1 - (1 - chill[k]) * np.exp(-loop.period / thrusters.cooling)
        for k in range(n):
            # a saturated motor is the controller's doing, not drag; nor is one that is off
            expected[k] += (motor[k] - drag_estimate[k]) * loop.period
    return cycles, -1
