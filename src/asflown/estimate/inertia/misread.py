"""How else the telemetry might be read, where momentum is not conserved as it stands: mistakes tried one by one, by what each leaves over.

A wheel's momentum is its reading times a vector, its axis times its spin inertia.  What least squares leaves over is linear in these
vectors, so that one factorization serves all hypotheses about them: senses reversed, wheels exchanged, and, where none of these
explains it, one wheel's vector free, which tells a wrong axis from a wrong spin inertia."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, pairwise, permutations
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.rigid_body import ELEMENTS
from ...kit.errors import some_of
from ...telemetry.attitude import MISTAKEN_UNITS
from .motion import Layout
from .plain import of_momentum

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .record import SlewRecord
    from .slews import Slew

#: Directions of the constants below this share of the largest do not count.
_RANK = 1e-6
#: Readings beyond so many medians of what is left over do not count: a few wild ones must not decide.
_WILD = 8.0
#: All orders of so many wheels are tried; of more, exchanges of two.
_ALL_ORDERS = 4
#: A free vector is named only where it leaves less than this share (rms) of what any simpler mistake leaves.
_SIMPLER = 0.5
#: A spin inertia beside an axis is spoken of where it differs by this share.
_SCALED = 0.05


def misread(record: SlewRecord, slews: list[Slew], limit: float) -> tuple[str, float, float]:
    """The likeliest mistake in words, what it leaves over, and what the record leaves as it is read (sums of squares).

    ``limit``: momentum of which no more is left over is conserved.  A free vector must reach it: with three numbers free much can be
    explained in part."""
    as_read = _Misfit.of(record)
    left = as_read.left(as_read.residual)
    tried = {what: _Misfit.of(other).left() for what, other in _motions(record)}
    wheels = _Wheels.of(record, as_read)
    if wheels is not None:
        tried |= dict(wheels.vectors_known(slews))
        least = min(_SIMPLER**2 * min(tried.values()), limit)
        tried |= {what: x for what, x in wheels.vector_free() if x < least}
    best = min(tried, key=lambda w: tried[w])
    return best, tried[best], left


def _motions(record: SlewRecord) -> Iterator[tuple[str, SlewRecord]]:
    """The same wheels with another motion."""
    if record.has_attitude:
        turned = record.attitude.q_NB * np.array([1.0, -1.0, -1.0, -1.0])
        yield "the quaternion were its conjugate", replace(record, attitude=replace(record.attitude, q_NB=turned))
        return
    for factor, unit in MISTAKEN_UNITS.items():
        rates = replace(record.rates, value_rad_s=record.rates.value_rad_s / factor)
        yield f"the body rates were {unit}", replace(record, rates=rates)


@dataclass(frozen=True)
class _Misfit:
    """What constants cannot explain: their orthonormal directions (M, p), the readings (M,) and what is left of them, and the weight
    of each reading in the tensor's trace (M,)."""

    directions: np.ndarray
    value: np.ndarray
    residual: np.ndarray
    trace: np.ndarray

    @classmethod
    def of(cls, record: SlewRecord) -> _Misfit:
        columns, value = of_momentum(record)
        size = np.sqrt(np.sum(columns**2, axis=0))
        size[size == 0] = 1.0
        u, s, v = np.linalg.svd(columns / size, full_matrices=False)
        told = s > _RANK * s[0]
        directions = u[:, told]
        moments = Layout.TENSOR.start + np.flatnonzero([e[1] == e[2] for e in ELEMENTS])
        trace = directions @ ((v[told] / s[told, None] / size)[:, moments].sum(axis=1))
        return cls(directions, value, value - directions @ (directions.T @ value), trace)

    def without(self, columns: np.ndarray) -> np.ndarray:
        """What the constants leave of other columns (M, k)."""
        return columns - self.directions @ (self.directions.T @ columns)

    def left(self, residual: np.ndarray | None = None) -> float:
        """Sum of squares; wild readings do not count."""
        size = np.abs(self.residual if residual is None else residual)
        return float(np.sum(size[size <= _WILD * np.median(size) + 1e-300] ** 2))


@dataclass(frozen=True)
class _Wheels:
    """The wheels' vectors (n, 3), and what a change of each of their components does to the readings (M, n, 3)."""

    record: SlewRecord
    misfit: _Misfit
    columns: np.ndarray

    @classmethod
    def of(cls, record: SlewRecord, misfit: _Misfit) -> _Wheels | None:
        """None where the wheels are not known one by one at all times."""
        columns = per_vector(record)
        return None if columns is None else cls(record, misfit, columns)

    @property
    def _vectors(self) -> np.ndarray:
        return self.record.axes

    def vectors_known(self, slews: list[Slew]) -> Iterator[tuple[str, float]]:
        """Senses and orders, and what each leaves over: in all of the record, or, of one or two wheels, after one of its slews."""
        for after in [None, *[0.5 * (a.stop_s + b.start_s) for a, b in pairwise(slews)]]:
            when = "" if after is None else f" from {after:.0f} s of the record on"
            late = np.ones(len(self.columns)) if after is None else self.record.momentum.time_s > after
            M, n = self.columns.shape[:2]
            columns = (self.columns * late[:, None, None]).reshape(M, 3 * n)
            left, trace = self.misfit.without(columns), self.misfit.trace @ columns
            for what, vectors in (*self._senses(several=after is None), *self._orders(several=after is None)):
                change = (vectors - self._vectors).ravel()
                if self.misfit.trace @ self.misfit.value + trace @ change > 0:  # else it is no body's
                    yield what + when, self.misfit.left(self.misfit.residual + left @ change)

    def _senses(self, *, several: bool) -> Iterator[tuple[str, np.ndarray]]:
        names = self.record.wheels
        for count in range(1, len(names) if several else 2):
            for which in combinations(range(len(names)), count):
                flipped = self._vectors.copy()
                flipped[list(which)] *= -1
                yield (
                    f"{'wheel' if count == 1 else 'wheels'} {some_of([names[k] for k in which])} turned the other way",
                    flipped,
                )

    def _orders(self, *, several: bool) -> Iterator[tuple[str, np.ndarray]]:
        names, n = self.record.wheels, len(self.record.wheels)
        for i, j in combinations(range(n), 2):
            swapped = self._vectors.copy()
            swapped[[i, j]] = swapped[[j, i]]
            yield f"wheels {names[i]} and {names[j]} were mistaken for each other", swapped
        if several and n <= _ALL_ORDERS:
            for order in permutations(range(n)):
                if sum(k != j for k, j in enumerate(order)) > 2:
                    words = ", ".join(names[k] for k in order)
                    yield f"the readings of {', '.join(names)} were those of {words}", self._vectors[list(order)]

    def vector_free(self) -> Iterator[tuple[str, float]]:
        """One wheel's vector as it explains most, in words, and what it leaves over."""
        for k, name in enumerate(self.record.wheels):
            columns, residual = self.misfit.without(self.columns[:, k]), self.misfit.residual
            change = -np.linalg.lstsq(columns, residual, rcond=_RANK)[0]
            yield (
                in_words(name, self._vectors[k], self._vectors[k] + change),
                self.misfit.left(residual + columns @ change),
            )


def per_vector(record: SlewRecord) -> np.ndarray | None:
    """Momentum of each reading per unit of each wheel's vector (M, n, 3); None where the wheels are not known one by one."""
    if record.spins is None:
        return None
    at, readings = record.spins
    m = record.momentum
    rates = np.stack([np.interp(m.time_s, at, r) for r in readings.T], axis=1)
    return rates[:, :, None] * m.direction[:, None, :]


def in_words(name: str, vector: np.ndarray, found: np.ndarray) -> str:
    """What is different in a wheel's axis and spin inertia."""
    size = np.linalg.norm(found)
    times = size / np.linalg.norm(vector)
    turned = np.arccos(np.clip(found @ vector / max(size * np.linalg.norm(vector), 1e-300), -1, 1))
    if turned < abs(times - 1):
        return f"the spin inertia of wheel {name} were {times:.4g} times what the craft file says"
    axis = ", ".join(f"{x:.3f}" for x in found / max(size, 1e-300) + 0.0)
    more = f", and its spin inertia {times:.2g} times" if abs(times - 1) > _SCALED else ""
    return f"the axis of wheel {name} were turned by {np.degrees(turned):.2g} deg, to ({axis}){more}"
