"""Options of the verbs that take a flyby, declared once, and what they say."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from ..telemetry.telemetry import Telemetry
    from .job import Job

FLYBY = typer.Option(..., "--flyby", help="Of Enceladus: E3, E4, E5 or E9; or Titan.")
CLOSEST = typer.Option(..., "--closest-approach", help="UTC, or seconds from the file's epoch.")
AXIS = typer.Option(
    None, "--axis", help="About which gas turns the craft: x, y or z; that of the craft's arm unless given."
)
METHOD = typer.Option(
    None,
    "--method",
    help="Of the torque: fused, momentum, transfer, polynomial, or on-times. By default on-times where thrusters fire, transfer where there are attitude errors and no body rates, else fused.",
)
AREA = typer.Option(None, "--area", help='Projected area, as in "18.4 m2"; the craft\'s unless given.')
ARM = typer.Option(None, "--arm", help='Moment arm, as in "0.85 m"; the craft\'s unless given.')
DRAG_TABLE = typer.Option(
    None, "--drag-table", help="CSV of time, speed, area and arm vector along the flyby, in place of the craft's."
)
SOURCE = typer.Option(
    None, "--source", help='A jet\'s source, repeated for more, in place of the published: "NAME=SOUTH LATITUDE,WEST LONGITUDE" or "NAME=TILT,OFFSET" (deg, km).',
)  # fmt: skip
VELOCITY = typer.Option(
    None, "--velocity", help='Direction of flight "x,y,z" in body axes; with --up takes the gravity gradient off.'
)
UP = typer.Option(None, "--up", help='From the moon to the craft at closest approach, "x,y,z" in body axes.')
TRAJECTORY = typer.Option(
    None, "--trajectory", help="CSV of time, position and velocity from the body's centre, instead of a straight line."
)
KERNELS = typer.Option(
    None, "--kernels", help="SPICE kernels, or a metakernel, instead of a straight line (needs spiceypy)."
)


def flyby_from(job: Job, telemetry: Telemetry):
    """The flyby that --flyby names, along a trajectory where one is given; and the input that this is, if any."""
    from ..dynamics.flyby import flyby_called
    from ..dynamics.trajectory import Trajectory
    from ..kit.errors import BadInput
    from ..kit.result import Input
    from ..kit.timeline import NS

    flyby = flyby_called(job.given["flyby"])
    if job.given["trajectory"] is None and not job.given["kernels"]:
        return flyby, []
    closest_ns = telemetry.moment(job.given["closest_approach"])
    table, source = _trajectory(job, flyby.moon.name, closest_ns)
    if table.dated and not telemetry.dated:
        raise BadInput(
            "the trajectory has dates and the telemetry has none",
            file=source,
            remedy="Give the trajectory's time in seconds from closest approach, without an epoch.",
        )
    time_s = (table.tai_ns - (closest_ns if table.dated else 0)) / NS
    try:
        path = Trajectory.along(flyby, time_s, table.position_m, table.velocity_m_s)
    except BadInput as why:
        raise why.within(source) from None
    return path, [Input(source, table.sha256)]


def _trajectory(job: Job, body: str, closest_ns: int):
    """The table of --trajectory or --kernels, and what it is called."""
    from ..kit.errors import BadInput

    trajectory, kernels = job.given["trajectory"], job.given["kernels"]
    if trajectory is not None and kernels:
        raise BadInput("--trajectory and --kernels both give the path", remedy="Give one of them.")
    if trajectory is not None:
        from ..telemetry.trajectory import load_trajectory

        return load_trajectory(trajectory), str(trajectory)
    from ..telemetry.kernels import trajectory_from_kernels

    table = trajectory_from_kernels(kernels, job.craft.name.upper(), body, closest_ns)
    return table, ", ".join(map(str, kernels))


def drag_from(job: Job) -> dict:
    """What the options of drag and attitude say, as ``density`` and ``jets`` take it."""
    from ..kit.quantities import plain_numbers, quantity

    area, arm, velocity, up = (job.given[n] for n in ("area", "arm", "velocity", "up"))
    return {
        "axis": job.given["axis"],
        "method": job.given["method"],
        "area_m2": None if area is None else quantity(area, "m2"),
        "arm_m": None if arm is None else quantity(arm, "m"),
        "drag_table": job.given["drag_table"],
        "velocity_B": None if velocity is None else plain_numbers(velocity, 3, "--velocity"),
        "up_B": None if up is None else plain_numbers(up, 3, "--up"),
    }


def sources_from(texts: list[str] | None, flyby):
    """The jets that --source describes, as the flyby passes them; None where there are none.

    The second number's unit says which of the two forms it is.  Raises BadInput for one that cannot be read."""
    if not texts:
        return None
    import numpy as np

    from ..dynamics.plume import Jet, as_passed
    from ..dynamics.trajectory import Trajectory
    from ..kit.errors import BadInput
    from ..kit.quantities import quantity

    found = []
    for text in texts:
        name, _, place = text.partition("=")
        parts = [p.strip() for p in place.split(",")]
        if not name.strip() or len(parts) != 2:
            raise BadInput(
                f"--source {text!r} is not understood",
                remedy='Write it as in "Baghdad=81 deg,229 deg" or "X=5 deg,3 km".',
            )
        first, angle = quantity(parts[0], "rad"), parts[1].endswith(("deg", "rad"))
        second = quantity(parts[1], "rad" if angle else "m")
        if angle and abs(first) > np.pi / 2:
            raise BadInput(
                f"--source {text!r} has a latitude beyond 90 degrees",
                remedy="South latitude comes first, then west longitude.",
            )
        if not angle and isinstance(flyby, Trajectory):
            raise BadInput(
                f"--source {text!r} has tilt and offset from the plane of a straight flyby, and this one follows a trajectory",
                remedy='Give its place: "NAME=SOUTH LATITUDE,WEST LONGITUDE".',
            )
        if angle:
            found.append(as_passed(Jet(name.strip(), 1.0, 0.3, 0.0, 0.0, first, second), flyby))
        else:
            found.append(Jet(name.strip(), 1.0, 0.3, first, second, float("nan"), float("nan")))
    return tuple(found)
