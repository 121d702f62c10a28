"""The verb `demo`."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import JSON
from .output import print_doubts, print_json, provenance, say, wrapped

SEED = 2016
PROFILES = {"profile-1": ("Table 3", "21"), "profile-2": ("Table 4", "22")}
WAYS = (
    ("momentum", "printed"),
    ("transfer", "printed"),
    ("momentum", "corrected"),
    ("transfer", "corrected"),
    ("fused", "corrected"),
)


def demo(
    out: Path = typer.Option(Path("demo-out"), "--out", help="Folder for flights and figures."),
    json: bool = JSON,
) -> None:
    """Fly the papers' test torques and a cover deployment, reconstruct them, and say how wrong each method is."""
    from ..kit.files import check_folder

    check_folder(out)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    # on standard error, so that --json keeps standard output to itself
    with Progress(
        TextColumn("{task.description:44s}"), BarColumn(), TimeElapsedColumn(), console=Console(stderr=True)
    ) as bar:
        task = bar.add_task("warming up", total=9)

        def step(words: str) -> None:
            bar.update(task, description=words, advance=1)

        tables = [_profile(name, out, step) for name in PROFILES]
        cover = _cover(out, step)
        bar.update(task, description="done", completed=9)
    mission = _mission(out / "mission")
    if json:
        print_json({
            "command": "demo", "tables": tables, "cover": cover, "mission": mission, "out": str(out), "doubts": cover["doubts"],
            "provenance": provenance({}, {"out": str(out)}, SEED),
        })  # fmt: skip
        return
    for table in tables:
        _print_table(table)
    _print_cover(cover)
    say(f"figures and telemetry: {out}/")
    _print_mission(mission)


def _fly(name: str, out: Path, noise: str):
    """Fly, write, and read back through the door that real telemetry comes through."""
    from ..sim.flight import fly, write_flight
    from ..telemetry.load import load_telemetry

    flight = fly(name, noise=noise, seed=SEED)
    folder = out / (name if noise == "nominal" else f"{name}-{noise}-noise")
    write_flight(flight, folder)
    return flight, load_telemetry(folder / "telemetry.csv")


def _profile(name: str, out: Path, step) -> dict:
    from ..campaigns.truth import PUBLISHED_PEAK_ERRORS, against_truth
    from ..craft.load import load_craft
    from ..estimate.torque import disturbance_torque
    from ..plots.actuation import torque_figure
    from ..plots.figure import save

    craft = load_craft("cassini")
    label, number = PROFILES[name]
    rows = []
    for noise in ("none", "nominal"):
        step(f"{name}: flying and reconstructing, noise {noise}")
        flight, telemetry = _fly(name, out, noise)
        truth = (flight.truth.time_s, flight.truth.torque_Nm[:, 1])
        peaks = [(t, v) for t, v, _ in flight.truth.peaks]
        results = [disturbance_torque(telemetry, craft, method=m, variant=v, axis="y") for m, v in WAYS]
        rows += [{"noise": noise} | against_truth(r, *truth, peaks, "y").record() for r in results]
    step(f"{name}: drawing")
    save(torque_figure(results[:2], "y", f"{name}: the printed methods against the torque flown (000 Fig {number})", truth=truth),
         out / f"fig{number}-{name}.svg")  # fmt: skip
    save(torque_figure(results[2:4], "y", f"{name}: the corrected methods, 95 % bands of noise", truth=truth),
         out / f"fig{number}-{name}-corrected.svg")  # fmt: skip
    save(
        torque_figure(results[4:], "y", f"{name}: all channels at once, 95 % band", truth=truth),
        out / f"{name}-fused.svg",
    )
    return {"profile": name, "table": label, "published_unsigned_percent": PUBLISHED_PEAK_ERRORS[name], "rows": rows}


def _cover(out: Path, step) -> dict:
    from ..campaigns.deployment import actuation_summary, stall_time
    from ..craft.load import load_craft
    from ..estimate.subject import subject_of
    from ..estimate.torque import compare_torques, disturbance_torque
    from ..plots import actuation
    from ..plots.figure import save

    craft = load_craft("cassini")
    step("cover-deploy: flying")
    flight, telemetry = _fly("cover-deploy", out, "nominal")
    step("cover-deploy: reconstructing")
    results = {way: disturbance_torque(telemetry, craft, method=way[0], variant=way[1], axis="y") for way in WAYS}
    t_hrwa, t_tf = results[WAYS[0]], results[WAYS[1]]
    stall = stall_time(flight.truth.time_s, flight.truth.cover_angle_rad)
    truth = (flight.truth.time_s, flight.truth.torque_Nm[:, 1])
    step("cover-deploy: drawing")
    figures = {
        "fig05-wheel-rates": actuation.wheel_rates_figure(telemetry),
        "fig06-body-rates": actuation.body_rates_figure(telemetry),
        "fig07-momentum": actuation.momentum_figure(subject_of(telemetry, craft), "Deploy: wheel momentum (000 Fig 7)"),
        "fig08-torque-momentum": actuation.torque_figure(
            [t_hrwa], "y", "Torque from wheel momentum (000 Fig 8)", stall_s=stall
        ),
        "fig10-attitude-error": actuation.attitude_error_figure(telemetry, "y"),
        "fig11-torque-transfer": actuation.torque_figure(
            [t_tf], "y", "Torque from attitude error (000 Fig 11)", stall_s=stall
        ),
        "fig12-both": actuation.torque_figure([t_hrwa, t_tf], "y", "Both printed methods (000 Fig 12)", stall_s=stall),
        "cover-deploy-corrected": actuation.torque_figure(
            [results[WAYS[2]], results[WAYS[3]]],
            "y",
            "Deploy: corrected methods against the torque flown",
            truth=truth,
            stall_s=stall,
        ),
    }
    figures["cover-deploy-fused"] = actuation.torque_figure(
        [results[WAYS[4]]], "y", "Deploy: all channels at once, 95 % band", truth=truth, stall_s=stall
    )
    step("cover-stow: flying and drawing")
    _, stow = _fly("cover-stow", out, "nominal")
    figures["figB1-stow-momentum"] = actuation.momentum_figure(
        subject_of(stow, craft), "Stow: wheel momentum (000 Fig B1)"
    )
    for name, figure in figures.items():
        save(figure, out / f"{name}.svg")
    both = compare_torques(t_hrwa, t_tf, "y")
    return actuation_summary(telemetry, t_hrwa, both, stall) | {"doubts": list(results[WAYS[4]].doubts)}


def _mission(out: Path) -> dict:
    """Eleven years of a cover flown, analysed, kept and judged, as `simulate`, `trend add` and `report` do; beside the truth."""
    from ..craft.load import load_craft
    from ..report.page import write_report
    from ..sim.mission import fly_mission
    from ..trends.board import healths_in
    from ..trends.entries import load_events
    from ..trends.record import figure_record
    from ..trends.store import TrendStore
    from .trend import analysed

    say("a mission of 20 actuations: flying")
    truth = fly_mission("cassini-mission", out, seed=SEED)
    store = out / "trends.db"
    entries = analysed(load_events(out / "events.toml"), load_craft("cassini"))
    with TrendStore.open(store) as trends:
        trends.add(entries)
    say("judging and drawing")
    healths = healths_in(str(store), None, [])
    page = out / "report.html"
    write_report(healths, page, provenance({}, {"store": str(store)}, SEED))
    deploys = healths[0]
    wanted = {name.rpartition("_N")[0]: v for name, v in truth["law"]["change_percent"].items()}
    found = {f["figure"]: f for f in map(figure_record, deploys.figures) if f["basis"] == "fused"}
    keys = ("figure", "change_percent", "change_percent_ci95")
    changes = [{"flown_percent": v} | {k: found[name][k] for k in keys} for name, v in wanted.items()]
    return {
        "changes": changes, "verdict": deploys.verdict, "reasons": list(deploys.reasons), "report": str(page),
        "events": len(entries),
    }  # fmt: skip


def _print_mission(m: dict) -> None:
    print(f"\nmission: {m['events']} actuations in eleven years    flown here      found   95 % interval")
    for c in m["changes"]:
        low, high = c["change_percent_ci95"]
        print(
            f"  change of {c['figure']:32s} {c['flown_percent']:+10.0f} % {c['change_percent']:+8.0f} %   {low:+.0f} to {high:+.0f} %"
        )
    for reason in m["reasons"]:
        print(wrapped("  ", reason))
    print(f"report: {m['report']}\nverdict: {m['verdict']}")


def _print_table(table: dict) -> None:
    head = " ".join(f"{'peak ' + str(k):>7s}" for k in range(1, 7))
    print(
        f"\n{table['profile']}: percent error at the six peaks (000 {table['table']}); + is too large, late is positive"
    )
    print(f"  {'noise':8s} {'method':22s} {head}   lag [s]  between peaks [s]")
    published = " ".join(f"{v:7.2f}" for v in table["published_unsigned_percent"])
    print(f"  {'paper':8s} {'momentum (unsigned)':22s} {published}")
    for r in table["rows"]:
        errors = " ".join(f"{v:+7.2f}" for v in r["peak_error_percent"])
        name = f"{r['method']}, {r['variant']}"
        print(f"  {r['noise']:8s} {name:22s} {errors}   {r['lag_s']:+7.1f}  {r['peak_lag_s']:+17.1f}")


def _print_cover(c: dict) -> None:
    wheels = ", ".join(f"{n} {v:+.1f}" for n, v in c["wheel_change_rpm"].items())
    print("\ncover-deploy                                   flown here     the paper")
    print(f"  peak wheel momentum about y [N m s]        {c['peak_momentum_Nms']:12.2f}     about 0.3")
    print(f"  net momentum at the end [N m s]            {c['net_momentum_Nms']:+12.3f}     0")
    print(f"  largest torque excursion [N m]             {c['peak_torque_Nm']:12.4f}     within 0.015 to 0.02")
    print(f"  stall after motor on [min]                 {c['stall_after_motor_on_min']:12.2f}     2.2 to 3.3")
    ratio = c["transfer_over_momentum"]
    print(
        f"  transfer over momentum, printed            {'' if ratio is None else format(ratio, '12.2f')}     about 0.5"
    )
    print(f"  transfer lags momentum by [s]              {c['transfer_lag_s']:+12.1f}     leads")
    print(f"  wheels [rpm]: {wheels}     (paper: order of 10)")
    print_doubts(c["doubts"])
