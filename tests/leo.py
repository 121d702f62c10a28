"""The low-orbit small satellite of ../shared/data/leo: what an analyst is told of it, its records by house names, and the truth.

The door does not read its semicolon tables, so each is brought to what the door reads."""

import csv
import gzip
import json
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from asflown.craft.load import load_craft
from asflown.kit.timeline import NS
from asflown.telemetry.load import load_telemetry
from conftest import flight_data
from flights import telemetry_of

CONTROLLER = """
[wheel_controller]
bandwidth = "0.03 Hz"
damping = 0.8
"""

DAYS = (1, 6, 10, 13, 18, 22, 27, 30)  # of the run-downs
_RUN_DOWN_COLUMNS = [
    *((f"RW{k}_SPD", f"wheel_rate_RW{k}", "rpm", "0.1 rpm") for k in range(1, 5)),
    *((f"RW{k}_CUR", f"wheel_current_RW{k}", "A", "0.0001 A") for k in range(1, 5)),
    *((f"GYR_{a.upper()}", f"body_rate_{a}", "deg/s", "0.000001 deg/s") for a in "xyz"),
]


# ---- the files ------------------------------------------------------------------------------------------------


@cache
def said(name: str) -> dict:
    """What stands beside a record: 'told', and 'truth'."""
    return json.loads(flight_data(f"leo/{name}.json").read_text())


@cache
def rows(name: str) -> list[dict[str, str]]:
    with gzip.open(flight_data(f"leo/{name}.csv.gz"), "rt") as f:
        return list(csv.DictReader(f, delimiter=";"))


@cache
def seconds(name: str = "nadir-eclipse") -> np.ndarray:
    at = np.array([np.datetime64(r["UTC"].rstrip("Z")) for r in rows(name)])
    return (at - at[0]) / np.timedelta64(1, "s")


# ---- the craft ------------------------------------------------------------------------------------------------


def craft_file(
    folder: Path, name: str, *, inertia: str | None = "estimated", motor: bool = False, controller: str = ""
) -> Path:
    """As an analyst would describe it.  ``inertia``: basis of the CAD tensor, None to leave it out; ``motor``: with the
    wheels' torque constant."""
    told = said(name)["told"]
    text = ['name = "kestrel"', 'description = "small satellite in low orbit"']
    if inertia is not None:
        cad = np.array(told["inertia_cad_kgm2"])
        elements = " ".join(f"{v}" for v in (cad[0, 0], cad[1, 1], cad[2, 2], cad[0, 1], cad[0, 2], cad[1, 2]))
        text += ["[[mass_properties]]", 'date = "2026-01-01"', 'piece = "flight"', f'basis = "{inertia}"']
        text += [f'inertia = "{elements} kg m2"', 'source = "CAD"']
    for wheel, axis in zip(told["wheels"], told["wheel_axes"], strict=True):
        text += ["[[wheels]]", f'name = "{wheel}"', f'axis = "{axis[0]} {axis[1]} {axis[2]}"']
        text.append(f'spin_inertia = "{told["wheel_spin_inertia_kgm2"]} kg m2"')
        text += ['torque_constant = "0.05 N m/A"'] if motor else []
    path = folder / "kestrel.toml"
    path.write_text("\n".join(text) + "\n" + controller)
    return path


def craft(folder: Path, name: str = "nadir-eclipse", **described):
    """The craft of ``craft_file``."""
    return load_craft(str(craft_file(folder, name, **described)))


# ---- the nadir hold -------------------------------------------------------------------------------------------


def record(folder, name="nadir-eclipse", start_s=0.0, stop_s=np.inf, without=(), commanded=None, orbit=False):
    """A window of the record; ``without``: stems left out; ``commanded``: rates (N, 3) [rad/s] of the times, as a channel;
    ``orbit``: with positions and velocities."""
    lines = rows(name)
    columns = {f"wheel_rate_{w} [rpm]": f"{w}_SPD" for w in said(name)["told"]["wheels"]}
    columns |= {f"body_rate_{a} [deg/s]": f"GYR_{a.upper()}" for a in "xyz"}
    columns |= {f"attitude_error_{a} [deg]": f"ATT_ERR_{a.upper()}" for a in "xyz"}
    columns |= {f"quaternion_{c} []": f"ADCS_Q{i}" for c, i in zip("xyzw", (1, 2, 3, 4), strict=True)}
    if orbit:
        columns |= {f"orbit_position_{a} [km]": f"POS_{a.upper()}" for a in "xyz"}
        columns |= {f"orbit_velocity_{a} [km/s]": f"VEL_{a.upper()}" for a in "xyz"}
    kept = {k: v for k, v in columns.items() if not k.startswith(tuple(without))}
    t = seconds(name)
    use = np.flatnonzero((t >= start_s) & (t <= stop_s))
    extra = (
        {} if commanded is None else {f"commanded_rate_{a} [rad/s]": commanded(t)[:, j] for j, a in enumerate("xyz")}
    )
    path = folder / f"{name}-{start_s:g}.csv"
    with path.open("w") as f:
        f.write(f"# epoch: {lines[0]['UTC'].rstrip('Z')} UTC\n" + ",".join(["time [s]", *kept, *extra]) + "\n")
        for i in use:
            told_there = [lines[i][c] for c in kept.values()] + [repr(float(v[i])) for v in extra.values()]
            f.write(",".join([f"{t[i]:.3f}", *told_there]) + "\n")
    return load_telemetry(path)


def truth(name, time_s):
    """Torque (N, 3) at times from the record's start."""
    true = said(name)["truth"]
    torque = np.array(true[next(k for k in true if "torque" in k.lower())])
    return np.column_stack([np.interp(time_s, true["t_s"], torque[:, j]) for j in range(3)])


def coverage(result, name="nadir-eclipse"):
    """Share of instants whose 95 % band holds the truth, per axis."""
    off = (result.torque_Nm - truth(name, result.time_s)) / result.torque_sigma_Nm
    return np.mean(np.abs(off) <= 1.96, axis=0)


# ---- the slews ------------------------------------------------------------------------------------------------


@cache
def slews(name: str):
    """Wheel rates, attitude, body rates, orbit, field and Sun."""
    t = seconds(name)

    def column(heading, factor=1.0):
        return t, factor * np.array([float(r[heading]) for r in rows(name)])

    made = {f"wheel_rate_RW{k}": column(f"RW{k}_SPD", np.pi / 30) for k in (1, 2, 3, 4)}
    made |= {f"quaternion_{m}": column(f"ADCS_Q{k}") for m, k in (("x", 1), ("y", 2), ("z", 3), ("w", 4))}
    for a in "xyz":
        made[f"body_rate_{a}"] = column(f"GYR_{a.upper()}", np.pi / 180)
        made[f"orbit_position_{a}"] = column(f"POS_{a.upper()}", 1e3)
        made[f"orbit_velocity_{a}"] = column(f"VEL_{a.upper()}", 1e3)
    for a in "xyz":
        made[f"magnetic_field_{a}"] = column(f"MAG_{a.upper()}", 1e-9)
        made[f"sun_direction_{a}"] = column(f"SUN_{a.upper()}")
    return telemetry_of(826_876_837 * NS, **made)


# ---- the run-downs --------------------------------------------------------------------------------------------


@cache
def _folder() -> Path:
    return Path(mkdtemp())


def run_downs(day: int) -> str:
    """Name of a day's record."""
    return f"run-downs-day{day:02d}"


def table(day: int, *, current: bool = True) -> tuple[Path, Path]:
    """A comma table of one day, and its dictionary; without the motor currents where ``current`` is not set."""
    columns = [c for c in _RUN_DOWN_COLUMNS if current or not c[1].startswith("wheel_current")]
    path = _folder() / f"{'with' if current else 'without'}-current-day{day:02d}.csv"
    with path.open("w") as out:
        out.write(",".join(["UTC", *(c[0] for c in columns)]) + "\n")
        for row in rows(run_downs(day)):
            out.write(",".join([row["UTC"], *(row[c[0]] for c in columns)]) + "\n")
    dictionary = _folder() / f"{'with' if current else 'without'}.toml"
    text = '[time]\ncolumn = "UTC"\nformat = "utc"\n'
    for column, name, unit, count in columns:
        text += f'\n[[channel]]\ncolumn = "{column}"\nname = "{name}"\nunit = "{unit}"\ncount = "{count}"\n'
    dictionary.write_text(text)
    return path, dictionary


@cache
def wheel_craft_file() -> Path:
    """Wheels with their motors, and no inertia."""
    return craft_file(_folder(), run_downs(DAYS[0]), inertia=None, motor=True)


@cache
def wheel_craft():
    return load_craft(str(wheel_craft_file()))


@cache
def flown_day(day: int, current: bool = True):
    path, dictionary = table(day, current=current)
    return load_telemetry(path, channels=dictionary, craft=wheel_craft())
