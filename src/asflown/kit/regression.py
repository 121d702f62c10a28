"""Local polynomial regression: values, slopes and curvatures of noisy samples, with their variances.

At each instant a polynomial is fitted to the samples near it with tricube weights
(1 - |u|^3)^3.  The window is either a half-width in the unit of t, or a number of nearest samples
(classical loess).  Towards an end or across missing samples the window widens until it holds as many
samples as in the interior, so an estimate exists up to the first and last sample, with a
correspondingly larger variance.

Where samples lie on an even lattice, single ones perhaps missing, every complete window has one set
of coefficients, computed once and applied as a correlation; ends, holes and uneven records are
evaluated exactly, point by point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compiled import jit
from .errors import BadInput
from .scatter import robust_sigma

_MOST_PHASES = 64  # distinct offsets of the wanted instants within one sample step
_FEW = 20_000  # weights up to which no compiled kernel is loaded: that takes as long as some million of them


@dataclass(frozen=True)
class LocalFit:
    """Local fits at M instants.

    ``derivatives``: (3, M), value, slope and curvature.  What a window alone decides is held once for all
    instants that share one: that of instant m is number ``window[m]`` of ``gains``, ``widths`` and ``owns``."""

    derivatives: np.ndarray
    window: np.ndarray  # (M,) int
    gains: np.ndarray  # (W, 3, 3)
    widths: np.ndarray  # (W,)
    owns: np.ndarray  # (W,)

    @property
    def value(self) -> np.ndarray:
        return self.derivatives[0]

    @property
    def slope(self) -> np.ndarray:
        return self.derivatives[1]

    @property
    def curvature(self) -> np.ndarray:
        return self.derivatives[2]

    @property
    def gain(self) -> np.ndarray:
        """Covariance of the three per unit variance of independent noise on the samples, (M, 3, 3)."""
        return self.gains[self.window]

    @property
    def half_width(self) -> np.ndarray:
        """Of the windows used, (M,)."""
        return self.widths[self.window]

    @property
    def own(self) -> np.ndarray:
        """The weight in the value of a sample at that very instant, 0 where there is none, (M,)."""
        return self.owns[self.window]

    def variance(self, weights) -> np.ndarray:
        """Variance, per unit noise variance, of w0 value + w1 slope + w2 curvature.  (M,)"""
        w = np.asarray(weights, float)
        return np.einsum("i,wij,j->w", w, self.gains, w)[self.window]


def local_polynomial(
    t, y, at, *, degree: int, half_width: float | None = None, neighbors: int | None = None
) -> LocalFit:
    """Fit at the instants ``at`` (M,) from samples y (N,) at increasing t (N,).

    Give ``half_width`` (unit of t) or ``neighbors`` (samples in the window, the furthest weighing
    nothing).  Raises BadInput where the record holds fewer samples than the polynomial needs."""
    t, y, at = (np.ascontiguousarray(v, float) for v in (t, y, at))
    step = _lattice_step(t)
    if half_width is not None:
        dt = step or float(np.median(np.diff(t))) if len(t) > 1 else 1.0
        half_width = max(half_width, (degree + 2) / 2 * dt * (1 + 1e-9))
        # as many samples as every interior window holds, wherever it is centred
        neighbors = int(np.floor(2 * half_width / dt))
    assert neighbors is not None
    needed = degree + 2
    if len(t) < needed:
        raise BadInput(
            f"{len(t)} samples are too few for a local polynomial of degree {degree}",
            remedy=f"At least {needed} are needed: take a longer record.",
        )
    neighbors = min(neighbors, len(t))
    order = min(degree, 2) + 1
    fit = _Fit(np.zeros((3, len(at))), np.full(len(at), -1, np.int32), [])
    reach = half_width if half_width is not None else (neighbors - 1) / 2 * (step or 0.0)
    if step and (half_width is not None or neighbors % 2) and len(t) > neighbors:
        _complete_windows(t, y, at, step, reach, degree, order, fit)
    todo = np.flatnonzero(fit.window < 0)
    for part in np.array_split(todo, len(todo) * (neighbors + 4) // 5_000_000 + 1):
        if len(part):
            _direct(t, y, at, part, degree, order, neighbors, half_width, fit)
    return fit.done()


@dataclass
class _Fit:
    """A LocalFit under construction; window -1 is not done yet."""

    derivatives: np.ndarray
    window: np.ndarray
    windows: list  # of gains, widths, owns

    def add(self, where, gains, widths, owns) -> None:
        """One window for all of ``where``, or one for each."""
        used = sum(len(w[1]) for w in self.windows)
        self.window[where] = used if len(widths) == 1 else np.arange(used, used + len(widths))
        self.windows.append((gains, widths, owns))

    def done(self) -> LocalFit:
        empty = np.zeros((0, 3, 3)), np.zeros(0), np.zeros(0)
        gains, widths, owns = (np.concatenate(parts) for parts in zip(empty, *self.windows, strict=True))
        return LocalFit(self.derivatives, self.window, gains, widths, owns)


def loess(y, span: int, degree: int = 2) -> np.ndarray:
    """Smoothed values of an evenly sampled record, ``span`` samples a window (MATLAB's loess)."""
    t = np.arange(len(y), dtype=float)
    return local_polynomial(t, y, t, degree=degree, neighbors=span).value


def noise_sigma(t, y, *, degree: int, half_width: float) -> float:
    """Standard deviation of independent noise on samples, from the residuals of local fits.

    Robust: a median, so that corners of the signal have little effect.  Unlike ``difference_sigma`` it takes uneven
    samples, and signals that change from one to the next."""
    t, y = np.asarray(t, float), np.asarray(y, float)
    fit = local_polynomial(t, y, t, degree=degree, half_width=half_width)
    left = (1 - 2 * fit.owns + fit.gains[:, 0, 0])[fit.window]  # expected squared residual per unit noise variance
    usable = left > 0.02
    if usable.sum() < 4:
        return float("nan")
    scaled = (y - fit.value)[usable] / np.sqrt(left[usable])
    return float(robust_sigma(scaled))


def memory(left) -> float:
    """Correlation length of residuals in samples, N over the effective sample size: 1 + 2 sum of autocorrelations, up to the first
    that is within noise."""
    n, total, power = len(left), 1.0, float(left @ left)
    if n < 8 or power == 0:
        return 1.0
    for k in range(1, n // 4):
        r = float(left[:-k] @ left[k:]) / power
        if r < 2 / np.sqrt(n):
            break
        total += 2 * r
    return total


def _lattice_step(t: np.ndarray) -> float | None:
    """The step of the even lattice that all samples lie on, or None where there is none."""
    if len(t) < 2:
        return None
    usual = float(np.median(np.diff(t)))
    count = round((t[-1] - t[0]) / usual) if usual > 0 else 0
    if count < 1 or count > 4 * len(t):
        return None
    step = (t[-1] - t[0]) / count
    return step if _on_lattice(t, step) else None


def _on_lattice(t, step) -> bool:
    off = (t - t[0]) / step
    off -= np.rint(off)
    return -1e-6 < off.min() and off.max() < 1e-6


def _tricube(u: np.ndarray) -> np.ndarray:
    a = np.minimum(np.abs(u), 1.0)
    return (1 - a**3) ** 3


def _rows(offset, bandwidth, degree, order):
    """Coefficients of value, slope, curvature on samples at ``offset`` (m, k) from each instant."""
    h = np.asarray(bandwidth, float).reshape(-1, 1)
    u = offset / h
    root = np.sqrt(_tricube(u))
    V = u[..., None] ** np.arange(degree + 1) * root[..., None]
    Q, R = np.linalg.qr(V)
    eye = np.broadcast_to(np.eye(degree + 1)[:, :order], (*R.shape[:-2], degree + 1, order))
    top = np.linalg.solve(np.swapaxes(R, -1, -2), eye)  # rows of R^-1, as columns
    rows = np.einsum("mkj,mjo->mok", Q, top) * root[:, None, :]
    scale = np.array([1.0, 1.0, 2.0])[:order] / h ** np.arange(order)
    return rows * scale[..., None]


def _complete_windows(t, y, at, step, reach, degree, order, fit) -> None:
    """Fill the instants whose window misses no sample, by one correlation a phase."""
    lattice, missing = _lay(t, y, step)
    base, which, phases = _places(at, t[0], t[-1], step, reach * (1 - 1e-12))
    if len(phases) > _MOST_PHASES:
        return
    n = int(np.floor(reach / step + 1e-9))
    for number, f in enumerate(phases):
        k = np.arange(-n - 1, n + 3)
        k = k[np.abs(k - f) * step < reach * (1 - 1e-12)]
        offset = (k - f) * step
        # a sample at the very edge has no weight but counts as a neighbour: it must exist too
        before, after = int(np.ceil(f - reach / step - 1e-9)), int(np.floor(f + reach / step + 1e-9))
        here, even = _complete(base, which, number, before, after, missing)
        if len(k) < degree + 1 or not len(here):
            continue
        rows = np.zeros((3, len(k)))
        rows[:order] = _rows(offset[None], reach, degree, order)[0]
        if even:  # straight into place
            here = slice(here[0], here[-1] + 1)
            _correlate(lattice[base[here.start] + k[0] :], rows, fit.derivatives[:, here])
        else:
            everywhere = np.empty((3, len(lattice) - len(k) + 1))
            _correlate(lattice, rows, everywhere)
            fit.derivatives[:, here] = everywhere[:, base[here] + k[0]]
        fit.add(here, (rows @ rows.T)[None], np.array([reach]), np.array([rows[0] @ (offset == 0)]))


def _lay(t, y, step):
    """Samples on their lattice, zero where one is missing, and how many are missing before each place."""
    count = int((t[-1] - t[0]) / step + 0.5) + 1
    if count == len(t):
        return y, np.zeros(count + 1, np.int32)
    place = ((t - t[0]) / step + 0.5).astype(np.intp)
    lattice, missing = np.zeros(count), np.ones(count + 1, np.int32)
    lattice[place] = y
    missing[0] = missing[place + 1] = 0
    return lattice, np.cumsum(missing, dtype=np.int32)


def _places(at, first, last, step, reach):
    """The sample at or before each instant; the number of its phase, how far on it is in steps; and the phases.

    Number -1 where a window reaches past an end."""
    place = (at - first) / step
    base = np.floor(place + 1e-7)
    phase = np.rint(np.clip(place - base, 0.0, 1.0) * 1e6)
    inside = (at >= first + reach) & (at <= last - reach)
    if (phase == phase[:1]).all():  # most records: nothing to sort
        phases, which = phase[:1], np.zeros(len(at), np.intp)
    else:
        phases, which = np.unique(phase, return_inverse=True)
    which[~inside] = -1
    return base.astype(np.intp), which, phases / 1e6


def _complete(base, which, number, before, after, missing):
    """The instants of one phase whose window misses nothing, and whether they follow one another sample by sample."""
    here = np.flatnonzero(which == number)
    low, high = base[here] + before, base[here] + after + 1
    here = here[(low >= 0) & (high < len(missing))]
    if missing[-1]:
        here = here[missing[base[here] + after + 1] == missing[base[here] + before]]
    steps = np.diff(base[here])
    return here, len(here) > 0 and here[-1] - here[0] == len(here) - 1 and bool((steps == 1).all())


def _correlate(y, rows, out):
    """Correlations of y with every row into ``out`` (rows, :)."""
    for o in range(len(rows)):
        out[o] = np.correlate(y[: out.shape[1] + rows.shape[1] - 1], rows[o], "valid")


def _direct(t, y, at, which, degree, order, neighbors, half_width, fit) -> None:
    """Exact evaluation at the instants ``which``, any sampling."""
    a = at[which]
    first = np.searchsorted(t, a)
    starts = np.clip(first[:, None] + np.arange(-neighbors, 1), 0, len(t) - neighbors)
    width = np.maximum(a[:, None] - t[starts], t[starts + neighbors - 1] - a[:, None])
    best = starts[np.arange(len(a)), np.argmin(width, axis=1)]
    bandwidth = width.min(axis=1)
    if half_width is not None:
        bandwidth = np.maximum(bandwidth, half_width)
        low, high = np.searchsorted(t, a - bandwidth), np.searchsorted(t, a + bandwidth, side="right")
    else:
        low, high = best, best + neighbors
    positive = (high - low) - (a - t[low] >= bandwidth) - (t[high - 1] - a >= bandwidth)
    bandwidth = np.where(positive < degree + 1, bandwidth * 1.5, bandwidth)  # too few that weigh: widen those
    evaluate = _evaluate if len(a) * neighbors > _FEW else _evaluate_few
    fit.derivatives[:, which], gains, owns = evaluate(t, y, a, low, high, bandwidth, degree, order)
    fit.add(which, gains, bandwidth, owns)


def _evaluate_few(t, y, at, low, high, bandwidth, degree, order):
    """As ``_evaluate``, without a kernel to load: windows side by side, the shorter ones filled up with samples that weigh nothing."""
    each = np.arange(np.max(high - low))
    inside = each < (high - low)[:, None]
    sample = np.where(inside, low[:, None] + each, low[:, None])
    offset = t[sample] - at[:, None]
    rows = np.zeros((len(at), 3, len(each)))
    rows[:, :order] = _rows(np.where(inside, offset, bandwidth[:, None]), bandwidth, degree, order)
    own = np.sum(rows[:, 0] * (inside & (offset == 0)), axis=1)
    return np.einsum("mok,mk->om", rows, y[sample]), rows @ np.swapaxes(rows, 1, 2), own


@jit
def _evaluate(t, y, at, low, high, bandwidth, degree, order):
    """Weighted polynomial fits, one an instant, by Gram-Schmidt done twice (good to rounding)."""
    m, p = len(at), degree + 1
    derivatives, gain, own = np.zeros((3, m)), np.zeros((m, 3, 3)), np.zeros(m)
    longest = 0
    for i in range(m):
        longest = max(longest, high[i] - low[i])
    Q, root, rows = np.empty((p, longest)), np.empty(longest), np.empty((order, longest))
    for i in range(m):
        k, h = high[i] - low[i], bandwidth[i]
        for s in range(k):
            u = (t[low[i] + s] - at[i]) / h
            v = min(abs(u), 1.0)
            root[s] = (1 - v * v * v) ** 1.5
            power = root[s]
            for c in range(p):
                Q[c, s] = power
                power *= u
        R = np.zeros((p, p))
        for c in range(p):
            for _ in range(2):
                for b in range(c):
                    dot = 0.0
                    for s in range(k):
                        dot += Q[b, s] * Q[c, s]
                    R[b, c] += dot
                    for s in range(k):
                        Q[c, s] -= dot * Q[b, s]
            size = 0.0
            for s in range(k):
                size += Q[c, s] * Q[c, s]
            R[c, c] = np.sqrt(size)
            for s in range(k):
                Q[c, s] /= R[c, c]
        inverse = np.zeros((p, p))
        for c in range(p):
            inverse[c, c] = 1 / R[c, c]
            for b in range(c - 1, -1, -1):
                dot = 0.0
                for x in range(b + 1, c + 1):
                    dot += R[b, x] * inverse[x, c]
                inverse[b, c] = -dot / R[b, b]
        unit = 1.0
        for o in range(order):
            total = 0.0
            for s in range(k):
                weight = 0.0
                for c in range(o, p):
                    weight += inverse[o, c] * Q[c, s]
                weight *= root[s] * unit
                rows[o, s] = weight
                total += weight * y[low[i] + s]
                if o == 0 and t[low[i] + s] == at[i]:
                    own[i] = weight
            derivatives[o, i] = total
            unit *= (o + 1) / h
        for o in range(order):
            for b in range(o + 1):
                dot = 0.0
                for s in range(k):
                    dot += rows[o, s] * rows[b, s]
                gain[i, o, b] = dot
                gain[i, b, o] = dot
    return derivatives, gain, own


#: Samples beyond this many robust sigma do not count for the line.
_OUTLYING = 4.0


def robust_line(u, y) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """y = c0 + c1 u by repeated least squares without outliers: values (2,), covariance, which samples were used.

    Samples in order of time: where their errors are correlated, the covariance is larger.  Where all u are equal
    the slope is zero with a sigma that marks it as unknown, and the value holds at u."""
    u, y = np.asarray(u, float), np.asarray(y, float)
    scatter = robust_sigma(y - np.median(y))
    used = np.abs(y - np.median(y)) <= 20 * scatter if scatter > 0 else np.ones(len(y), bool)
    for _ in range(20):
        centre, middle = float(u[used].mean()), float(y[used].mean())
        spread = float(np.sum((u[used] - centre) ** 2))
        narrow = spread <= 1e-12 * float(np.sum(u[used] ** 2))
        slope = 0.0 if narrow else float((u[used] - centre) @ y[used]) / spread
        left = y - middle - slope * (u - centre)
        scatter = robust_sigma(left[used])
        again = np.abs(left) <= _OUTLYING * scatter
        if scatter == 0 or again.sum() < 4 or np.array_equal(again, used):
            break
        used = again
    count = int(used.sum())
    variance = float(np.sum(left[used] ** 2)) / max(count - 2, 1) * memory(left[used])
    of_slope = (100 * middle / centre) ** 2 if narrow else variance / spread
    J = np.array([[1.0, -centre], [0.0, 1.0]])
    return np.array([middle - slope * centre, slope]), J @ np.diag([variance / count, of_slope]) @ J.T, used
