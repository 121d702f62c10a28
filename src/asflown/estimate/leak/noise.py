"""Noise of the residual momentum, learned from quiet pieces of the record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kit.errors import BadInput
from ...kit.regression import memory
from ...kit.timeline import runs
from .residual import AXES_IN_A_LEAK, Steps

#: Noise is learned from quiet pieces of so many instants, from the first ones of which so many count together.
_PIECE, _SHORTEST, _ENOUGH, _FEWEST = 40, 8, 150, 12
_TOO_LARGE = 2.5  # times the median piece's variance: noise alone gives it to one piece in a million
#: A piece whose body rates change by this is not quiet, slew or not: thrusters that no counter reports shake a hold by more, and
#: kicks of theirs are what a median would take out, and a piece's own noise hide (unlike ``subject.slews``). [rad/s]
_SHAKEN = 1e-4
_SMALLEST_NOISE = 1e-5  # N m s; below it noise-free data would make the filter believe rounding


@dataclass(frozen=True)
class Noise:
    """Of one instant's momentum about each body axis, in the long run: variance (3,) [(N m s)^2], and how well it is known."""

    variance: np.ndarray
    alike: np.ndarray  # (3,), how many correlated readings count as one: part of the variance
    degrees: float  # of freedom
    until: int  # instants of the record it was learned from

    @property
    def sigma(self) -> np.ndarray:
        return np.sqrt(self.variance)


def learned_noise(steps: Steps, *, final: bool) -> Noise | None:
    """From the first quiet holds: what is left over straight lines through pieces of them.

    A leak is a straight line too, and hardly shows; a piece in which one begins is left out, since its variance is large.
    None while there are too few instants and more may come.  Raises BadInput where there are too few and the record is
    ``final``."""
    pieces: list[tuple[int, np.ndarray]] = []
    for s in runs(steps.quiet):
        for start in range(s.start, s.stop, _PIECE):
            part = slice(start, min(start + _PIECE, s.stop))
            unfinished = part.stop == len(steps.tai_ns) and part.stop - start < _PIECE and not final
            shaken = np.ptp(steps.body_rate[part], axis=0).max() > _SHAKEN
            if part.stop - start < _SHORTEST or unfinished or shaken:
                continue
            pieces.append((part.stop, _over_a_line(steps, part)))
            like = _alike_in_size(pieces)
            if sum(len(p) - 2 for _, p in like) >= _ENOUGH:
                return _noise_of(like)
    if not final:
        return None
    like = _alike_in_size(pieces) if pieces else []
    if sum(len(p) - 2 for _, p in like) < _FEWEST:
        raise BadInput(
            "there are too few quiet instants to learn the noise from",
            remedy=f"At least {_FEWEST} in holds without firing are needed, {_ENOUGH} are better: take a longer record.",
        )
    return _noise_of(like)


def _over_a_line(steps: Steps, part: slice) -> np.ndarray:
    """Momentum less a straight line through it, body axes, (n, 3)."""
    t = steps.seconds[part] - steps.seconds[part].mean()
    line = np.polynomial.polynomial.polyfit(t, steps.residual[part], 1)
    over = steps.residual[part] - np.polynomial.polynomial.polyval(t, line).T
    return np.einsum("nji,nj->ni", steps.turned[part], over)


def _alike_in_size(pieces):
    """Those whose variance is at most _TOO_LARGE times the median piece's, about every axis."""
    variance = np.array([np.sum(p**2, axis=0) / (len(p) - 2) for _, p in pieces])
    middle = np.sort(variance, axis=0)[(len(pieces) - 1) // 2]
    return [p for p, v in zip(pieces, variance, strict=True) if (v <= _TOO_LARGE * middle).all()]


def _noise_of(pieces) -> Noise:
    over, count = np.concatenate([p for _, p in pieces]), sum(len(p) - 2 for _, p in pieces)
    alike = np.array([memory(over[:, k]) for k in range(3)])
    variance = np.maximum(np.sum(over**2, axis=0) / count * alike, _SMALLEST_NOISE**2)
    return Noise(variance, alike, AXES_IN_A_LEAK * count / float(alike.max()), pieces[-1][0])
