"""Thrust as flown: what was found for every thruster, how well it is known, and what cannot be told."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...kit.digits import plus_minus
from ...kit.result import Estimate, with_old_keys
from ...kit.schema import Annotated, Doc, Number, TypedDict, Vector
from ...kit.table import Table
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from .accelerometer import Burn

#: On-times that differ by no more than this share of their end are drawn as one.
_ALIKE = 0.02


class PairRecord(TypedDict):
    """Thrusters that fire together and their common thrust."""

    thrusters: list[str]
    thrust_N: Number
    thrust_sigma_N: Number


class RatioRecord(TypedDict):
    """The thrust of one thruster over the mean, in which all that thrusters share cancels."""

    ratio: Number
    ratio_sigma: Number


class BurnRecord(TypedDict, total=False):
    """Velocity gained in a burn; empty unless the method is accelerometer."""

    delta_v_m_s: Number
    delta_v_sigma_m_s: Number
    duration_s: Number
    bias_m_s2: Number
    bias_added_delta_v_m_s: Annotated[Number, Doc("with the sign of the bias as Feldman & Lee print it")]


class ThrustRecord(TypedDict):
    """JSON of `asflown thrust`.  Objects are by thruster unless they say otherwise."""

    craft: str
    epoch: str
    method: Annotated[str, Doc("joint, printed or accelerometer")]
    variant: Annotated[str, Doc("corrected or printed: the pulse formula whose R divides")]
    thrust_N: Annotated[dict[str, Number], Doc("null: did not fire, or cannot be separated")]
    thrust_sigma_N: dict[str, Number]
    mean_thrust_N: Annotated[
        Number, Doc("of those that fired, weighted by impulse; printed: one thrust for all, eq 23")
    ]
    mean_thrust_sigma_N: Number
    mean_thrust_sigma_parts_N: Annotated[dict[str, Number], Doc("by what is not known")]
    predicted_thrust_N: Annotated[Number, Doc("the craft's thrust history on the date of the first record")]
    pairs: list[PairRecord]
    pairs_N: Annotated[dict[str, dict[str, Number]], Doc("kept for this version; see pairs")]
    over_mean: dict[str, RatioRecord]
    unadjusted_N: Annotated[dict[str, Number], Doc("before R: without regard to delay, rise and fall")]
    fall_time_s: Number
    fall_time_sigma_s: Number
    center_of_mass_m: Vector | None
    center_of_mass_sigma_m: Vector | None
    pulse_ratio: Annotated[dict[str, Number], Doc("R of these pulses by formula: printed, corrected")]
    on_time_s: dict[str, Number]
    pulses: dict[str, Number]
    pulses_counted: bool
    delta_v: BurnRecord
    correlation: Annotated[dict[str, Number], Doc("of the mean thrust with fall_time and center_x, _y, _z")]
    misfit: Annotated[Number, Doc("chi square over its degrees of freedom")]
    priors: Annotated[dict, Doc("what was taken as known, value and sigma")]


@dataclass(frozen=True)
class EventSeen:
    """What one record shows, for figures; j thrusters.  Times count from the telemetry's epoch."""

    label: str
    wheel_time_s: np.ndarray  # (N,)
    wheel_rate_rad_s: dict[str, np.ndarray]
    counter_time_s: np.ndarray  # (M,)
    on_time_s: np.ndarray  # (M, j)
    time_s: np.ndarray  # (K,): ends of the momentum's steps
    gained_Nms: np.ndarray  # (K, 3): momentum since the first sample
    left_Nms: np.ndarray | None  # (K, 3): of that, what the fit does not explain

    def alike(self, names: tuple[str, ...]) -> list[tuple[list[str], np.ndarray]]:
        """Thrusters that fired, those whose on-times are the same throughout together, with their on-time (M,)."""
        groups: list[tuple[list[str], np.ndarray]] = []
        for name, on in zip(names, self.on_time_s.T, strict=True):
            if on[-1] <= 0:
                continue
            same = next((g for g in groups if np.allclose(g[1], on, atol=_ALIKE * on[-1])), None)
            if same is not None:
                same[0].append(name)
            else:
                groups.append(([name], on))
        return groups


@dataclass(frozen=True)
class Pair:
    """Thrusters that fire together, and their common thrust [N]; sigma None where the method has none."""

    thrusters: tuple[str, ...]
    thrust_N: float
    thrust_sigma_N: float | None = None

    @property
    def name(self) -> str:
        """'Y1+Y3'"""
        return "+".join(self.thrusters)


@dataclass(frozen=True, kw_only=True, repr=False)
class ThrustResult(Estimate):
    """Steady thrust of each thruster [N]; None where it did not fire or cannot be separated.

    ``mean_thrust_N``: of those that fired, weighted by their impulse (printed: one thrust for all, Feldman & Lee eq 23).
    ``over_mean``: each thrust over the mean, and its sigma.  ``center_of_mass_m``: in the axes of the thrusters' positions.
    ``pulse_ratio``: R of these pulses by the printed formula and by the corrected one.  ``correlation``: of the mean thrust
    with other parameters, and ``mean_thrust_sigma_parts_N`` the part of its sigma due to each of them.  ``unadjusted_N``:
    without regard to delay, rise and fall, by what was fitted (printed and accelerometer methods)."""

    RECORD: ClassVar[type] = ThrustRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {
        "sigma_N": "thrust_sigma_N",
        "mean_sigma_N": "mean_thrust_sigma_N",
        "mean_sigma_parts_N": "mean_thrust_sigma_parts_N",
    }

    names: tuple[str, ...]
    thrust_N: dict[str, float | None]
    thrust_sigma_N: dict[str, float | None]
    mean_thrust_N: float
    mean_thrust_sigma_N: float | None
    pulse_ratio: dict[str, float]
    on_time_s: dict[str, float]
    pulses: dict[str, float]
    pulses_counted: bool
    fall_time_s: float
    fall_time_sigma_s: float | None = None
    center_of_mass_m: tuple[float, float, float] | None = None
    center_of_mass_sigma_m: tuple[float, float, float] | None = None
    pairs: tuple[Pair, ...] = ()
    over_mean: dict[str, tuple[float, float]] = field(default_factory=dict)
    unadjusted_N: dict[str, float] = field(default_factory=dict)
    correlation: dict[str, float] = field(default_factory=dict)
    mean_thrust_sigma_parts_N: dict[str, float] = field(default_factory=dict)
    misfit: float | None = None
    predicted_thrust_N: float | None = None
    burn: Burn | None = None
    priors: dict = field(default_factory=dict)
    priors_told: str = ""
    events: tuple[EventSeen, ...] = ()

    def _record(self) -> dict:
        pairs = {
            p.name: {"thrusters": p.thrusters, "thrust_N": p.thrust_N, "thrust_sigma_N": p.thrust_sigma_N}
            for p in self.pairs
        }
        over_mean: dict[str, dict] = {n: {"ratio": v, "ratio_sigma": s} for n, (v, s) in self.over_mean.items()}
        burn = {} if self.burn is None else self.burn.record()
        for ratio in over_mean.values():
            with_old_keys(ratio, {"sigma": "ratio_sigma"})
        with_old_keys(burn, {"sigma_m_s": "delta_v_sigma_m_s"})
        return {
            "craft": self.craft,
            "epoch": self.epoch,
            "method": self.method,
            "variant": self.variant,
            "thrust_N": self.thrust_N,
            "thrust_sigma_N": self.thrust_sigma_N,
            "mean_thrust_N": self.mean_thrust_N,
            "mean_thrust_sigma_N": self.mean_thrust_sigma_N,
            "mean_thrust_sigma_parts_N": self.mean_thrust_sigma_parts_N,
            "predicted_thrust_N": self.predicted_thrust_N,
            "pairs": list(pairs.values()),
            "pairs_N": {n: {"thrust_N": p["thrust_N"], "sigma_N": p["thrust_sigma_N"]} for n, p in pairs.items()},
            "over_mean": over_mean,
            "unadjusted_N": self.unadjusted_N,
            "fall_time_s": self.fall_time_s,
            "fall_time_sigma_s": self.fall_time_sigma_s,
            "center_of_mass_m": self.center_of_mass_m,
            "center_of_mass_sigma_m": self.center_of_mass_sigma_m,
            "pulse_ratio": self.pulse_ratio,
            "on_time_s": self.on_time_s,
            "pulses": self.pulses,
            "pulses_counted": self.pulses_counted,
            "delta_v": burn,
            "correlation": self.correlation,
            "misfit": self.misfit,
            "priors": self.priors,
        }

    def _tables(self) -> tuple[Table, ...]:
        return self._thrusts(), self._rest()

    def _thrusts(self) -> Table:
        about = "" if self.pulses_counted else "about "
        rows: list[tuple[str, ...]] = []
        for n in self.names:
            value = self.thrust_N[n]
            if value is None:
                told = "not separated" if self.on_time_s[n] else "did not fire"
            else:
                told = plus_minus(value, self.thrust_sigma_N[n])
            rows.append((n, told, f"{self.on_time_s[n]:.3f}", f"{about}{self.pulses[n]:.0f}"))
        rows += [(p.name, plus_minus(p.thrust_N, p.thrust_sigma_N)) for p in self.pairs]
        rows.append(("mean", plus_minus(self.mean_thrust_N, self.mean_thrust_sigma_N)))
        if self.predicted_thrust_N is not None:
            rows.append(("predicted", f"{self.predicted_thrust_N:.4g}"))
        title = f"Thrust · {self.craft} · {self.method}, {self.variant} · epoch {self.epoch}"
        return Table(title, tuple(rows), ("thruster", "thrust [N]", "on-time [s]", "pulses"))

    def _rest(self) -> Table:
        """Further results, and the priors."""
        sigma = self.fall_time_sigma_s
        fall = plus_minus(1e3 * self.fall_time_s, None if sigma is None else 1e3 * sigma)
        rows = [("fall time [ms]", fall)]
        if self.center_of_mass_m is not None:
            sigmas = self.center_of_mass_sigma_m or (None,) * 3
            rows += [
                (f"centre of mass {a} [m]", plus_minus(x, s))
                for a, x, s in zip(AXES, self.center_of_mass_m, sigmas, strict=True)
            ]
        if self.burn is not None:
            b = self.burn
            rows += [
                ("velocity gained [mm/s]", plus_minus(1e3 * b.delta_v_m_s(), 1e3 * b.delta_v_sigma_m_s)),
                ("  with the bias added, as printed", f"{1e3 * b.delta_v_m_s(+1.0):.4g}"),
                ("accelerometer bias [mm/s2]", plus_minus(1e3 * b.bias_m_s2, 1e3 * b.bias_sigma_m_s2)),
                ("burn [s]", f"{b.duration_s:.4g}"),
            ]
        rows += [(f"R, {n}", f"{v:.4f}") for n, v in self.pulse_ratio.items()]
        rows += [(f"before R, {n} [N]", f"{v:.4g}") for n, v in self.unadjusted_N.items()]
        rows += [
            (f"sigma of the mean due to {n} [mN]", f"{1e3 * v:.2g}") for n, v in self.mean_thrust_sigma_parts_N.items()
        ]
        rows += [(f"correlation of the mean with {n}", f"{v:+.4f}") for n, v in self.correlation.items()]
        taken = (f"taken beforehand: {self.priors_told}",) if self.priors_told else ()
        return Table("Fall time, centre of mass, and parts of the sigma", tuple(rows), (), taken)
