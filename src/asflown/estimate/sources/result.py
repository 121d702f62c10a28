"""The sources of a torque: what was found of each, what it contributes over time, and what is left."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...kit.digits import plus_minus, scaled_unit
from ...kit.result import Estimate, Series, per_spin_inertia
from ...kit.schema import Annotated, Doc, Intervals, NotRequired, Number, Numbers, Rows, TypedDict, Vector
from ...kit.table import Table

if TYPE_CHECKING:
    from .compare import Model
    from .residual import Residual

_UNTOLD = "a component that the arc does not tell is null, and its interval is what was open before"


class ModelRecord(TypedDict):
    sources: list[str]
    bic_above_best: Number
    held_back_below_best: Annotated[Number, Doc("how much less likely the set makes stretches held back, log odds")]


class InertiaSeenRecord(TypedDict):
    """Corrections of the tensor's elements, in their own order."""

    names: list[str]
    value_kgm2: Numbers
    ci95_kgm2: Intervals


class SwingRecord(TypedDict):
    amplitude: Annotated[Number, Doc("of the density over the orbit, as a share of its mean")]
    amplitude_sigma: Number
    phase_rad: Annotated[Number, Doc("where it is largest: angle gone round the orbit from the first sample")]


class SpectrumRecord(TypedDict):
    frequency_Hz: Numbers
    density_Nm2_per_Hz: Annotated[Rows, Doc("M x 3")]


class SourcesRecord(TypedDict):
    """JSON of `asflown sources`; null where a source is not fitted.  Body axes.

    Where the wheels' spin inertia is unknown the keys in N m are null, their siblings per unit spin inertia hold the values, and
    ``contributions`` are per unit spin inertia."""

    craft: str
    epoch: str
    method: str
    dipole_Am2: Annotated[Vector | None, Doc(f"residual dipole; {_UNTOLD}")]
    dipole_ci95_Am2: Annotated[Intervals | None, Doc("three [low, high]")]
    sunlight_lever_Nm: Annotated[Vector | None, Doc("torque = lit (lever x s), s the unit vector to the Sun")]
    sunlight_lever_ci95_Nm: Annotated[Intervals | None, Doc("three [low, high]")]
    drag_lever_Nm: Annotated[Vector | None, Doc("torque = rho / rho_0 lever x (-v/|v|)")]
    drag_lever_ci95_Nm: Annotated[Intervals | None, Doc("three [low, high]")]
    constant_Nm: Annotated[Vector | None, Doc("constant torque in body axes")]
    constant_ci95_Nm: Annotated[Intervals | None, Doc("three [low, high]")]
    constant_probability: Annotated[
        Number | None, Doc("that a constant torque is more than next to none; null where it was asked for or left out")
    ]
    inertia_correction: Annotated[
        InertiaSeenRecord | None, Doc("of the craft file's, as gravity gradient and turn see it")
    ]
    density_swing: SwingRecord | None
    correlations: Annotated[dict[str, dict[str, Number]], Doc("between all unknowns, such as 'dipole x'")]
    untold: Annotated[list[str], Doc("sentences: what this arc cannot tell")]
    models: Annotated[list[ModelRecord], Doc("every set of sources, the best BIC first")]
    time_s: Numbers
    contributions: Annotated[dict[str, Rows], Doc("torque of each source at time_s, N x 3 [N m]; known ones too")]
    torque_Nm: Annotated[Rows, Doc("N x 3: the sum of the contributions and of the residual")]
    lit: Annotated[Numbers | None, Doc("share of the Sun that is seen")]
    residual_rms_Nm: Annotated[
        Number, Doc("root of the mean square of the residual torque, of the three axes together")
    ]
    residual_noise_rms_Nm: Annotated[Number, Doc("what the readings' noise alone makes of it")]
    residual_time_s: Numbers
    residual_Nm: Annotated[Rows, Doc("mean residual torque over windows, W x 3")]
    residual_spectrum: SpectrumRecord
    where_from: Annotated[dict[str, str], Doc("what each term's vectors are from")]
    left_out: Annotated[dict[str, str], Doc("sources not looked for, and what they need")]
    settings: dict
    sunlight_lever_per_spin_inertia_rad_s2: NotRequired[Vector | None]
    sunlight_lever_ci95_per_spin_inertia_rad_s2: NotRequired[Intervals | None]
    drag_lever_per_spin_inertia_rad_s2: NotRequired[Vector | None]
    drag_lever_ci95_per_spin_inertia_rad_s2: NotRequired[Intervals | None]
    constant_per_spin_inertia_rad_s2: NotRequired[Vector | None]
    constant_ci95_per_spin_inertia_rad_s2: NotRequired[Intervals | None]
    torque_per_spin_inertia_rad_s2: NotRequired[Rows]
    residual_rms_per_spin_inertia_rad_s2: NotRequired[Number]
    residual_noise_rms_per_spin_inertia_rad_s2: NotRequired[Number]
    residual_per_spin_inertia_rad_s2: NotRequired[Rows]


@dataclass(frozen=True)
class Fitted:
    """One source's constants: value (p,), sigma (p,), 95 % interval (p, 2), and whether the arc tells each (p,)."""

    names: tuple[str, ...]
    unit: str
    value: np.ndarray
    sigma: np.ndarray
    ci95: np.ndarray
    told: np.ndarray

    @property
    def stated(self) -> np.ndarray:
        """The value, unknown (NaN) where the arc does not tell it."""
        return np.where(self.told, self.value, np.nan)


@dataclass(frozen=True, kw_only=True, repr=False)
class SourcesResult(Estimate):
    """Sources of the torque on a craft, body axes.

    ``found`` {name: Fitted}; ``inertia``: corrections of the craft's tensor; ``time_s`` (N,): from the epoch; ``contributions``
    {name: (N, 3)} [N m]; ``lit``, ``phase_rad`` (N,) or None; ``size_Nm``: rms of the torque that is seen; ``untold``: sentences; ``constant_chance``: that
    a constant torque is more than next to none, None where it was asked for or left out.
    All torques per unit spin inertia where ``relative``."""

    RECORD: ClassVar[type] = SourcesRecord

    found: dict[str, Fitted]
    inertia: Fitted | None
    swing: dict[str, float] | None
    correlations: dict[str, dict[str, float]]
    time_s: np.ndarray
    contributions: dict[str, np.ndarray]
    lit: np.ndarray | None
    phase_rad: np.ndarray | None
    residual: Residual
    size_Nm: float
    untold: tuple[str, ...]
    models: tuple[Model, ...]
    constant_chance: float | None = None
    relative: bool = False
    where_from: dict[str, str] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)

    @property
    def explained_Nm(self) -> np.ndarray:
        """The sum of all contributions, (N, 3)."""
        return np.sum(list(self.contributions.values()), axis=0)

    @property
    def torque_Nm(self) -> np.ndarray:
        """The torque estimated: what is explained and the residual between its windows, (N, 3)."""
        t = self.time_s - self.time_s[0]
        r = self.residual
        left = [np.interp(t, r.time_s, column) for column in r.torque_Nm.T]
        return self.explained_Nm + np.stack(left, axis=1)

    @property
    def residual_rms_Nm(self) -> float:
        """Of the three axes together."""
        return float(np.linalg.norm(self.residual.rms_Nm))

    def _record(self) -> dict:
        in_torque: dict = {}
        for name, key in (("sunlight", "sunlight_lever"), ("drag", "drag_lever"), ("constant", "constant")):
            of = self.found.get(name)
            in_torque |= {
                f"{key}_Nm": None if of is None else of.stated,
                f"{key}_ci95_Nm": None if of is None else of.ci95,
            }
        dipole = None if self.relative else self.found.get("dipole")
        r = self.residual
        rest = {
            "torque_Nm": self.torque_Nm, "residual_rms_Nm": self.residual_rms_Nm,
            "residual_noise_rms_Nm": float(np.linalg.norm(r.noise_Nm)), "residual_Nm": r.torque_Nm,
        }  # fmt: skip
        record = {
            "craft": self.craft,
            "epoch": self.epoch,
            "method": self.method,
            "dipole_Am2": None if dipole is None else dipole.stated,
            "dipole_ci95_Am2": None if dipole is None else dipole.ci95,
            **in_torque,
            "constant_probability": self.constant_chance,
            "inertia_correction": self._inertia(),
            "density_swing": self.swing,
            "correlations": self.correlations,
            "untold": list(self.untold),
            "models": [
                {
                    "sources": list(m.sources),
                    "bic_above_best": m.bic_above_best,
                    "held_back_below_best": m.held_back_below_best,
                }
                for m in self.models
            ],
            "time_s": self.time_s,
            "contributions": self.contributions,
            "lit": self.lit,
            **rest,
            "residual_time_s": self.time_s[0] + r.time_s,
            "residual_spectrum": {"frequency_Hz": r.frequency_Hz, "density_Nm2_per_Hz": r.spectrum_Nm2_Hz},
            "where_from": self.where_from,
            "left_out": self.left_out,
            "settings": self.settings,
        }
        if self.relative:
            per_spin_inertia(record, [*in_torque, *rest])
        return record

    def _inertia(self) -> dict | None:
        if self.inertia is None or self.relative:
            return None
        return {"names": list(self.inertia.names), "value_kgm2": self.inertia.value, "ci95_kgm2": self.inertia.ci95}

    def series(self) -> Series:
        """Contributions, the estimated torque, and the lit share."""
        columns = {f"{n.replace('-', '_')}_Nm": v for n, v in self.contributions.items()}
        lit = {} if self.lit is None else {"lit": self.lit}
        return Series(self.time_s, {"torque_Nm": self.torque_Nm, **columns, **lit})

    def _tables(self) -> tuple[Table, ...]:
        span = f"{self.time_s[-1] - self.time_s[0]:.0f} s from {self.time_s[0]:.0f} s on"
        if self.phase_rad is not None:
            span += f", {self.phase_rad[-1] / (2 * np.pi):.2f} orbits"
        title = f"Sources of the torque · {self.craft} · epoch {self.epoch}\n  {span}"
        return Table(
            title, self._rows(), ("source", "", "value", "95 % interval", "rms torque"), self._remarks()
        ), self._models()

    def _rows(self) -> tuple[tuple[str, ...], ...]:
        rows = []
        torque_unit = "rad/s2 per unit spin inertia" if self.relative else "N m"
        for name, of in self.found.items():
            unit = torque_unit if of.unit == "N m" else of.unit
            factor, label = scaled_unit(float(np.abs(of.stated[of.told]).max(initial=0.0)), unit)
            rms = self._rms(name)
            for k, axis in enumerate(of.names):
                low, high = factor * of.ci95[k]
                told = f"{plus_minus(factor * of.value[k], factor * of.sigma[k])} {label}" if of.told[k] else "untold"
                rows.append((name if k == 0 else "", axis, told, f"{low:.3g} to {high:.3g}", rms if k == 0 else ""))
        rows += [(n, "", "known", "", self._rms(n)) for n in self.contributions if n not in self.found]
        return tuple(rows)

    def _rms(self, name: str) -> str:
        size = float(np.sqrt(np.mean(np.sum(self.contributions[name] ** 2, axis=1))))
        factor, label = scaled_unit(size, "rad/s2" if self.relative else "N m")
        return f"{factor * size:.3g} {label}"

    def _remarks(self) -> tuple[str, ...]:
        unit = "rad/s2" if self.relative else "N m"
        left, noise = self.residual_rms_Nm, float(np.linalg.norm(self.residual.noise_Nm))
        factor, label = scaled_unit(left, unit)
        window = float(np.median(np.diff(self.residual.time_s)))
        remarks = [
            f"residual torque {factor * left:.3g} {label} rms over {window:.0f} s, of which noise {factor * noise:.3g} {label}"
        ]
        if self.swing is not None:
            remarks.append(
                f"density swings by {100 * self.swing['amplitude']:.0f} ± {100 * self.swing['amplitude_sigma']:.0f} % over the orbit"
            )
        if self.constant_chance is not None:
            remarks.append(f"a constant torque acts with a probability of {100 * self.constant_chance:.0f} %")
        remarks += [f"{n}: {w}" for n, w in self.where_from.items()]
        return (*remarks, *self.untold)

    def _models(self) -> Table:
        rows = tuple(
            (", ".join(m.sources) or "none", f"{m.bic_above_best:.1f}", f"{m.held_back_below_best:.1f}")
            for m in self.models[:5]
        )
        return Table("Sets of sources, the best first", rows, ("sources", "BIC above", "held back, log odds below"))
