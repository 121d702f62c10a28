"""Tables of maneuvers as people keep them, read by a dictionary."""

import numpy as np
import pytest

from asflown import load_maneuvers
from asflown.kit.errors import BadInput

TABLE = """Burn;State;Size;Over;U;Aim X;Aim Y;OD;When
OTM-1;flown;10,0;1,5;%;2,0;-1,0;4e-10;2012-10-01 00:00:00
OTM-2;cancelled;;;;;;;2012-10-11 00:00:00
OTM-3;Flown;20,0;50;mm/s;1,0;0,5;9e-10;2012-10-21 00:00:00
"""
COLUMNS = {
    "column": [
        {"column": "Burn", "name": "id"}, {"column": "Size", "name": "dv", "unit": "cm/s"},
        {"column": "Over", "name": "magnitude_error", "unit_column": "U"},
        {"column": "Aim X", "name": "pointing_error_x", "unit": "mrad"}, {"column": "Aim Y", "name": "pointing_error_y", "unit": "arcmin"},
        {"column": "OD", "name": "sigma_magnitude", "unit": "m/s", "variance": True}, {"column": "When", "name": "time", "unit": "utc"},
    ],
    "status": {"column": "State", "used": ["flown"]},
}  # fmt: skip


def written(tmp_path, text=TABLE):
    (tmp_path / "burns.csv").write_text(text)
    return tmp_path / "burns.csv"


def test_law_shares_angles_and_variances_of_a_dictionary(tmp_path):
    m = load_maneuvers(written(tmp_path), columns=COLUMNS)
    assert m.id == ("OTM-1", "OTM-3") and m.excluded == (("OTM-2", "cancelled"),)
    assert np.allclose(m.dv_mps, [0.1, 0.2]) and np.allclose(m.magnitude_error_mps, [0.0015, 0.05])
    assert np.allclose(m.sigma_magnitude_mps, [2e-5, 3e-5])
    arcmin = np.pi / 180 / 60
    assert np.allclose(m.pointing_error_mps, [[2e-4, -0.1 * arcmin], [2e-4, 0.1 * arcmin]])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"unit": "furlong"}, "furlong"), ({"unit": "kg"}, "kg"), ({"name": "dv2"}, "dv2"), ({"column": "Szie"}, "Szie"),
        ({"variance": True}, "variance"), ({"colour": 1}, "colour"),
    ],
)  # fmt: skip
def test_a_wrong_dictionary_is_one_clear_complaint(tmp_path, change, says):
    first, size, *rest = COLUMNS["column"]
    with pytest.raises(BadInput) as why:
        load_maneuvers(written(tmp_path), columns=COLUMNS | {"column": [first, size | change, *rest]})
    assert says in str(why.value)


def test_a_unit_that_does_not_fit_is_told_with_its_line(tmp_path):
    with pytest.raises(BadInput) as why:
        load_maneuvers(written(tmp_path, TABLE.replace("mm/s", "mrad")), columns=COLUMNS)
    assert why.value.line == 4 and why.value.channel == "magnitude_error"


def test_law_a_frame_and_a_file_agree(tmp_path):
    pandas = pytest.importorskip("pandas")
    plain = {
        "id": ["a", "b"], "engine": ["rcs", "rcs"], "dv [m/s]": [0.1, 0.2], "magnitude_error [mm/s]": [1.0, -2.0],
        "sigma_magnitude [mm/s]": [0.1, 0.1],
    }  # fmt: skip
    pandas.DataFrame(plain).to_csv(tmp_path / "m.csv", index=False)
    of_file, of_frame, of_dict = (load_maneuvers(x) for x in (tmp_path / "m.csv", pandas.DataFrame(plain), plain))
    with_units = {k.split(" ")[0]: (v, k[k.index("[") + 1 : -1]) if "[" in k else v for k, v in plain.items()}
    for m in (of_frame, of_dict, load_maneuvers(with_units)):
        assert m.id == of_file.id and np.array_equal(m.magnitude_error_mps, of_file.magnitude_error_mps)
    with pytest.raises(BadInput) as why:
        load_maneuvers(plain | {"dv [m/s]": [0.1]})
    assert "dv" in str(why.value)
