"""Compiled kernels of the Gates likelihoods, normal and with the tails of Student's t; they call each other, so they share a file.

Rows: a measurement each, (M,), with variance d + a + b z, z = v^2; columns of the biases (M, p); k: exponents; ``prior``: mean
and width of both sigmas, width 0 for none.  All without dimension.
"""

from __future__ import annotations

import numpy as np

from ...kit.compiled import jit

#: Variance below which nothing is told apart from nothing, in units of mean y^2.
FLOOR = 1e-12
#: Degrees of freedom of the t.
FREEDOM = 4.0


@jit
def evaluate(a, b, y, d, z, X, k, reml, prior, beta, out):
    """Objective (-log likelihood without constants); biases into ``beta``, gradient and expected Hessian into ``out``."""
    M, p = X.shape
    A = np.zeros((p, p))  # then its Cholesky factor, with one over the diagonal
    c, h = np.zeros(p), np.zeros(p)
    inverse = np.empty(M)
    f = 0.0
    for i in range(M):
        s = max(d[i] + a + b * z[i], FLOOR)
        inverse[i] = 1 / s
        f += 0.5 * k[i] * np.log(s)
        w = k[i] * inverse[i]
        for j in range(p):
            wx = w * X[i, j]
            c[j] += wx * y[i]
            for q in range(j + 1):
                A[j, q] += wx * X[i, q]
    for j in range(p):
        for q in range(j + 1):
            t = A[j, q]
            for m in range(q):
                t -= A[j, m] * A[q, m]
            if j == q:
                root = np.sqrt(max(t, 1e-14 * A[j, j]))  # of burns all of one size: either bias does, neither is known
                A[j, j] = 1 / root
                if reml:
                    f += np.log(root)
            else:
                A[j, q] = t * A[q, q]
    for j in range(p):
        t = c[j]
        for m in range(j):
            t -= A[j, m] * c[m]
        c[j] = t * A[j, j]
    for j in range(p - 1, -1, -1):
        t = c[j]
        for m in range(j + 1, p):
            t -= A[m, j] * beta[m]
        beta[j] = t * A[j, j]
    ga, gb, haa, hab, hbb = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(M):
        r = y[i]
        for j in range(p):
            r -= X[i, j] * beta[j]
        w = k[i] * inverse[i]
        f += 0.5 * w * r * r
        curve = 0.5 * w * inverse[i]
        slope = 0.5 * w - curve * r * r
        if reml:  # less the diagonal of the hat matrix
            for j in range(p):
                t = X[i, j]
                for m in range(j):
                    t -= A[j, m] * h[m]
                h[j] = t * A[j, j]
                slope -= curve * h[j] * h[j]
        ga += slope
        gb += slope * z[i]
        haa += curve
        hab += curve * z[i]
        hbb += curve * z[i] * z[i]
    if prior[1] > 0:
        root = np.sqrt(max(a, 1e-10))
        f += 0.5 * ((root - prior[0]) / prior[1]) ** 2
        ga += 0.5 * (1 - prior[0] / root) / prior[1] ** 2
        haa += 0.25 * prior[0] / root**3 / prior[1] ** 2
    if prior[3] > 0:
        root = np.sqrt(max(b, 1e-10))
        f += 0.5 * ((root - prior[2]) / prior[3]) ** 2
        gb += 0.5 * (1 - prior[2] / root) / prior[3] ** 2
        hbb += 0.25 * prior[2] / root**3 / prior[3] ** 2
    out[0], out[1], out[2], out[3], out[4] = ga, gb, haa, hab, hbb
    return f


@jit
def descend(a, b, free_a, free_b, y, d, z, X, k, reml, prior, beta, out):
    """From one start to a minimum, by scoring steps kept at or above zero.  Returns a, b and the objective."""
    f = evaluate(a, b, y, d, z, X, k, reml, prior, beta, out)
    for _ in range(200):
        ga, gb, haa, hab, hbb = out[0], out[1], out[2], out[3], out[4]
        move_a = free_a and not (a <= 0 and ga >= 0)
        move_b = free_b and not (b <= 0 and gb >= 0)
        if move_a and move_b:
            determinant = haa * hbb * (1 + 1e-9) - hab * hab
            da = -(hbb * ga - hab * gb) / determinant
            db = -(haa * gb - hab * ga) / determinant
        elif move_a:
            da, db = -ga / haa, 0.0
        elif move_b:
            da, db = 0.0, -gb / hbb
        else:
            break
        step, better = 1.0, False
        for _try in range(40):
            na, nb = max(a + step * da, 0.0), max(b + step * db, 0.0)
            found = evaluate(na, nb, y, d, z, X, k, reml, prior, beta, out)
            if found < f:
                better = True
                break
            step *= 0.5
        if not better:
            break
        gain = f - found
        still = abs(na - a) <= 1e-9 * (na + 1e-9) and abs(nb - b) <= 1e-9 * (nb + 1e-9)
        a, b, f = na, nb, found
        if gain < 1e-9 or still:
            break
    return a, b, f


@jit
def minimum(starts, free_a, free_b, y, d, z, X, k, reml, prior, best_beta):
    """The least objective over several starts (S, 2).  Returns a, b, objective; biases into ``best_beta``."""
    beta, out = np.zeros(X.shape[1]), np.zeros(5)
    best_a, best_b, best = starts[0, 0], starts[0, 1], np.inf
    for n in range(starts.shape[0]):
        a, b, f = descend(starts[n, 0], starts[n, 1], free_a, free_b, y, d, z, X, k, reml, prior, beta, out)
        if f < best - 1e-11:
            best_a, best_b, best = a, b, f
    best = evaluate(best_a, best_b, y, d, z, X, k, reml, prior, best_beta, out)
    return best_a, best_b, best


@jit
def refits(sets, starts, free_a, free_b, d, z, X, k, reml, prior):
    """The minimum of every row of ``sets`` (B, M): variances and biases, (B, 2 + p)."""
    found = np.empty((sets.shape[0], 2 + X.shape[1]))
    beta = np.zeros(X.shape[1])
    for n in range(sets.shape[0]):
        a, b, _ = minimum(starts, free_a, free_b, sets[n], d, z, X, k, reml, prior, beta)
        found[n, 0], found[n, 1] = a, b
        found[n, 2:] = beta
    return found


@jit
def weigh(a, b, y, d, z, X, burn, c, beta, root):
    """sqrt(u) / c of every row into ``root``.  Returns by what t's objective exceeds that of the normal one so weighted."""
    n = burn.max() + 1
    q, m, extra = np.zeros(n), np.zeros(n), 0.0
    for i in range(len(y)):
        r = y[i]
        for j in range(X.shape[1]):
            r -= X[i, j] * beta[j]
        q[burn[i]] += r * r / max(d[i] + a + b * z[i], FLOOR) / c**2
        m[burn[i]] += 1
    for i in range(len(y)):
        root[i] = np.sqrt((FREEDOM + m[burn[i]]) / (FREEDOM + q[burn[i]])) / c
    for g in range(n):
        extra += 0.5 * (FREEDOM + m[g]) * (np.log1p(q[g] / FREEDOM) - q[g] / (FREEDOM + q[g]))
    return extra


@jit
def robust_minimum(starts, free_a, free_b, y, d, z, X, k, reml, prior, burn, c, beta):
    """The most likely variances and the objective there; biases into ``beta``."""
    starts, root, out = starts.copy(), np.empty(len(y)), np.zeros(5)
    a, b, _ = minimum(starts, free_a, free_b, y, d, z, X, k, reml, prior, beta)
    last = np.inf
    for _ in range(200):
        extra = weigh(a, b, y, d, z, X, burn, c, beta, root)
        weighted, columns = y * root, X.copy()
        for j in range(X.shape[1]):
            columns[:, j] *= root
        f = extra + evaluate(a, b, weighted, d, z, columns, k, reml, prior, beta, out)
        if abs(last - f) < 1e-9:
            break
        last = f
        starts[0, 0], starts[0, 1] = a, b
        a, b, _ = minimum(starts, free_a, free_b, weighted, d, z, columns, k, reml, prior, beta)
    return a, b, f


@jit
def robust_refits(sets, starts, free_a, free_b, d, z, X, k, reml, prior, burn, c):
    """The maximum of every row of ``sets`` (B, M): variances and biases, (B, 2 + p)."""
    found = np.empty((sets.shape[0], 2 + X.shape[1]))
    beta = np.zeros(X.shape[1])
    for n in range(sets.shape[0]):
        found[n, 0], found[n, 1], _ = robust_minimum(
            starts, free_a, free_b, sets[n], d, z, X, k, reml, prior, burn, c, beta
        )
        found[n, 2:] = beta
    return found
