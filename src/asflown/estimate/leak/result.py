"""What the leak monitor says: whether, which thruster, since when, how much, and what it would not have seen."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ...kit.digits import plus_minus
from ...kit.errors import some_of

if TYPE_CHECKING:
    import numpy as np

    from .papers_monitor import ErrorMonitor


@dataclass(frozen=True)
class LeakResult:
    """A leak or a weak thruster, or none.  Times are seconds from the epoch; what has no value is None.

    ``kind``: 'leak', a thrust nobody ordered, or 'weak', pulses that give less than ordered.  ``posterior``: over the
    thrusters, both kinds together, given that one of them is at fault.  ``torque_Nm`` (3,): of the leak, free in its
    direction, body axes.  ``detectable_Nm``: smallest leak's torque found in nine of ten cases, by seconds since it
    began, of the worst thruster.  ``residual`` (N, 3): momentum beyond what orders gave, since the first instant, in the
    axes the body had then; ``statistic`` (N,): log likelihood ratio, its alarm beyond ``threshold``."""

    craft: str
    epoch: str
    method: str
    alarm: bool
    alarm_s: float | None
    kind: str | None
    thruster: str | None
    alternative: str | None
    posterior: dict[str, float] | None
    onset_s: float | None
    onset_95_s: tuple[float, float] | None
    torque_Nm: np.ndarray | None
    torque_sigma_Nm: np.ndarray | None
    leak_N: float | None
    leak_sigma_N: float | None
    loss: float | None
    loss_sigma: float | None
    smallest_detectable_Nm: float | None
    smallest_detectable_N: dict[str, float]
    detectable_Nm: dict[float, float]
    window_s: float
    false_alarms_per_hour: float
    threshold: float
    time_s: np.ndarray
    residual: np.ndarray
    statistic: np.ndarray
    noise_Nms: np.ndarray
    monitor: ErrorMonitor
    doubts: tuple[str, ...] = ()
    together: list[str] | None = None  # thrusters that make it between them, where no one alone would
    settings: dict = field(default_factory=dict)
    taken_as_known: str = ""

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
        m = self.monitor
        return {
            "craft": self.craft, "epoch": self.epoch, "method": self.method,
            "alarm": self.alarm, "alarm_s": self.alarm_s, "kind": self.kind,
            "thruster": self.thruster, "alternative": self.alternative, "together": self.together, "posterior": self.posterior,
            "onset_s": self.onset_s, "onset_95_s": self.onset_95_s,
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
            "duration_s": self.time_s[-1] - self.time_s[0], "samples": len(self.time_s),
            "settings": self.settings, "doubts": list(self.doubts),
        }  # fmt: skip

    def __str__(self) -> str:
        """The table a person scans."""
        noise = ", ".join(f"{1e3 * v:.2g}" for v in self.noise_Nms)
        lines = [
            f"Leak monitor · {self.craft} · {self.method} · epoch {self.epoch}",
            f"  {self.time_s[-1] - self.time_s[0]:.0f} s from {self.time_s[0]:.0f} s on, {len(self.time_s)} instants · noise of one "
            f"{noise} mN m s",
        ]
        lines += self._verdict()
        lines.append(
            f"  log likelihood ratio: highest {self.statistic.max():.1f}, alarm beyond {self.threshold:.1f} "
            f"({self.false_alarms_per_hour:g} false alarms an hour)"
        )
        if self.smallest_detectable_Nm is not None:
            by_window = ", ".join(f"{1e6 * v:.3g} in {w:.0f} s" for w, v in self.detectable_Nm.items())
            lines.append(
                f"  smallest leak found nine times in ten within {self.window_s:.0f} s: "
                f"{1e6 * self.smallest_detectable_Nm:.3g} µN m, {1e6 * max(self.smallest_detectable_N.values()):.3g} µN"
            )
            lines.append(f"    [µN m]  {by_window}")
        lines.append(f"  {self._monitor_text()}")
        lines.append(f"  taken as known: {self.taken_as_known}")
        return "\n".join(lines)

    def _verdict(self) -> list[str]:
        if not self.alarm or self.alarm_s is None:
            return ["  no alarm"]
        if self.method == "threshold":
            named = self.thruster or "no thruster has these signs"
            return [f"  ALARM  at {self.alarm_s:.0f} s: residual momentum {self.monitor.signs}: {named}{self._or()}"]
        what = "leaks" if self.kind == "leak" else "is weak"
        lines = [f"  ALARM  at {self.alarm_s:.0f} s: {self.thruster} {what}{self._or()}"]
        if self.together:
            lines = [
                f"  ALARM  at {self.alarm_s:.0f} s: momentum as of several thrusters, {some_of(self.together)}; of one alone, {self.thruster} "
                f"{what}{self._or()}"
            ]
        if self.kind == "leak" and self.torque_Nm is not None and self.torque_sigma_Nm is not None:
            torque = ", ".join(
                plus_minus(1e3 * v, 1e3 * s) for v, s in zip(self.torque_Nm, self.torque_sigma_Nm, strict=True)
            )
            lines.append(f"    thrust   {plus_minus(1e3 * (self.leak_N or 0), 1e3 * (self.leak_sigma_N or 0))} mN")
            lines.append(f"    torque   {torque} mN m")
        if self.kind == "weak":
            lines.append(
                f"    loss     {plus_minus(100 * (self.loss or 0), 100 * (self.loss_sigma or 0))} % of each pulse"
            )
        if self.onset_s is not None and self.onset_95_s is not None:
            a, b = self.onset_95_s
            lines.append(f"    began    at {self.onset_s:.0f} s (95 %: {a:.0f} to {b:.0f} s)")
        if self.posterior is not None:
            likely = sorted(self.posterior.items(), key=lambda p: -p[1])
            lines.append("    posterior  " + ", ".join(f"{n} {p:.3f}" for n, p in likely if p >= 5e-4))
        return lines

    def _or(self) -> str:
        return f" (or {self.alternative})" if self.alternative else ""

    def _monitor_text(self) -> str:
        m = self.monitor
        found = "no alarm"
        if m.alarm is not None:
            found = f"alarm at {self.time_s[m.alarm]:.0f} s, {m.signs}, {m.thruster or 'no thruster has these signs'}"
        return f"papers' monitor, {m.threshold_Nms:.3g} N m s within {m.duration_s:.0f} s: {found}"
