"""The motion that the controller follows, and the torque it adds to follow it.

Of a body at rate w = w_c + d, w_c commanded, I d' = T - w x H - I w_c' + u.  The controller's u is that of a hold on the
deviation d, plus a feed-forward f that is known from w_c and H: with h + integral of f in place of the wheels' momentum h,
and w x H + I w_c' - f taken off as a known torque, the model of a hold serves for any motion.  A controller that does not track
the commanded rate holds an attitude that lags behind by F(w_c) / KP: deviations are then from that attitude.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.loop import filtered_rate
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.rotations import attitude_error, lvlh_to_inertial, rates_between, rotation, turned_by
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from .series import ATTITUDE_ERROR, BODY_RATE, MOMENTUM, Series

if TYPE_CHECKING:
    from ...craft.model import WheelController
    from ..subject import Grid, Subject

#: Source of a command that is none.
HOLD = "none: an attitude is held"

_QUATERNION = [f"quaternion_{m}" for m in "wxyz"]
_COMMANDED = [f"commanded_quaternion_{m}" for m in "wxyz"]
#: The command of a hold is smoothed over this, and over so many times the loop's own. [s], [loop times]
_SMOOTHED_S, _LOOP_TIMES = 300.0, 50.0
#: The craft file is contradicted where the actuators do this many times less beside the law that feeds w x H forward, or does not.
_PLAIN = 3.0
#: Shortest block whose mean is smoothed. [s]
_BLOCK_S = 10.0
#: In a hold the actuators do something beside the law where so many parts of the record say so, by so many standard errors of their mean.
_PARTS, _SURE = 8, 6.0
#: What they do is estimated from the same data that then say more of it: what it is off by is given this many of its sigmas beforehand.
_WIDE = 3.0
#: A craft is held to its orbit where its attitude stays this near one in LVLH axes [rad], with positions over this share of the
#: attitudes and no fewer than so many.
_STILL_RAD, _COVERED, _FEWEST = 0.02, 0.95, 8

FED_OTHERWISE = Kind(
    "fused.fed-otherwise", Severity.SUSPECT,
    "the craft file says that the controller {said} feed w x H forward, and its actuators contradict that: they slowly do another "
    "thing, which is taken from the data",
    "Check the wheels' axes and spin inertia, the inertia, and gyroscopic under [wheel_controller]: the torque is wrong if it is not this last.",
)  # fmt: skip


@dataclass(frozen=True)
class Command:
    """On the grid: rates, their derivative and the feed-forward on the body, (M, 3); variance of the rates and of their derivatives (2, 3).

    ``beside_Nm``: (3,), one sigma of what the actuators slowly do beside the law, which shifts the attitude held; ``source``: where
    the rates are from; ``gyroscopic``, ``acceleration``: what the controller feeds forward; ``doubts``: where the actuators say
    otherwise than the craft file."""

    seconds: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    feed_Nm: np.ndarray
    fed_Nms: np.ndarray  # its integral
    variance: np.ndarray
    beside_Nm: np.ndarray
    lag_rad: (
        np.ndarray
    )  # (M, 3), by which the attitude that the loop holds without a torque is behind the one commanded
    source: str
    gyroscopic: bool
    acceleration_fed: bool
    doubts: Doubts = Doubts()

    @property
    def still(self) -> bool:
        """Whether a fixed attitude is held."""
        return self.source == HOLD

    def on(self, seconds: np.ndarray, values: np.ndarray, j: int) -> np.ndarray:
        return np.interp(seconds, self.seconds, values[:, j])

    def taken_off(self, series: dict[int, list[Series]]) -> dict[int, list[Series]]:
        """The series as a hold would have them."""
        return {j: [self._as_in_a_hold(s, j) for s in of_axis] for j, of_axis in series.items()}

    def _as_in_a_hold(self, s: Series, j: int) -> Series:
        if s.row == BODY_RATE and not self.still:
            off = s.values - self.on(s.seconds, self.rate, j)
            return replace(s, values=off - np.median(off))  # the sensor's bias
        if s.row == ATTITUDE_ERROR:
            return _less_lag(s, self.seconds, self.lag_rad[:, j])
        if s.row == MOMENTUM:
            return replace(s, values=s.values + self.on(s.seconds, self.fed_Nms, j))
        return s


def has_command(subject: Subject) -> bool:
    """Whether the telemetry tells what is commanded: by channels, or by an orbit whose LVLH axes the craft follows."""
    tlm = subject.telemetry
    told = tlm.has_axes("commanded_rate") or all(n in tlm for n in _COMMANDED)
    return told or held_to_orbit(subject) is not None


def has_attitudes(subject: Subject) -> bool:
    """Whether the telemetry tells the attitude and the commanded one."""
    if not all(n in subject.telemetry for n in _QUATERNION):
        return False
    return all(n in subject.telemetry for n in _COMMANDED) or held_to_orbit(subject) is not None


def errors_from_quaternions(subject: Subject, grid: Grid) -> dict[int, Series]:
    """The error of the telemetered attitude against the commanded one."""
    tlm = subject.telemetry
    if all(n in tlm for n in _COMMANDED):
        tai_ns, q = together(tlm, [*_QUATERNION, *_COMMANDED])
        error = attitude_error(q[:, 4:], q[:, :4])
    else:
        held = held_to_orbit(subject)
        assert held is not None  # by has_attitudes
        tai_ns, q = together(tlm, _QUATERNION)
        inside = (tai_ns >= held.tai_ns[0]) & (tai_ns <= held.tai_ns[-1])
        tai_ns, q = tai_ns[inside], q[inside]
        error = (rotation(q).inv() * held.at(tai_ns)).as_rotvec()
    s = grid.of(tai_ns)
    inside = (s >= 0) & (s <= grid.seconds[-1] + 1e-6)
    return {j: Series(ATTITUDE_ERROR, s[inside], error[inside, j]) for j in range(3)}


@dataclass(frozen=True)
class HeldToOrbit:
    """An attitude that stands still in LVLH axes: its turn off them, body to LVLH, and the orbit (N, 3) at some instants (N,)."""

    tai_ns: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    turn: scipy.spatial.transform.Rotation

    def _orbit(self, tai_ns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t = (self.tai_ns - self.tai_ns[0]) / NS
        path = scipy.interpolate.CubicHermiteSpline(t, self.position, self.velocity)
        at = np.clip((tai_ns - self.tai_ns[0]) / NS, 0.0, t[-1])
        return path(at), np.column_stack([np.interp(at, t, v) for v in self.velocity.T])

    def at(self, tai_ns: np.ndarray) -> scipy.spatial.transform.Rotation:
        """The attitude held, body to inertial."""
        return lvlh_to_inertial(*self._orbit(tai_ns)) * self.turn

    def rate(self, tai_ns: np.ndarray) -> np.ndarray:
        """Of the attitude held, body axes (N, 3) [rad/s]: along a Kepler orbit, (0, -|r x v| / r^2, 0) in LVLH axes."""
        r, v = self._orbit(tai_ns)
        size = np.linalg.norm(np.cross(r, v), axis=1) / np.sum(r**2, axis=1)
        return self.turn.inv().apply(np.outer(size, [0.0, -1.0, 0.0]))


def held_to_orbit(subject: Subject) -> HeldToOrbit | None:
    """The attitude held in LVLH axes, where positions, velocities and attitudes say that there is one."""
    tlm = subject.telemetry
    names = [f"orbit_{v}_{a}" for v in ("position", "velocity") for a in AXES]
    if not all(n in tlm for n in (*names, *_QUATERNION)):
        return None
    tai_ns, orbit = together(tlm, names)
    at, q = together(tlm, _QUATERNION)
    inside = (at >= tai_ns[0]) & (at <= tai_ns[-1]) if len(tai_ns) else np.zeros(len(at), bool)
    if len(tai_ns) < _FEWEST or np.mean(inside) < _COVERED or not np.all(np.linalg.norm(orbit[:, :3], axis=1) > 0):
        return None
    held = HeldToOrbit(tai_ns, orbit[:, :3], orbit[:, 3:], scipy.spatial.transform.Rotation.identity())
    off = held.at(at[inside]).inv() * rotation(q[inside])
    mean = off.mean()
    still = np.quantile((mean.inv() * off).magnitude(), 0.95) < _STILL_RAD
    return replace(held, turn=mean) if still else None


def command_of(
    subject: Subject, grid: Grid, series: dict[int, list[Series]], stored: tuple[np.ndarray, np.ndarray]
) -> Command:
    """What the craft is commanded to do; ``stored``: instants (N,) and the actuators' momentum there (N, 3).

    From the channel, the commanded attitude, the orbit whose LVLH axes the craft follows, or the smoothed attitude or body rates, which is
    right in a hold alone."""
    law, I_B = subject.controller(), subject.known_inertia()
    rate, acceleration, variance, source = _commanded(subject, grid, series, law)
    at = grid.seconds
    h = np.column_stack([np.interp(at, stored[0], stored[1][:, j]) for j in range(3)])
    J, lag = law.believed_kgm2(I_B), _lag(law, rate, grid.step_s)
    series = {j: [_less_lag(s, at, lag[:, j]) for s in of_axis] for j, of_axis in series.items()}
    slower = np.gradient(lag, at, axis=0)
    rate, acceleration = rate - slower, acceleration - np.gradient(slower, at, axis=0)
    turn, push = np.cross(rate, rate @ J + h), acceleration @ J
    without, fed_forward = _left_over(law, J, series, turn)
    gyroscopic = fed_forward < without if law.gyroscopic is None else law.gyroscopic
    stated, other = (fed_forward, without) if gyroscopic else (without, fed_forward)
    doubts = Doubts([FED_OTHERWISE(said="does" if gyroscopic else "does not")] if stated > _PLAIN * other else ())
    pushed = gyroscopic if law.acceleration is None else law.acceleration
    feed = gyroscopic * turn + pushed * push
    fed = gyroscopic * scipy.integrate.cumulative_trapezoid(turn, at, axis=0, initial=0) + pushed * (rate - rate[0]) @ J
    beside = np.zeros(3)
    for j, of_axis in series.items():
        more = _beside(of_axis, fed[:, j], at, J[j, j] * law.kd_per_s, law)
        lag[:, j] -= more.at(at, 1) / _stiffness(law, J, j)
        beside[j] = np.sqrt(more.variance[0])
    return Command(at, rate, acceleration, feed, fed, variance, beside, lag, source, gyroscopic, pushed, doubts)


def hold_of(subject: Subject, grid: Grid, series: dict[int, list[Series]]) -> Command | None:
    """What the actuators slowly do beside the law while a fixed attitude is held (bearings' drag, a bias of the rate); None for nothing."""
    law, at = subject.controller(), grid.seconds
    J, none = law.believed_kgm2(subject.known_inertia()), np.zeros((grid.count, 3))
    lag, sigma = none.copy(), np.zeros(3)
    for j, of_axis in series.items():
        s, left = _left_beside(of_axis, none[:, j], at, J[j, j] * law.kd_per_s, law)
        ends = np.linspace(0, len(s) - 1, _PARTS + 1).astype(int)
        slopes = np.diff(left[ends]) / np.diff(s[ends])
        error = float(np.std(slopes, ddof=1)) / np.sqrt(_PARTS)
        if abs(np.mean(slopes)) > _SURE * error:
            lag[:, j], sigma[j] = (
                -_smoothed(s, left, 1, *_smoothing(law, at)).at(at, 1) / _stiffness(law, J, j),
                _WIDE * error,
            )
    if not sigma.any():
        return None
    return Command(
        at, none, none, none, none, np.zeros((2, 3)), sigma, lag, HOLD, gyroscopic=False, acceleration_fed=False
    )


def _stiffness(law: WheelController, J: np.ndarray, j: int) -> float:
    """The torque of a turn off the attitude held. [N m/rad]"""
    return float(J[j, j]) * law.kd_per_s * law.kp_per_s


def _lag(law: WheelController, rate: np.ndarray, step_s: float) -> np.ndarray:
    """By what a law that does not track lags behind the attitude commanded, (M, 3) [rad]."""
    if law.tracking:
        return np.zeros_like(rate)
    return np.column_stack([filtered_rate(law, rate[:, j], step_s) for j in range(3)]) / law.kp_per_s


def _less_lag(s: Series, seconds: np.ndarray, lag: np.ndarray) -> Series:
    return replace(s, values=s.values - np.interp(s.seconds, seconds, lag)) if s.row == ATTITUDE_ERROR else s


def _commanded(subject: Subject, grid: Grid, series, law: WheelController):
    """Rates and their derivative (M, 3), the rates' variance and its derivative's (2, 3), and where they are from."""
    tlm, at = subject.telemetry, grid.seconds
    if tlm.has_axes("commanded_rate"):
        channels = [tlm.channel(f"commanded_rate_{a}").usable for a in AXES]
        rate = np.column_stack([np.interp(at, grid.of(c.tai_ns), c.values) for c in channels])
        return rate, np.gradient(rate, at, axis=0), np.zeros((2, 3)), "commanded rate"
    if all(n in tlm for n in _COMMANDED):
        tai_ns, q = together(tlm, _COMMANDED)
        middle, between = rates_between(grid.of(tai_ns), q)
        smooth = [scipy.interpolate.make_smoothing_spline(middle, between[:, j]) for j in range(3)]
        inside = np.clip(at, middle[0], middle[-1])
        rate = np.column_stack([f(inside) for f in smooth])
        return rate, np.column_stack([f.derivative()(inside) for f in smooth]), np.zeros((2, 3)), "commanded attitude"
    most, block_s = _smoothing(law, at)
    held = held_to_orbit(subject)
    if held is not None:
        told = held.rate(grid.start_ns + np.round(at * NS).astype(np.int64))
        slow = [_smoothed(at, told[:, j], 0, most, block_s) for j in range(3)]
        rate, push = (np.column_stack([f.at(at, k) for f in slow]) for k in (0, 1))
        return rate, push, np.array([f.variance for f in slow]).T, "LVLH of the orbit"
    measured = [next(s for s in series[j] if s.row == BODY_RATE) for j in range(3)]
    fits = [_smoothed(s.seconds, scipy.ndimage.median_filter(s.values, 5), 0, most, block_s) for s in measured]
    found = [np.column_stack([f.at(at, k) for f in fits]) for k in (0, 1)]
    source, variance = "smoothed body rates", np.array([f.variance for f in fits]).T
    if all(n in tlm for n in _QUATERNION):
        found, variance = _from_attitude(subject, grid, series, found[0], most, block_s)
        source = "smoothed attitude"
    return found[0], found[1], variance, source


def _from_attitude(subject: Subject, grid: Grid, series, rate: np.ndarray, most: int, block_s: float):
    """[rates, their derivatives] of what the attitude and its error say is commanded, and the variance of each (2, 3).

    ``rate``: (M, 3), from the body rates; the attitude's angles off what they make are smoothed."""
    tai_ns, q = together(subject.telemetry, _QUATERNION)
    s, at = grid.of(tai_ns), grid.seconds
    inside = (s >= 0) & (s <= at[-1] + 1e-6)
    s, commanded = s[inside], rotation(q[inside])
    errors = {j: x for j in range(3) for x in series[j] if x.row == ATTITUDE_ERROR}
    error = np.column_stack([np.interp(s, errors[j].seconds, errors[j].values) for j in range(3)])
    commanded = commanded * scipy.spatial.transform.Rotation.from_rotvec(error)
    acceleration, fits = np.gradient(rate, at, axis=0), []
    for _ in range(2):  # what is left of the first is of second order
        made = scipy.spatial.transform.Slerp(at, turned_by(at, rate))(np.clip(s, 0, at[-1]))
        off = (made.inv() * (commanded[0] * made[0].inv()).inv() * commanded).as_rotvec()
        fits = [_smoothed(s, off[:, j], 1, most, block_s) for j in range(3)]
        angle, more, curve = (np.column_stack([f.at(at, k) for f in fits]) for k in range(3))
        rate = rate + more - np.cross(angle, rate)
        acceleration = acceleration + curve - np.cross(more, rate)
    return [rate, acceleration], np.array([f.variance for f in fits]).T


@dataclass(frozen=True)
class _Smooth:
    """A spline and the variance of the rate it stands for, and of that rate's derivative."""

    spline: scipy.interpolate.BSpline
    variance: tuple[float, float]

    def at(self, seconds: np.ndarray, derivative: int) -> np.ndarray:
        return self.spline(seconds, derivative) if derivative <= self.spline.k else np.zeros(len(seconds))


def _smoothed(seconds: np.ndarray, values: np.ndarray, order: int, most: int, block_s: float) -> _Smooth:
    """The spline that means over blocks call for (BIC); ``order``: 0 for rates, 1 for angles; ``most``: pieces."""
    block = (seconds / block_s).astype(int)
    count = np.bincount(block)
    full = count >= 0.5 * np.median(count)
    t, y = (np.bincount(block, v)[full] / count[full] for v in (seconds, values))
    end, n = float(seconds[-1]), len(t)
    shapes = [(k, 1) for k in range(4)] + [(3, pieces) for pieces in range(2, most + 1)]
    best = None
    for k, pieces in shapes:
        k, size = k + order, k + order + pieces
        if size > n // 3 and best is not None:
            break
        knots = np.concatenate([[0.0] * k, np.linspace(0, end, pieces + 1), [end] * k])
        spline = scipy.interpolate.make_lsq_spline(t, y, knots, k)
        square = float(np.mean((y - spline(t)) ** 2)) + 1e-300
        score = n * np.log(square) + size * np.log(n)
        if best is None or score < best[0]:
            best = score, spline, square, size, pieces
    _, spline, square, size, pieces = best
    each, span = square * size / max(n - size, 1), end / pieces
    # of a least-squares line, and of a parabola
    slope, curve = 12 * each / span**2, 720 * each / span**4
    return _Smooth(spline, (slope, curve) if order else (each, slope))


def _beside(of_axis: list[Series], fed: np.ndarray, at: np.ndarray, gain: float, law: WheelController) -> _Smooth:
    """What the actuators slowly do beside the law and its feed-forward: the integral of that torque on the body.

    Bearing drag, a bias of the rate sensor, an inertia on board that is another: all shift the attitude held, and would be
    taken for a disturbance.  ``fed``: integral of the feed-forward; ``gain``: inertia x KD."""
    seconds, left = _left_beside(of_axis, fed, at, gain, law)
    return _smoothed(seconds, left, 1, *_smoothing(law, at))


def _left_beside(
    of_axis: list[Series], fed: np.ndarray, at: np.ndarray, gain: float, law: WheelController
) -> tuple[np.ndarray, np.ndarray]:
    """Instants, and the integral of what the actuators do beside the law and its feed-forward; as ``_beside``."""
    row = {s.row: s for s in of_axis}
    h, e = row[MOMENTUM], row[ATTITUDE_ERROR]
    turned = scipy.integrate.cumulative_trapezoid(e.values, e.seconds, initial=0)
    asked = gain * (law.kp_per_s * np.interp(h.seconds, e.seconds, turned) + np.interp(h.seconds, e.seconds, e.values))
    return h.seconds, -h.values - asked - np.interp(h.seconds, at, fed)


def _smoothing(law: WheelController, at: np.ndarray) -> tuple[int, float]:
    """Most pieces of a slow spline, and the blocks that it takes the means of [s]."""
    spacing = max(_SMOOTHED_S, _LOOP_TIMES / law.natural_frequency_rad_s)
    return max(1, round(float(at[-1]) / spacing)), max(_BLOCK_S, 2 / law.natural_frequency_rad_s)


def _left_over(law: WheelController, J: np.ndarray, series, turn: np.ndarray) -> tuple[float, float]:
    """What the actuators do in the mean beside the law, without and with w x H fed forward. [N m]"""
    beside = np.zeros(3)
    for j, of_axis in series.items():
        row = {s.row: s for s in of_axis}
        h, e = row[MOMENTUM], row[ATTITUDE_ERROR]
        line = np.polynomial.Polynomial.fit(h.seconds, h.values, 1).convert().coef
        held = _stiffness(law, J, j) * float(np.mean(e.values))
        beside[j] = -line[1] - held
    return float(np.linalg.norm(beside)), float(np.linalg.norm(beside - turn.mean(axis=0)))
