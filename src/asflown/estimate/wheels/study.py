"""Bearing drag of every wheel, from the best that a record holds, and how the wheel was used.

Best first: a run-down (the motor is off, and the wheel's own course tells); the flight software's estimate of the
drag; the torque commanded of the wheels.  With wheel rates alone and the wheels in the loop there is none: the loop
makes up for whatever the drag is, so that the rates follow the torque on the body and nothing else.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput, some_of
from ...kit.regression import robust_line
from ...telemetry import attitude
from ...telemetry.channels import AXES
from .result import COMMAND, FLIGHT_SOFTWARE, RUN_DOWN, DragFit, DragSamples, Spike, WheelDrag, WheelsResult
from .run_downs import FEWEST, STICTION_RATE, Coasting, Finder, together
from .samples import find_spikes, opposing
from .use import WheelUse, wheel_use

if TYPE_CHECKING:
    from collections.abc import Collection

    from ...craft.model import Craft, Wheel
    from ...telemetry.telemetry import Channel, Telemetry

#: 300 rpm.  Below some speed a bearing's oil film is too thin to part the balls from the race; none of the papers
#: gives it, so this is an assumption. [rad/s]
LOW_SPEED = 300 * 2 * np.pi / 60

#: Torque that turning the momentum with the body takes, as a share of a wheel's slowing: above it, it may be the cause.
_TURNING = 0.2
_AS_IT_TURNS = "as the momentum turns with the body"
#: Momentum that wheels which do not coast gain meanwhile, as a share of what this one loses: above it, a torque acts.
_SHARED = 0.5
#: Share of a slowing that the commanded torque explains: above it the motor is at work.
_COMMANDED = 0.5
#: Length over which commanded torque and momentum gained are set against each other [s], and how many it takes.
_BLOCK_S, _FEWEST_BLOCKS = 60.0, 6
#: Two ways to the same drag that differ by this many sigma are doubted.
_APART = 4.0
#: Drag below this many sigma is none.
_NONE = 3.0
#: Slow residuals this many times the noise are told.
_NOT_QUITE = 2.0


def wheel_drag(
    telemetry: Telemetry, craft: Craft, *, low_speed: float = LOW_SPEED, run_down: Collection[str] = ()
) -> WheelsResult:
    """Drag, spikes and use of each wheel that has a rate.

    ``low_speed``: below it a wheel dwells [rad/s].  ``run_down``: wheels of which the user says that the motor is off in
    all of this telemetry; otherwise run-downs are those that only a bearing explains.

    Raises BadInput for telemetry without wheel rates, a wheel that the craft does not have, or one in ``run_down``
    that does not slow down."""
    if not low_speed > 0:
        raise BadInput(f"the low speed {low_speed:g} rad/s is not positive", remedy='Give it as in "300 rpm".')
    names = _wheels(telemetry, craft)
    for name in run_down:
        if name not in names:
            raise BadInput(
                f"no rate of wheel {name!r}, whose run-down this is said to be",
                file=telemetry.source or None,
                remedy=f"Wheels with a rate here: {some_of(names)}.",
            )
    study = _Study(telemetry, craft, frozenset(run_down))
    finders = {n: study.finder(n) for n in names}
    seen = study.slowing(finders)
    coastings = {n: study.coasting(n, f, seen[n]) for n, f in finders.items()}
    for name in run_down:
        if coastings[name] is None:
            raise BadInput(
                "the wheel does not slow down in this window",
                file=telemetry.source or None,
                channel=f"wheel_rate_{name}",
                remedy=f"A run-down takes {FEWEST} samples above {STICTION_RATE * 30 / np.pi:.0f} rpm without a gap. "
                "Name its span with --start and --stop.",
            )
    study.coasts = [(r.start_s, r.stop_s) for c in coastings.values() if c for r in c.run_downs]
    wheels = tuple(study.wheel(n, finders[n], coastings[n], low_speed) for n in names)
    unknown = [w.name for w in wheels if w.fit is None]
    if unknown:
        study.doubts.append(
            f"drag is not known of wheel {some_of(unknown)}: no run-down is seen, and in the loop the motor makes up for drag, "
            "so that the rate alone does not show it. It takes a run-down, wheel_drag_torque or control_torque"
        )
    return WheelsResult(craft.name, telemetry.epoch_label, low_speed, wheels, tuple(dict.fromkeys(study.doubts)))


def _wheels(telemetry: Telemetry, craft: Craft) -> list[str]:
    names = telemetry.members("wheel_rate")
    if not names:
        raise BadInput(
            "there are no wheel rates, and nothing can be said of wheels without",
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
    return names


class _Study:
    """One record: what all wheels need to know of each other, and the doubts as they come up."""

    def __init__(self, telemetry: Telemetry, craft: Craft, named: frozenset[str]):
        self.telemetry, self.craft, self.named = telemetry, craft, named
        self.now = craft.at(telemetry.date_ns)
        self.doubts = list(telemetry.doubts)
        self.coasts: list[tuple[float, float]] = []

    def described(self, name: str) -> Wheel:
        """As it is in service then; a spare one as it was described last."""
        return self.now.wheel(name) or [w for w in self.craft.wheels if w.name == name][-1]

    def finder(self, name: str) -> Finder:
        c = self.telemetry.channel(f"wheel_rate_{name}")
        return Finder(c, self.telemetry.seconds(c.usable.tai_ns))

    # ---- run-downs ----------------------------------------------------------------------------------

    def slowing(self, finders: dict[str, Finder]) -> dict[str, list[tuple[int, int, str]]]:
        """Of each wheel the stretches in which it slows evenly, with what else may be the cause; '' for none."""
        seen = {
            n: [(a, b, self._other_cause(n, f, a, b)) for a, b in f.found()] if n not in self.named else []
            for n, f in finders.items()
        }
        return {
            n: [(a, b, cause or self._shared(n, finders, seen, a, b)) for a, b, cause in stretches]
            for n, stretches in seen.items()
        }

    def coasting(self, name: str, finder: Finder, seen: list[tuple[int, int, str]]) -> Coasting | None:
        if name in self.named:
            spans = [(s.start, s.stop) for s in finder.stretches() if finder.falls(s.start, s.stop)]
        else:
            spans = [(a, b) for a, b, cause in seen if not cause]
            for why_not in dict.fromkeys(cause for _, _, cause in seen):
                stretches = [(a, b) for a, b, cause in seen if cause == why_not]
                a, b = max(stretches, key=lambda k: k[1] - k[0])
                # so short, a wheel in the loop does it by chance; and all wheels of a turning craft do
                if b - a < 2 * FEWEST or why_not in ("", _AS_IT_TURNS):
                    continue
                more = f", and in {len(stretches) - 1} more stretches" if len(stretches) > 1 else ""
                self.doubts.append(
                    f"wheel {name} slows evenly from {finder.t[a]:.0f} to {finder.t[b - 1]:.0f} s{more}, but {why_not}: not "
                    f"taken as a run-down (--run-down {name} with --start and --stop says that the motor was off)"
                )
        if not spans:
            return None
        found = together(finder, spans, name in self.named)
        if name not in self.named:
            first, many = found.run_downs[0], "s" * (len(spans) > 1)
            self.doubts.append(
                f"wheel {name}: {len(spans)} run-down{many} ({first.start_s:.0f} to {first.stop_s:.0f} s) found by the wheel's "
                "course, which is that of a bearing alone; nothing in the file says that the motor was off"
            )
        if found.misfit > _NOT_QUITE**2:
            self.doubts.append(
                f"wheel {name} does not slow quite as Coulomb and viscous drag have it (slow residuals "
                f"{np.sqrt(found.misfit):.1f} times the noise): sigmas are widened by as much"
            )
        return found

    def _other_cause(self, name: str, finder: Finder, a: int, b: int) -> str:
        """What else may slow the wheel evenly; '' where only a bearing explains it."""
        start, stop = float(finder.t[a]), float(finder.t[b - 1])
        slowing = float(np.abs(finder.rate[a]) - np.abs(finder.rate[b - 1])) / (stop - start)
        if self._turning(name, start, stop) > _TURNING * slowing:
            return _AS_IT_TURNS
        ordered, J = self._ordered(name), self.described(name).spin_inertia
        if ordered is not None and J is not None:
            t, torque = ordered
            inside = (t >= start) & (t <= stop)
            slows = -np.sign(finder.rate[a]) * float(np.mean(torque[inside])) if inside.any() else 0.0
            if slows > _COMMANDED * J * slowing:
                return "the commanded torque does just that"
        if not finder.is_bearing(a, b):
            return "as a motor or a steady torque on the body would have it"
        return ""

    def _shared(self, name: str, finders: dict[str, Finder], seen, a: int, b: int) -> str:
        """Whether other wheels, which do not coast, change as much meanwhile, as by a torque on the body; else ''.

        Wheels that only trade momentum with this one keep the sum, and are no sign of such a torque."""
        f = finders[name]
        start, stop = float(f.t[a]), float(f.t[b - 1])
        own = self._momentum(name, f, start, stop)
        others = np.zeros(3)
        for n, g in finders.items():
            coasts = n in self.named or any(
                g.t[c] < stop and g.t[d - 1] > start and not cause for c, d, cause in seen[n]
            )
            if n != name and not coasts and len(g.t) and g.t[0] <= start and g.t[-1] >= stop:
                others += self._momentum(n, g, start, stop)
        limit = _SHARED * float(np.linalg.norm(own))
        if np.linalg.norm(others) > limit and np.linalg.norm(own + others) > limit:
            return "with other wheels, as a torque on the body would have it"
        return ""

    def _momentum(self, name: str, finder: Finder, start_s: float, stop_s: float) -> np.ndarray:
        """What a wheel gains from one time to another, body axes; per unit spin inertia where that is not known."""
        w = self.described(name)
        first, last = np.interp([start_s, stop_s], finder.t, finder.rate)
        return (w.spin_inertia or 1.0) * (last - first) * np.array(w.axis)

    def _turning(self, name: str, start_s: float, stop_s: float) -> float:
        """Size of what the wheel takes on as the momentum turns with the body, (w x h).a / J. [rad/s^2]"""
        if not self.telemetry.has_axes("body_rate"):
            return 0.0

        def middle(c: Channel) -> float:
            t = self.telemetry.seconds(c.usable.tai_ns)
            inside = c.usable.values[(t >= start_s) & (t <= stop_s)]
            return float(np.median(inside)) if len(inside) else 0.0

        omega = np.array([middle(self.telemetry.channel(f"body_rate_{a}")) for a in AXES])
        h = np.zeros(3)
        for n in self.telemetry.members("wheel_rate"):
            w = self.described(n)
            h += (w.spin_inertia or 1.0) * middle(self.telemetry.channel(f"wheel_rate_{n}")) * np.array(w.axis)
        own = self.described(name)
        return float(abs(np.cross(omega, h) @ own.axis)) / (own.spin_inertia or 1.0)

    # ---- commanded torque ----------------------------------------------------------------------------

    def _ordered(self, name: str) -> tuple[np.ndarray, np.ndarray] | None:
        """Seconds (N,) and what is ordered of a wheel's motor (N,) [N m]; None where that is not known.

        Three wheels share a torque on the body in one way only; with four it depends on software not described."""
        names = [w.name for w in self.now.wheels]
        if self._orders is None or name not in names:
            return None
        t, ordered = self._orders
        return t, ordered[:, names.index(name)]

    @cached_property
    def _orders(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Of all three wheels in service, (N, 3)."""
        tlm, wheels = self.telemetry, self.now.wheels
        if not tlm.has_axes("control_torque") or len(wheels) != 3:
            return None
        axes = np.array([w.axis for w in wheels], float).T
        if np.linalg.cond(axes) > 1e3:
            return None
        tai_ns, torque = attitude.together(tlm, [f"control_torque_{a}" for a in AXES])
        return tlm.seconds(tai_ns), -torque @ np.linalg.inv(axes).T

    def from_command(self, name: str, finder: Finder) -> DragFit | None:
        """Ordered torque less momentum gained, block by block: h_dot = ordered - drag."""
        ordered, J = self._ordered(name), self.described(name).spin_inertia
        if ordered is None or J is None:
            return None
        t, torque = ordered
        rate, drag = [], []
        for s in finder.gapless:
            ts, ws = finder.t[s], finder.rate[s]
            if len(ts) < 6:
                continue
            length = max(_BLOCK_S, 8 * float(np.median(np.diff(ts))))
            for start in np.arange(ts[0], ts[-1] - length + 1e-9, length):
                inside, block = (t >= start) & (t < start + length), (ts >= start) & (ts < start + length)
                # a coasting wheel's order is carried out by something else
                coasts = any(a < start + length and b > start for a, b in self.coasts)
                if coasts or inside.sum() < 6 or block.sum() < 6 or np.max(np.diff(t[inside])) > length / 3:
                    continue
                x, w = ts[block] - ts[block].mean(), ws[block]
                if np.min(np.abs(w)) >= STICTION_RATE:
                    rate.append(float(w.mean()))
                    drag.append(float(torque[inside].mean()) - J * float(x @ w / (x @ x)))
        if len(rate) < _FEWEST_BLOCKS:
            return None
        u, way = np.abs(rate), np.sign(rate)
        values, covariance, used = robust_line(u, way * np.array(drag))
        return DragFit.from_law(COMMAND, values, covariance, float(u[used].mean()))

    # ---- the flight software's estimate ----------------------------------------------------------------

    def from_flight_software(self, name: str, finder: Finder) -> tuple[DragFit, tuple[Spike, ...], DragSamples] | None:
        if f"wheel_drag_torque_{name}" not in self.telemetry:
            return None
        c = self.telemetry.channel(f"wheel_drag_torque_{name}").usable
        t = self.telemetry.seconds(c.tai_ns)
        seen = np.zeros(len(t), bool)
        for s in finder.gapless:
            seen |= (t >= finder.t[s][0]) & (t <= finder.t[s][-1])
        t, drag = t[seen], c.values[seen]
        rate = np.interp(t, finder.t, finder.rate) if len(t) else t
        moving = np.abs(rate) >= STICTION_RATE
        if moving.sum() < _FEWEST_BLOCKS:
            return None
        drag, convention = opposing(rate, drag, STICTION_RATE)
        if convention:
            self.doubts.append(f"wheel_drag_torque_{name} {convention}")
        u = np.abs(rate[moving])
        values, covariance, kept = robust_line(u, drag[moving])
        fit = DragFit.from_law(FLIGHT_SOFTWARE, values, covariance, float(u[kept].mean()))
        used = moving.copy()
        used[moving] = kept
        spikes = tuple(Spike(*s) for s in find_spikes(t, drag - fit.drag(rate), drag, moving, used))
        return fit, spikes, DragSamples(t, rate, drag, used)

    # ---- one wheel ------------------------------------------------------------------------------------

    def wheel(self, name: str, finder: Finder, coasting: Coasting | None, low_speed: float) -> WheelDrag:
        described = self.described(name)
        J, limit = described.spin_inertia, described.rate_limit
        fits: list[DragFit] = []
        if coasting is not None:
            scale, relative = (1.0, True) if J is None else (J, False)
            fits.append(
                DragFit.from_law(RUN_DOWN, coasting.values, coasting.covariance, coasting.rate, scale, relative)
            )
            if relative:
                self.doubts.append(f"wheel {name}: its spin inertia is not known, so its drag is per unit of it")
        software = self.from_flight_software(name, finder)
        if software is not None:
            fits.append(software[0])
        elif (commanded := self.from_command(name, finder)) is not None:
            if commanded.at_mean > _NONE * commanded.sigma_at_mean:
                fits.append(commanded)
                self.doubts.append(
                    f"wheel {name}: drag from the commanded torque is what the wheel gains too little by it; what its own "
                    "electronics make up for is not in it"
                )
            elif not fits:
                self.doubts.append(
                    f"wheel {name}: the commanded torque leaves no drag ({commanded.at_mean:.1g} +- "
                    f"{commanded.sigma_at_mean:.1g} N m): something makes up for it, and it cannot be seen"
                )
        use = wheel_use(self.telemetry.channel(f"wheel_rate_{name}"), finder.t, low_speed)
        self._doubt(name, fits, use, limit)
        return WheelDrag(
            name, J, limit, use, finder.t, finder.rate, tuple(fits),
            () if coasting is None else coasting.run_downs,
            *((None, None) if software is None else software[1:]),
        )  # fmt: skip

    def _doubt(self, name: str, fits: list[DragFit], use: WheelUse, limit: float | None) -> None:
        say = self.doubts.append
        for f in fits:
            if not f.told_apart:
                say(
                    f"wheel {name}, {f.basis}: the range of speeds is too narrow to tell Coulomb from viscous drag; together, "
                    f"at {f.mean_rate:.1f} rad/s, they are known"
                )
            elif f.coulomb < -_NONE * f.sigma_coulomb or f.viscous < -_NONE * f.sigma_viscous:
                say(f"wheel {name}, {f.basis}: a part of the drag comes out negative, so something else acts too")
        for f in fits[1:]:
            g = fits[0]
            if f.relative == g.relative:
                off = float(f.drag(g.mean_rate) - g.at_mean)
                if abs(off) > _APART * np.hypot(f.sigma(g.mean_rate), g.sigma_at_mean):
                    say(f"wheel {name}: {f.basis} and {g.basis} differ by {off:+.2g} N m at {g.mean_rate:.0f} rad/s")
        if use.gaps_s > 0:
            say(
                f"wheel {name}: nothing is known of {use.gaps_s:.0f} s in gaps, so revolutions, dwell and crossings are lower bounds"
            )
        if limit is not None and use.largest_rate_rad_s > limit:
            say(f"wheel {name} exceeds its rate limit: {use.largest_rate_rad_s:.1f} of {limit:.1f} rad/s")
