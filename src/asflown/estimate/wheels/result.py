"""What was found of every wheel: bearing drag, spikes, and how it was used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...kit.digits import plus_minus
from ...kit.errors import some_of
from ...kit.result import Estimate, per_spin_inertia, with_old_keys
from ...kit.schema import Annotated, Doc, NotRequired, Number, Numbers, TypedDict
from ...kit.table import Table

if TYPE_CHECKING:
    from .run_downs import Law, RunDown
    from .use import WheelUse

RUN_DOWN, FLIGHT_SOFTWARE, COMMAND = "run-down", "flight software estimate", "command"
MOTOR_CURRENT, WHEEL_COMMAND = "motor current", "wheel command"

#: The split of drag into both parts is doubted where it is uncertain by this share of the drag.
_SPLIT = 0.1
_RPM = 60 / (2 * np.pi)
#: Spikes of one wheel in the text.
_MOST_SPIKES = 12

#: Keys of a fit in earlier versions.
_OLD_FIT_KEYS = {
    "sigma_coulomb_Nm": "coulomb_sigma_Nm",
    "sigma_viscous_Nms": "viscous_sigma_Nms",
    "sigma_drag_at_mean_Nm": "drag_at_mean_sigma_Nm",
    "told_apart": "separable",
    "sigma_coulomb_per_spin_inertia_rad_s2": "coulomb_sigma_per_spin_inertia_rad_s2",
    "sigma_viscous_per_spin_inertia_per_s": "viscous_sigma_per_spin_inertia_per_s",
    "sigma_drag_at_mean_per_spin_inertia_rad_s2": "drag_at_mean_sigma_per_spin_inertia_rad_s2",
}


class DragRecord(TypedDict):
    """One way to the drag of a wheel; null where there is none.  Where the spin inertia is unknown the keys in N m and N m s are
    null and their siblings per unit spin inertia hold the values."""

    coulomb_Nm: Number
    coulomb_sigma_Nm: Number
    viscous_Nms: Number
    viscous_sigma_Nms: Number
    correlation: Annotated[Number, Doc("of both parts")]
    drag_at_mean_Nm: Annotated[Number, Doc("their sum at mean_rate_rad_s, which is known better than either")]
    drag_at_mean_sigma_Nm: Number
    mean_rate_rad_s: Annotated[Number, Doc("mean |rate| of the samples used")]
    separable: Annotated[bool | None, Doc("whether the split into both parts is known to 10 % of the drag")]
    basis: Annotated[str | None, Doc("run-down, flight software estimate, motor current, wheel command or command")]
    coulomb_per_spin_inertia_rad_s2: NotRequired[Number]
    coulomb_sigma_per_spin_inertia_rad_s2: NotRequired[Number]
    viscous_per_spin_inertia_per_s: NotRequired[Number]
    viscous_sigma_per_spin_inertia_per_s: NotRequired[Number]
    drag_at_mean_per_spin_inertia_rad_s2: NotRequired[Number]
    drag_at_mean_sigma_per_spin_inertia_rad_s2: NotRequired[Number]


class RunDownRecord(TypedDict):
    start_s: Number
    stop_s: Number
    from_rad_s: Number
    to_rad_s: Number
    samples: int
    rms_residual_rad_s: Number
    found_by: Annotated[str, Doc("named (by the user), current (the motor's is zero) or shape (guessed)")]
    alone: Annotated[DragRecord, Doc("drag from this run-down by itself")]


class SpikeRecord(TypedDict):
    time_s: Number
    drag_Nm: Number
    excess_Nm: Number
    duration_s: Number


class WheelRecord(DragRecord):
    """One wheel, with the best way to its drag."""

    name: str
    spin_inertia_kgm2: Number
    run_downs: list[RunDownRecord]
    spikes: Annotated[list[SpikeRecord] | None, Doc("null where there is no estimate of drag to look in")]
    low_speed_dwell_s: Number
    zero_crossings: int
    zero_crossing_times_s: Numbers
    revolutions: Number
    largest_rate_rad_s: Number
    rate_limit_rad_s: Number
    seen_s: Number
    gaps_s: Number
    other_bases: Annotated[list[DragRecord], Doc("the same drag by other ways")]


class WheelsRecord(TypedDict):
    """JSON of `asflown wheels`."""

    craft: str
    epoch: str
    low_speed_rad_s: Number
    wheels: list[WheelRecord]


@dataclass(frozen=True)
class DragFit:
    """drag = Coulomb + viscous |rate|, opposing the rate; per unit spin inertia (rad/s^2, 1/s) where ``relative``.

    Sigmas hold the scatter of the samples.  The spin inertia's own error scales a run-down's drag and is not in them."""

    basis: str
    coulomb_Nm: float
    coulomb_sigma_Nm: float
    viscous_Nms: float
    viscous_sigma_Nms: float
    correlation: float
    drag_at_mean_Nm: float  # at ``mean_rate_rad_s``, known better than either part
    drag_at_mean_sigma_Nm: float
    mean_rate_rad_s: float  # mean |rate| of the samples used
    relative: bool = False

    @classmethod
    def from_law(cls, basis, values, covariance, rate: float, *, scale: float = 1.0, relative: bool = False) -> DragFit:
        values, covariance = scale * np.asarray(values, float), scale**2 * np.asarray(covariance, float)
        sigma = np.sqrt(np.diag(covariance))
        at = np.array([1.0, rate])
        product = sigma[0] * sigma[1]
        return cls(
            basis, float(values[0]), float(sigma[0]), float(values[1]), float(sigma[1]),
            float(np.clip(covariance[0, 1] / product, -1, 1)) if product > 0 else float("nan"),
            float(at @ values), float(np.sqrt(max(at @ covariance @ at, 0.0))), float(rate), relative,
        )  # fmt: skip

    @classmethod
    def of_run_downs(cls, law: Law, spin_inertia_kgm2: float | None) -> DragFit:
        """The drag of a wheel that slows by a law."""
        J = spin_inertia_kgm2
        return cls.from_law(
            RUN_DOWN, law.values, law.covariance, law.rate, scale=1.0 if J is None else J, relative=J is None
        )

    @property
    def separable(self) -> bool:
        """Whether the split into both parts is known well enough."""
        return bool(self.viscous_sigma_Nms * self.mean_rate_rad_s <= _SPLIT * abs(self.drag_at_mean_Nm))

    def drag(self, rate_rad_s) -> np.ndarray:
        """Size of the drag at these rates."""
        return self.coulomb_Nm + self.viscous_Nms * np.abs(rate_rad_s)

    def sigma(self, rate_rad_s) -> np.ndarray:
        """One sigma of ``drag``; smallest at the mean rate."""
        off = np.abs(np.asarray(rate_rad_s, float)) - self.mean_rate_rad_s
        return np.hypot(self.drag_at_mean_sigma_Nm, off * self.viscous_sigma_Nms)

    def record(self) -> dict:
        record = {
            "coulomb_Nm": self.coulomb_Nm,
            "coulomb_sigma_Nm": self.coulomb_sigma_Nm,
            "viscous_Nms": self.viscous_Nms,
            "viscous_sigma_Nms": self.viscous_sigma_Nms,
            "correlation": self.correlation,
            "drag_at_mean_Nm": self.drag_at_mean_Nm,
            "drag_at_mean_sigma_Nm": self.drag_at_mean_sigma_Nm,
            "mean_rate_rad_s": self.mean_rate_rad_s,
            "separable": self.separable,
            "basis": self.basis,
        }
        if self.relative:
            per_spin_inertia(record, [n for n in record if n.endswith("_Nm")])
            for name in ("viscous", "viscous_sigma"):  # per rad/s: 1/s, where a momentum would be rad/s
                record[f"{name}_per_spin_inertia_per_s"], record[f"{name}_Nms"] = record[f"{name}_Nms"], None
        return record


_NO_FIT = dict.fromkeys(n for n in DragRecord.__annotations__ if "_per_spin_inertia_" not in n)


@dataclass(frozen=True)
class Spike:
    """Drag that stands out above the law: when it rises, its largest value and excess (medians of three samples, where
    it lasts as long), and how long it stays above half of that."""

    time_s: float
    drag_Nm: float
    excess_Nm: float
    duration_s: float

    def record(self) -> dict:
        return {n: getattr(self, n) for n in ("time_s", "drag_Nm", "excess_Nm", "duration_s")}


@dataclass(frozen=True)
class DragSamples:
    """The flight software's own estimates (N,), opposing the rate: evidence, and where spikes are looked for."""

    time_s: np.ndarray
    rate_rad_s: np.ndarray
    drag_Nm: np.ndarray
    used: np.ndarray  # (N,) bool
    spiked: np.ndarray  # (N,) bool


@dataclass(frozen=True)
class WheelDrag:
    """One wheel.  ``fits``: every way to its drag, the best one first; empty where there is none.

    ``spikes``: None where the file holds nothing to look for them in."""

    name: str
    spin_inertia_kgm2: float | None
    rate_limit_rad_s: float | None
    use: WheelUse
    time_s: np.ndarray
    rate_rad_s: np.ndarray
    fits: tuple[DragFit, ...] = ()
    run_downs: tuple[RunDown, ...] = ()
    spikes: tuple[Spike, ...] | None = None
    samples: DragSamples | None = None

    @property
    def fit(self) -> DragFit | None:
        return self.fits[0] if self.fits else None

    @property
    def is_guessed(self) -> bool:
        """Whether the drag is of run-downs that only their shape shows."""
        return bool(self.run_downs) and all(r.is_guessed for r in self.run_downs)

    def alone(self, run_down: RunDown) -> DragFit:
        """The drag from one of its run-downs by itself."""
        return DragFit.of_run_downs(run_down.alone, self.spin_inertia_kgm2)

    @property
    def known_fit(self) -> DragFit | None:
        """The best way to the drag that is not guessed."""
        return next((f for f in self.fits if not (f.basis == RUN_DOWN and self.is_guessed)), None)

    def record(self) -> dict:
        others = [f.record() for f in self.fits[1:]]
        for other in others:
            with_old_keys(other, _OLD_FIT_KEYS)
        return {
            "name": self.name,
            **(self.fit.record() if self.fit else _NO_FIT),
            "spin_inertia_kgm2": self.spin_inertia_kgm2,
            "run_downs": [r.record() | {"alone": self.alone(r).record()} for r in self.run_downs],
            "spikes": None if self.spikes is None else [s.record() for s in self.spikes],
            "low_speed_dwell_s": self.use.low_speed_dwell_s,
            "zero_crossings": self.use.zero_crossings,
            "zero_crossing_times_s": list(self.use.crossing_times_s),
            "revolutions": self.use.revolutions,
            "largest_rate_rad_s": self.use.largest_rate_rad_s,
            "rate_limit_rad_s": self.rate_limit_rad_s,
            "seen_s": self.use.seen_s,
            "gaps_s": self.use.gaps_s,
            "other_bases": others,
        }


@dataclass(frozen=True, kw_only=True, repr=False)
class WheelsResult(Estimate):
    """Every wheel of a record.  Times count from the telemetry's epoch.  ``low_speed_rad_s``: below it a wheel dwells."""

    RECORD: ClassVar[type] = WheelsRecord
    OLD_KEYS: ClassVar[dict[str, str]] = {f"wheels[].{before}": now for before, now in _OLD_FIT_KEYS.items()}

    low_speed_rad_s: float
    wheels: tuple[WheelDrag, ...]

    def wheel(self, name: str) -> WheelDrag:
        return next(w for w in self.wheels if w.name == name)

    def _record(self) -> dict:
        return {
            "craft": self.craft,
            "epoch": self.epoch,
            "low_speed_rad_s": self.low_speed_rad_s,
            "wheels": [w.record() for w in self.wheels],
        }

    def _tables(self) -> tuple[Table, ...]:
        """Use, then drag in N m, drag per unit spin inertia, run-downs and spikes, where there are any."""
        unknown = [w.name for w in self.wheels if not w.fits]
        use = Table(
            f"Wheels · {self.craft} · epoch {self.epoch}",
            tuple(_use_row(w) for w in self.wheels),
            ("wheel", "seen [s]", "revolutions", f"below {_RPM * self.low_speed_rad_s:.0f} rpm [s]", "zero crossings", "largest [rpm]"),
            (f"drag not known: {some_of(unknown)}",) if unknown else (),
        )  # fmt: skip
        fits = [(w.name, f) for w in self.wheels for f in w.fits]
        head = ("wheel", "from", "Coulomb [mN m]", "viscous [µN m s]", "sum [mN m]", "at [rpm]")
        relative = ("wheel", "from", "Coulomb [rad/s^2]", "viscous [1/s]", "sum [rad/s^2]", "at [rpm]")
        several = any(len(w.run_downs) > 1 for w in self.wheels)
        run_downs = tuple(_run_down_row(w, r, several=several) for w in self.wheels for r in w.run_downs)
        spikes = tuple(
            (w.name, f"{s.time_s:.0f}", f"{s.duration_s:.0f}", f"{1e3 * s.drag_Nm:.2f}")
            for w in self.wheels for s in (w.spikes or ())[:_MOST_SPIKES]
        )  # fmt: skip
        more = tuple(
            f"and {len(w.spikes) - _MOST_SPIKES} more of {w.name}"
            for w in self.wheels
            if w.spikes and len(w.spikes) > _MOST_SPIKES
        )
        tables = (
            Table("Drag", tuple(_fit_row(n, f, 1e3, 1e6) for n, f in fits if not f.relative), head),
            Table("Drag per unit spin inertia", tuple(_fit_row(n, f, 1.0, 1.0) for n, f in fits if f.relative), relative),
            Table("Run-downs", run_downs, _run_down_head(self.wheels, several=several)),
            Table("Drag spikes", spikes, ("wheel", "time [s]", "duration [s]", "drag [mN m]"), more),
        )  # fmt: skip
        return (use, *(t for t in tables if t.rows))


def _use_row(w: WheelDrag) -> tuple[str, ...]:
    u = w.use
    largest = f"{_RPM * u.largest_rate_rad_s:.1f}"
    return (
        w.name,
        f"{u.seen_s:.0f}",
        f"{u.revolutions:.1f}",
        f"{u.low_speed_dwell_s:.0f}",
        str(u.zero_crossings),
        largest,
    )


def _run_down_head(wheels: tuple[WheelDrag, ...], *, several: bool) -> tuple[str, ...]:
    head = ("wheel", "time [s]", "rate [rpm]", "samples")
    unit = "rad/s^2" if any(w.spin_inertia_kgm2 is None for w in wheels) else "mN m"
    return (*head, f"Coulomb [{unit}]", f"sum [{unit}]", "at [rpm]") if several else head


def _run_down_row(w: WheelDrag, r: RunDown, *, several: bool) -> tuple[str, ...]:
    """One run-down; with ``several`` its own drag too."""
    times, rates = f"{r.start_s:.0f} to {r.stop_s:.0f}", f"{_RPM * r.from_rad_s:.1f} to {_RPM * r.to_rad_s:.1f}"
    row = (w.name, times, rates, str(len(r.time_s)))
    if not several:
        return row
    f = w.alone(r)
    _, _, coulomb, _, together, at = _fit_row("", f, 1.0 if f.relative else 1e3, 1.0)
    return (*row, coulomb, together, at)


def _fit_row(name: str, f: DragFit, scale: float, fine: float) -> tuple[str, ...]:
    """One way to a wheel's drag; ``scale``, ``fine``: to the units of torque and of torque per rate."""
    parts = ("not separable", "")
    if f.separable:
        parts = (
            plus_minus(scale * f.coulomb_Nm, scale * f.coulomb_sigma_Nm),
            plus_minus(fine * f.viscous_Nms, fine * f.viscous_sigma_Nms),
        )
    together = plus_minus(scale * f.drag_at_mean_Nm, scale * f.drag_at_mean_sigma_Nm)
    return (name, f.basis, *parts, together, f"{_RPM * f.mean_rate_rad_s:.0f}")
