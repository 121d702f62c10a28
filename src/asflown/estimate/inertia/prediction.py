"""An estimated inertia tensor beside a predicted one, in the form of 001's Table 1 (eqs 12, 13)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...craft.model import Craft, InertiaRequirement, MassProperties, tensor
from ...kit.errors import BadInput
from ...kit.timeline import utc_label
from ...telemetry.attitude import MISTAKEN_UNITS

#: Rows of Table 1, and where they stand in the tensor.
ROWS = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}

MET, NOT_MET, OPEN = "met", "not met", "open"
#: A prediction further from the date than this is doubted. [ns]
_LONG_AGO_NS = 200 * 86_400 * 10**9
#: Moments whose ratio is this near to a unit's factor, and alike within this, are taken for a wrong unit.
_NEAR_FACTOR, _ALIKE = 1.25, 1.5


@dataclass(frozen=True)
class Prediction:
    """A tensor (3, 3) to compare with, and where it is from."""

    inertia: np.ndarray
    basis: str
    date: str
    source: str
    requirement: InertiaRequirement | None = None
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Compared:
    """One component.  ``error``: predicted less estimated, in percent of the predicted for moments (001 eq 12), else as
    it is (eq 13).  ``verdict``: whether the requirement is met; 'open' where 95 % of the estimate lies on both sides."""

    name: str
    predicted: float
    estimated: float
    sigma: float | None
    error: float
    sigma_error: float | None
    requirement: float | None
    verdict: str | None

    @property
    def moment(self) -> bool:
        return self.name[1] == self.name[2]


@dataclass(frozen=True)
class InertiaComparison:
    """All six, and how far the estimate is from what no rigid body can be.

    ``smallest_moment``: the smallest principal moment; ``triangle_margin``: the smallest eigenvalue of
    trace(I)/2 - I, half of what two principal moments exceed the third by.  Both must be positive."""

    prediction: Prediction
    rows: tuple[Compared, ...]
    smallest_moment: float
    triangle_margin: float
    relative: bool
    doubts: tuple[str, ...]

    def row(self, name: str) -> Compared:
        return next(r for r in self.rows if r.name == name)

    @property
    def unit(self) -> str:
        return "per spin inertia" if self.relative else "kg m2"

    def record(self) -> dict:
        """The JSON form.  Errors of moments in percent, of products in ``unit``."""
        return {
            "unit": self.unit,
            "predicted": {
                "inertia": self.prediction.inertia, "basis": self.prediction.basis, "date": self.prediction.date,
                "source": self.prediction.source,
            },
            "components": [
                {
                    "name": r.name, "predicted": r.predicted, "estimated": r.estimated, "sigma": r.sigma,
                    "error_percent": r.error if r.moment else None, "error": None if r.moment else r.error,
                    "sigma_error": r.sigma_error, "requirement": r.requirement, "verdict": r.verdict,
                }
                for r in self.rows
            ],
            "smallest_moment": self.smallest_moment,
            "triangle_margin": self.triangle_margin,
            "doubts": list(self.doubts),
        }  # fmt: skip

    def __str__(self) -> str:
        """Table 1, one window of it."""
        p = self.prediction
        lines = [
            f"Estimate against {p.basis} inertia of {p.date} ({p.source}) [{self.unit}]",
            f"  {'':4}{'predicted':>11}{'estimated':>11}{'sigma':>9}{'error':>11}   requirement",
        ]
        for r in self.rows:
            unit = " %" if r.moment else "  "
            error = f"{r.error:+.2f}" if r.moment else _short(r.error, "+")
            sigma = "" if r.sigma is None else f"{r.sigma:.3g}"
            asked = "" if r.requirement is None else f"{r.requirement:g}{unit.rstrip()} {r.verdict}"
            lines.append(
                f"  {r.name:4}{_short(r.predicted):>11}{_short(r.estimated):>11}{sigma:>9}{error:>9}{unit}   {asked}".rstrip()
            )
        lines.append(
            f"  smallest principal moment {_short(self.smallest_moment)}, triangle margin {_short(self.triangle_margin)}"
        )
        return "\n".join(lines)


def _short(value: float, sign: str = "") -> str:
    """In columns: tenths, or four digits where there would be too many."""
    return f"{value:{sign}.1f}" if abs(value) < 1e6 else f"{value:{sign}.4g}"


def predicted_inertia(craft: Craft, tai_ns: int | None) -> Prediction:
    """The tensor predicted for the configuration of a date (None: the latest), the nearest in time; where there is none,
    the craft's own tensor on that date.

    Raises BadInput where the craft has neither."""
    known = sorted((m for m in craft.mass_properties if m.basis != "predicted"), key=lambda m: m.date)
    moment = tai_ns if tai_ns is not None else max((m.date for m in craft.mass_properties), default=0)
    piece = next((m.piece for m in reversed(known) if m.date <= moment), known[0].piece if known else None)
    candidates = [m for m in craft.mass_properties if m.basis == "predicted" and piece in (None, m.piece)]
    if candidates:
        m = min(candidates, key=lambda m: abs(m.date - moment))
        return Prediction(
            tensor(m.elements),
            "predicted",
            utc_label(m.date)[:10],
            m.source,
            craft.inertia_requirement,
            _age(m, moment),
        )
    now = craft.at(tai_ns)
    if now.inertia_kgm2 is None:
        raise BadInput(
            f"{craft.name} has no inertia to compare an estimate with",
            remedy="Add [[mass_properties]] to the craft file, or give --inertia.",
        )
    source = (
        "given by the user" if piece == "given" else "the craft's tensor on that date, which may itself be an estimate"
    )
    date = utc_label(moment)[:10] if piece != "given" else "any date"
    doubts = () if piece == "given" else ("no prediction is in the craft file for this configuration",)
    return Prediction(now.inertia_kgm2, "craft's", date, source, craft.inertia_requirement, (*doubts, *now.doubts))


def _age(m: MassProperties, moment: int) -> tuple[str, ...]:
    if abs(m.date - moment) <= _LONG_AGO_NS:
        return ()
    return (f"the prediction is that of {utc_label(m.date)[:10]}, the nearest there is to {utc_label(moment)[:10]}",)


def compare_inertia(estimate, prediction: Prediction, sigma=None, relative: bool = False) -> InertiaComparison:
    """Set an estimate (3, 3) against a prediction; ``sigma`` (3, 3): its total one sigma, where known.

    ``relative``: both are per unit spin inertia, of which no requirement on products speaks."""
    I_B, rows = np.asarray(estimate, float), []
    for name, at in ROWS.items():
        predicted, estimated = float(prediction.inertia[at]), float(I_B[at])
        s = None if sigma is None else float(np.asarray(sigma, float)[at])
        scale = 100 / predicted if at[0] == at[1] else 1.0
        asked = None
        if prediction.requirement is not None and not (relative and at[0] != at[1]):
            asked = 100 * prediction.requirement.moments if at[0] == at[1] else prediction.requirement.products
        error = scale * (predicted - estimated)
        s_error = None if s is None else abs(scale) * s
        rows.append(Compared(name, predicted, estimated, s, error, s_error, asked, _verdict(error, s_error, asked)))
    moments = np.linalg.eigvalsh(I_B)
    margin = float(moments.sum() / 2 - moments[-1])
    doubts = [*prediction.doubts, *_impossible(float(moments[0]), margin), *_wrong_unit(I_B, prediction.inertia)]
    return InertiaComparison(prediction, tuple(rows), float(moments[0]), margin, relative, tuple(dict.fromkeys(doubts)))


def _verdict(error: float, sigma: float | None, asked: float | None) -> str | None:
    if asked is None:
        return None
    if sigma is not None and abs(abs(error) - asked) < 1.96 * sigma:
        return OPEN
    return MET if abs(error) <= asked else NOT_MET


def _impossible(smallest: float, margin: float) -> list[str]:
    if smallest > 0 and margin >= 0:
        return []
    what = (
        f"its smallest principal moment is {smallest:.4g}" if smallest <= 0 else f"its triangle margin is {margin:.4g}"
    )
    return [f"no rigid body has the estimated inertia: {what}"]


def _wrong_unit(estimate, predicted) -> list[str]:
    """Moments are a wheel's rate over the body's: a factor in either shows in all three."""
    ratio = np.diag(estimate) / np.diag(predicted)
    if (ratio <= 0).any() or ratio.max() / ratio.min() > _ALIKE:
        return []
    mean = float(np.exp(np.mean(np.log(ratio))))
    guesses = [
        f"{which} rates {words}"
        for which, scale in (("body", 1 / mean), ("wheel", mean))
        for factor, words in MISTAKEN_UNITS.items()
        if abs(np.log(scale / factor)) < np.log(_NEAR_FACTOR)
    ]
    if not guesses:
        return []
    return [f"all moments are {mean:.3g} times the predicted ones: are the {', or the '.join(guesses)}?"]


def compared_history(craft: Craft) -> list[tuple[str, str, InertiaComparison]]:
    """(date, configuration, comparison) of every estimate in the craft file that has a prediction of its own date: 001's
    Table 1 for Cassini."""
    found = []
    for m in sorted(craft.mass_properties, key=lambda m: m.date):
        prediction = next(
            (p for p in craft.mass_properties if p.basis == "predicted" and (p.date, p.piece) == (m.date, m.piece)),
            None,
        )
        if m.basis != "estimated" or prediction is None:
            continue
        date = utc_label(m.date)[:10]
        p = Prediction(tensor(prediction.elements), "predicted", date, prediction.source, craft.inertia_requirement)
        found.append((date, m.piece, compare_inertia(tensor(m.elements), p, relative=m.inertia is None)))
    return found
