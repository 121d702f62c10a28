"""One face for every result: its record, table, files, frames and picture, with its doubts and provenance.

``Estimate`` is the base; a result adds its numbers and says how they are laid out.  ``recorded`` decorates every public
function that returns one: it records inputs and options, and turns findings about the channels used into doubts.
"""

from __future__ import annotations

import functools
import inspect
import json
import platform
from dataclasses import dataclass, field, replace
from html import escape
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, ParamSpec, TypeVar

from .doubts import Doubts
from .errors import BadInput
from .escapes import on_one_line
from .files import mark, sha256_of, write_text, write_whole
from .plain import plain

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from .table import Table

#: Packages whose versions can change a number.
_VERSIONS = ("asflown", "numpy", "scipy", "numba", "astropy")


class Input(NamedTuple):
    """A file that a result was made from."""

    file: str
    sha256: str


def inputs_of(*files) -> tuple[Input, ...]:
    """Every file named, with its SHA-256; anything else (a built-in name, None) is skipped."""
    return tuple(
        Input(str(f), sha256_of(Path(f).read_bytes()))
        for f in files
        if isinstance(f, (str, Path)) and Path(f).is_file()
    )


class Series(NamedTuple):
    """A result over time: seconds from ``epoch``, and columns by name with their unit in it; (M,) or (M, n)."""

    time_s: Any
    columns: dict[str, Any]
    members: tuple[str, ...] = ("x", "y", "z")  # of an (M, n) column
    dimension: str = "axis"


def provenance(inputs=(), options: dict | None = None, seed=None) -> dict:
    """Which files, versions, options and seed made a result; the JSON object of that name."""
    return {
        "inputs": [{"file": i.file, "sha256": i.sha256} for i in dict.fromkeys(inputs)],
        "versions": {"python": platform.python_version(), **{p: version(p) for p in _VERSIONS}},
        "options": plain(options or {}),
        "seed": seed,
    }


@dataclass(frozen=True, kw_only=True, repr=False)
class Estimate:
    """Base of all results: what they have in common.

    ``craft``, ``epoch``: whose, and the instant that times count from ('' where there is none); ``method``, ``variant``: how;
    ``settings``: what the estimator chose; ``inputs``, ``options``, ``seed``: what it was given (see ``provenance``)."""

    craft: str = ""
    epoch: str = ""
    method: str = ""
    variant: str = "corrected"
    settings: dict = field(default_factory=dict)
    doubts: Doubts = Doubts()
    inputs: tuple[Input, ...] = ()
    options: dict = field(default_factory=dict)
    seed: int | None = None

    #: Keys of earlier versions that still stand in the record, and where their values are now: {"sigma_Nm": "torque_sigma_Nm"},
    #: or in a list of objects {"peaks[].sigma_Nm": "torque_sigma_Nm"}.
    OLD_KEYS: ClassVar[dict[str, str]] = {}

    def __post_init__(self):
        if not isinstance(self.doubts, Doubts):
            object.__setattr__(self, "doubts", Doubts(self.doubts))

    # ---- given by each result ----

    def _record(self) -> dict:
        """The result's own part of its JSON, in its order."""
        raise NotImplementedError

    def _tables(self) -> tuple[Table, ...]:
        """The tables shown to the user."""
        raise NotImplementedError

    def series(self) -> Series | None:
        """The result over time; None for one that is not a function of time."""
        return None

    # ---- derived ----

    @property
    def file_kind(self) -> str:
        """What a saved result calls itself, so that another kind of file is not replaced by it."""
        return f"result {type(self).__name__}"

    @property
    def provenance(self) -> dict:
        return provenance(self.inputs, self.options, self.seed)

    def record(self) -> dict:
        """The JSON form: keys carry units, unknown values are None; without command and provenance."""
        record = self._record()
        with_old_keys(record, self.OLD_KEYS)
        return record | self.doubts.record()

    def table(self) -> str:
        """The tables as text."""
        return "\n".join(map(str, self._tables()))

    def with_doubts(self, *found) -> Any:
        """The same result with further doubts."""
        return replace(self, doubts=self.doubts + Doubts(found))

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        words = [w for w in (self.craft, self.method, self.variant if self.variant != "corrected" else "") if w]
        doubted = f", {len(self.doubts)} doubts" if self.doubts else ""
        return f"<{type(self).__name__}: {', '.join(words)}{doubted}>"

    def _repr_html_(self) -> str:
        """HTML for a notebook: the tables, and the doubts with the gravest first."""
        doubts = "".join(
            f"<li><b>{d.severity.label}</b> {escape(str(d))} <i>{escape(d.remedy)}</i></li>"
            for d in self.doubts.gravest_first
        )
        return "".join(t.html() for t in self._tables()) + (f"<ul>{doubts}</ul>" if doubts else "")

    def to_pandas(self):
        """The series as a DataFrame with ``time_s`` as its index; doubts and provenance in ``attrs``.

        Raises TypeError for a result that is not a function of time."""
        import pandas

        series = self._needed_series()
        frame = pandas.DataFrame(_flat(series), index=pandas.Index(series.time_s, name="time_s"))
        frame.attrs = self._attributes()
        return frame

    def to_xarray(self):
        """The series as a Dataset over ``time_s``; doubts and provenance in its attributes.

        Raises TypeError for a result that is not a function of time."""
        import numpy as np
        import xarray

        series = self._needed_series()
        sides = {n: ("time_s",) if np.ndim(v) == 1 else ("time_s", series.dimension) for n, v in series.columns.items()}
        coordinates: dict = {"time_s": series.time_s}
        if any(len(s) == 2 for s in sides.values()):
            coordinates[series.dimension] = list(series.members)
        data = {n: (sides[n], v) for n, v in series.columns.items()}
        attributes = {n: v if isinstance(v, str) else json.dumps(v) for n, v in self._attributes().items()}
        return xarray.Dataset(data, coordinates, attributes)

    def save(self, path) -> None:
        """Into a file, by its suffix: .json (all of it), .csv or .parquet (the series), provenance and doubts inside.

        Raises BadInput for another suffix, for a file that cannot be written, and for a table of a result without a series."""
        kind = Path(path).suffix.lower()
        if kind == ".json":
            whole = {"file": mark(self.file_kind)} | self.record() | {"provenance": self.provenance}
            write_text(path, json.dumps(plain(whole), allow_nan=False, indent=1) + "\n")
        elif kind in (".csv", ".parquet"):
            if self.series() is None:
                raise BadInput("this result is not a function of time", file=path, remedy="Save it as .json.")
            self._save_csv(path) if kind == ".csv" else self._save_parquet(path)
        else:
            raise BadInput(
                f"cannot save into {kind or 'a file without suffix'}",
                file=path,
                remedy="Name it .json, .csv or .parquet.",
            )

    def plot(self, ax=None):
        """Draw the result into matplotlib axes, new ones unless given; returns them."""
        # plots are above results: the function is imported by name, and only when needed
        return import_module("asflown.plots").draw(self, ax)

    # ---- helpers ----

    def _needed_series(self) -> Series:
        series = self.series()
        if series is None:
            raise TypeError(f"{type(self).__name__} is not a function of time; its record() has all of it")
        return series

    def _attributes(self) -> dict:
        return {
            "result": type(self).__name__, "craft": self.craft, "epoch": self.epoch, "method": self.method,
            "variant": self.variant, "doubts": self.doubts.sentences(), "provenance": self.provenance,
        }  # fmt: skip

    def _save_csv(self, path) -> None:
        """Comment lines, a heading with units, and rows; blank where unknown.  No partial file remains."""
        series = self._needed_series()
        columns = _flat(series)
        lines = self._comments(f"{type(self).__name__}; craft {self.craft}; {self.method}, {self.variant}")
        lines.append(",".join(["time_s", *columns]))
        rows = zip(series.time_s, *columns.values(), strict=True)
        lines.extend(",".join("" if v != v else repr(float(v)) for v in row) for row in rows)
        write_text(path, "\n".join(lines) + "\n")

    def _comments(self, what: str) -> list[str]:
        """Comment lines above a saved table: epoch, what it is, doubts, provenance."""
        remarks = [
            f"epoch: {self.epoch}",
            what,
            *(f"DOUBT ({d.severity.label}) {d}" for d in self.doubts),
            *(f"input {i.file} sha256 {i.sha256}" for i in self.inputs),
            f"asflown {version('asflown')}, options {plain(self.options)}",
            mark(self.file_kind),
        ]
        return [f"# {on_one_line(r)}" for r in remarks]

    def _save_parquet(self, path) -> None:
        import duckdb

        frame = self.to_pandas().reset_index()
        kept = json.dumps(plain(self._attributes())).replace("'", "''")

        def write(place: Path) -> None:
            with duckdb.connect() as link:
                link.register("frame", frame)
                target = str(place).replace("'", "''")
                told = f"{{asflown: '{kept}', file: '{mark(self.file_kind)}'}}"
                try:
                    link.execute(f"COPY frame TO '{target}' (FORMAT parquet, KV_METADATA {told})")
                except duckdb.Error as why:
                    raise OSError(str(why).splitlines()[0]) from None

        write_whole(path, write)


#: Units whose names hold an underscore themselves.
_UNITS_OF_TWO = ("rad_s2", "rad_s", "m_s2", "m_s")


def _flat(series: Series) -> dict[str, Any]:
    """Columns of one number each; 'torque_Nm' of three becomes 'torque_x_Nm', …: the unit stays last."""
    import numpy as np

    flat = {}
    for name, values in series.columns.items():
        if np.ndim(values) == 1:
            flat[name] = values
            continue
        unit = next((u for u in _UNITS_OF_TWO if name.endswith(f"_{u}")), name.rpartition("_")[2])
        stem = name.removesuffix(unit).removesuffix("_")
        for member, column in zip(series.members, np.asarray(values).T, strict=False):
            flat[f"{stem}_{member}_{unit}" if stem else f"{name}_{member}"] = column
    return flat


def with_old_keys(record: dict, old: dict[str, str]) -> None:
    """Set the keys of earlier versions beside those that hold their values now (see ``Estimate.OLD_KEYS``)."""
    for before, now in old.items():
        place, _, name = before.rpartition("[].")
        rows = [record] if not place else record.get(place) or []
        for row in rows:
            if now in row:
                row.setdefault(name, row[now])


def per_spin_inertia(record: dict, names) -> None:
    """Move values per unit spin inertia from keys that say N m, N m s or kg m2 to ones that say so; null is left behind.

    'torque_Nm' -> 'torque_per_spin_inertia_rad_s2', 'momentum_Nms' -> 'momentum_per_spin_inertia_rad_s',
    'inertia_kgm2' -> 'inertia_per_spin_inertia'."""
    units = {"Nm": "_per_spin_inertia_rad_s2", "Nms": "_per_spin_inertia_rad_s", "kgm2": "_per_spin_inertia"}
    for name in names:
        if name in record:
            stem, _, unit = name.rpartition("_")
            record[stem + units[unit]], record[name] = record[name], None


P = ParamSpec("P")
R = TypeVar("R")


def recorded(estimate: Callable[P, R]) -> Callable[P, R]:
    """Decorate a public function that returns an ``Estimate``: its inputs, options and the doubts of the screening go into the result.

    Arguments that are inputs have ``inputs``; telemetry also has ``watched()``, a copy that notes which channels are used, and
    ``found_in(used)``, doubts about those.  All other arguments are options."""
    signature = inspect.signature(estimate)

    @functools.wraps(estimate)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        bound = signature.bind(*args, **kwargs)
        bound.apply_defaults()

        def watch(value):
            if hasattr(value, "watched"):
                value = value.watched()
            elif isinstance(value, (list, tuple)) and value and all(hasattr(v, "watched") for v in value):
                value = type(value)(map(watch, value))
            return value

        for name, value in bound.arguments.items():
            bound.arguments[name] = watch(value)
        return noted(estimate(*bound.args, **bound.kwargs), bound.arguments)

    return call


def noted(result: Any, given: Mapping[str, Any]) -> Any:
    """The result with what it was given: inputs, options, and the findings about the channels used.

    ``given``: arguments by name, telemetry among them as its watched copy.  For a class; a function is ``recorded``."""
    inputs: list[Input] = []
    options, found = {}, Doubts()
    for name, value in given.items():
        several = value if isinstance(value, (list, tuple)) else [value]
        if several and all(hasattr(v, "inputs") for v in several):
            inputs += [i for v in several for i in v.inputs]
            for v in several:
                of_this = v.found_in(v.used or ()) if hasattr(v, "watched") else Doubts()
                found += of_this if len(several) == 1 else [d.of_record(v.source) for d in of_this]
        elif not callable(value):
            options[name] = _told(value)
    return replace(
        result,
        inputs=tuple(dict.fromkeys((*result.inputs, *inputs))),
        options=result.options or options,
        doubts=result.doubts + found,
    )


def _told(value):
    """An option as JSON has it; of an object without such a form its own record, or its text."""
    if hasattr(value, "record"):
        return value.record()
    try:
        return plain(value)
    except TypeError:
        return str(value)
