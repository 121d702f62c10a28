"""Wheels against the body: another reading of the wheels under which the control law or the momentum would hold far better.

    law        D (KD F(w) + KP KD a) - g w x (J w)  =  sum of h_k' + g w x h_k     (the controller asks, the wheels give)
    loop       as the law, with two gains of each axis fitted, neither negative     (of a controller that is not described)
    momentum   -(I w' + w x I w)                    =  sum of (h_k' + w x h_k)     (of a body that slews or turns)

a is the angle the body has turned by, the attitude error's negative.  The law holds whatever torque acts on the body; the
momentum balance holds where what body and wheels exchange is large beside outside torques.  A reading changes the sense or the
spin inertia of a wheel or of all, exchanges two wheels, or shifts the wheels in time.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ...kit.regression import memory
from ...telemetry.channels import AXES
from .loop import fitted_gains
from .motion import GYRO, NAMES
from .rates import BETTER, LATE_S, LATE_STEPS, LATEST_S, SIGNIFICANT

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ..subject import Subject
    from .motion import Motion

#: Share of what is to be explained that a reading leaves at most: of what the law asks, of the wheels' torque in a fitted loop, and
#: of what each wheel gives by itself in the momentum balance.
_LAW_LEAVES, _LOOP_LEAVES, _MOMENTUM_LEAVES = 0.25, 0.15, 0.05
#: Or, of readings that change no size: where the file's own explains less than this leaves, the other leaves that much.
_NOTHING, _MUCH_LESS = 0.8, 0.7
#: What the wheels' own reading leaves where a fitted loop explains little of it.
_LITTLE = 0.5
#: But noise that the controller answers looks like a delay as long as the smoothing.
_LIKE_NOISE_S = 9.0
#: What the momentum balance's own reading leaves is this many times more: outside torques are no noise, of which odds could be told.
_PLAINLY = 4.0
#: Share that a balance leaves where it stands, and where it stands firmly.
STANDS, FIRMLY = 0.3, 0.1
#: Share of the wheels' torque from which on the body's motion tells of it.
_MOVES = 0.3
#: A spin inertia, or that of all wheels, is off by more than this factor.
_OFF = 1.25


@dataclass(frozen=True)
class Reading:
    """What the wheels would be, what it leaves of the squares (3,), and the residual (N, 3).

    ``family``: of readings that change one thing; ``factor``: by what their momentum would be multiplied, 1 where its size stays; ``late_s``: by how
    much they are stamped late; ``share``: of what is to be explained, left."""

    family: str
    what: str
    residual: np.ndarray
    factor: float = 1.0
    late_s: float = 0.0
    share: float = np.inf

    @property
    def left(self) -> float:
        return float(np.sum(self.residual**2))


@dataclass(frozen=True)
class Balance:
    """``asked`` (N, 3) that the wheels' parts (N, n, 3) should add up to, both per moment of inertia [rad/s^2].

    ``turned``: of the parts, the wheels' turn with the body; ``by``: law, loop or momentum; ``fitted``: takes a total (N, 3) to
    what is left of it; None: less what is asked."""

    by: str
    asked: np.ndarray
    parts: np.ndarray
    wheels: tuple[str, ...]
    step_s: float
    cadence_s: float
    source: str
    turned: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    fitted: Callable[[np.ndarray], np.ndarray] | None = None

    @property
    def moves(self) -> bool:
        """Whether the body's own motion, or its turn with what the wheels hold, is large beside what the wheels take up."""
        return bool(np.sum(self.asked**2) + np.sum(self.turned**2) > _MOVES * np.sum(self.parts**2))

    @property
    def exchanges(self) -> bool:
        """Whether the body takes up what the wheels lose."""
        asked = float(np.sum(self.asked**2))
        return asked > _MOVES * float(np.sum(self.parts.sum(axis=1) ** 2)) and self.own.left < STANDS * asked

    def left_of(self, total: np.ndarray) -> np.ndarray:
        return self.asked - total if self.fitted is None else self.fitted(total)

    @cached_property
    def own(self) -> Reading:
        """The wheels as they are read."""
        return self._shared(Reading("own", "", self.left_of(self.parts.sum(axis=1))), self.parts.sum(axis=1))

    def _shared(self, r: Reading, total: np.ndarray) -> Reading:
        """The reading with the share that it leaves."""
        if self.by == "loop":
            size = np.sum(total**2)
        elif self.by == "momentum" and abs(r.factor) == 1.0:
            size = max(np.sum(self.parts**2), np.sum(self.asked**2))
        else:
            size = np.sum(self.asked**2)
        return replace(r, share=r.left / float(size) if size > 0 else np.inf)

    def better(self) -> Reading | None:
        """The reading that fits far better than the file's own; None where there is none."""
        own, whole = self.own, self.parts.sum(axis=1)
        before = self._score(own, whole)
        tried = [(self._score(r, total), self._shared(r, total)) for r, total in self._readings()]
        tried = [(score, r) for score, r in tried if self._serves(r, own)]
        if not tried or before == 0:
            return None
        least = min(score for score, _ in tried)
        family = next(
            r.family for score, r in tried if score <= BETTER * least
        )  # the simplest of those that serve alike
        score, r = min((t for t in tried if t[1].family == family), key=lambda t: t[0])
        if self.by == "loop" and own.share < _LITTLE:
            return None  # what the wheels answer beside a loop, as of a craft that turns, fits other senses a little better
        if self.by == "momentum" and abs(r.factor) == 1.0:
            return r if before > _PLAINLY * score else None
        worth = sum(len(c) / memory(c) for c in r.residual.T)
        plain = before > BETTER * score and 0.5 * worth * np.log(before / max(score, 1e-300)) > SIGNIFICANT
        return r if plain else None

    def _serves(self, r: Reading, own: Reading) -> bool:
        """Whether a reading explains enough to be believed."""
        limit = {"law": _LAW_LEAVES, "loop": _LOOP_LEAVES, "momentum": _MOMENTUM_LEAVES}[self.by]
        if self.by == "law" and abs(r.factor) == 1.0 and own.share > _NOTHING and not 0 < abs(r.late_s) < _LIKE_NOISE_S:
            limit = _MUCH_LESS
        return r.share < limit

    @cached_property
    def told(self) -> float:
        """Share that the best of all readings leaves, the file's own among them: how well the balance can be told."""
        return min(self.own.share, *(self._shared(r, total).share for r, total in self._readings()))

    def _score(self, r: Reading, total: np.ndarray) -> float:
        """What readings are compared by: squares left, in a fitted loop as a share of the wheels' own."""
        return r.left / float(max(np.sum(total**2), 1e-300)) if self.by == "loop" else r.left

    def _readings(self) -> Iterator[tuple[Reading, np.ndarray]]:
        yield from self._other_senses()
        if self.by != "loop":
            yield from self._exchanged()
        if self.by == "law":
            yield from self._other_axes()
        if self.by != "loop":
            yield from self._shifted()
            yield from self._other_sizes()

    def _other_senses(self):
        whole = self.parts.sum(axis=1)
        for k, name in enumerate(self.wheels):
            total = whole - 2 * self.parts[:, k]
            yield Reading("sense", f"wheel {name} turned the other way", self.left_of(total), -1.0), total
        yield Reading("sense", "all wheels turned the other way", self.left_of(-whole), -1.0), -whole

    def _other_sizes(self):
        whole = self.parts.sum(axis=1)
        choices = [("all wheels", whole)] + [(f"wheel {n}", self.parts[:, k]) for k, n in enumerate(self.wheels)]
        for what, part in choices:
            rest = self.asked - (whole - part)
            factor = float(np.sum(part * rest) / max(np.sum(part * part), 1e-300))
            if abs(np.log(max(abs(factor), 1e-12))) > np.log(_OFF):
                total = whole + (factor - 1) * part
                yield (
                    Reading(
                        what.split()[0], f"{what} held {factor:.4g} times the momentum", self.asked - total, factor
                    ),
                    total,
                )

    def _exchanged(self):
        """Two wheels mistaken for each other: each one's size along the other's axis."""
        for i, k in combinations(range(len(self.wheels)), 2):
            ai, ak = (_axis(self.parts[:, m]) for m in (i, k))
            if ai is None or ak is None:
                continue
            change = np.outer(self.parts[:, i] @ ai, ak - ai) + np.outer(self.parts[:, k] @ ak, ai - ak)
            total = self.parts.sum(axis=1) + change
            what = f"wheels {self.wheels[i]} and {self.wheels[k]} were mistaken for each other"
            yield Reading("exchange", what, self.left_of(total)), total

    def _other_axes(self):
        """The source with two axes exchanged, or one of them reversed."""
        whole = self.parts.sum(axis=1)
        for j in range(3):
            reversed_axis = self.asked * np.where(np.arange(3) == j, -1.0, 1.0)
            yield Reading("axes", f"{NAMES[self.source]} {AXES[j]} had the other sign", reversed_axis - whole), whole
        for i, j in combinations(range(3), 2):
            order = [0, 1, 2]
            order[i], order[j] = j, i
            yield (
                Reading(
                    "axes", f"{NAMES[self.source]} {AXES[i]} and {AXES[j]} were exchanged", self.asked[:, order] - whole
                ),
                whole,
            )

    def _shifted(self):
        whole, n = self.parts.sum(axis=1), len(self.parts)
        for k in range(-round(LATEST_S / self.step_s), round(LATEST_S / self.step_s) + 1):
            late = k * self.step_s
            if abs(late) <= max(LATE_S, LATE_STEPS * self.cadence_s) or abs(k) > n // 4:
                continue
            asked, total = self.asked[max(-k, 0) : n - max(k, 0)], whole[max(k, 0) : n + min(k, 0)]
            how = "earlier" if late > 0 else "later"
            # what the ends lack counts as left over in proportion
            residual = (asked - total) * np.sqrt(n / len(total))
            yield (
                Reading("stamps", f"the wheels' time stamps were {abs(late):.0f} s {how}", residual, late_s=late),
                total,
            )


def _axis(part: np.ndarray) -> np.ndarray | None:
    """Unit vector along which a wheel's part changes; None for one that does not, or turns with the body."""
    values, vectors = np.linalg.eigh(part.T @ part)
    if not values[-1] > 0 or values[-2] > 1e-6 * values[-1]:
        return None
    return vectors[:, -1]


def law_balance(subject: Subject, motion: Motion, source: str, slow_s: float | None = None) -> Balance | None:
    """From what a source of the body's motion makes the controller ask, or a fitted loop where the craft describes none."""
    I_B, rate = subject.inertia_kgm2, motion.rates[source]
    if I_B is None or motion.stored is None or not np.isfinite(rate[motion.blocks[0]]).all():
        return None
    scale, law, step = np.diag(I_B), subject.craft.craft.wheel_controller, motion.grid.step_s
    if law is None:
        return _loop(motion, source, motion.quick(motion.gained(), slow_s) / scale, slow_s)
    from ...dynamics.loop import filtered_rate  # brings in scipy.signal, for which crafts without a law need not wait

    J = law.believed_kgm2(I_B)
    asked, parts = np.full_like(rate, np.nan), motion.gained()
    for b in motion.blocks:
        for j in range(3):
            filtered = filtered_rate(law, rate[b, j], step)
            asked[b, j] = J[j, j] * law.kd_per_s * (filtered + law.kp_per_s * motion.angles[source][b, j])
    if law.gyroscopic and GYRO in motion.rates and np.isfinite(motion.rates[GYRO][motion.blocks[0]]).all():
        w = motion.rates[GYRO]
        asked = asked - np.cross(w, w @ J)
        parts = parts + np.cross(w[:, None, :], motion.stored)
    asked, parts = motion.quick(asked, slow_s) / scale, motion.quick(parts, slow_s) / scale
    return Balance("law", asked, parts, motion.wheels, step, motion.cadence_s, source)


def _loop(motion: Motion, source: str, parts: np.ndarray, slow_s: float | None) -> Balance:
    rate, angle = motion.quick(motion.rates[source], slow_s), motion.quick(motion.angles[source], slow_s)

    def left(total: np.ndarray) -> np.ndarray:
        residual = np.empty_like(total)
        for j in range(3):
            (D, K), _ = fitted_gains(rate[:, j], angle[:, j], total[:, j])
            residual[:, j] = total[:, j] - (D * rate[:, j] + K * angle[:, j])
        return residual

    return Balance("loop", rate, parts, motion.wheels, motion.grid.step_s, motion.cadence_s, source, fitted=left)


def momentum_balance(subject: Subject, motion: Motion, source: str) -> Balance | None:
    """Of a body whose motion a source tells."""
    I_B, w = subject.inertia_kgm2, motion.rates[source]
    keep = np.concatenate([np.arange(b.start, b.stop) for b in motion.blocks])
    if I_B is None or motion.stored is None or not np.isfinite(w[keep]).all():
        return None
    turn = np.full_like(w, np.nan)
    for b in motion.blocks:
        turn[b] = np.gradient(w[b], motion.grid.step_s, axis=0)
    asked = -(turn @ I_B + np.cross(w, w @ I_B))[keep]
    turned = np.cross(w[:, None, :], motion.stored)
    parts = (motion.gained() + turned)[keep]
    scale = np.diag(I_B)
    step, cadence = motion.grid.step_s, motion.cadence_s
    return Balance("momentum", asked / scale, parts / scale, motion.wheels, step, cadence, source, turned[keep] / scale)
