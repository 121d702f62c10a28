"""Local polynomial regression: values, slopes and curvatures of noisy samples, with their variances.

At each instant a polynomial is fitted to the samples near it with tricube weights
(1 - |u|^3)^3.  The window is either a half-width in the unit of t, or a number of nearest samples
(classical loess).  Towards an end or across missing samples the window widens until it holds as many
samples as in the interior, so an estimate exists up to the first and last sample, at a variance
that says what it costs.

Where samples lie on an even lattice, single ones perhaps missing, every complete window has one set
of coefficients, computed once and applied as a correlation; ends, holes and uneven records are
evaluated exactly, point by point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compiled import jit
from .errors import BadInput

_MOST_PHASES = 64  # distinct offsets of the wanted instants within one sample step


@dataclass(frozen=True)
class LocalFit:
    """Local fits at M instants.

    ``derivatives``: (3, M), value, slope and curvature; ``gain``: (M, 3, 3), their covariance per
    unit variance of independent noise on the samples; ``half_width``: (M,), the windows used;
    ``own``: (M,), the weight in the value of a sample at that very instant (0 where there is none)."""

    derivatives: np.ndarray
    gain: np.ndarray
    half_width: np.ndarray
    own: np.ndarray

    @property
    def value(self) -> np.ndarray:
        return self.derivatives[0]

    @property
    def slope(self) -> np.ndarray:
        return self.derivatives[1]

    @property
    def curvature(self) -> np.ndarray:
        return self.derivatives[2]

    def variance(self, weights) -> np.ndarray:
        """Variance, per unit noise variance, of w0 value + w1 slope + w2 curvature.  (M,)"""
        w = np.asarray(weights, float)
        return np.einsum("i,mij,j->m", w, self.gain, w)


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
    derivatives = np.zeros((3, len(at)))
    gain = np.zeros((len(at), 3, 3))
    rest = np.ones(len(at), bool)
    reach = half_width if half_width is not None else (neighbors - 1) / 2 * (step or 0.0)
    fit = LocalFit(derivatives, gain, np.full(len(at), reach), np.zeros(len(at)))
    if step and (half_width is not None or neighbors % 2) and len(t) > neighbors:
        rest &= ~_complete_windows(t, y, at, step, reach, degree, order, fit)
    todo = np.flatnonzero(rest)
    for part in np.array_split(todo, len(todo) * (neighbors + 4) // 5_000_000 + 1):
        if len(part):
            _direct(t, y, at, part, degree, order, neighbors, half_width, fit)
    return fit


def loess(y, span: int, degree: int = 2) -> np.ndarray:
    """Smoothed values of an evenly sampled record, ``span`` samples a window (MATLAB's loess)."""
    t = np.arange(len(y), dtype=float)
    return local_polynomial(t, y, t, degree=degree, neighbors=span).value


def noise_sigma(t, y, *, degree: int, half_width: float) -> float:
    """Standard deviation of independent noise on samples, from the residuals of local fits.

    Robust: a median, so that a few corners of the signal do not count as noise."""
    t, y = np.asarray(t, float), np.asarray(y, float)
    fit = local_polynomial(t, y, t, degree=degree, half_width=half_width)
    left = 1 - 2 * fit.own + fit.gain[:, 0, 0]  # expected squared residual per unit noise variance
    usable = left > 0.02
    if usable.sum() < 4:
        return float("nan")
    scaled = (y - fit.value)[usable] / np.sqrt(left[usable])
    return float(1.4826 * np.median(np.abs(scaled)))


def _lattice_step(t: np.ndarray) -> float | None:
    """The step of the even lattice that all samples lie on, or None where there is none."""
    if len(t) < 2:
        return None
    usual = float(np.median(np.diff(t)))
    count = round((t[-1] - t[0]) / usual) if usual > 0 else 0
    if count < 1 or count > 4 * len(t):
        return None
    step = (t[-1] - t[0]) / count
    place = (t - t[0]) / step
    return step if np.all(np.abs(place - np.round(place)) < 1e-6) else None


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


def _complete_windows(t, y, at, step, reach, degree, order, fit) -> np.ndarray:
    """Fill the instants whose window misses no sample, by one correlation a phase; returns which they are."""
    place = np.round((t - t[0]) / step).astype(int)
    lattice = np.zeros(place[-1] + 1)
    lattice[place] = y
    missing = np.ones(len(lattice))
    missing[place] = 0
    missing = np.concatenate([[0], np.cumsum(missing)])
    inside = (at >= t[0] + reach * (1 - 1e-12)) & (at <= t[-1] - reach * (1 - 1e-12))
    base = np.floor((at - t[0]) / step + 1e-7).astype(int)
    phase = np.round(np.clip((at - t[0]) / step - base, 0, 1), 6)
    phases = np.unique(phase[inside])
    filled = np.zeros(len(at), bool)
    if len(phases) > _MOST_PHASES:
        return filled
    n = int(np.floor(reach / step + 1e-9))
    for f in phases:
        k = np.arange(-n - 1, n + 3)
        k = k[np.abs(k - f) * step < reach * (1 - 1e-12)]
        offset = (k - f) * step
        here = np.flatnonzero(inside & (phase == f))
        # a sample at the very edge weighs nothing, but would be counted as a neighbour: it must be there too
        before, after = int(np.ceil(f - reach / step - 1e-9)), int(np.floor(f + reach / step + 1e-9))
        low, high = base[here] + before, base[here] + after + 1
        good = (low >= 0) & (high <= len(lattice))
        good[good] = missing[high[good]] == missing[low[good]]
        here, low = here[good], (base[here] + k[0])[good]
        if len(k) < degree + 1 or not len(here):
            continue
        rows = _rows(offset[None], reach, degree, order)[0]
        for o in range(order):
            fit.derivatives[o, here] = np.correlate(lattice, rows[o], "valid")[low]
        fit.gain[np.ix_(here, range(order), range(order))] = rows @ rows.T
        fit.own[here] = rows[0] @ (offset == 0)
        filled[here] = True
    return filled


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
    parts = _evaluate(t, y, a, low, high, bandwidth, degree, order)
    fit.derivatives[:, which], fit.gain[which], fit.own[which] = parts
    fit.half_width[which] = bandwidth


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
