"""Slews of the low-orbit craft of ../shared/data/leo, read as an operator's table is: columns mapped, units converted."""

import csv
import gzip
import io
import json
from functools import cache

import numpy as np

from asflown.craft.load import load_craft
from asflown.kit.timeline import NS
from conftest import flight_data
from flights import telemetry_of

AXES = "xyz"


@cache
def told_and_truth(name: str) -> dict:
    return json.loads(flight_data(f"leo/{name}.json").read_text())


def kestrel(folder, name: str = "slews"):
    """The craft from what an analyst is told of it."""
    told = told_and_truth(name)["told"]
    cad = np.array(told["inertia_cad_kgm2"])
    elements = " ".join(f"{v}" for v in (cad[0, 0], cad[1, 1], cad[2, 2], cad[0, 1], cad[0, 2], cad[1, 2]))
    lines = [
        'name = "kestrel"', 'description = "a small craft in low orbit"', "[[mass_properties]]", 'date = "2026-01-01"',
        'piece = "cad"', 'basis = "predicted"', f'inertia = "{elements} kg m2"', 'source = "CAD"',
    ]  # fmt: skip
    for wheel, axis in zip(told["wheels"], told["wheel_axes"], strict=True):
        lines += ["[[wheels]]", f'name = "{wheel}"', f'axis = "{axis[0]} {axis[1]} {axis[2]}"']
        lines.append(f'spin_inertia = "{told["wheel_spin_inertia_kgm2"]} kg m2"')
    path = folder / "kestrel.toml"
    path.write_text("\n".join(lines) + "\n")
    return load_craft(str(path))


@cache
def slews(name: str):
    rows = list(
        csv.DictReader(
            io.StringIO(gzip.decompress(flight_data(f"leo/{name}.csv.gz").read_bytes()).decode()), delimiter=";"
        )
    )
    utc = np.array([np.datetime64(r["UTC"].rstrip("Z"), "ms") for r in rows])
    t = (utc - utc[0]) / np.timedelta64(1, "s")

    def column(heading, factor=1.0):
        return t, factor * np.array([float(r[heading]) for r in rows])

    made = {f"wheel_rate_RW{k}": column(f"RW{k}_SPD", np.pi / 30) for k in (1, 2, 3, 4)}
    made |= {f"quaternion_{m}": column(f"ADCS_Q{k}") for m, k in (("x", 1), ("y", 2), ("z", 3), ("w", 4))}
    for a in AXES:
        made[f"body_rate_{a}"] = column(f"GYR_{a.upper()}", np.pi / 180)
        made[f"orbit_position_{a}"] = column(f"POS_{a.upper()}", 1e3)
        made[f"orbit_velocity_{a}"] = column(f"VEL_{a.upper()}", 1e3)
    for a in AXES:
        made[f"magnetic_field_{a}"] = column(f"MAG_{a.upper()}", 1e-9)
        made[f"sun_direction_{a}"] = column(f"SUN_{a.upper()}")
    return telemetry_of(826_876_837 * NS, **made)
