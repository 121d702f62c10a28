"""What the leak monitor says: whether, which thruster, since when, how much, and what it would not have seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from ...kit.digits import interval, plus_minus, scaled_unit
from ...kit.errors import some_of
from ...kit.result import Estimate, Series
from ...kit.schema import Annotated, Doc, Interval, Number, TypedDict, Vector
from ...kit.table import Table
from ...telemetry.channels import AXES
from .diagnosis import Diagnosis

if TYPE_CHECKING:
    import numpy as np

    from .known import Known
    from .papers_monitor import ErrorMonitor


class DetectableRecord(TypedDict):
    window_s: Number
    torque_Nm: Annotated[Number, Doc("of the worst thruster")]


class ErrorMonitorRecord(TypedDict):
    """The papers' monitor, whose alarm is told whatever the method."""

    alarm: bool
    alarm_s: Number
    thruster: str | None
    signs: Annotated[str | None, Doc("of the residual momentum about x, y, z at the alarm, as in '+-0'")]
    threshold_Nms: Number
    duration_s: Number


class LeakRecord(TypedDict):
    """JSON of `asflown leak`.  Without an alarm all from ``kind`` to ``loss_sigma`` is null; the papers' monitor gives ``kind``,
    ``thruster`` and ``alternative`` only."""

    craft: str
    epoch: str
    method: Annotated[str, Doc("whose alarm counts: likelihood or threshold")]
    alarm: bool
    alarm_s: Number
    kind: Annotated[str | None, Doc("leak or weak")]
    thruster: str | None
    alternative: Annotated[str | None, Doc("the thruster of the other branch, in the same place")]
    together: Annotated[list[str] | None, Doc("thrusters that make the torque between them, where no one alone would")]
    posterior: Annotated[dict[str, Number] | None, Doc("by thruster")]
    onset_s: Number
    onset_ci95_s: Interval | None
    torque_Nm: Vector | None
    torque_sigma_Nm: Vector | None
    leak_N: Number
    leak_sigma_N: Number
    loss: Annotated[Number, Doc("share of each pulse")]
    loss_sigma: Number
    smallest_detectable_Nm: Annotated[Number, Doc("of the worst thruster, at the age window_s")]
    smallest_detectable_N: Annotated[dict[str, Number] | None, Doc("by thruster")]
    detectable: list[DetectableRecord]
    window_s: Number
    false_alarms_per_hour: Number
    log_ratio_threshold: Number
    log_ratio_highest: Number
    error_monitor: ErrorMonitorRecord
    noise_Nms: Annotated[Vector, Doc("one sigma of an instant's momentum")]
    start_s: Number
    duration_s: Number
    samples: int
    settings: dict


@dataclass(frozen=True, kw_only=True, repr=False)
class LeakResult(Estimate, Diagnosis):
    """A leak or a weak thruster, or none.

    ``alarm_s``: when it was found, None without an alarm; ``alternative``: the thruster that momentum cannot tell from the one
    named.  ``smallest_detectable_N``: leak of each thruster found in nine of ten cases by the age ``window_s``, empty where the
    record is shorter; ``detectable_Nm``: its torque for the worst thruster, by age [s].  ``residual_Nms`` (N, 3): momentum
    beyond what orders gave, since the first instant, in the axes the body had then; ``statistic`` (N,): log likelihood ratio,
    its alarm beyond ``threshold``; ``noise_Nms`` (3,): one sigma of an instant's momentum, body axes."""

    RECORD: ClassVar[type] = LeakRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {"onset_95_s": "onset_ci95_s"}

    alarm_s: float | None
    alternative: str | None
    smallest_detectable_N: dict[str, float]
    detectable_Nm: dict[float, float]
    window_s: float
    false_alarms_per_hour: float
    threshold: float
    time_s: np.ndarray
    residual_Nms: np.ndarray
    statistic: np.ndarray
    noise_Nms: np.ndarray
    monitor: ErrorMonitor
    known: Known

    @property
    def alarm(self) -> bool:
        return self.alarm_s is not None

    @property
    def smallest_detectable_Nm(self) -> float | None:
        """Torque of the smallest leak found by the age ``window_s``, of the worst thruster."""
        return self.detectable_Nm.get(self.window_s)

    @property
    def duration_s(self) -> float:
        return float(self.time_s[-1] - self.time_s[0])

    def _record(self) -> dict:
        m = self.monitor
        return {
            "craft": self.craft, "epoch": self.epoch, "method": self.method,
            "alarm": self.alarm, "alarm_s": self.alarm_s, "kind": self.kind,
            "thruster": self.thruster, "alternative": self.alternative, "together": self.together, "posterior": self.posterior,
            "onset_s": self.onset_s, "onset_ci95_s": self.onset_ci95_s,
            "torque_Nm": self.torque_Nm, "torque_sigma_Nm": self.torque_sigma_Nm,
            "leak_N": self.leak_N, "leak_sigma_N": self.leak_sigma_N,
            "loss": self.loss, "loss_sigma": self.loss_sigma,
            "smallest_detectable_Nm": self.smallest_detectable_Nm,
            "smallest_detectable_N": self.smallest_detectable_N or None,
            "detectable": [{"window_s": w, "torque_Nm": v} for w, v in self.detectable_Nm.items()],
            "window_s": self.window_s, "false_alarms_per_hour": self.false_alarms_per_hour,
            "log_ratio_threshold": self.threshold, "log_ratio_highest": self.statistic.max(),
            "error_monitor": {
                "alarm": m.alarm is not None,
                "alarm_s": None if m.alarm is None else self.time_s[m.alarm],
                "thruster": m.thruster, "signs": m.signs or None,
                "threshold_Nms": m.threshold_Nms, "duration_s": m.duration_s,
            },
            "noise_Nms": self.noise_Nms, "start_s": self.time_s[0],
            "duration_s": self.duration_s, "samples": len(self.time_s),
            "settings": self.settings,
        }  # fmt: skip

    def series(self) -> Series:
        """Residual momentum, what of it was gained within the papers' duration, and the log likelihood ratio."""
        columns = {
            "residual_Nms": self.residual_Nms,
            "gained_Nms": self.monitor.gained_Nms,
            "log_likelihood_ratio": self.statistic,
        }
        return Series(self.time_s, columns)

    def verdict(self) -> str:
        """The alarm in a few words."""
        if self.alarm_s is None:
            return "no alarm"
        head, alternative = f"ALARM at {self.alarm_s:.0f} s:", f" (or {self.alternative})" if self.alternative else ""
        if self.method == "threshold":
            named = self.thruster or "no thruster has these signs"
            return f"{head} residual momentum {self.monitor.signs}: {named}{alternative}"
        one = f"{self.thruster} {'leaks' if self.kind == 'leak' else 'is weak'}{alternative}"
        if self.together:
            return f"{head} momentum as of several thrusters, {some_of(self.together)}; of one alone, {one}"
        return f"{head} {one}"

    def _tables(self) -> tuple[Table, ...]:
        noise = ", ".join(f"{1e3 * v:.3g}" for v in self.noise_Nms)
        m, by_papers = self.monitor, "no alarm"
        if m.alarm is not None:
            by_papers = (
                f"alarm at {self.time_s[m.alarm]:.0f} s, {m.signs}, {m.thruster or 'no thruster has these signs'}"
            )
        title = (
            f"Leak monitor · {self.craft} · {self.method} · epoch {self.epoch}\n"
            f"  {len(self.time_s)} instants over {self.duration_s:.0f} s from {self.time_s[0]:.0f} s on\n"
            f"  {self.verdict()}"
        )
        remarks = (
            f"log likelihood ratio: largest {self.statistic.max():.1f}, alarm beyond {self.threshold:.1f} "
            f"({self.false_alarms_per_hour:g} false alarms an hour)",
            f"papers' monitor, {m.threshold_Nms:.3g} N m s within {m.duration_s:.0f} s: {by_papers}",
            f"noise of an instant's momentum about {', '.join(AXES)}: {noise} mN m s",
            f"taken as known: {self.known}",
        )
        return (Table(title, self._change(), remarks=remarks), *self._by_thruster(), *self._by_age())

    def _change(self) -> tuple[tuple[str, ...], ...]:
        """Onset and size of the change."""
        rows: list[tuple[str, ...]] = []
        if self.onset_s is not None and self.onset_ci95_s is not None:
            rows.append(("onset", f"{self.onset_s:.0f} s", f"95 %: {interval(*self.onset_ci95_s, digits=6)} s"))
        if self.leak_N is not None:
            rows.append(("thrust", plus_minus(self.leak_N, self.leak_sigma_N, "N")))
        if self.torque_Nm is not None and self.torque_sigma_Nm is not None:
            factor, unit = scaled_unit(float(abs(self.torque_Nm).max()), "N m")
            for axis, v, s in zip(AXES, self.torque_Nm, self.torque_sigma_Nm, strict=True):
                rows.append((f"torque {axis}", f"{plus_minus(factor * v, factor * s)} {unit}"))
        if self.loss is not None and self.loss_sigma is not None:
            rows.append(("loss of each pulse", f"{plus_minus(100 * self.loss, 100 * self.loss_sigma)} %"))
        return tuple(rows)

    def _by_thruster(self) -> tuple[Table, ...]:
        names = tuple(self.posterior or self.smallest_detectable_N)
        if not names:
            return ()
        rows: list[tuple[str, ...]] = [(n,) for n in names]
        head: tuple[str, ...] = ("thruster",)
        if self.posterior is not None:
            head = (*head, "posterior")
            rows = [(*r, f"{self.posterior[r[0]]:.3f}") for r in rows]
        if self.smallest_detectable_N:
            factor, unit = scaled_unit(max(self.smallest_detectable_N.values()), "N")
            head = (*head, f"smallest leak found within {self.window_s:.0f} s [{unit}]")
            rows = [(*r, f"{factor * self.smallest_detectable_N[r[0]]:.3g}") for r in rows]
        return (Table("By thruster", tuple(rows), head),)

    def _by_age(self) -> tuple[Table, ...]:
        if not self.detectable_Nm:
            return ()
        factor, unit = scaled_unit(max(self.detectable_Nm.values()), "N m")
        rows = tuple((f"{w:.0f} s", f"{factor * v:.3g}") for w, v in self.detectable_Nm.items())
        head = ("within", f"torque [{unit}]")
        return (Table("Smallest leak found nine times in ten, of the worst thruster", rows, head),)
