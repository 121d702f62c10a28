"""From telemetry to what an inertia fit needs: momentum of the wheels, body rates and attitude at their own times."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ...craft.model import Wheel
from ...kit.errors import BadInput, some_of
from ...kit.regression import third_difference_sigma
from ...kit.rotations import quaternion, rotation
from ...kit.timeline import NS
from ...telemetry.attitude import rate_scale, together
from ...telemetry.channels import AXES
from ...telemetry.telemetry import Channel, Telemetry
from .slews import find_slews

if TYPE_CHECKING:
    from ..subject import Subject

#: Samples of a faster channel are averaged in blocks of this length, far shorter than a slew's ramps; ... [s]
BLOCK_S = 1.0
#: ... in blocks of this one where the body does not turn, which tells nothing of the tensor, ... [s]
_QUIET_BLOCK_S = 16.0
#: ... as long as no slew is nearer than this. [s]
_QUIET_S = 120.0
#: Around a firing, besides the samples between which the on-time rises: valves close late, booms ring. [s]
_BEFORE_S, _AFTER_S = 1.0, 4.0
#: A wheel that begins to report later, or stops earlier, than others by this much was switched. [s]
_SWITCHED_S = 60.0
_FEWEST = 20
#: A channel, the momentum per unit of its reading (3,), and the wheel it is of, where it is of one.
_Source = tuple[Channel, np.ndarray, Wheel | None]
_QUATERNION = [f"quaternion_{m}" for m in "wxyz"]


@dataclass(frozen=True)
class MomentumSamples:
    """Components d . h of the wheels' momentum, body axes; seconds from the record's start.

    ``unit``: what one unit of reading error (rad/s of a wheel, or N m s) makes of the component; ``count``: readings
    averaged in it; ``arc``: the stretch of undisturbed momentum it belongs to."""

    time_s: np.ndarray  # (M,)
    direction: np.ndarray  # (M, 3)
    value_Nms: np.ndarray  # (M,)
    unit: np.ndarray  # (M,)
    count: np.ndarray  # (M,)
    arc: np.ndarray  # (M,) int

    def vectors(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Instants (N,), the sum of ``values`` (M,) along their directions at each (N, 3), and each sample's instant (M,)."""
        times, index = np.unique(self.time_s, return_inverse=True)
        total = np.zeros((len(times), 3))
        np.add.at(total, index, self.direction * values[:, None])
        return times, total, index


@dataclass(frozen=True)
class RateSamples:
    """Body rates, one axis each; (0,) where the telemetry has none."""

    time_s: np.ndarray
    axis: np.ndarray  # (M,) int
    value_rad_s: np.ndarray
    count: np.ndarray


@dataclass(frozen=True)
class AttitudeSamples:
    """Attitude as the telemetry has it, body to inertial; (0, 4) where it has none."""

    time_s: np.ndarray
    q_NB: np.ndarray
    count: np.ndarray


@dataclass(frozen=True)
class SlewRecord:
    """One record.  ``arcs``: spans [s] over which nothing but a constant outside torque changes the momentum."""

    start_ns: int
    momentum: MomentumSamples
    rates: RateSamples
    attitude: AttitudeSamples
    arcs: tuple[tuple[float, float], ...]
    wheels: tuple[str, ...]
    axes: np.ndarray  # (n, 3), momentum of each per unit of its reading
    relative: bool  # momentum per unit spin inertia
    counts: dict[str, float]  # one count of each kind of channel, 0 where not known
    doubts: tuple[str, ...]

    @property
    def has_attitude(self) -> bool:
        return len(self.attitude.time_s) > 0

    @property
    def has_rates(self) -> bool:
        return len(self.rates.time_s) > 0

    def common_rates(self) -> tuple[np.ndarray, np.ndarray]:
        """Instants at which all three rates are known (N,), and the rates (N, 3)."""
        parts = [(self.rates.time_s[m], self.rates.value_rad_s[m]) for j in range(3) for m in [self.rates.axis == j]]
        times = np.intersect1d(np.intersect1d(parts[0][0], parts[1][0]), parts[2][0])
        return times, np.stack([v[np.searchsorted(t, times)] for t, v in parts], axis=1)

    def split_at(self, time_s: float) -> SlewRecord:
        """The same record with the arc around an instant parted there."""
        arcs = []
        for a, b in self.arcs:
            arcs += [(a, time_s), (time_s, b)] if a < time_s < b else [(a, b)]
        return replace(self, arcs=tuple(arcs), momentum=_sorted_into(self.momentum, arcs))


def slew_record(subject: Subject) -> SlewRecord:
    """Raises BadInput where wheels, or both of rates and attitude, are missing, and where nothing usable is left."""
    tlm = subject.telemetry
    doubts = [d for d in subject.doubts if d not in subject.craft.doubts]  # the craft's own tensor is not used yet
    start_ns = tlm.span()[0]
    blocks = Blocks(tlm, start_ns)
    rates, attitude = _rates(tlm, start_ns, blocks), _attitude(tlm, start_ns, blocks)
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
    if len(attitude.time_s) == 0:
        doubts.append(
            "no attitude in the telemetry: body rates alone carry the inertial axes along, and their scale error in full"
        )
    if len(rates.time_s) == 0:
        doubts.append("no body rates in the telemetry: the attitude alone says how the body turned")
    momentum, spans, names, axes = _momentum(subject, start_ns, blocks, doubts)
    firing = _firings(tlm, start_ns)
    arcs = _without(spans, firing)
    momentum = _sorted_into(momentum, arcs)
    arcs = [arcs[k] for k in np.unique(momentum.arc)] if len(momentum.arc) else []
    momentum = _sorted_into(momentum, arcs)
    if len(momentum.time_s) < _FEWEST:
        raise BadInput(
            f"{len(momentum.time_s)} usable readings of wheel momentum are too few for an inertia estimate",
            file=tlm.source or None,
            remedy="Take a longer window; thrusters must be quiet in it, and all wheels must report.",
        )
    if firing:
        told = ", ".join(f"{a:.0f}-{b:.0f} s" for a, b in _from_epoch(tlm, start_ns, firing[:3]))
        more = f" and {len(firing) - 3} more spans" if len(firing) > 3 else ""
        doubts.append(f"thrusters fire at {told}{more}: these are left out, and the momentum begins anew after each")
    counts = {stem: _count(tlm, stem) for stem in ("wheel_rate", "body_rate", "quaternion")}
    return SlewRecord(
        start_ns, momentum, rates, attitude, tuple(arcs), names, axes, subject.relative, counts, tuple(doubts)
    )


def _count(tlm: Telemetry, stem: str) -> float:
    return max((c.count_size for c in tlm.channels.values() if c.kind.stem == stem), default=0.0)


def _from_epoch(tlm: Telemetry, start_ns: int, spans):
    zero = float(tlm.seconds(start_ns))
    return [(zero + a, zero + b) for a, b in spans]


def _seconds(tai_ns, start_ns: int) -> np.ndarray:
    return (np.asarray(tai_ns, np.int64) - start_ns) / NS


class Blocks:
    """Which samples are averaged into one, the same instants for every channel."""

    def __init__(self, tlm: Telemetry, start_ns: int) -> None:
        self.edges = np.empty(0)  # of quiet spans: start, stop, start, ...
        if not tlm.has_axes("body_rate"):
            return
        tai_ns, w = together(tlm, [f"body_rate_{a}" for a in AXES])
        if len(tai_ns) < 2 * _FEWEST:
            return
        t = _seconds(tai_ns, start_ns)
        slews = find_slews(t, w, third_difference_sigma(w))
        stops = np.concatenate([[t[0]], [s.stop_s + _QUIET_S for s in slews]])
        starts = np.concatenate([[s.start_s - _QUIET_S for s in slews], [t[-1]]])
        long = starts - stops > 2 * _QUIET_BLOCK_S
        self.edges = np.stack([stops[long], starts[long]], axis=1).ravel()

    def first(self, time_s: np.ndarray) -> np.ndarray | None:
        """First index of every block, None where samples come slower than blocks."""
        if len(time_s) < 3:
            return None
        span = np.searchsorted(self.edges, time_s, side="right")
        quiet = span % 2 == 1
        slow = np.median(np.diff(time_s)) > 0.51 * BLOCK_S
        if slow and not quiet.any():
            return None
        number = np.where(
            quiet,
            np.floor(time_s / _QUIET_BLOCK_S + 1e-9),
            np.arange(len(time_s)) if slow else np.floor(time_s / BLOCK_S + 1e-9),
        )
        return np.flatnonzero(np.concatenate([[True], (np.diff(number) != 0) | (np.diff(span) != 0)]))

    def averaged(self, time_s: np.ndarray, values: np.ndarray):
        """Block means of time and values, and how many samples are in each."""
        first = self.first(time_s)
        if first is None:
            return time_s, values, np.ones(len(time_s))
        count = np.diff(np.append(first, len(time_s))).astype(float)
        mean = np.add.reduceat(values, first, axis=0) / (count if values.ndim == 1 else count[:, None])
        return np.add.reduceat(time_s, first) / count, mean, count


def _rates(tlm: Telemetry, start_ns: int, blocks: Blocks) -> RateSamples:
    parts = []
    for j, a in enumerate(AXES):
        if f"body_rate_{a}" in tlm:
            c = tlm.channel(f"body_rate_{a}").usable
            t, v, n = blocks.averaged(_seconds(c.tai_ns, start_ns), c.values)
            parts.append((t, np.full(len(t), j), v, n))
    if len(parts) < 3 or any(len(p[0]) < _FEWEST for p in parts):
        return RateSamples(np.empty(0), np.empty(0, int), np.empty(0), np.empty(0))
    return RateSamples(*(np.concatenate([p[k] for p in parts]) for k in range(4)))


def _attitude(tlm: Telemetry, start_ns: int, blocks: Blocks) -> AttitudeSamples:
    if not all(n in tlm for n in _QUATERNION):
        return AttitudeSamples(np.empty(0), np.empty((0, 4)), np.empty(0))
    tai_ns, q = together(tlm, _QUATERNION)
    if len(tai_ns) < _FEWEST:
        return AttitudeSamples(np.empty(0), np.empty((0, 4)), np.empty(0))
    t = _seconds(tai_ns, start_ns)
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    first = blocks.first(t)
    if first is None:
        return AttitudeSamples(t, q, np.ones(len(t)))
    # within a block the body hardly turns: small angles from the block's own first attitude average as vectors do
    block = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(t))))
    lead = rotation(q[first])
    away = (lead[block].inv() * rotation(q)).as_rotvec()
    at, turned, count = blocks.averaged(t, away)
    return AttitudeSamples(at, quaternion(lead * rotation_from(turned)), count)


def rotation_from(vectors: np.ndarray):
    """SciPy's rotation for rotation vectors (N, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(vectors)


def _firings(tlm: Telemetry, start_ns: int) -> list[tuple[float, float]]:
    """Spans in which any thruster fired, merged. [s]"""
    spans = []
    for c in tlm.channels.values():
        if c.kind.stem in ("on_time", "pulse_count"):
            u = c.usable
            t = _seconds(u.tai_ns, start_ns)
            for k in np.flatnonzero(np.diff(u.values) > 0):
                spans.append((float(t[k]) - _BEFORE_S, float(t[k + 1]) + _AFTER_S))
    merged: list[tuple[float, float]] = []
    for a, b in sorted(spans):
        if merged and a <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(b, merged[-1][1])
        else:
            merged.append((a, b))
    return merged


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


def _sorted_into(momentum: MomentumSamples, arcs) -> MomentumSamples:
    """The samples that lie in an arc, each with its arc's number."""
    arc = np.full(len(momentum.time_s), -1)
    for k, (a, b) in enumerate(arcs):
        arc[(momentum.time_s >= a) & (momentum.time_s < b)] = k
    keep = arc >= 0
    m = momentum
    return MomentumSamples(m.time_s[keep], m.direction[keep], m.value_Nms[keep], m.unit[keep], m.count[keep], arc[keep])


def _momentum(subject: Subject, start_ns: int, blocks: Blocks, doubts: list[str]):
    """Samples of momentum, the spans with one set of wheels each, and of what holds it the names and momentum per reading."""
    tlm = subject.telemetry
    if not tlm.members("wheel_rate") and tlm.has_axes("wheel_momentum"):
        sources: list[_Source] = [(tlm.channel(f"wheel_momentum_{a}"), np.eye(3)[j], None) for j, a in enumerate(AXES)]
        names = tuple(f"wheel_momentum_{a}" for a in AXES)
    else:
        subject.wheels()  # refuses unknown and missing wheels
        sources = _wheels_in(subject)
        names = tuple(w.name for _, _, w in sources if w is not None)
    spans = _wheel_spans(sources, subject, start_ns, doubts)
    parts = [
        _components([s for s in sources if _reports(s, a, b, start_ns)], a, b, start_ns, blocks, doubts)
        for a, b in spans
    ]
    samples = MomentumSamples(
        *(np.concatenate([getattr(p, f) for p in parts]) for f in MomentumSamples.__annotations__)
    )
    return samples, spans, names, np.array([d for _, d, _ in sources])


def _wheels_in(subject: Subject) -> list[_Source]:
    """Rate channel, momentum per rate, and wheel: all that are in service at some time of the record."""
    tlm = subject.telemetry
    first, last = tlm.span()
    found: list[_Source] = []
    for w in subject.craft.craft.wheels:
        name = f"wheel_rate_{w.name}"
        if name not in tlm:
            continue
        if not tlm.dated:
            if subject.craft.wheel(w.name) is not w:
                continue
            c = tlm.channel(name).usable
        else:
            if (w.valid_to or last + 1) <= first or (w.valid_from or first) > last:
                continue
            c = tlm.channel(name).usable
            c = c.where((c.tai_ns >= (w.valid_from or first)) & (c.tai_ns < (w.valid_to or last + 1)))
        if len(c.tai_ns) >= 2:
            found.append((c, np.array(w.axis, float) * (1.0 if w.spin_inertia is None else w.spin_inertia), w))
    return found


def _reports(source, start_s: float, stop_s: float, start_ns: int) -> bool:
    t = _seconds(source[0].tai_ns, start_ns)
    return bool(np.any((t >= start_s) & (t < stop_s)))


def _wheel_spans(sources, subject: Subject, start_ns: int, doubts: list[str]) -> list[tuple[float, float]]:
    """Spans over which one set of wheels is in service, and all of it reports.

    Raises BadInput where there is none."""
    covers = [_seconds(c.tai_ns[[0, -1]], start_ns) for c, _, _ in sources]
    service = [_service_s(w, start_ns) for _, _, w in sources]
    first, last = min(a for a, _ in covers), max(b for _, b in covers) + 1e-6
    edges = {first, last} | {t for s in service for t in s if first < t < last}
    edges |= {a for a, _ in covers if a > first + _SWITCHED_S}
    edges |= {b + 1e-6 for _, b in covers if b < last - _SWITCHED_S}
    spans: list[tuple[float, float, list[str]]] = []
    silent: list[tuple[float, float, list[str]]] = []
    for a, b in pairwise(sorted(edges)):
        missing = [
            s[2].name if s[2] else s[0].name for s, (x, y) in zip(sources, service, strict=True)
            if x < b and y > a and not _reports(s, a, b, start_ns)
        ]  # fmt: skip
        (silent if missing else spans).append((a, b, missing))
    for a, b, missing in silent:
        x, y = _from_epoch(subject.telemetry, start_ns, [(a, b)])[0]
        doubts.append(
            f"from {x:.0f} to {y:.0f} s no rate of {some_of(missing)} is known, so the momentum is not: left out"
        )
    if not spans:
        raise BadInput(
            "at no time do all wheels in service report",
            file=subject.telemetry.source or None,
            channel=f"wheel_rate_{silent[0][2][0]}",
            remedy="A wheel that is switched off needs valid_from or valid_to in the craft file.",
        )
    if len(spans) > 1:
        doubts.append(f"the set of wheels in service changes: the momentum begins anew in each of {len(spans)} spans")
    return [(a, b) for a, b, _ in spans]


def _service_s(wheel: Wheel | None, start_ns: int) -> tuple[float, float]:
    """When a wheel serves, seconds from the record's start."""
    if wheel is None:
        return -np.inf, np.inf
    start = -np.inf if wheel.valid_from is None else (wheel.valid_from - start_ns) / NS
    return start, np.inf if wheel.valid_to is None else (wheel.valid_to - start_ns) / NS


def _components(
    sources, start_s: float, stop_s: float, start_ns: int, blocks: Blocks, doubts: list[str]
) -> MomentumSamples:
    """Components of momentum that are measured at one instant each, with independent errors."""
    series = []
    for c, direction, _ in sources:
        t = _seconds(c.tai_ns, start_ns)
        inside = (t >= start_s) & (t < stop_s)
        series.append((*blocks.averaged(t[inside], c.values[inside]), direction))
    D = np.array([s[3] for s in series])  # (n, 3)
    common = series[0][0]
    for s in series[1:]:
        common = np.intersect1d(common, s[0])
    if len(common) > 0.5 * max(len(s[0]) for s in series):
        at = [np.searchsorted(s[0], common) for s in series]
        h = sum(np.outer(s[1][i], s[3]) for s, i in zip(series, at, strict=True))
        # errors of single wheels are independent: so are these components of their sum
        variance, axes = np.linalg.eigh(D.T @ D)
        unit = np.sqrt(np.maximum(variance, 1e-6 * variance.max()))
        n = len(common)
        return MomentumSamples(
            np.repeat(common, 3), np.tile(axes.T, (n, 1)), (h @ axes).ravel(), np.tile(unit, n),
            np.repeat(series[0][2][at[0]], 3), np.zeros(3 * n, int),
        )  # fmt: skip
    if len(series) != 3 or np.linalg.cond(D) > 1e3:
        raise BadInput(
            "the wheels are read at different instants and are not three independent ones: their sum is not known at any",
            channel=sources[0][0].name,
            remedy="Give all wheel rates at common instants.",
        )
    doubts.append("the wheels are read at different instants: each reading is taken at its own")
    dual = np.linalg.inv(D)  # columns: a direction along which one wheel alone has momentum
    return MomentumSamples(
        np.concatenate([s[0] for s in series]),
        np.concatenate(
            [np.tile(dual[:, k] / np.linalg.norm(dual[:, k]), (len(s[0]), 1)) for k, s in enumerate(series)]
        ),
        np.concatenate([s[1] / np.linalg.norm(dual[:, k]) for k, s in enumerate(series)]),
        np.concatenate([np.full(len(s[0]), 1 / np.linalg.norm(dual[:, k])) for k, s in enumerate(series)]),
        np.concatenate([s[2] for s in series]),
        np.zeros(sum(len(s[0]) for s in series), int),
    )
