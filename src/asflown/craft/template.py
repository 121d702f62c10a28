"""A commented craft file to start from, and what is read from a JSON description."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..kit.config import validated
from ..kit.errors import BadInput
from ..kit.reading import read_bytes

if TYPE_CHECKING:
    from pathlib import Path

#: Elevation of a pyramid's axes at which four wheels store the same momentum along x, y and z. [deg]
CANT_DEG = 35.2644

_Number = Annotated[float, Field(gt=-1e9, lt=1e9, allow_inf_nan=False)]
_Row = Annotated[list[_Number], Field(min_length=3, max_length=3)]
_JSON = "Its keys: craft, inertia_kg_m2 (3 x 3) and wheels [{name, axis, spin_inertia_kg_m2}], as `asflown craft show --json` prints them."
_PLACEHOLDER = "the craft file still has the template's placeholders: inertia and spin inertia are no one's"


_SURROUNDINGS = (
    "# For the torques of an Earth orbit (sources, --with), whatever is known before flight:",
    "# [orbit]                           # where the telemetry has no orbit_position_x, _y, _z",
    '# body = "Earth"',
    '# epoch = "2026-06-01T00:00:00Z"',
    '# semi_major_axis = "6878 km"       # from the centre of the Earth',
    "# eccentricity = 0.001",
    '# inclination = "97.4 deg"',
    '# ascending_node = "47 deg"',
    '# argument_of_perigee = "90 deg"',
    '# mean_anomaly = "0 deg"',
    "",
    "# [magnetics]",
    '# residual_dipole = "0.1 0 0 A m2"',
    '# sigma = "0.1 A m2"                # of each component',
    "",
    "# [[torque_rods]]",
    '# name = "MTX"',
    '# axis = "1 0 0"',
    '# max_dipole = "15 A m2"',
    "",
    "# [sunlight]                        # torque = lit * (lever x s), s to the Sun; or facets: docs/craft.md",
    '# lever = "0 0 1e-5 N m"',
    '# sigma = "3e-6 N m"',
    "",
    "# [aerodynamics]                    # torque = lever x (-v/|v|) * density / reference_density; or facets",
    '# lever = "0 0 1e-5 N m"',
    '# sigma = "3e-6 N m"',
    '# reference_density = "5e-13 kg/m3"',
    "",
)


class _ToldWheel(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore")

    name: str = Field(min_length=1, max_length=60)
    axis: list[_Number] = Field(min_length=3, max_length=3)
    spin_inertia_kg_m2: Annotated[float, Field(gt=0, lt=1e6, allow_inf_nan=False)] | None = None


class _Told(BaseModel):
    """What is read of a JSON description: numbers are numbers, not text."""

    model_config = ConfigDict(strict=True, extra="ignore")

    wheels: list[_ToldWheel] = Field(min_length=1, max_length=24)
    inertia_kg_m2: Annotated[list[_Row], Field(min_length=3, max_length=3)] | None = None


@dataclass(frozen=True)
class Outline:
    """What a template is filled with; None: a placeholder stands there."""

    axes: tuple[tuple[float, float, float], ...]
    names: tuple[str, ...]
    spin_inertia_kgm2: tuple[float | None, ...]
    inertia_kgm2: tuple[float, ...] | None = None  # Ixx Iyy Izz Ixy Ixz Iyz


def outline(wheels: int, cant_rad: float | None) -> Outline:
    """Wheels evenly around body z, ``cant_rad`` above the x-y plane; three without a cant lie along x, y, z."""
    if not 1 <= wheels <= 24:
        raise BadInput(f"{wheels} wheels are not possible", remedy="Give 1 to 24 as --wheels.")
    if wheels <= 3 and cant_rad is None:
        axes = np.eye(3)[:wheels]
    else:
        up = np.radians(CANT_DEG) if cant_rad is None else cant_rad
        if not -np.pi / 2 <= up <= np.pi / 2:
            raise BadInput(
                f"a cant of {np.degrees(up):g} deg is beyond 90 deg", remedy="Give the angle above the x-y plane."
            )
        around = 2 * np.pi * (np.arange(wheels) + 0.5) / wheels
        axes = np.column_stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.full(wheels, np.sin(up))])
    names = tuple(f"RW{k + 1}" for k in range(wheels))
    return Outline(tuple(map(tuple, (axes + 0.0).tolist())), names, (None,) * wheels)


def outline_of(file: str | Path) -> Outline:
    """What a JSON file says of a craft.  Raises BadInput where it says no wheels, or what cannot be."""
    source = read_bytes(file, "JSON file", _JSON)
    try:
        told = json.loads(source)
    except (ValueError, RecursionError) as why:
        raise BadInput(f"this JSON does not describe a craft ({str(why)[:100]})", file=file, remedy=_JSON) from None
    if not isinstance(told, dict):
        raise BadInput("this JSON does not describe a craft", file=file, remedy=_JSON)
    craft = validated(_Told, told, file, _JSON)
    wheels = [(w.name, np.array(w.axis, float), w.spin_inertia_kg_m2) for w in craft.wheels]
    lengths = [float(np.linalg.norm(a)) for _, a, _ in wheels]
    spins = tuple(s for _, _, s in wheels)
    I_B = None if craft.inertia_kg_m2 is None else np.array(craft.inertia_kg_m2, float)
    if not wheels or any(len(a) != 3 or not abs(n - 1) < 1e-3 for (_, a, _), n in zip(wheels, lengths, strict=True)):
        raise BadInput("an axis is not a unit vector, or there are no wheels", file=file, remedy=_JSON)
    if I_B is not None and not np.allclose(I_B, I_B.T, rtol=1e-9, atol=1e-9 * float(np.abs(I_B).max())):
        raise BadInput("the inertia is not symmetric", file=file, remedy=_JSON)
    elements = (
        None if I_B is None else tuple(float(I_B[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    )
    axes = tuple(tuple((a / n).tolist()) for (_, a, _), n in zip(wheels, lengths, strict=True))
    return Outline(axes, tuple(n for n, _, _ in wheels), spins, elements)


def craft_template(name: str, what: Outline) -> str:
    """The text of a craft file: what is known filled in, the rest placeholders that say so in every result."""
    known = what.inertia_kgm2 is not None and None not in what.spin_inertia_kgm2
    inertia = "10 12 9 0 0 0" if what.inertia_kgm2 is None else " ".join(f"{v:.10g}" for v in what.inertia_kgm2)
    return "\n".join([
        "# A craft file for asflown; docs/craft.md lists all keys.  Every value carries its unit.  Vectors are in body axes.",
        f"name = {json.dumps(name)}",
        'description = ""',
        "",
        "[[mass_properties]]                 # repeat for other dates; entries of one piece are interpolated",
        'date = "2000-01-01"                 # UTC',
        'piece = "flight"',
        'basis = "predicted"                 # estimated, predicted, extrapolated, inferred or assumed',
        'sigma = "5 %"                       # one sigma, a share of the moments',
        f'inertia = "{inertia} kg m2"  # Ixx Iyy Izz Ixy Ixz Iyz: tensor elements, about the centre of mass',
        *([] if known else [f'doubt = "{_PLACEHOLDER}"  # take this line out once your own values stand here']),
        "",
        *(line for k in range(len(what.names)) for line in _wheel(what, k)),
        "# [wheel_controller]                # the loop that holds the attitude: for torque by the fused and transfer methods",
        '# bandwidth = "0.03 Hz"              # or in rad/s',
        "# damping = 0.8",
        '# rate_filter = { natural_frequency = "3 rad/s", damping = 0.7 }',
        '# period = "0.25 s"',
        "# gyroscopic = true                  # w x H is fed forward; found from the data where not said",
        "# acceleration = true                # inertia x commanded acceleration is fed forward",
        "# tracking = true                    # the rate's error is against the commanded rate",
        '# inertia = "10 12 9 0 0 0 kg m2"    # that the controller believes, where it is not the above',
        "",
        "# [[thrusters]]                     # for thrust and leak; direction is that of the force on the body",
        '# name = "T1"',
        '# position = "0.5 0 -0.4 m"',
        '# direction = "0 0 1"',
        '# nominal_thrust = "0.5 N"',
        "",
        *_SURROUNDINGS,
    ])  # fmt: skip


def _wheel(what: Outline, k: int) -> list[str]:
    spin = what.spin_inertia_kgm2[k]
    x, y, z = what.axes[k]
    return [
        "[[wheels]]",
        f"name = {json.dumps(what.names[k])}               # as in the channel wheel_rate_{what.names[k]}".replace(
            "\n", " "
        ),
        f'axis = "{x:.10f} {y:.10f} {z:.10f}"  # unit vector, along positive rate',
        f'spin_inertia = "{0.001 if spin is None else spin:.10g} kg m2"     # or "unknown", of all wheels',
        '# torque_constant = "0.05 N m / A"  # of the motor, for wheel_current_<WHEEL>',
        '# rate_limit = "6000 rpm"',
        "",
    ]
