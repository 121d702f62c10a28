"""The entry of one actuation: figures of merit, curves, doubts and provenance."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

from ..kit.doubts import Doubts

#: Kinds of actuation.
MOVES = ("deploy", "stow")
#: Entries of other kinds, for which rests and cycles do not count.
RECORDS = ("wheels", "inertia", "thrust", "gates", "sources")
#: Basis by which a figure is judged: the fused torque, or telemetry where the figure is not of the torque.
BEST = ("fused", "telemetry")


@dataclass(frozen=True)
class Value:
    """One figure of merit, in SI; ``None`` where it is not known.

    ``basis``: what it was computed from: 'fused', 'momentum, printed', 'transfer, printed' or 'telemetry'."""

    figure: str
    basis: str
    value: float | None
    sigma: float | None
    unit: str


@dataclass(frozen=True)
class Curve:
    """A history to overlay: ``time_s`` counts from the motor's start; ``sigma`` None where there is none.

    ``name``: 'torque_y, fused', 'motor_current', 'cover_angle', ...; all arrays (N,), NaN where unknown."""

    name: str
    unit: str
    time_s: np.ndarray
    values: np.ndarray
    sigma: np.ndarray | None = None


@dataclass(frozen=True)
class Entry:
    """One actuation, analysed once; analysed again, it is a further revision.

    ``date``: UTC of the start, as ISO 8601 to the second; ``revision`` and ``added`` (UTC) are the store's."""

    craft: str
    event: str
    kind: str
    date: str
    motor: str | None = None
    note: str = ""
    values: tuple[Value, ...] = ()
    curves: tuple[Curve, ...] = ()
    doubts: Doubts = Doubts()
    provenance: dict = field(default_factory=dict)
    revision: int | None = None
    added: str | None = None

    def __post_init__(self):
        if not isinstance(self.doubts, Doubts):  # sentences, as an earlier version took them
            object.__setattr__(self, "doubts", Doubts(self.doubts))

    @property
    def day(self) -> float:
        """Days since 2000-01-01 UTC, to compare dates."""
        moment = datetime.fromisoformat(self.date).replace(tzinfo=UTC)
        return (moment - datetime(2000, 1, 1, tzinfo=UTC)).total_seconds() / 86400

    def value(self, figure: str, basis: str) -> Value | None:
        """The figure of that name and basis; None where it was not computed."""
        return next((v for v in self.values if (v.figure, v.basis) == (figure, basis)), None)

    def best(self, figure: str) -> Value | None:
        """The figure on the basis by which it is judged."""
        return next((v for b in BEST if (v := self.value(figure, b)) is not None), None)

    @property
    def known(self) -> int:
        """How many of its figures have a value, on any basis."""
        return sum(v.value is not None for v in self.values)

    def curve(self, name: str) -> Curve | None:
        return next((c for c in self.curves if c.name == name), None)
