"""Which branch of thrusters is in use, by telemetry and by the craft file; thrusters of two branches sit in one place.

Their torques are the same, so momentum cannot distinguish them: only their counters, their thrust, and this channel can.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import some_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Thruster
    from ...telemetry.telemetry import Telemetry

CHANNEL = "thruster_branch"


def branches_in_use(telemetry: Telemetry) -> list[str]:
    """In order of their first reading; none where the channel is not there."""
    if CHANNEL not in telemetry:
        return []
    return list(dict.fromkeys(str(v) for v in telemetry.channel(CHANNEL).usable.values))


def branch_change(telemetry: Telemetry) -> str | None:
    """When the branch first changes, as text; None where it does not."""
    if len(branches_in_use(telemetry)) < 2:
        return None
    c = telemetry.channel(CHANNEL).usable
    k = int(np.flatnonzero(c.values[1:] != c.values[:-1])[0])
    return f"from {c.values[k]} to {c.values[k + 1]} by {telemetry.describe_time(int(c.tai_ns[k + 1]))}"


def undescribed(telemetry: Telemetry, thrusters: Sequence[Thruster]) -> str | None:
    """The branch in use and the one described, as text, where the craft file describes another than is in use."""
    described = sorted({t.branch for t in thrusters if t.branch})
    other = [b for b in branches_in_use(telemetry) if b not in described]
    if not described or not other:
        return None
    return f"branch {some_of(other)} is in use and the craft file describes branch {some_of(described)}"


def other_branch(name: str, thrusters: Sequence[Thruster]) -> str | None:
    """The thruster that momentum cannot distinguish from this one: another of the craft file in its place, else that of the
    other branch.  None where neither is known."""
    own = next(t for t in thrusters if t.name == name)
    same_place = [t for t in thrusters if t.name != name and (t.position, t.direction) == (own.position, own.direction)]
    if same_place:
        return some_of([f"{t.name} of branch {t.branch}" if t.branch else t.name for t in same_place])
    if not own.branch:
        return None
    other = {"A": "B", "B": "A"}.get(own.branch)
    return f"{name} of branch {other}" if other else f"{name} of a branch other than {own.branch}"
