"""A steady external torque: what was found, how well it is known, and by what."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from ...kit.digits import interval, plus_minus, scaled_unit
from ...kit.result import Estimate, Series, per_spin_inertia
from ...kit.schema import Annotated, Doc, Intervals, NotRequired, Number, TypedDict, Vector
from ...kit.table import Table
from ...telemetry.channels import AXES

_RPM_PER_DAY = 86_400 * 60 / (2 * np.pi)


class ExternalTorqueRecord(TypedDict):
    """JSON of `asflown external-torque`.  Where the wheels' spin inertia is unknown the keys in N m and N m s are null and
    their siblings per unit spin inertia hold the values."""

    craft: str
    epoch: str
    method: Annotated[str, Doc("drift or momentum")]
    variant: Annotated[str, Doc("corrected or printed")]
    frame: Annotated[str, Doc("axes in which the torque is constant: body or inertial")]
    torque_Nm: Vector | None
    torque_sigma_Nm: Annotated[Vector | None, Doc("random part; null for the printed variant")]
    torque_sigma_systematic_Nm: Annotated[Vector | None, Doc("what assumed errors of known quantities would shift")]
    torque_ci95_Nm: Annotated[Intervals | None, Doc("three [low, high], random part")]
    gyroscopic_Nm: Annotated[Vector | None, Doc("mean w x H, which is part of the torque (corrected drift only)")]
    momentum_Nms: Annotated[Vector | None, Doc("mean, body axes")]
    turn_rad_s: Annotated[Vector | None, Doc("mean body rate used for w x H")]
    turn_from: str
    wheel_drift_rpm_per_day: dict[str, Number]
    start_s: Number
    duration_s: Number
    known: Annotated[dict[str, str], Doc("torques that were taken off, and where their vectors are from")]
    samples: int
    samples_used: int
    independent_samples: Annotated[Number, Doc("effective sample size of the residuals")]
    settings: dict
    torque_per_spin_inertia_rad_s2: NotRequired[Vector]
    torque_sigma_per_spin_inertia_rad_s2: NotRequired[Vector | None]
    torque_sigma_systematic_per_spin_inertia_rad_s2: NotRequired[Vector | None]
    torque_ci95_per_spin_inertia_rad_s2: NotRequired[Intervals | None]
    gyroscopic_per_spin_inertia_rad_s2: NotRequired[Vector | None]
    momentum_per_spin_inertia_rad_s: NotRequired[Vector]


@dataclass(frozen=True, kw_only=True, repr=False)
class ExternalTorqueResult(Estimate):
    """A constant torque on the craft about its centre of mass, in the axes of ``frame``: body or inertial.

    ``torque_sigma_Nm`` (3,) is random, ``torque_systematic_Nm`` (3,) what assumed errors of spin inertia, inertia and gyros
    would shift; ``torque_ci95_Nm`` (3, 2) holds the random part.  None where the method gives none.  ``gained_Nms`` and
    ``fitted_Nms`` (N, 3): momentum gained since the first sample and its fit, in axes that do not turn and were the body's
    then, ``fitted_ci95_Nms`` the half width of its 95 % band; ``used`` (N,): samples that counted.  All per unit spin
    inertia where ``relative``."""

    RECORD: ClassVar[type] = ExternalTorqueRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {
        "sigma_Nm": "torque_sigma_Nm",
        "sigma_systematic_Nm": "torque_sigma_systematic_Nm",
        "interval_95_Nm": "torque_ci95_Nm",
        "sigma_per_spin_inertia_rad_s2": "torque_sigma_per_spin_inertia_rad_s2",
        "sigma_systematic_per_spin_inertia_rad_s2": "torque_sigma_systematic_per_spin_inertia_rad_s2",
        "interval_95_per_spin_inertia_rad_s2": "torque_ci95_per_spin_inertia_rad_s2",
    }

    frame: str
    torque_Nm: np.ndarray
    momentum_Nms: np.ndarray  # (3,): mean, body axes
    time_s: np.ndarray
    gained_Nms: np.ndarray
    fitted_Nms: np.ndarray
    used: np.ndarray
    torque_sigma_Nm: np.ndarray | None = None
    torque_systematic_Nm: np.ndarray | None = None
    torque_ci95_Nm: np.ndarray | None = None
    fitted_ci95_Nms: np.ndarray | None = None
    gyroscopic_Nm: np.ndarray | None = None  # (3,): mean w x H, which is part of the torque; body axes
    turn_rad_s: np.ndarray | None = None  # (3,): mean body rate taken for it
    turn_from: str = ""
    wheel_drift_rad_s2: dict[str, float] = field(default_factory=dict)
    effective_samples: float | None = None  # how many independent samples the used ones amount to
    relative: bool = False
    known: dict[str, str] = field(default_factory=dict)  # torques taken off, and where their vectors are from

    @property
    def duration_s(self) -> float:
        return float(self.time_s[-1] - self.time_s[0])

    def _record(self) -> dict:
        in_torque = {
            "torque_Nm": self.torque_Nm, "torque_sigma_Nm": self.torque_sigma_Nm,
            "torque_sigma_systematic_Nm": self.torque_systematic_Nm, "torque_ci95_Nm": self.torque_ci95_Nm,
            "gyroscopic_Nm": self.gyroscopic_Nm, "momentum_Nms": self.momentum_Nms,
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
            "known": self.known,
            "samples": len(self.time_s),
            "samples_used": int(self.used.sum()),
            "independent_samples": self.effective_samples,
            "settings": self.settings,
        }
        if self.relative:
            per_spin_inertia(record, in_torque)
        return record

    def series(self) -> Series:
        """Momentum gained, its fit, and which samples counted."""
        return Series(self.time_s, {"gained_Nms": self.gained_Nms, "fitted_Nms": self.fitted_Nms, "used": self.used})

    def _tables(self) -> tuple[Table, ...]:
        factor, unit = (1.0, "rad/s^2, per unit spin inertia")
        if not self.relative:
            sigma = np.zeros(3) if self.torque_sigma_Nm is None else self.torque_sigma_Nm
            factor, unit = scaled_unit(float(max(np.abs(self.torque_Nm).max(), sigma.max())), "N m")
        rows: list[tuple[str, ...]] = []
        for j, axis in enumerate(AXES):
            if self.torque_sigma_Nm is None or self.torque_ci95_Nm is None or self.torque_systematic_Nm is None:
                rows.append((axis, f"{factor * self.torque_Nm[j]:+.4g}"))
                continue
            rows.append(
                (
                    axis,
                    plus_minus(factor * self.torque_Nm[j], factor * self.torque_sigma_Nm[j]),
                    interval(*(factor * self.torque_ci95_Nm[j]), digits=4),
                    f"{factor * self.torque_systematic_Nm[j]:.2g}",
                )
            )
        remarks = []
        if self.gyroscopic_Nm is not None and self.turn_rad_s is not None and np.any(self.turn_rad_s):
            g = factor * self.gyroscopic_Nm
            remarks.append(f"w x H is included: {_three(g)}; w = {_three(self.turn_rad_s)} rad/s from {self.turn_from}")
        if self.wheel_drift_rad_s2:
            drifts = ", ".join(f"{n} {_RPM_PER_DAY * v:+.2f}" for n, v in self.wheel_drift_rad_s2.items())
            remarks.append(f"wheel drift: {drifts} rpm/day")
        used = f"{int(self.used.sum())} of {len(self.time_s)} samples over {self.duration_s:.0f} s from {self.time_s[0]:.0f} s on"
        title = f"External torque · {self.craft} · {self.method}, {self.variant} · {self.frame} axes · epoch {self.epoch}\n  {used}"
        head = (
            "axis",
            f"torque [{unit}]",
            *(("95 % interval", "systematic") if self.torque_sigma_Nm is not None else ()),
        )
        return (Table(title, tuple(rows), head, tuple(remarks)),)


def _three(values: np.ndarray) -> str:
    return ", ".join(f"{v:+.3g}" for v in values)
