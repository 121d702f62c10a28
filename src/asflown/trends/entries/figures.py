"""Figures of merit of an actuation, each declared in a few lines.

A figure is a function of one actuation; its docstring is its description.  One of the torque is
computed on every basis (fused with its sigma, and both printed methods), one of telemetry once::

    @figure_of_merit("N m s")
    def late_impulse(torque: Torque):
        \"\"\"Area under the torque from minute 1.35 to 3 after the motor came on.\"\"\"
        return torque.impulse(81.0, 180.0)
"""

from __future__ import annotations

import inspect
import runpy
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Kind, Severity
from ...kit.ensemble import spread
from ...kit.errors import BadInput
from ...kit.peaks import peaks
from ...kit.plain import finite
from ..entry import Value
from .events import Event, stall

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...craft.model import Mechanism
    from ...kit.doubts import Doubt
    from ...telemetry.telemetry import Telemetry

#: The first kind of motion lasts from the motor's start to minute 1.35 after it (cover paper section V: 1.00 to 2.35). [s]
FIRST_PHASE_S = 81.0
#: Excursions nearer than this to a larger one, or standing out less than this share of the largest, are part of it.
_APART_S, _STANDS_OUT = 5.0, 0.1
#: Tolerance of a mechanism's end angle: twice the potentiometer's usual step. [rad]
END_WITHIN = np.radians(1.0)


@dataclass(frozen=True)
class Torque:
    """Torque about the hinge over time from the motor's start, and draws from its posterior where there are any."""

    time_s: np.ndarray  # (N,)
    mean_Nm: np.ndarray  # (N,)
    drawn_time_s: np.ndarray = field(default_factory=lambda: np.empty(0))  # (F,)
    drawn_Nm: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))  # (K, F); K = 0: none
    start_sigma_s: float = 0.0  # how well the motor's start is known

    def impulse(self, start_s: float, stop_s: float) -> Measured:
        """Angular impulse between two times from the motor's start; unknown beyond the record. [N m s]"""
        step = float(self.time_s[1] - self.time_s[0])
        if start_s < self.time_s[0] - step or stop_s > self.time_s[-1] + step:
            return Measured(
                None, None, f"the record does not cover {start_s:g} to {stop_s:g} s after the motor's start"
            )
        value = float(_area(self.time_s, self.mean_Nm, start_s, stop_s))
        if not len(self.drawn_Nm):
            return Measured(value)
        own = float(spread(_area(self.drawn_time_s, self.drawn_Nm, start_s, stop_s)))
        ends = np.interp([start_s, stop_s], self.time_s, self.mean_Nm)
        return Measured(value, float(np.hypot(own, (ends[1] - ends[0]) * self.start_sigma_s)))

    def momentum(self) -> tuple[np.ndarray, np.ndarray]:
        """Momentum transferred to the body since the motor's start, and drawn ones, at ``time_s`` and ``drawn_time_s``. [N m s]"""
        own = _cumulated(self.time_s, self.mean_Nm)
        return own, _cumulated(self.drawn_time_s, self.drawn_Nm) if len(self.drawn_Nm) else self.drawn_Nm

    def excursions(self, after_s: float, sign: int) -> np.ndarray:
        """Times of the excursions of one sign after a time, the largest first. [s]"""
        late = self.time_s >= after_s
        t, v = self.time_s[late], sign * self.mean_Nm[late]
        if len(v) < 3 or not np.nanmax(v) > 0:
            return np.empty(0)
        step = float(np.median(np.diff(t)))
        at = peaks(
            np.nan_to_num(v), height=0, prominence=_STANDS_OUT * np.nanmax(v), distance=max(1, round(_APART_S / step))
        )
        return t[at[np.argsort(-v[at])]]

    def height(self, times_s) -> Measured:
        """Mean torque at these times, of the excursions there. [N m]

        The extremes of each draw are not used: drawn torques are rougher than a mechanism's, and their extremes are 10 %
        too high (studies/peak_figures.py)."""
        value = float(np.mean(np.interp(times_s, self.time_s, self.mean_Nm)))
        return Measured(value, self.spread_at(self.drawn_Nm, times_s))

    def spread_at(self, drawn, times_s) -> float | None:
        """One sigma of the mean over these times of drawn curves (K, F); None without any."""
        if not len(drawn):
            return None
        near = [int(np.argmin(np.abs(self.drawn_time_s - t))) for t in times_s]
        return float(spread(drawn[:, near].mean(axis=1)))


@dataclass(frozen=True)
class Measured:
    """A value, its sigma where there is one, and its doubt where there is one: a ``Doubt``, or a sentence."""

    value: float | None
    sigma: float | None = None
    doubt: Doubt | str | None = None


@dataclass(frozen=True)
class Actuation:
    """One actuation as its telemetry shows it, for figures that are not of the torque."""

    telemetry: Telemetry
    event: Event
    mechanism: Mechanism

    def samples(self, stem: str) -> tuple[np.ndarray, np.ndarray] | None:
        """Times from the motor's start and usable values of the mechanism's channel; None where it has none."""
        for name in (f"{stem}_{self.mechanism.name}", stem):
            if name in self.telemetry:
                c = self.telemetry.channel(name).usable
                return self.telemetry.seconds(c.tai_ns) - self.event.motor_on_s, c.values
        return None

    @property
    def running_s(self) -> float:
        return self.event.motor_off_s - self.event.motor_on_s

    @property
    def target_rad(self) -> float:
        return self.mechanism.deployed if self.event.kind == "deploy" else self.mechanism.stowed

    @cached_property
    def stall(self) -> tuple[float, float] | None:
        """Stall after the motor's start and its sigma. [s]"""
        return stall(self.telemetry, self.event)

    def level(self, stem: str, start_s: float, stop_s: float) -> Measured:
        """Median of a channel between two times, and its standard error."""
        found = self.samples(stem)
        if found is None:
            return Measured(None)
        inside = found[1][(found[0] > start_s) & (found[0] < stop_s)]
        if not len(inside):
            return Measured(None)
        sigma = None if len(inside) < 3 else float(1.2533 * np.std(inside, ddof=1) / np.sqrt(len(inside)))
        return Measured(float(np.median(inside)), sigma)


@dataclass(frozen=True)
class FigureOfMerit:
    """One declared figure: ``of`` a Torque or an Actuation; ``judged`` for trend and watch; ``is_check``: should be zero."""

    name: str
    unit: str
    meaning: str
    of: str  # torque or actuation
    compute: Callable[..., Measured | None]
    judged: bool
    is_check: bool


FIGURES: dict[str, FigureOfMerit] = {}


def figure_of_merit(unit: str, *, judged: bool = True, is_check: bool = False):
    """Decorator: declare a function as a figure of merit under its own name.

    Parameters
    ----------
    unit : str
        SI unit of its value, as in 'N m s'; '' where it has none.
    judged : bool
        Whether trend and watch test it.
    is_check : bool
        Whether it should be zero; it is doubted where it is not.

    Returns
    -------
    callable
        The decorator.  The function has one argument, ``torque`` (a Torque; computed on every basis) or ``actuation``
        (an Actuation), and returns a Measured, or None where the figure cannot be computed.  Its docstring is the
        figure's description.

    Raises
    ------
    TypeError
        For any other signature, and without a docstring.
    """

    def declare(compute):
        names = list(inspect.signature(compute).parameters)
        if names not in (["torque"], ["actuation"]) or not compute.__doc__:
            raise TypeError(f"{compute.__name__}: a figure has one argument, torque or actuation, and a docstring")
        meaning = " ".join(compute.__doc__.split())
        FIGURES[compute.__name__] = FigureOfMerit(compute.__name__, unit, meaning, names[0], compute, judged, is_check)
        return compute

    return declare


def load_figures(path: str | Path) -> None:
    """Declare the figures of a user's Python file in addition to the shipped ones.

    Raises BadInput where the file does not exist or does not run."""
    if not Path(path).is_file():
        raise BadInput(
            "this file of figures does not exist", file=path, remedy="Give a Python file; see docs/trends.md."
        )
    try:
        runpy.run_path(str(path))
    except Exception as why:
        raise BadInput(
            f"this file of figures does not run ({type(why).__name__}: {why})", file=path, remedy="See docs/trends.md."
        ) from why


OF_FIGURE = Kind("trends.figure", Severity.CAUTION, "{figure}: {sentence}")  # sentence of a user's figure
OTHER_END = Kind(
    "trends.end-angle", Severity.SUSPECT,
    "the {mechanism} ends at {angle_deg:.2f} deg, not at {target_deg:.2f} deg",
)  # fmt: skip
OTHER_SWITCH = Kind("trends.microswitch", Severity.SUSPECT, "the microswitch ends at {state}, not {wanted}")
ONE_EXCURSION = Kind(
    "trends.one-excursion",
    Severity.CAUTION,
    "{figure}: there is only one significant excursion of this sign after minute 1.35",
)


def measure(figure: FigureOfMerit, of, basis: str) -> tuple[Value, Doubt | None]:
    """One figure on one basis, and its doubt; None where it cannot be computed."""
    found = figure.compute(of) or Measured(None)
    value, sigma = finite(found.value), finite(found.sigma)
    doubt = OF_FIGURE(figure=figure.name, sentence=found.doubt) if isinstance(found.doubt, str) else found.doubt
    return Value(figure.name, basis, value, None if value is None else sigma, figure.unit), doubt


@figure_of_merit("N m s")
def angular_impulse(torque: Torque):
    """Area under the torque from the motor's start to minute 1.35 after it (cover paper section V: minute 1.00 to 2.35)."""
    return torque.impulse(0.0, FIRST_PHASE_S)


@figure_of_merit("N m")
def peak_positive(torque: Torque):
    """Mean of the two largest excursions after minute 1.35 from the motor's start (cover paper section V)."""
    return _two_largest(torque, 1)


@figure_of_merit("N m")
def peak_negative(torque: Torque):
    """Mean of the two smallest excursions after minute 1.35 from the motor's start (cover paper section V)."""
    return _two_largest(torque, -1)


@figure_of_merit("N m s", judged=False, is_check=True)
def net_impulse(torque: Torque):
    """Area under the torque from the motor's start to the end of the record: zero without an external torque."""
    return torque.impulse(0.0, float(torque.time_s[-1]))


@figure_of_merit("N m s")
def peak_momentum(torque: Torque):
    """Largest momentum of the mechanism during its motion, with its sign."""
    own, drawn = torque.momentum()
    k = int(np.nanargmax(np.abs(own)))
    return Measured(float(own[k]), torque.spread_at(drawn, torque.time_s[[k]]))


@figure_of_merit("s", judged=False)
def time_of_peak_positive(torque: Torque):
    """Time of the largest excursion after the motor's start."""
    return _time_of_largest(torque, 1)


@figure_of_merit("s", judged=False)
def time_of_peak_negative(torque: Torque):
    """Time of the smallest excursion after the motor's start."""
    return _time_of_largest(torque, -1)


@figure_of_merit("s")
def time_to_stall(actuation: Actuation):
    """From the motor's start to the jump of its current at the end stop; known to a sampling interval."""
    return None if actuation.stall is None else Measured(*actuation.stall)


@figure_of_merit("rad", judged=False)
def end_angle(actuation: Actuation):
    """Angle at the last sample."""
    found = actuation.samples("cover_angle")
    if found is None or not len(found[1]):
        return None
    off = abs(found[1][-1] - actuation.target_rad)
    angle = float(found[1][-1])
    if off < END_WITHIN:
        return Measured(angle)
    ends = float(np.degrees(angle)), float(np.degrees(actuation.target_rad))
    return Measured(angle, None, OTHER_END(mechanism=actuation.mechanism.name, angle_deg=ends[0], target_deg=ends[1]))


@figure_of_merit("", judged=False)
def microswitch(actuation: Actuation):
    """1 where the last reading of the switch is the commanded end position, else 0."""
    found = actuation.samples("microswitch")
    if found is None or not len(found[1]):
        return None
    wanted = {"deploy": "deployed", "stow": "stowed"}[actuation.event.kind]
    right = str(found[1][-1]) == wanted
    return Measured(float(right), None, None if right else OTHER_SWITCH(state=str(found[1][-1]), wanted=wanted))


@figure_of_merit("A")
def run_current(actuation: Actuation):
    """Median motor current from the start to the stall."""
    until = actuation.stall[0] if actuation.stall else actuation.running_s
    return actuation.level("motor_current", 0.0, until)


@figure_of_merit("A")
def stall_current(actuation: Actuation):
    """Median motor current from the stall to the end."""
    return None if not actuation.stall else actuation.level("motor_current", actuation.stall[0], actuation.running_s)


def _two_largest(torque: Torque, sign: int) -> Measured | None:
    times = torque.excursions(FIRST_PHASE_S, sign)[:2]
    if not len(times):
        return None
    found = torque.height(times)
    name = "peak_positive" if sign > 0 else "peak_negative"
    doubt = None if len(times) == 2 else ONE_EXCURSION(figure=name)
    return Measured(found.value, found.sigma, doubt)


def _time_of_largest(torque: Torque, sign: int) -> Measured | None:
    times = torque.excursions(FIRST_PHASE_S, sign)
    if not len(times):
        return None
    if not len(torque.drawn_Nm):
        return Measured(float(times[0]))
    near = np.abs(torque.drawn_time_s - times[0]) <= _APART_S
    drawn = torque.drawn_time_s[near][np.argmax(sign * torque.drawn_Nm[:, near], axis=1)]
    return Measured(float(times[0]), float(np.hypot(spread(drawn), torque.start_sigma_s)))


def _area(time_s, values, start_s: float, stop_s: float):
    """Integral of (..., N) between two times, straight lines between the instants."""
    whole = _cumulated(time_s, values)
    ends = [_at(time_s, values, whole, t) for t in (start_s, stop_s)]
    return ends[1] - ends[0]


def _cumulated(time_s, values) -> np.ndarray:
    """Integral since time zero, (..., N)."""
    step = np.diff(time_s)
    sums = np.concatenate(
        [np.zeros((*np.shape(values)[:-1], 1)), np.cumsum(0.5 * step * (values[..., 1:] + values[..., :-1]), axis=-1)],
        axis=-1,
    )
    return sums - np.asarray(_at(time_s, values, sums, 0.0))[..., None]


def _at(time_s, values, whole, t: float):
    """The cumulated integral at an instant between two samples."""
    k = int(np.clip(np.searchsorted(time_s, t) - 1, 0, len(time_s) - 2))
    part = np.clip(t - time_s[k], 0, time_s[k + 1] - time_s[k])
    slope = (values[..., k + 1] - values[..., k]) / (time_s[k + 1] - time_s[k])
    return whole[..., k] + part * (values[..., k] + 0.5 * slope * part)
