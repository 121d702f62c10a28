"""A craft of which only a predicted inertia is known: used, with a wide sigma, and said."""

import pytest

from asflown.craft.load import load_craft
from asflown.craft.model import PREDICTED
from asflown.estimate.firing import thrust_priors
from asflown.estimate.leak import leak_known
from asflown.estimate.subject import subject_of
from asflown.estimate.torque import torque
from asflown.kit.errors import BadInput
from asflown.telemetry.load import load_telemetry
from cli.program import csv_text, flight
from flights import CASSINI

FLOWN = "7362 6130 3750 -164 -12 149 kg m2"


def craft(tmp_path, *entries: str):
    """Cassini with other mass properties."""
    text = "\n".join(
        f'[[mass_properties]]\ndate = "2004-12-25"\npiece = "p"\ninertia = "{FLOWN}"\n{entry}\n' for entry in entries
    )
    path = tmp_path / "c.toml"
    path.write_text(f'name = "other"\n{text}')
    own = load_craft(path)
    return CASSINI.model_copy(update={"mass_properties": own.mass_properties})


def torque_of(vessel, tmp_path):
    (tmp_path / "t.csv").write_text(csv_text(flight()))
    return torque(load_telemetry(tmp_path / "t.csv"), vessel, method="fused", axis="y", prior="matern")


def test_law_a_predicted_inertia_is_used_with_a_wide_sigma_and_said(tmp_path):
    vessel = craft(tmp_path, 'basis = "predicted"')
    now = vessel.at(None)
    assert now.inertia_kgm2[0, 0] == 7362 and vessel.inertia_share == 0.05
    assert now.doubts.has(PREDICTED) and "5 %" in str(now.doubts.of(PREDICTED)[0])
    assert thrust_priors(vessel).inertia_share == 0.05 and leak_known(vessel).inertia_share == 0.05
    assert leak_known(vessel, inertia_share=0.02).inertia_share == 0.02
    result = torque_of(vessel, tmp_path)
    assert result.doubts.has(PREDICTED)


@pytest.mark.parametrize(
    ("entry", "share"), [('basis = "predicted"\nsigma = "30 %"', 0.3), ("sigma = 0.02", 0.02), ("", 0.01)]
)
def test_law_the_stated_sigma_reaches_what_an_estimate_is_about(entry, share, tmp_path):
    (tmp_path / "t.csv").write_text(csv_text(flight()))
    assert subject_of(load_telemetry(tmp_path / "t.csv"), craft(tmp_path, entry)).inertia_share == share


def test_law_an_estimated_inertia_leaves_predictions_aside(tmp_path):
    vessel = craft(tmp_path, 'basis = "predicted"', 'basis = "estimated"')
    assert vessel.inertia_share is None and not vessel.at(None).doubts.has(PREDICTED)
    assert CASSINI.inertia_share is None


@pytest.mark.parametrize("sigma", ["0", "1.5", '"-3 %"', '"3 kg"'])
def test_a_sigma_that_is_no_share_is_refused(sigma, tmp_path):
    with pytest.raises(BadInput, match="sigma"):
        craft(tmp_path, f"sigma = {sigma}")
