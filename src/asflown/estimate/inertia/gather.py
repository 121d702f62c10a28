"""From telemetry to a slew record: which wheels report when, where thrusters fire, and block means of fast channels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput, some_of
from ...kit.rotations import quaternion, rates_between, rotation
from ...kit.scatter import difference_sigma
from ...kit.timeline import NS
from ...telemetry.attitude import rate_scale, together
from ...telemetry.channels import AXES
from .gravity import with_orbit
from .record import AttitudeSamples, MomentumSamples, RateSamples, SlewRecord
from .slews import find_slews
from .swings import swings_of

if TYPE_CHECKING:
    from ...craft.model import Wheel
    from ...telemetry.telemetry import Channel, Telemetry
    from ..subject import Subject

#: Samples of a faster channel are averaged in blocks of this length, far shorter than a slew's ramps; ... [s]
_BLOCK_S = 1.0
#: ... in blocks of this one where the body does not turn, which tells nothing of the tensor, ... [s]
_QUIET_BLOCK_S = 16.0
#: ... as long as no slew is nearer than this. [s]
_QUIET_S = 120.0
#: Around a firing, besides the samples between which the on-time rises: valves close late, booms ring. [s]
_BEFORE_S, _AFTER_S = 1.0, 4.0
#: A wheel that begins to report later, or stops earlier, than others by this much was switched. [s]
_SWITCHED_S = 60.0
_FEWEST = 20
#: Axes of gyros and quaternion apart by more than this [rad], and by so many sigmas, are spoken of; means over so many blocks.
_TILT, _TILT_SIGMAS, _TILT_BLOCKS = np.radians(0.2), 6.0, 120
_QUATERNION = [f"quaternion_{m}" for m in "wxyz"]

NO_ATTITUDE = Kind(
    "inertia.no-attitude", Severity.CAUTION,
    "there is no quaternion: the attitude is integrated from the body rates, whose scale error enters the tensor in full",
    "Add the quaternion.",
)  # fmt: skip
NO_RATES = Kind(
    "inertia.no-rates", Severity.NOTE, "there are no body rates: the motion comes from the attitude alone",
    "Add body_rate_x, _y, _z.",
)  # fmt: skip
THRUSTERS_FIRE = Kind(
    "inertia.thrusters-fire", Severity.NOTE,
    "thrusters fire at {spans}: these spans are left out, and each stretch between them has its own momentum",
)  # fmt: skip
WHEEL_SILENT = Kind(
    "inertia.wheel-silent", Severity.CAUTION,
    "no rate of {wheels} is known from {start_s:.0f} to {stop_s:.0f} s: the total momentum is unknown there, and the span is "
    "left out", "Add the channel; a wheel out of service needs valid_to in the craft file.",
)  # fmt: skip
WHEELS_CHANGE = Kind(
    "inertia.wheels-change", Severity.NOTE,
    "the set of wheels in service changes: each of {spans} spans has its own momentum",
)  # fmt: skip
WHEELS_APART = Kind(
    "inertia.wheels-apart", Severity.NOTE,
    "the wheels are read at different instants: each reading is used at its own time",
)  # fmt: skip
TILTED = Kind(
    "inertia.axes-tilted", Severity.SUSPECT,
    "the quaternion's body axes are turned by {angle_deg:.2g} deg against those of the body rates ({sigmas:.0f} sigma): wheels, rates and "
    "attitude must be in one body frame, and an element is off by about that angle times the difference of two moments",
    "Bring all three into one frame: a star tracker's alignment belongs into the quaternion.",
)  # fmt: skip


def slew_record(subject: Subject) -> SlewRecord:
    """Raises BadInput where wheels, or both of rates and attitude, are missing, and where nothing usable is left."""
    check_wheels(subject)
    reader = _Reader(subject)
    rates, attitude = reader.rates(), reader.attitude()
    _check_motion(subject.telemetry, rates, attitude)
    held = reader.momentum()
    firing = reader.firings()
    arcs = _without(held.spans, firing)
    momentum = held.samples.sorted_into(arcs)
    arcs = [arcs[k] for k in np.unique(momentum.arc)]
    momentum = momentum.sorted_into(arcs)
    if len(momentum.time_s) < _FEWEST:
        raise BadInput(
            f"{len(momentum.time_s)} usable readings of wheel momentum are too few for an inertia estimate",
            file=subject.telemetry.source or None,
            remedy="Take a longer window; thrusters must be quiet in it, and all wheels must report.",
        )
    found = [
        *(d for d in subject.doubts if d.origin != "craft"),  # the craft's own tensor is not used yet
        NO_ATTITUDE() if len(attitude.time_s) == 0 else None,
        NO_RATES() if len(rates.time_s) == 0 else None,
        *held.doubts,
        reader.doubt_of(firing),
        _tilted(rates, attitude),
    ]
    counts = {stem: _count(subject.telemetry, stem) for stem in ("wheel_rate", "body_rate", "quaternion")}
    made = SlewRecord(
        zero_s=reader.zero_s, momentum=momentum, rates=rates, attitude=attitude, arcs=tuple(arcs), wheels=held.names,
        axes=held.axes, spins=held.spins, swings=() if subject.relative else swings_of(subject.craft), relative=subject.relative, counts=counts, doubts=Doubts(found),
    )  # fmt: skip
    return with_orbit(made, subject.telemetry, reader.start_ns, subject.inertia_kgm2)


def check_wheels(subject: Subject) -> None:
    """Raises BadInput for a craft that has no wheels, and whose telemetry has no momentum either."""
    name = subject.craft.craft.name
    if not subject.craft.craft.wheels and not subject.telemetry.has_axes("wheel_momentum"):
        raise BadInput(
            f"{name} has no wheels, and it is the momentum that wheels hold which tells the inertia",
            file=subject.telemetry.source or None,
            remedy="Describe them as [[wheels]] in the craft file, or add wheel_momentum_x, _y, _z.",
        )


def _check_motion(tlm: Telemetry, rates: RateSamples, attitude: AttitudeSamples) -> None:
    """Raises BadInput where nothing tells how the body turned, or where rates and attitude contradict each other."""
    if len(rates.time_s) == 0 and len(attitude.time_s) == 0:
        raise BadInput(
            f"neither body rates nor a quaternion have {_FEWEST} usable samples: how the body turned is not known",
            file=tlm.source or None,
            remedy="Add body_rate_x, _y, _z or quaternion_w, _x, _y, _z, or take a longer window.",
        )
    scale = rate_scale(tlm)
    if scale is not None and scale[1]:
        raise BadInput(
            f"the body rates are {scale[0]:.4g} times those of the quaternion: {scale[1]}",
            file=tlm.source or None,
            channel="body_rate_x",
            remedy="The tensor would be wrong by that factor: put the right unit into the column's header.",
        )


def _tilted(rates: RateSamples, attitude: AttitudeSamples) -> Doubt | None:
    """Whether the quaternion's rates are those of the gyros in other axes: gyros = (1 + scale) (rate + angle x rate) + bias, by least
    squares over blocks, in which there is hardly any noise."""
    if len(rates.time_s) == 0 or len(attitude.time_s) < 2 * _TILT_BLOCKS:
        return None
    mid, rate = rates_between(attitude.time_s, attitude.q_NB)
    parts = [(rates.time_s[rates.axis == j], rates.value_rad_s[rates.axis == j]) for j in range(3)]
    gyro = np.stack([np.interp(mid, t, v) for t, v in parts], axis=1)
    r, g = (np.array([p.mean(axis=0) for p in np.array_split(x, _TILT_BLOCKS)]) for x in (rate, gyro))
    X = np.concatenate(
        [np.cross(np.eye(3)[None], r[:, None, :]).swapaxes(1, 2), r[:, :, None], np.tile(np.eye(3), (len(r), 1, 1))],
        axis=2,
    )
    X, y = X.reshape(-1, 7), (g - r).ravel()
    size = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    inverse = np.linalg.pinv((X / size).T @ (X / size), rcond=1e-6, hermitian=True)
    found = inverse @ ((X / size).T @ y)
    left = float(np.sum((y - X / size @ found) ** 2)) / (len(y) - 7)
    angle = found[:3] / size[:3]
    covariance = left * inverse[:3, :3] / np.outer(size[:3], size[:3])
    sigmas = float(np.sqrt(max(angle @ np.linalg.pinv(covariance, rcond=1e-6, hermitian=True) @ angle, 0.0)))
    off = float(np.linalg.norm(angle))
    return TILTED(angle_deg=np.degrees(off), sigmas=sigmas) if off > _TILT and sigmas > _TILT_SIGMAS else None


def _count(tlm: Telemetry, stem: str) -> float:
    return max((c.count_size for c in tlm.channels.values() if c.kind.stem == stem), default=0.0)


def _without(spans, holes) -> list[tuple[float, float]]:
    """Spans with the holes cut out."""
    left = []
    for a, b in spans:
        for x, y in holes:
            if x < b and y > a:
                if x > a:
                    left.append((a, x))
                a = y
        if a < b:
            left.append((a, b))
    return left


@dataclass(frozen=True)
class _Source:
    """A channel that tells momentum, the momentum per unit of its reading (3,), and the wheel it is of, where it is of one."""

    channel: Channel
    per_reading: np.ndarray
    wheel: Wheel | None = None

    @property
    def name(self) -> str:
        return self.wheel.name if self.wheel is not None else self.channel.name


@dataclass(frozen=True)
class _Held:
    """Samples of momentum, the spans with one set of wheels each, and of what holds it names and momentum per reading."""

    samples: MomentumSamples
    spans: list[tuple[float, float]]
    names: tuple[str, ...]
    axes: np.ndarray
    spins: tuple[np.ndarray, np.ndarray] | None
    doubts: list[Doubt]


@dataclass(frozen=True)
class _Reader:
    """The channels of one record, times in seconds from its start."""

    subject: Subject

    @property
    def tlm(self) -> Telemetry:
        return self.subject.telemetry

    @cached_property
    def start_ns(self) -> int:
        return self.tlm.span()[0]

    @cached_property
    def zero_s(self) -> float:
        """The record's start, from the epoch."""
        return float(self.tlm.seconds(self.start_ns))

    @cached_property
    def blocks(self) -> _Blocks:
        return _Blocks(self.quiet_edges())

    def seconds(self, tai_ns) -> np.ndarray:
        return (np.asarray(tai_ns, np.int64) - self.start_ns) / NS

    def quiet_edges(self) -> np.ndarray:
        """Start, stop, start, … of the spans far from any slew. [s]"""
        if not self.tlm.has_axes("body_rate"):
            return np.empty(0)
        tai_ns, w = together(self.tlm, [f"body_rate_{a}" for a in AXES])
        if len(tai_ns) < 2 * _FEWEST:
            return np.empty(0)
        t = self.seconds(tai_ns)
        slews = find_slews(t, w, difference_sigma(w, 3))
        stops = np.concatenate([[t[0]], [s.stop_s + _QUIET_S for s in slews]])
        starts = np.concatenate([[s.start_s - _QUIET_S for s in slews], [t[-1]]])
        long = starts - stops > 2 * _QUIET_BLOCK_S
        return np.stack([stops[long], starts[long]], axis=1).ravel()

    # ---- motion ----

    def rates(self) -> RateSamples:
        parts = []
        for j, a in enumerate(AXES):
            if f"body_rate_{a}" in self.tlm:
                c = self.tlm.channel(f"body_rate_{a}").usable
                t, v, n = self.blocks.averaged(self.seconds(c.tai_ns), c.values)
                parts.append((t, np.full(len(t), j), v, n))
        if len(parts) < 3 or any(len(p[0]) < _FEWEST for p in parts):
            return RateSamples.none()
        return RateSamples(*(np.concatenate([p[k] for p in parts]) for k in range(4)))

    def attitude(self) -> AttitudeSamples:
        if not all(n in self.tlm for n in _QUATERNION):
            return AttitudeSamples.none()
        tai_ns, q = together(self.tlm, _QUATERNION)
        if len(tai_ns) < _FEWEST:
            return AttitudeSamples.none()
        t = self.seconds(tai_ns)
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
        first = self.blocks.first(t)
        if first is None:
            return AttitudeSamples(t, q, np.ones(len(t)))
        # within a block the body hardly turns: small angles from the block's own first attitude average as vectors do
        block = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(t))))
        lead = rotation(q[first])
        away = (lead[block].inv() * rotation(q)).as_rotvec()
        at, turned, count = self.blocks.averaged(t, away)
        return AttitudeSamples(at, quaternion(lead * scipy.spatial.transform.Rotation.from_rotvec(turned)), count)

    # ---- thrusters ----

    def firings(self) -> list[tuple[float, float]]:
        """Spans in which any thruster fired, merged. [s]"""
        spans: list[tuple[float, float]] = []
        for c in self.tlm.channels.values():
            if c.kind.stem in ("on_time", "pulse_count"):
                t = self.seconds(c.usable.tai_ns)
                rises = np.flatnonzero(np.diff(c.usable.values) > 0)
                spans.extend((float(t[k]) - _BEFORE_S, float(t[k + 1]) + _AFTER_S) for k in rises)
        merged: list[tuple[float, float]] = []
        for a, b in sorted(spans):
            if merged and a <= merged[-1][1]:
                merged[-1] = merged[-1][0], max(b, merged[-1][1])
            else:
                merged.append((a, b))
        return merged

    def doubt_of(self, firing: list[tuple[float, float]]) -> Doubt | None:
        if not firing:
            return None
        spans = ", ".join(f"{self.zero_s + a:.0f}-{self.zero_s + b:.0f} s" for a, b in firing[:3])
        more = f" and {len(firing) - 3} more spans" if len(firing) > 3 else ""
        return THRUSTERS_FIRE(spans=f"{spans}{more}", count=len(firing))

    # ---- wheels ----

    def momentum(self) -> _Held:
        """Raises BadInput for unknown and missing wheels, and where at no time all of them report."""
        if not self.tlm.members("wheel_rate") and self.tlm.has_axes("wheel_momentum"):
            sources = [_Source(self.tlm.channel(f"wheel_momentum_{a}"), np.eye(3)[j]) for j, a in enumerate(AXES)]
        else:
            self.subject.wheels()  # refuses unknown and missing wheels
            sources = self.wheels()
        spans, doubts = self.wheel_spans(sources)
        parts, spins = [], None
        for a, b in spans:
            series = [self.series(s, a, b) for s in sources if self.reports(s, a, b)]
            part = _components_together(series)
            if part is None:
                part = _components_apart(series)
                doubts.append(WHEELS_APART())
            elif len(spans) == 1:
                common = np.unique(part.time_s)
                spins = common, np.stack([s.value[np.searchsorted(s.time_s, common)] for s in series], axis=1)
            parts.append(part)
        fields = MomentumSamples.__annotations__
        samples = MomentumSamples(*(np.concatenate([getattr(p, f) for p in parts]) for f in fields))
        return _Held(
            samples, spans, tuple(s.name for s in sources), np.array([s.per_reading for s in sources]), spins, doubts
        )

    def wheels(self) -> list[_Source]:
        """All wheels that are in service at some time of the record."""
        tlm, craft = self.tlm, self.subject.craft
        first, last = tlm.span()
        found = []
        for w in craft.craft.wheels:
            if f"wheel_rate_{w.name}" not in tlm:
                continue
            c = tlm.channel(f"wheel_rate_{w.name}").usable
            if not tlm.dated:
                if craft.wheel(w.name) is not w:
                    continue
            elif (w.valid_to or last + 1) <= first or (w.valid_from or first) > last:
                continue
            else:
                c = c.where((c.tai_ns >= (w.valid_from or first)) & (c.tai_ns < (w.valid_to or last + 1)))
            if len(c.tai_ns) >= 2:
                per_rate = np.array(w.axis, float) * (1.0 if w.spin_inertia is None else w.spin_inertia)
                found.append(_Source(c, per_rate, w))
        return found

    def reports(self, source: _Source, start_s: float, stop_s: float) -> bool:
        t = self.seconds(source.channel.tai_ns)
        return bool(np.any((t >= start_s) & (t < stop_s)))

    def service_s(self, wheel: Wheel | None) -> tuple[float, float]:
        """When a wheel is in service."""
        if wheel is None:
            return -np.inf, np.inf
        start = -np.inf if wheel.valid_from is None else (wheel.valid_from - self.start_ns) / NS
        return start, np.inf if wheel.valid_to is None else (wheel.valid_to - self.start_ns) / NS

    def wheel_spans(self, sources: list[_Source]) -> tuple[list[tuple[float, float]], list[Doubt]]:
        """Spans over which one set of wheels is in service, and all of it reports.

        Raises BadInput where there is none."""
        covers = [self.seconds(s.channel.tai_ns[[0, -1]]) for s in sources]
        service = [self.service_s(s.wheel) for s in sources]
        first, last = min(a for a, _ in covers), max(b for _, b in covers) + 1e-6
        edges = {first, last} | {t for s in service for t in s if first < t < last}
        edges |= {a for a, _ in covers if a > first + _SWITCHED_S}
        edges |= {b + 1e-6 for _, b in covers if b < last - _SWITCHED_S}
        spans: list[tuple[float, float]] = []
        silent: list[tuple[float, float, list[str]]] = []
        for a, b in pairwise(sorted(edges)):
            missing = [
                s.name for s, (x, y) in zip(sources, service, strict=True) if x < b and y > a and not self.reports(s, a, b)
            ]  # fmt: skip
            if missing:
                silent.append((a, b, missing))
            else:
                spans.append((a, b))
        if not spans:
            raise BadInput(
                "at no time do all wheels in service report",
                file=self.tlm.source or None,
                channel=f"wheel_rate_{silent[0][2][0]}",
                remedy="A wheel that is switched off needs valid_from or valid_to in the craft file.",
            )
        zero = self.zero_s
        doubts = [WHEEL_SILENT(wheels=some_of(names), start_s=zero + a, stop_s=zero + b) for a, b, names in silent]
        if len(spans) > 1:
            doubts.append(WHEELS_CHANGE(spans=len(spans)))
        return spans, doubts

    def series(self, source: _Source, start_s: float, stop_s: float) -> _Series:
        t = self.seconds(source.channel.tai_ns)
        inside = (t >= start_s) & (t < stop_s)
        return _Series(
            source.channel.name,
            *self.blocks.averaged(t[inside], source.channel.values[inside]),
            source.per_reading,
        )


class _Blocks:
    """Which samples are averaged into one, the same instants for every channel."""

    def __init__(self, quiet_edges: np.ndarray) -> None:
        self.edges = quiet_edges

    def first(self, time_s: np.ndarray) -> np.ndarray | None:
        """First index of every block, None where samples come slower than blocks."""
        if len(time_s) < 3:
            return None
        span = np.searchsorted(self.edges, time_s, side="right")
        quiet = span % 2 == 1
        slow = np.median(np.diff(time_s)) > 0.51 * _BLOCK_S
        if slow and not quiet.any():
            return None
        number = np.where(
            quiet,
            np.floor(time_s / _QUIET_BLOCK_S + 1e-9),
            np.arange(len(time_s)) if slow else np.floor(time_s / _BLOCK_S + 1e-9),
        )
        return np.flatnonzero(np.concatenate([[True], (np.diff(number) != 0) | (np.diff(span) != 0)]))

    def averaged(self, time_s: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Block means of time and values, and how many samples are in each."""
        first = self.first(time_s)
        if first is None:
            return time_s, values, np.ones(len(time_s))
        count = np.diff(np.append(first, len(time_s))).astype(float)
        mean = np.add.reduceat(values, first, axis=0) / (count if values.ndim == 1 else count[:, None])
        return np.add.reduceat(time_s, first) / count, mean, count


# ---- readings to components of momentum ----------------------------------------------------------


@dataclass(frozen=True)
class _Series:
    """Block means of one channel, how many readings are in each, and the momentum per unit of a reading (3,)."""

    name: str
    time_s: np.ndarray
    value: np.ndarray
    count: np.ndarray
    per_reading: np.ndarray


def _components_together(series: list[_Series]) -> MomentumSamples | None:
    """Three components of the sum at each common instant, with independent errors; None where few instants are common."""
    common = series[0].time_s
    for s in series[1:]:
        common = np.intersect1d(common, s.time_s)
    if len(common) <= 0.5 * max(len(s.time_s) for s in series):
        return None
    at = [np.searchsorted(s.time_s, common) for s in series]
    h = sum(np.outer(s.value[i], s.per_reading) for s, i in zip(series, at, strict=True))
    D = np.array([s.per_reading for s in series])  # (n, 3)
    # errors of single wheels are independent: so are these components of their sum
    variance, axes = np.linalg.eigh(D.T @ D)
    unit = np.sqrt(np.maximum(variance, 1e-6 * variance.max()))
    n = len(common)
    return MomentumSamples(
        np.repeat(common, 3), np.tile(axes.T, (n, 1)), (h @ axes).ravel(), np.tile(unit, n),
        np.repeat(series[0].count[at[0]], 3), np.zeros(3 * n, int),
    )  # fmt: skip


def _components_apart(series: list[_Series]) -> MomentumSamples:
    """Of three wheels read at different instants: each reading along the direction in which that wheel alone has momentum.

    Raises BadInput where they are not three independent ones."""
    D = np.array([s.per_reading for s in series])
    if len(series) != 3 or np.linalg.cond(D) > 1e3:
        raise BadInput(
            "the wheels are read at different instants and are not three independent ones: their sum is not known at any",
            channel=series[0].name,
            remedy="Give all wheel rates at common instants.",
        )
    dual = np.linalg.inv(D).T  # rows: a direction along which one wheel alone has momentum
    lengths = [np.linalg.norm(d) for d in dual]
    counts = [len(s.time_s) for s in series]
    return MomentumSamples(
        np.concatenate([s.time_s for s in series]),
        np.concatenate([np.tile(d / size, (n, 1)) for d, size, n in zip(dual, lengths, counts, strict=True)]),
        np.concatenate([s.value / size for s, size in zip(series, lengths, strict=True)]),
        np.repeat([1 / size for size in lengths], counts),
        np.concatenate([s.count for s in series]),
        np.zeros(sum(counts), int),
    )
