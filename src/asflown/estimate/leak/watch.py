"""Leaking and weak thrusters, from momentum that orders do not explain (001 section IV, its error monitor, and beyond it).

``likelihood`` weighs, at every instant, each thruster leaking or weak since any earlier instant against nothing happening
(leak_filter), with a threshold that noise exceeds at a stated rate.  ``threshold`` is the papers' monitor
(leak_error_monitor).  Both run always; the method says whose alarm counts.

A ``LeakWatch`` takes telemetry as it grows and gives in pieces what one look at the whole would give.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import norm

from ...kit.errors import BadInput, some_of
from ...kit.timeline import NS
from ..firing import PULSES, center_doubts, gained_idle, other_branch, pulse_Nms, uncounted
from ..subject import Subject, stopped, subject_of
from .doubts import branch_doubts, loss_doubt, noise_doubts, pointing_doubt, thrust_doubts, together
from .firing import geometry_of
from .known import Known, known_for
from .likelihood import Evidence, Monitor, threshold_for
from .noise import Noise, learned_noise
from .papers_monitor import ErrorMonitor, error_monitor, threshold_at_rate
from .residual import Steps, steps_of
from .result import LeakResult

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

METHODS = ("likelihood", "threshold")

#: Ages of a leak for which the smallest detectable one is given. [s]
WINDOWS_S = (60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0, 3600.0)
POWER = 0.9  # of the smallest detectable leak

#: Instants that a stream keeps back: a spike is one only once its neighbours are there.
_HELD_BACK = 3
_SURE = 0.95  # posterior below which the thruster named is doubted


def leak(telemetry: Telemetry, craft: Craft, **options) -> LeakResult:
    """Whether a thruster leaks or is weak in a record.  Options are those of ``LeakWatch``.

    Raises BadInput for a craft without thrusters, centre of mass (known or assumed), inertia or spin inertia, and for channels missing."""
    watch = LeakWatch(craft, **options)
    watch.take(telemetry, final=True)
    return watch.result()


@dataclass(frozen=True)
class _View:
    """The newest look at the record."""

    subject: Subject
    steps: Steps
    thrust_N: float


class LeakWatch:
    """``method``: whose alarm counts.  ``false_alarms_per_hour``: of quiet record.  ``window_s``: the age of a leak for which the
    smallest detectable one is stated, and the papers' duration.  ``thrust_N``: of each thruster, steady; the craft's on the
    date.  ``momentum_Nms``: the papers' threshold; by default the one that noise exceeds at the same rate."""

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
        if method not in METHODS:
            raise BadInput(f"method {method!r} is not known", remedy=f"Choose one of: {some_of(METHODS)}.")
        for value, what in (
            (false_alarms_per_hour, "rate of false alarms"), (window_s, "window"), (thrust_N, "thrust"),
            (momentum_Nms, "threshold of momentum"),
        ):  # fmt: skip
            if value is not None and not 0 < value < np.inf:
                raise BadInput(f"a {what} of {value:g} is not positive", remedy="Give a number above zero.")
        self.craft, self.method, self.known = craft, method, known or known_for(craft)
        self.rate, self.window_s, self._thrust_N, self._momentum_Nms = (
            false_alarms_per_hour,
            window_s,
            thrust_N,
            momentum_Nms,
        )
        self.geometry = geometry_of(craft)
        self._view: _View | None = None
        self._noise: Noise | None = None
        self._monitor: Monitor | None = None
        self._last_ns = 0

    def take(self, telemetry: Telemetry, final: bool = False) -> bool:
        """The record so far, of which only what is new is gone through.  Returns whether there is an alarm.

        ``final``: nothing will follow."""
        subject = subject_of(telemetry, self.craft, moving=None)
        thrust = self._thrust_N or self.craft.believed_thrust(telemetry.date_ns)
        try:
            steps = steps_of(subject, self.geometry, thrust)
        except BadInput as why:
            raise why.within(telemetry.source) from why.__cause__
        try:
            if not final:
                steps = steps.first(len(steps.tai_ns) - _HELD_BACK)
            if self._monitor is not None and not self._follows(steps):
                self._noise = self._monitor = None  # what was taken has changed since: begin anew
            if self._noise is None:
                self._noise = learned_noise(steps, final)
        except BadInput as why:
            if final and steps.body_rate.any() and not steps.ordered.any():
                body = np.einsum("nij,nj->ni", steps.turned, steps.body_rate @ subject.known_inertia())
                gained = gained_idle(steps.residual, body)
                pulses = gained / self._pulse_Nms(telemetry.date_ns)
                if pulses > PULSES:
                    raise uncounted(gained, pulses, "in this record", telemetry.source) from why
            raise why.within(telemetry.source) from why.__cause__
        self._view = _View(subject, steps, thrust)
        if self._noise is None:
            return False
        if self._monitor is None:
            threshold = threshold_for(self._rate_per_instant(steps))
            wheels = len(subject.craft.wheels)
            self._monitor = Monitor(self.geometry, self._noise, subject.known_inertia(), wheels, threshold, self.known)
        self._monitor.take(steps)
        self._last_ns = int(steps.tai_ns[-1])
        return self._alarm(self._papers()) is not None

    def result(self) -> LeakResult:
        """Raises BadInput where the record has been too short to learn the noise from."""
        if self._view is None or self._monitor is None or self._noise is None:
            raise BadInput("too little telemetry to say anything", remedy="Wait for more, or take a longer record.")
        view, monitor = self._view, self._monitor
        tlm, steps = view.subject.telemetry, view.steps
        t, papers = tlm.seconds(steps.tai_ns), self._papers()
        alarm = self._alarm(papers)
        windows = self._detectable(monitor.at_alarm or monitor.evidence(), t)
        at_window = windows.get(self.window_s)
        found: dict[str, Any] = dict.fromkeys(
            ("kind", "thruster", "posterior", "onset_s", "onset_95_s", "torque_Nm", "torque_sigma_Nm", "leak_N",
             "leak_sigma_N", "loss", "loss_sigma", "together")
        )  # fmt: skip
        doubts = [*center_doubts(self.craft, self.known.center_of_mass_m), *view.subject.doubts, *steps.doubts]
        doubts += noise_doubts(self._noise, steps)
        if self._thrust_N is None and steps.ordered.any():
            doubts += thrust_doubts(tlm.date_ns, self.craft)
        if at_window is None:
            doubts.append(
                f"up to its end or its alarm the record is shorter than {self.window_s:g} s: the smallest leak found by then is not given"
            )
        if alarm is not None:
            doubts = [
                *branch_doubts(tlm, self.craft),
                *stopped(view.subject),
                *doubts,
            ]  # what may be wrong with it comes first
        if alarm is not None and self.method == "threshold":
            found |= {"kind": "leak", "thruster": papers.thruster}
            doubts.append("the papers' monitor gives no probability, and takes any momentum not ordered for a leak")
        elif alarm is not None and monitor.best is not None:
            told, more = self._told(monitor.best, t, view.thrust_N, tlm.date_ns)
            found |= told
            doubts = [*more, *doubts]
        return LeakResult(
            craft=self.craft.name,
            epoch=tlm.epoch_label,
            method=self.method,
            alarm=alarm is not None,
            alarm_s=None if alarm is None else float(t[alarm]),
            alternative=self._alternative(found["thruster"]),
            **found,
            smallest_detectable_Nm=None if at_window is None else float((at_window * self._arm).max()),
            smallest_detectable_N={} if at_window is None else dict(zip(self.geometry.names, at_window, strict=True)),
            detectable_Nm={w: float((v * self._arm).max()) for w, v in windows.items()},
            window_s=self.window_s,
            false_alarms_per_hour=self.rate,
            threshold=monitor.threshold,
            time_s=t,
            residual=steps.residual - steps.residual[0],
            statistic=np.array(monitor.statistic),
            noise_Nms=self._noise.sigma,
            monitor=papers,
            doubts=tuple(dict.fromkeys(doubts)),
            taken_as_known=str(self.known),
            settings={
                "thrust_N": view.thrust_N,
                "center_of_mass_m": self.craft.stated_center,
                "inertia_kg_m2": view.subject.inertia_kgm2,
                "one_sigma_of_what_is_known": self.known.record(),
            },
        )

    @property
    def _arm(self) -> np.ndarray:
        return np.linalg.norm(self.geometry.columns, axis=0)

    def _follows(self, steps: Steps) -> bool:
        taken = self._monitor.taken if self._monitor else 0
        return taken <= len(steps.tai_ns) and int(steps.tai_ns[taken - 1]) == self._last_ns

    def _rate_per_instant(self, steps: Steps) -> float:
        assert self._noise is not None
        return self.rate * float(np.median(np.diff(steps.tai_ns[: self._noise.until]))) / NS / 3600

    def _papers(self) -> ErrorMonitor:
        assert self._view is not None and self._noise is not None
        steps = self._view.steps
        threshold = self._momentum_Nms or threshold_at_rate(self._noise, self._rate_per_instant(steps))
        return error_monitor(steps, self.geometry, threshold, self.window_s)

    def _alarm(self, papers: ErrorMonitor) -> int | None:
        if self.method == "threshold" or self._monitor is None:
            return papers.alarm
        return self._monitor.alarm

    def _detectable(self, evidence: Evidence, t) -> dict[float, np.ndarray]:
        """Smallest leak of each thruster [N] that the filter finds with POWER, by its age [s], as far as the record goes.

        A leak of F shifts d / sqrt c by F sqrt c."""
        monitor, n = self._monitor, evidence.degrees
        assert monitor is not None
        if len(evidence.onset) < 2:
            return {}
        raw = n / 2 * np.expm1(2 * monitor.threshold / n)
        needed = np.sqrt(2 * raw) + norm.ppf(POWER)
        age = (t[evidence.instant] - t[evidence.onset - 1])[::-1]
        c = evidence.c[::-1, : len(self.geometry.names)]
        windows = sorted({*WINDOWS_S, self.window_s})
        return {
            w: np.array(
                [needed / np.exp(0.5 * np.interp(np.log(w), np.log(age), np.log(c[:, j]))) for j in range(c.shape[1])]
            )
            for w in windows
            if age[0] <= w <= age[-1]
        }

    def _told(self, e: Evidence, t, thrust_N: float, date_ns: int | None) -> tuple[dict, list[str]]:
        """What the evidence says of the change, and doubts."""
        weights, names = e.weights(thrust_N), self.geometry.names
        j, by_hypothesis = len(names), weights.sum(axis=0)
        posterior = by_hypothesis[:j] + by_hypothesis[j:]
        k = int(posterior.argmax())
        weak = by_hypothesis[j + k] > by_hypothesis[k]
        h = k + j if weak else k
        b = int(e.log_ratio[:, h].argmax())
        since = t[e.onset - 1]  # a change within a step is told from its beginning
        share = np.cumsum(weights.sum(axis=1))
        low, high = (int(np.searchsorted(share, q)) for q in (0.025, 0.975))
        size, sigma = float(e.d[b, h] / e.c[b, h]), float(1 / np.sqrt(e.c[b, h]))
        C = e.free_c[b]
        free = np.linalg.solve(C, e.free_d[b])
        found: dict[str, Any] = {
            "kind": "weak" if weak else "leak", "thruster": names[k],
            "posterior": dict(zip(names, posterior.tolist(), strict=True)),
            "onset_s": float(since[b]), "onset_95_s": (float(since[low]), float(t[e.onset[min(high, len(since) - 1)]])),
        }  # fmt: skip
        better = 0.5 * float(e.free_d[b] @ free) - 0.5 * float(e.d[b, h] ** 2 / e.c[b, h])
        gained = float(np.linalg.norm(free)) * (t[e.instant] - since[b])
        one = self._pulse_Nms(date_ns)
        mixed = together(better, free, C, self.geometry)
        doubts = [pointing_doubt(better, mixed, gained / one)]
        if len(mixed) > 1:
            found["together"] = mixed
        if weak:
            found |= {"loss": size, "loss_sigma": sigma}
            doubts.append(loss_doubt(size, sigma))
        else:
            found |= {"leak_N": size, "leak_sigma_N": sigma, "torque_Nm": free,
                      "torque_sigma_Nm": np.sqrt(np.diag(np.linalg.inv(C)))}  # fmt: skip
            if np.linalg.norm(free) < 5 * self.known.torque_Nm:
                doubts.append(
                    "a torque so small may come from outside too (sunlight, thin atmosphere) and have changed"
                )
        if posterior[k] < _SURE:
            second = int(np.argsort(posterior)[-2])
            doubts.append(
                f"which thruster it is remains open: {names[k]} {posterior[k]:.2f}, {names[second]} {posterior[second]:.2f}"
            )
        if e.onset[b] <= 2:
            doubts.append(
                "it is there from the record's beginning: only its size tells it from the steady torque from outside"
            )
        return found, [d for d in doubts if d]

    def _pulse_Nms(self, date_ns: int | None) -> float:
        return pulse_Nms(self.craft, self.craft.thrusters, self.geometry.shortest_s, date_ns)

    def _alternative(self, thruster: str | None) -> str | None:
        """The thruster of the other branch sits beside this one, and momentum cannot tell them apart."""
        return None if thruster is None else other_branch(thruster, self.craft.thrusters)
