"""Telemetry: check a file before use, list the channel names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import typer

from .options import CHANNELS, CM, EXCLUDE, INERTIA, JSON, START, STOP, craft_from, hashes
from .output import print_doubts, print_json, provenance
from .progress import shown
from .verb import verb, weighed

app = typer.Typer(help=__doc__, rich_markup_mode=None)


@app.command(short_help="What a file holds, and what is wrong with it.")
@verb
def check(
    file: Path = typer.Argument(help="CSV (plain or gzip), Parquet, NetCDF or HDF5."),
    channels: Path = CHANNELS,
    exclude: Path = EXCLUDE,
    craft: str = typer.Option(None, "--craft", help="A craft, to test wheel rates against its limits."),
    inertia: str = INERTIA,
    cm: str = CM,
    start: str = START,
    stop: str = STOP,
    json: bool = JSON,
) -> None:
    """Check a telemetry file channel by channel, and report what is wrong with it.

    A measured magnetic field and Sun are held against IGRF, the ephemeris and the Earth's shadow, where orbit, attitude and epoch
    are known.

    Exit code 3 where the data need inspection before use: a doubted unit, attitude or rates in other axes, spikes, a stuck sensor, an
    undeclared wrap, quaternions without unit length, one time stamp with two different values.
    Dropouts, gaps, repeats, duplicates and late samples are reported and handled, exit code 0."""
    from ..estimate.subject import sky_doubts
    from ..telemetry.load import load_telemetry
    from ..telemetry.screening import needs_a_look, summaries

    ship = craft_from(craft, inertia, cm) if craft else None
    with shown():
        t = load_telemetry(file, channels=channels, exclude=exclude, craft=ship).between(start, stop)
    look = needs_a_look(replace(t, doubts=weighed(t.doubts)))
    t = replace(t, doubts=weighed(t.doubts + sky_doubts(t, ship)))
    lines = summaries(t)
    if json:
        options = {"channels": channels, "exclude": exclude, "craft": craft, "inertia": inertia, "cm": cm, "start": start,
                   "stop": stop}  # fmt: skip
        print_json(
            _record(t, lines)
            | {"command": "telemetry check", "provenance": provenance(dict(t.inputs) | hashes(craft), options)}
        )
    else:
        _print(t, lines)
    if look:
        raise typer.Exit(3)


@app.command()
@verb
def names(json: bool = JSON) -> None:
    """The channel names asflown knows, with their units."""
    from ..kit.doubts import Doubts
    from ..telemetry.channels import AXES, KINDS

    members = {"axis": "|".join(AXES), "component": "w|x|y|z", "wheel": "<WHEEL>", "thruster": "<THRUSTER>"}
    rows = []
    for k in KINDS:
        name = k.stem + (f"_{members[k.member]}" if k.member in members else "")
        rows.append((name + ("[_<MECHANISM>]" if k.member == "mechanism" else ""), k))
    if json:
        print_json({
            "command": "telemetry names",
            "names": [{"name": n, "unit": k.unit, "behaves": k.behaves, "meaning": k.meaning} for n, k in rows],
            **Doubts().record(), "provenance": provenance({}, {}),
        })  # fmt: skip
        return
    for name, k in rows:
        unit = "word or integer" if k.behaves == "state" else f"[{k.unit}]"
        print(f"{name:35s} {unit:16s} {k.meaning}")


def _record(t, lines) -> dict:
    return {
        "file": t.source,
        "epoch": t.epoch_label if t.dated else None,
        "channels": [
            {"name": s.name, "unit": s.unit, "samples": s.samples, "unused": s.unused, "cadence_s": s.cadence_s,
             "first_s": s.first_s, "last_s": s.last_s, "dropouts": s.dropouts, "gaps": len(s.gaps),
             "gap_list": [{"start_s": a, "stop_s": b} for a, b in s.gaps], "quantisation": s.quantisation,
             "noise": s.noise, "suspicions": list(s.suspicions)} for s in lines
        ],
        "time_labels": list(t.time_labels),
        "findings": [
            {"channel": f.channel, "what": f.what, "count": f.count, "first_s": float(t.seconds(f.first_tai_ns)),
             "detail": f.detail} for f in t.findings
        ],
        **t.doubts.record(),
    }  # fmt: skip


def _print(t, lines) -> None:
    """One row a channel; then the findings in words, except dropouts and gaps (they have columns)."""
    first, last = t.span()
    print(
        f"{t.source}: {len(lines)} channels, epoch {t.epoch_label}, {float(t.seconds(first)):g} to {float(t.seconds(last)):g} s"
    )
    if t.time_labels:
        print(f"also kept: {', '.join(t.time_labels)}")
    cells = [
        (
            "channel",
            "unit",
            "samples",
            "every s",
            "from s",
            "to s",
            "drop",
            "gaps",
            "longest",
            "step",
            "noise",
            "look at",
        )
    ]
    for s in lines:
        longest = max((b - a for a, b in s.gaps), default=None)
        cells.append((
            s.name, s.unit, str(s.samples), _short(s.cadence_s), _short(s.first_s), _short(s.last_s), str(s.dropouts or "·"),
            str(len(s.gaps) or "·"), f"{longest:g} s" if longest else "", _short(s.quantisation), _short(s.noise, 2),
            ", ".join(s.suspicions),
        ))  # fmt: skip
    widths = [max(len(row[i]) for row in cells) for i in range(len(cells[0]))]
    print()
    for row in cells:
        left = [c.ljust(w) if i in (0, 1, 11) else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True))]
        print("  ".join(left).rstrip())
    print()
    told = [f for f in t.findings if f.what not in ("dropout", "gap")]
    for f in told:
        when = "" if f.what == "ignored" else f", first at {t.describe_time(f.first_tai_ns)}"
        print(f"  {f.channel or 'file'}: {f.what} {f.count}{when}: {f.detail}")
    if not told and not t.doubts:
        print("  nothing suspicious")
    print_doubts(t.doubts)


def _short(value: float | None, digits: int = 4) -> str:
    if value is None:
        return ""
    return f"{value:.0f}" if value == int(value) and abs(value) < 1e7 else f"{value:.{digits}g}"
