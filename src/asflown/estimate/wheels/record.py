"""One record's wheels: their rates, what the craft file says of them, and the torque commanded of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput, some_of
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from .named import check_named, named_run_downs, spans_of
from .run_downs import FEWEST, Finder, own_noise

if TYPE_CHECKING:
    from collections.abc import Collection

    from ...craft.model import Craft, CraftAt, Wheel
    from ...telemetry.telemetry import Telemetry
    from .named import NamedRunDown

#: Condition number of three wheels' axes beyond which their shares of a torque are not told.
_ALIGNED = 1e3
#: Body rates are put to a wheel's where they change by so many times their noise, and reach its ends to so many seconds.
_MOVES, _ENDS_S = 2.0, 10.0


@dataclass(frozen=True)
class RecordedWheels:
    """``finders``: the course of each wheel that has a rate; ``run_down``: spans [s] in which a wheel's motor is off, as the user
    says; ``named``: the same as named."""

    telemetry: Telemetry
    craft: Craft
    now: CraftAt
    finders: dict[str, Finder]
    run_down: dict[str, tuple[tuple[float, float], ...]]
    named: tuple[NamedRunDown, ...] = ()

    def described(self, name: str) -> Wheel:
        """As it is in service then; a spare one as it was described last."""
        return self.now.wheel(name) or [w for w in self.craft.wheels if w.name == name][-1]

    @property
    def count(self) -> int:
        """Wheels in service."""
        return len(self.now.wheels)

    def motor_torque(self, name: str) -> tuple[np.ndarray, np.ndarray] | None:
        """Seconds (N,) and a motor's torque from its current (N,) [N m]; None where that is not known."""
        constant, channel = self.described(name).torque_constant, f"wheel_current_{name}"
        if constant is None or channel not in self.telemetry:
            return None
        c = self.telemetry.channel(channel).usable
        return self.telemetry.seconds(c.tai_ns), constant * c.values

    def commanded_of_wheel(self, name: str) -> tuple[np.ndarray, np.ndarray] | None:
        """Seconds (N,) and the torque commanded of this wheel's own motor (N,) [N m]; None without such a channel."""
        channel = f"wheel_torque_{name}"
        if channel not in self.telemetry:
            return None
        c = self.telemetry.channel(channel).usable
        return self.telemetry.seconds(c.tai_ns), c.values

    def commanded(self, name: str) -> tuple[np.ndarray, np.ndarray] | None:
        """Seconds (N,) and the torque commanded of a wheel's motor (N,) [N m]; None where that is not known.

        Without a channel of its own: three wheels share a torque on the body in one way only; with four it depends on
        software not described."""
        own = self.commanded_of_wheel(name)
        if own is not None:
            return own
        names = [w.name for w in self.now.wheels]
        if self._commanded is None or name not in names:
            return None
        t, torque = self._commanded
        return t, torque[:, names.index(name)]

    @cached_property
    def _commanded(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Of all three wheels in service, (N, 3)."""
        tlm, wheels = self.telemetry, self.now.wheels
        if not tlm.has_axes("control_torque") or len(wheels) != 3:
            return None
        axes = np.array([w.axis for w in wheels], float).T
        if np.linalg.cond(axes) > _ALIGNED:
            return None
        tai_ns, torque = together(tlm, [f"control_torque_{a}" for a in AXES])
        return tlm.seconds(tai_ns), -torque @ np.linalg.inv(axes).T


def record_of(telemetry: Telemetry, craft: Craft, run_down: Collection[str | NamedRunDown]) -> RecordedWheels:
    """Raises BadInput for telemetry without wheel rates, a wheel that the craft does not have, and one in ``run_down`` without
    a rate."""
    names = telemetry.members("wheel_rate")
    if not names:
        raise BadInput(
            "there are no wheel rates, without which nothing can be said of wheels",
            file=telemetry.source or None,
            channel="wheel_rate_<WHEEL>",
            remedy=f"The telemetry holds: {some_of(telemetry.channels)}.",
        )
    for name in names:
        if name not in craft.wheel_names:
            raise BadInput(
                f"{craft.name} has no wheel {name!r}",
                file=telemetry.source or None,
                channel=f"wheel_rate_{name}",
                remedy=f"Its wheels: {some_of(craft.wheel_names)}. Rename the column, or name the right --craft.",
            )
    named = named_run_downs(run_down)
    check_named(named, craft.wheel_names)
    spans = spans_of(named, telemetry)
    for name in spans:
        if name not in names:
            raise BadInput(
                f"no rate of wheel {name!r}, whose run-down this is said to be",
                file=telemetry.source or None,
                remedy=f"Wheels with a rate here: {some_of(names)}.",
            )
    channels = {n: telemetry.channel(f"wheel_rate_{n}") for n in names}
    now = craft.at(telemetry.date_ns)
    finders = {}
    for n, c in channels.items():
        seconds = telemetry.seconds(c.usable.tai_ns)
        axis = (now.wheel(n) or [w for w in craft.wheels if w.name == n][-1]).axis
        finders[n] = Finder(c, seconds, _turning_along(telemetry, axis, seconds))
    return RecordedWheels(telemetry, craft, now, finders, spans, named)


def _turning_along(telemetry: Telemetry, axis, seconds: np.ndarray) -> np.ndarray | None:
    """The body's rate along an axis at a wheel's samples (N,) [rad/s]; None where it is not known or does not matter."""
    if not telemetry.has_axes("body_rate") or len(seconds) < FEWEST:
        return None
    along = np.zeros(len(seconds))
    for a, share in zip(AXES, axis, strict=True):
        c = telemetry.channel(f"body_rate_{a}").usable
        t = telemetry.seconds(c.tai_ns)
        if not len(t) or t[0] > seconds[0] + _ENDS_S or t[-1] < seconds[-1] - _ENDS_S:
            return None
        along += share * np.interp(seconds, t, c.values)
    return along if float(np.std(along)) > _MOVES * own_noise(along, seconds) else None
