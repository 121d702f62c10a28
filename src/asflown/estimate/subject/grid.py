"""A common grid of instants, and channels fitted on it across their gaps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.errors import BadInput, some_of
from ...kit.regression import LocalFit, local_polynomial, noise_sigma
from ...kit.timeline import NS, seconds_since

if TYPE_CHECKING:
    from ...telemetry.telemetry import Channel, Telemetry

#: Instants in one estimate: five weeks at 1 s, some gigabytes of memory.
_MOST_INSTANTS = 3_000_000


def gaps_on_grid(channel: Channel, grid: Grid) -> list[tuple[float, float]]:
    """Gaps of a channel, from the grid's start. [s]"""
    c = channel.usable
    t = grid.of(c.tai_ns)
    return [(float(t[a.stop - 1]), float(t[b.start])) for a, b in pairwise(c.segments())]


@dataclass(frozen=True)
class Grid:
    """Evenly spaced instants (int64 ns TAI) at which an estimate is given."""

    start_ns: int
    step_s: float
    count: int

    @property
    def seconds(self) -> np.ndarray:
        """From the grid's own start."""
        return self.step_s * np.arange(self.count)

    def of(self, tai_ns) -> np.ndarray:
        """Instants as seconds from the grid's start."""
        return seconds_since(tai_ns, self.start_ns)

    def from_epoch(self, telemetry: Telemetry) -> np.ndarray:
        return float(telemetry.seconds(self.start_ns)) + self.seconds


def grid_for(channels: list[Channel], step_s: float | None = None) -> Grid:
    """From the first to the last instant that all ``channels`` cover.

    The step is 1 s, or a quarter of the coarsest cadence where that is longer than 4 s."""
    usable = [c.usable for c in channels]
    for c in usable:
        if len(c.tai_ns) < 2:
            raise BadInput(
                f"too few usable samples ({len(c.tai_ns)})",
                channel=c.name,
                remedy="Take a longer window, or check what was excluded (asflown telemetry check).",
            )
    start, stop = max(int(c.tai_ns[0]) for c in usable), min(int(c.tai_ns[-1]) for c in usable)
    if step_s is None:
        coarsest = max(c.cadence_ns for c in usable) / NS
        step_s = 1.0 if coarsest <= 4.0 * (1 + 1e-9) else coarsest / 4
    if stop <= start:
        raise BadInput(
            f"{some_of(c.name for c in channels)} have no time in common",
            remedy="These channels must overlap in time.",
        )
    count = int(np.floor((stop - start) / NS / step_s + 1e-9)) + 1
    if count > _MOST_INSTANTS:
        raise BadInput(
            f"the record spans {(stop - start) / NS / 86_400:,.0f} days, {count:,} instants of {step_s:g} s: too many for one estimate",
            channel=usable[0].name,
            remedy="Give a window (--start, --stop). If the record is not that long, one time stamp is wrong "
            "(asflown telemetry check shows the gap).",
        )
    return Grid(start, step_s, count)


@dataclass(frozen=True)
class SampledFit:
    """Local fits of one channel on a grid; NaN outside its gap-free stretches.

    ``sigma``: one sample's independent noise; ``widened``: (M, 3), variance of value, slope and
    curvature that a window stretched over missing samples adds; ``gaps``: from the grid's start [s]."""

    fit: LocalFit
    sigma: float
    widened: np.ndarray
    gaps: tuple[tuple[float, float], ...]

    def variance(self, weights) -> np.ndarray:
        """Of w0 value + w1 slope + w2 curvature. (M,)"""
        return self.fit.variance(weights) * self.sigma**2 + self.widened @ np.square(weights)


def fit_on_grid(channel: Channel, grid: Grid, *, degree: int, half_width_s: float) -> SampledFit:
    """Local polynomials through each gap-free stretch of a channel.

    Runs of up to five missing samples are bridged: the window widens, and so does the variance.
    Raises BadInput where no stretch is as long as the window."""
    c = channel.usable
    t = grid.of(c.tai_ns)
    at = grid.seconds
    derivatives = np.full((3, grid.count), np.nan)
    gain = np.full((grid.count, 3, 3), np.nan)
    width, own = np.full(grid.count, np.nan), np.zeros(grid.count)
    widened, shortfall = np.zeros((grid.count, 3)), np.zeros((grid.count, 3))
    stretches = c.segments()
    longest = max((t[s][-1] - t[s][0] for s in stretches), default=0.0)
    held = [
        s for s in stretches if s.stop - s.start >= degree + 3 and t[s][-1] - t[s][0] >= 2 * half_width_s * (1 - 1e-9)
    ]
    if not held:
        raise BadInput(
            f"the longest stretch without a gap is {longest:.0f} s, shorter than the window of {2 * half_width_s:.0f} s",
            channel=channel.name,
            remedy="Take a longer record, or a shorter window (--window).",
        )
    noises, weights = [], []
    for s in held:
        inside = (at >= t[s][0] - 1e-9) & (at <= t[s][-1] + 1e-9)
        part = local_polynomial(t[s], c.values[s], at[inside], degree=degree, half_width=half_width_s)
        derivatives[:, inside], gain[inside], width[inside] = part.derivatives, part.gain, part.half_width
        widened[inside], shortfall[inside] = _cost_of_widening(
            t[s], c.values[s], at[inside], part, degree, half_width_s
        )
        noise = noise_sigma(t[s], c.values[s], degree=degree, half_width=half_width_s)
        if np.isfinite(noise):
            noises.append(noise)
            weights.append(s.stop - s.start)
    sigma = float(np.average(noises, weights=weights)) if noises else float("nan")
    sigma = max(sigma, channel.count_size / np.sqrt(12)) if np.isfinite(sigma) else sigma
    edges = [t[0], *[v for s in held for v in (t[s][0], t[s][-1])], t[-1]]
    gaps = tuple((a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b > a)
    fit = LocalFit(derivatives, np.arange(grid.count), gain, width, own)
    return SampledFit(fit, sigma, widened + shortfall * sigma**2, gaps)


def _cost_of_widening(t, y, at, part: LocalFit, degree: int, half_width_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Variance to add where a window had to widen over missing samples: (m, 3), and (m, 3) per unit noise variance.

    What the wider window changes elsewhere in this record is what it may hide here: the mean square
    difference of both windows' answers over the parts where the narrow one fits.  A longer base also
    makes a slope less noisy; the second return takes that credit back, so that a hole never narrows the
    band."""
    cost, shortfall = np.zeros((len(at), 3)), np.zeros((len(at), 3))
    usual = float(np.median(part.half_width))
    inner = (at > t[0] + half_width_s) & (at < t[-1] - half_width_s)  # an end's variance says enough
    stretched = inner & (part.half_width > 1.01 * usual)
    intact = inner & ~stretched
    if not stretched.any() or intact.sum() < 10:
        return cost, shortfall
    diagonal = np.einsum("mii->mi", part.gain)
    shortfall[stretched] = np.maximum(diagonal[intact].max(axis=0) - diagonal[stretched], 0)
    levels = np.linspace(usual, part.half_width[stretched].max(), 4)[1:]
    level = np.minimum(np.searchsorted(levels, part.half_width - 1e-9), 2)
    for k, wide in enumerate(levels):
        here = stretched & (level == k)
        if here.any():
            other = local_polynomial(t, y, at[intact], degree=degree, half_width=wide)
            cost[here] = np.mean((other.derivatives - part.derivatives[:, intact]) ** 2, axis=1)
    return cost, shortfall


def splined(channel: Channel, grid: Grid) -> np.ndarray:
    """Cubic spline onto the grid, stretch by stretch; NaN in gaps."""
    c = channel.usable
    t, at = grid.of(c.tai_ns), grid.seconds
    out = np.full(grid.count, np.nan)
    for s in c.segments():
        inside = (at >= t[s][0] - 1e-9) & (at <= t[s][-1] + 1e-9)
        if s.stop - s.start >= 4 and inside.any():
            out[inside] = scipy.interpolate.CubicSpline(t[s], c.values[s])(at[inside])
    return out


GAPS_NULL = Kind(
    "subject.gaps-null",
    Severity.NOTE,
    "gaps longer than five samples are left null: {spans}",
    "Use --method fused, which bridges them.",
)
GAPS_BRIDGED = Kind(
    "subject.gaps-bridged", Severity.NOTE,
    "gaps longer than five samples are bridged by the model, with a wider band: {spans}",
)  # fmt: skip


def gap_doubts(
    tlm: Telemetry, grid: Grid, silent: dict[tuple[float, float], str], kind: Kind = GAPS_NULL
) -> list[Doubt]:
    """One doubt of a ``kind`` for the gaps, from the grid's start [s] with the channel that is silent."""
    inside = {g: name for g, name in silent.items() if g[1] > 0 and g[0] < grid.seconds[-1]}
    if not inside:
        return []
    zero = float(tlm.seconds(grid.start_ns))
    first = sorted(inside)[:3]
    spans = ", ".join(f"{zero + a:.0f}-{zero + b:.0f} s ({inside[(a, b)]})" for a, b in first)
    more = f" and {len(inside) - 3} more" if len(inside) > 3 else ""
    return [kind(spans=f"{spans}{more}", count=len(inside))]
