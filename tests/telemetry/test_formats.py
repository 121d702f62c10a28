"""Typed files: the same channels from Parquet, NetCDF, HDF5, FITS, CDF, MATLAB and Excel."""

import numpy as np
import pytest

from asflown import load_telemetry
from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS, utc_to_tai_ns

ZERO = "2023-08-11T10:00:00"
T = np.arange(20.0)
W = np.stack([100 + 0.1 * T, -90 + 0.2 * T, 150 - 0.1 * T], axis=1)

DICTIONARY = """
[time]
column = "time"
epoch = "2023-08-11T10:00:00"
[[channel]]
column = "rates_1"
name = "wheel_rate_A"
unit = "rad/s"
[[channel]]
column = "rates_3"
name = "wheel_rate_C"
unit = "rad/s"
"""


def by_dictionary(path):
    (path.parent / "d.toml").write_text(DICTIONARY)
    return load_telemetry(path, channels=path.parent / "d.toml")


def check(telemetry, names=("wheel_rate_A", "wheel_rate_C")):
    assert telemetry.epoch_ns == utc_to_tai_ns(ZERO)
    for name, k in zip(names, (0, 2), strict=True):
        c = telemetry.channels[name]
        assert (c.tai_ns - telemetry.epoch_ns == (T * NS).astype(np.int64)).all()
        assert c.values == pytest.approx(W[:, k], rel=1e-15)


def test_law_netcdf_arrays_are_columns(tmp_path):
    import xarray

    data = xarray.Dataset(
        {
            "wheel_rate": (("time", "wheel"), W, {"units": "rad/s"}),
            "body_rate": (("time", "axis"), 1e-3 * W, {"units": "rad/s"}),
        },
        {"time": ("time", T, {"units": f"seconds since {ZERO}"})},
    )
    data.to_netcdf(tmp_path / "t.nc", engine="h5netcdf")
    t = load_telemetry(tmp_path / "t.nc")
    check(t, ("wheel_rate_1", "wheel_rate_3"))
    assert t.channels["body_rate_z"].values == pytest.approx(1e-3 * W[:, 2])


@pytest.mark.parametrize(("calendar", "offset"), [("standard", 0), ("proleptic_gregorian", 0), (None, 0), ("utc", 27)])
def test_law_calendars_of_cf_count_no_leap_seconds(tmp_path, calendar, offset):
    import xarray

    attributes = {"units": "seconds since 1970-01-01"} | ({"calendar": calendar} if calendar else {})
    xarray.Dataset(
        {"wheel_rate_A": ("time", W[:, 0], {"units": "rad/s"})}, {"time": ("time", 1691748000 + T, attributes)}
    ).to_netcdf(tmp_path / "t.nc", engine="h5netcdf")
    first = load_telemetry(tmp_path / "t.nc").channels["wheel_rate_A"].tai_ns[0]
    # 27 leap seconds lie between; SI seconds since 1970 count them, and 2 ms of the drift before 1972
    assert abs(int(first) + offset * NS - int(utc_to_tai_ns(ZERO))) < (3 * NS if offset else 1)


def test_law_a_calendar_without_leap_days_is_refused(tmp_path):
    import xarray

    xarray.Dataset(
        {"wheel_rate_A": ("time", W[:, 0], {"units": "rad/s"})},
        {"time": ("time", T, {"units": "days since 2000-01-01", "calendar": "noleap"})},
    ).to_netcdf(tmp_path / "t.nc", engine="h5netcdf")
    with pytest.raises(BadInput, match="noleap"):
        load_telemetry(tmp_path / "t.nc")


@pytest.mark.parametrize(
    "attributes",
    [
        {"FILLVAL": -1e31},
        {"missing_value": -1e31},
        {"VALIDMIN": -500.0, "VALIDMAX": 500.0},
        {"valid_range": [-500.0, 500.0]},
    ],
)
def test_law_declared_fill_values_and_ranges_are_heeded(tmp_path, attributes):
    import xarray

    values = W[:, 0].copy()
    values[5:9] = -1e31
    xarray.Dataset(
        {"wheel_rate_A": ("time", values, {"units": "rad/s", **attributes})},
        {"time": ("time", T, {"units": f"seconds since {ZERO}"})},
    ).to_netcdf(tmp_path / "t.nc", engine="h5netcdf")
    c = load_telemetry(tmp_path / "t.nc").channels["wheel_rate_A"]
    assert len(c.values) == 16 and c.values.min() > 0


def test_law_groups_of_hdf5_are_read(tmp_path):
    import h5py

    with h5py.File(tmp_path / "t.h5", "w") as file:
        group = file.create_group("adcs")
        clock = group.create_dataset("time", data=T)
        clock.attrs["units"] = f"seconds since {ZERO}"
        clock.make_scale("time")
        for k, name in enumerate("ABC"):
            d = group.create_dataset(f"wheel_rate_{name}", data=W[:, k])
            d.attrs["units"] = "rad/s"
            d.dims[0].attach_scale(clock)
    check(load_telemetry(tmp_path / "t.h5"))


def test_law_fits_tables_are_read(tmp_path):
    from astropy.io import fits

    columns = [fits.Column("time", "D", "s", array=T), fits.Column("rates", "3D", "rad/s", array=W)]
    fits.BinTableHDU.from_columns(columns).writeto(tmp_path / "t.fits")
    check(by_dictionary(tmp_path / "t.fits"))


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_law_matlab_files_are_read(tmp_path, version):
    path = tmp_path / "t.mat"
    if version == "5":
        from scipy.io import savemat

        savemat(path, {"time": T, "rates": W})
    else:
        import h5py

        with h5py.File(path, "w", userblock_size=512) as file:
            file["time"], file["rates"] = T[None, :], W.T  # MATLAB stores columns first
        with path.open("r+b") as raw:
            raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    check(by_dictionary(path))


def test_law_excel_sheets_are_read(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Export of pass 12"])
    sheet.append(["time", "rates_1", "rates_2", "rates_3"])
    for t, w in zip(T.tolist(), W.tolist(), strict=True):
        sheet.append([t, *w])
    book.create_sheet("notes")
    book.save(tmp_path / "t.xlsx")
    t = by_dictionary(tmp_path / "t.xlsx")
    check(t)
    assert any("sheet" in f.detail for f in t.findings if f.what == "form")


def test_law_cdf_files_are_read(tmp_path):
    cdflib = pytest.importorskip("cdflib")
    from cdflib.cdfwrite import CDF

    file = CDF(str(tmp_path / "t.cdf"), delete=True)
    epoch = cdflib.cdfepoch.compute_tt2000([[2023, 8, 11, 10, 0, int(s), 0, 0, 0] for s in T])
    file.write_var(
        {"Variable": "Epoch", "Data_Type": 33, "Num_Elements": 1, "Rec_Vary": True, "Dim_Sizes": []},
        var_data=np.array(epoch),
    )
    values = W[:, 0].copy()
    values[4] = -1e31
    file.write_var({"Variable": "wheel_rate_A", "Data_Type": 45, "Num_Elements": 1, "Rec_Vary": True, "Dim_Sizes": []},
                   var_attrs={"DEPEND_0": "Epoch", "UNITS": "rad/s", "FILLVAL": -1e31}, var_data=values)  # fmt: skip
    file.close()
    (tmp_path / "d.toml").write_text(
        '[time]\ncolumn = "time_Epoch"\nformat = "utc"\n[[channel]]\ncolumn = "wheel_rate_A"\nname = "wheel_rate_A"\nunit = "rad/s"\n'
    )
    c = load_telemetry(tmp_path / "t.cdf", channels=tmp_path / "d.toml").channels["wheel_rate_A"]
    assert len(c.values) == 19 and c.tai_ns[0] == utc_to_tai_ns(ZERO)


def test_law_more_numbers_than_memory_holds_are_refused_before_they_are_read(tmp_path):
    import h5py

    with h5py.File(tmp_path / "t.h5", "w") as file:
        file.create_dataset("time", shape=(2_000_000_000,), dtype="f8", chunks=(1_000_000,), compression="gzip")
    with pytest.raises(BadInput, match="numbers"):
        load_telemetry(tmp_path / "t.h5")


@pytest.mark.parametrize("suffix", ["parquet", "nc", "fits", "cdf", "mat", "xlsx"])
@pytest.mark.parametrize(
    "content",
    [
        b"PK\x03\x04",
        b"SIMPLE  =",
        b"\xcd\xf3\x00\x01\x00\x00",
        b"MATLAB 5.0 MAT-file",
        b"PAR1",
        b"\x89HDF\r\n\x1a\n",
        b"CDF\x01",
    ],
)
def test_law_a_damaged_file_is_one_clear_error(tmp_path, suffix, content):
    (tmp_path / f"t.{suffix}").write_bytes(content + b"\x00" * 40)
    with pytest.raises(BadInput):
        load_telemetry(tmp_path / f"t.{suffix}")


def test_law_only_plain_files_are_read(tmp_path):
    import os

    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero", tmp_path):
        with pytest.raises(BadInput):
            load_telemetry(path)
