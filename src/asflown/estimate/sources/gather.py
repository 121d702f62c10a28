"""The momentum of a record and what each source would add to it, in means over blocks, body axes.

The total momentum H of body and wheels changes in inertial axes only by the torque of the surroundings, so nothing is differentiated:

    H_B(t) = R(t)^T (H_0 + integral of R T dt),   R body to inertial
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.rigid_body import momentum_regressor
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput, some_of
from ...kit.rotations import rates_between, turned_by
from ...kit.scatter import difference_sigma, robust_sigma
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ..environment import Air, Environment, attitude_at, environment_of, inertia_sigma
from ..subject import FEWEST, SPIN_SHARE, samples_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..subject import Subject

#: Blocks of a record, and the shortest. [s]
_BLOCKS, _SHORTEST_S = 600, 2.0
#: What columns of the density's higher harmonics are called.
DENSITY = "density"
#: What columns of the magnetometer's bias are called, and one sigma of it, of a calibrated one: assumed. [T]
FIELD_BIAS, _FIELD_BIAS_T = "field bias", 3e-7
#: What columns of the wheels' spin inertia are called.
SPIN = "spin inertia"
#: A stretch without samples after which the momentum starts anew. [s]
_GAP_S = 60.0
#: One sigma of a gyro's bias where no quaternion tells it: a good small gyro's. Assumed. [rad/s]
_BIAS = 5e-6
#: A source alone may exert so many times the torque that is seen (rms), one sigma: sources seldom cancel to less than a third.
ALONE = 3.0
#: One sigma of the density's second to fourth harmonic over the orbit, as shares of its mean: the day's bulge is no sine
#: (studies/density_harmonics.py).  Without a model of the air; with one a fifth of it.
_HARMONICS, _MODELLED = (0.14, 0.035, 0.03), 0.2
#: The penumbra's middle is known to this, or to half its length where that is longer. [s]  It lasts 8 s in low orbit.
_EDGE_S = 4.0

ATTITUDE_FROM_RATES = Kind(
    "sources.attitude-from-rates", Severity.CAUTION,
    "there is no quaternion: the attitude is integrated from the body rates, including their bias; orbit and models of field, Sun and air "
    "cannot be used",
    "Add the quaternion.",
)  # fmt: skip
ACTUATORS_TORQUE = Kind(
    "sources.actuators-torque", Severity.CAUTION,
    "the actuators' momentum is integrated from their commanded torque: errors of that torque count as torque of the surroundings",
    "Add wheel_rate_<WHEEL> or wheel_momentum_x|y|z.",
)  # fmt: skip


@dataclass(frozen=True)
class Column:
    """An unknown: which source it belongs to ('' for what is not looked for), its name, unit, and one sigma beforehand."""

    source: str
    name: str
    unit: str
    sigma: float


@dataclass(frozen=True)
class Arc:
    """K blocks: middle (K,) [s from the first sample], samples in each, momentum (K, 3) [N m s] less what known torques brought, columns
    (K, 3, p) per one sigma of each unknown, and the sigma of one sample's momentum (3,).

    ``jump`` (K,): variance of a step of momentum before each block, past gaps and edges of the shadow; ``turn`` (K, 3, 3): mean attitude;
    ``torque`` (K, 3, p): of each column; ``known`` {name: (K, 3)}: torques taken off; ``size_Nm``: rms of the torque that is seen."""

    time_s: np.ndarray
    tai_ns: np.ndarray
    count: np.ndarray
    momentum: np.ndarray
    Z: np.ndarray
    columns: tuple[Column, ...]
    white: np.ndarray
    jump: np.ndarray
    turn: np.ndarray
    torque: np.ndarray
    known: dict[str, np.ndarray]
    size_Nm: float
    step_s: float
    environment: Environment
    doubts: Doubts
    own_harmonics: bool = False  # drag's harmonics are of each axis' own

    @property
    def phase(self) -> np.ndarray | None:
        """Way round the orbit at the blocks' middles. (K,)"""
        whole = self.environment.phase_rad
        return None if whole is None else np.interp(self.tai_ns, self.environment.tai_ns, whole)

    @property
    def each(self) -> np.ndarray:
        """Momentum of each wheel, body axes. (K, n, 3) [N m s]"""
        at = [k for k, c in enumerate(self.columns) if c.name.startswith(SPIN)]
        sigma = np.array([self.columns[k].sigma for k in at])
        return -np.swapaxes(self.Z[:, :, at] / sigma, 1, 2)

    def of(self, source: str) -> np.ndarray:
        """Which columns belong to a source."""
        return np.array([c.source == source for c in self.columns])


@dataclass(frozen=True)
class _Course:
    """Instants, attitude, momentum in body axes of body and of each wheel; doubts.

    ``turn`` (N, 3): the body's rate by the quaternion, whose noise is not that of the gyros in ``momentum``: of gyro rates, an inertia
    fitted would cancel their own noise."""

    tai_ns: np.ndarray
    R: np.ndarray
    momentum: np.ndarray
    each: np.ndarray  # (N, n, 3)
    turn: np.ndarray
    bias_sigma: float
    doubts: Doubts

    @property
    def seconds(self) -> np.ndarray:
        return (self.tai_ns - self.tai_ns[0]) / NS


def gather(subject: Subject, which: Sequence[str], air: Air | None) -> Arc:
    """Raises BadInput where momentum or its frame is not known, or thrusters fire."""
    if subject.firing:
        raise BadInput(
            f"thrusters fire in this span ({some_of(subject.firing)}), and their torque cannot be told from the surroundings'",
            file=subject.telemetry.source or None,
            remedy="Narrow the span with --start and --stop to one without firings.",
        )
    course = _course(subject)
    around = environment_of(subject, course.tai_ns, air=air)
    t = course.seconds
    block = _blocks(t)
    known = {
        t_.name: t_.torque_Nm
        for t_ in around.terms
        if t_.name in ("gravity-gradient", "rods") and t_.torque_Nm is not None
    }
    brought = _grown(course, sum(known.values(), np.zeros((len(t), 3)))[:, :, None])[:, :, 0]
    momentum = course.momentum - brought
    size = _size(course, momentum)
    columns, torque, direct = _columns(subject, course, around, which, size)
    whole = _grown(course, torque) + direct
    white = np.array([difference_sigma(course.momentum[:, j], 3) for j in range(3)])
    mean = _Means(block)
    middle, lit = mean(t), None if around.lit is None else mean(around.lit)
    return Arc(
        time_s=middle, tai_ns=course.tai_ns[0] + np.rint(middle * NS).astype(np.int64), count=mean.count, momentum=mean(momentum),
        Z=mean(whole), columns=columns, white=np.maximum(white, 1e-9 * np.abs(course.momentum).max() + 1e-300),
        jump=_jumps(middle, mean(course.momentum), lit, size, t), turn=mean(course.R), torque=mean(torque),
        known={n: mean(v) for n, v in known.items()}, size_Nm=size, step_s=float(np.median(np.diff(middle))), environment=around,
        doubts=Doubts([*course.doubts, *around.doubts]),
    )  # fmt: skip


def with_harmonics(arc: Arc, drag: np.ndarray, *, modelled: bool) -> Arc:
    """The arc with higher harmonics of the density among its unknowns, each a torque as drag's that swings faster.

    ``drag`` (K, 3, l): torque at the mean density; of one lever, or per lever of each axis where none is known yet."""
    phase = arc.phase
    assert phase is not None
    sizes = np.array(_HARMONICS) * (_MODELLED if modelled else 1.0)
    shares = [s * f(k * phase) for k, s in enumerate(sizes, 2) for f in (np.cos, np.sin)]
    torque = np.concatenate([drag * share[:, None, None] for share in shares], axis=2)
    grown = scipy.integrate.cumulative_trapezoid(arc.turn @ torque, arc.time_s, axis=0, initial=0)
    columns = tuple(Column("", f"{DENSITY} {k}", "", 1.0) for k in range(torque.shape[2]))
    Z = np.concatenate([arc.Z, np.swapaxes(arc.turn, 1, 2) @ grown], axis=2)
    whole = np.concatenate([arc.torque, torque], axis=2)
    return replace(arc, Z=Z, columns=(*arc.columns, *columns), torque=whole, own_harmonics=drag.shape[2] > 1)


def with_field_bias(arc: Arc, dipole: np.ndarray) -> Arc:
    """The arc with the magnetometer's bias among its unknowns, of a craft whose ``dipole`` (3,) is about so large [A m2].

    A bias b is no field: it makes a torque dipole x b in the model that is not there, constant in body axes."""
    K = len(arc.time_s)
    torque = np.broadcast_to(_FIELD_BIAS_T * np.cross(dipole, np.eye(3)).T, (K, 3, 3))
    grown = scipy.integrate.cumulative_trapezoid(arc.turn @ torque, arc.time_s, axis=0, initial=0)
    columns = tuple(Column("", f"{FIELD_BIAS} {a}", "T", _FIELD_BIAS_T) for a in AXES)
    Z = np.concatenate([arc.Z, np.swapaxes(arc.turn, 1, 2) @ grown], axis=2)
    return replace(arc, Z=Z, columns=(*arc.columns, *columns), torque=np.concatenate([arc.torque, torque], axis=2))


class _Means:
    """Means over blocks of samples (N, ...)."""

    def __init__(self, block: np.ndarray):
        self.first = np.flatnonzero(np.r_[True, np.diff(block) > 0])
        self.count = np.diff(np.r_[self.first, len(block)])

    def __call__(self, values: np.ndarray) -> np.ndarray:
        sums = np.add.reduceat(values, self.first, axis=0)
        return sums / self.count.reshape(-1, *[1] * (values.ndim - 1))


def _blocks(t: np.ndarray) -> np.ndarray:
    return np.floor(t / max((t[-1] - t[0]) / _BLOCKS, _SHORTEST_S, float(np.median(np.diff(t))))).astype(int)


def _course(subject: Subject) -> _Course:
    I_B = subject.known_inertia()
    tlm = subject.telemetry
    doubts: list[Doubt] = []
    if not (tlm.members("wheel_rate") or tlm.has_axes("wheel_momentum")) and tlm.has_axes("control_torque"):
        names = [f"{stem}_{a}" for stem in ("body_rate", "control_torque") for a in AXES]
        if not tlm.has_axes("body_rate"):
            raise BadInput("body rates are not in the telemetry", channel="body_rate_x", remedy="Add them.")
        tai_ns, values = together(tlm, names)
        if len(tai_ns) < FEWEST:
            raise BadInput(
                "too few instants at which rates and control torque are known", remedy="Take a longer record."
            )
        rates, pushed, each = values[:, :3], values[:, 3:], np.zeros((len(tai_ns), 0, 3))
        doubts.append(ACTUATORS_TORQUE())
    else:
        s = samples_of(subject)
        if s.rates is None:
            raise BadInput("body rates are not in the telemetry", channel="body_rate_x", remedy="Add them.")
        tai_ns, rates, each, pushed = s.tai_ns, s.rates, s.each, None
        doubts = [*s.doubts]
    t = (tai_ns - tai_ns[0]) / NS
    R = attitude_at(tlm, tai_ns)
    turn, bias, bias_sigma = rates, np.zeros(3), _BIAS
    if R is None:
        R = turned_by(t, rates).as_matrix()
        doubts.append(ATTITUDE_FROM_RATES())
    else:
        turn, bias, bias_sigma = _turn(subject, tai_ns, rates)
    momentum = (rates - bias) @ I_B + each.sum(axis=1)
    if pushed is not None:  # dh/dt = -u in inertial axes
        given = scipy.integrate.cumulative_trapezoid(np.einsum("nij,nj->ni", R, pushed), t, axis=0, initial=0)
        momentum = momentum - np.einsum("nji,nj->ni", R, given)
    return _Course(tai_ns, R, momentum, each, turn, bias_sigma, Doubts(doubts))


def _turn(subject: Subject, tai_ns: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Rates of the quaternion (N, 3), the gyros' bias against them (3,), and one sigma of it. [rad/s]"""
    at, q = together(subject.telemetry, [f"quaternion_{m}" for m in "wxyz"])
    mid, w = rates_between((at - tai_ns[0]) / NS, q)
    t = (tai_ns - tai_ns[0]) / NS
    turn = np.stack([np.interp(t, mid, w[:, j]) for j in range(3)], axis=1)
    off = np.stack([np.interp(mid, t, rates[:, j]) for j in range(3)], axis=1) - w
    inside = (mid >= t[0]) & (mid <= t[-1])
    if inside.sum() < FEWEST:
        return rates, np.zeros(3), _BIAS
    off = off[inside]
    scatter = robust_sigma(off - np.median(off, axis=0), axis=0)
    # differenced angles' noise cancels along a record; that of the gyros does not
    return turn, off.mean(axis=0), float(2 * scatter.max() / np.sqrt(len(off)))


def _grown(course: _Course, torque: np.ndarray) -> np.ndarray:
    """Momentum that torques (N, 3, p) in body axes have brought, in body axes."""
    grown = scipy.integrate.cumulative_trapezoid(course.R @ torque, course.seconds, axis=0, initial=0)
    return np.swapaxes(course.R, 1, 2) @ grown


def _size(course: _Course, momentum: np.ndarray) -> float:
    """The rms torque that changes the momentum over a twentieth of the record. [N m]"""
    H = np.einsum("nij,nj->ni", course.R, momentum)
    t = course.seconds
    parts = np.array_split(np.arange(len(t)), min(21, max(len(t) // 4, 2)))
    means, middles = np.array([H[p].mean(axis=0) for p in parts]), np.array([t[p].mean() for p in parts])
    torque = np.diff(means, axis=0) / np.diff(middles)[:, None]
    return max(float(np.sqrt(np.median(np.sum(torque**2, axis=1)))), 1e-12 * float(np.abs(momentum).max()))


def _columns(subject: Subject, course: _Course, around: Environment, which: Sequence[str], size: float):
    """Unknowns, their torque (N, 3, p) and what they change in the momentum directly (N, 3, p), per one sigma of each."""
    n = len(course.tai_ns)
    columns: list[Column] = []
    torques, direct = [], []

    def add(source, names, unit, sigma, torque=None, momentum=None):
        sigma = np.broadcast_to(np.asarray(sigma, float), (len(names),))
        columns.extend(Column(source, name, unit, float(s)) for name, s in zip(names, sigma, strict=True))
        zero = np.zeros((n, 3, len(names)))
        torques.append(zero if torque is None else torque * sigma)
        direct.append(zero if momentum is None else momentum * sigma)

    largest = 10 * float(np.abs(course.momentum).max()) + 1e-300
    add("", [f"momentum {a}" for a in AXES], "N m s", largest, momentum=np.swapaxes(course.R, 1, 2))
    for name in ("dipole", "sunlight"):
        term = around.term(name)
        if name in which and term is not None:
            per_unit = float(np.sqrt(np.mean(np.sum(term.design**2, axis=(1, 2))) / 2))
            add(
                name,
                list(AXES),
                term.unit,
                ALONE * size / max(per_unit, 1e-300) if name == "dipole" else ALONE * size,
                term.design,
            )
    term = around.term("drag")
    if "drag" in which and term is not None and around.phase_rad is not None:
        # the swing of the density: lever x cosine and sine of the way round the orbit (see swing)
        for source, share in (
            ("drag", 1.0),
            ("drag cos", np.cos(around.phase_rad)),
            ("drag sin", np.sin(around.phase_rad)),
        ):
            add(source, list(AXES), "N m", ALONE * size, term.design * np.reshape(share, (-1, 1, 1)))
    if "constant" in which:
        add("constant", list(AXES), "N m", ALONE * size, np.broadcast_to(np.eye(3), (n, 3, 3)))
    gravity = around.term("gravity-gradient")
    G = None if gravity is None else gravity.design
    add("inertia", list(gravity.labels) if gravity else [], "kg m2", inertia_sigma(subject) if gravity else [], G,
        -momentum_regressor(course.turn) if gravity else None)  # fmt: skip
    rods = around.term("rods")
    if rods is not None:
        add("", ["rods"], "", 0.05, rods.design)
    if course.each.shape[1]:
        spin = SPIN_SHARE if not subject.relative else 1e-6
        add(
            "",
            [f"{SPIN} {k}" for k in range(course.each.shape[1])],
            "",
            spin,
            momentum=-np.swapaxes(course.each, 1, 2),
        )
    bias = np.broadcast_to(subject.known_inertia(), (n, 3, 3))
    add("", [f"gyro bias {a}" for a in AXES], "rad/s", course.bias_sigma, momentum=bias)
    return tuple(columns), np.concatenate(torques, axis=2), np.concatenate(direct, axis=2)


def _penumbra(middle: np.ndarray, lit: np.ndarray, edge: int) -> float:
    """How long the light takes to go at an edge of the shadow; long where the craft grazes it. [s]

    Refraction and absorption, which the geometry leaves out, dim light that passes as low as the penumbra is wide."""
    whole = np.flatnonzero((lit < 0.02) | (lit > 0.98))
    before, after = whole[whole <= edge], whole[whole > edge]
    first, last = (before[-1] if len(before) else 0), (after[0] if len(after) else len(lit) - 1)
    return float(middle[last] - middle[first]) - float(np.median(np.diff(middle)))


def _jumps(middle: np.ndarray, momentum: np.ndarray, lit: np.ndarray | None, size: float, t: np.ndarray) -> np.ndarray:
    """Variance of a step of momentum before each block: past a gap any, past the shadow's edge what the edge's place leaves open."""
    jump = np.zeros(len(middle))
    if lit is not None:
        for edge in np.flatnonzero(np.diff(lit > 0.5)):
            jump[edge + 1] = (max(_EDGE_S, 0.5 * _penumbra(middle, lit, int(edge))) * size) ** 2
    gaps = t[np.flatnonzero(np.diff(t) > max(_GAP_S, 6 * float(np.median(np.diff(t)))))]
    for at in gaps:
        jump[np.searchsorted(middle, at, side="right").clip(max=len(jump) - 1)] = float(np.max(momentum**2)) + 1e-300
    return jump
