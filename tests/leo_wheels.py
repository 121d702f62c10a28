"""Run-downs of the low-orbit craft beside the project, brought to what the door reads: a comma table, a dictionary, a craft file."""

import csv
import gzip
import json
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

from asflown.craft.load import load_craft
from asflown.telemetry.load import load_telemetry
from conftest import flight_data

DAYS = (1, 6, 10, 13, 18, 22, 27, 30)
_COLUMNS = [
    *((f"RW{k}_SPD", f"wheel_rate_RW{k}", "rpm", "0.1 rpm") for k in range(1, 5)),
    *((f"RW{k}_CUR", f"wheel_current_RW{k}", "A", "0.0001 A") for k in range(1, 5)),
    *((f"GYR_{a.upper()}", f"body_rate_{a}", "deg/s", "0.000001 deg/s") for a in "xyz"),
]


@cache
def folder() -> Path:
    return Path(mkdtemp())


def told(day: int) -> dict:
    return json.loads(flight_data(f"leo/run-downs-day{day:02d}.json").read_text())


def truth(day: int) -> dict:
    return told(day)["truth"]


def table(day: int, *, current: bool = True) -> tuple[Path, Path]:
    """A comma table of one day, and its dictionary; without the motor currents where ``current`` is not set."""
    source = flight_data(f"leo/run-downs-day{day:02d}.csv.gz")
    columns = [c for c in _COLUMNS if current or not c[1].startswith("wheel_current")]
    path = folder() / f"{'with' if current else 'without'}-current-day{day:02d}.csv"
    with gzip.open(source, "rt") as read, path.open("w") as out:
        rows = csv.DictReader(read, delimiter=";")
        out.write(",".join(["UTC", *(c[0] for c in columns)]) + "\n")
        for row in rows:
            out.write(",".join([row["UTC"], *(row[c[0]] for c in columns)]) + "\n")
    dictionary = folder() / f"{'with' if current else 'without'}.toml"
    text = '[time]\ncolumn = "UTC"\nformat = "utc"\n'
    for column, name, unit, count in columns:
        text += f'\n[[channel]]\ncolumn = "{column}"\nname = "{name}"\nunit = "{unit}"\ncount = "{count}"\n'
    dictionary.write_text(text)
    return path, dictionary


def craft_file() -> Path:
    given = told(DAYS[0])["told"]
    text = f'name = "{given["craft"]}"\n'
    for name, axis in zip(given["wheels"], given["wheel_axes"], strict=True):
        text += f"""
[[wheels]]
name = "{name}"
axis = "{axis[0]} {axis[1]} {axis[2]}"
spin_inertia = "{given["wheel_spin_inertia_kgm2"]} kg m2"
torque_constant = "0.05 N m/A"
"""
    path = folder() / "kestrel.toml"
    path.write_text(text)
    return path


@cache
def craft():
    return load_craft(str(craft_file()))


@cache
def flown_day(day: int, current: bool = True):
    path, dictionary = table(day, current=current)
    return load_telemetry(path, channels=dictionary, craft=craft())
