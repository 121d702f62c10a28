"""A flight on disk: the telemetry a spacecraft would send, and the truth beside it."""

from __future__ import annotations

import json
import os
import platform
from importlib.metadata import version
from pathlib import Path

import numpy as np

from ...kit.files import check_folder, check_output, mark, sha256_of, sha256_of_file, together, write_text
from ...kit.timeline import utc_label
from ...telemetry.channels import AXES
from ...telemetry.write import table_text
from .faults import true_drag
from .world import acting_dipole, acting_drag, acting_sunlight, reference_density

#: What a flight's truth.json calls itself (see ``kit.files.is_ours``).
FLIGHT = "flight"


def write_flight(flight, directory: str | Path, *, force: bool = False) -> dict[str, Path]:
    """telemetry.csv, truth.csv and truth.json in ``directory``; returns their paths by name.

    All appear, or none.  ``force``: files there that are no flight of ours are replaced.  Raises BadInput where they are not, and
    where the directory cannot be written."""
    folder = Path(directory)
    check_flight(folder, force=force)
    files = {"telemetry": folder / "telemetry.csv", "truth": folder / "truth.csv", "truth_json": folder / "truth.json"}
    telemetry, truth = table_text(flight.telemetry), truth_table(flight)
    record = (
        {"file": mark(FLIGHT)}
        | truth_record(flight)
        | {"files": digests({"telemetry.csv": telemetry, "truth.csv": truth})}
    )
    with together():
        write_text(files["truth"], truth)
        write_text(files["telemetry"], telemetry)
        write_text(files["truth_json"], json.dumps(record, indent=1, allow_nan=False) + "\n")
    return files


def check_flight(folder: Path, *, force: bool = False, inputs=()) -> None:
    """Raise BadInput where a flight written into ``folder`` would replace files that are no flight of ours, or not as it was written."""
    check_folder(folder)
    check_record(folder / "truth.json", FLIGHT, ("telemetry.csv", "truth.csv"), force=force, inputs=inputs)


def check_record(record: Path, kind: str, names, *, force: bool, inputs) -> None:
    """The same for any ``record`` that keeps the digests of the files beside it, by ``names`` within its folder."""
    check_output(record, kind, force=force, inputs=inputs)
    written = {} if force else _digests_in(record)
    for name in names:
        place = record.parent / name
        known = not force and os.path.isfile(place) and written.get(name) == sha256_of_file(place)
        check_output(place, kind, force=force, inputs=inputs, ours=known)


def _digests_in(record: Path) -> dict:
    try:
        found = json.loads(record.read_bytes()).get("files")
        return found if isinstance(found, dict) else {}
    except (OSError, ValueError, AttributeError, RecursionError):
        return {}


def digests(texts: dict[str, str]) -> dict[str, str]:
    """SHA-256 of every text as it stands in its file."""
    return {name: sha256_of(text.encode()) for name, text in texts.items()}


def truth_table(flight) -> str:
    """What really happened at every control instant, as CSV; torques on the body, in body axes."""
    truth = flight.truth
    columns = {"time [s]": truth.time_s}

    def add(stem: str, unit: str, values, members) -> None:
        columns.update({f"{stem}_{m} [{unit}]": values[:, i] for i, m in enumerate(members)})

    add("disturbance_torque", "N m", truth.torque_Nm, AXES)
    add("body_rate", "rad/s", truth.body_rate_rad_s, AXES)
    add("wheel_rate", "rad/s", truth.wheel_rate_rad_s, flight.wheels)
    add("quaternion", "", truth.attitude, ("w", *AXES))
    add("wheel_momentum", "N m s", truth.wheel_momentum_Nms, AXES)
    add("momentum_inertial", "N m s", truth.momentum_inertial_Nms, AXES)
    add("control_torque", "N m", truth.control_torque_Nm, AXES)
    add("estimation_error", "rad", truth.estimation_error_rad, AXES)
    if flight.scenario.coasts:
        add("holding_torque", "N m", truth.holding_torque_Nm, AXES)
    if truth.thrusters is not None:
        add("thrust", "N", truth.thrusters.thrust_N, truth.thrusters.names)
        add("impulse", "N s", truth.thrusters.impulse_Ns, truth.thrusters.names)
        add("linear_impulse_inertial", "N s", truth.thrusters.linear_impulse_Ns(truth.attitude), AXES)
    if truth.density_kgm3 is not None:
        columns |= {"density [kg/m3]": truth.density_kgm3, "altitude [m]": truth.altitude_m}
    for name, torque in truth.torque_by_source_Nm.items():
        add(f"{name}_torque", "N m", torque, AXES)
    if truth.along is not None:
        columns |= {"sunlit []": truth.along.lit, "air_density [kg/m3]": truth.along.density_kgm3}
        add("orbit_position", "m", truth.along.position_N, AXES)
    if "rods" in truth.torque_by_source_Nm:
        add("torque_rod_dipole", "A m2", truth.rod_dipole_Am2, AXES)
    if truth.cover_angle_rad is not None:
        columns["cover_angle [rad]"] = truth.cover_angle_rad
    head = [
        f"# truth of scenario {flight.scenario.name}, seed {flight.seed}; {flight.ended}",
        f"# epoch: {flight.telemetry.epoch_label}",
        "# torques act on the body, body axes; quaternion scalar first, body to inertial; momentum_inertial is of everything",
        ",".join(columns),
    ]
    rows = np.column_stack(list(columns.values())).tolist()
    return "\n".join(head + [",".join(map(repr, row)) for row in rows]) + "\n"


def truth_record(flight) -> dict:
    """What was flown: enough to fly it again, and to judge an estimate."""
    scenario, truth = flight.scenario, flight.truth
    return {
        "scenario": scenario.name,
        "description": scenario.description,
        "craft": flight.craft.name,
        "epoch": f"{utc_label(scenario.epoch_ns)} UTC",
        "seed": flight.seed,
        "noise": scenario.noise,
        "ended": flight.ended,
        "inertia_kg_m2": np.asarray(flight.inertia_kgm2).tolist(),
        "environment": _environment_of(flight),
        "controller_inertia_kg_m2": None if scenario.controller.inertia is None else list(scenario.controller.inertia),
        "wheels": list(flight.wheels),
        "torque_profile": [source.model_dump() for source in scenario.torques],
        "coasts": [c.model_dump() for c in scenario.coasts],
        "drag_spikes": [d.model_dump() for d in scenario.drag_spikes],
        "wheel_drag": _drag_of(flight),
        "thrusters": None if truth.thrusters is None else _thrusters_of(flight),
        "flyby": None if flight.met is None else flight.met.record(),
        "peaks": [{"time_s": t, "torque_Nm": T, "axis": a} for t, T, a in truth.peaks],
        "assumptions": list(scenario.assumptions),
        **flight.doubts.record(),
        "as_written": scenario.as_written,
        "versions": {"python": platform.python_version()}
        | {p: version(p) for p in ("asflown", "numpy", "scipy", "numba")},
    }


def _thrusters_of(flight) -> dict:
    """What each thruster is and did; pulses are start, on-time and the thrust they rise to."""
    truth, fired = flight.truth, flight.truth.thrusters
    return {
        name: {
            "arm_m": fired.arms_m[k].tolist(),
            "direction": fired.directions[k].tolist(),
            "delay_s": fired.delay_s[k],
            "rise_hot_cold_s": fired.rise_s[:, k].tolist(),
            "fall_hot_cold_s": fired.fall_s[:, k].tolist(),
            "on_time_s": fired.on_time_s[-1, k],
            "impulse_Ns": fired.impulse_Ns[-1, k],
            "leak_Ns": float(np.sum(fired.leak_N[:-1, k]) * fired.period_s),
            "pulses": fired.pulses_of(name, truth.time_s),
        }
        for k, name in enumerate(fired.names)
    }


def _drag_of(flight) -> dict:
    """Bearing drag of every wheel as flown; nothing where friction was off."""
    wheels = flight.craft.at(flight.scenario.epoch_ns).wheels if flight.scenario.friction else ()
    drags = {w.name: true_drag(flight.scenario, w) for w in wheels}
    return {
        name: {"viscous_Nms": drag.viscous, "coulomb_Nm": drag.coulomb, "stiction_Nm": drag.stiction}
        for name, drag in drags.items()
    }


def _environment_of(flight) -> dict | None:
    """What really acted along the orbit, for the truth beside the telemetry; None without an orbit, null for what did not act."""
    truth, e = flight.truth, flight.scenario.environment
    if truth.along is None:
        return None
    record: dict = {"sources": list(truth.torque_by_source_Nm), "shadows": list(truth.shadows)}
    if e is None:
        return record
    now = flight.craft.at(flight.scenario.epoch_ns)
    (sun, lit), (air, flown_through) = acting_sunlight(e, now), acting_drag(e, now)
    reference, mean = reference_density(e, now), truth.along.mean_density_kgm3
    vectors = {
        "dipole_Am2": acting_dipole(e, now), "sunlight_lever_Nm": sun, "drag_lever_Nm": air,
        "drag_lever_at_mean_density_Nm": None if air is None else air * mean / reference,
    }  # fmt: skip
    return record | {name: None if v is None else v.tolist() for name, v in vectors.items()} | {
        "sunlit_facets": len(lit), "air_facets": len(flown_through),
        "reference_density_kgm3": reference, "mean_density_kgm3": mean, "density_factor": e.density_factor,
        "density_swing": e.density_swing, "density_phase_rad": e.density_phase,
        "meaning": "torque = gravity gradient + lit (sunlight_lever x s) + dipole x B + density / reference_density (drag_lever x -v/|v|)"
        " + rods x B, body axes, s and v/|v| of length one; the mean density is the flight's without its swing; sunlit, air_density and each source's torque stand in truth.csv",
    }  # fmt: skip
