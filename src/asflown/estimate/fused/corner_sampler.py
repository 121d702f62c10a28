"""Reversible-jump Monte Carlo through sets of corners.

What is sampled is a regression with unit noise, y = X b + e, in which most coefficients b are exactly zero, under
several whitenings of the same data, one for each roughness the torque may have.  A state is a set of columns, each
one's prior precision, their common size, and a roughness; coefficients are integrated out.
"""

from __future__ import annotations

import math

import numpy as np

from ...kit.compiled import jit

_MOST_CORNERS = 160
#: A column of which less than this share is its own, beside those already in the set, is refused: rounding would decide.
_ALONE = 1e-9
#: Cumulative probabilities of the moves: a corner is born, removed, moved, split in two, two are merged; else another
#: roughness is tried.  Moves are proposed most often, since they refine what births have found.
_BORN, _REMOVED, _MOVED, _SPLIT, _MERGED = 0.15, 0.30, 0.75, 0.85, 0.95


@jit
def _marginal(G, b, active, count, precision, U, z, sums, first):
    """Log evidence of a set of columns with their coefficients integrated out; leaves Cholesky's U = L^T, z = L^-1 b, and the sums of
    the evidence's parts.  Those of the ``first`` entries are there already."""
    row = np.empty(count)
    for r in range(first, count):
        at = active[r]
        for c in range(r + 1):
            row[c] = G[at, active[c]]
        row[r] += precision[r]
        least = _ALONE * row[r]
        for c in range(r):
            x = row[c] / U[c, c]
            U[c, r] = x
            for i in range(c + 1, r + 1):  # along a row of U: the processor takes several at a time
                row[i] -= x * U[c, i]
        if not row[r] > least:
            return -np.inf
        U[r, r] = math.sqrt(row[r])
        z[r] = b[at]
    for r in range(count):
        if r >= first:
            z[r] /= U[r, r]
            part = 0.5 * (z[r] * z[r] + math.log(precision[r])) - math.log(U[r, r])
            sums[r] = part + (sums[r - 1] if r > 0 else 0.0)
        for i in range(max(r + 1, first), count):
            z[i] -= z[r] * U[r, i]
    return sums[count - 1] if count > 0 else 0.0


@jit
def _as_before(active, precision, U, z, sums, count, active2, precision2, U2, z2, sums2):
    """Take over what two sets have in common from their beginning; returns how many entries that is."""
    same = 0
    while same < count and active[same] == active2[same] and precision[same] == precision2[same]:
        same += 1
    for r in range(same):
        z2[r], sums2[r] = z[r], sums[r]
        for i in range(r, same):
            U2[r, i] = U[r, i]
    return same


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
def sample(
    G, b, evidence, prior, always, size, corner_prior, share, freedom, proposals, burn, kept, corners, level, rng
):
    """``kept`` coefficient vectors, their numbers of corners, and which roughness each has.

    ``always``: prior sigma of the first columns, which are in every set; ``size``: of a bend's
    prior variance, to start from; ``share``: (columns,), logarithm of how much more probable a corner is at each column than at the
    usual one; ``corners``, ``level``: columns in the set, and roughness, to start from.
    Bends' own precisions and their size are drawn after every eighth proposal."""
    alpha, beta = corner_prior[0], corner_prior[1]
    most = _MOST_CORNERS
    columns = b.shape[1]
    fixed = len(always)
    free = columns - fixed
    reach = 6  # of a split, in candidates
    on = np.zeros(columns, np.bool_)
    active, active2 = np.zeros(most, np.int64), np.zeros(most, np.int64)
    precision, precision2 = np.zeros(most), np.zeros(most)
    U, U2 = np.zeros((most, most)), np.zeros((most, most))
    z, z2, sums, sums2, coefficient = np.zeros(most), np.zeros(most), np.zeros(most), np.zeros(most), np.zeros(most)
    for i in range(fixed):
        active[i], precision[i] = i, 1 / always[i] ** 2
    count, variance = fixed, size
    for c in corners:
        active[count], precision[count] = c, 1 / variance
        if _marginal(G[level], b[level], active, count + 1, precision, U, z, sums, 0) > -np.inf:
            on[c] = True
            count += 1
    now = _marginal(G[level], b[level], active, count, precision, U, z, sums, 0)
    out, counts, levels = np.zeros((kept, columns)), np.zeros(kept, np.int64), np.zeros(kept, np.int64)
    taken = 0
    for n in range(proposals):
        bends = count - fixed
        kind = rng.random()
        # corners added and gone, -1: none; a split adds a second one, never the first column, so that 0 is none
        to, second, ratio, added, gone, gone2 = level, 0, 0.0, -1, -1, -1
        new = 0  # corners proposed; 0: nothing
        if kind < _BORN:  # born
            c = fixed + int(rng.random() * free)
            if not on[c] and count < most:
                for i in range(count):
                    active2[i], precision2[i] = active[i], precision[i]
                active2[count] = c
                precision2[count] = rng.gamma(freedom / 2) * 2 / freedom / variance
                new, added = count + 1, c
                ratio = math.log((alpha + bends) / (beta + free - bends - 1)) + math.log(free / (bends + 1.0))
                ratio += share[c]
        elif kind < _REMOVED:  # removed
            if bends > 0:
                j = fixed + int(rng.random() * bends)
                new, gone = _without(active, precision, count, j, active2, precision2), active[j]
                ratio = -math.log((alpha + bends - 1) / (beta + free - bends)) - math.log(free / (1.0 * bends))
                ratio -= share[gone]
        elif kind < _MOVED:  # moved
            if bends > 0:
                j = fixed + int(rng.random() * bends)
                far = rng.random()
                d = 1 + int(rng.random() * (1 if far < 0.5 else (4 if far < 0.85 else 20)))
                c = active[j] + (d if rng.random() < 0.5 else -d)
                if fixed <= c < columns and not on[c]:
                    new = _without(active, precision, count, j, active2, precision2) + 1
                    active2[new - 1], precision2[new - 1] = c, precision[j]
                    added, gone = c, active[j]
                    ratio = share[added] - share[gone]
        elif kind < _SPLIT:  # split in two
            if bends > 0 and count < most:
                j = fixed + int(rng.random() * bends)
                left, right = active[j] - 1 - int(rng.random() * reach), active[j] + 1 + int(rng.random() * reach)
                if left >= fixed and right < columns and not on[left] and not on[right]:
                    new = _without(active, precision, count, j, active2, precision2) + 2
                    active2[new - 2], precision2[new - 2] = left, precision[j]
                    active2[new - 1] = right
                    precision2[new - 1] = rng.gamma(freedom / 2) * 2 / freedom / variance
                    added, gone, second = left, active[j], right
                    ways = _between(left, right, reach, on, active[j])
                    ratio = math.log((alpha + bends) / (beta + free - bends - 1))
                    ratio += math.log(bends * reach * reach) - math.log((bends + 1.0) * bends * ways)
                    ratio += share[left] + share[right] - share[gone]
        elif kind < _MERGED:  # two merged
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
                        ratio += share[x] - share[left] - share[right]
        elif n > burn // 4:  # another roughness; first the corners have to settle
            to = int(rng.random() * len(evidence))
            if to != level:
                new = _without(active, precision, count, -1, active2, precision2)
                ratio = evidence[to] + prior[to] - evidence[level] - prior[level]
        if new > 0:
            same = 0
            if to == level:
                same = _as_before(active, precision, U, z, sums, min(count, new), active2, precision2, U2, z2, sums2)
            then = _marginal(G[to], b[to], active2, new, precision2, U2, z2, sums2, same)
            if math.log(rng.random()) < then - now + ratio:
                if gone >= 0:
                    on[gone] = False
                if gone2 >= 0:
                    on[gone2] = False
                if added >= 0:
                    on[added] = True
                if second > 0:
                    on[second] = True
                active, active2, precision, precision2 = active2, active, precision2, precision
                U, U2, z, z2, sums, sums2 = U2, U, z2, z, sums2, sums
                count, now, level = new, then, to
        if n % 8 == 7:
            for r in range(count - 1, -1, -1):
                s = z[r] + rng.standard_normal()
                for i in range(r + 1, count):
                    s -= U[r, i] * coefficient[i]
                coefficient[r] = s / U[r, r]
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
            after = _marginal(G[level], b[level], active, count, precision2, U2, z2, sums2, 0)
            if after > -np.inf:  # else rounding would decide: keep those before
                now, variance = after, then
                precision, precision2 = precision2, precision
                U, U2, z, z2, sums, sums2 = U2, U, z2, z, sums2, sums
    return out, counts, levels
