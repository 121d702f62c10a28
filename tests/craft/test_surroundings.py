"""The tables of a craft file for what acts on it in orbit: read, refused, and told by craft check."""

from pathlib import Path

import numpy as np
import pytest

from asflown.craft.abilities import abilities
from asflown.craft.load import load_craft
from asflown.craft.surroundings import Aerodynamics, Facet, Magnetics, OrbitElements, Sunlight, TorqueRod
from asflown.craft.template import craft_template, outline
from asflown.kit.errors import BadInput

ORBIT = """
[orbit]
body = "Earth"
epoch = "2026-06-01T00:00:00Z"
semi_major_axis = "6878 km"
eccentricity = 0.001
inclination = "97.4 deg"
ascending_node = "47 deg"
argument_of_perigee = "90 deg"
mean_anomaly = "0 deg"
"""
FACET = '{ area = "1 m2", normal = "0 0 1", center = "0 0 0.5 m" }'
LEVER = 'lever = "0 6e-6 -1e-5 N m"'


def craft(tmp_path, text: str):
    path = tmp_path / "mine.toml"
    path.write_text(f'name = "mine"\n{text}')
    return load_craft(path)


def test_a_craft_file_says_what_acts_on_it(tmp_path):
    text = f"""{ORBIT}
[magnetics]
residual_dipole = "0.2 0.1 -0.2 A m2"
[[torque_rods]]
name = "MTX"
axis = "1 0 0"
max_dipole = "15 A m2"
[sunlight]
{LEVER}
sigma = "2 uN m"
[aerodynamics]
facets = [{FACET}]
drag_coefficient = 2.2
"""
    c = craft(tmp_path, text)
    assert c.orbit.semi_major_axis == 6.878e6 and c.orbit.inclination == pytest.approx(np.radians(97.4))
    assert np.allclose(c.magnetics.residual_dipole_Am2, [0.2, 0.1, -0.2]) and c.magnetics.sigma_Am2 == pytest.approx(
        0.09
    )
    assert c.torque_rods[0].max_dipole == 15.0
    assert np.allclose(c.sunlight.lever_Nm, [0, 6e-6, -1e-5]) and c.sunlight.sigma_Nm == pytest.approx(2e-6)
    assert c.aerodynamics.in_orbit and not c.aerodynamics.in_flyby and c.aerodynamics.lever_Nm is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            ORBIT.replace("6878 km", "500 km"),
            "orbit: the perigee is 499.5 km from the Earth's centre, below its surface",
        ),
        (ORBIT.replace("6878 km", "6878 Mm"), "beyond the Earth's reach"),
        (ORBIT.replace("97.4 deg", "97.4"), "orbit.inclination: '97.4' has no unit"),
        (ORBIT.replace("97.4 deg", "97.4 rad"), "orbit.inclination"),
        (ORBIT.replace("0.001", "1.2"), "orbit.eccentricity"),
        (ORBIT.replace("Earth", "Mars"), "orbit.body"),
        (
            '[magnetics]\nresidual_dipole = "1 0 0 N m"',
            "magnetics.residual_dipole: the unit [N m] does not convert to [A m2]",
        ),
        ('[magnetics]\nsigma = "1 A m2"', "magnetics.residual_dipole"),
        (
            '[[torque_rods]]\nname = "A"\naxis = "1 1 0"\nmax_dipole = "1 A m2"',
            "torque rod 'A': the axis is not a unit vector",
        ),
        ('[sunlight]\nlever = "0 0 0.1 m"', "sunlight.lever: the unit [m] does not convert to [N m]"),
        (f"[sunlight]\n{LEVER}\nfacets = [{FACET}]", "both lever and facets"),
        ("[sunlight]", "[sunlight] needs lever (three torques in N m) or facets"),
        (
            f"[sunlight]\nfacets = [{FACET[:-1]}, specular = 0.7, diffuse = 0.6 }}]",
            "specular and diffuse together reflect 1.3",
        ),
        (f"[aerodynamics]\n{LEVER}", "lever needs reference_density beside it"),
        (f"[aerodynamics]\nfacets = [{FACET}]", "facets needs drag_coefficient beside it"),
        ("[aerodynamics]\ndrag_coefficient = 2.2", "[aerodynamics] needs lever"),
        ('[aerodynamics]\nprojected_area = "2 m2"', "projected_area needs drag_coefficient"),
        (f"[aerodynamics]\ndrag_coefficient = 2\nfacets = [{FACET[:-1]}, specular = 0.1 }}]", "belong to [sunlight]"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(text, said, tmp_path):
    with pytest.raises(BadInput) as why:
        craft(tmp_path, text)
    assert said in str(why.value) and "mine.toml" in str(why.value)


def test_craft_check_says_what_the_sources_start_from(tmp_path):
    notes = {a.verb: a for a in abilities(load_craft("pyramid"))}
    assert notes["sources"].can and "no [" not in notes["sources"].note
    assert "gravity-gradient, sunlight, dipole, drag" in notes["torque"].note
    bare = {a.verb: a.note for a in abilities(load_craft("iss"))}
    assert "no [orbit]" in bare["sources"] and "no [magnetics], [sunlight], [aerodynamics]" in bare["sources"]


def test_every_line_that_the_template_offers_is_valid(tmp_path):
    """All comments that hold a key, made keys."""
    lines = craft_template("mine", outline(4, None)).splitlines()
    keys = [n.removeprefix("# ") for n in lines if n.startswith(("# [", "# ")) and ("= " in n or n.startswith("# ["))]
    c = craft(tmp_path, "\n".join(n for n in keys if not n.startswith(("torque_constant", "rate_limit"))))
    assert c.orbit and c.magnetics and c.torque_rods and c.sunlight and c.aerodynamics.in_orbit and c.wheel_controller


def test_the_page_names_every_key():
    page = (Path(__file__).resolve().parents[2] / "docs" / "craft.md").read_text(encoding="utf-8")
    for model in (OrbitElements, Magnetics, TorqueRod, Sunlight, Aerodynamics, Facet):
        missing = [key for key in model.model_fields if f"`{key}`" not in page and f"{key} = " not in page]
        assert not missing, (model.__name__, missing)
