"""Tables in memory: the same channels from DataFrames, Datasets and arrays as from a file; and back."""

import numpy as np
import pandas as pd
import pytest

from asflown import load_telemetry
from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS, tai_to_datetime64, utc_to_tai_ns

ZERO = utc_to_tai_ns("2023-08-11T10:00:00")
T = np.arange(30.0)
W = 100 + 0.1 * T
STAMPS = pd.Timestamp("2023-08-11T10:00:00") + pd.to_timedelta(T, unit="s")


def sources():
    xarray = pytest.importorskip("xarray")
    units = {"units": "rad/s"}
    yield "columns", pd.DataFrame({"time [utc]": STAMPS.strftime("%Y-%m-%dT%H:%M:%S"), "wheel_rate_A [rad/s]": W})
    yield "index of dates", pd.DataFrame({"wheel_rate_A [rad/s]": W}, index=STAMPS)
    yield (
        "index with a zone",
        pd.DataFrame({"wheel_rate_A [rad/s]": W}, index=STAMPS.tz_localize("UTC").tz_convert("Europe/Berlin")),
    )
    yield "arrays", {"time": (1691748000 + T, "unix s"), "wheel_rate_A": (W, "rad/s")}
    yield "decoded dataset", xarray.Dataset({"wheel_rate_A": ("time", W, units)}, {"time": STAMPS.to_numpy()})
    yield (
        "dataset",
        xarray.Dataset(
            {"wheel_rate_A": ("time", W, units)}, {"time": ("time", T, {"units": "seconds since 2023-08-11T10:00:00"})}
        ),
    )


@pytest.mark.parametrize(("name", "data"), list(sources()), ids=[n for n, _ in sources()])
def test_law_a_table_in_memory_is_read_as_a_file(name, data):
    t = load_telemetry(data)
    c = t.channels["wheel_rate_A"]
    assert (c.tai_ns == ZERO + np.arange(30) * NS).all() and (c.values == W).all()
    assert len(t.sha256) == 64


def test_law_missing_values_are_blanks_and_a_dictionary_may_be_a_dict():
    frame = pd.DataFrame({"T": T, "W": pd.array([None, *W[1:]], dtype="Float64")})
    said = {"time": {"column": "T"}, "channel": [{"column": "W", "name": "wheel_rate_A", "unit": "rpm"}]}
    c = load_telemetry(frame, channels=said).channels["wheel_rate_A"]
    assert len(c.values) == 29 and c.values == pytest.approx(W[1:] * np.pi / 30)


@pytest.mark.parametrize(
    "data",
    [
        {"time [s]": T, "wheel_rate_A [rad/s]": W[:-1]},
        {"time [s]": T, "wheel_rate_A": W},
        3.5,
        {"time [s]": T, "wheel_rate_A [kg]": W},
        {"time [s]": T, "body_rate_x [rad/s]": np.zeros((30, 3))},
    ],
)
def test_law_what_is_no_table_is_one_clear_error(data):
    with pytest.raises(BadInput) as why:
        load_telemetry(data)
    assert why.value.remedy


def test_law_telemetry_goes_out_and_comes_back():
    t = load_telemetry({"time [unix s]": 1691748000 + T, "wheel_rate_A [rpm]": W, "body_rate_x [rad/s]": 1e-3 * W})
    back = load_telemetry(t.to_xarray())
    for name, c in t.channels.items():
        assert (back.channels[name].tai_ns == c.tai_ns).all() and (back.channels[name].values == c.values).all()
    frame = t.to_pandas()
    assert (
        frame.index.name == "time_s"
        and list(frame) == ["wheel_rate_A [rad/s]", "body_rate_x [rad/s]"]
        and len(frame) == 30
    )
    assert len(t.plot().axes) == 2 and len(t.plot(["body_rate_x"]).axes) == 1


def test_law_dates_out_are_utc():
    for stamp in ("2016-12-31T23:59:59", "2017-01-01T00:00:00", "1999-07-01T12:00:00.5"):
        assert tai_to_datetime64(np.array([utc_to_tai_ns(stamp)]))[0] == np.datetime64(stamp, "ns")
