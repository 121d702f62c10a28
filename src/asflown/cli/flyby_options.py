"""Options of the verbs that take a flyby, declared once."""

from __future__ import annotations

import typer

FLYBY = typer.Option(..., "--flyby", help="Of Enceladus: E3, E4, E5 or E9.")
CLOSEST = typer.Option(..., "--closest-approach", help="UTC, or seconds from the file's epoch.")
AXIS = typer.Option(
    None, "--axis", help="About which gas turns the craft: x, y or z; that of the craft's arm unless given."
)
METHOD = typer.Option(None, "--method", help="Of the torque: fused (default), momentum, transfer, polynomial.")
AREA = typer.Option(None, "--area", help='Projected area, as in "18.4 m2"; the craft\'s unless given.')
ARM = typer.Option(None, "--arm", help='Moment arm, as in "0.85 m"; the craft\'s unless given.')
VELOCITY = typer.Option(
    None, "--velocity", help='Direction of flight "x,y,z" in body axes; with --up takes the gravity gradient off.'
)
UP = typer.Option(None, "--up", help='From the moon to the craft at closest approach, "x,y,z" in body axes.')


def drag_from(axis, method, area, arm, velocity, up) -> dict:
    """What these options say, as ``estimate.density.density`` takes it."""
    from asflown.kit.quantities import plain_numbers, quantity

    return {
        "axis": axis,
        "method": method,
        "area_m2": None if area is None else quantity(area, "m2"),
        "arm_m": None if arm is None else quantity(arm, "m"),
        "velocity_B": None if velocity is None else plain_numbers(velocity, 3, "--velocity"),
        "up_B": None if up is None else plain_numbers(up, 3, "--up"),
    }
