"""What the numbers of a table of maneuvers make doubtful by themselves: wrong units, lost signs, two frames, rows listed twice."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..kit.doubts import Doubt, Kind, Severity
from ..kit.errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Iterator

#: A median error beyond this share of the dV is rather a wrong unit.
_BEYOND_BELIEF = 0.3
#: A median error below this share of the dV, of at least so many burns, is beyond any engine.
_TOO_SMALL, _SEVERAL = 2e-5, 5
#: A maneuver this large is rarer than a wrong unit. [m/s]
_LARGEST_DV = 3000.0
#: Pointing over magnitude errors of an engine: an accelerometer cuts off to 0.02 % where pointing is good to 5 mrad, and little makes
#: the magnitude much worse than the pointing.
_LEAST_RATIO, _LARGEST_RATIO = 1 / 30, 50.0
#: Doppler tracking sees a burn to 0.01 mm/s at best, and any to 10 mm/s; beyond half and five times these no orbit determination is. [m/s]
_FINEST, _COARSEST = 5e-6, 0.05
#: Rows are alike where dV and errors agree to this share; so many of them, as a share of all, make a table listed twice where no
#: pointing errors tell them apart.
_NEAR, _MANY = 2e-3, 0.2
#: Reconstructed and expected dV this far apart in the median are in two frames. [rad]
_TWO_FRAMES = 0.3
#: An engine is gimballed by no more than this. [deg]
_TURNS_DEG = 40.0

LARGE_ERRORS = Kind(
    "maneuvers.large-errors", Severity.SUSPECT,
    "the median magnitude error is {share_percent:.0f} % of the dV: is a unit in the headings wrong?",
    "Check the units in the headings.",
)  # fmt: skip
LARGE_POINTING = Kind(
    "maneuvers.large-pointing", Severity.SUSPECT,
    "the median pointing error is {share_percent:.0f} % of the dV, which is {angle_deg:.0f} degrees: is a unit wrong, or are "
    "reconstructed and expected dV in two frames (RTN and inertial)?",
    "Check the units in the headings; give all vectors in one inertial frame, and angles times the dV.",
)  # fmt: skip
PARTS_APART = Kind(
    "maneuvers.pointing-against-magnitude", Severity.SUSPECT,
    "pointing errors are {ratio:.2g} times the magnitude errors (medians): is the unit of one of them wrong?",
    "Check the units of magnitude_error and pointing_error_x, _y; pointing errors are velocities, not angles.",
)  # fmt: skip
FINE_SIGMAS = Kind(
    "maneuvers.sigma-too-small", Severity.SUSPECT,
    "the orbit determination's {what} sigma is {sigma_mps:.2g} m/s in the median, finer than tracking sees a burn: is it a variance, or in "
    "another unit?",
    "Check the unit of the sigmas; give standard deviations, or 0 for what is exactly known.",
)  # fmt: skip
COARSE_SIGMAS = Kind(
    "maneuvers.sigma-too-large", Severity.SUSPECT,
    "the orbit determination's {what} sigma is {sigma_mps:.2g} m/s in the median, coarser than tracking sees a burn: are the values mm/s "
    "labelled m/s?",
    "Check the units in the headings.",
)  # fmt: skip
REPEATED_ROWS = Kind(
    "maneuvers.repeated-rows", Severity.SUSPECT,
    "{count} rows have the dV and the errors of another row{near}: is the table listed twice?", "Leave the copies out.",
)  # fmt: skip
SAME_COLUMNS = Kind(
    "maneuvers.same-columns", Severity.SUSPECT, "{columns} are the same in every row: is one column under two names?",
    "Check which column holds what.",
)  # fmt: skip
SMALL_ERRORS = Kind(
    "maneuvers.small-errors", Severity.SUSPECT,
    "the median magnitude error is {share:.1g} of the dV, far below what engines reach: is a unit in the headings wrong?",
    "Check the units in the headings.",
)  # fmt: skip
LARGE_DV = Kind(
    "maneuvers.large-dv", Severity.SUSPECT,
    "the largest dV is {largest_mps:.4g} m/s: are the values mm/s labelled m/s?", "Check the unit of the dV.",
)  # fmt: skip
ENGINE_TURNS = Kind(
    "maneuvers.engine-turns", Severity.CAUTION,
    "the angle between craft_x and the expected dV of {engine} is anything from {low_deg:.0f} to {high_deg:.0f} degrees, where an engine is "
    "fixed in the craft: craft_x and the vectors may be in two frames, which mixes pointing X and Y",
    "Give craft_x and all vectors in one inertial frame.",
)  # fmt: skip


def check_directions(reconstructed, expected, ids: tuple[str, ...]) -> None:
    """Raises BadInput where reconstructed dV (N, 3) point against the expected ones, which is one frame too many or a sign."""
    against = np.flatnonzero(np.sum(reconstructed * expected, axis=1) < 0)
    if len(against):
        raise BadInput(
            f"the reconstructed dV of {len(against)} of {len(ids)} maneuvers point against the expected ones, first {ids[against[0]]}",
            channel="reconstructed_dv_x",
            remedy="Are the two in two frames (RTN and inertial), or is a sign reversed?  Give all vectors in one inertial frame.",
        )


def engine_turns(expected, craft_x, engines: tuple[str, ...]) -> Iterator[Doubt]:
    """A doubt for each engine whose dV (N, 3) stands at all angles to the craft's X axis (N, 3)."""
    along = np.sum(expected * craft_x, axis=1) / np.linalg.norm(expected, axis=1) / np.linalg.norm(craft_x, axis=1)
    angle = np.degrees(np.arccos(np.clip(along, -1, 1)))
    for engine in sorted(set(engines)):
        own = angle[[e == engine for e in engines]]
        if len(own) >= _SEVERAL and np.ptp(own) > _TURNS_DEG:
            yield ENGINE_TURNS(engine=engine or "the engine", low_deg=float(own.min()), high_deg=float(own.max()))


class Burns(Protocol):
    """What is looked at, as ``Maneuvers`` holds it: N of each; SI, None where pointing is not known."""

    def __len__(self) -> int: ...
    @property
    def dv_mps(self) -> np.ndarray: ...
    @property
    def magnitude_error_mps(self) -> np.ndarray: ...
    @property
    def sigma_magnitude_mps(self) -> np.ndarray: ...
    @property
    def pointing_error_mps(self) -> np.ndarray | None: ...
    @property
    def sigma_pointing_mps(self) -> np.ndarray: ...


def implausible(m: Burns) -> Iterator[Doubt]:
    """Doubts of maneuvers, one engine or several together."""
    share = float(np.median(np.abs(m.magnitude_error_mps) / m.dv_mps))
    if share > _BEYOND_BELIEF:
        yield LARGE_ERRORS(share_percent=100 * share)
    if len(m) >= _SEVERAL and share < _TOO_SMALL:
        yield SMALL_ERRORS(share=share)
    if m.dv_mps.max() > _LARGEST_DV:
        yield LARGE_DV(largest_mps=float(m.dv_mps.max()))
    yield from _of_pointing(m)
    yield from _of_sigmas(m)
    yield from _of_rows(m)


def _of_pointing(m: Burns) -> Iterator[Doubt]:
    if m.pointing_error_mps is None:
        return
    across = np.linalg.norm(m.pointing_error_mps, axis=1)
    share = float(np.median(across / m.dv_mps))
    if share > _TWO_FRAMES:
        yield LARGE_POINTING(share_percent=100 * share, angle_deg=float(np.degrees(np.arctan(share))))
        return
    sizes = float(np.median(across)), float(np.median(np.abs(m.magnitude_error_mps)))
    if len(m) >= _SEVERAL and min(sizes) > 0 and not _LEAST_RATIO < sizes[0] / sizes[1] < _LARGEST_RATIO:
        yield PARTS_APART(ratio=sizes[0] / sizes[1])


def _of_sigmas(m: Burns) -> Iterator[Doubt]:
    sigmas = {"magnitude": m.sigma_magnitude_mps}
    if m.pointing_error_mps is not None:
        sigmas["pointing"] = m.sigma_pointing_mps
    for what, sigma in sigmas.items():
        median = float(np.median(sigma))
        if 0 < median < _FINEST:
            yield FINE_SIGMAS(what=what, sigma_mps=median)
        elif median > _COARSEST:
            yield COARSE_SIGMAS(what=what, sigma_mps=median)


def _of_rows(m: Burns) -> Iterator[Doubt]:
    """Rows that occur twice, to the last digit or rounded, and columns that do."""
    yield from _of_columns(m)
    rows = np.column_stack([m.dv_mps, m.magnitude_error_mps, m.sigma_magnitude_mps])
    same = len(rows) - len(np.unique(rows, axis=0))
    if same:
        yield REPEATED_ROWS(count=same, near="")
        return
    numbers = [m.dv_mps, m.magnitude_error_mps]
    if m.pointing_error_mps is not None:
        numbers += list(m.pointing_error_mps.T)
    values = np.column_stack(numbers)
    order = np.argsort(m.dv_mps, kind="stable")
    near = 0
    for k, row in enumerate(order):  # of the rows of about its dV, whether one is alike
        others = order[k + 1 : np.searchsorted(m.dv_mps, m.dv_mps[row] * (1 + _NEAR), sorter=order)]
        alike = np.abs(values[others] - values[row]) <= _NEAR * np.abs(values[row])
        near += bool(alike.all(axis=1).any())
    if near > (0 if len(numbers) > 2 else _MANY * len(m)):
        yield REPEATED_ROWS(count=near, near=f" to {100 * _NEAR:g} %")


def _of_columns(m: Burns) -> Iterator[Doubt]:
    columns = {"dv": m.dv_mps, "magnitude_error": m.magnitude_error_mps}
    if m.pointing_error_mps is not None:
        columns |= {f"pointing_error_{a}": e for a, e in zip("xy", m.pointing_error_mps.T, strict=True)}
    for (a, x), (b, y) in combinations(columns.items(), 2):
        if len(m) >= _SEVERAL and np.ptp(x) > 0 and np.array_equal(x, y):
            yield SAME_COLUMNS(columns=[a, b])
