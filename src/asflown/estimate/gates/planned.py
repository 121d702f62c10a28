"""What burns yet to be flown will be off by, as a Gates model says."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from ...maneuvers.history import PastModel
from .foreseen import foresee

if TYPE_CHECKING:
    from ...maneuvers.plan import Plan
    from .result import GatesFit

_CONFIDENCE = 0.95


@dataclass(frozen=True)
class PlannedError:
    """Of one burn, in TVC axes X, Y, Z (Z along the dV); inertial covariance where the plan has directions."""

    id: str
    dv_mps: float
    mean_mps: np.ndarray  # (3,)
    covariance: np.ndarray  # (3, 3) [m2/s2]
    covariance_N: np.ndarray | None

    @property
    def sigma_magnitude_mps(self) -> float:
        return float(np.sqrt(self.covariance[2, 2]))

    @property
    def sigma_pointing_mps(self) -> tuple[float, float]:
        x, y = np.sqrt(np.diag(self.covariance)[:2])
        return float(x), float(y)

    @property
    def ellipsoid_mps(self) -> np.ndarray:
        """Semi-axes (3,) of the ellipsoid that holds 95 of 100 errors, along TVC X, Y, Z."""
        return np.sqrt(stats.chi2.ppf(_CONFIDENCE, 3) * np.diag(self.covariance))

    def samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Errors drawn, (count, 3), TVC."""
        return self.mean_mps + np.sqrt(np.diag(self.covariance)) * rng.standard_normal((count, 3))

    def record(self) -> dict:
        return {
            "id": self.id, "dv_mps": self.dv_mps, "mean_mps": self.mean_mps, "sigma_magnitude_mps": self.sigma_magnitude_mps,
            "sigma_pointing_mps": list(self.sigma_pointing_mps), "sigma_pointing_rad": [s / self.dv_mps for s in self.sigma_pointing_mps],
            "covariance_tvc_m2_s2": self.covariance, "ellipsoid95_tvc_mps": self.ellipsoid_mps,
            "covariance_inertial_m2_s2": self.covariance_N,
        }  # fmt: skip


@dataclass(frozen=True)
class Prediction:
    """Errors to be expected of planned burns."""

    model: str
    burns: tuple[PlannedError, ...]
    doubts: tuple[str, ...] = field(default=())

    def record(self) -> dict:
        return {"model": self.model, "burns": [b.record() for b in self.burns], "doubts": list(self.doubts)}

    def __str__(self) -> str:
        lines = [
            f"Execution errors to be expected · {self.model}",
            f"  {'':16s} {'dV m/s':>8s}  {'magnitude mm/s':>18s}  {'X mm/s':>18s}  {'Y mm/s':>18s}  {'pointing mrad':>13s}",
        ]
        for b in self.burns:
            columns = [
                f"{1e3 * b.mean_mps[j]:+.2f} +- {1e3 * s:.2f}"
                for j, s in ((2, b.sigma_magnitude_mps), *enumerate(b.sigma_pointing_mps))
            ]
            across = 1e3 * max(b.sigma_pointing_mps) / b.dv_mps
            lines.append(
                f"  {b.id:16s} {b.dv_mps:8.3g}  {columns[0]:>18s}  {columns[1]:>18s}  {columns[2]:>18s}  {across:13.2f}"
            )
        return "\n".join(lines)


def predict(plan: Plan, source: GatesFit | PastModel) -> Prediction:
    """Errors of planned burns, by a fit or by a model of the history.

    A fit's covariance holds what its biases are uncertain by.  Means are zero, biases being removed, but for a fit that is
    mean-aware, and for a model of the history whose magnitude bias was left."""
    if isinstance(source, PastModel):
        gates, low, high, name, doubts = (
            source.left,
            0.0,
            source.model.valid_to_mps,
            source.model.name,
            list(source.doubts),
        )
        doubts.append("pointing is read about zero, as the model was used: its biases are in the sigmas or nowhere")
    else:
        gates, name, doubts = source.gates, source.gates.name, list(source.doubts)
        low, high = float(source.maneuvers.dv_mps.min()), float(source.maneuvers.dv_mps.max())
    out = [i for i, v in zip(plan.id, plan.dv_mps, strict=True) if v < low or (high is not None and v > high)]
    if out:
        doubts.append(
            f"outside the sizes the model was made for ({low:.3g} to {high:.3g} m/s): {', '.join(out[:8])}"
            + (" and more" if len(out) > 8 else "")
        )
    burns = []
    for k, (i, v) in enumerate(zip(plan.id, plan.dv_mps.tolist(), strict=True)):
        if isinstance(source, PastModel):
            mean, covariance = np.array([0.0, 0.0, float(gates.mean_magnitude(v))]), gates.covariance(v)
        else:
            mean, covariance = _of_fit(source, v)
        turned = None if plan.axes is None else plan.axes[k].T @ covariance @ plan.axes[k]
        burns.append(PlannedError(i, v, mean, covariance, turned))
    return Prediction(name, tuple(burns), tuple(doubts))


def _of_fit(fit: GatesFit, v: float) -> tuple[np.ndarray, np.ndarray]:
    mean, covariance = np.full(3, np.nan), np.full((3, 3), np.nan)
    for part in fit.parts:
        if part.known:
            at = slice(2, 3) if part.name == "magnitude" else slice(0, 2)
            c = 1 if part.name == "magnitude" else 2
            told = foresee(part.problem, part.point, v, np.zeros((c, c)))
            mean[at], covariance[at, at] = (told.mean if fit.model == "mean-aware" else 0.0), told.covariance
    covariance[2, :2] = covariance[:2, 2] = 0.0
    return mean, covariance
