"""Typed files as tables: Parquet, NetCDF and HDF5, FITS, CDF, MATLAB and Excel.  A reader gives headings and cells, no meaning."""

from __future__ import annotations

import math
import warnings
from datetime import date, datetime, timedelta
from typing import TYPE_CHECKING, Any
from zipfile import ZipFile

import numpy as np

from ..kit.errors import BadInput, some_of
from ..kit.progress import stage
from ..kit.reading import limit
from ..kit.timeline import utc_to_posix_ns
from .channels import member_names
from .probe import check_hdf5
from .tables import Table, checked, quiet_database, quoted_pattern, said, share_done, typed
from .text import form_of_rows
from .times import NotATime, exact_ns, scale_called

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

#: Numbers in one file that are unpacked into memory at most.
LARGEST_CELLS = limit("CELLS", 400_000_000)
#: A file that declares more times its own size than any packing gives, and more than this, is damaged or a trap. [bytes]
_PACKING, _SUSPICIOUS = 1100, 64_000_000
#: A workbook is unpacked up to this size: its cells take thirty times as much in Python. [bytes]
LARGEST_WORKBOOK = limit("WORKBOOK_BYTES", 100_000_000)
#: Calendars of CF that count as UTC without leap seconds, as xarray and netCDF4 write them; 'utc' counts SI seconds.
_CALENDARS = ("standard", "gregorian", "proleptic_gregorian", "utc")
#: Attributes that declare a fill value, and the ends of the valid range.
_FILLS = ("FILLVAL", "_FillValue", "missing_value")
_RANGES = (("VALIDMIN", "VALIDMAX"), ("valid_min", "valid_max"))


def damaged(kind: str, why: object) -> BadInput:
    said = str(why).splitlines()
    return BadInput(
        f"the {kind} file cannot be read ({said[0][:200] if said else type(why).__name__})",
        remedy="Copy the file again, or write it anew.",
    )


def needed(package: str, extra: str, kind: str) -> BadInput:
    return BadInput(
        f"{kind} needs the package {package}, which is not installed",
        remedy=f"Install it with: pip install 'asflown[{extra}]'. Or save the table as CSV or Parquet.",
    )


# ---- Parquet ----------------------------------------------------------------------------------------


def read_parquet(path: Path) -> Table:
    """A Parquet file whose column names are header cells; ``epoch`` among its key-value metadata."""

    place = quoted_pattern(path)
    try:
        with quiet_database() as db, stage(f"reading {path.name}", lambda: share_done(db)):
            db.execute("SET TimeZone = 'UTC'")
            rows = db.execute("SELECT max(num_rows) FROM parquet_file_metadata(?)", [place]).fetchone()[0]
            columns = db.execute("SELECT count(*) FROM parquet_schema(?)", [place]).fetchone()[0]
            _check_size(rows * columns, path)
            found = db.execute("SELECT * FROM read_parquet(?, hive_partitioning = false)", [place]).fetchnumpy()
            notes = db.execute("SELECT key, value FROM parquet_kv_metadata(?)", [place]).fetchall()
    except BadInput:
        raise
    except Exception as why:  # of DuckDB, and of Arrow's types that numpy lacks
        raise damaged("Parquet", why) from None
    epoch = next((v for k, v in notes if said(k).strip().lower() == "epoch"), None)
    return checked(
        Table(tuple(found), tuple(typed(c) for c in found.values()), epoch=None if epoch is None else said(epoch))
    )


# ---- NetCDF and HDF5 --------------------------------------------------------------------------------


def read_netcdf(path: Path) -> list[Table]:
    """A NetCDF or HDF5 file: one table per time coordinate, in any of its groups, units from the CF attribute ``units``.

    'seconds since …' counts as CF calendars do, without leap seconds; with calendar = 'utc' it counts SI seconds.
    Values that the file declares as fill, or outside a declared range, are blanks.  Raises BadInput for no usable variable."""
    import xarray

    return tables_of_dataset(_groups(path, xarray))


def tables_of_dataset(groups: list) -> list[Table]:
    """One table per time coordinate of xarray Datasets, not decoded or decoded."""
    tables, seen = [], []
    for data in groups:
        seen += [str(n) for n in data.variables]
        for dim in data.sizes:
            clock = _clock(data, dim)
            flags = {f"valid_{n}" for n in data.variables}  # as Telemetry.to_xarray writes them
            others = [
                n for n, v in data.variables.items() if dim in v.dims and n != clock and v.ndim <= 2 and n not in flags
            ]
            if clock is not None and others:
                tables.append(_coordinate_table(data, clock, others))
    if not tables:
        raise BadInput(
            f"no variable has a time coordinate (variables: {some_of(seen)})",
            remedy="Each channel is a variable over a time coordinate, in units 'seconds since …'.",
        )
    return tables


def _groups(path: Path, xarray) -> list:
    """The data sets of a file, its root first."""
    with path.open("rb") as file:
        classic = file.read(3) == b"CDF"
    if not classic:
        check_hdf5(path)
    how: dict[str, Any] = {"engine": "scipy"} if classic else {"engine": "h5netcdf", "phony_dims": "sort"}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            names = [None] if classic else [None, *_group_names(path)]
            found = []
            for name in names:
                at = {} if name is None else {"group": name}
                with xarray.open_dataset(path, decode_times=False, **how, **at) as opened:
                    _check_size(sum(math.prod(v.shape) for v in opened.variables.values()), path)
                    found.append(opened.load())
    except ImportError as why:
        raise BadInput(
            f"HDF5 cannot be read here ({str(why)[:100]})",
            remedy="Install the package it names, or save the table as CSV or Parquet.",
        ) from None
    except BadInput:
        raise
    except Exception as why:  # h5py, h5netcdf and xarray share no base exception
        raise damaged("NetCDF/HDF5", why) from None
    return found


def _group_names(path: Path) -> list[str]:
    import h5py

    names: list[str] = []
    with h5py.File(path, "r") as file:
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Group) else None)
    return names


def _check_size(cells: int, path: Path) -> None:
    """Raise BadInput before more is unpacked than may be, or than the file can hold."""
    if cells > LARGEST_CELLS:
        raise BadInput(
            f"the file declares {cells:.3g} numbers, more than {LARGEST_CELLS:.3g}",
            remedy="Divide the file, keep only the variables that are needed, or set ASFLOWN_MAX_CELLS.",
        )
    size = path.stat().st_size
    if 8 * cells > max(_PACKING * size, _SUSPICIOUS):
        raise BadInput(
            f"the file declares {cells:.3g} numbers and has {size / 1e3:.0f} kB, too little to hold them",
            remedy="Copy the file again, or write it anew.",
        )


def _coordinate_table(data, clock: str, others: list) -> Table:
    heading, epoch, instants = _cf_time(data[clock], data.attrs.get("epoch"))
    headings, blanked = [heading], {}
    times = data[clock].values
    columns: list = [times.astype("timedelta64[ns]").astype(np.int64) if times.dtype.kind == "m" else typed(times)]
    for name in others:
        variable = data[name]
        unit = said(variable.attrs["units"]) if "units" in variable.attrs else None
        for member, values in _members(str(name), variable.transpose(data[clock].dims[0], ...)):
            values, out = _declared(values, variable)
            if out.any():
                blanked[len(columns)] = np.flatnonzero(out)
            headings.append(member if unit is None else f"{member} [{unit}]")
            columns.append(values)
    return checked(
        Table(
            tuple(headings),
            tuple(columns),
            epoch=epoch,
            blanked=blanked,
            instants={} if instants is None else {0: instants},
        )
    )


def _members(name: str, variable) -> Iterable[tuple[str, Any]]:
    """A variable as columns: itself, or the columns of an (N, M) array by their labels, axes or numbers."""
    values = np.asarray(variable.values)
    if values.ndim == 1:
        return [(name, typed(values))]
    labels = variable.coords[variable.dims[1]].values if variable.dims[1] in variable.coords else None
    if labels is None or labels.dtype.kind not in "SUO":
        labels = member_names(name, values.shape[1])
    return [(f"{name}_{said(m)}", typed(values[:, k])) for k, m in enumerate(labels)]


def _declared(values, variable) -> tuple[Any, np.ndarray]:
    """Numbers with what the file declares as fill or out of range masked, and which those are."""
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "iuf":
        return values, np.zeros(len(values), bool)
    attributes = variable.attrs
    scale = float(variable.encoding.get("scale_factor", 1.0))
    offset = float(variable.encoding.get("add_offset", 0.0))
    out = np.zeros(len(values), bool)
    for name in _FILLS:
        for fill in np.atleast_1d(attributes.get(name, [])):
            if np.issubdtype(np.asarray(fill).dtype, np.number):
                out |= np.isclose(values, float(fill) * scale + offset, rtol=1e-6, atol=0)
    limits = [(attributes.get(a, -np.inf), attributes.get(b, np.inf)) for a, b in _RANGES]
    if np.size(attributes.get("valid_range", ())) == 2:
        limits.append(tuple(np.asarray(attributes["valid_range"]).ravel()))
    for low, high in limits:
        ends = sorted(float(np.asarray(x).ravel()[0]) * scale + offset for x in (low, high))
        with np.errstate(invalid="ignore"):
            out |= (values < ends[0]) | (values > ends[1])
    return (np.ma.MaskedArray(values, out | np.ma.getmaskarray(values)) if out.any() else values), out


def _clock(data, dim) -> str | None:
    """The variable with the times of a dimension."""
    if dim in data.variables and data.variables[dim].ndim == 1 and _is_time(str(dim), data.variables[dim]):
        return dim
    named = [
        n for n, v in data.variables.items()
        if v.dims == (dim,) and (v.attrs.get("standard_name") == "time" or str(n) == "time" or str(n).startswith("time_"))
    ]  # fmt: skip
    return named[0] if named else None


def _is_time(name: str, variable) -> bool:
    """Whether a coordinate is one of times, by its units, kind or name."""
    units = said(variable.attrs.get("units", ""))
    named = variable.attrs.get("standard_name") == "time" or name.lower().split("_")[0] in ("time", "t")
    return named or variable.dtype.kind in "Mm" or " since " in units or scale_called(units) is not None


def _cf_time(clock, epoch) -> tuple[str, str | None, np.ndarray | None]:
    """Heading, epoch and, for a CF calendar, ns since 1970 without leap seconds, from 'seconds since 2015-09-29T00:00:00', 's', 'gps s', ..."""
    units = said(clock.attrs.get("units", "s")).strip()
    unit, since, start = units.partition(" since ")
    values = np.asarray(clock.values)
    if values.dtype.kind == "M":  # decoded already
        return "time [utc]", None, None
    if values.dtype.kind == "m":
        return "time [ns]", None if epoch is None else said(epoch), None
    if not since:
        return f"time [{units}]", None if epoch is None else said(epoch), None
    calendar = said(clock.attrs.get("calendar", "standard")).lower()
    if calendar not in _CALENDARS:
        raise BadInput(
            f"the calendar {calendar!r} of {clock.name!r} is not that of any clock",
            remedy=f"Write times in one of the calendars {some_of(_CALENDARS)}.",
        )
    scale = scale_called(unit)
    if scale is None or scale.kind != "":
        raise BadInput(f"the unit {unit!r} of {clock.name!r} is not a unit of time", remedy="Write 'seconds since …'.")
    if values.dtype.kind not in "fiu":
        raise BadInput(f"the time coordinate {clock.name!r} is not numeric", remedy="Store times as numbers with CF units.")  # fmt: skip
    if calendar == "utc":
        return f"time [{scale.unit}]", start.strip(), None
    try:
        ns = exact_ns(values, scale)
    except NotATime as why:
        raise BadInput(
            f"value {why.row + 1} of the time coordinate {clock.name!r} is not a time ({values[why.row]})",
            remedy="Store times as finite numbers with CF units.",
        ) from None
    origin_ns = utc_to_posix_ns(start.strip())
    if len(ns) and not abs(int(ns[np.argmax(np.abs(ns))]) + origin_ns) < 2**63 - 1:
        raise BadInput("the times are outside the calendar", remedy="Check the units of the time coordinate.")
    return f"time [unix {scale.unit}]", start.strip(), ns + origin_ns


# ---- FITS, CDF, MATLAB, Excel -----------------------------------------------------------------------


def read_fits(path: Path) -> list[Table]:
    """The binary tables of a FITS file: names and units of the columns as headings; (N, M) columns divided."""
    from astropy.io import fits

    tables = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with fits.open(path, memmap=False) as file:
                for part in file:
                    if not isinstance(part, (fits.BinTableHDU, fits.TableHDU)):
                        continue
                    if part.header["NAXIS1"] * part.header["NAXIS2"] > path.stat().st_size:
                        raise BadInput("the file is shorter than its table", remedy="Copy the file again.")
                    if len(part.data):
                        columns = [(c.name, c.unit, np.asarray(part.data[c.name]), c.null) for c in part.columns]
                        tables.append(_from_arrays(columns, part.header.get("EPOCH") or part.header.get("DATEREF")))
    except BadInput:
        raise
    except Exception as why:  # astropy raises many kinds for damaged files
        raise damaged("FITS", why) from None
    if not tables:
        raise BadInput("the FITS file has no table with rows", remedy="Give a file with a binary table.")
    return tables


def _from_arrays(columns: Iterable[tuple[str, str | None, np.ndarray, Any]], epoch=None) -> Table:
    """Columns (name, unit, values (N,) or (N, M), fill) as a table."""
    headings, blanked = [], {}
    cells: list = []
    for name, unit, values, fill in columns:
        parts = [("", values)] if values.ndim == 1 else [
            (f"_{m}", values[:, k]) for k, m in enumerate(member_names(name, values.shape[1]))
        ] if values.ndim == 2 else []  # fmt: skip
        for member, part in parts:
            column = typed(part)
            if fill is not None and isinstance(column, np.ndarray) and column.dtype.kind in "iuf":
                out = np.isclose(column, float(fill), rtol=1e-6, atol=0)
                if out.any():
                    blanked[len(cells)] = np.flatnonzero(out)
                    column = np.ma.MaskedArray(column, out)
            headings.append(f"{name}{member} [{unit}]" if unit else f"{name}{member}")
            cells.append(column)
    return checked(Table(tuple(headings), tuple(cells), epoch=None if epoch is None else str(epoch), blanked=blanked))


def read_cdf(path: Path) -> list[Table]:
    """A CDF file (ISTP): one table per time variable (DEPEND_0), FILLVAL and VALIDMIN, VALIDMAX heeded."""
    try:
        import cdflib
    except ImportError:
        raise needed("cdflib", "files", "CDF") from None
    try:
        file = cdflib.CDF(str(path))
        names = list(file.cdf_info().zVariables) + list(file.cdf_info().rVariables)
        by_clock: dict[str, list] = {}
        cells = 0
        for name in names:
            attributes = file.varattsget(name)
            if clock := attributes.get("DEPEND_0"):
                about = file.varinq(name)
                cells += (about.Last_Rec + 1) * math.prod(about.Dim_Sizes or [1])
                _check_size(cells, path)
                values = np.asarray(file.varget(name))
                by_clock.setdefault(clock, []).append((name, attributes, values))
        clocks = {clock: cdflib.cdfepoch.to_datetime(file.varget(clock)) for clock in by_clock}
    except BadInput:
        raise
    except Exception as why:  # cdflib raises many kinds for damaged files
        raise damaged("CDF", why) from None
    tables = []
    for clock, variables in by_clock.items():
        columns: list = [
            (clock if clock.lower() == "time" else f"time_{clock}", "utc", np.asarray(clocks[clock]), None)
        ]
        for name, attributes, values in variables:
            ends = [attributes.get(k) for k in ("VALIDMIN", "VALIDMAX")]
            if values.dtype.kind in "iuf" and all(np.size(e) == 1 for e in ends if e is not None):
                low, high = (-np.inf if ends[0] is None else float(np.ravel(ends[0])[0])), (np.inf if ends[1] is None else float(np.ravel(ends[1])[0]))  # fmt: skip
                fill = attributes.get("FILLVAL")
                values = np.where(
                    (values < low) | (values > high), np.nan if fill is None else float(np.ravel(fill)[0]), values
                )
            columns.append((name, said(attributes.get("UNITS", "")).strip() or None, values, attributes.get("FILLVAL")))
        tables.append(_from_arrays(columns))
    if not tables:
        raise BadInput(
            "no variable of the CDF file depends on a time (DEPEND_0)", remedy="Write it after the ISTP guidelines."
        )
    return tables


def read_matlab(path: Path) -> list[Table]:
    """A MATLAB file of version 5: vectors and matrices of one length as columns; version 7.3 is HDF5."""
    from scipy.io import loadmat, whosmat

    try:
        _check_size(sum(math.prod(shape) for _, shape, _ in whosmat(path)), path)
        found = loadmat(path, squeeze_me=True, struct_as_record=False)
    except BadInput:
        raise
    except Exception as why:  # scipy raises many kinds for damaged files
        raise damaged("MATLAB", why) from None
    arrays: dict[str, np.ndarray] = {}
    for name, value in found.items():
        if name.startswith("__"):
            continue
        fields = {f: getattr(value, f) for f in value._fieldnames} if hasattr(value, "_fieldnames") else {name: value}
        arrays |= {
            f: np.asarray(v) for f, v in fields.items() if np.ndim(v) in (1, 2) and np.asarray(v).dtype.kind in "iufUSb"
        }
    return [_by_length(arrays, "MATLAB")]


def read_matlab73(path: Path) -> list[Table]:
    """A MATLAB file of version 7.3, which is HDF5: vectors and matrices of one length as columns."""
    import h5py

    check_hdf5(path)
    arrays: dict[str, np.ndarray] = {}

    def keep(name: str, item) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#") and item.dtype.kind in "iuf":
            _check_size(item.size + sum(v.size for v in arrays.values()), path)
            arrays[name.rpartition("/")[2]] = np.squeeze(item[()])

    try:
        with h5py.File(path, "r") as file:
            file.visititems(keep)
    except BadInput:
        raise
    except Exception as why:  # h5py raises many kinds for damaged files
        raise damaged("MATLAB", why) from None
    return [_by_length({n: v for n, v in arrays.items() if v.ndim in (1, 2)}, "MATLAB")]


def _by_length(arrays: dict[str, np.ndarray], kind: str) -> Table:
    """Arrays as long as the one called time (or t), as a table."""
    clock = next((n for n in arrays if n.lower().split("_")[0] in ("time", "t")), None)
    if clock is None:
        raise BadInput(
            f"no array of the {kind} file is called time (arrays: {some_of(arrays)})",
            remedy="Name the vector of times 'time', or save the table as CSV.",
        )
    length = len(arrays[clock])
    columns = [(clock, None, arrays[clock], None)]
    for name, values in arrays.items():
        if name != clock and length in values.shape:
            columns.append((name, None, values if values.shape[0] == length else values.T, None))
    return _from_arrays(columns)


def read_excel(path: Path) -> list[Table]:
    """The first sheet of an Excel workbook with a table: its header is found as in a text table."""
    try:
        import openpyxl
    except ImportError:
        raise needed("openpyxl", "files", "Excel") from None
    try:
        with ZipFile(path) as packed:
            size = sum(part.file_size for part in packed.infolist())
        if size > LARGEST_WORKBOOK:
            raise BadInput(
                f"the workbook unpacks to {size / 1e6:.0f} MB, more than {LARGEST_WORKBOOK / 1e6:g} MB",
                remedy="Save the table as CSV or Parquet, or set ASFLOWN_MAX_WORKBOOK_BYTES.",
            )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            book = openpyxl.load_workbook(path, read_only=True, data_only=True)
            sheets = {
                s.title: [[_cell(c) for c in row] for row in s.iter_rows(values_only=True)] for s in book.worksheets
            }
            book.close()
    except BadInput:
        raise
    except Exception as why:  # openpyxl raises many kinds for damaged files
        raise damaged("Excel", why) from None
    for title, sheet in sheets.items():
        rows = [(n, _trimmed(r)) for n, r in enumerate(sheet, 1) if any(c.strip() for c in r)]
        if len(rows) > 1:
            left = [t for t in sheets if t != title]
            notes = (f"the sheet {title!r} was read", *([f"other sheets were not: {some_of(left)}"] if left else []))
            return [_of_cells(rows, notes)]
    raise BadInput("no sheet of the workbook has a table", remedy="Save the table as CSV or Parquet.")


def _cell(value) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, date):
        return f"{value.isoformat()}T00:00:00"
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    return repr(value) if isinstance(value, float) else str(value)


def _trimmed(row: list[str]) -> list[str]:
    while row and not row[-1].strip():
        row = row[:-1]
    return row


def _of_cells(rows: list[tuple[int, list[str]]], notes: tuple[str, ...]) -> Table:
    width = max(len(r) for _, r in rows)
    rows = [(n, r + [""] * (width - len(r))) for n, r in rows]
    form = form_of_rows(rows[:200])
    body = [(n, r) for n, r in rows if n >= form.first_line]
    columns = tuple(zip(*(r for _, r in body), strict=True))[: len(form.headings)]
    return checked(Table(form.headings, columns, [n for n, _ in body], None, (*notes, *form.notes)))


#: First bytes of a file -> its reader.
BY_SIGNATURE: tuple[tuple[bytes, Callable[[Path], Any]], ...] = (
    (b"PAR1", lambda p: [read_parquet(p)]),
    (b"\x89HDF\r\n\x1a\n", read_netcdf),
    (b"CDF\x01", read_netcdf),
    (b"CDF\x02", read_netcdf),
    (b"CDF\x05", read_netcdf),
    (b"SIMPLE  =", read_fits),
    (b"\xcd\xf3\x00\x01", read_cdf),
    (b"\xcd\xf2\x60\x02", read_cdf),
    (b"MATLAB 5.0 MAT-file", read_matlab),
    (b"MATLAB 7.3 MAT-file", read_matlab73),
    (b"PK\x03\x04", read_excel),
)
