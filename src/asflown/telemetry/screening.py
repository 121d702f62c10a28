"""Screening: what is wrong with received samples, counted, and marked where it must not be used.

Only the order of time and declared wraps are repaired.  Each test asks what the channel's own noise and
quantisation would produce, and reports only what they do not explain.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..kit.scatter import MEDIAN_SIZE, difference_sigma
from ..kit.timeline import NS, segments
from .channels import AXES, kind_of, to_si
from .findings import ERROR_TOO_FAST, IMPLAUSIBLE, NO_SIGN, NOT_UNIT, RATE_SCALE, Finding
from .order import in_order
from .telemetry import BRIDGED, Channel, Telemetry, common_instants

if TYPE_CHECKING:
    from ..kit.doubts import Doubt

SPIKE_SIGMAS = 20.0  # far beyond noise; kicks of a sticking wheel reach 10 on their own channel
AGREE = 0.2  # a spike's neighbours differ among themselves by less than this part of its height
STUCK_RUN = 10  # samples; shorter runs of one value are repeats
_FEW = 0.01  # share of the samples: fewer beyond a limit are outliers, more are a wrong unit
_OVER_LIMIT = 1.05  # times a wheel's rate limit
_FEWEST = 7  # samples that a channel needs to be judged
_FAR, _NEAR = (
    10.0,
    1.0,
)  # ranges of all other samples that a fill value lies away; one of the usual fill values may be nearer
_PLATEAU = 3  # samples at the end of the range
_FINE = 10.0  # quantisation steps of a typical change, from which a channel seldom repeats by chance
_DRIFT = 30  # samples that tell which way a channel drifts
CHANCE = 1e-6  # significance: an event less probable than this is not due to noise and quantisation

#: Quantities whose noise never repeats bit for bit: a repeated value is stale.
_MEASURED = frozenset({
    "wheel_rate", "body_rate", "attitude_error", "rate_error", "controller_rate_error", "quaternion",
    "wheel_momentum", "wheel_momentum_magnitude", "orbit_position", "orbit_velocity",
})  # fmt: skip

_NOT_UNIT = 0.1  # by which a unit vector's length may be off
#: Quantities with a sign: a wrapped value stands for the turn nearest zero.
_SIGNED = frozenset({"wheel_rate", "body_rate", "attitude_error", "rate_error", "control_torque", "wheel_torque"})

#: More rows of one value than this share are a state of the craft, and no unfilled packets.
_MOST_UNFILLED = 0.3

#: Usual fill values; of 16 and 32 bits, of spreadsheets, and of NetCDF and CDF.
_FILL_VALUES = frozenset(np.float32(v) for v in (
    999, 9999, 99999, 999999, 9999.9, 99999.9, 32767, 32768, 65535, 2147483647, 2147483648, 4294967295, 1e20, 1e30, 1e31, 9.969209968386869e36, 1e38, 3.4028234663852886e38,
))  # fmt: skip

#: Doubts that a unit is not the one written.
_OF_UNITS = (IMPLAUSIBLE, ERROR_TOO_FAST, RATE_SCALE)

#: Findings that need inspection before the data are used (exit code 3 of `telemetry check`).
SERIOUS = frozenset({"conflict", "spike", "stuck", "norm", "fall", "fill", "stray", "saturated", "unit"})


def screen(telemetry: Telemetry, craft=None) -> Telemetry:
    """The same telemetry in order of time, with findings, doubts and unusable samples marked.

    ``craft`` serves only to test wheel rates against its rate limits (rpm labelled rad/s).
    Raises BadInput where time runs backwards for more than a few samples."""
    channels, findings = in_order(telemetry)
    for look in (_of_one_sign, _without_unfilled):
        channels, found = look(channels)
        findings += found
    pauses = {id(c.tai_ns): _Pauses.of(c.tai_ns) for c in {id(c.tai_ns): c for c in channels.values()}.values()}
    screened = _each(partial(_screened, craft=craft, pauses=pauses), list(channels.values()))
    steps = {c.name: step for c, step, _ in screened if c.kind.behaves != "state"}
    channels = {c.name: c for c, _, _ in screened}
    findings += [f for _, _, found in screened for f in found]
    channels, found = _without_repeated_frames(channels, steps)
    findings += found
    channels, found = _whole_quaternions(channels)
    findings += found
    rows = np.unique(telemetry.label_tai_ns, return_index=True)
    return replace(
        telemetry,
        channels=channels,
        label_tai_ns=rows[0],
        time_labels={k: v[rows[1]] for k, v in telemetry.time_labels.items()},
        findings=(*telemetry.findings, *findings),
        doubts=telemetry.doubts + _implausible(channels, craft) + _sun_length(channels) + _without_sign(channels),
    )


def _each(look, channels: list[Channel]) -> list[tuple[Channel, float, list[Finding]]]:
    """What ``look`` makes of each channel; of long ones beside each other, as sorting and differencing run in threads."""
    if sum(len(c.values) for c in channels) < _LEVELS_FROM:
        return [look(c) for c in channels]
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(min(len(channels), os.cpu_count() or 1)) as pool:
        return list(pool.map(look, channels))


def _screened(c: Channel, craft, pauses: dict[int, _Pauses]) -> tuple[Channel, float, list[Finding]]:
    """One channel with unusable samples marked, its quantisation step, and what was found.

    ``pauses``: of every axis of times, by its id."""
    paused = pauses[id(c.tai_ns)].findings(c.name)
    if c.kind.behaves == "state":
        return c, 0.0, paused
    step = max(c.count_size, quantisation_step(c.values))
    findings: list[Finding] = []
    c, found = _within_limits(_unwrapped(c, findings), craft)
    findings += found
    for test in (_without_fills, _without_plateaus, _without_spikes, _without_stuck, _without_repeats):
        c, found = test(c, step)
        findings += found
    return c, step, [*findings, *_falls(c, step), *paused]


# ---- pauses -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Pauses:
    """Dropouts (at most BRIDGED samples missing) and gaps of one axis of times: (last sample before, first after). [ns TAI]"""

    cadence_ns: int
    dropouts: list[tuple[int, int]]
    gaps: list[tuple[int, int]]

    @classmethod
    def of(cls, tai_ns: np.ndarray) -> _Pauses:
        """By the axis' own cadence; one sampled on events has none, so no gaps."""
        steps = np.diff(tai_ns)
        if len(steps) == 0 or (steps == steps[0]).all():
            return cls(int(steps[0]) if len(steps) else 0, [], [])
        cadence = int(np.median(steps))
        if len(steps) < 2 or not np.mean(np.abs(steps - cadence) < 0.3 * cadence) > 0.5:
            return cls(cadence, [], [])
        missed = np.flatnonzero(steps > 1.5 * cadence)
        spans = [(int(tai_ns[i]), int(tai_ns[i + 1])) for i in missed]
        longest = (BRIDGED + 1.5) * max(cadence, 1)
        return cls(cadence, [s for s in spans if s[1] - s[0] <= longest], [s for s in spans if s[1] - s[0] > longest])

    def findings(self, channel: str) -> list[Finding]:
        found = []
        for what, spans in (("dropout", self.dropouts), ("gap", self.gaps)):
            if spans:
                longest = max(b - a for a, b in spans) / NS
                missing = sum(round((b - a) / self.cadence_ns) - 1 for a, b in spans)
                word = "longest" if len(spans) > 1 else "of"
                found.append(
                    Finding(channel, what, len(spans), spans[0][0], f"{missing} samples missing, {word} {longest:g} s")
                )
        return found


def gaps(c: Channel) -> list[tuple[int, int]]:
    """(last sample before, first after) of every gap: more than BRIDGED samples missing. [ns TAI]"""
    return _Pauses.of(c.tai_ns).gaps


def dropouts(c: Channel) -> list[tuple[int, int]]:
    """(last sample before, first after) of every run of 1 to BRIDGED missing samples. [ns TAI]"""
    return _Pauses.of(c.tai_ns).dropouts


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


#: A longer record's quantisation step is inferred from blocks of its samples, and its medians from evenly chosen ones.
_LEVELS_FROM, _BLOCK = 1 << 17, 1 << 14


def _few(x: np.ndarray) -> np.ndarray:
    """Samples that stand for all of them where a median or a quantile is wanted: 100,000 tell it to half a percent."""
    return x[:: len(x) // _LEVELS_FROM + 1]


def quantisation_step(values: np.ndarray) -> float:
    """The step all values are multiples of, from their smallest differences. SI; 0 where there is none."""
    if len(values) > _LEVELS_FROM:  # neighbouring samples have neighbouring levels: blocks of them serve
        starts = np.linspace(0, len(values) - _BLOCK, _LEVELS_FROM // _BLOCK).astype(int)
        values = np.concatenate([values[i : i + _BLOCK] for i in starts])
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


def _unwrapped(c: Channel, findings: list[Finding]) -> Channel:
    """Unwrap a declared modulus within each gap-free stretch.

    Across a gap the number of turns is not known: a quantity with a sign begins each stretch on the turn nearest zero, so that
    a negative value written without sign is read as negative."""
    if c.modulus <= 0:
        return c
    values, count, first = c.values.copy(), 0, 0
    for part in segments(c.tai_ns, BRIDGED, c.cadence_ns):
        jumps = np.abs(np.diff(c.values[part])) > c.modulus / 2
        if jumps.any():
            values[part] = np.unwrap(c.values[part], period=c.modulus)
            first = first or int(c.tai_ns[part][1:][jumps][0])
            count += int(jumps.sum())
        if c.kind.stem in _SIGNED:
            values[part] -= c.modulus * np.rint(float(np.median(values[part])) / c.modulus)
    if count:
        findings.append(Finding(c.name, "wrap", count, first, "wraps at the declared modulus, unwrapped"))
    return replace(c, values=values, modulus=0.0)


def _within_limits(c: Channel, craft) -> tuple[Channel, list[Finding]]:
    """A wheel's few samples beyond its rate limit; many of them are a wrong unit (``_implausible``)."""
    limits = {} if craft is None else {w.name: w.rate_limit for w in craft.wheels if w.rate_limit}
    if c.kind.stem != "wheel_rate" or c.member not in limits:
        return c, []
    beyond = np.abs(c.values) > _OVER_LIMIT * limits[c.member]
    if np.mean(beyond) > _FEW:
        return c, []
    return _marked(c, beyond, "fill", f"values beyond the wheel's rate limit of {limits[c.member]:.4g} rad/s; not used")


def _without_fills(c: Channel, step: float) -> tuple[Channel, list[Finding]]:
    """A value that recurs bit for bit far outside the range of all others, or where no motion leads.

    A step to another level, or motion, has values between, or does not come back."""
    if len(c.values) < _FEWEST:
        return c, []
    if c.kind.behaves == "cumulative":
        fill = _beside_its_count(c.values)
    else:
        fill = _far_off(c, step)
        if c.kind.stem in _MEASURED and not fill.all():
            fill |= _unreachable(c, fill, step)
    if not fill.any():
        return c, []
    said = ", ".join(f"{v:.6g}" for v in np.unique(c.values[fill])[:5])
    return _marked(
        c, fill, "fill", f"the value {said} {c.kind.unit} recurs far outside the range of all others; not used"
    )


def _far_off(c: Channel, step: float) -> np.ndarray:
    """Samples of a value that recurs far outside the range of all others, which are alike before and after it."""
    values = c.values
    fill, rest = np.zeros(len(values), bool), values
    for _ in range(3):  # more than one fill value may occur, the farthest first
        centre = float(np.median(_few(rest)))
        low, high = c.extremes if rest is values else (float(np.min(rest)), float(np.max(rest)))
        far = high if high - centre > centre - low else low
        known = far != 0 and _is_known(c, far)
        if far == 0 or np.count_nonzero(rest == far) < (1 if known else 2):
            break
        here = (values == far) & ~fill
        others = values[~fill & ~here]
        if len(others) < _FEWEST:
            break
        spread = float(np.ptp(others)) + 10 * step
        if abs(far - centre) < (_FAR if not known else _NEAR) * max(spread, 1e-12 * abs(far)):
            break
        if not known and not _comes_back(values, here, fill, 0.2 * abs(far - centre)):
            break
        if np.count_nonzero(here) == 1 and not (here[0] or here[-1]):
            break  # a single sample within is a spike
        fill, rest = fill | here, others
    return fill


def _comes_back(values, here, fill, within: float) -> bool:
    """Whether the samples before and after each run are alike."""
    sound = np.flatnonzero(~here & ~fill)
    starts, stops = _runs_of(here)
    before = np.searchsorted(sound, starts) - 1
    after = np.searchsorted(sound, stops - 1)
    inside = (before >= 0) & (after < len(sound))
    if not inside.any():
        return False
    return bool((np.abs(values[sound[before[inside]]] - values[sound[after[inside]]]) < within).all())


def _is_known(c: Channel, value: float) -> bool:
    """Whether a value, in SI or as it was written, is one of the usual fill values or all nines."""
    factor, shift = to_si(c.name, c.unit_given) if c.unit_given else (1.0, 0.0)
    for written in (abs(value), abs((value - shift) / factor)):
        digits = f"{written:.7g}".replace(".", "")
        with np.errstate(over="ignore"):
            usual = np.float32(written) in _FILL_VALUES
        if usual or (len(digits) >= 3 and set(digits) == {"9"}):
            return True
    return False


def _unreachable(c: Channel, fill: np.ndarray, step: float) -> np.ndarray:
    """Runs of one value that a wheel or an attitude cannot jump to: zeros within, and any value at the ends of the record.

    At an end the jump must dwarf every other change."""
    out = np.zeros(len(fill), bool)
    at = np.flatnonzero(~fill)
    v = c.values[at]
    change = np.abs(np.diff(v))
    if len(v) < _FEWEST or not change.any():
        return out
    floor = max(SPIKE_SIGMAS * sample_noise(c), 10 * step)
    last = len(v) - 1
    head, tail = int(np.argmax(v != v[0])), int(np.argmax(v[::-1] != v[last]))
    fewest = 1 if c.kind.stem in ("wheel_rate", "quaternion") else 2
    for run, place in ((slice(0, head), head - 1), (slice(last + 1 - tail, last + 1), last - tail)):
        largest = max(float(np.max(np.delete(change, place), initial=0)), floor)
        if fewest <= run.stop - run.start <= last // 2 and change[place] > SPIKE_SIGMAS * largest:
            out[at[run]] = True
    if c.kind.stem == "wheel_rate":
        for start, stop in zip(*(x.tolist() for x in _runs_of(v == 0)), strict=True):
            if stop - start > 1 and 0 < start and stop <= last and min(abs(v[start - 1]), abs(v[stop])) > floor:
                out[at[start:stop]] = abs(v[stop] - v[start - 1]) < AGREE * abs(v[start - 1])
    return out


def _beside_its_count(values: np.ndarray) -> np.ndarray:
    """Runs of one value in a counter that goes on behind them where it was before."""
    out = np.zeros(len(values), bool)
    turn = np.flatnonzero(np.diff(values) != 0) + 1
    for start, stop in pairwise(turn.tolist()):
        before, here, after = values[start - 1], values[start], values[stop]
        out[start:stop] = before <= after and not before <= here <= after
    return out


def _without_plateaus(c: Channel, step: float) -> tuple[Channel, list[Finding]]:
    """A sensor at the end of its range: the channel's largest or smallest value held, entered and left at once."""
    if c.kind.stem not in _MEASURED or len(c.values) < _FEWEST:
        return c, []
    flat = np.zeros(len(c.values), bool)
    for extreme in c.extremes[::-1]:
        at_end = c.values == extreme
        if np.count_nonzero(at_end) < _PLATEAU:
            continue
        starts, stops = _runs_of(at_end)
        inside = (starts > 0) & (stops < len(c.values)) & (stops - starts >= _PLATEAU)
        if not inside.any():
            continue
        change, floor = np.abs(np.diff(c.values)), max(3 * step, 3 * sample_noise(c))
        starts, stops = starts[inside], stops[inside]
        abrupt = (change[starts - 1] > floor) & (change[stops - 1] > floor)
        starts, stops = starts[abrupt], stops[abrupt]
        if len(starts) < 2 and not (stops - starts >= 2 * _PLATEAU).any():
            continue  # one short plateau may be the top of a curve
        for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
            flat[start:stop] = True
    return _marked(
        c, flat, "saturated", "the channel's extreme value is held: a sensor at the end of its range? Not used"
    )


def _without_spikes(c: Channel, step: float) -> tuple[Channel, list[Finding]]:
    """Single samples far off both neighbours, which agree with each other and with theirs.

    A kick, a step or the apex of a triangle has at least one neighbour between: those are kept."""
    n = len(c.values)
    if c.kind.behaves == "steps" or n < _FEWEST:
        return c, []
    x = c.values
    bend = np.diff(x, 2)
    np.abs(bend, out=bend)  # of samples 1 to n - 2: twice the height over both neighbours
    sigma = max(float(np.median(_few(bend))), 1e-12 * max(abs(e) for e in c.extremes)) / _MEDIAN_OF_SECOND
    at = np.flatnonzero(bend > 2 * SPIKE_SIGMAS * max(sigma, step / 2)) + 1
    around = [x[np.clip(at + k, 0, n - 1)] for k in (-2, -1, 1, 2)]
    alike = c.valid[at]
    for a, b in ((1, 2), (0, 1), (2, 3)):
        alike &= np.abs(around[a] - around[b]) < AGREE * bend[at - 1] / 2
    at = at[alike]
    if len(at) == 0:
        return c, []
    # noise may change with time: that of about 30 samples must be exceeded too
    width = min(31, n - 2)
    near = np.clip(at - 1 - width // 2, 0, n - 2 - width)[:, None] + np.arange(width)
    local = np.median(bend[near], axis=1) / _MEDIAN_OF_SECOND
    steps = np.diff(c.tai_ns)
    beside = np.maximum(steps[at - 1], steps[at]) <= 3.5 * c.cadence_ns
    spike = np.zeros(n, bool)
    spike[at] = beside & (bend[at - 1] / 2 > SPIKE_SIGMAS * local)
    return _marked(c, spike, "spike", "single samples far off both neighbours, not used")


def _without_stuck(c: Channel, step: float) -> tuple[Channel, list[Finding]]:
    """A noisy sensor that repeats one value for a long run."""
    if c.kind.stem not in _MEASURED or len(c.values) < 3 * STUCK_RUN:
        return c, []
    same = c.values[1:] == c.values[:-1]
    if same.all():
        detail = f"the same value throughout, {c.values[0]:g}: a stuck sensor, or motion below one count? Used"
        return c, [Finding(c.name, "still", len(c.values), int(c.tai_ns[0]), detail)]
    stuck, still = np.zeros(len(c.values), bool), np.zeros(len(c.values), bool)
    starts, stops = _runs_of(same)
    long = stops - starts + 1 >= STUCK_RUN
    for start, stop in zip(starts[long].tolist(), stops[long].tolist(), strict=True):
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
        # a coasting wheel does not stop at a speed: its tachometer has
        slows = len(change) >= 2 * STUCK_RUN and (change * np.sign(c.values[stop]) <= 0).all()
        held = c.kind.stem == "wheel_rate" and abrupt and slows
        if not rest and (noisy or abrupt):
            (stuck if noisy or held else still)[start + 1 : stop + 1] = True
    c, found = _marked(c, stuck, "stuck", "samples repeat one value after others that change; not used")
    still &= c.valid
    if still.any():
        detail = "samples repeat one value after motion: a stuck sensor, or rest? Used"
        found.append(Finding(c.name, "still", int(still.sum()), int(c.tai_ns[still][0]), detail))
    return c, found


def _without_repeats(c: Channel, step: float) -> tuple[Channel, list[Finding]]:
    """Short runs of one value in a noisy channel, more frequent than quantisation produces."""
    if c.kind.stem not in _MEASURED | {"control_torque"} or len(c.values) <= 20:
        return c, []
    v = c.values
    same = v[1:] == v[:-1]
    count = np.count_nonzero(same)
    if count in (0, len(same)):
        return c, []
    step = max(step, 1e-15 * max(abs(e) for e in c.extremes))
    moves = _few_moves(v)
    if float(np.median(moves)) < _FINE * step:
        return c, []
    starts, stops = _runs_of(same)
    inside = (starts > 0) & (stops < len(same)) & (stops - starts < STUCK_RUN - 1)
    starts, stops = starts[inside], stops[inside]
    alone = np.minimum(np.abs(v[starts] - v[starts - 1]), np.abs(v[stops + 1] - v[stops])) > 3 * step
    starts, stops = starts[alone], stops[alone]
    if len(starts) == 0:
        return c, []
    by_chance = (len(same) - count) * _repeats_per_move(moves, step)
    if scipy.special.pdtrc(len(starts) - 1, by_chance) > CHANCE:
        return c, []
    edges = np.zeros(len(v) + 1, np.int64)
    edges[starts + 1] += 1
    edges[stops + 1] -= 1
    repeated = np.cumsum(edges[:-1]) > 0
    if c.kind.stem == "control_torque":  # a command may be held
        first = int(c.tai_ns[repeated][0])
        return c, [
            Finding(c.name, "repeat", int(repeated.sum()), first, "samples repeat the previous value bit for bit")
        ]
    return _marked(c, repeated, "repeat", "samples repeat the previous value bit for bit: stale, not used")


def _few_moves(values: np.ndarray) -> np.ndarray:
    """Sizes of the changes from one sample to the next, of those that change; of a long record evenly chosen ones."""
    each = len(values) // _LEVELS_FROM + 1
    change = np.abs(values[1::each] - values[:-1:each])
    return change[change > 0]


def _repeats_per_move(moves: np.ndarray, step: float) -> float:
    """Samples that repeat from quantisation alone, for each that moves: no change is about as frequent as any other small change of
    one step."""
    width = max(5 * step, float(np.quantile(moves, 0.1)))
    return float(1.5 * np.mean(moves <= width) * step / (2 * width))


def _falls(c: Channel, step: float) -> list[Finding]:
    """Cumulative counts that decrease, and sawteeth: undeclared wraps or resets."""
    c = c.usable
    x, t = c.values, c.tai_ns
    if len(x) < 6:
        return []
    swung, most = c.kind.stem in ("wheel_rate", "attitude_error"), 0.75 * (c.extremes[1] - c.extremes[0])
    if not (swung or c.kind.stem == "accelerometer_count" or c.kind.behaves == "cumulative"):
        return []
    jump = np.diff(x)
    if swung and -most <= jump.min() and jump.max() <= most:
        return []
    if c.kind.stem == "accelerometer_count":  # counts down as well as up, by thrust and by its own bias
        hit = np.abs(jump) > max(0.5 * float(np.ptp(x)), 50 * float(np.median(np.abs(jump))) + 1)
        detail = "jumps over much of its range: a wrap (declare it in a channel dictionary) or a reset"
    elif c.kind.behaves == "cumulative":
        hit = jump < 0
        detail = "decreases although it is cumulative: a wrap (declare it in a channel dictionary) or a reset"
    else:
        noise = sample_noise(c)
        hit = np.abs(jump) > max(most, 50 * noise, 10 * step)
        small = np.where(hit, 0.0, jump)
        for i in np.flatnonzero(hit):
            beside = small[max(0, i - _DRIFT) : i], small[i + 1 : i + 1 + _DRIFT]
            drift = [np.sign(d.sum()) if np.abs(d.sum()) > 3 * noise else 0 for d in beside]
            hit[i] = drift[0] == drift[1] == -np.sign(jump[i])
        detail = "jumps over its whole range against its own drift: an undeclared wrap?"
    if not hit.any():
        return []
    first = int(np.flatnonzero(hit)[0])
    return [
        Finding(c.name, "fall", int(hit.sum()), int(t[first + 1]), f"{detail} ({x[first]:.6g} to {x[first + 1]:.6g})")
    ]


def _runs_of(flags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and stops of each run of True, [start, stop)."""
    edges = np.flatnonzero(flags[1:] != flags[:-1]) + 1
    if len(flags) and flags[0]:
        edges = np.concatenate(([0], edges))
    if len(flags) and flags[-1]:
        edges = np.concatenate((edges, [len(flags)]))
    return edges[::2], edges[1::2]


def _marked(c: Channel, hit: np.ndarray, what: str, detail: str) -> tuple[Channel, list[Finding]]:
    hit = hit & c.valid
    if not hit.any():
        return c, []
    return replace(c, valid=c.valid & ~hit), [Finding(c.name, what, int(hit.sum()), int(c.tai_ns[hit][0]), detail)]


# ---- several channels -------------------------------------------------------------------------------


def _frames(channels: dict[str, Channel], stems: frozenset[str]) -> list[list[str]]:
    """Names of channels of some families that are sampled at the same instants."""
    frames: list[list[str]] = []
    for name, c in channels.items():
        if c.kind.stem not in stems or len(c.values) < 20:
            continue
        for names in frames:
            other = channels[names[0]].tai_ns
            if other is c.tai_ns or (len(other) == len(c.tai_ns) and np.array_equal(other, c.tai_ns)):
                names.append(name)
                break
        else:
            frames.append([name])
    return [names for names in frames if len(names) >= 3]


def _without_repeated_frames(channels: dict[str, Channel], steps: dict[str, float]):
    """Instants at which all noisy channels sampled together repeat their previous values."""
    channels, findings = dict(channels), []
    moving = {n: c for n, c in channels.items() if n in steps and c.extremes[0] < c.extremes[1]}
    for names in _frames(moving, _MEASURED):
        values = [channels[n].values for n in names]
        whole = values[0][1:] == values[0][:-1]
        for v in values[1:]:
            whole &= v[1:] == v[:-1]
        if not whole.any():
            continue
        by_chance = whole.size * float(
            np.prod([_repeats_by_chance(v, steps[n]) for n, v in zip(names, values, strict=True)])
        )
        # a long run of equal frames, or one at either end, is rest and not repetition
        starts, stops = _runs_of(whole)
        for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
            whole[start:stop] = start > 0 and stop < whole.size and stop - start < STUCK_RUN - 1
        if not whole.any() or scipy.special.pdtrc(whole.sum() - 1, by_chance) > CHANCE:
            continue
        hit = np.concatenate(([False], whole))
        for n in names:
            channels[n] = replace(channels[n], valid=channels[n].valid & ~hit)
        first = int(channels[names[0]].tai_ns[hit][0])
        findings.append(
            Finding("", "repeat", int(hit.sum()), first, f"frames of {len(names)} channels repeat the previous frame bit for bit; not used")
        )  # fmt: skip
    return channels, findings


def _repeats_by_chance(values: np.ndarray, step: float) -> float:
    """Share of the samples that repeat the last one by chance; a fine channel does so seldom."""
    share, moves = float(np.mean(values[1:] == values[:-1])), _few_moves(values)
    if float(np.median(moves)) < _FINE * step:
        return share
    return min(share, (1 - share) * _repeats_per_move(moves, max(step, 1e-15)))


def _without_unfilled(channels: dict[str, Channel]) -> tuple[dict[str, Channel], list[Finding]]:
    """Rows in which every measured channel, or every one of a family, reads the same value, most often zero, between rows in which
    they do not: packets that were not filled."""
    channels, findings = dict(channels), []
    for frame in _frames(channels, _MEASURED):
        families: dict[str, list[str]] = {}
        for n in frame:
            families.setdefault(channels[n].kind.stem, []).append(n)
        for names in (frame, *(those for those in families.values() if 2 < len(those) < len(frame))):
            unfilled = _unfilled([channels[n] for n in names])
            if not unfilled.any():
                continue
            for n in names:
                channels[n] = replace(channels[n], valid=channels[n].valid & ~unfilled)
            first = int(channels[names[0]].tai_ns[unfilled][0])
            value = channels[names[0]].values[unfilled][0]
            said = "zero" if value == 0 else f"{value:.6g}"
            what = (
                f"all {len(names)} measured channels"
                if names is frame
                else f"all channels {channels[names[0]].kind.stem}"
            )
            detail = f"rows in which {what} are {said}: unfilled packets; not used"
            findings += [
                Finding(n, "fill", int(unfilled.sum()), first, detail)
                for n in ([""] if names is frame and value == 0 else names)
            ]
    return channels, findings


def _unfilled(parts: list[Channel]) -> np.ndarray:
    """Samples at which channels of one frame hold one and the same value, to which and from which one of them jumps."""
    valid = np.all([c.valid for c in parts], axis=0)
    same = valid & np.all([c.values == parts[0].values for c in parts], axis=0)
    nothing = np.zeros(len(same), bool)
    if not same.any() or np.mean(same) > _MOST_UNFILLED:
        return nothing
    # at rest all read zero too; but then nothing jumps to zero and back
    jumps = nothing.copy()
    for c in parts:
        change = np.abs(np.diff(c.values))
        least = 0.1 * float(np.median(np.abs(c.values[valid & ~same] - c.values[same][0])))
        far = change > max(SPIKE_SIGMAS * sample_noise(c), least, 10 * quantisation_step(c.values[~same]))
        jumps |= np.concatenate(([False], far)) | np.concatenate((far, [False]))
    unfilled = nothing
    starts, stops = _runs_of(same)
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        ends = [i for i in (start, stop - 1) if 0 < i < len(same) - 1 or stop - start == 1]
        unfilled[start:stop] = bool(ends) and all(jumps[i] for i in ends)
    return unfilled


def _of_one_sign(channels: dict[str, Channel]) -> tuple[dict[str, Channel], list[Finding]]:
    """Quaternions that follow each other without a change of sign: q and -q are the same attitude."""
    channels = dict(channels)
    for stem in ("quaternion", "commanded_quaternion"):
        names = [f"{stem}_{m}" for m in "wxyz"]
        if not all(n in channels for n in names):
            continue
        parts = [channels[n] for n in names]
        if any(not np.array_equal(p.tai_ns, parts[0].tai_ns) for p in parts[1:]):
            continue
        q = np.stack([p.values for p in parts], axis=1)
        flips = np.concatenate(([False], np.sum(q[1:] * q[:-1], axis=1) < 0))
        if flips.any():
            sign = 1.0 - 2.0 * (np.cumsum(flips) % 2)
            channels |= {n: replace(p, values=p.values * sign) for n, p in zip(names, parts, strict=True)}
    return channels, []


def _whole_quaternions(channels: dict[str, Channel]) -> tuple[dict[str, Channel], list[Finding]]:
    """A quaternion is used only with all four components at one instant and unit length."""
    names = [f"quaternion_{m}" for m in "wxyz"]
    if not all(n in channels for n in names):
        return channels, []
    parts = [channels[n] for n in names]
    instants = common_instants(parts)
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
            limit, whose = _OVER_LIMIT * limits[c.member], f"{craft.name}'s wheel rate limit"
        if limit is None or not c.valid.any():
            continue
        if -limit <= c.extremes[0] and c.extremes[1] <= limit:
            continue
        size = np.abs(c.usable.values)
        if np.mean(size > limit) > _FEW:  # a short outlier is not a wrong unit
            beyond.setdefault((kind.stem, limit, whose), []).append((c.name, float(np.max(size))))
    doubts = []
    for (stem, limit, whose), those in beyond.items():
        kind = next(kind_of(n) for n, _ in those)
        given = channels[those[0][0]].unit_given
        wrong = " or ".join(u for u in kind.mistaken_for.split(" or ") if u and u != given)
        guess = f": are the values {wrong} labelled {given}?" if wrong else ""
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


def _without_sign(channels: dict[str, Channel]) -> list[Doubt]:
    """Wheels whose rate falls to zero and rises again at the same pace: a tachometer that counts pulses knows no sense."""
    names = [n for n, c in channels.items() if c.kind.stem == "wheel_rate" and _turns_at_zero(c.usable)]
    return [NO_SIGN(channels=names)] if names else []


def _turns_at_zero(c: Channel) -> bool:
    """Whether a rate of one sign has the shape of a V with its point at zero: one line through zero, folded."""
    x = c.values if np.min(c.values, initial=0) >= 0 else -c.values
    if len(x) < 3 * _DRIFT or np.min(x) < 0:
        return False
    noise, i = sample_noise(c), int(np.argmin(x))
    t = (c.tai_ns - c.tai_ns[i]) / c.cadence_ns
    if not _DRIFT <= i < len(x) - _DRIFT or x[i] > 5 * max(noise, float(np.median(np.abs(np.diff(x))))):
        return False
    n = min(i, len(x) - 1 - i, 5 * _DRIFT)
    sides = [slice(i - n, i - 2), slice(i + 3, i + n)]
    (down, at_down), (up, at_up) = (np.polyfit(t[side], x[side], 1) for side in sides)
    sigma = max(noise, 1e-9 * float(np.max(x))) * np.sqrt(12 / n**3)  # of a slope
    return bool(
        down < -20 * sigma
        and up > 20 * sigma
        and abs(up + down) < 0.2 * up
        and abs(at_down / down - at_up / up) < 3 + 0.1 * n
    )


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
