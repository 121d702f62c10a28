"""Tables that are in memory already: DataFrames, xarray Datasets, arrays by name."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..kit.errors import BadInput
from .formats import tables_of_dataset
from .tables import Table, checked, typed
from .times import is_stamp


def tables_of(data: Any) -> list[Table]:
    """The tables of something in memory.

    A pandas or polars DataFrame (or what narwhals takes for one): column names are headings, a pandas index with a name or with
    dates comes first.  An xarray Dataset: as a NetCDF file.  A mapping of heading -> values, or name -> (values, unit).
    Raises BadInput, naming the column, for lengths that differ and for anything else."""
    if isinstance(data, Mapping) and not hasattr(data, "data_vars"):
        return [_of_mapping(data)]
    if hasattr(data, "data_vars"):
        return tables_of_dataset([data])
    return [_of_frame(data)]


def digest_of(tables: list[Table]) -> str:
    """SHA-256 over headings and cells."""
    digest = hashlib.sha256()
    for table in tables:
        for heading, column in zip(table.headings, table.columns, strict=True):
            digest.update(heading.encode())
            cells = np.ma.filled(column, 0) if isinstance(column, np.ma.MaskedArray) else np.asarray(column)
            digest.update(np.ascontiguousarray(cells).tobytes())
    return digest.hexdigest()


def _of_mapping(data: Mapping) -> Table:
    headings: list[str] = []
    columns: list = []
    for name, given in data.items():
        values, unit = (
            given if isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], str) else (given, None)
        )
        values = np.asarray(values)
        if values.ndim != 1:
            raise BadInput(
                f"the values have {values.ndim} dimensions",
                channel=str(name),
                remedy="Give one array (N,) for each column.",
            )
        if columns and len(values) != len(columns[0]):
            raise BadInput(
                f"{len(values)} values where {headings[0]!r} has {len(columns[0])}",
                channel=str(name),
                remedy="Give columns of one length.",
            )
        headings.append(str(name) if unit is None else f"{name} [{unit}]")
        columns.append(typed(values))
    return checked(Table(tuple(headings), tuple(columns)))


def _of_frame(data: Any) -> Table:
    import narwhals

    if getattr(getattr(data, "columns", None), "nlevels", 1) > 1:  # a heading in several levels, as (name, unit)
        data = data.set_axis([" ".join(str(x) for x in c if str(x)) for c in data.columns], axis=1)
    try:
        frame = narwhals.from_native(data, eager_only=True)
    except TypeError:
        raise BadInput(
            f"{type(data).__name__} is neither a file nor a table",
            remedy="Give a path, a pandas or polars DataFrame, an xarray Dataset, or a dict of arrays.",
        ) from None
    headings = [str(c) for c in frame.columns]
    columns = [typed(_values(frame[c])) for c in frame.columns]
    index = getattr(data, "index", None)
    if index is not None and not callable(index) and (index.name is not None or index.dtype.kind in "Mm"):
        dated = index.dtype.kind == "M" or hasattr(index, "tz")
        values = index.tz_convert("UTC").tz_localize(None) if getattr(index, "tz", None) is not None else index
        headings.insert(0, "time [utc]" if dated else "time" if index.dtype.kind == "m" else str(index.name))
        columns.insert(0, typed(np.asarray(values)))
    for j, column in enumerate(columns):
        if isinstance(column, np.ndarray) and column.dtype.kind == "m":  # elapsed times
            headings[j], columns[j] = f"{headings[j]} [ns]", column.astype("timedelta64[ns]").astype(np.int64)
    said = str(getattr(data, "attrs", {}).get("epoch", ""))  # as Telemetry.to_pandas writes it
    return checked(Table(tuple(headings), tuple(columns), epoch=said if is_stamp(said) else None))


def _values(series: Any) -> np.ndarray:
    """A column as an array; what is missing is masked."""
    missing = series.is_null().to_numpy()
    if series.dtype.is_numeric() and missing.any():
        return np.ma.MaskedArray(series.fill_null(0).to_numpy(), missing)
    if series.dtype.is_temporal() and getattr(series.dtype, "time_zone", None):
        series = series.dt.convert_time_zone("UTC").dt.replace_time_zone(None)
    return series.to_numpy()
