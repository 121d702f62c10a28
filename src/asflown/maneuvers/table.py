"""Executed maneuvers from a file: any of two forms in, execution errors in the TVC frame and SI out."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..kit.config import read_bytes
from ..kit.doubts import Doubt, Doubts, Kind, Severity
from ..kit.errors import BadInput, some_of
from ..kit.files import sha256_of
from ..kit.result import Input, inputs_of
from .adjust import SCALE, Adjustment, Ledger, entered, scale_corrected
from .columns import Columns, read_table
from .frame import SMALLEST, resolved, tvc_axes
from .history import engine_called
from .plausible import check_directions, engine_turns, implausible

#: Parts of the expected dV, each rounded to 0.1 mm/s, add up to it within this. [m/s]
_ROUNDED = 2e-4
NO_MAGNITUDE_SIGMA = Kind(
    "maneuvers.no-magnitude-sigma", Severity.CAUTION,
    "sigma_magnitude is zero throughout: errors of the orbit determination count as execution errors",
    "Give the orbit determination's sigmas.",
)  # fmt: skip
NO_POINTING_SIGMA = Kind(
    "maneuvers.no-pointing-sigma", Severity.CAUTION,
    "the pointing errors have no sigmas: errors of the orbit determination count as execution errors",
    "Give sigma_pointing_x and sigma_pointing_y.",
)  # fmt: skip
NO_POINTING = Kind(
    "maneuvers.no-pointing", Severity.NOTE, "the table has no pointing errors: pointing is not estimated",
    "Give pointing_error_x and pointing_error_y.",
)  # fmt: skip
ENGINE_SPELLINGS = Kind(
    "maneuvers.engine-spellings", Severity.NOTE, "{spellings} are taken for one engine, {engine}",
    "Write each engine's name in one way.",
)  # fmt: skip


@dataclass(frozen=True)
class Maneuvers:
    """N maneuvers in order of time (of the file where it has no times); SI, errors in the TVC frame.

    Errors are reconstructed minus expected: a positive magnitude error is an overburn.  Sigmas and covariances are
    those of the orbit determination.  ``pointing_error_mps`` is None where only magnitudes are known."""

    id: tuple[str, ...]
    engine: tuple[str, ...]  # '' where not said
    dv_mps: np.ndarray  # (N,), expected
    magnitude_error_mps: np.ndarray  # (N,)
    sigma_magnitude_mps: np.ndarray  # (N,)
    pointing_error_mps: np.ndarray | None = None  # (N, 2), TVC X and Y
    pointing_covariance: np.ndarray | None = None  # (N, 2, 2) [m2/s2]
    tai_ns: np.ndarray | None = None  # (N,)
    ledger: tuple[Ledger, ...] = ()
    excluded: tuple[tuple[str, str], ...] = ()  # (id, reason) of what was left out
    source: str = ""
    inputs: tuple[Input, ...] = ()
    doubts: Doubts = Doubts()

    def __post_init__(self):
        if not self.ledger:
            object.__setattr__(self, "ledger", ((),) * len(self.id))

    def __len__(self) -> int:
        return len(self.id)

    @property
    def engines(self) -> list[str]:
        return sorted(set(self.engine))

    @property
    def engine_name(self) -> str | None:
        """Of maneuvers of one engine, as the table calls it; None where it does not."""
        return self.engine[0] or None

    @property
    def engine_label(self) -> str:
        return self.engine_name or "engine not named"

    @property
    def across(self) -> tuple[np.ndarray, np.ndarray]:
        """Pointing errors (N, 2) and their covariance (N, 2, 2).  Raises BadInput where there are none."""
        if self.pointing_error_mps is None or self.pointing_covariance is None:
            raise BadInput(
                "there are no pointing errors", file=self.source or None, remedy="Give pointing_error_x and _y."
            )
        return self.pointing_error_mps, self.pointing_covariance

    @property
    def sigma_pointing_mps(self) -> np.ndarray:
        """Semi-major axis of the one-sigma ellipse of each pointing error, (N,)."""
        return np.sqrt(np.maximum(np.linalg.eigvalsh(self.across[1])[:, -1], 0))

    def place(self, id: str) -> int:
        """Where a maneuver stands.  Raises BadInput for an id that is not there."""
        if id not in self.id:
            raise BadInput(
                f"there is no maneuver {id!r}", file=self.source or None, remedy=f"There are: {some_of(self.id)}."
            )
        return self.id.index(id)

    def take(self, rows) -> Maneuvers:
        """Some maneuvers, by index or mask."""
        rows = np.arange(len(self))[rows]
        cut: dict[str, Any] = {n: v[rows] for n, v in vars(self).items() if isinstance(v, np.ndarray)}
        cut |= {n: tuple(getattr(self, n)[k] for k in rows) for n in ("id", "engine", "ledger")}
        return replace(self, **cut)

    def of(self, engine: str | None) -> Maneuvers:
        """Those of one engine, as the file calls it or by another common name ('MEA' for 'main engine').

        Raises BadInput where the file holds several and none is named, or not this one."""
        held = some_of(e or "one without a name" for e in self.engines)
        if engine is None:
            if len(self.engines) > 1:
                raise BadInput(
                    f"the file holds several engines: {held}",
                    file=self.source or None,
                    remedy="Name one with --engine.",
                )
            return self
        kind = engine_called(engine)
        alike = [e for e in self.engines if e == engine] or [
            e for e in self.engines if kind is not None and engine_called(e) == kind
        ]
        if len(alike) != 1:
            raise BadInput(
                f"the file holds no maneuver of engine {engine!r}" if not alike else f"{engine!r} may be {some_of(alike)}",
                file=self.source or None, remedy=f"It holds: {held}.",
            )  # fmt: skip
        return self.take([e == alike[0] for e in self.engine])

    def with_bias_removed(self, before: int, fixed_mps: float, proportional: float, name: str) -> Maneuvers:
        """A bias of the magnitude taken out of the first ``before`` maneuvers, as if a later patch had been there.

        The error of a maneuver of size v falls by fixed + proportional v (its expected dV rises by as much).
        Raises BadInput where the ledger says that this was done."""
        change = fixed_mps + proportional * self.dv_mps
        change[before:] = 0.0
        ledger = tuple(
            entered(book, Adjustment(name), who) if k < before else book
            for k, (book, who) in enumerate(zip(self.ledger, self.id, strict=True))
        )
        return replace(self, magnitude_error_mps=self.magnitude_error_mps - change, ledger=ledger)

    def without(self, ids, reason: str) -> Maneuvers:
        """All but some, the reason kept.  Raises BadInput for an id that is not there, or where none is left."""
        gone = {self.place(i) for i in ids}
        if len(gone) == len(self):
            raise BadInput("no maneuver is left", file=self.source or None, remedy="Leave fewer out.")
        rest = self.take([k not in gone for k in range(len(self))])
        return replace(rest, excluded=(*self.excluded, *((self.id[k], reason) for k in sorted(gone))))


def load_maneuvers(path, *, columns=None) -> Maneuvers:
    """Read a table of executed maneuvers.

    Expected dV are corrected for accelerometer scale or thrust where there is a correction_ratio (Wagner 2014 eqs 6, 7), once.

    Parameters
    ----------
    path : str or Path, or table
        CSV (plain or gzip), Parquet, Excel or TOML; or a pandas or polars DataFrame, an xarray Dataset, or a dict of arrays (name ->
        values, or name -> (values, unit)).  Units are in the headings; docs/maneuvers.md lists the columns.  It holds errors already
        resolved (dv, magnitude_error, sigma_magnitude; pointing_error_x and _y with sigmas and correlation), or inertial
        vectors (reconstructed_dv, expected_dv or its parts, covariance, craft_x).
    columns : str, Path or dict, optional
        Dictionary of the columns (TOML, or a dict of the same keys), where the table has other ones; docs/maneuvers.md lists its keys.

    Returns
    -------
    Maneuvers
        SI, TVC frame, in order of time.  Rows with a reason in the column ``excluded`` are left out, and listed.

    Raises
    ------
    BadInput
        For anything that cannot be read, with file, line and column.
    """
    of_file = isinstance(path, (str, Path))
    name = str(path) if of_file else type(path).__name__
    try:
        if of_file:
            data = read_bytes(path, "maneuver table", "Give a CSV, Parquet, Excel or TOML file.")
            table, digest = read_table(Path(path), data), sha256_of(data)
        else:
            from ..telemetry.in_memory import digest_of, tables_of

            tables = tables_of(path)
            table, digest = tables[0], digest_of(tables)
        if columns is not None:
            from .dictionary import load_maneuver_dictionary, translated

            table = translated(table, load_maneuver_dictionary(columns))
        whole = Columns(table)
        whole.need("id")
        ids, reasons = _ids(whole), whole.words("excluded")  # an excluded row may hold blanks or zeros
        used = whole.some([k for k, reason in enumerate(reasons) if not reason])
        if len(used) == 0:
            raise BadInput("no maneuver is left", remedy="Leave fewer out.")
        found = _vectors(used) if used.has("reconstructed_dv") else _scalars(used)
        excluded = tuple((i, reason) for i, reason in zip(ids, reasons, strict=True) if reason)
        found = replace(found, source=name, inputs=(Input(name, digest), *inputs_of(columns)), excluded=excluded)
        found = _one_spelling(_in_order(found))
        return replace(found, doubts=found.doubts + Doubts(implausible(found)))
    except BadInput as why:
        raise why.within(name) from None


def _ids(columns: Columns) -> tuple[str, ...]:
    ids = columns.words("id")
    for row, name in enumerate(ids):
        if not name:
            raise columns.wrong(row, "id", "the maneuver has no name", "Every row has an id.")
    twice = [n for n, times in Counter(ids).items() if times > 1]
    if twice:
        row = len(ids) - 1 - ids[::-1].index(twice[0])
        raise columns.wrong(row, "id", f"two maneuvers are called {some_of(twice)}", "Give each a name of its own.")
    return ids


def _books(columns: Columns) -> tuple[Ledger, ...]:
    """Adjustments made before: words divided by semicolons in the column ``adjusted``."""
    return tuple(
        tuple(Adjustment(name.strip()) for name in text.split(";") if name.strip())
        for text in columns.words("adjusted")
    )


def _scalars(columns: Columns) -> Maneuvers:
    """A table of errors already resolved."""
    columns.need("id", "dv", "magnitude_error", "sigma_magnitude")
    others = [
        n for n in ("expected_dv", "burn_dv", "turn_dv", "deadband_dv", "craft_x", "covariance") if columns.has(n)
    ]
    if others or "correction_ratio" in columns:
        raise BadInput(
            f"errors already resolved stand beside {some_of([*others, *(['correction_ratio'] if 'correction_ratio' in columns else [])])}",
            remedy="Give either resolved errors or vectors with reconstructed_dv; a correction needs the vectors.",
        )
    dv, error, sigma = (columns.numbers(n) for n in ("dv", "magnitude_error", "sigma_magnitude"))
    _positive(columns, "dv", dv)
    _not_negative(columns, "sigma_magnitude", sigma)
    pointing, covariance, unsure = _pointing(columns)
    doubts = [None if sigma.any() else NO_MAGNITUDE_SIGMA(), unsure]
    return Maneuvers(
        _ids(columns), columns.words("engine"), dv, error, sigma, pointing, covariance, columns.times(), _books(columns),
        doubts=Doubts(doubts),
    )  # fmt: skip


def _pointing(columns: Columns) -> tuple[np.ndarray | None, np.ndarray | None, Doubt | None]:
    """Pointing errors (N, 2), their covariance (N, 2, 2), and what is to be doubted of them."""
    if "pointing_error_x" in columns or "pointing_error_y" in columns:
        columns.need("pointing_error_x", "pointing_error_y")
        errors = np.stack([columns.numbers(f"pointing_error_{a}") for a in "xy"], axis=1)
        covariance = _pointing_covariance(columns)
        unsure = NO_POINTING_SIGMA() if covariance is None else None
        return errors, np.zeros((len(columns), 2, 2)) if covariance is None else covariance, unsure
    stray = [n for n in ("sigma_pointing_x", "sigma_pointing_y", "correlation_xy") if n in columns]
    if stray:
        raise BadInput(
            f"{some_of(stray)} without pointing errors", channel=stray[0], remedy="Give pointing_error_x and _y."
        )
    return None, None, NO_POINTING()


def _pointing_covariance(columns: Columns) -> np.ndarray | None:
    """(N, 2, 2) [m2/s2]; None where the table gives no sigmas."""
    n = len(columns)
    given = [x for x in ("sigma_pointing_x", "sigma_pointing_y") if x in columns]
    if not given:
        if "correlation_xy" in columns:
            raise BadInput(
                "a correlation without sigmas", channel="correlation_xy", remedy="Give sigma_pointing_x and _y."
            )
        return None
    columns.need("sigma_pointing_x", "sigma_pointing_y")
    x, y = (columns.numbers(f"sigma_pointing_{a}") for a in "xy")
    for name, s in (("sigma_pointing_x", x), ("sigma_pointing_y", y)):
        _not_negative(columns, name, s)
    r = columns.numbers("correlation_xy", 0.0) if "correlation_xy" in columns else np.zeros(n)
    for row in np.flatnonzero(np.abs(r) > 1)[:1]:
        raise columns.wrong(int(row), "correlation_xy", f"{r[row]:g} is not a correlation", "It lies between -1 and 1.")
    return np.stack([np.stack([x * x, r * x * y], -1), np.stack([r * x * y, y * y], -1)], axis=1)


def _vectors(columns: Columns) -> Maneuvers:
    """A table of inertial vectors, resolved here."""
    mixed = [
        n for n in ("dv", "magnitude_error", "pointing_error_x", "pointing_error_y", "sigma_magnitude") if n in columns
    ]
    if mixed:
        raise BadInput(
            f"vectors stand beside {some_of(mixed)}", remedy="Give either vectors or errors already resolved."
        )
    ids, books = _ids(columns), _books(columns)
    recon, craft_x = columns.vectors("reconstructed_dv"), columns.vectors("craft_x")
    c = columns.vectors("covariance")
    covariance = c[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
    low = np.linalg.eigvalsh(covariance)[:, 0] < -1e-9 * np.abs(covariance).max(axis=(1, 2))
    for row in np.flatnonzero(low)[:1]:
        raise columns.wrong(
            int(row), "covariance_xx", "the covariance has a negative eigenvalue", "Check its six numbers."
        )
    parts = {
        n: columns.vectors(n, None if n == "burn_dv" else 0.0)
        for n in ("burn_dv", "turn_dv", "deadband_dv")
        if columns.has(n)
    }
    expected = _expected(columns, parts)
    if "correction_ratio" in columns:
        if "burn_dv" not in parts:
            raise BadInput(
                "a correction needs the burn's own dV", channel="correction_ratio", remedy="Give burn_dv_x, _y, _z."
            )
        ratio = columns.numbers("correction_ratio", 1.0)
        for row in np.flatnonzero(np.abs(ratio - 1) > 0.5)[:1]:
            raise columns.wrong(int(row), "correction_ratio", f"{ratio[row]:g} is far from 1",
                                "It is estimated over onboard scale factor, or predicted over onboard thrust.")  # fmt: skip
        expected = scale_corrected(expected, parts["burn_dv"], ratio)
        books = tuple(
            entered(book, Adjustment(SCALE), who) if c != 1 else book
            for book, c, who in zip(books, ratio, ids, strict=True)
        )
    axes = tvc_axes(expected, craft_x, ids)
    check_directions(recon, expected, ids)
    engines = columns.words("engine")
    error, pointing, sigma, pointing_covariance = resolved(recon, expected, covariance, axes)
    return Maneuvers(
        ids, engines, np.linalg.norm(expected, axis=1), error, sigma, pointing, pointing_covariance,
        columns.times(), books, doubts=Doubts(engine_turns(expected, craft_x, engines)),
    )  # fmt: skip


def _expected(columns: Columns, parts: dict[str, np.ndarray]) -> np.ndarray:
    """Expected dV = burn + turns + deadband firing, given whole or in parts (Wagner 2014 Appendix C)."""
    if not columns.has("expected_dv"):
        if "burn_dv" not in parts:
            columns.need("expected_dv_x")
        return np.sum(list(parts.values()), axis=0)
    expected = columns.vectors("expected_dv")
    if len(parts) == 3:
        off = np.abs(np.sum(list(parts.values()), axis=0) - expected).max(axis=1)
        for row in np.flatnonzero(off > _ROUNDED)[:1]:
            raise columns.wrong(
                int(row), "expected_dv_x", f"burn, turns and deadband miss the expected dV by {1e3 * off[row]:.2g} mm/s",
                "Expected dV is their sum, before any correction; give the sum or the parts.",
            )  # fmt: skip
    return expected


def _positive(columns: Columns, name: str, values) -> None:
    for row in np.flatnonzero(values < SMALLEST)[:1]:
        raise columns.wrong(int(row), name, f"{values[row]:g} m/s is not the size of a maneuver", "A dV is positive.")


def _not_negative(columns: Columns, name: str, values) -> None:
    for row in np.flatnonzero(values < 0)[:1]:
        raise columns.wrong(int(row), name, "a standard deviation is not negative", "Correct it; 0 says exactly known.")


def _in_order(found: Maneuvers) -> Maneuvers:
    return found if found.tai_ns is None else found.take(np.argsort(found.tai_ns, kind="stable"))


def _one_spelling(found: Maneuvers) -> Maneuvers:
    """Engines whose names differ in case, blanks and hyphens alone are one, called as most rows call it."""
    spellings: dict[str, Counter] = {}
    for name in found.engine:
        spellings.setdefault(re.sub(r"[\s_-]", "", name.casefold()), Counter())[name] += 1
    several = [names for names in spellings.values() if len(names) > 1]
    if not several:
        return found
    usual = {name: names.most_common(1)[0][0] for names in spellings.values() for name in names}
    told = [ENGINE_SPELLINGS(spellings=some_of(sorted(names)), engine=names.most_common(1)[0][0]) for names in several]
    return replace(found, engine=tuple(usual[n] for n in found.engine), doubts=found.doubts + Doubts(told))
