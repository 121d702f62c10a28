"""Screening: what is wrong with received samples, counted, and marked where it must not be used.

Only the order of time and declared wraps are repaired.  Each test asks what the channel's own noise and
quantisation would produce, and reports only what they do not explain.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import median_filter
from scipy.special import pdtrc

from ..kit.errors import BadInput
from ..kit.scatter import MEDIAN_SIZE, difference_sigma
from ..kit.timeline import NS, segments
from .channels import AXES, kind_of
from .findings import ERROR_TOO_FAST, IMPLAUSIBLE, NOT_UNIT, RATE_SCALE, Finding
from .telemetry import BRIDGED, Channel, Telemetry

if TYPE_CHECKING:
    from ..kit.doubts import Doubt

SPIKE_SIGMAS = 20.0  # far beyond noise; kicks of a sticking wheel reach 10 on their own channel
AGREE = 0.2  # a spike's neighbours differ among themselves by less than this part of its height
STUCK_RUN = 10  # samples; shorter runs of one value are repeats
LATE_FEW, LATE_PART = 3, 0.01  # up to this many late samples count as disorder, more as a clock running backwards
CHANCE = 1e-6  # significance: an event less probable than this is not due to noise and quantisation

#: Quantities whose noise never repeats bit for bit: a repeated value is stale.
_MEASURED = frozenset({
    "wheel_rate", "body_rate", "attitude_error", "rate_error", "controller_rate_error", "quaternion",
    "wheel_momentum", "wheel_momentum_magnitude", "orbit_position", "orbit_velocity",
})  # fmt: skip

_NOT_UNIT = 0.1  # by which a unit vector's length may be off
#: Doubts that a unit is not the one written.
_OF_UNITS = (IMPLAUSIBLE, ERROR_TOO_FAST, RATE_SCALE)

#: Findings that need inspection before the data are used (exit code 3 of `telemetry check`).
SERIOUS = frozenset({"conflict", "spike", "stuck", "norm", "fall"})


def screen(telemetry: Telemetry, craft=None) -> Telemetry:
    """The same telemetry in order of time, with findings, doubts and unusable samples marked.

    ``craft`` serves only to test wheel rates against its rate limits (rpm labelled rad/s).
    Raises BadInput where time runs backwards for more than a few samples."""
    channels, findings = _in_order(telemetry)
    for name, c in list(channels.items()):
        if c.kind.behaves == "state":
            findings += _pauses(c)
            continue
        for test in (_unwrapped, _without_spikes, _without_stuck, _without_repeats):
            c, found = test(c)
            findings += found
        findings += _falls(c) + _pauses(c)
        channels[name] = c
    for look in (_without_repeated_frames, _whole_quaternions):
        channels, found = look(channels)
        findings += found
    rows = np.unique(telemetry.label_tai_ns, return_index=True)
    return replace(
        telemetry,
        channels=channels,
        label_tai_ns=rows[0],
        time_labels={k: v[rows[1]] for k, v in telemetry.time_labels.items()},
        findings=(*telemetry.findings, *findings),
        doubts=telemetry.doubts + _implausible(channels, craft) + _sun_length(channels),
    )


# ---- the order of time ----------------------------------------------------------------------------


def _in_order(telemetry: Telemetry) -> tuple[dict[str, Channel], list[Finding]]:
    """Each channel increasing in time: a few late samples sorted, the first of duplicates kept."""
    late: set[int] = set()
    identical: set[int] = set()
    differing: set[int] = set()
    channels = {}
    for name, c in telemetry.channels.items():
        step = np.diff(c.tai_ns)
        if (step > 0).all():
            channels[name] = c
            continue
        if (step < 0).any():
            late.update(c.tai_ns[_late(c, telemetry)].tolist())
            c = c.where(np.argsort(c.tai_ns, kind="stable"))
        first = np.concatenate(([True], np.diff(c.tai_ns) > 0))
        kept = np.flatnonzero(first)[np.cumsum(first) - 1]  # for each sample, the one kept at its instant
        same = c.values == c.values[kept]
        differing.update(c.tai_ns[~first & ~same].tolist())
        identical.update(c.tai_ns[~first & same].tolist())
        channels[name] = c.where(first)
    found = []
    for what, instants, detail in (
        ("disorder", late, "late samples, sorted into place"),
        ("duplicate", identical - differing, "time stamps occur twice with the same values; the first is kept"),
        ("conflict", differing, "time stamps occur twice with different values; the first is kept"),
    ):
        if instants:
            found.append(Finding("", what, len(instants), min(instants), detail))
    return channels, found


def _late(c: Channel, telemetry: Telemetry) -> np.ndarray:
    """Samples out of order: all but a longest non-decreasing subsequence."""
    from bisect import bisect_right

    tails: list[int] = []
    length = np.empty(len(c.tai_ns), np.int64)
    for i, t in enumerate(c.tai_ns.tolist()):
        k = bisect_right(tails, t)
        tails[k : k + 1] = [t]
        length[i] = k
    in_order, want, last = np.zeros(len(length), bool), len(tails) - 1, c.tai_ns.max()
    for i in range(len(length) - 1, -1, -1):
        if length[i] == want and c.tai_ns[i] <= last:
            in_order[i], last, want = True, c.tai_ns[i], want - 1
    late = np.flatnonzero(~in_order)
    if len(late) > max(LATE_FEW, LATE_PART * len(length)) or 2 * len(late) >= len(length):
        back = int(np.flatnonzero(np.diff(c.tai_ns) < 0)[0]) + 1
        raise BadInput(
            f"time runs backwards: {telemetry.describe_time(int(c.tai_ns[back]))} follows "
            f"{telemetry.describe_time(int(c.tai_ns[back - 1]))}, and {len(late)} of {len(length)} samples are out of order",
            channel=c.name,
            time=telemetry.describe_time(int(c.tai_ns[back])),
            remedy="Sort the table by time, or divide it where the clock was reset.",
        )
    return late


def _pauses(c: Channel) -> list[Finding]:
    """Dropouts (at most BRIDGED samples missing) and gaps, by the channel's own cadence."""
    found, cadence = [], c.cadence_ns
    for what, spans in (("dropout", dropouts(c)), ("gap", gaps(c))):
        if spans:
            longest = max(b - a for a, b in spans) / NS
            missing = sum(round((b - a) / cadence) - 1 for a, b in spans)
            word = "longest" if len(spans) > 1 else "of"
            found.append(
                Finding(c.name, what, len(spans), spans[0][0], f"{missing} samples missing, {word} {longest:g} s")
            )
    return found


def gaps(c: Channel) -> list[tuple[int, int]]:
    """(last sample before, first after) of every gap: more than BRIDGED samples missing. [ns TAI]"""
    if not _is_regular(c):
        return []
    cuts = segments(c.tai_ns, BRIDGED, c.cadence_ns)
    return [(int(c.tai_ns[a.stop - 1]), int(c.tai_ns[b.start])) for a, b in pairwise(cuts)]


def dropouts(c: Channel) -> list[tuple[int, int]]:
    """(last sample before, first after) of every run of 1 to BRIDGED missing samples. [ns TAI]"""
    if not _is_regular(c):
        return []
    steps, cadence = np.diff(c.tai_ns), c.cadence_ns
    missed = (steps > 1.5 * cadence) & (steps <= (BRIDGED + 1.5) * cadence)
    return [(int(c.tai_ns[i]), int(c.tai_ns[i + 1])) for i in np.flatnonzero(missed)]


def _is_regular(c: Channel) -> bool:
    """A channel sampled on events has no cadence, so no gaps."""
    steps, cadence = np.diff(c.tai_ns), c.cadence_ns
    return len(steps) >= 2 and bool(np.mean(np.abs(steps - cadence) < 0.3 * cadence) > 0.5)


# ---- noise and quantisation -------------------------------------------------------------------------

_MEDIAN_OF_SECOND = MEDIAN_SIZE * 6**0.5  # median |x0 - 2 x1 + x2| of unit white noise


def sample_noise(c: Channel) -> float:
    """White noise of one sample, from local second differences (median, so events do not count). SI

    0 where more than half of them are zero: the noise is then below the quantisation step."""
    if len(c.tai_ns) < 5:
        return 0.0
    v, steps = c.usable.values, np.diff(c.usable.tai_ns)
    even = np.abs(steps - c.cadence_ns) <= 0.5 * c.cadence_ns  # samples that follow each other at the cadence
    sigma = difference_sigma(v, 2, even[:-1] & even[1:])
    return sigma if np.isfinite(sigma) else 0.0


def quantisation_step(values: np.ndarray) -> float:
    """The step all values are multiples of, from their smallest differences. SI; 0 where there is none."""
    levels = np.unique(values)
    steps = np.diff(levels)
    steps = steps[steps > 1e-12 * np.maximum(np.abs(levels[1:]), np.abs(levels[:-1]))]
    if len(steps) == 0:
        return 0.0
    smallest = float(np.min(steps))
    for divisor in (1, 2, 3):  # the smallest difference seen may be two or three steps
        q = smallest / divisor
        near = steps[steps < 1000 * q]
        counts = np.rint(near / q)
        q = float(near @ counts / (counts @ counts))
        # twenty differences that are all multiples are not a coincidence, however sparse the levels
        if np.quantile(np.abs(near / q - counts), 0.99) < 0.1 and len(near) >= min(20, 0.5 * len(steps)):
            return q
    return 0.0


# ---- single channels ----------------------------------------------------------------------------------


def _unwrapped(c: Channel) -> tuple[Channel, list[Finding]]:
    """Unwrap a declared modulus within each gap-free stretch; across a gap the number of turns is not known."""
    if c.modulus <= 0:
        return c, []
    values, count, first = c.values.copy(), 0, 0
    for part in segments(c.tai_ns, BRIDGED, c.cadence_ns):
        jumps = np.abs(np.diff(c.values[part])) > c.modulus / 2
        if jumps.any():
            values[part] = np.unwrap(c.values[part], period=c.modulus)
            first = first or int(c.tai_ns[part][1:][jumps][0])
            count += int(jumps.sum())
    c = replace(c, values=values, modulus=0.0)
    return c, [Finding(c.name, "wrap", count, first, "wraps at the declared modulus, unwrapped")] if count else []


def _without_spikes(c: Channel) -> tuple[Channel, list[Finding]]:
    """Single samples far off both neighbours, which agree with each other and with theirs.

    A kick, a step or the apex of a triangle has at least one neighbour between: those are kept."""
    n = len(c.values)
    if c.kind.behaves == "steps" or n < 7:
        return c, []
    x = np.pad(c.values, 2, mode="edge")
    before2, before, here, after, after2 = x[:-4], x[1:-3], c.values, x[3:-1], x[4:]
    height = np.abs(here - (before + after) / 2)
    # noise may change with time: the larger of the whole record's and that of about 30 samples, by a running median
    bend = np.abs(before - 2 * here + after)
    sigma = max(float(np.median(bend)), 1e-12 * float(np.max(np.abs(here)))) / _MEDIAN_OF_SECOND
    local = median_filter(bend, min(31, n), mode="nearest") / _MEDIAN_OF_SECOND
    floor = np.maximum(np.maximum(sigma, local), max(c.count_size, quantisation_step(c.values)) / 2)
    steps = np.diff(c.tai_ns)
    beside = np.concatenate(([False], np.maximum(steps[:-1], steps[1:]) <= 3.5 * c.cadence_ns, [False]))
    spike = beside & (height > SPIKE_SIGMAS * floor)
    for a, b in ((before, after), (before2, before), (after, after2)):
        spike &= np.abs(a - b) < AGREE * height
    return _marked(c, spike, "spike", "single samples far off both neighbours, not used")


def _without_stuck(c: Channel) -> tuple[Channel, list[Finding]]:
    """A noisy sensor that repeats one value for a long run."""
    if c.kind.stem not in _MEASURED or len(c.values) < 3 * STUCK_RUN:
        return c, []
    if (c.values == c.values[0]).all():
        detail = f"the same value throughout, {c.values[0]:g}: a stuck sensor, or motion below one count? Used"
        return c, [Finding(c.name, "still", len(c.values), int(c.tai_ns[0]), detail)]
    stuck, still = np.zeros(len(c.values), bool), np.zeros(len(c.values), bool)
    step = quantisation_step(c.values)
    for start, stop in _runs(np.diff(c.values) == 0):
        if stop - start + 1 < STUCK_RUN:
            continue
        change = np.diff(c.values[max(0, start - 60) : start + 1])
        if len(change) < STUCK_RUN or np.std(change) <= step:
            continue
        natural = (np.sum(change == 0) + 1) / (len(change) + 2)
        if natural ** (stop - start) > CHANCE:
            continue
        # differences of noise are anticorrelated (-1/2); those of a smooth motion that comes to rest are not
        noisy = np.sum(change[1:] * change[:-1]) < -0.2 * np.sum(change**2)
        rest = c.kind.stem == "wheel_rate" and c.values[stop] == 0  # a wheel at rest reads exactly zero
        abrupt = np.median(np.abs(change[-5:])) > max(5 * step, 0.3 * np.median(np.abs(change)))
        if not rest and (noisy or abrupt):
            (stuck if noisy else still)[start + 1 : stop + 1] = True
    c, found = _marked(c, stuck, "stuck", "samples repeat one value after noisy ones; not used")
    if still.any():
        detail = "samples repeat one value after motion: a stuck sensor, or rest? Used"
        found.append(Finding(c.name, "still", int(still.sum()), int(c.tai_ns[still][0]), detail))
    return c, found


def _without_repeats(c: Channel) -> tuple[Channel, list[Finding]]:
    """Short runs of one value in a noisy channel, more frequent than quantisation produces."""
    change = np.diff(c.values)
    if c.kind.stem not in _MEASURED | {"control_torque"} or len(change) < 20 or not change.any():
        return c, []
    step = max(quantisation_step(c.values), 1e-15 * float(np.max(np.abs(c.values))))
    moves = np.abs(change[change != 0])
    typical = float(np.median(moves))
    if typical < 10 * step:
        return c, []
    repeated, isolated = np.zeros(len(c.values), bool), 0
    for start, stop in _runs(change == 0):
        inside = start > 0 and stop < len(change)
        if inside and stop - start < STUCK_RUN - 1 and min(abs(change[start - 1]), abs(change[stop])) > 3 * step:
            repeated[start + 1 : stop + 1] = True
            isolated += 1
    # from quantisation alone, no change is about as frequent as any other small change of one step
    width = max(5 * step, float(np.quantile(moves, 0.1)))
    expected = 1.5 * np.sum(moves <= width) * step / (2 * width)
    if isolated == 0 or pdtrc(isolated - 1, expected) > CHANCE:
        return c, []
    if c.kind.stem == "control_torque":  # a command may be held
        first = int(c.tai_ns[repeated][0])
        return c, [
            Finding(c.name, "repeat", int(repeated.sum()), first, "samples repeat the previous value bit for bit")
        ]
    return _marked(c, repeated, "repeat", "samples repeat the previous value bit for bit: stale, not used")


def _falls(c: Channel) -> list[Finding]:
    """Cumulative counts that decrease, and sawteeth: undeclared wraps or resets."""
    x, t = c.usable.values, c.usable.tai_ns
    if len(x) < 6:
        return []
    jump = np.diff(x)
    if c.kind.stem == "accelerometer_count":  # counts down as well as up, by thrust and by its own bias
        hit = np.abs(jump) > max(0.5 * float(np.ptp(x)), 50 * float(np.median(np.abs(jump))) + 1)
        detail = "jumps over much of its range: a wrap (declare it in a channel dictionary) or a reset"
    elif c.kind.behaves == "cumulative":
        hit = jump < 0
        detail = "decreases although it is cumulative: a wrap (declare it in a channel dictionary) or a reset"
    elif c.kind.stem in ("wheel_rate", "attitude_error"):
        hit = np.abs(jump) > max(0.75 * np.ptp(x), 50 * sample_noise(c))
        for i in np.flatnonzero(hit):
            before, after = jump[max(0, i - 5) : i], jump[i + 1 : i + 6]
            drift = [
                np.sign(d.mean()) if len(d) and np.abs(d.sum()) > 3 * sample_noise(c) else 0 for d in (before, after)
            ]
            hit[i] = drift[0] == drift[1] == -np.sign(jump[i])
        detail = "jumps over its whole range against its own drift: an undeclared wrap?"
    else:
        return []
    if not hit.any():
        return []
    first = int(np.flatnonzero(hit)[0])
    return [
        Finding(c.name, "fall", int(hit.sum()), int(t[first + 1]), f"{detail} ({x[first]:.6g} to {x[first + 1]:.6g})")
    ]


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """[start, stop) of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _marked(c: Channel, hit: np.ndarray, what: str, detail: str) -> tuple[Channel, list[Finding]]:
    hit = hit & c.valid
    if not hit.any():
        return c, []
    return replace(c, valid=c.valid & ~hit), [Finding(c.name, what, int(hit.sum()), int(c.tai_ns[hit][0]), detail)]


# ---- several channels -------------------------------------------------------------------------------


def _without_repeated_frames(channels: dict[str, Channel]) -> tuple[dict[str, Channel], list[Finding]]:
    """Instants at which all noisy channels sampled together repeat their previous values."""
    frames: dict[bytes, list[str]] = {}
    for name, c in channels.items():
        if c.kind.stem in _MEASURED and len(c.values) >= 20 and np.any(np.diff(c.values)):
            frames.setdefault(c.tai_ns.tobytes(), []).append(name)
    channels, findings = dict(channels), []
    for names in frames.values():
        same = np.array([np.diff(channels[n].values) == 0 for n in names])
        whole = np.all(same, axis=0)
        by_chance = np.prod(same.mean(axis=1)) * whole.size
        # a long run of equal frames, or one at either end, is rest and not repetition
        for start, stop in _runs(whole):
            whole[start:stop] = start > 0 and stop < whole.size and stop - start < STUCK_RUN - 1
        if len(names) < 3 or not whole.any() or pdtrc(whole.sum() - 1, min(by_chance, 1e-3 * whole.size)) > CHANCE:
            continue
        hit = np.concatenate(([False], whole))
        for n in names:
            channels[n] = replace(channels[n], valid=channels[n].valid & ~hit)
        first = int(channels[names[0]].tai_ns[hit][0])
        findings.append(
            Finding("", "repeat", int(hit.sum()), first, f"frames of {len(names)} channels repeat the previous frame bit for bit; not used")
        )  # fmt: skip
    return channels, findings


def _whole_quaternions(channels: dict[str, Channel]) -> tuple[dict[str, Channel], list[Finding]]:
    """A quaternion is used only with all four components at one instant and unit length."""
    names = [f"quaternion_{m}" for m in "wxyz"]
    if not all(n in channels for n in names):
        return channels, []
    parts = [channels[n] for n in names]
    instants = parts[0].tai_ns
    for p in parts[1:]:
        instants = np.intersect1d(instants, p.tai_ns, assume_unique=True)
    rows = [np.searchsorted(p.tai_ns, instants) for p in parts]
    q = np.stack([p.values[r] for p, r in zip(parts, rows, strict=True)], axis=1)
    usable = np.all([p.valid[r] for p, r in zip(parts, rows, strict=True)], axis=0)
    off = usable & (np.abs(np.linalg.norm(q, axis=1) - 1) > 1e-3)
    channels = dict(channels)
    for n, p, r in zip(names, parts, rows, strict=True):
        valid = np.zeros(len(p.valid), bool)
        valid[r] = usable & ~off
        channels[n] = replace(p, valid=valid)
    if not off.any():
        return channels, []
    return channels, [Finding("quaternion_w", "norm", int(off.sum()), int(instants[off][0]), "quaternions do not have unit length; not used")]  # fmt: skip


def _implausible(channels: dict[str, Channel], craft) -> list[Doubt]:
    """Implausible magnitudes: most often the unit in the heading is not that of the column."""
    limits = {} if craft is None else {w.name: w.rate_limit for w in craft.wheels if w.rate_limit}
    beyond: dict[tuple[str, float, str], list[tuple[str, float]]] = {}
    for c in channels.values():
        kind, whose = c.kind, "the plausible limit"
        limit = kind.plausible
        if kind.stem == "wheel_rate" and c.member in limits:
            limit, whose = 1.05 * limits[c.member], f"{craft.name}'s wheel rate limit"
        if limit is None or not c.valid.any():
            continue
        size = np.abs(c.usable.values)
        if np.mean(size > limit) > 0.01:  # a short outlier is not a wrong unit
            beyond.setdefault((kind.stem, limit, whose), []).append((c.name, float(np.max(size))))
    doubts = []
    for (stem, limit, whose), those in beyond.items():
        kind = next(kind_of(n) for n, _ in those)
        given = channels[those[0][0]].unit_given
        guess = f": are the values {kind.mistaken_for} labelled {given}?" if kind.mistaken_for else ""
        doubts.append(
            IMPLAUSIBLE(
                channels=[n for n, _ in those],
                largest=max(v for _, v in those),
                unit=kind.unit or stem,
                limit=limit,
                limit_of=whose,
                guess=guess,
            )
        )
    return doubts


def _sun_length(channels: dict[str, Channel]) -> list[Doubt]:
    """A sun vector that is neither zero nor of unit length."""
    parts = [channels[n].usable for n in (f"sun_direction_{a}" for a in AXES) if n in channels]
    if len(parts) < 3 or len({len(p.values) for p in parts}) > 1:
        return []
    length = np.linalg.norm([p.values for p in parts], axis=0)
    length = length[length > 0]
    off = np.abs(length - 1) > _NOT_UNIT
    return [NOT_UNIT(length=float(np.median(length[off])))] if len(length) and np.mean(off) > 0.05 else []


# ---- summary -----------------------------------------------------------------------


@dataclass(frozen=True)
class ChannelSummary:
    """One channel in a line: how it was sampled, and what is suspicious.  SI, seconds from the epoch."""

    name: str
    unit: str
    samples: int
    unused: int
    cadence_s: float | None
    first_s: float
    last_s: float
    dropouts: int
    gaps: tuple[tuple[float, float], ...]
    quantisation: float | None
    noise: float | None
    suspicions: tuple[str, ...]


def summaries(telemetry: Telemetry) -> list[ChannelSummary]:
    """One line per channel, in file order."""
    lines = []
    for c in telemetry.channels.values():
        at, state = telemetry.seconds(c.tai_ns), c.kind.behaves == "state"
        odd = [f"{f.what} {f.count}" for f in telemetry.findings if f.channel == c.name and f.what not in ("gap", "dropout", "wrap")]  # fmt: skip
        odd += ["unit?" for d in telemetry.doubts.of(*_OF_UNITS) if c.name in d.about["channels"].split(", ")]
        lines.append(
            ChannelSummary(
                name=c.name,
                unit=c.kind.unit,
                samples=len(c.values),
                unused=int((~c.valid).sum()),
                cadence_s=c.cadence_ns / NS if len(at) > 1 else None,
                first_s=float(at[0]),
                last_s=float(at[-1]),
                dropouts=len(dropouts(c)),
                gaps=tuple((float(telemetry.seconds(a)), float(telemetry.seconds(b))) for a, b in gaps(c)),
                quantisation=None if state else c.count_size or quantisation_step(c.usable.values) or None,
                noise=None if state or c.kind.behaves == "cumulative" or len(at) < 5 else sample_noise(c),
                suspicions=tuple(odd),
            )
        )
    return lines


def needs_a_look(telemetry: Telemetry) -> bool:
    """Whether the data need inspection before use: a serious finding, or a doubt that they contradict themselves."""
    return any(d.is_grave for d in telemetry.doubts) or any(f.what in SERIOUS for f in telemetry.findings)
