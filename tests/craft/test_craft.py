"""The vehicle: what the papers print, by date, and what a wrong file is told."""

import numpy as np
import pytest

from asflown.craft.load import built_in_crafts, load_craft
from asflown.craft.model import INTERPOLATED
from asflown.kit.errors import BadInput
from asflown.kit.timeline import utc_to_tai_ns
from flights import CASSINI


def on(date):
    return CASSINI.at(utc_to_tai_ns(date))


def test_published_wheel_axes_are_the_matrix_of_000_eq_7():
    T = np.array([w.axis for w in on("2015-09-29").wheels]).T
    r2, r3, r6 = np.sqrt([2, 3, 6])
    assert np.allclose(T, [[0, -1 / r2, 1 / r2], [r2 / r3, -1 / r6, -1 / r6], [1 / r3] * 3], atol=1e-12)
    assert np.allclose(T @ T.T, np.eye(3), atol=1e-12)
    assert np.allclose(np.degrees(np.arccos(T[2])), 54.7356, atol=5e-5)  # degrees, printed in 001


def test_published_spin_inertias_of_004_and_001():
    assert [w.spin_inertia for w in on("2008-03-12").wheels] == [0.16138, 0.15947, 0.16138]  # kg m2
    rounded = load_craft("cassini@001-rounded").at(utc_to_tai_ns("2005-01-28"))
    assert [w.spin_inertia for w in rounded.wheels] == [0.161, 0.160, 0.161]


def test_published_wheel_four_takes_the_place_of_three_on_2003_07_11():
    assert [w.name for w in on("2003-07-10T23:59:59").wheels] == ["RWA1", "RWA2", "RWA3"]
    assert [w.name for w in on("2003-07-11T00:00:00").wheels] == ["RWA1", "RWA2", "RWA4"]
    assert on("2003-07-10").wheel("RWA3").axis == on("2003-07-12").wheel("RWA4").axis


def test_published_controller_gains():
    k = CASSINI.wheel_controller
    assert k.kd_per_s == pytest.approx(0.15548, abs=5e-6)  # 000 eq 15
    assert k.kp_per_s * k.kd_per_s == pytest.approx(0.03529, abs=5e-6)


@pytest.mark.parametrize(
    ("date", "moments"),
    [("2000-03-15", (8655.2, 7922.7, 4586.2)), ("2004-09-15", (7637, 6948, 4223)),
     ("2008-03-12", (6957.6, 5751.5, 3640.4))],
)  # fmt: skip
def test_published_moments_of_inertia(date, moments):
    assert np.allclose(np.diag(on(date).inertia_kgm2), moments)


def test_published_cover_is_two_percent_of_iyy():
    now = on("2015-09-29")
    assert now.inertia_kgm2[1, 1] == 5333  # kg m2, 000 footnote
    assert now.effective_inertia("cover")[1, 1] == pytest.approx(0.98 * 5333, abs=0.5)


def test_inertia_between_dates_lies_between_and_says_so():
    then = on("2006-08-01")
    assert 5751.5 < then.inertia_kgm2[1, 1] < 6130
    assert then.doubts.has(INTERPOLATED)


def test_nothing_is_interpolated_across_the_probe_release():
    assert on("2004-12-24").inertia_kgm2[1, 1] == 6948
    assert on("2004-12-26").inertia_kgm2[1, 1] == pytest.approx(6130, abs=1)


def test_law_every_published_tensor_belongs_to_a_body():
    for name in built_in_crafts():
        for m in load_craft(name).mass_properties:
            w = np.linalg.eigvalsh(np.array(m.elements[:3]) * np.eye(3))
            assert w[0] > 0 and w[0] + w[1] > w[2]


def test_propellant_decides_where_the_ledger_covers_the_dates(tmp_path):
    text = """
name = "tank"
[[mass_properties]]
date = "2020-01-01"
piece = "a"
inertia = "100 100 100 0 0 0 kg m2"
[[mass_properties]]
date = "2022-01-01"
piece = "a"
inertia = "80 80 80 0 0 0 kg m2"
[[propellant]]
date = "2020-01-01"
used = "0 kg"
[[propellant]]
date = "2020-02-01"
used = "90 kg"
[[propellant]]
date = "2022-01-01"
used = "100 kg"
"""
    path = tmp_path / "tank.toml"
    path.write_text(text)
    assert load_craft(path).at(utc_to_tai_ns("2020-02-01")).inertia_kgm2[0, 0] == pytest.approx(82)  # 90 % burnt


def test_an_inertia_given_is_used_as_given():
    craft = load_craft("cassini", inertia=(6570, 5333, 3400, -122, -10, 118))
    for date in ("2004-01-01", "2015-09-29"):
        now = craft.at(utc_to_tai_ns(date))
        assert now.inertia_kgm2[0, 1] == -122 and now.doubts == ()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("0.16138 kg m2", "0.16138"), "unit"),
        (("0.16138 kg m2", "0.16138 kg"), "does not convert"),
        (("damping = 0.4138", "damping = 0.4138\ncolour = 3"), "unknown key"),
        (("0 0.816496580927726", "0 0.9"), "unit vector"),
        (("6510 5333 3519", "6510 5333 300"), "no rigid body"),
        (("[wheel_controller]", "[wheel_controller"), "not a TOML"),
        (('date = "2000-03-15"', 'date = "soon"'), "not a time"),
    ],
)
def test_a_wrong_file_is_told_what_and_where(tmp_path, change, words):
    from importlib import resources

    text = (resources.files("asflown.craft") / "profiles" / "cassini.toml").read_text()
    assert change[0] in text
    path = tmp_path / "bad.toml"
    path.write_text(text.replace(*change, 1))
    with pytest.raises(BadInput, match=words) as why:
        load_craft(path)
    assert "bad.toml" in str(why.value) and len(str(why.value)) < 1500


def test_an_unknown_craft_names_the_known_ones():
    with pytest.raises(BadInput, match="cassini, inspiresat1, iss"):
        load_craft("casini")


def test_thrust_falls_with_the_tank_and_steps_at_its_recharge():
    """001 section V: 0.97 N at launch, 0.75 and 0.69 N at Saturn; the tank was to be recharged in April 2006."""

    def at(date: str) -> float:
        return CASSINI.thrust_at(int(utc_to_tai_ns(date)))

    assert [at("1997-01-01"), at("2004-06-30"), at("2005-01-14")] == [0.97, 0.75, 0.69]
    assert 0.75 < at("2001-01-01") < 0.97
    assert at("2006-04-14") == 0.69 and at("2006-04-15") == at("2008-01-01") == 1.01


def _law(tmp_path, **keys):
    said = {"bandwidth": '"0.03 Hz"', "damping": "0.8"} | keys
    (tmp_path / "c.toml").write_text(
        'name = "c"\n[wheel_controller]\n' + "\n".join(f"{k} = {v}" for k, v in said.items())
    )
    return load_craft(tmp_path / "c.toml").wheel_controller


def test_law_frequencies_are_in_hertz_or_radians_a_second(tmp_path):
    section = '{{ natural_frequency = "{}", damping = 0.7 }}'
    a = _law(tmp_path, bandwidth='"0.5 Hz"', rate_filter=section.format("2 Hz"))
    b = _law(tmp_path, bandwidth=f'"{np.pi} rad/s"', rate_filter=section.format(f"{4 * np.pi} rad/s"))
    assert (a.kp_per_s, a.kd_per_s) == pytest.approx((b.kp_per_s, b.kd_per_s))
    assert a.rate_filter.natural_frequency == pytest.approx(b.rate_filter.natural_frequency) == pytest.approx(4 * np.pi)


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [("bandwidth", "0.03", "no unit"), ("bandwidth", '"2 deg"', "deg"), ("inertia", '"1 1 5 0 0 0 kg m2"', "no rigid body"),
     ("gyroscopic", '"sometimes"', "gyroscopic")],
)  # fmt: skip
def test_a_law_that_cannot_be_is_refused(tmp_path, key, value, told):
    with pytest.raises(BadInput, match=told):
        _law(tmp_path, **{key: value})
