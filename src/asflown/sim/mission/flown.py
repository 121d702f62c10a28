"""Fly a mission: plan every actuation, fly it, and write the event list beside what is true of it."""

from __future__ import annotations

import json
import platform
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...craft.load import load_craft
from ...craft.model import Craft
from ...kit.doubts import Doubt, Doubts, grouped
from ...kit.errors import BadInput
from ...kit.files import check_folder, mark, together, write_text
from ...kit.schema import Annotated, Doc, DoubtRecord, TypedDict
from ...kit.timeline import utc_to_tai_ns
from ...telemetry.write import table_text
from ..flight import check_record, digests, fly, stream
from ..scenario import CoverMotion, Scenario, load_scenario
from .ageing import Figures, aged, figures_of
from .mission import Actuation, Cold, Fault, Mission, load_mission

if TYPE_CHECKING:
    from collections.abc import Callable

#: What a mission's mission.json calls itself (see ``kit.files.is_ours``).
MISSION = "mission"
#: truth.csv of an event has a row this often, not one a control cycle as a flight's own. [s]
TRUTH_EVERY_S = 0.5


@dataclass(frozen=True)
class Planned:
    """An actuation made ready to be flown, with what was drawn for it."""

    event: Actuation
    scenario: Scenario
    cover: CoverMotion  # the scenario's
    line: Figures  # where the ageing law alone puts the figures
    factors: dict[str, float]  # what faults and a cold start do to them
    wanted: Figures  # with factors and scatter
    rest_days: int | None
    cold: bool


class MissionRecord(TypedDict):
    """What ``fly_mission`` returns and mission.json holds: what was flown, and what is true of it."""

    mission: str
    description: str
    craft: str
    seed: int
    noise: str
    law: Annotated[dict, Doc("figures of merit when ageing starts, and their change until it stops")]
    fit: Annotated[dict, Doc("straight line through the true figures, by kind of actuation")]
    scatter: dict[str, float]
    cold: dict[str, float]
    faults: list[dict]
    flown: Annotated[int, Doc("actuations flown")]
    listed: Annotated[int, Doc("actuations listed, flown or not")]
    events: Annotated[list[dict], Doc("each actuation flown: true figures, the law's alone, draws, scenario, doubts")]
    assumptions: list[str]
    doubts: list[str]
    doubts_detail: list[DoubtRecord]
    as_written: dict
    versions: dict[str, str]
    file: Annotated[str, Doc("what the file calls itself")]
    files: Annotated[dict[str, str], Doc("SHA-256 of the other files, by their names within the folder")]


def fly_mission(
    mission: str | Path | Mission,
    out: str | Path,
    *,
    craft: str | Path | Craft | None = None,
    seed: int | None = None,
    noise: str | None = None,
    progress: Callable[[str], None] | None = None,
    changes: dict | None = None,
    force: bool = False,
) -> MissionRecord:
    """Fly every actuation of a mission and write telemetry and truth into a folder.

    Writes <event>/telemetry.csv and <event>/truth.csv (every half second) for each event flown, events.toml, and mission.json with
    the truth: all of them at the end, or none.  The same mission and seed give the same files on one
    machine with the same package versions.

    Parameters
    ----------
    mission : str, Path or Mission
        A shipped mission by name (``cassini-mission``), or a TOML file.
    out : str or Path
        The folder; it is made where it is missing.
    craft : str, Path or Craft, optional
        The craft to fly in place of the mission's own.
    seed : int, optional
        Another draw of scatter and noise; the mission's own unless given.
    noise : str, optional
        'none', 'half', 'nominal' or 'double', in place of the mission's own.
    progress : callable, optional
        Called with a line of text now and then.
    changes : dict, optional
        Values of the mission to replace, written as in its TOML: ``{"scatter": {"impulse_percent": 0.0}}``.
    force : bool
        Files in the folder that are no mission of ours are replaced too.

    Returns
    -------
    MissionRecord
        The content of mission.json, a dict.  Torques and momenta are those on the body, with their sign.

    Raises
    ------
    BadInput
        If the mission cannot be flown: before anything is written, unless a wheel reaches its rate limit on the way.
    """
    mission = mission if isinstance(mission, Mission) else load_mission(mission)
    own = {"seed": seed, "noise": noise}
    changes = (changes or {}) | {name: value for name, value in own.items() if value is not None}
    mission = mission.changed(**changes) if changes else mission
    craft = craft if isinstance(craft, Craft) else load_craft(craft or mission.craft)
    folder = Path(out)
    check_mission(folder, mission, force=force)
    planned = plan_mission(mission, craft)
    if progress is not None:
        progress(f"{mission.name}: {len(planned)} flights, {len(mission.events)} actuations in all")
    return _flown(mission, craft, planned, folder, progress or (lambda _: None))


def check_mission(folder: Path, mission: Mission, *, force: bool = False, inputs=()) -> None:
    """Raise BadInput where a mission flown into ``folder`` would replace files that are no mission of ours, or not as it was written."""
    check_folder(folder)
    tables = [f"{e.name}/{name}" for e in mission.flown for name in ("truth.csv", "telemetry.csv")]
    check_record(folder / "mission.json", MISSION, ["events.toml", *tables], force=force, inputs=inputs)


def _flown(mission: Mission, craft: Craft, planned, folder: Path, progress: Callable[[str], None]) -> MissionRecord:
    """Fly every event and write its files, then those of the mission."""
    records: list[dict] = []
    texts: dict[str, str] = {}
    doubts: list[Doubt] = []
    for number, p in enumerate(planned, start=1):
        flight = fly(p.scenario, craft=craft)
        if flight.truth.time_s[-1] < p.cover.motor_off:
            raise BadInput(f"event {p.event.name!r}: {flight.ended}", remedy="Lower most_wheel_rate.")
        true = figures_of(flight.truth.time_s, flight.truth.torque_Nm[:, 1], p.cover.motor_on)
        texts |= {f"{p.event.name}/truth.csv": _thinned_truth(flight), f"{p.event.name}/telemetry.csv": table_text(flight.telemetry)}  # fmt: skip
        records.append(_event_record(p, flight, true))
        doubts += flight.doubts
        progress(f"{number:3d} of {len(planned)}  {p.event.name}: impulse {true.impulse_Nms:+.3f} N m s, "
                 f"excursions {1e3 * true.peak_positive_Nm:+.1f} and {1e3 * true.peak_negative_Nm:+.1f} mN m")  # fmt: skip
    texts["events.toml"] = _event_list(mission, planned)
    record = _mission_record(mission, craft, records, doubts, texts)
    with together():
        for name, text in texts.items():
            write_text(folder / name, text)
        write_text(folder / "mission.json", json.dumps(record, indent=1, allow_nan=False) + "\n")
    return record


def plan_mission(mission: Mission, craft: Craft) -> list[Planned]:
    """Every event to be flown, its motion found: nearly all that can be wrong with a mission shows here.

    Raises BadInput for a motion that cannot be, naming the event."""
    rests, patterns = mission.rest_days(), {kind: _pattern(mission, kind) for kind in mission.motions}
    planned = []
    for event in mission.flown:
        rest, now = rests[event.name], craft.at(event.tai_ns)
        cold = rest is not None and rest >= mission.cold.after / 86_400
        line, factors = line_at(mission, event), _factors(mission, event, cold=cold)
        # all are drawn always, in this order, by the event's name: no setting and no other event changes a draw
        random = stream(mission.seed, f"event {event.name}")
        seed = int(random.integers(2**31))
        normal = np.clip(random.standard_normal(3), -3, 3)
        late = mission.scatter.timing * np.clip(random.standard_normal(32), -3, 3)
        rates = random.uniform(mission.least_wheel_rate, mission.most_wheel_rate, len(now.wheels))
        rates *= random.choice([-1.0, 1.0], len(now.wheels))
        sigma = np.array([mission.scatter.impulse_percent, *[mission.scatter.excursion_percent] * 2]) / 100
        by = (1 + sigma * normal) * [factors["impulse"], factors["excursion"], factors["excursion"]]
        wanted = Figures(*(by * [line.impulse_Nms, line.peak_positive_Nm, line.peak_negative_Nm]).tolist())
        pattern, cover = patterns[event.kind]
        try:
            cover = cover.model_copy(update={"craft_mass": mission.mass_kg(event.tai_ns)})
            motion, _ = aged(cover, now, wanted, late)
            scenario = pattern.changed(
                name=event.name, epoch=event.date, seed=seed, noise=mission.noise, cover=_as_written(motion),
                wheel_rates={w.name: f"{_rpm(r):.3f} rpm" for w, r in zip(now.wheels, rates, strict=True)},
            )  # fmt: skip
        except BadInput as why:
            raise BadInput(f"event {event.name!r}: {why.what}", remedy=why.remedy) from None
        planned.append(Planned(event, scenario, motion, line, factors, wanted, rest, cold))
    return planned


def line_at(mission: Mission, event: Actuation) -> Figures:
    """The figures of merit that the ageing law gives for an event's date and kind."""
    start, stop = (int(utc_to_tai_ns(d)) for d in (mission.ageing.start, mission.ageing.stop))
    x, first = (event.tai_ns - start) / (stop - start), mission.motions[event.kind]
    impulse = 1 + x * mission.ageing.impulse_change_percent / 100
    excursion = 1 + x * mission.ageing.excursion_change_percent / 100
    if min(impulse, excursion) <= 0:
        raise BadInput(f"event {event.name!r}: the ageing law leaves nothing of it", remedy="Take smaller changes.")
    return Figures(first.impulse * impulse, first.peak_positive * excursion, first.peak_negative * excursion)


def trend_of(records) -> dict:
    """Straight line through the true figures of some events, scatter, faults and cold included: value at the first
    date and change in percent to the last; empty for fewer than two dates."""
    days = np.array([utc_to_tai_ns(r["date"]) / 86_400e9 for r in records])
    if len(days) < 2 or np.ptp(days) < 1:
        return {}
    found: dict = {"from": records[0]["date"], "to": records[-1]["date"]}
    for name in ("angular_impulse_Nms", "peak_positive_Nm", "peak_negative_Nm"):
        slope, at_first = np.polyfit(days - days[0], [r["true"][name] for r in records], 1)
        found[name] = {"at_first": float(at_first), "change_percent": float(100 * slope * np.ptp(days) / at_first)}
    return found


def _factors(mission: Mission, event: Actuation, *, cold: bool) -> dict[str, float]:
    until_now = [e.name for e in mission.events if e.tai_ns <= event.tai_ns]
    struck = [f for f in mission.faults if f.kind in (None, event.kind) and f.since in until_now]
    active: list[Fault | Cold] = [*struck, *([mission.cold] if cold else [])]
    return {
        "impulse": float(np.prod([f.impulse_factor for f in active])),
        "excursion": float(np.prod([f.excursion_factor for f in active])),
    }


def _pattern(mission: Mission, kind) -> tuple[Scenario, CoverMotion]:
    motion = mission.motions[kind]
    scenario = load_scenario(mission.folder / motion.scenario if motion.scenario.endswith(".toml") else motion.scenario)
    if scenario.cover is None or scenario.cover.direction != kind or scenario.torques or scenario.slews:
        raise BadInput(
            f"motions.{kind}: the scenario {motion.scenario!r} is no {kind} with nothing else going on",
            remedy="Take cover-deploy or cover-stow, or a scenario of your own like them.",
        )
    if motion.impulse * (-1 if kind == "deploy" else 1) <= 0:
        raise BadInput(
            f"motions.{kind}: the impulse has the wrong sign",
            remedy="That of a deployment is negative, of a stow positive: the body is pushed against the part's turn.",
        )
    return scenario, scenario.cover


def _as_written(cover) -> dict:
    return {
        "times": " ".join(f"{t:.3f}" for t in cover.times) + " s",
        "rates": " ".join(f"{r:.9f}" for r in cover.rates) + " rad/s",
        "stall": f"{cover.stall:.3f} s",
        "craft_mass": f"{cover.craft_mass:.3f} kg",
    }


def _rpm(rate_rad_s: float) -> float:
    return rate_rad_s * 30 / np.pi


def _thinned_truth(flight) -> str:
    t = flight.truth
    every = max(1, round(TRUTH_EVERY_S / float(t.time_s[1] - t.time_s[0])))
    rows = np.column_stack([t.time_s, t.torque_Nm, t.body_rate_rad_s, t.wheel_momentum_Nms])[::every].tolist()
    stems = {"disturbance_torque": "N m", "body_rate": "rad/s", "wheel_momentum": "N m s"}
    head = [
        f"# truth of event {flight.scenario.name}, thinned to every {TRUTH_EVERY_S:g} s; body axes, torques on the body",
        f"# epoch: {flight.telemetry.epoch_label}",
        ",".join(["time [s]", *(f"{stem}_{axis} [{unit}]" for stem, unit in stems.items() for axis in "xyz")]),
    ]
    return "\n".join(head + [",".join(f"{v:.9g}" for v in row) for row in rows]) + "\n"


def _three(f: Figures) -> dict[str, float]:
    return {
        "angular_impulse_Nms": f.impulse_Nms,
        "peak_positive_Nm": f.peak_positive_Nm,
        "peak_negative_Nm": f.peak_negative_Nm,
    }


def _event_record(p: Planned, flight, true: Figures) -> dict:
    cover = p.cover
    others = {
        "peak_momentum_Nms": true.peak_momentum_Nms,
        "net_impulse_Nms": true.net_impulse_Nms,
        "time_to_stall_s": cover.stall - cover.motor_on,
    }
    return {
        "id": p.event.name,
        "kind": p.event.kind,
        "date": p.event.date,
        "rest_days": p.rest_days,
        "cold": p.cold,
        "true": _three(true) | others,
        "law": _three(p.line),
        "factors": p.factors,
        "wanted": _three(p.wanted),
        "inertia_kg_m2": np.asarray(flight.inertia_kgm2).tolist(),
        "craft_mass_kg": cover.craft_mass,
        "wheels": list(flight.wheels),
        "wheel_rates_rpm": {name: round(_rpm(rate), 3) for name, rate in p.scenario.wheel_rates.items()},
        "seed": flight.seed,
        "ended": flight.ended,
        "as_written": p.scenario.as_written,
        **flight.doubts.record(),
    }


def _mission_record(mission: Mission, craft: Craft, records, doubts, texts: dict[str, str]) -> MissionRecord:
    law = mission.ageing
    said = Doubts(d for d, _ in grouped(doubts))  # the same of many events once
    start = {
        kind: {
            "angular_impulse_Nms": m.impulse,
            "peak_positive_Nm": m.peak_positive,
            "peak_negative_Nm": m.peak_negative,
        }
        for kind, m in mission.motions.items()
    }
    return {
        "mission": mission.name,
        "description": mission.description,
        "craft": craft.name,
        "seed": mission.seed,
        "noise": mission.noise,
        "law": {
            "from": law.start,
            "to": law.stop,
            "at_start": start,
            "change_percent": {
                "angular_impulse_Nms": law.impulse_change_percent,
                "peak_positive_Nm": law.excursion_change_percent,
                "peak_negative_Nm": law.excursion_change_percent,
            },
        },
        "fit": {kind: trend_of([r for r in records if r["kind"] == kind]) for kind in mission.motions},
        "scatter": mission.scatter.model_dump(),
        "cold": mission.cold.model_dump(),
        "faults": [f.model_dump() for f in mission.faults],
        "flown": len(records),
        "listed": len(mission.events),
        "events": records,
        "assumptions": list(mission.assumptions),
        "doubts": said.sentences(),
        "doubts_detail": [d.record() for d in said],
        "as_written": mission.as_written,
        "versions": {"python": platform.python_version()}
        | {p: version(p) for p in ("asflown", "numpy", "scipy", "numba")},
        "file": mark(MISSION),
        "files": digests(texts),
    }


def _event_list(mission: Mission, planned) -> str:
    covers = {p.event.name: p.cover for p in planned}
    lines = [
        f"# Simulated: {mission.name}, seed {mission.seed}. {len(covers)} of {len(mission.events)} actuations are flown;",
        "# those without a file count for dormancy and cycles only.",
    ]
    for e in mission.events:
        entries = {"id": e.name, "kind": e.kind, "date": e.date, "motor": "motor-A"}
        if e.name in covers:
            cover = covers[e.name]
            entries |= {"file": f"{e.name}/telemetry.csv", "motor_on_s": cover.motor_on, "motor_off_s": cover.motor_off}
        if e.note:
            entries["note"] = e.note
        lines += ["", "[[event]]", *(f"{key} = {json.dumps(value)}" for key, value in entries.items())]
    return "\n".join(lines) + "\n"
