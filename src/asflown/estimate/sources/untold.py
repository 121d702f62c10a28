"""What an arc cannot tell, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from .gather import Arc, Column
    from .swing import Posterior

#: Two unknowns whose correlation is this near to one are not told from each other.
_ALIKE = 0.95

_WORDS = {
    "dipole": "the dipole along {}",
    "sunlight": "sunlight's lever along {}",
    "drag": "the drag lever along {}",
    "constant": "a constant torque about {}",
    "inertia": "the gravity gradient of {}",
}


class Told(NamedTuple):
    """Where an unknown stands in the posterior, and whether the data tell it."""

    place: int
    told: bool


def untold_in(arc: Arc, found: Posterior, told: dict[int, Told], fitted: tuple[str, ...]) -> tuple[str, ...]:
    """Sentences: unknowns that show too little, pairs that look alike, and what the inertia's error adds."""
    C = found.spread
    C = C / np.sqrt(np.outer(np.diag(C), np.diag(C)))
    looked_for = [c for c in told if arc.columns[c].source in fitted]
    sentences: list[str] = []
    spoken: set[int] = set()
    for n, a in enumerate(looked_for):
        for b in looked_for[n + 1 :]:
            r = float(C[told[a].place, told[b].place])
            if abs(r) > _ALIKE:
                sentences.append(
                    f"This arc cannot tell {words(arc.columns[a])} from {words(arc.columns[b])}: correlation {r:+.3f}."
                )
                spoken |= {a, b}
    sentences += [
        f"This arc cannot tell {words(arc.columns[c])}: {_why(arc, told, c, C, looked_for)}."
        for c in looked_for
        if not told[c].told and c not in spoken
    ]
    open_ = [arc.columns[c].name for c in told if arc.columns[c].source == "inertia" and not told[c].told]
    if open_:
        sentences.append(
            f"This arc tells no more of the inertia ({', '.join(open_)}) than the craft file: its gravity gradient is taken with the file's sigma."
        )
    return tuple(sentences)


def words(column: Column) -> str:
    return _WORDS[column.source].format(column.name)


def _why(arc: Arc, told: dict[int, Told], c: int, C: np.ndarray, looked_for: list[int]) -> str:
    others = [o for o in looked_for if o != c]
    if others:
        nearest = max(others, key=lambda o: abs(C[told[c].place, told[o].place]))
        r = float(C[told[c].place, told[nearest].place])
        if abs(r) > 0.7:
            return f"{words(arc.columns[nearest])} does nearly the same (correlation {r:+.2f})"
    column = arc.torque[:, :, c]
    swings = np.sqrt(np.mean(np.sum(column**2, axis=1)))
    most = arc.size_Nm * 3
    return (
        "it exerts next to no torque here"
        if swings < 0.1 * most
        else "it changes too little over the arc beside what else is open"
    )
