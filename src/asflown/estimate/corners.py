"""A torque of straight lines: which corners, how sharp, and how rough between them.

The torque is a line with bends, T(t) = T0 + S0 t + sum_i b_i max(t - t_i, 0), plus a roughness in
proportion to the size the torque has thereabouts.  Everything else in the loop is Gaussian, so each
candidate bend is one column of responses; once the filter has whitened columns and data, what is left is
a regression with unit noise in which most coefficients are exactly zero.  Reversible-jump Monte Carlo
goes through sets of corners (born, removed, moved, split, merged) with the bends integrated out:

    y = X b + D d + e,   b_i ~ N(0, s^2 / l_i), l_i gamma (Student-t bends),   number of corners: beta-binomial

and through a few sizes of roughness and the smooth torque of the fitted levels, each with its own whitening.  D holds the sensitivities to what is
taken as known (an inertia, a gain), d ~ N(0, 1) how far off each is.  A pure triangle keeps its corners
sharp, since a straight line costs nothing; a rubbing hinge gets its roughness, since the data ask for it.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..kit.compiled import jit
from ..kit.ensemble import gains, paths, whiten
from ..kit.smoother import Measurements
from .latent import Body, Levels, Posterior, Times, response

#: Sizes of the roughness as shares of the torque's own size near that time (studies/corners.py).
ROUGHNESS = (0.05, 0.15, 0.45)
#: What is given beforehand: nearly half to a torque of pure lines, as much to one with roughness; the last to the
#: smooth torque of the fitted levels (studies/corners.py).
_PRIOR = (0.45, 0.1, 0.2, 0.175, 0.075)
#: Time scale of the roughness, short of what the telemetry resolves; and of what "thereabouts" means. [s]
ROUGH_LENGTH_S, _NEARBY_S = 4.0, 10.0
#: Degrees of freedom of the bends: Cauchy, so that one sharp corner does not widen all others.
BEND_FREEDOM = 1.0
#: Beta prior of the share of instants that are corners: one in a minute, to a factor of e, however near the candidates.
_CORNER_PRIOR = (1.0, 60.0)
#: Most candidate instants; a longer record has them further apart, to at most COARSEST_S. [s]
_CANDIDATES, COARSEST_S = 1200, 5.0
#: Proposals for each candidate instant, the fewest in all, and the share thrown away.
_PROPOSALS, _LEAST_PROPOSALS, _BURN_IN = 50, 30_000, 0.4
_MOST_CORNERS = 160
#: Chains whose draws are put together: one alone may stay with few corners and much roughness, or many and little.
_CHAINS = 4
#: Innovations whose mean square is above 1 by this many standard errors are not explained. [sigma]
_UNEXPLAINED = 5.0
#: A column of which less than this share is its own, beside those already in the set, is refused: rounding would decide.
_ALONE = 1e-9


def spacing_s(duration_s: float, step_s: float) -> float:
    """Distance of candidate corners in a record of that length. [s]"""
    return step_s * max(1, math.ceil(duration_s / step_s / _CANDIDATES))


def draw_torques(
    body: Body,
    levels: Levels,
    times: Times,
    data: Measurements,
    columns: np.ndarray,
    count: int,
    rng: np.random.Generator,
) -> Posterior:
    """The posterior of corners, bends and roughness at fixed ``levels``; ``columns``: (M, P), of one sigma each.

    A sampler that has not found what explains the data as well as a smooth torque does is given ten
    times longer; whether it did in the end stands in ``settings['explained']``."""
    wanted = times.seconds[times.wanted]
    every = round(spacing_s(np.ptp(wanted), float(wanted[1] - wanted[0])) / (wanted[1] - wanted[0]))
    candidates = wanted[::every]
    spacing = float(candidates[1] - candidates[0])
    t = times.seconds[:, None]
    basis = np.hstack([np.ones_like(t), t - t[0], np.maximum(t - candidates, 0.0)])
    lines = response(body, levels, times, data, basis)
    seen = np.hstack([lines[:, :2], columns, lines[:, 2:]])
    fixed = 2 + columns.shape[1]
    begin = np.concatenate([np.zeros(fixed, int), np.searchsorted(times.seconds, candidates)])
    slope = levels.torque_Nm * math.sqrt(3) / levels.length_s
    always = np.array([levels.torque_Nm, slope, *np.ones(columns.shape[1])])
    of_torque = np.r_[0, 1, fixed : len(begin)]
    proposals = max(_LEAST_PROPOSALS, _PROPOSALS * len(candidates))

    def chain(grams, share, proposals, count, corners):
        G, b, evidence = grams
        return _sample(
            G, b, evidence, np.log(share), always, slope**2, np.array([_CORNER_PRIOR[0], _CORNER_PRIOR[1] / spacing]), BEND_FREEDOM,
            proposals, int(_BURN_IN * proposals), count, _MOST_CORNERS, corners, rng,
        )  # fmt: skip

    def whitened(size_Nm, length_s=ROUGH_LENGTH_S):
        g = gains(body.model(levels, times, length_s, size_Nm), data)
        X = whiten(g, seen, begin)
        return g, (X.T @ X, X.T @ g.own, g.log_likelihood)

    def stacked(ways):
        return tuple(np.array(x) for x in zip(*(gram for _, gram in ways), strict=True))

    plain = whitened(np.zeros(len(t)))
    first, _, _ = chain(stacked([plain]), np.ones(1), proposals, count, np.empty(0, np.int64))
    found = fixed + np.flatnonzero(first[-1, fixed:])
    first = first[:, of_torque]
    size = np.sqrt(gaussian_filter1d(np.mean((first @ basis.T) ** 2, axis=0), _NEARBY_S / _step(times), mode="nearest"))
    ways = [plain, *[whitened(r * size) for r in ROUGHNESS], whitened(levels.torque_Nm, levels.length_s)]
    grams, kept = stacked(ways), -(-count // _CHAINS)
    for effort in (1, 10):
        drawn = [chain(grams, np.array(_PRIOR), effort * proposals, kept, found) for _ in range(_CHAINS)]
        bends, corners, which = (np.concatenate(x)[:count] for x in zip(*drawn, strict=True))
        usual = int(np.bincount(which).argmax())
        g = ways[usual][0]
        left = g.own - whiten(g, seen @ bends[which == usual].mean(axis=0)[:, None])[:, 0]
        explained = np.mean(left**2) < 1 + _UNEXPLAINED * math.sqrt(2 / len(left))
        if explained:
            break
    torque = bends[:, of_torque] @ basis.T
    residual = data.value[:, None] - seen @ bends.T
    for k in range(1, len(ways)):
        mine = which == k
        if mine.any():
            added = paths(ways[k][0], residual[:, mine], [body.torque], rng)[:, :, 0]
            torque[mine] += body.inertia_kgm2 * added
    settings = {
        "corners": float(corners.mean()),
        "lines_probability": float(np.mean(which == 0)),
        "smooth_probability": float(np.mean(which == len(ways) - 1)),
        "explained": bool(explained),
    }
    return Posterior(torque.mean(axis=0), torque, bends[:, 2:fixed], left, settings)


def _step(times: Times) -> float:
    """Mean step: the instants are nearly even, and the neighbourhood need not be exact."""
    return float(np.mean(np.diff(times.seconds)))


@jit
def _marginal(G, b, active, count, precision, L, z):
    """Log evidence of a set of columns with their coefficients integrated out; leaves Cholesky's L and z = L^-1 b."""
    total = 0.0
    for r in range(count):
        at = active[r]
        for c in range(r + 1):
            s = G[at, active[c]]
            if c == r:
                s += precision[r]
            for i in range(c):
                s -= L[r, i] * L[c, i]
            if c < r:
                L[r, c] = s / L[c, c]
            elif s > _ALONE * (G[at, at] + precision[r]):
                L[r, r] = math.sqrt(s)
            else:
                return -np.inf
        s = b[at]
        for i in range(r):
            s -= L[r, i] * z[i]
        z[r] = s / L[r, r]
        total += 0.5 * (z[r] * z[r] + math.log(precision[r])) - math.log(L[r, r])
    return total


@jit
def _without(active, precision, count, j, active2, precision2):
    """Copy a set without its entry j; returns how many are left."""
    k = 0
    for i in range(count):
        if i != j:
            active2[k], precision2[k] = active[i], precision[i]
            k += 1
    return k


@jit
def _between(left, right, reach, on, extra):
    """Free instants (or ``extra``) within ``reach`` of both: where a merged corner may lie."""
    found = 0
    for x in range(left + 1, right):
        if x - left <= reach and right - x <= reach and (not on[x] or x == extra):
            found += 1
    return found


@jit
def _sample(G, b, evidence, prior, always, size, corner_prior, freedom, proposals, burn, kept, most, corners, rng):
    """``kept`` coefficient vectors, their numbers of corners, and which roughness each has.

    ``always``: prior sigma of the first columns, which are in every set; ``size``: of a bend's
    prior variance, to start from; ``corners``: columns in the set to start from.
    Bends' own precisions and their size are drawn after every eighth proposal."""
    alpha, beta = corner_prior[0], corner_prior[1]
    columns = b.shape[1]
    fixed = len(always)
    free = columns - fixed
    reach = 6  # of a split, in candidates
    on = np.zeros(columns, np.bool_)
    active, active2 = np.zeros(most, np.int64), np.zeros(most, np.int64)
    precision, precision2 = np.zeros(most), np.zeros(most)
    L, L2, z, z2, coefficient = (
        np.zeros((most, most)),
        np.zeros((most, most)),
        np.zeros(most),
        np.zeros(most),
        np.zeros(most),
    )
    for i in range(fixed):
        active[i], precision[i] = i, 1 / always[i] ** 2
    count, level, variance = fixed, 0, size
    for c in corners:
        active[count], precision[count] = c, 1 / variance
        if _marginal(G[level], b[level], active, count + 1, precision, L, z) > -np.inf:
            on[c] = True
            count += 1
    now = _marginal(G[level], b[level], active, count, precision, L, z)
    out, counts, levels = np.zeros((kept, columns)), np.zeros(kept, np.int64), np.zeros(kept, np.int64)
    taken = 0
    for n in range(proposals):
        bends = count - fixed
        kind = rng.random()
        to, change, ratio, added, gone, gone2 = level, 0, 0.0, -1, -1, -1
        new = 0  # corners proposed; 0: nothing
        if kind < 0.15:  # born
            c = fixed + int(rng.random() * free)
            if not on[c] and count < most:
                for i in range(count):
                    active2[i], precision2[i] = active[i], precision[i]
                active2[count] = c
                precision2[count] = rng.gamma(freedom / 2) * 2 / freedom / variance
                new, added = count + 1, c
                ratio = math.log((alpha + bends) / (beta + free - bends - 1)) + math.log(free / (bends + 1.0))
        elif kind < 0.30:  # removed
            if bends > 0:
                j = fixed + int(rng.random() * bends)
                new, gone = _without(active, precision, count, j, active2, precision2), active[j]
                ratio = -math.log((alpha + bends - 1) / (beta + free - bends)) - math.log(free / (1.0 * bends))
        elif kind < 0.75:  # moved
            if bends > 0:
                j = fixed + int(rng.random() * bends)
                far = rng.random()
                d = 1 + int(rng.random() * (1 if far < 0.5 else (4 if far < 0.85 else 20)))
                c = active[j] + (d if rng.random() < 0.5 else -d)
                if fixed <= c < columns and not on[c]:
                    new = _without(active, precision, count, j, active2, precision2) + 1
                    active2[new - 1], precision2[new - 1] = c, precision[j]
                    added, gone = c, active[j]
        elif kind < 0.85:  # split in two
            if bends > 0 and count < most:
                j = fixed + int(rng.random() * bends)
                left, right = active[j] - 1 - int(rng.random() * reach), active[j] + 1 + int(rng.random() * reach)
                if left >= fixed and right < columns and not on[left] and not on[right]:
                    new = _without(active, precision, count, j, active2, precision2) + 2
                    active2[new - 2], precision2[new - 2] = left, precision[j]
                    active2[new - 1] = right
                    precision2[new - 1] = rng.gamma(freedom / 2) * 2 / freedom / variance
                    added, gone, change = left, active[j], right
                    ways = _between(left, right, reach, on, active[j])
                    ratio = math.log((alpha + bends) / (beta + free - bends - 1))
                    ratio += math.log(bends * reach * reach) - math.log((bends + 1.0) * bends * ways)
        elif kind < 0.95:  # two merged
            if bends > 1:
                j, j2 = fixed + int(rng.random() * bends), fixed + int(rng.random() * bends)
                left, right = active[j], active[j2]
                if left < right <= left + 2 * reach:
                    ways = _between(left, right, reach, on, -1)
                    if ways > 0:
                        pick, x = int(rng.random() * ways), left
                        while pick >= 0:
                            x += 1
                            if x - left <= reach and right - x <= reach and not on[x]:
                                pick -= 1
                        new = _without(active, precision, count, j2, active2, precision2)
                        for i in range(new):
                            if active2[i] == left:
                                active2[i] = x
                        added, gone, gone2 = x, left, right
                        ratio = -math.log((alpha + bends - 1) / (beta + free - bends))
                        ratio += math.log(bends * (bends - 1.0) * ways) - math.log((bends - 1.0) * reach * reach)
        elif n > burn // 4:  # another roughness; first the corners have to settle
            to = int(rng.random() * len(evidence))
            if to != level:
                new = _without(active, precision, count, -1, active2, precision2)
                ratio = evidence[to] + prior[to] - evidence[level] - prior[level]
        if new > 0:
            then = _marginal(G[to], b[to], active2, new, precision2, L2, z2)
            if math.log(rng.random()) < then - now + ratio:
                if gone >= 0:
                    on[gone] = False
                if gone2 >= 0:
                    on[gone2] = False
                if added >= 0:
                    on[added] = True
                if change > 0:
                    on[change] = True
                active, active2, precision, precision2 = active2, active, precision2, precision
                L, L2, z, z2 = L2, L, z2, z
                count, now, level = new, then, to
        if n % 8 == 7:
            for r in range(count - 1, -1, -1):
                s = z[r] + rng.standard_normal()
                for i in range(r + 1, count):
                    s -= L[i, r] * coefficient[i]
                coefficient[r] = s / L[r, r]
            while taken < kept and (n - burn) * kept >= taken * (proposals - burn):
                for i in range(count):
                    out[taken, active[i]] = coefficient[i]
                counts[taken], levels[taken] = count - fixed, level
                taken += 1
            spread = 0.0
            for i in range(count):
                precision2[i] = precision[i]
            for i in range(fixed, count):
                square = coefficient[i] ** 2
                precision2[i] = rng.gamma((freedom + 1) / 2) / (0.5 * freedom + 0.5 * square / variance)
                spread += square * precision2[i]
            then = (size + 0.5 * spread) / rng.gamma(1.0 + 0.5 * (count - fixed))
            for i in range(fixed, count):
                precision2[i] /= then
            after = _marginal(G[level], b[level], active, count, precision2, L2, z2)
            if after > -np.inf:  # else rounding would decide: keep those before
                now, variance = after, then
                precision, precision2 = precision2, precision
                L, L2, z, z2 = L2, L, z2, z
    return out, counts, levels
