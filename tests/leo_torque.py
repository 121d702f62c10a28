"""The low-orbit small satellite of ../shared/data/leo for the torque's tests: telemetry by house names, craft file, truth."""

import csv
import gzip
import json
from functools import cache

import numpy as np

from asflown import load_craft, load_telemetry
from conftest import flight_data

_WHEELS = ("RW1", "RW2", "RW3", "RW4")
_RAD = np.pi / 180

CONTROLLER = """
[wheel_controller]
bandwidth = "0.03 Hz"
damping = 0.8
"""


@cache
def told(name):
    return json.loads(flight_data(f"leo/{name}.json").read_text())


@cache
def _rows(name):
    with gzip.open(flight_data(f"leo/{name}.csv.gz"), "rt") as f:
        return list(csv.DictReader(f, delimiter=";"))


def craft(folder, name="nadir-eclipse", controller=CONTROLLER):
    """As an analyst would describe it: CAD inertia, wheels, and what is known of its controller."""
    said = told(name)["told"]
    I_B = np.array(said["inertia_cad_kgm2"])
    text = [
        'name = "kestrel"',
        'description = "small satellite"',
        "[[mass_properties]]",
        'date = "2026-01-01"',
        'piece = "flight"',
    ]
    text.append(f'inertia = "{I_B[0, 0]} {I_B[1, 1]} {I_B[2, 2]} {I_B[0, 1]} {I_B[0, 2]} {I_B[1, 2]} kg m2"')
    for wheel, axis in zip(_WHEELS, said["wheel_axes"], strict=True):
        text += ["[[wheels]]", f'name = "{wheel}"', 'axis = "{} {} {}"'.format(*axis), 'spin_inertia = "0.00042 kg m2"']
    path = folder / "kestrel.toml"
    path.write_text("\n".join(text) + "\n" + controller)
    return load_craft(path)


def record(folder, name="nadir-eclipse", start_s=0.0, stop_s=np.inf, without=(), commanded=None):
    """A window of the record; ``without``: stems left out; ``commanded``: rates (N, 3) [rad/s] of the times, as a channel."""
    rows = _rows(name)
    columns = {f"wheel_rate_{w} [rpm]": f"{w}_SPD" for w in _WHEELS}
    columns |= {f"body_rate_{a} [deg/s]": f"GYR_{a.upper()}" for a in "xyz"}
    columns |= {f"attitude_error_{a} [deg]": f"ATT_ERR_{a.upper()}" for a in "xyz"}
    columns |= {f"quaternion_{c} []": f"ADCS_Q{i}" for c, i in zip("xyzw", (1, 2, 3, 4), strict=True)}
    kept = {k: v for k, v in columns.items() if not k.startswith(tuple(without))}
    t = seconds(name)
    use = np.flatnonzero((t >= start_s) & (t <= stop_s))
    extra = (
        {} if commanded is None else {f"commanded_rate_{a} [rad/s]": commanded(t)[:, j] for j, a in enumerate("xyz")}
    )
    path = folder / f"{name}-{start_s:g}.csv"
    with path.open("w") as f:
        f.write(f"# epoch: {rows[0]['UTC'].rstrip('Z')} UTC\n" + ",".join(["time [s]", *kept, *extra]) + "\n")
        for i in use:
            told_there = [rows[i][c] for c in kept.values()] + [repr(float(v[i])) for v in extra.values()]
            f.write(",".join([f"{t[i]:.3f}", *told_there]) + "\n")
    return load_telemetry(path)


@cache
def seconds(name="nadir-eclipse"):
    at = np.array([np.datetime64(r["UTC"].rstrip("Z")) for r in _rows(name)])
    return (at - at[0]) / np.timedelta64(1, "s")


def truth(name, time_s):
    """Torque (N, 3) at times from the record's start."""
    said = told(name)["truth"]
    torque = np.array(said[next(k for k in said if "torque" in k.lower())])
    return np.column_stack([np.interp(time_s, said["t_s"], torque[:, j]) for j in range(3)])


def coverage(result, name="nadir-eclipse"):
    """Share of instants whose 95 % band holds the truth, per axis."""
    off = (result.torque_Nm - truth(name, result.time_s)) / result.torque_sigma_Nm
    return np.mean(np.abs(off) <= 1.96, axis=0)
