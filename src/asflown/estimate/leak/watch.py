"""Leaking and weak thrusters, from momentum that orders do not explain (Feldman & Lee 2006, section IV, and beyond it).

``likelihood`` weighs, at every instant, each thruster leaking or weak since any earlier instant against nothing happening
(likelihood.py), with a threshold that noise exceeds at a stated rate.  ``threshold`` is the papers' monitor
(papers_monitor.py).  Both always run; the method says whose alarm counts.

A ``LeakWatch`` takes telemetry as it grows and gives in pieces what one look at the whole would give.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubts
from ...kit.errors import BadInput, check_choice
from ...kit.result import noted, recorded
from ...kit.timeline import NS
from ..firing import PULSES, center_doubts, gained_idle, other_branch, pulse_Nms, uncounted
from ..subject import Subject, stopped, subject_of
from .answered import answer_doubt
from .as_ordered import as_ordered
from .diagnosis import Diagnosis, diagnosed
from .doubts import PAPERS_MONITOR, SHORT_RECORD, branch_doubt, noise_doubts, thrust_doubt
from .firing import geometry_of
from .known import Known, leak_known
from .likelihood import Monitor, threshold_for
from .noise import Noise, learned_noise
from .papers_monitor import ErrorMonitor, error_monitor, threshold_at_rate
from .power import smallest_leaks
from .residual import Steps, steps_of
from .result import LeakResult

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

METHODS = ("likelihood", "threshold")

#: Instants that a stream keeps back: a spike is one only once its neighbours are there.
_HELD_BACK = 3


@recorded
def leak(
    telemetry: Telemetry,
    craft: Craft,
    *,
    method: str = "likelihood",
    false_alarms_per_hour: float = 0.01,
    window_s: float = 600.0,
    thrust_N: float | None = None,
    momentum_Nms: float | None = None,
    known: Known | None = None,
) -> LeakResult:
    """Whether a thruster leaks or is weak in a record, which one, since when and by how much.

    Parameters
    ----------
    telemetry : Telemetry
        Wheel rates, with on-times and pulse counts of thrusters that fire, body rates and quaternion where there are any.
    craft : Craft
        Thrusters, centre of mass (known or assumed), inertia, and the wheels' axes and spin inertia.
    method : {'likelihood', 'threshold'}
        Whose alarm counts: that of the likelihood ratio (Willsky & Jones 1976), or that of the error monitor of Feldman & Lee
        2006, section IV.
    false_alarms_per_hour : float
        Alarms that noise alone may raise in an hour of quiet record.
    window_s : float
        Age of a leak at which the smallest detectable one is stated, and the error monitor's duration [s].
    thrust_N : float, optional
        Steady thrust of each thruster [N]; the craft's on the date unless given.
    momentum_Nms : float, optional
        The error monitor's threshold [N m s]; by default the one that noise exceeds at the same rate.
    known : Known, optional
        One sigma of what is taken as known, from ``leak_known``; its defaults unless given.

    Returns
    -------
    LeakResult
        The alarm, and what changed; torque (3,) [N m] about the centre of mass, positive as it turns the body about +axis.

    Raises
    ------
    BadInput
        For a craft without thrusters, centre of mass, inertia or spin inertia, for missing channels, and for a record too
        short to learn the noise from.
    """
    watch = LeakWatch(
        craft,
        method=method,
        false_alarms_per_hour=false_alarms_per_hour,
        window_s=window_s,
        thrust_N=thrust_N,
        momentum_Nms=momentum_Nms,
        known=known,
    )
    watch.take(telemetry, final=True)
    return watch.result()


@dataclass(frozen=True)
class _View:
    """The newest look at the record."""

    subject: Subject
    steps: Steps
    thrust_N: float

    @property
    def time_s(self) -> np.ndarray:
        return self.subject.telemetry.seconds(self.steps.tai_ns)


class LeakWatch:
    """A leak monitor for telemetry that grows: ``take`` what there is so far, as often as wanted, then ask for the ``result``.

    Options are those of ``leak``."""

    def __init__(
        self,
        craft: Craft,
        *,
        method: str = "likelihood",
        false_alarms_per_hour: float = 0.01,
        window_s: float = 600.0,
        thrust_N: float | None = None,
        momentum_Nms: float | None = None,
        known: Known | None = None,
    ):
        check_choice(method, METHODS, "method")
        for value, what in (
            (false_alarms_per_hour, "rate of false alarms"), (window_s, "window"), (thrust_N, "thrust"),
            (momentum_Nms, "threshold of momentum"),
        ):  # fmt: skip
            if value is not None and not 0 < value < np.inf:
                raise BadInput(f"a {what} of {value:g} is not positive", remedy="Give a number above zero.")
        self.craft, self.method, self.known = craft, method, known or leak_known(craft)
        self.false_alarms_per_hour, self.window_s = false_alarms_per_hour, window_s
        self.thrust_N, self.momentum_Nms = thrust_N, momentum_Nms
        self.geometry = geometry_of(craft)
        self._view: _View | None = None
        self._monitor: Monitor | None = None

    def take(self, telemetry: Telemetry, *, final: bool = False) -> bool:
        """The record so far, of which only what is new is gone through.  Returns whether there is an alarm.

        ``final``: nothing will follow.  Raises BadInput for channels missing, and where the record is final and too short."""
        subject = subject_of(telemetry.watched(), self.craft, moving=None)
        thrust = self.thrust_N or self.craft.believed_thrust(telemetry.date_ns)
        try:
            steps = steps_of(subject, self.geometry, thrust)
            if not final:
                steps = steps.first(len(steps.tai_ns) - _HELD_BACK)
            view = _View(subject, steps, thrust)
            if self._monitor is not None and not self._monitor.is_followed_by(steps):
                self._monitor = None  # what was taken has changed since: begin anew
            noise = self._learned(view, final=final) if self._monitor is None else self._monitor.noise
        except BadInput as why:
            raise why.within(telemetry.source) from why.__cause__
        self._view = view
        if noise is None:
            return False
        if self._monitor is None:
            inertia, wheels = subject.known_inertia(), len(subject.craft.wheels)
            threshold = threshold_for(self._rate(view, noise))
            self._monitor = Monitor(self.geometry, noise, inertia, wheels, threshold, self.known)
        self._monitor.take(steps)
        return self._alarm(self._monitor, self._papers(view, noise)) is not None

    def result(self) -> LeakResult:
        """What is found so far.  Raises BadInput where the record has been too short to learn the noise from."""
        view, monitor = self._view, self._monitor
        if view is None or monitor is None:
            raise BadInput("too little telemetry to say anything", remedy="Wait for more, or take a longer record.")
        tlm, steps, t = view.subject.telemetry, view.steps, view.time_s
        papers = self._papers(view, monitor.noise)
        alarm = self._alarm(monitor, papers)
        found, of_change = self._diagnosis(view, monitor, papers) if alarm is not None else (Diagnosis(), Doubts())
        by_window = smallest_leaks(monitor, monitor.at_alarm or monitor.evidence(), t, self.window_s)
        arm = np.linalg.norm(self.geometry.columns, axis=0)
        smallest = by_window.get(self.window_s)
        result = LeakResult(
            craft=self.craft.name,
            epoch=tlm.epoch_label,
            method=self.method,
            alarm_s=None if alarm is None else float(t[alarm]),
            **vars(found),
            alternative=found.thruster and other_branch(found.thruster, self.craft.thrusters),
            smallest_detectable_N={} if smallest is None else dict(zip(self.geometry.names, smallest, strict=True)),
            detectable_Nm={w: float((v * arm).max()) for w, v in by_window.items()},
            window_s=self.window_s,
            false_alarms_per_hour=self.false_alarms_per_hour,
            threshold=monitor.threshold,
            time_s=t,
            residual_Nms=steps.residual - steps.residual[0],
            statistic=np.array(monitor.statistic),
            noise_Nms=monitor.noise.sigma,
            monitor=papers,
            known=self.known,
            doubts=self._doubts(view, monitor.noise, short=smallest is None)
            + of_change
            + Doubts(as_ordered(steps, self.geometry, found)),
            settings={
                "thrust_N": view.thrust_N,
                "center_of_mass_m": self.craft.stated_center,
                "inertia_kg_m2": view.subject.inertia_kgm2,
                "one_sigma_of_what_is_known": self.known.record(),
            },
        )
        return noted(result, {"telemetry": tlm, "craft": self.craft} | self._options)

    @property
    def _options(self) -> dict:
        names = ("method", "false_alarms_per_hour", "window_s", "thrust_N", "momentum_Nms", "known")
        return {n: getattr(self, n) for n in names}

    def _learned(self, view: _View, *, final: bool) -> Noise | None:
        """The noise; None while it is not known and more may come.

        Raises BadInput for too few quiet instants; where momentum changes as by pulses and no on-time rises, that is why."""
        tlm, steps = view.subject.telemetry, view.steps
        try:
            return learned_noise(steps, final=final)
        except BadInput as why:
            if steps.body_rate.any() and not steps.ordered.any():
                body = np.einsum("nij,nj->ni", steps.turned, steps.body_rate @ view.subject.known_inertia())
                gained = gained_idle(steps.residual, body)
                pulses = gained / self._pulse_Nms(view)
                if pulses > PULSES:
                    raise uncounted(gained, pulses, "in this record", tlm.source) from why
            raise

    def _rate(self, view: _View, noise: Noise) -> float:
        """False alarms an instant."""
        step_ns = float(np.median(np.diff(view.steps.tai_ns[: noise.until])))
        return self.false_alarms_per_hour * step_ns / NS / 3600

    def _papers(self, view: _View, noise: Noise) -> ErrorMonitor:
        threshold = self.momentum_Nms or threshold_at_rate(noise, self._rate(view, noise))
        return error_monitor(view.steps, self.geometry, threshold, self.window_s)

    def _alarm(self, monitor: Monitor, papers: ErrorMonitor) -> int | None:
        return papers.alarm if self.method == "threshold" else monitor.alarm

    def _diagnosis(self, view: _View, monitor: Monitor, papers: ErrorMonitor) -> tuple[Diagnosis, Doubts]:
        """What the alarm is of, and what is not sure of it."""
        of_record = [branch_doubt(view.subject.telemetry, self.craft), *stopped(view.subject)]
        if self.method == "threshold":
            return Diagnosis(kind="leak", thruster=papers.thruster), Doubts([*of_record, PAPERS_MONITOR()])
        if monitor.best is None:
            return Diagnosis(), Doubts(of_record)
        found, doubts = diagnosed(
            monitor.best, view.time_s, self.geometry, self.known, view.thrust_N, self._pulse_Nms(view)
        )
        return found, Doubts([*of_record, answer_doubt(view.subject, found), *doubts])

    def _pulse_Nms(self, view: _View) -> float:
        date_ns = view.subject.telemetry.date_ns
        return pulse_Nms(self.craft, self.craft.thrusters, self.geometry.shortest_s, date_ns)

    def _doubts(self, view: _View, noise: Noise, *, short: bool) -> Doubts:
        """Of the record and of what is taken as known, alarm or not."""
        assumed = self.thrust_N is None and view.steps.ordered.any()
        return Doubts([
            *center_doubts(self.craft, self.known.center_of_mass_m),
            *view.subject.doubts,
            *view.steps.doubts,
            *noise_doubts(noise, view.steps),
            thrust_doubt(view.subject.telemetry.date_ns, self.craft) if assumed else None,
            SHORT_RECORD(window_s=self.window_s) if short else None,
        ])  # fmt: skip
