"""Measurements of thrust: chains of samples whose steps are impulses, with their errors.

A chain is momentum (three components) or velocity along an accelerometer (one).  From sample to sample it gains what the
thrusters gave.  Each sample has noise, which its two neighbouring steps share with opposite signs.  Errors of the pulses'
size add up from step to step.  A firing whose time is not known counts in one step or the next, which does not add up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...dynamics.pulses import Valve, expected_effective
from ...kit.banded import Covariance
from ...kit.scatter import robust_sigma

if TYPE_CHECKING:
    from .counters import Known
    from .firings import Firings
    from .priors import Priors

#: Quiet steps from which the samples' noise is taken; with fewer it is what the fit leaves.
_QUIET = 12
#: Steps count as no more than so many times the usual one; the noise is at least this share of all that is gained.
_FAR, _LEAST = 4.0, 1e-4
#: Variance added to a step that does not count: beyond that of any step that does, in (N m s)^2 or (m/s)^2.
_NOT_USED = 1e12


class Source(StrEnum):
    """What a parameter of a thrust's model stands for."""

    THRUST = "thrust"
    MEAN_THRUST = "mean thrust"
    FALL_TIME = "fall time"
    CENTER = "centre of mass"
    SPIN_INERTIA = "spin inertia"
    INERTIA = "inertia"
    RATE_OFFSET = "rate offset"
    ACCELEROMETER_BIAS = "accelerometer bias"
    MASS = "mass"
    UNCOUNTED = "pulses not counted"
    LONG_PULSES = "pulses of minutes"
    LASTING = "pulses that last"


class Parameter(NamedTuple):
    """One parameter; records that share it name it alike.  ``which``: the thruster, wheel, axis or record, '' for the only one."""

    source: Source
    which: str = ""


@dataclass(frozen=True)
class Nuisance:
    """A parameter that shifts a chain's steps in proportion to its column; its prior is zero with ``sigma``.

    ``considered``: its uncertainty is counted, but it is not estimated.  This is so for spin inertia and inertia: their columns
    are measured and share the noise of the steps, which would bias their estimates."""

    parameter: Parameter
    column: np.ndarray  # (K, d)
    sigma: float
    considered: bool = False


@dataclass(frozen=True)
class Chain:
    """K steps of d components; j thrusters."""

    what: str
    steps: np.ndarray  # (K, d)
    turn: np.ndarray | None  # (K, 3, 3): from body axes, halfway through each step; None: velocity
    along: np.ndarray  # (j, 3): unit force, body axes
    places: np.ndarray  # (j, 3), or for a velocity (j,): what a newton second of each adds
    known: Known  # at the samples, (K + 1, j) each
    used: np.ndarray  # (K,) bool
    step_s: float
    record: int  # its pulses are those of all chains of that record
    long_of: np.ndarray  # (L,): thrusters of pulses followed one by one
    weak: np.ndarray  # (j,): share by which the impulse given may lie below the mean of its pulses
    sample_sigma: np.ndarray | None = None  # (K + 1,): noise of each sample where it is known
    nuisances: tuple[Nuisance, ...] = field(default=())

    @property
    def width(self) -> int:
        return self.steps.shape[1]

    @property
    def on_time_s(self) -> np.ndarray:
        """In every step, (K, j)."""
        return np.maximum(np.diff(self.known.on_time_s, axis=0), 0.0)

    @property
    def pulses(self) -> np.ndarray:
        return np.maximum(np.diff(self.known.pulses, axis=0), 0.0)

    @property
    def long(self) -> dict[Parameter, tuple[int, np.ndarray]]:
        """Pulses of many steps, each with a thrust of its own: thruster, and on-time in every step (K,)."""
        steps = np.diff(self.known.long, axis=0)
        return {
            Parameter(Source.LONG_PULSES, f"{k} of record {self.record}"): (int(j), steps[:, k])
            for k, j in enumerate(self.long_of)
        }

    @property
    def spread(self) -> np.ndarray:
        """What one sigma of the pulses' mean length adds to their number, (K, j)."""
        return np.diff(self.known.spread, axis=0)

    def arms(self, center) -> np.ndarray:
        """What a newton second of each thruster adds to a step, (K, d, j)."""
        if self.turn is None:
            return np.broadcast_to(self.places, (len(self.steps), 1, len(self.places)))
        return self.turn @ np.cross(self.places - center, self.along).T

    def arms_by_center(self) -> np.ndarray:
        """Their change with the centre of mass, (3, K, d, j)."""
        if self.turn is None:
            return np.zeros((3, len(self.steps), 1, len(self.places)))
        return np.stack([self.turn @ np.cross(-unit, self.along).T for unit in np.eye(3)])

    def effective(self, valve: Valve, more=0.0) -> np.ndarray:
        """Impulse per newton, (K, j), with ``more`` (K, j) pulses in each step. [s]"""
        whole = expected_effective(self.on_time_s, np.maximum(self.pulses + more, 0.0), self.step_s, valve)
        return whole - np.diff(to_come(self.known.duty, self.known.rate, valve)[0], axis=0)

    def noise(self, left) -> np.ndarray:
        """Variance of the samples' noise, (K + 1, d): as known, else from steps without firing, else from a fit's residuals ``left``
        (K, d)."""
        if self.sample_sigma is not None:
            return np.square(self.sample_sigma)[:, None]
        return np.broadcast_to(self._noise(left), (len(self.steps) + 1, self.width))

    def _noise(self, left) -> np.ndarray:
        quiet = self.used & (self.on_time_s.sum(axis=1) == 0)
        quiet[1:] &= quiet[:-1]
        steps = self.steps[quiet] if quiet.sum() >= _QUIET else left[self.used]
        typical = robust_sigma(steps, axis=0)
        typical = np.where(typical > 0, typical, np.abs(steps).mean(axis=0))  # whole counts, most of them the same
        kept = np.minimum(np.abs(steps), _FAR * typical)
        least = _LEAST * np.abs(np.cumsum(self.steps[self.used], axis=0)).max()
        return 0.5 * np.maximum(np.mean(kept**2, axis=0), least**2)

    def together(self) -> np.ndarray:
        """Share of their time for which each two thrusters fire together, (j, j): timing errors of a pair are correlated."""
        T = self.on_time_s
        overlap = np.minimum(T[:, :, None], T[:, None, :]).sum(axis=0)
        own = np.sqrt(np.maximum(np.diag(overlap), 1e-300))
        return overlap / np.outer(own, own)

    def guessed(self) -> list[np.ndarray]:
        """Thrusters whose number of pulses is estimated, those that always fire together in one group."""
        left, groups = list(np.flatnonzero(self.known.spread[-1] > 0)), []
        alike = self.together() > 0.99
        while left:
            group = np.array([k for k in left if alike[left[0], k]])
            groups.append(group)
            left = [k for k in left if k not in group]
        return groups

    def covariance(self, thrust_N, center, valve: Valve, pulse_scatter: float, noise) -> Covariance:
        """Of the steps, for thrusts (j,); ``noise`` (K + 1, d): variance of the samples' noise."""
        push = self.arms(center) * thrust_N  # (K, d, j)
        on = self.on_time_s
        longer = np.where(on > 0, self.effective(valve) / np.where(on > 0, on, 1.0), 0.0)  # R of each step
        squares = np.maximum(np.diff(self.known.short, axis=0), 0.0) * longer**2
        walk = pulse_scatter**2 * np.einsum("kdj,kej,kj->kde", push, push, squares)
        guessed = push * valve.added() * np.sqrt(np.maximum(np.diff(self.known.chance, axis=0), 0.0))[:, None, :]
        walk += guessed @ self.together() @ np.swapaxes(guessed, 1, 2)
        push = np.concatenate([push, push[-1:]])
        known = self.known
        one = self.known.on_time_s[-1] + self.known.pulses[-1] * valve.added()
        one = one / np.maximum(self.known.pulses[-1], 1.0)  # effective time of a pulse, (j,)
        unsure = known.early * one**2 + to_come(known.duty, known.rate, valve)[1]
        sized = push * np.sqrt(unsure)[:, None, :]
        own = sized @ self.together() @ np.swapaxes(sized, 1, 2) + noise[:, :, None] * np.eye(self.width)
        main = own[1:] + own[:-1] + walk
        main[~self.used] += _NOT_USED * np.eye(self.width)
        return Covariance.of(main, -own[1:-1])


def to_come(duty, rate, valve: Valve) -> tuple[np.ndarray, np.ndarray]:
    """Mean [s] and variance [s2] of the effective time that is counted but not yet delivered, for a sample at a random time.

    While a pulse lasts that is td + tf - tr exp(-(t - td)/tr); after its end it falls with the delay and the fall time."""
    td, tr, tf = valve.delay_s, valve.rise_s, valve.fall_s
    mean = duty * (tf + td) + rate * (tf**2 + td * tf + td**2 / 2 - tr * (tr + td))
    square = duty * (tf + td) ** 2 + rate * (tf**3 / 2 + td * tf**2 - 2 * (tf + td) * tr**2 + tr**3 / 2)
    mean = np.maximum(mean, 0.0)
    return mean, np.maximum(square - mean**2, 0.0)


def momentum_chain(f: Firings, priors: Priors, number: int) -> Chain:
    """Steps of the momentum, with their nuisances: spin inertia, inertia, gyro bias."""
    y, t = f.in_space, f.seconds
    halfway = f.turned[:-1] * (f.turned[:-1].inv() * f.turned[1:]) ** 0.5
    nuisances = [
        Nuisance(
            Parameter(Source.SPIN_INERTIA, w.name),
            -np.diff(f.turned.apply(h), axis=0),
            priors.spin_share,
            considered=True,
        )
        for w, h in zip(f.subject.craft.wheels, np.swapaxes(f.each, 0, 1), strict=False)
    ]
    of_body = -np.diff(f.turned.apply(f.body), axis=0)
    nuisances.append(Nuisance(Parameter(Source.INERTIA), of_body, priors.inertia_share, considered=True))
    if not f.by_quaternion:
        nuisances += [
            Nuisance(Parameter(Source.RATE_OFFSET, f"{a} of record {number}"), np.diff(np.cross(np.outer(t, e), y), axis=0),
                     priors.gyro_bias_rad_s)
            for a, e in zip("xyz", np.eye(3), strict=True)
        ]  # fmt: skip
    return Chain(
        what=f"momentum of record {number}",
        steps=np.diff(y, axis=0),
        turn=halfway.as_matrix(),
        along=np.array([x.direction for x in f.thrusters], float),
        places=np.array([x.position for x in f.thrusters], float),
        known=f.known,
        used=~f.broken,
        step_s=f.step_s,
        nuisances=tuple(nuisances),
        record=number,
        long_of=f.counters.lengths.thruster,
        weak=f.counters.weak(priors.pulse_scatter),
    )
