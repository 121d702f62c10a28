"""Table 1 of 001, all of it, and what a comparison says of an estimate."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.craft.model import tensor
from asflown.estimate.inertia import prediction as doubt
from asflown.estimate.inertia.prediction import ROWS, Prediction, compare_inertia, predicted_inertia
from asflown.kit.errors import BadInput
from asflown.kit.timeline import utc_to_tai_ns
from flights import CASSINI

#: 001 Table 1: predicted, estimated, error, in the order of its rows; percent for moments, kg m2 for products.
TABLE_1 = {
    "2004-06-30": [(8802, 8853, -0.58), (8155, 8171, -0.21), (4715, 4651, 1.34), (-137, -161, 24), (115, 114, 1), (156, 161, -5)],
    "2004-08-23": [(7589, 7637, -0.63), (6948, 6948, 0), (4449, 4223, 5.08), (-138, -137, -1), (151, 252, -102), (150, 162, -12)],
    "2004-12-25": [(7403, 7362, 0.54), (6174, 6130, 0.73), (3727, 3750, -0.63), (-129, -164, 35), (-12, -12, 0), (147, 149, -2)],
}  # fmt: skip


def compared(date: str, **more):
    """The craft file's estimate of a window against its prediction."""
    ns = int(utc_to_tai_ns(f"{date}T00:00:00"))
    return compare_inertia(CASSINI.at(ns).inertia_kgm2, predicted_inertia(CASSINI, ns), **more)


@pytest.mark.parametrize("date", TABLE_1)
def test_published_table_1(date):
    """Every printed error is one that the printed integers, themselves rounded, allow."""
    table = compared(date)
    assert table.prediction.basis == "predicted" and table.prediction.date == date and not table.doubts
    for r, (predicted, estimated, printed) in zip(table.rows, TABLE_1[date], strict=True):
        assert (r.predicted, r.estimated) == (predicted, estimated)
        ends = [
            100 * (p - e) / p if r.moment else p - e for p in (predicted - 0.5, predicted + 0.5) for e in (estimated - 0.5, estimated + 0.5)
        ]  # fmt: skip
        digit = 0.005 if r.moment else 0.5
        assert min(ends) - digit <= printed <= max(ends) + digit, r.name


def test_published_text_about_table_1_against_its_numbers():
    soi, prm, probe = (compared(d) for d in TABLE_1)
    of_xy = [abs(t.row(c).error) for t in (soi, prm, probe) for c in ("Ixx", "Iyy")]
    assert (
        sorted(of_xy)[-2] < 0.65 < max(of_xy)
    )  # "errors that are less than 0.65 %": Iyy after the probe is 0.71 (0.73 printed)
    assert soi.row("Izz").error > 1 and prm.row("Izz").error > 5  # the summary's "+-1 %"
    verdicts = {(d, r.name): r.verdict for d, t in zip(TABLE_1, (soi, prm, probe), strict=True) for r in t.rows}
    assert [k for k, v in verdicts.items() if v != "met"] == [
        ("2004-08-23", "Ixz")
    ]  # -101 from the integers, -102 printed; +-75 asked
    assert prm.row("Ixz").error == pytest.approx(-101) and prm.row("Ixz").verdict == "not met"


def test_published_cruise_estimate_against_the_sum_of_components():
    """001 eqs 1, 8: "consistently lower by nearly 3 %" is so of Y and Z only."""
    table = compared("2000-03-15")
    assert [table.row(c).error for c in ("Ixx", "Iyy", "Izz")] == pytest.approx([1.77, 2.88, 2.87], abs=0.005)  # %
    assert [table.row(c).error for c in ("Ixy", "Ixz", "Iyz")] == pytest.approx(
        [7.2, -16.8, -35.7], abs=0.05
    )  # kg m2, "within 40"
    assert {r.verdict for r in table.rows} == {"met"}


def test_published_tensors_are_those_of_rigid_bodies():
    margins = [compare_inertia(tensor(m.elements), predicted_inertia(CASSINI, m.date)).triangle_margin_kgm2 for m in CASSINI.mass_properties
               if m.source.startswith("Feldman & Lee")]  # fmt: skip
    assert len(margins) == 8 and 1200 < min(margins) and max(margins) < 2010  # kg m2


def test_sigma_of_the_estimate_can_leave_a_requirement_open():
    table = compared("2004-08-23", sigma=np.full((3, 3), 14.0))
    assert table.row("Ixz").verdict == "open"  # 26 beyond 75, at 14 one sigma
    assert table.row("Izz").sigma_error == pytest.approx(100 * 14 / 4449)
    assert compared("2004-08-23", sigma=np.full((3, 3), 5.0)).row("Ixz").verdict == "not met"
    text = str(table).splitlines()
    assert len(text) == 9 and "+5.08 %" in text[4] and text[6].endswith("75 open")
    record = table.record()
    assert [c["name"] for c in record["components"]] == list(ROWS)
    assert record["components"][0]["error"] is None and record["components"][3]["error_percent"] is None


@pytest.mark.parametrize("factor, words", [
    (np.pi / 180, ["body rates deg/s labelled rad/s"]),
    (30 / np.pi, ["wheel rates rpm labelled rad/s"]),
    (1e-3, ["body rates mrad/s labelled rad/s"]),
    (1e3, ["wheel rates mrad/s labelled rad/s"]),
    (1.1, []),
])  # fmt: skip
def test_a_units_factor_is_doubted(factor, words):
    p = predicted_inertia(CASSINI, None)
    said = compare_inertia(factor * p.inertia_kgm2, p).doubts.of(doubt.WRONG_UNIT)
    assert len(said) == bool(words) and all(w in said[0].about["guesses"] for w in words)
    lopsided = factor * p.inertia_kgm2 * np.diag([1, 3, 1]) if factor != 1.1 else p.inertia_kgm2
    assert not compare_inertia(lopsided, p).doubts.has(doubt.WRONG_UNIT)


def test_moments_far_from_the_prediction_are_doubted_by_its_own_sigma():
    p = predicted_inertia(CASSINI, None)  # known to 5 %
    I_B = p.inertia_kgm2
    assert compare_inertia(1.3 * I_B, p).doubts.has(doubt.OFF_SCALE)
    assert not compare_inertia(1.2 * I_B, p).doubts.has(doubt.OFF_SCALE)
    assert compare_inertia(1.2 * I_B, replace(p, share=0.03)).doubts.has(doubt.OFF_SCALE)
    one = I_B * np.where(np.eye(3) * [1, 0, 0], 1.3, 1.0)
    assert compare_inertia(one, p).doubts.of(doubt.FAR_FROM_PREDICTION).about(element="Ixx")
    loose = 0.1 * np.abs(I_B)
    assert not compare_inertia(one, p, sigma=loose).doubts.has(doubt.FAR_FROM_PREDICTION)


def test_a_tensor_no_body_has_is_doubted():
    p = predicted_inertia(CASSINI, None)
    for I_B, words in (
        (np.diag([1.0, 1.0, 3.0]), "triangle margin"),
        (np.diag([-1.0, 5.0, 5.0]), "smallest principal moment"),
    ):
        assert compare_inertia(I_B, p).doubts.of(doubt.IMPOSSIBLE).about(quantity=words)


def test_which_prediction_is_taken():
    late = predicted_inertia(CASSINI, int(utc_to_tai_ns("2015-09-29T00:00:00")))
    assert late.date == "2004-12-25" and late.doubts.of(doubt.OLD_PREDICTION).about(date="2015-09-29")
    given = predicted_inertia(load_craft("cassini", inertia=(5, 5, 5, 0, 0, 0)), None)
    assert given.source == "given by the user" and not given.doubts and given.inertia_kgm2[0, 0] == 5
    ratios = load_craft("inspiresat1")
    p = predicted_inertia(ratios, None)
    assert p.doubts.has(doubt.NO_PREDICTION)
    table = compare_inertia(1.05 * p.inertia_kgm2, p, relative=True)
    assert table.unit == "per spin inertia" and table.row("Ixy").verdict is None and table.row("Ixx").verdict is None
    with pytest.raises(BadInput, match="no inertia to compare"):
        predicted_inertia(CASSINI.model_copy(update={"mass_properties": ()}), None)
    assert Prediction(np.eye(3), "predicted", "", "").doubts == ()
