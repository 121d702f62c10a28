"""An inertia tensor as flown: values, random and systematic uncertainty apart, and what there is to doubt."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.rigid_body import ELEMENTS, elements_of
from ...kit.digits import plus_minus

if TYPE_CHECKING:
    from .excitation import Excitation
    from .prediction import InertiaComparison
    from .slews import Slew

_ORDER = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True)
class Evidence:
    """What the pictures show, at the wheels' instants (N,), seconds from the epoch.

    ``residual_Nms``: momentum of wheels and body less what the fit says of it, inertial axes (body axes where there
    is no attitude); per unit spin inertia where the result is."""

    time_s: np.ndarray
    omega_rad_s: np.ndarray  # (N, 3)
    wheels_Nms: np.ndarray  # (N, 3), body axes
    residual_Nms: np.ndarray  # (N, 3)
    used: np.ndarray  # (N,) bool


@dataclass(frozen=True)
class InertiaResult:
    """The tensor about the craft's own centre of mass, body axes, wheels counted as if they did not spin.

    Where ``relative`` is set the wheels' spin inertia is unknown, and tensor, torque and momentum are per unit of it.
    Elements that nothing tells are NaN.  ``sigma_systematic`` is that of the scale errors considered, (3, 3) like the rest."""

    craft: str
    method: str
    epoch: str
    inertia: np.ndarray
    sigma_random: np.ndarray
    sigma_systematic: np.ndarray
    excitation: Excitation
    torque: np.ndarray  # (3,)
    torque_sigma: np.ndarray
    frame: str  # of the torque: body or inertial
    slews: tuple[Slew, ...]
    evidence: Evidence
    comparison: InertiaComparison | None = None
    doubts: tuple[str, ...] = ()
    relative: bool = False
    products: dict[str, tuple[float, float]] = field(default_factory=dict)  # both estimates of each, axis by axis
    settings: dict = field(default_factory=dict)  # noise levels, time offsets, biases: what was fitted besides

    @property
    def sigma_total(self) -> np.ndarray:
        return np.hypot(self.sigma_random, self.sigma_systematic)

    @property
    def residual_rms(self) -> float:
        """Of all components, N m s (or per unit spin inertia)."""
        return float(np.sqrt(np.nanmean(self.evidence.residual_Nms[self.evidence.used] ** 2)))

    def record(self) -> dict:
        """The JSON form, without command and provenance."""
        measured = {
            "inertia_kgm2": self.inertia,
            "sigma_random_kgm2": self.sigma_random,
            "sigma_systematic_kgm2": self.sigma_systematic,
            "sigma_total_kgm2": self.sigma_total,
            "external_torque_Nm": self.torque,
            "external_torque_sigma_Nm": self.torque_sigma,
            "residual_rms_Nms": self.residual_rms,
        }
        if self.relative:
            # a number per unit spin inertia must not stand under a key that says kg m2 or N m
            names = {"_kgm2": "_per_spin_inertia", "_Nms": "_per_spin_inertia_rad_s", "_Nm": "_per_spin_inertia_rad_s2"}
            moved = {}
            for key, value in measured.items():
                end = next(e for e in names if key.endswith(e))
                moved[key.removesuffix(end) + names[end]] = value
            measured = dict.fromkeys(measured) | moved
        return {
            "craft": self.craft,
            "epoch": self.epoch,
            "method": self.method,
            **measured,
            "rank": self.excitation.rank,
            "singular_values": self.excitation.singular_values,
            "told": list(self.excitation.told),
            "untold": list(self.excitation.untold),
            "external_torque_frame": self.frame,
            "slews": [s.record() for s in self.slews],
            "products_kgm2": {k: list(v) for k, v in self.products.items()},
            "comparison": None if self.comparison is None else self.comparison.record(),
            "settings": self.settings,
            "doubts": list(self.doubts),
        }

    def __str__(self) -> str:
        """The table a person scans."""
        unit = "of a wheel's spin inertia" if self.relative else "kg m2"
        lines = [
            f"Inertia tensor · {self.craft} · {self.method} · epoch {self.epoch}",
            f"  in units {unit}" if self.relative else f"  in {unit}",
        ]
        values, random, systematic = (
            dict(zip(ELEMENTS, elements_of(v), strict=True))
            for v in (self.inertia, self.sigma_random, self.sigma_systematic)
        )
        for name in _ORDER:
            if not np.isfinite(values[name]):
                lines.append(f"    {name}   not told")
                continue
            lines.append(
                f"    {name}  {plus_minus(values[name], random[name]):>22s} random  +- {systematic[name]:.3g} systematic"
            )
        for name, (one, other) in self.products.items():
            lines.append(f"    {name} from both its slews: {one:.1f} and {other:.1f}, {one - other:+.1f} apart")
        told = f"  slews    {len(self.slews)}; rank {self.excitation.rank} of 6"
        lines.append(told + (f", not told: {', '.join(self.excitation.untold)}" if self.excitation.untold else ""))
        if np.isfinite(self.torque).all():
            scale, of = (1.0, "rad/s^2 per unit spin inertia") if self.relative else (1e6, "µN m")
            if not self.relative and np.abs(self.torque_sigma).max() > 1e-3:
                scale, of = 1.0, "N m"
            each = "  ".join(
                f"{a} {plus_minus(scale * t, scale * s)}"
                for a, t, s in zip("xyz", self.torque, self.torque_sigma, strict=True)
            )
            lines.append(f"  torque   {each}  {of}, {self.frame} axes")
        scale, unit = (1.0, "rad/s per unit spin inertia") if self.relative else (1e3, "mN m s")
        if not self.relative and self.residual_rms > 1:
            scale, unit = 1.0, "N m s"
        lines.append(f"  residual {scale * self.residual_rms:.3g} {unit} rms")
        if self.comparison is not None:
            lines.append(str(self.comparison))
        return "\n".join(lines)
