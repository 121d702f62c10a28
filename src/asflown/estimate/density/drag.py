"""Torque per density along a flyby, about every axis that gas turns: 1/2 C_D V^2 A u x (r_CP - r_CM)  (plume paper eqs 21, 22).

The plume paper takes speed, area and arm at closest approach for all of the flyby, and one axis.  A table gives them over
time, the arm as a vector: then one density explains the torque about all axes at once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.drag import PRINTED_E3, torque_per_density
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput, check_choice
from ...kit.quantities import si_factor
from ...kit.reading import csv_rows, plain_number, read_text, reading
from ...telemetry.channels import AXES, split_header
from .expected import size_doubts

if TYPE_CHECKING:
    from ...craft.model import Aerodynamics, Craft
    from ...dynamics.flyby import Flyby

#: Errors that the plume paper judges its torque (shape) and its drag (scale) to have; section VI: root sum of squares 7.73 %.
PRINTED_SHAPE, PRINTED_SCALE = 0.05, 0.059
_REACH_S = 1200.0  # speeds are followed for so long before and after closest approach
#: What a table should hold: where jets are met [s]; and by how much it may change from row to row, and its speed differ from the
#: flyby's, as shares.  Assumed.
_COVERS_S, _STEP, _UNLIKE = (-60.0, 160.0), 0.3, 0.2
_UNITS = {"time": "s", "speed": "m/s", "area": "m2", "arm_x": "m", "arm_y": "m", "arm_z": "m"}
_REMEDY = "Write a CSV with the header time [s],speed [m/s],area [m2],arm_x [m],arm_y [m],arm_z [m]: times from closest approach increasing; speed may be left out."

SCALE_UNKNOWN = Kind(
    "density.scale-unknown", Severity.SUSPECT,
    "projected area and moment arm are those of the attitude at {known_at}, not at {flyby}: the density's scale is not known",
    "Give --area and --arm, or --drag-table.",
)  # fmt: skip
CONSTANT_DRAG = Kind(
    "density.constant-drag", Severity.NOTE, "{what} are assumed constant through the flyby", "Give --drag-table."
)
PRINTED_ERRORS = Kind(
    "density.printed-errors", Severity.CAUTION,
    "printed method: sigma is the plume paper's judgement of 5 % (shape) and 5.9 % (scale), not estimated from this record",
    "Use --variant corrected.",
)  # fmt: skip
DRAG_COEFFICIENT_ONLY = Kind(
    "density.drag-coefficient-only", Severity.CAUTION,
    "the scale's sigma holds the error of the drag coefficient only: area and arm are taken as exact",
    "Give scale_sigma in the craft file.",
)  # fmt: skip
ARM_THROUGH_ZERO = Kind(
    "density.arm-through-zero", Severity.NOTE,
    "the arm about {axis} passes through zero: near there its torque does not tell the density",
)  # fmt: skip
TABLE_SHORT = Kind(
    "density.drag-table-short", Severity.CAUTION,
    "the drag table covers {start_s:+.0f} to {stop_s:+.0f} s only: its first and last values are held beyond",
    "Add rows to the drag table.",
)  # fmt: skip
TABLE_COARSE = Kind(
    "density.drag-table-coarse", Severity.CAUTION,
    "the drag table changes by {change_percent:.0f} % from {start_s:+.0f} to {stop_s:+.0f} s: it is interpolated linearly there",
    "Give rows closer together.",
)  # fmt: skip
TABLE_SPEED = Kind(
    "density.drag-table-speed", Severity.SUSPECT,
    "the drag table's speed is {ratio:.2g} times that of {flyby}",
    "Check that the table is of this flyby, and its unit of speed.",
)  # fmt: skip


@dataclass(frozen=True)
class DragGiven:
    """What the user gives in place of the craft's drag: an axis, area [m2] and arm [m], or a table (a CSV file)."""

    axis: str | None = None
    area_m2: float | None = None
    arm_m: float | None = None
    table: Path | str | None = None

    @property
    def replaces(self) -> bool:
        """Whether area, arm or a table is given."""
        return any(v is not None for v in (self.area_m2, self.arm_m, self.table))


@dataclass(frozen=True)
class DragAlong:
    """Torque per density (K, 3) [N m / (kg/m3)] at times from closest approach, interpolated linearly, its ends held beyond.

    ``axes``: those about which gas turns the craft; ``signed``: whether the arm's sign is known, else it is ``sign``;
    ``scale_sigma``: one sigma of all, as a share; None where not known."""

    time_s: np.ndarray
    per_density: np.ndarray
    axes: tuple[int, ...]
    signed: bool
    scale_sigma: float | None
    settings: dict
    doubts: Doubts
    sign: float = 1.0

    def at(self, time_s) -> np.ndarray:
        """(N, 3) [N m / (kg/m3)]"""
        return self.sign * np.stack([np.interp(time_s, self.time_s, k) for k in self.per_density.T], axis=-1)

    def about(self, axis: int, time_s) -> np.ndarray:
        """About one axis, of the shape of ``time_s``. [N m / (kg/m3)]"""
        return self.at(time_s)[..., axis]

    def as_pushes(self, torque_Nm: np.ndarray) -> DragAlong:
        """With the sign, where it is not known, that makes the density positive at the largest of these torques (N,)."""
        if self.signed:
            return self
        return replace(self, sign=float(np.sign(torque_Nm[np.argmax(np.abs(torque_Nm))])) or 1.0)

    @property
    def names(self) -> str:
        return "".join(AXES[j] for j in self.axes)


def flyby_drag(craft: Craft, flyby: Flyby, given: DragGiven, variant: str = "corrected") -> DragAlong:
    """The craft's drag, with what the user gives in its place; of a table all its axes, or the one named.

    Raises BadInput where drag or its axis is not known, for impossible sizes, and for a table that cannot be read."""
    air = craft.aerodynamics
    if air is None or not air.in_flyby:
        raise BadInput(
            f"the drag of {craft.name} is not known",
            remedy="Describe it under [aerodynamics] in the craft file: drag_coefficient, projected_area, moment_arm.",
        )
    check_choice(given.axis, (None, *AXES), "axis")
    if variant == "printed":
        return _printed(air, flyby, given)
    if given.table is not None:
        return _from_table(air, flyby, given)
    if given.axis not in (None, air.axis) and given.arm_m is None:
        raise BadInput(
            f"the moment arm of {craft.name} is known about {air.axis} only",
            remedy=f"Give that about {given.axis}: --arm.",
        )
    return _constant(air, flyby, given)


def _printed(air: Aerodynamics, flyby: Flyby, given: DragGiven) -> DragAlong:
    """The plume paper's constant."""
    if flyby.name != "E3" or given.replaces or (given.axis or air.axis) != "z":
        raise BadInput(
            "the printed torque per density is that of E3 about z, with its own area and arm",
            remedy="Use --variant corrected.",
        )
    settings = {
        "speed_m_s": flyby.speed_m_s, "drag_coefficient": None, "projected_area_m2": None, "moment_arm_m": None,
    }  # fmt: skip
    doubts = Doubts([CONSTANT_DRAG(what="speed, area and arm"), PRINTED_ERRORS()])
    return DragAlong(np.zeros(1), np.array([[0.0, 0.0, PRINTED_E3]]), (2,), False, PRINTED_SCALE, settings, doubts)


def _constant(air: Aerodynamics, flyby: Flyby, given: DragGiven) -> DragAlong:
    """Area and arm of one attitude, and the flyby's speed."""
    for name, value in {"projected area": given.area_m2, "moment arm": given.arm_m}.items():
        if value is not None and not 0 < value < 1e6:
            raise BadInput(f"the {name} must be positive, and it is {value:g}", remedy="Give a positive size.")
    scale_sigma: float | None
    scale_sigma, doubts = _scale(air)
    area, arm = given.area_m2 or air.projected_area, given.arm_m or air.moment_arm
    if air.flyby and air.flyby != flyby.name and None in (given.area_m2, given.arm_m):
        scale_sigma = None
        doubts.append(SCALE_UNKNOWN(known_at=air.flyby, flyby=flyby.name))
    doubts += size_doubts(air, area, arm)
    t, speed = _speeds(flyby)
    doubts.append(CONSTANT_DRAG(what="speed, area and arm" if len(t) == 1 else "area and arm"))
    j = AXES.index(given.axis or air.axis)
    k = np.zeros((len(t), 3))
    k[:, j] = torque_per_density(air.drag_coefficient, speed, area, arm)
    settings = {
        "speed_m_s": flyby.speed_m_s, "drag_coefficient": air.drag_coefficient, "projected_area_m2": area,
        "moment_arm_m": arm,
    }  # fmt: skip
    return DragAlong(t, k, (j,), False, scale_sigma, settings, Doubts(doubts))


def _speeds(flyby: Flyby) -> tuple[np.ndarray, np.ndarray]:
    """Times from closest approach [s] and speeds [m/s]: one where the speed is constant, else every second."""
    t = np.arange(-_REACH_S, _REACH_S + 1)
    speed = np.broadcast_to(flyby.speed(t), t.shape)
    return (t, speed) if np.ptp(speed) > 1e-9 * flyby.speed_m_s else (np.zeros(1), np.array([flyby.speed_m_s]))


def _scale(air: Aerodynamics) -> tuple[float, list[Doubt]]:
    """One sigma of the torque per density, as a share."""
    if air.scale_sigma is not None:
        return air.scale_sigma, []
    return air.drag_coefficient_sigma / air.drag_coefficient, [DRAG_COEFFICIENT_ONLY()]


def _from_table(air: Aerodynamics, flyby: Flyby, given: DragGiven) -> DragAlong:
    path, axis = Path(str(given.table)), given.axis
    if given.area_m2 is not None or given.arm_m is not None:
        raise BadInput("area and arm are given, and the drag table holds them too", remedy="Leave out --area, --arm.")
    with reading(path, _REMEDY, "this drag table"):
        column = _read(path)
    t, area = column["time"], column["area"]
    speed = column["speed"] if "speed" in column else flyby.speed(t)
    arm = np.stack([column.get(f"arm_{a}", np.zeros(len(t))) for a in AXES], axis=1)
    if not (area > 0).all() or not (speed > 0).all():
        raise BadInput("an area or a speed in this drag table is not positive", file=path, remedy=_REMEDY)
    k = torque_per_density(air.drag_coefficient, speed, area, arm)
    axes = tuple(j for j in range(3) if np.any(k[:, j]) and axis in (None, AXES[j]))
    if not axes:
        where = "any axis" if axis is None else axis
        raise BadInput(f"this drag table has no arm about {where}", file=path, remedy=_REMEDY)
    scale_sigma, doubts = _scale(air)
    doubts += [ARM_THROUGH_ZERO(axis=AXES[j]) for j in axes if np.any(k[:, j] > 0) and np.any(k[:, j] < 0)]
    settings = {
        "drag_table": str(path), "drag_coefficient": air.drag_coefficient, "speed_m_s": [speed.min(), speed.max()],
        "projected_area_m2": [area.min(), area.max()], "table_from_s": t[0], "table_to_s": t[-1],
    }  # fmt: skip
    doubts += [*size_doubts(air, area, np.linalg.norm(arm, axis=1)), *_table_doubts(t, speed, k, flyby)]
    return DragAlong(t, k, axes, True, scale_sigma, settings, Doubts(doubts))


def _table_doubts(t, speed, k, flyby: Flyby) -> list[Doubt]:
    doubts = []
    if t[0] > _COVERS_S[0] or t[-1] < _COVERS_S[1]:
        doubts.append(TABLE_SHORT(start_s=float(t[0]), stop_s=float(t[-1])))
    size = np.linalg.norm(k, axis=1)
    change = np.linalg.norm(np.diff(k, axis=0), axis=1) / size.max()
    if change.max() > _STEP:
        i = int(np.argmax(change))
        doubts.append(TABLE_COARSE(change_percent=100 * float(change[i]), start_s=float(t[i]), stop_s=float(t[i + 1])))
    near = int(np.argmin(np.abs(t)))
    unlike = float(speed[near] / flyby.speed(t[near]))
    if abs(unlike - 1) > _UNLIKE:
        doubts.append(TABLE_SPEED(ratio=unlike, flyby=flyby.name))
    return doubts


def _read(path: Path) -> dict[str, np.ndarray]:
    """Columns of a drag table in SI.  Raises BadInput naming file and line."""
    rows = csv_rows(read_text(path, "drag table", _REMEDY), path, _REMEDY)
    heads = [split_header(cell.strip()) for cell in rows[0][1]] if rows else []
    known = [h for h in heads if h is not None and h[0] in _UNITS]
    names = [h[0] for h in known]
    if len(known) != len(heads) or len(set(names)) != len(names) or not {"time", "area"} <= set(names) or len(rows) < 3:
        raise BadInput(
            "the header of this drag table is not understood, or it has less than two rows", file=path, remedy=_REMEDY
        )
    values = []
    for number, row in rows[1:]:
        try:
            values.append([plain_number(cell) for cell in row])
        except ValueError:
            values.append([])
        if len(values[-1]) != len(names) or not (np.abs(values[-1]) < 1e60).all():
            raise BadInput("this row does not match its header", file=path, line=number, remedy=_REMEDY)
    found = {
        n: np.array(v) * si_factor(unit, _UNITS[n])
        for (n, unit), v in zip(known, zip(*values, strict=True), strict=True)
    }
    if np.any(np.diff(found["time"]) <= 0):
        raise BadInput("the times of this drag table do not increase", file=path, remedy=_REMEDY)
    return found
