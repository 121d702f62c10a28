"""Torque per density along a flyby, about every axis that gas turns: 1/2 C_D V^2 A u x (r_CP - r_CM)  (004 eqs 21, 22).

004 takes speed, area and arm at closest approach for all of it, and one axis.  A table gives them over time, the arm as a
vector: then one density explains the torque about all axes at once.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.drag import PRINTED_E3, torque_per_density
from ...kit.errors import BadInput
from ...kit.quantities import si_factor
from ...telemetry.channels import AXES, split_header

if TYPE_CHECKING:
    from ...craft.model import Aerodynamics, Craft
    from ...dynamics.flyby import Flyby

#: What 004 judges its torque to be off by, and what else is (section VI): their root sum of squares is 7.73 %.
PRINTED_SHAPE, PRINTED_SCALE = 0.05, 0.059
_REACH_S = 1200.0  # speeds are followed for so long before and after closest approach
#: What a table should hold: where jets are met; and by how much it may change from row to row, and its speed differ from the flyby's.
_COVERS_S, _STEP, _UNLIKE = (-60.0, 160.0), 0.3, 0.2
_UNITS = {"time": "s", "speed": "m/s", "area": "m2", "arm_x": "m", "arm_y": "m", "arm_z": "m"}
_REMEDY = "Write a CSV with the header time [s],speed [m/s],area [m2],arm_x [m],arm_y [m],arm_z [m]: times from closest approach increasing; speed may be left out."


@dataclass(frozen=True)
class DragAlong:
    """Torque per density (K, 3) [N m / (kg/m3)] at times from closest approach, lines between, its ends held beyond.

    ``axes``: those about which gas turns the craft; ``signed``: whether the arm's sign is known; ``scale``: one sigma of all, as a share; None where not known."""

    time_s: np.ndarray
    per_density: np.ndarray
    axes: tuple[int, ...]
    signed: bool
    scale: float | None
    settings: dict
    doubts: tuple[str, ...]

    def at(self, time_s) -> np.ndarray:
        """(N, 3) [N m / (kg/m3)]"""
        return np.stack([np.interp(time_s, self.time_s, k) for k in self.per_density.T], axis=-1)

    @property
    def names(self) -> str:
        return "".join(AXES[j] for j in self.axes)


def flyby_drag(craft: Craft, flyby: Flyby, axis=None, area_m2=None, arm_m=None, table=None, printed=False) -> DragAlong:
    """The craft's drag with what the user gives in its place.

    ``table``: a CSV file of time, speed, area and arm vector (then all its axes, or the one named).

    Raises BadInput where drag or its axis is not known, for impossible sizes, and for a table that cannot be read."""
    air = craft.aerodynamics
    if air is None:
        raise BadInput(
            f"the drag of {craft.name} is not known",
            remedy="Describe it under [aerodynamics] in the craft file: drag_coefficient, projected_area, moment_arm.",
        )
    if axis is not None and axis not in AXES:
        raise BadInput(f"axis {axis!r} is not known", remedy="Choose one of: x, y, z.")
    if printed and (
        flyby.name != "E3" or any(v is not None for v in (area_m2, arm_m, table)) or (axis or air.axis) != "z"
    ):
        raise BadInput(
            "the printed torque per density is that of E3 about z, with its own area and arm",
            remedy="Use --variant corrected.",
        )
    scale: float | None
    scale, doubts = (PRINTED_SCALE, []) if printed else _scale(air)
    if table is not None:
        if area_m2 is not None or arm_m is not None:
            raise BadInput("area and arm are in the drag table, and given beside it", remedy="Leave out --area, --arm.")
        return _from_table(Path(table), air, flyby, axis, scale, doubts)
    about = axis or air.axis
    if about != air.axis and arm_m is None:
        raise BadInput(
            f"the moment arm of {craft.name} is known about {air.axis} only", remedy=f"Give that about {about}: --arm."
        )
    for name, value in {"projected area": area_m2, "moment arm": arm_m}.items():
        if value is not None and not 0 < value < 1e6:
            raise BadInput(f"a {name} of {value:g} is not possible", remedy="Give a positive size.")
    area, arm = area_m2 or air.projected_area, arm_m or air.moment_arm
    if air.flyby and air.flyby != flyby.name and None in (area_m2, arm_m):
        scale = None
        doubts.append(
            f"projected area and moment arm are those of the attitude at {air.flyby}, not at {flyby.name}: the density's scale is not known (--area, --arm)"
        )
    t, speed = _speeds(flyby)
    constant = "speed, area and arm" if len(t) == 1 else "area and arm"
    doubts.append(f"{constant} count as constant through the flyby (--drag-table)")
    if printed:
        doubts.append("printed method: sigma is 004's judgement of 5 % (shape) and 5.9 % (scale), not this record's")
    k = np.zeros((len(t), 3))
    k[:, AXES.index(about)] = PRINTED_E3 if printed else torque_per_density(air.drag_coefficient, speed, area, arm)
    settings = {
        "speed_m_s": flyby.speed_m_s, "drag_coefficient": None if printed else air.drag_coefficient,
        "projected_area_m2": None if printed else area, "moment_arm_m": None if printed else arm,
    }  # fmt: skip
    return DragAlong(t, k, (AXES.index(about),), False, scale, settings, tuple(doubts))


def _speeds(flyby: Flyby) -> tuple[np.ndarray, np.ndarray]:
    """Times from closest approach [s] and speeds [m/s]: one where the speed is constant, else every second."""
    t = np.arange(-_REACH_S, _REACH_S + 1)
    speed = np.broadcast_to(flyby.speed(t), t.shape)
    return (t, speed) if np.ptp(speed) > 1e-9 * flyby.speed_m_s else (np.zeros(1), np.array([flyby.speed_m_s]))


def _scale(air: Aerodynamics) -> tuple[float, list[str]]:
    """One sigma of the torque per density, as a share."""
    if air.scale_sigma is not None:
        return air.scale_sigma, []
    doubt = "only the drag coefficient's error is in the scale: area and arm count as exact (scale_sigma in the craft file would hold all)"
    return air.drag_coefficient_sigma / air.drag_coefficient, [doubt]


def _from_table(path: Path, air: Aerodynamics, flyby: Flyby, axis, scale: float, doubts: list[str]) -> DragAlong:
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
    for j in axes:
        if np.any(k[:, j] > 0) and np.any(k[:, j] < 0):
            doubts = [
                *doubts,
                f"the arm about {AXES[j]} passes through zero: near there its torque says nothing of the density",
            ]
    doubts = [*doubts, *_table_doubts(t, speed, k, flyby)]
    settings = {
        "drag_table": str(path), "drag_coefficient": air.drag_coefficient, "speed_m_s": [speed.min(), speed.max()],
        "projected_area_m2": [area.min(), area.max()], "table_from_s": t[0], "table_to_s": t[-1],
    }  # fmt: skip
    return DragAlong(t, k, axes, True, scale, settings, tuple(doubts))


def _table_doubts(t, speed, k, flyby: Flyby) -> list[str]:
    doubts = []
    if t[0] > _COVERS_S[0] or t[-1] < _COVERS_S[1]:
        doubts.append(
            f"the drag table runs from {t[0]:+.0f} to {t[-1]:+.0f} s only: its first and last values are held beyond"
        )
    size = np.linalg.norm(k, axis=1)
    change = np.linalg.norm(np.diff(k, axis=0), axis=1) / size.max()
    if change.max() > _STEP:
        i = int(np.argmax(change))
        doubts.append(
            f"the drag table changes by {100 * change[i]:.0f} % from {t[i]:+.0f} to {t[i + 1]:+.0f} s: lines stand for what is between (rows closer together)"
        )
    near = int(np.argmin(np.abs(t)))
    unlike = float(speed[near] / flyby.speed(t[near]))
    if abs(unlike - 1) > _UNLIKE:
        doubts.append(
            f"the drag table's speed is {unlike:.2g} times that of {flyby.name}: is it the right flyby, and unit?"
        )
    return doubts


def _read(path: Path) -> dict[str, np.ndarray]:
    """Columns of a drag table in SI.  Raises BadInput naming file and line."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = [(n, r) for n, r in enumerate(csv.reader(file), start=1) if r and not r[0].lstrip().startswith("#")]
    except (OSError, UnicodeDecodeError) as why:
        raise BadInput(f"this drag table cannot be read ({why})", file=path, remedy=_REMEDY) from why
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
            values.append([float(cell) for cell in row])
        except ValueError:
            values.append([])
        if len(values[-1]) != len(names) or not np.isfinite(values[-1]).all():
            raise BadInput(f"line {number} of this drag table does not match its header", file=path, remedy=_REMEDY)
    found = {
        n: np.array(v) * si_factor(unit, _UNITS[n])
        for (n, unit), v in zip(known, zip(*values, strict=True), strict=True)
    }
    if np.any(np.diff(found["time"]) <= 0):
        raise BadInput("the times of this drag table do not increase", file=path, remedy=_REMEDY)
    return found
