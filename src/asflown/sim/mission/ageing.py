"""The motion of a cover whose torque is to have given figures of merit.

The cover's momentum in a body held still is h = g(angle) rate, its torque on the body -dh/dt (cover.py, plant.py).
Three things follow, and this file rests on them:

- the impulse up to a moment is the momentum held then, so the build-up scales with it;
- the excursions are the slopes of the momentum between its turns: falls and rises are scaled each on their own;
- the integral of g over the travel is fixed, and it is the integral of the momentum over time: falls are made longer
  and rises shorter, or the other way round, until the travel comes out.  The swings as a whole last as long as
  before; the last fall lasts as long as it takes to come to rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...kit.errors import BadInput
from ...kit.peaks import peaks
from ..flight import MovingPart, momentum_per_rate, moving_part

if TYPE_CHECKING:
    from ..scenario import CoverMotion

#: The first kind of motion lasts this long from motor-on (cover paper, section V: minute 1.00 to 2.35). [s]
BUILD_UP_S = 81.0
#: Excursions nearer than this to a larger one, or standing out less than this share of the largest, are part of it.
APART_S, STANDS_OUT = 5.0, 0.1
#: The new table of rates has an entry about this often. [s]
_STEP_S = 0.8
#: Entries stand on this grid, the control instants of the flight: a kink within an integrator's step costs accuracy. [s]
_GRID_S = 0.125
#: The grid makes the figures jump by a few 1e-5 of themselves; a motion that misses by more than the last is no answer.
_ROUNDS, _CLOSE, _ENOUGH = 30, 5e-5, 2e-3


@dataclass(frozen=True)
class Figures:
    """True figures of merit of a torque about the hinge, on the body, with their sign (cover paper, section V)."""

    impulse_Nms: float
    peak_positive_Nm: float
    peak_negative_Nm: float
    peak_momentum_Nms: float = np.nan  # largest momentum given to the body on the way
    net_impulse_Nms: float = np.nan


def figures_of(time_s, torque_Nm, motor_on_s: float) -> Figures:
    """Figures of merit from a noise-free torque, (N,) each.

    The same definitions as those of the estimates, written here anew: a mistake in either shows against the other."""
    since = np.asarray(time_s) - motor_on_s
    held = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(since) * (torque_Nm[1:] + torque_Nm[:-1]))])
    held -= np.interp(0.0, since, held)
    late = since >= BUILD_UP_S
    return Figures(
        float(np.interp(BUILD_UP_S, since, held)),
        _two_largest(since[late], torque_Nm[late]),
        -_two_largest(since[late], -torque_Nm[late]),
        float(held[np.argmax(np.abs(held))]),
        float(held[-1]),
    )


def _two_largest(t, v) -> float:
    step = float(np.median(np.diff(t)))
    at = peaks(v, height=0, prominence=STANDS_OUT * v.max(), distance=round(APART_S / step))
    return float(np.mean(np.sort(v[at])[-2:])) if len(at) else 0.0


@dataclass(frozen=True)
class _Shape:
    """The pattern's momentum: its build-up, then turn after turn, down to rest."""

    build_up: scipy.interpolate.PchipInterpolator  # size of the momentum until the end of the build-up
    start: float
    end: float  # of the build-up
    turns: np.ndarray  # (m + 1,) times, the first that end
    steps: np.ndarray  # (m,) change of the momentum's size: fall, rise, fall, ..., fall
    stall: float  # as a share of the last fall


def _shape_of(cover: CoverMotion, part: MovingPart) -> _Shape:
    """Turns of the pattern, from its table's entries.  Raises BadInput where it does not build up, then swing."""
    times, rates = np.array(cover.times), np.array(cover.rates)
    end = cover.motor_on + BUILD_UP_S
    angle = scipy.interpolate.PchipInterpolator(times, rates).antiderivative()(times)
    if cover.direction == "stow":
        angle = part.travel - angle
    held = np.abs(rates * _per_rate(part)(angle))
    after = np.flatnonzero(times >= end)
    swings = np.sign(np.diff(held[after]))
    turn = after[np.concatenate([[True], swings[1:] != swings[:-1], [True]])] if len(swings) else after
    steps = np.diff(held[turn])
    if len(steps) < 3 or steps[0] >= 0 or times[0] != cover.motor_on or times[after[0]] != end:
        raise BadInput(
            "this motion cannot age: its table does not start at motor-on, or has no entry 81 s later, or its momentum "
            "does not fall and rise after that",
            remedy="Take cover-deploy or cover-stow as the pattern.",
        )
    stall = (cover.stall - times[turn[-2]]) / (times[turn[-1]] - times[turn[-2]])
    from_rest = scipy.interpolate.PchipInterpolator(
        [times[0] - 1, *times], [0, *held]
    )  # its slope is zero at the start
    return _Shape(from_rest, float(times[0]), end, times[turn], steps, float(np.clip(stall, 0, 1)))


def aged(cover: CoverMotion, now, wanted: Figures, late_s=None) -> tuple[CoverMotion, Figures]:
    """The motion changed so that its true impulse and peaks are the wanted ones, and what they have become.

    ``now``: the craft on the date; ``late_s``: how much later each turn after the build-up comes, the first ones given.
    Raises BadInput where no such motion has the mechanism's travel."""
    part = moving_part(cover, now)
    shape, per_rate = _shape_of(cover, part), _per_rate(part)
    turns = shape.turns.copy()
    if late_s is not None:
        turns[1:-1] += late_s[: len(turns) - 2]
    if np.min(np.diff(turns)) < 3.0:
        raise _impossible("its excursions come too close to each other")
    steps = shape.steps * np.diff(turns) / np.diff(shape.turns)  # a longer swing at the same slope goes further
    goal = _sizes(wanted, cover.direction)
    slopes = np.pi / 2 * steps / np.diff(turns)  # of a half cosine, where it is steepest
    scale = goal / [shape.build_up(shape.end), np.sort(-slopes)[-2:].mean(), np.sort(slopes)[-2:].mean()]
    best: tuple = (np.inf, cover, wanted)
    for _ in range(_ROUNDS):
        motion = _motion(cover, part, per_rate, shape, turns, steps, scale)
        found = true_figures(motion, now)
        off = _sizes(found, cover.direction) / goal
        if not np.all(off > 0):
            raise _impossible("its excursions vanish")
        best = min(best, (float(np.max(np.abs(off - 1))), motion, found), key=lambda b: b[0])
        if best[0] < _CLOSE:
            break
        scale = scale / off
    if best[0] > _ENOUGH:
        raise _impossible("the search for it does not settle")
    return best[1:]


def _sizes(f: Figures, direction: str) -> np.ndarray:
    """Momentum at the end of the build-up, and how steeply it falls and rises after it."""
    peaks = (f.peak_positive_Nm, -f.peak_negative_Nm)
    return np.array([abs(f.impulse_Nms), *(peaks if direction == "deploy" else peaks[::-1])])


def true_figures(cover: CoverMotion, now) -> Figures:
    """Figures of merit of the torque that a motion makes, whatever the body does: what a flight's truth shows."""
    part = moving_part(cover, now)
    time = np.arange(np.floor(cover.times[0]) - 2, cover.times[-1] + 2, 0.125)
    return figures_of(time, _reaction_about_hinge(part, time), cover.motor_on)


def _reaction_about_hinge(part: MovingPart, time) -> np.ndarray:
    """Torque on the body about the hinge axis, (N,), by the chain rule on the part's angle. [N m]"""
    j = np.clip(np.searchsorted(part.times, time, side="right") - 1, 0, len(part.times) - 2)
    x = np.clip(time, part.times[0], part.times[-1]) - part.times[j]
    a, b, c, d, e = part.quartics[:, j]
    angle = (((a * x + b) * x + c) * x + d) * x + e
    rate, acceleration = ((4 * a * x + 3 * b) * x + 2 * c) * x + d, (12 * a * x + 6 * b) * x + 2 * c
    moving = (time >= part.times[0]) & (time <= part.times[-1])
    g = _per_rate(part)
    return -np.where(moving, g(angle, 1) * rate**2 + g(angle) * acceleration, 0.0)


def _per_rate(part: MovingPart) -> scipy.interpolate.CubicSpline:
    """Momentum about the hinge per rate, over the angle from stowed."""
    angles = np.linspace(-0.01, part.travel + 0.01, 241)
    return scipy.interpolate.CubicSpline(angles, momentum_per_rate(part, angles) @ part.hinge_axis)


def _motion(cover, part, per_rate, shape: _Shape, turns, steps, scale) -> CoverMotion:
    """The scaled momentum, half cosines between its turns, as a table of rates that makes the whole travel."""
    swept = per_rate.antiderivative()
    area = float(swept(part.travel) - swept(0.0))
    swings, down = np.diff(turns)[:-1], steps[:-1] < 0
    build_up, falls, rises = scale
    slope = np.where(down, falls, rises) * steps[:-1] / swings
    last_slope = falls * steps[-1] / (turns[-1] - turns[-2])
    held_at_end = build_up * float(shape.build_up(shape.end))
    fall_s, rise_s = swings[down].sum(), swings[~down].sum()

    def momentum(longer: float):
        """Times and sizes at the turns, the falls longer by that share, the rises shorter by as many seconds."""
        lasts = swings * np.where(down, 1 + longer, 1 - longer * fall_s / rise_s)
        at = shape.end + np.concatenate([[0], np.cumsum(lasts)])
        size = held_at_end + np.concatenate([[0], np.cumsum(slope * lasts)])
        return np.append(at, at[-1] - size[-1] / last_slope), np.append(size, 0.0)

    built = build_up * float(shape.build_up.integrate(shape.start, shape.end))

    def over(longer: float) -> float:
        at, size = momentum(longer)
        return built + float(np.sum(np.diff(at) * 0.5 * (size[1:] + size[:-1]))) - area  # half cosines halve it too

    most = 0.8 * min(1.0, rise_s / fall_s)
    if not over(most) < 0 < over(-most):
        raise _impossible("no length of its excursions gives the travel")
    at, size = momentum(scipy.optimize.brentq(over, -most, most, xtol=1e-12))
    if size[:-1].min() < 0.02 * size.max():
        raise _impossible("it would come to rest on its way")
    stall = round(float(at[-2] + shape.stall * (at[-1] - at[-2])), 3)
    if at[-1] > cover.motor_off:
        raise _impossible("it is not over when the motor is switched off")

    first, late = _every(0.05, shape.start, shape.end), _every(0.05, at[0], at[-1])[1:]
    j = np.clip(np.searchsorted(at, late) - 1, 0, len(at) - 2)
    x = (late - at[j]) / (at[j + 1] - at[j])
    time = np.concatenate([first, late])
    swinging = size[j] + (size[j + 1] - size[j]) * 0.5 * (1 - np.cos(np.pi * x))
    held = np.concatenate([build_up * shape.build_up(first), swinging])
    turned = scipy.integrate.cumulative_simpson(held, x=time, initial=0.0)
    turned *= area / turned[-1]
    angles = np.linspace(0, part.travel, 4001)
    angle = np.interp(turned if cover.direction == "deploy" else area - turned, swept(angles) - swept(0.0), angles)
    # turns of the momentum stay entries of the table
    entries = np.concatenate([_every(_STEP_S, a, b) for a, b in pairwise([shape.start, *at])])
    entries = np.unique(_GRID_S * np.round(entries / _GRID_S))
    rates = np.interp(entries, time, held / np.abs(per_rate(angle)))
    rates[[0, -1]] = 0.0
    return cover.model_copy(
        update={"times": tuple(entries.tolist()), "rates": tuple(rates.round(9).tolist()), "stall": stall}
    )


def _every(step: float, start: float, stop: float) -> np.ndarray:
    return np.linspace(start, stop, 1 + max(2, round((stop - start) / step)))


def _impossible(why: str) -> BadInput:
    return BadInput(
        f"no motion has these figures of merit: {why}",
        remedy="Take smaller changes, factors or scatter, or other figures under [motions].",
    )
