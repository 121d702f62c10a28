"""The house names: what a channel may be called, what it measures, and what is plausible for it.

Torques act on the body, along its axes.  Attitude error = commanded minus estimated, a small-angle
vector in body axes.  Wheel rates are relative to the body.  Quaternions are scalar-first Hamilton,
R(q) takes body vectors to inertial ones.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from typing import Literal

from ..kit.errors import BadInput, some_of
from ..kit.quantities import is_unit, si_factor


@dataclass(frozen=True)
class ChannelKind:
    """One family of channels, ``stem`` + ``_`` + member."""

    stem: str
    unit: str  # SI
    member: Literal["axis", "component", "wheel", "thruster", "mechanism", "none"]
    meaning: str
    behaves: Literal["sensor", "cumulative", "steps", "state"] = "sensor"
    plausible: float | None = None  # largest plausible magnitude, SI; beyond it the unit is doubted
    mistaken_for: str = ""  # unit that a larger value most often has


KINDS = (
    ChannelKind("wheel_rate", "rad/s", "wheel", "wheel rate relative to the body", plausible=700.0, mistaken_for="rpm"),
    ChannelKind("wheel_current", "A", "wheel", "wheel motor current"),
    ChannelKind("wheel_torque", "N m", "wheel", "commanded wheel motor torque, on the wheel", plausible=10.0),
    ChannelKind("wheel_drag_torque", "N m", "wheel", "estimated bearing drag", plausible=1.0),
    ChannelKind("body_rate", "rad/s", "axis", "body rate, inertial", plausible=0.2, mistaken_for="mrad/s or deg/s"),
    ChannelKind("attitude_error", "rad", "axis", "commanded minus estimated attitude", plausible=0.1,
                mistaken_for="mrad or deg"),
    ChannelKind("rate_error", "rad/s", "axis", "commanded minus estimated rate", plausible=0.05,
                mistaken_for="mrad/s or deg/s"),
    ChannelKind("controller_rate_error", "rad/s", "axis", "rate error with KP e added (cover paper eq 17)", plausible=0.05,
                mistaken_for="mrad/s or deg/s"),
    ChannelKind("quaternion", "", "component", "attitude, body to inertial", plausible=1.001),
    ChannelKind("commanded_rate", "rad/s", "axis", "commanded body rate, inertial", plausible=0.2, mistaken_for="mrad/s or deg/s"),
    ChannelKind("commanded_quaternion", "", "component", "commanded attitude, body to inertial", plausible=1.001),
    ChannelKind("magnetic_field", "T", "axis", "magnetic field, body axes", plausible=1e-3, mistaken_for="nT"),
    ChannelKind("sun_direction", "", "axis", "unit vector to the Sun, body axes; zero in shadow", plausible=1.1),
    ChannelKind("torque_rod_dipole", "A m2", "axis", "dipole of the torque rods, body axes"),
    ChannelKind("on_time", "s", "thruster", "cumulative commanded on-time", behaves="cumulative"),
    ChannelKind("pulse_count", "", "thruster", "cumulative pulses", behaves="cumulative"),
    ChannelKind("cover_angle", "rad", "mechanism", "mechanism angle", behaves="steps", plausible=7.0, mistaken_for="deg"),
    ChannelKind("motor_current", "A", "mechanism", "mechanism motor current", behaves="steps"),
    ChannelKind("motor_temperature", "K", "mechanism", "mechanism motor temperature", behaves="steps"),
    ChannelKind("tank_pressure", "Pa", "none", "propellant tank pressure", behaves="steps"),
    ChannelKind("catbed_temperature", "K", "thruster", "catalyst bed temperature", behaves="steps"),
    ChannelKind("accelerometer_count", "", "none", "cumulative accelerometer counts", behaves="cumulative"),
    ChannelKind("control_torque", "N m", "axis", "commanded torque on the body"),
    ChannelKind("wheel_momentum", "N m s", "axis", "stored momentum relative to the body"),
    ChannelKind("wheel_momentum_magnitude", "N m s", "none", "size of the stored momentum"),
    ChannelKind("orbit_position", "m", "axis", "position, inertial axes"),
    ChannelKind("orbit_velocity", "m/s", "axis", "velocity, inertial axes"),
    ChannelKind("control_mode", "", "none", "control mode", behaves="state"),
    ChannelKind("motor_on", "", "mechanism", "mechanism motor on", behaves="state"),
    ChannelKind("microswitch", "", "mechanism", "mechanism microswitch", behaves="state"),
    ChannelKind("thruster_branch", "", "none", "thruster branch in use", behaves="state"),
)  # fmt: skip

AXES = ("x", "y", "z")
_MEMBERS = {"axis": AXES, "component": ("w", "x", "y", "z"), "none": ()}
_BY_STEM = sorted(KINDS, key=lambda k: -len(k.stem))


def kind_of(name: str) -> ChannelKind:
    """The family of a house name.  Raises BadInput, with the nearest names, for any other."""
    for kind in _BY_STEM:
        if name == kind.stem and kind.member in ("none", "mechanism"):
            return kind
        if name.startswith(kind.stem + "_"):
            member = name[len(kind.stem) + 1 :]
            if kind.member in ("wheel", "thruster", "mechanism") and re.fullmatch(r"[A-Za-z0-9_.-]+", member):
                return kind
            if member in _MEMBERS.get(kind.member, ()):
                return kind
    near = difflib.get_close_matches(name, example_names(), 3, 0.5)
    raise BadInput(
        f"{name!r} is not a channel asflown knows",
        channel=name,
        remedy=(f"Did you mean {some_of(near)}? " if near else "")
        + "Rename the column, or map it in a channel dictionary (--channels); `asflown telemetry names` lists all names.",
    )


def member_of(name: str) -> str:
    """'wheel_rate_RWA1' -> 'RWA1'."""
    return name.removeprefix(kind_of(name).stem).removeprefix("_")


def member_names(stem: str, count: int) -> tuple[str, ...]:
    """Members of a family given as one array of ``count`` columns: its axes or components, else numbers from 1."""
    kind = next((k for k in KINDS if k.stem == stem), None)
    known = _MEMBERS.get(kind.member, ()) if kind else ()
    return known if len(known) == count else tuple(str(k) for k in range(1, count + 1))


def example_names() -> list[str]:
    """Every name, with <NAME> where a wheel, thruster or mechanism stands."""
    names = []
    for k in KINDS:
        if k.member in ("axis", "component"):
            names += [f"{k.stem}_{m}" for m in _MEMBERS[k.member]]
        elif k.member in ("wheel", "thruster"):
            names.append(f"{k.stem}_<{k.member.upper()}>")
        else:
            names.append(k.stem)
    return names


def split_header(cell: str) -> tuple[str, str] | None:
    """'wheel_rate_RWA1 [rad/s]' or 'rate (deg/s)' -> (name, unit); None where there is no [unit]."""
    cell = cell.strip()
    for first, last in ("[]", "()"):
        if cell.endswith(last) and first in cell:
            name, _, unit = cell[:-1].rpartition(first)
            name, unit = name.strip(), unit.strip()
            if (
                name
                and not any(mark in name + unit for mark in "[]\n")
                and (first == "[" or is_unit(unit) or unit.lower() == "utc")
            ):
                return name, unit
    return None


def to_si(name: str, unit: str) -> tuple[float, float]:
    """Factor and offset that bring a channel given in ``unit`` to its SI unit."""
    kind = kind_of(name)
    if kind.behaves == "state":
        return 1.0, 0.0
    if kind.unit == "K" and unit in ("deg_C", "degC", "°C", "C", "celsius", "Celsius"):
        return 1.0, 273.15
    if kind.unit == "K" and unit in ("deg_F", "degF", "°F", "F", "fahrenheit", "Fahrenheit"):
        return 5 / 9, 273.15 - 32 * 5 / 9
    try:
        return si_factor(unit, kind.unit), 0.0
    except BadInput as why:
        raise BadInput(why.what, channel=name, remedy=why.remedy) from why
