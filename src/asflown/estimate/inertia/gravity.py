"""The orbit of a slew record: where the gravity gradient comes from, and whether it covers the record."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ..environment import gravity_words, longest_gap, orbit_in
from .surroundings import surroundings_of

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from .record import SlewRecord

#: The longest stretch without a position, as a share of an orbit (by circular motion).
_GAP = 0.1

GRAVITY = Kind(
    "inertia.gravity-gradient", Severity.NOTE,
    "the gravity gradient of {body} is in the model: it is linear in the tensor, and position and attitude give it",
)  # fmt: skip
ORBIT_TOO_SHORT = Kind(
    "inertia.orbit-too-short", Severity.CAUTION,
    "orbit_position does not cover the wheels' readings ({why}): the gravity gradient is left out, {left_out}",
    "Give positions over the whole span.",
)  # fmt: skip
NO_ATTITUDE_FOR_GRAVITY = Kind(
    "inertia.gravity-left-out", Severity.CAUTION,
    "there is an orbit but no quaternion: the gravity gradient is left out, {left_out}",
    "Add the quaternion.",
)  # fmt: skip


def with_orbit(
    record: SlewRecord, telemetry: Telemetry, start_ns: int, I_B: np.ndarray | None, craft: Craft
) -> SlewRecord:
    """The record with the orbit that the telemetry has, where it can be used, and doubts about it.

    ``start_ns``: the record's start (TAI); ``I_B`` (3, 3): the craft's own tensor, which tells the size of what is left out."""
    span = max(b for _, b in record.arcs) - min(a for a, _ in record.arcs)
    words = gravity_words(None if record.relative else I_B, span)
    orbit, body, doubts, count = orbit_in(telemetry, start_ns, words)
    if orbit is None:
        few = (
            ORBIT_TOO_SHORT(why=f"{count} positions", left_out="by an unknown amount") if count and not doubts else None
        )
        return _without(record, *doubts, few)
    doubts = Doubts([*doubts, GRAVITY(body=body)])
    left_out = words(orbit)
    if not record.has_attitude:
        return _without(record, *doubts, NO_ATTITUDE_FOR_GRAVITY(left_out=left_out))
    wheels = record.momentum.time_s
    gap = longest_gap(orbit, wheels.min(), wheels.max())
    if gap > _GAP * 2 * np.pi * np.sqrt(orbit.nearest_m**3 / orbit.mu):
        return _without(record, *doubts, ORBIT_TOO_SHORT(why=f"{gap:.0f} s without one", left_out=left_out))
    around = surroundings_of(telemetry, start_ns, orbit, craft)
    return replace(record, orbit=orbit, surroundings=around, doubts=record.doubts + doubts)


def _without(record: SlewRecord, *doubts: Doubt | None) -> SlewRecord:
    return replace(record, doubts=record.doubts + Doubts(doubts))
