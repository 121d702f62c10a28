"""A fitted Gates model: what it says, how well it is known, and what to doubt."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ...kit.plain import finite
from ...maneuvers.model import Gates
from .likelihood import LOG_2PI, Point, Problem

if TYPE_CHECKING:
    from ...maneuvers.table import Maneuvers
    from .intervals import Interval


@dataclass(frozen=True)
class ModelScore:
    """Log likelihood of one model, and Akaike's criterion corrected for few burns (None with too few)."""

    model: str
    log_likelihood: float
    aicc: float | None


@dataclass(frozen=True)
class Part:
    """Magnitude or pointing of a fit.  ``known``: whether there are burns enough to give its sigmas and biases."""

    name: str
    problem: Problem
    point: Point
    known: bool
    sigmas: tuple[Interval, Interval]  # fixed, proportional
    biases: tuple[Interval, ...]  # fixed and proportional of each component
    log_likelihood: float
    scores: tuple[ModelScore, ...]
    drawn: np.ndarray | None = None  # (B, 2 + p), refits of the parametric bootstrap

    @property
    def held(self) -> list[str]:
        return [t for t, h in zip(("fixed", "proportional"), self.problem.held, strict=True) if h is not None]

    @property
    def at_bound(self) -> list[str]:
        """Sigmas estimated as zero."""
        values = {"fixed": self.point.fixed, "proportional": self.point.proportional}
        return [t for t, value in values.items() if value == 0 and t not in self.held]

    @property
    def down_weighted(self) -> dict[int, float]:
        """Rows of the burns that count less than half, and their weights; of normal errors none."""
        if not np.isfinite(self.point.objective):
            return {}
        weights = self.problem.weights(self.point)
        return {int(k): float(weights[k]) for k in np.flatnonzero(weights < 0.5)}

    def interval(self, term: str) -> Interval:
        return self.sigmas[0 if term == "fixed" else 1]

    def shown(self, term: str, value: float) -> str:
        """A value in the unit people read."""
        scale, unit = _READ[term if term == "fixed" else self.name]
        return f"{scale * value:.3g} {unit}"

    @property
    def proportional_key(self) -> str:
        return "proportional" if self.name == "magnitude" else "proportional_rad"

    @property
    def bias_keys(self) -> tuple[str, str]:
        return "bias_fixed_mps", f"bias_{self.proportional_key}"

    @property
    def terms(self) -> list[str]:
        """Names of all parameters in the problem's order."""
        axes = [""] if self.name == "magnitude" else [" X", " Y"]
        return [
            "fixed",
            "proportional",
            *(f"bias{a}, {t}" for a in axes[: len(self.point.beta) // 2] for t in ("fixed", "proportional")),
        ]

    @property
    def standard_errors(self) -> list[float | None]:
        """One sigma of every parameter, from the widths of the intervals; None for what is held, open, or a limit (from zero)."""
        return [_width(i) if i[0] else None for i in self.sigmas] + [_width(i) for i in self.biases]

    def gathered(self, values) -> dict:
        """Values in the problem's order under the keys of the record; one number a key for magnitude, two for pointing."""
        values = list(values)
        keys = ("fixed_mps", self.proportional_key, *self.bias_keys)
        fixed, proportional = values[2::2], values[3::2]
        if self.name == "magnitude":
            fixed, proportional = (x[0] if x else None for x in (fixed, proportional))
        elif not fixed:
            fixed = proportional = [None, None]
        return dict(zip(keys, [*values[:2], fixed, proportional], strict=True))

    def record(self) -> dict:
        numbers = [self.point.fixed, self.point.proportional, *self.point.beta]
        values = self.gathered(numbers if self.known else [None] * len(numbers))
        found = values | {
            "ci95": self.gathered([None if i == (None, None) else list(i) for i in (*self.sigmas, *self.biases)]),
            "held": self.held,
            "log_likelihood": finite(self.log_likelihood),
            "log_likelihood_printed_normaliser": finite(self.log_likelihood_printed),
            "models": [{"model": s.model, "log_likelihood": s.log_likelihood, "aicc": s.aicc} for s in self.scores],
        }
        if self.drawn is not None:
            spread = np.std(self.drawn, axis=0, ddof=1)
            low, high = np.quantile(self.drawn, [0.025, 0.975], axis=0)
            found["bootstrap"] = {
                "refits": len(self.drawn), "sd": self.gathered(spread.tolist()),
                "ci95": self.gathered([list(x) for x in zip(low.tolist(), high.tolist(), strict=True)]),
                "at_bound_share": dict(zip(("fixed", "proportional"), np.mean(self.drawn[:, :2] == 0, axis=0).tolist(), strict=True)),
            }  # fmt: skip
        return found

    @property
    def log_likelihood_printed(self) -> float:
        """With the papers' normaliser of a pointing density, sqrt(2 pi) s^2 in place of 2 pi s^2 (002 eq 4); NaN where it is no normal one."""
        if not self.problem.normal:
            return float("nan")
        return self.log_likelihood + (
            0.25 * LOG_2PI * float(np.sum(self.problem.k)) if self.name == "pointing" else 0.0
        )


#: Term, or part for its proportional term -> scale and unit people read.
_READ = {"fixed": (1e3, "mm/s"), "magnitude": (100.0, "%"), "pointing": (1e3, "mrad")}


#: The record of pointing where there are no pointing errors.
_NOTHING = {
    "fixed_mps": None, "proportional_rad": None, "bias_fixed_mps": [None, None], "bias_proportional_rad": [None, None],
    "ci95": {"fixed_mps": None, "proportional_rad": None, "bias_fixed_mps": [None, None], "bias_proportional_rad": [None, None]},
    "held": [], "log_likelihood": None, "log_likelihood_printed_normaliser": None, "models": [],
}  # fmt: skip


@dataclass(frozen=True)
class GatesFit:
    """Sigmas and biases of one engine.  ``engine``: None where the file names none."""

    engine: str | None
    maneuvers: Maneuvers
    model: str
    likelihood: str
    magnitude: Part
    pointing: Part | None = None
    doubts: tuple[str, ...] = field(default=())

    @property
    def parts(self) -> list[Part]:
        return [self.magnitude] if self.pointing is None else [self.magnitude, self.pointing]

    @property
    def at_bound(self) -> list[str]:
        """Sigmas that are limits and no estimates, as ``magnitude.proportional``."""
        return [f"{p.name}.{t}" for p in self.parts if p.known for t in p.at_bound]

    @property
    def known(self) -> bool:
        return self.magnitude.known

    @property
    def gates(self) -> Gates:
        """The most likely model, however badly known; of pointing NaN where there is none."""
        m, nan = self.magnitude.point, float("nan")
        biases = m.beta if len(m.beta) else (0.0, 0.0)
        p = None if self.pointing is None else self.pointing.point
        across = (p.fixed, p.proportional) if p else (nan, nan)
        turned = (0.0,) * 4 if p and not len(p.beta) else tuple(p.beta) if p else (nan,) * 4
        return Gates(
            m.fixed, m.proportional, *across, float(biases[0]), float(biases[1]), (float(turned[0]), float(turned[2])),
            (float(turned[1]), float(turned[3])), float(self.maneuvers.dv_mps.max()), f"{self.engine or 'engine'}, {self.model}",
        )  # fmt: skip

    @property
    def log_likelihood(self) -> float:
        """Full log likelihood at the estimates, magnitude and pointing together."""
        return sum(p.log_likelihood for p in self.parts)

    def record(self) -> dict:
        """The JSON form of the fit alone, without judgement, command and provenance."""
        return {
            "engine": self.engine, "count": len(self.maneuvers), "model": self.model, "likelihood": self.likelihood,
            "magnitude": self.magnitude.record(), "pointing": _NOTHING if self.pointing is None else self.pointing.record(),
            "at_bound": self.at_bound, "log_likelihood": finite(self.log_likelihood) if self.known else None,
            "down_weighted": [{"id": self.maneuvers.id[k], "part": p.name, "weight": w} for p in self.parts for k, w in p.down_weighted.items()],
            "dv_mps": [float(self.maneuvers.dv_mps.min()), float(self.maneuvers.dv_mps.max())],
            "excluded": [{"id": i, "reason": r} for i, r in self.maneuvers.excluded],
            "adjusted": {i: [a.name for a in book] for i, book in zip(self.maneuvers.id, self.maneuvers.ledger, strict=True) if book},
        }  # fmt: skip

    def __str__(self) -> str:
        m = self.maneuvers
        lines = [
            f"Gates model · {self.engine or 'engine not named'} · {len(m)} maneuvers of {_size(m.dv_mps.min())} to {_size(m.dv_mps.max())} · "
            f"{self.model}, {self.likelihood}"
        ]
        for part in self.parts:
            lines.append(f"  {part.name}" + (" (per axis)" if part.name == "pointing" else ""))
            values = [part.point.fixed, part.point.proportional, *part.point.beta]
            intervals = [*part.sigmas, *part.biases]
            drawn = (
                [None] * len(values)
                if part.drawn is None
                else np.quantile(part.drawn, [0.025, 0.975], axis=0).T.tolist()
            )
            for name, value, interval, refitted in zip(part.terms, values, intervals, drawn, strict=True):
                scale, unit = _READ["fixed" if name.endswith("fixed") else part.name]
                within = _between(interval, scale, unit)
                if name in part.held:
                    said, within = f"{scale * value:.3g} {unit}", "held"
                elif not part.known:
                    said = "not known"
                elif name in part.at_bound:
                    said = "no limit" if interval[1] is None else f"< {scale * interval[1]:.3g} {unit}"
                    within = "95 %; on its bound"
                else:
                    said = f"{scale * value:.3g} {unit}"
                if refitted is not None:
                    within += f"; bootstrap {scale * refitted[0]:.3g} to {scale * refitted[1]:.3g}"
                lines.append(f"    {name:22s} {said:>14s}   {within}".rstrip())
        return "\n".join(lines)


def _width(interval: Interval) -> float | None:
    """One sigma of what lies in a 95 % interval; None where an end is open."""
    low, high = interval
    return None if low is None or high is None else (high - low) / 3.92


def _between(interval: Interval, scale: float, unit: str) -> str:
    low, high = interval
    if low is None and high is None:
        return ""
    ends = ["-inf" if low is None else f"{scale * low:.3g}", "no limit" if high is None else f"{scale * high:.3g}"]
    return f"95 %: {ends[0]} to {ends[1]} {unit}"


def _size(dv_mps: float) -> str:
    return f"{dv_mps:.3g} m/s"
