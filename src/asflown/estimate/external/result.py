"""A steady external torque: what was found, how well it is known, and by what."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...kit.digits import plus_minus

AXES = "XYZ"
_RPM_PER_DAY = 86_400 * 60 / (2 * np.pi)


@dataclass(frozen=True)
class ExternalTorque:
    """A constant torque on the craft about its centre of mass, in the axes of ``frame``: body or inertial.

    ``sigma`` (3,) is random, ``systematic`` (3,) what assumed errors of spin inertia, inertia and gyros would shift;
    ``interval_95`` (3, 2) holds the random part.  None where the method gives none.  ``gained`` and ``fitted`` (N, 3):
    momentum gained since the first sample and its fit, in axes that do not turn and were the body's then, ``fitted_95``
    the half width of its 95 % band; ``used`` (N,): samples that counted.  All per unit spin inertia where ``relative``."""

    craft: str
    epoch: str
    method: str
    variant: str
    frame: str
    torque: np.ndarray
    momentum: np.ndarray  # (3,): mean, body axes
    time_s: np.ndarray
    gained: np.ndarray
    fitted: np.ndarray
    used: np.ndarray
    sigma: np.ndarray | None = None
    systematic: np.ndarray | None = None
    interval_95: np.ndarray | None = None
    fitted_95: np.ndarray | None = None
    gyroscopic: np.ndarray | None = None  # (3,): mean w x H, which is part of the torque; body axes
    turn_rad_s: np.ndarray | None = None  # (3,): mean body rate taken for it
    turn_from: str = ""
    wheel_drift_rad_s2: dict[str, float] = field(default_factory=dict)
    worth: float | None = None  # how many independent samples the used ones are worth
    relative: bool = False
    doubts: tuple[str, ...] = ()
    settings: dict = field(default_factory=dict)

    @property
    def duration_s(self) -> float:
        return float(self.time_s[-1] - self.time_s[0])

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
        in_torque = {
            "torque_Nm": self.torque, "sigma_Nm": self.sigma, "sigma_systematic_Nm": self.systematic,
            "interval_95_Nm": self.interval_95, "gyroscopic_Nm": self.gyroscopic, "momentum_Nms": self.momentum,
        }  # fmt: skip
        record = {
            "craft": self.craft,
            "epoch": self.epoch,
            "method": self.method,
            "variant": self.variant,
            "frame": self.frame,
            **in_torque,
            "turn_rad_s": self.turn_rad_s,
            "turn_from": self.turn_from,
            "wheel_drift_rpm_per_day": {n: _RPM_PER_DAY * v for n, v in self.wheel_drift_rad_s2.items()},
            "start_s": self.time_s[0],
            "duration_s": self.duration_s,
            "samples": len(self.time_s),
            "samples_used": int(self.used.sum()),
            "independent_samples": self.worth,
            "settings": self.settings,
            "doubts": list(self.doubts),
        }
        if self.relative:  # a number per unit spin inertia must not stand under a key that says N m
            for name, value in in_torque.items():
                unit = "_per_spin_inertia_rad_s" if name.endswith("_Nms") else "_per_spin_inertia_rad_s2"
                record[name.rsplit("_", 1)[0] + unit], record[name] = value, None
        return record

    def __str__(self) -> str:
        """The table a person scans."""
        unit, scale = ("rad/s^2, per unit spin inertia", 1.0) if self.relative else ("µN m", 1e6)
        lines = [
            f"External torque · {self.craft} · {self.method}, {self.variant} · {self.frame} axes · epoch {self.epoch}",
            f"  {self.duration_s:.0f} s from {self.time_s[0]:.0f} s on, {int(self.used.sum())} of {len(self.time_s)} samples · [{unit}]",
        ]
        for j, axis in enumerate(AXES):
            if self.sigma is None or self.interval_95 is None or self.systematic is None:
                lines.append(f"    {axis}  {scale * self.torque[j]:+.4g}")
                continue
            low, high = scale * self.interval_95[j]
            lines.append(
                f"    {axis}  {plus_minus(scale * self.torque[j], scale * self.sigma[j]):<22}  95 %: {low:.4g} to {high:.4g}   "
                f"systematic {scale * self.systematic[j]:.2g}"
            )
        if self.gyroscopic is not None and self.turn_rad_s is not None:
            w, g = self.turn_rad_s, scale * self.gyroscopic
            lines.append(f"  w x H in it  {_three(g)}; w {_three(w)} rad/s from {self.turn_from}")
        if self.wheel_drift_rad_s2:
            drifts = ", ".join(f"{n} {_RPM_PER_DAY * v:+.2f}" for n, v in self.wheel_drift_rad_s2.items())
            lines.append(f"  wheels drift {drifts} rpm/day")
        return "\n".join(lines)


def _three(values) -> str:
    return ", ".join(f"{v:+.3g}" for v in values)
