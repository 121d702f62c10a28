"""A torque of straight lines: which corners, how sharp, and how rough between them.

The torque is a line with bends, T(t) = T0 + S0 t + sum_i b_i max(t - t_i, 0), plus a roughness in
proportion to the size the torque has thereabouts.  Everything else in the loop is Gaussian, so each
candidate bend is one column of responses; once the filter has whitened columns and data, what is left is
a regression with unit noise in which most coefficients are exactly zero.  Reversible-jump Monte Carlo
goes through sets of corners (born, removed, moved, split, merged) with the bends integrated out:

    y = X b + D d + e,   b_i ~ N(0, s^2 / l_i), l_i gamma (Student-t bends),   number of corners: beta-binomial

and through a few sizes of roughness and the smooth torque of the fitted levels, each with its own whitening.  D holds the
sensitivities to what is taken as known (an inertia, a gain), d ~ N(0, 1) how far off each is.  A pure triangle keeps its corners
sharp, since a straight line costs nothing; a rubbing hinge gets its roughness, since the data ask for it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.convergence import Convergence, worst
from ...kit.ensemble import Gains, gains, paths, simulate, spread, whiten
from ...kit.peaks import excursions
from .body import AxisData, Posterior
from .corner_sampler import sample
from .peaks import peak_scale
from .suspects import NEAR_S, Suspects, suspects

if TYPE_CHECKING:
    from numpy.random import Generator

#: Sizes of the roughness as shares of the torque's own size near that time, and time scales, short of what the telemetry
#: resolves (studies/corners.py). [1], [s]
ROUGHNESS = ((0.05, 4.0), (0.15, 4.0), (0.45, 4.0))
#: What is given beforehand: nearly half to a torque of pure lines, as much to one with roughness; the last to the
#: smooth torque of the fitted levels (studies/corners.py).
_PRIOR = (0.45, 0.1, 0.2, 0.175, 0.075)
#: What "thereabouts" means. [s]
_NEARBY_S = 10.0
#: Degrees of freedom of the bends: Cauchy, so that one sharp corner does not widen all others.
BEND_FREEDOM = 1.0
#: Beta prior of the share of instants that are corners: one in a minute, to a factor of e, however near the candidates.
_CORNER_PRIOR = (1.0, 60.0)
#: Most instants that are all candidates; in a longer record those near suspect instants are, and so many others.
_CANDIDATES, _COARSE = 1200, 60
#: A torque whose fitted length is above this is slow, with edges in it; a faster one is made of excursions, which lines suit. [s]
_SLOW_S = 60.0
#: Lengths of the ramps in a long record [s]: a bend for each end, of a size of its own, would have them long, whatever the data
#: say (by the cube of the length).  Edges are steps, or a shadow's penumbra of seconds.
_RAMPS_S = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
#: Beta prior of the share of instants of a long record that are edges: one in ten minutes, to a factor of e. [s]
_EDGE_PRIOR = (1.0, 600.0)
#: Usual size of an edge, as a share of the slow torque's; the sizes are Cauchy, so that large ones are as welcome.
_EDGE_SHARE = 0.1
#: Proposals for each candidate instant, the fewest in all, and the share thrown away.
_PROPOSALS, _LEAST_PROPOSALS, _BURN_IN = 50, 30_000, 0.4
#: Chains whose draws are put together: one alone may stay with few corners and much roughness, or many and little.
_CHAINS = 4
#: In a long record chains that lie further apart than this walk again, with so many times the proposals.
_FAR, _FURTHER = 1.05, 6
#: In an event, where few draws are kept and chance alone makes 1.05.
_FAR_IN_EVENT = 1.1
#: Chains have met below this R-hat; the furthest that widens a band.
_MET, _FURTHEST = 1.01, 5.0
#: Draws of a chain for each that is used, to see whether chains have met; at how many instants that is looked at.
_MORE, _LOOKED_AT = 5, 16
#: Innovations whose mean square is above 1 by this many standard errors are not explained. [sigma]
_UNEXPLAINED = 5.0
#: Where pure lines are more probable than this, the peaks' sigma needs no scale (flights give 0.8 to 1.1,
#: studies/peak_scale.py), and the flights, half of the run time, are left out.
_SURE_OF_LINES = 0.5
#: Flights of the model itself that the peaks' sigma is checked against; their share of the proposals, and draws of each.
_FLIGHTS, _FLOWN_PROPOSALS, _FLOWN_DRAWS = 8, 0.5, 80


def all_candidates(instants: int) -> bool:
    """Whether a record is so short that corners are looked for at all of its instants."""
    return instants <= _CANDIDATES + 1


def is_slow(axis: AxisData) -> bool:
    """Whether the torque of the fitted levels is a slow one, with edges in it."""
    return axis.levels.length_s > _SLOW_S


@dataclass(frozen=True)
class _Way:
    """One roughness: its filter, the columns whitened by it, and their normal equations."""

    gains: Gains
    columns: np.ndarray  # (M, C)
    gram: np.ndarray  # (C, C)
    rough: bool


@dataclass(frozen=True)
class _Walked:
    """Draws from the sampler: coefficients (K, C), numbers of corners (K,), and the way of each (K,)."""

    bends: np.ndarray
    corners: np.ndarray
    which: np.ndarray


@dataclass(frozen=True)
class _Found:
    """What all chains drew, innovations (M,) of the most frequent way, whether these are as small as they should be, and whether
    the chains have met."""

    drawn: _Walked
    left: np.ndarray
    explained: bool
    met: Convergence

    def widened(self, post: Posterior) -> Posterior:
        """Of chains that lie apart the mean is itself uncertain, by what lies between them over their number less one."""
        if self.met.r_hat <= _MET:
            return post
        wider = math.sqrt(1 + (min(self.met.r_hat, _FURTHEST) ** 2 - 1) / (_CHAINS - 1))
        return replace(post, paths=post.mean + wider * (post.paths - post.mean))

    @property
    def settings(self) -> dict:
        return {
            "explained": self.explained, "r_hat": self.met.r_hat, "effective_bulk": self.met.bulk, "effective_tail": self.met.tail,
        }  # fmt: skip


@dataclass(frozen=True)
class _Search:
    """What does not depend on the values measured: candidate corners, their responses, and priors.

    Columns are the line's two, those of what is taken as known, and a bend at every candidate."""

    axis: AxisData
    basis: np.ndarray  # (N, 2 + candidates), torque of a unit of each [N m]
    seen: np.ndarray  # (M, C), what of it is measured
    begin: np.ndarray  # (C,), the instant before which each column is zero
    always: np.ndarray  # prior sigma of the columns that are in every set
    bend_variance: float
    corner_prior: np.ndarray
    share: np.ndarray  # (C,), logarithm of the time that each candidate stands for, over the usual one's
    proposals: int
    rng: Generator

    @classmethod
    def of_bends(cls, axis: AxisData, at_s: np.ndarray, rng: Generator) -> _Search:
        """A bend at each even instant."""
        t, slope = axis.times.seconds, axis.levels.torque_Nm * math.sqrt(3) / axis.levels.length_s
        bends, begin = np.maximum(t[:, None] - at_s, 0.0), np.searchsorted(t, at_s)
        return cls._of(axis, bends, begin, slope**2, np.diff(at_s[:2]).repeat(len(at_s)), _CORNER_PRIOR, rng)

    @classmethod
    def of_ramps(
        cls, axis: AxisData, at_s: np.ndarray, long_s: np.ndarray, each_s: np.ndarray, rng: Generator
    ) -> _Search:
        """Ramps about some instants, of some lengths, to a step of one; ``each_s``: the time that each stands for."""
        t = axis.times.seconds
        ramps = np.clip((t[:, None] - at_s) / long_s + 0.5, 0.0, 1.0)
        begin = np.searchsorted(t, at_s - long_s / 2)
        begin = np.minimum.accumulate(begin[::-1])[::-1]  # must not fall: a few steps of zeros more
        return cls._of(axis, ramps, begin, (_EDGE_SHARE * axis.levels.torque_Nm) ** 2, each_s, _EDGE_PRIOR, rng)

    @classmethod
    def _of(cls, axis: AxisData, shapes, begin, variance: float, each_s: np.ndarray, prior, rng: Generator) -> _Search:
        times, levels, columns = axis.times, axis.levels, axis.columns
        t = times.seconds[:, None]
        basis = np.hstack([np.ones_like(t), t - t[0], shapes])
        lines = axis.response(basis)
        known = columns.shape[1]
        slope = levels.torque_Nm * math.sqrt(3) / levels.length_s
        usual = float(each_s.mean())
        return cls(
            axis,
            basis,
            np.hstack([lines[:, :2], columns, lines[:, 2:]]),
            np.concatenate([np.zeros(2 + known, int), begin]),
            np.array([levels.torque_Nm, slope, *np.ones(known)]),
            variance,
            np.array([prior[0], prior[1] / usual]),
            np.concatenate([np.zeros(2 + known), np.log(each_s / usual)]),
            max(_LEAST_PROPOSALS, _PROPOSALS * shapes.shape[1]),
            rng,
        )

    @property
    def fixed(self) -> int:
        return len(self.always)

    def way(self, size_Nm, length_s: float) -> _Way:
        """The way of a roughness of that size (one, or (N,)) and length."""
        g = gains(self.axis.body.model(self.axis.levels, self.axis.times, length_s, size_Nm), self.axis.data)
        X = whiten(g, self.seen, self.begin)
        return _Way(g, X, X.T @ X, bool(np.any(size_Nm)))

    def lines(self, coefficients: np.ndarray) -> np.ndarray:
        """Torques (K, N) of coefficients (K, C), without roughness."""
        chosen = np.delete(coefficients, np.s_[2 : self.fixed], axis=1)
        used = np.any(chosen, axis=0)  # most are in no set that was drawn
        return chosen[:, used] @ self.basis[:, used].T

    def quantities(self, chains: list[_Walked]) -> list[np.ndarray]:
        """What is looked at to see whether chains have met, each (chains, draws): corners, and the torque at some instants."""
        few = replace(self, basis=self.basis[np.linspace(0, len(self.basis) - 1, _LOOKED_AT).astype(int)])
        torques = np.array([few.lines(c.bends) for c in chains])
        return [np.array([c.corners for c in chains]), *np.moveaxis(torques, 2, 0)]

    def walk(
        self,
        ways: list[_Way],
        prior,
        own: list[np.ndarray],
        evidence,
        start: np.ndarray,
        count: int,
        effort=1.0,
        level=0,
    ) -> _Walked:
        """``count`` draws; ``own``: data whitened in each way (M,); ``start``, ``level``: corners and way to start from."""
        b = np.array([w.columns.T @ o for w, o in zip(ways, own, strict=True)])
        proposals = int(effort * self.proposals)
        return _Walked(*sample(
            np.array([w.gram for w in ways]), b, np.array(evidence), np.log(prior[: len(ways)]), self.always, self.bend_variance, self.corner_prior, self.share, BEND_FREEDOM,
            proposals, int(_BURN_IN * proposals), count, start, level, self.rng,
        ))  # fmt: skip

    def torques(self, ways: list[_Way], value: np.ndarray, drawn: _Walked) -> np.ndarray:
        """Torques (K, N) of draws given the measurements (M,), their roughness drawn too."""
        body, torque = self.axis.body, self.lines(drawn.bends)
        used = np.any(drawn.bends, axis=0)
        residual = value[:, None] - self.seen[:, used] @ drawn.bends[:, used].T
        for k, way in enumerate(ways):
            mine = drawn.which == k
            if way.rough and mine.any():
                added = paths(way.gains, residual[:, mine], [body.torque], self.rng)[:, :, 0]
                torque[mine] += body.inertia_kgm2 * added
        return torque


def draw_torques(axis: AxisData, count: int, rng: Generator) -> Posterior:
    """The posterior of corners, bends and roughness at the axis's levels.

    In a long record, and where the torque is slow, ramps are looked for near suspect instants, beside a smooth torque of the levels
    between the edges (``suspects``).  Where the first draws do not explain the data as well as a smooth torque does, the sampler is given ten times
    as many proposals; ``Posterior.explained`` says whether they did in the end."""
    wanted = axis.times.seconds[axis.times.wanted]
    if not all_candidates(len(wanted)) or is_slow(axis):
        return _in_long(axis, wanted, count, rng)
    search = _Search.of_bends(axis, wanted, rng)
    ways, found = _ways(search, count)
    walked = _walked(search, ways, _PRIOR, found, count, apart=_FAR_IN_EVENT)
    drawn = walked.drawn
    torque = search.torques(ways, axis.data.value, drawn)
    mean, as_lines, scale = torque.mean(axis=0), float(np.mean(drawn.which == 0)), 1.0
    settings = {
        "corners": float(drawn.corners.mean()),
        "lines_probability": as_lines,
        "smooth_probability": float(np.mean(drawn.which == len(ways) - 1)),
        **walked.settings,
    }
    if walked.explained and as_lines < _SURE_OF_LINES:
        shown = axis.times.wanted
        peaks = excursions(mean[shown], spread(torque[:, shown]))
        if len(peaks):
            true, flown = _flown_again(search, ways, drawn, torque)
            scale = settings["peak_scale"] = peak_scale(axis.times.seconds[shown], mean[shown], peaks, true, flown)
    considered = drawn.bends[:, 2 : search.fixed]
    return walked.widened(Posterior(mean, torque, considered, walked.left, settings, walked.explained, scale))


def _in_long(axis: AxisData, wanted: np.ndarray, count: int, rng: Generator) -> Posterior:
    """As ``draw_torques``, of a slow torque, or of a record with more instants than candidates can be."""
    found = suspects(axis)
    at, length, each = _ramps(found, wanted)
    levels = found.axis.levels
    search = _Search.of_ramps(found.axis, at, length, each, rng)
    ways = [search.way(levels.torque_Nm, levels.length_s)]
    start = [search.fixed + int(np.argmin(np.abs(at - t) + np.abs(np.log(length / 8.0)))) for t in found.edges]
    walked = _walked(search, ways, np.ones(1), np.unique(np.array(start, np.int64)), count, (1, _FURTHER), _FAR)
    drawn = walked.drawn
    torque = search.torques(ways, axis.data.value, drawn)
    settings = {
        "edges": float(drawn.corners.mean()), "edges_found_s": found.edges.tolist(), "suspects": len(found.seconds),
        "torque_between_edges_Nm": levels.torque_Nm, "length_between_edges_s": levels.length_s,
        "curved_between_edges": found.axis.body.curved, **walked.settings,
    }  # fmt: skip
    considered = drawn.bends[:, 2 : search.fixed]
    return walked.widened(Posterior(torque.mean(axis=0), torque, considered, walked.left, settings, walked.explained))


def _ramps(found: Suspects, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles and lengths of the ramps that are looked for, and the time that each stands for, in order of time. [s]

    Dense about edges, coarser about other suspects, and a few elsewhere; their lengths are as probable as their logarithms."""
    step = float(wanted[1] - wanted[0])
    rows = []
    for length in _RAMPS_S:
        for near, spacing in ((found.edges, max(step, length / 4)), (found.seconds, max(step, length / 2))):
            for t in near:
                here = t + np.arange(-NEAR_S, NEAR_S + 1e-9, spacing)
                rows += [(round(x / step) * step, length, spacing) for x in here if wanted[0] < x < wanted[-1]]
    coarse = np.ptp(wanted) / _COARSE
    rows += [(x, _RAMPS_S[-1], coarse) for x in np.arange(wanted[0] + coarse / 2, wanted[-1], coarse)]
    finest: dict[tuple[float, float], float] = {}  # of those that coincide
    for at, length, spacing in rows:
        finest[at, length] = min(spacing, finest.get((at, length), np.inf))
    at, length, each = np.array([(*k, v) for k, v in sorted(finest.items())]).T
    return at, length, each / len(_RAMPS_S)


def _ways(search: _Search, count: int) -> tuple[list[_Way], np.ndarray]:
    """Pure lines, three sizes of roughness and the smooth torque; and the corners that pure lines need."""
    levels, times = search.axis.levels, search.axis.times
    plain = search.way(np.zeros(len(times.seconds)), ROUGHNESS[0][1])
    first = search.walk(
        [plain], np.ones(1), [plain.gains.own], [plain.gains.log_likelihood], np.empty(0, np.int64), count
    ).bends
    square = np.mean(search.lines(first) ** 2, axis=0)
    # the instants are nearly even, and the neighbourhood need not be exact
    size = np.sqrt(
        scipy.ndimage.gaussian_filter1d(square, _NEARBY_S / float(np.mean(np.diff(times.seconds))), mode="nearest")
    )
    ways = [
        plain,
        *[search.way(r * size, s) for r, s in ROUGHNESS],
        search.way(levels.torque_Nm, levels.length_s),
    ]
    return ways, search.fixed + np.flatnonzero(first[-1, search.fixed :])


def _walked(
    search: _Search, ways: list[_Way], prior, found: np.ndarray, count: int, efforts=(1, 10), apart: float = np.inf
) -> _Found:
    """Draws of all chains, with more proposals (``efforts``) where the first do not explain the data, or the chains lie apart."""
    own, evidence = [w.gains.own for w in ways], [w.gains.log_likelihood for w in ways]
    of_each = -(-count // _CHAINS)
    for effort in efforts:
        chains = [search.walk(ways, prior, own, evidence, found, _MORE * of_each, effort) for _ in range(_CHAINS)]
        met = worst(search.quantities(chains))
        drawn = _Walked(
            *(np.concatenate(x)[:count] for x in zip(*((c.bends[::_MORE], c.corners[::_MORE], c.which[::_MORE]) for c in chains), strict=True))
        )  # fmt: skip
        usual = int(np.bincount(drawn.which).argmax())
        left = own[usual] - ways[usual].columns @ drawn.bends[drawn.which == usual].mean(axis=0)
        usually = (
            max(1.0, float(np.mean(own[0] ** 2))) if ways[0].rough else 1.0
        )  # a smooth torque's own, where it is the first
        explained = bool(np.mean(left**2) < usually + _UNEXPLAINED * math.sqrt(2 / len(left)))
        if explained and met.r_hat < apart:
            break
    return _Found(drawn, left, explained, met)


def _flown_again(search: _Search, ways: list[_Way], drawn: _Walked, torque) -> tuple[np.ndarray, np.ndarray]:
    """Some of the drawn torques (F, N wanted), and what is made of each from telemetry the model itself would give of it (F, K, N wanted)."""
    axis, rng, fixed = search.axis, search.rng, search.fixed
    chosen = rng.choice(len(torque), _FLIGHTS, replace=False)
    quiet = simulate(ways[0].gains.model, axis.data, [axis.body.torque], _FLIGHTS, rng)[1]  # of no torque at all: noise
    value = axis.response(torque[chosen].T) + search.seen[:, 2:fixed] @ drawn.bends[chosen, 2:fixed].T + quiet
    own = [whiten(w.gains, value) for w in ways]
    wanted, flown = axis.times.wanted, []
    for k, j in enumerate(chosen):
        evidence = [
            w.gains.log_likelihood + 0.5 * (w.gains.own @ w.gains.own - o[:, k] @ o[:, k])
            for w, o in zip(ways, own, strict=True)
        ]
        start = fixed + np.flatnonzero(drawn.bends[j, fixed:])
        again = search.walk(
            ways, _PRIOR, [o[:, k] for o in own], evidence, start, _FLOWN_DRAWS, _FLOWN_PROPOSALS, drawn.which[j]
        )
        flown.append(search.torques(ways, value[:, k], again)[:, wanted])
    return torque[chosen][:, wanted], np.array(flown)
