"""Crafts: list the built-in ones, show one on a date, start a file of your own, check it."""

from __future__ import annotations

from pathlib import Path

import typer

from .options import JSON, hashes
from .output import plain, print_doubts, print_json, provenance, wrapped
from .verb import verb, weighed

app = typer.Typer(help=__doc__, rich_markup_mode=None)


@app.command("list")
@verb
def list_(json: bool = JSON) -> None:
    """The built-in crafts."""
    from ..craft.load import built_in_crafts, load_craft
    from ..kit.doubts import Doubts

    crafts = [load_craft(n) for n in built_in_crafts()]
    if json:
        print_json({
            "command": "craft list",
            "crafts": [{"name": c.name, "description": c.description, "alternatives": list(c.alternatives)} for c in crafts],
            **Doubts().record(), "provenance": provenance({}, {}),
        })  # fmt: skip
        return
    for c in crafts:
        print(f"{c.name:14s} {c.description}")
        for name, a in c.alternatives.items():
            print(f"{'':14s}   {c.name}@{name}: {a.source}")


@app.command()
@verb
def show(
    name: str = typer.Argument(help="A built-in craft or a TOML file."),
    at: str = typer.Option(None, "--at", help="The date, UTC (default: the latest known state)."),
    json: bool = JSON,
) -> None:
    """A craft as it was on a date."""
    from ..craft.load import load_craft
    from ..kit.timeline import utc_to_tai_ns

    c = load_craft(name)
    now = c.at(utc_to_tai_ns(at) if at is not None else None)
    doubts = weighed(now.doubts)
    if json:
        print_json(
            _record(c, now, at, doubts)
            | {"command": "craft show", "provenance": provenance(hashes(name), {"craft": name, "at": at})}
        )
        return
    print(c.name + (f": {c.description}" if c.description else "") + (f", on {at}" if at else ""))
    if now.inertia_kgm2 is not None:
        print("  inertia [per unit spin inertia]" if now.relative else "  inertia [kg m2]")
        for row in now.inertia_kgm2:
            print("    " + " ".join(f"{v:12.6g}" for v in row))
    for w in now.wheels:
        spin = "unknown" if w.spin_inertia is None else f"{w.spin_inertia:.5f} kg m2"
        print(f"  wheel {w.name:6s} axis ({w.axis[0]:+.4f} {w.axis[1]:+.4f} {w.axis[2]:+.4f})  spin inertia {spin}")
        if w.note:
            print(wrapped(" " * 15, w.note))
    for t in c.thrusters:
        p, d = t.position, t.direction
        print(f"  thruster {t.name:3s} at ({p[0]:+.3f} {p[1]:+.3f} {p[2]:+.3f}) m  force along ({d[0]:g} {d[1]:g} {d[2]:g})"
              f"  {t.nominal_thrust:g} N")  # fmt: skip
    for timing, names in _by_timing(c.thrusters).items():
        print(wrapped("                ", f"delay, rise, fall {timing} ms: {', '.join(names)}"))
    if c.wheel_controller:
        _print_law(c.wheel_controller)
    for m in c.mechanisms:
        print(
            f"  mechanism {m.name}: {m.mass:g} kg at ({m.from_cm[0]:+.3f} {m.from_cm[1]:+.3f} {m.from_cm[2]:+.3f}) m from the centre of mass"
        )
    print_doubts(doubts)


def _print_law(k) -> None:
    period = "period not known" if k.period is None else f"every {k.period:g} s"
    print(f"  wheel controller: {k.bandwidth:g} Hz, damping {k.damping:g}, KP {k.kp_per_s:.6f} 1/s, KD {k.kd_per_s:.6f} 1/s\n"
          f"                    {_filter(k)}, {period}")  # fmt: skip
    if said := _fed(k):
        print(wrapped(" " * 20, said))


def _filter(law) -> str:
    f = law.rate_filter
    return "no rate filter" if f is None else f"rate filter {f.natural_frequency:g} rad/s, damping {f.damping:g}"


def _fed(law) -> str:
    """What the file says of feed-forward, tracking and the controller's inertia; '' where it says nothing."""
    terms = {"w x H": law.gyroscopic, "inertia x commanded acceleration": law.acceleration}
    said = [f"{what} {'fed' if yes else 'not fed'} forward" for what, yes in terms.items() if yes is not None]
    said += [] if law.tracking else ["the commanded rate is not tracked"]
    said += [] if law.inertia is None else [f"inertia {' '.join(f'{v:g}' for v in law.inertia)} kg m2"]
    return ", ".join(said)


def _by_timing(thrusters) -> dict[str, list[str]]:
    """Thrusters with the same delay, rise and fall, together."""
    found: dict[str, list[str]] = {}
    for t in thrusters:
        found.setdefault(f"{1e3 * t.delay:g}, {1e3 * t.rise:g}, {1e3 * t.fall:g}", []).append(t.name)
    return found


@app.command(short_help="Start a craft file of your own.")
@verb
def new(
    name: str = typer.Argument(help="The craft's name; its file is NAME.toml in the working folder."),
    wheels: int = typer.Option(None, "--wheels", help="How many wheels (default: 3 along x, y, z)."),
    cant: str = typer.Option(
        None, "--cant", help='Angle of their axes above the x-y plane, evenly around z, as in "35.26deg".'
    ),
    from_json: Path = typer.Option(
        None, "--from-json", help="Inertia and wheels from a JSON file, with the keys of craft show --json."
    ),
    json: bool = JSON,
) -> None:
    """Write a commented template of a craft file, which passes craft check; fill in your own values."""
    from ..craft.load import load_craft
    from ..craft.template import craft_template, outline, outline_of
    from ..kit.errors import BadInput
    from ..kit.files import write_text
    from ..kit.quantities import quantity

    if not name.replace("-", "").replace("_", "").isalnum():
        raise BadInput(f"{name!r} is no name for a craft", remedy="Use letters, digits, - and _.")
    if from_json is not None and (wheels is not None or cant is not None):
        raise BadInput("--from-json has the wheels already", remedy="Leave out --wheels and --cant.")
    angle = None if cant is None else quantity(cant, "rad")
    what = outline(3 if wheels is None else wheels, angle) if from_json is None else outline_of(from_json)
    place = Path(f"{name}.toml")
    if place.exists():
        raise BadInput("there is such a file already", file=place, remedy="Choose another name, or remove it first.")
    write_text(place, craft_template(name, what))
    try:
        doubts = weighed(load_craft(place).at(None).doubts)
    except BadInput:
        place.unlink()
        raise
    if json:
        options = {"name": name, "wheels": wheels, "cant": cant, "from_json": from_json}
        print_json({"command": "craft new", "craft": name, "file": str(place), **doubts.record(),
                    "provenance": provenance(hashes(from_json), options)})  # fmt: skip
        return
    print(f"wrote {place}: fill in your own values, then run `asflown craft check {place}`")
    print_doubts(doubts)


@app.command(short_help="Check a craft file.")
@verb
def check(file: str = typer.Argument(help="A craft TOML file."), json: bool = JSON) -> None:
    """Check a craft file: report its errors, else say verb by verb what it allows and what is missing."""
    from ..craft.abilities import abilities
    from ..craft.load import load_craft

    c = load_craft(file)
    now, can = c.at(None), abilities(c)
    doubts = weighed(now.doubts)
    if json:
        print_json(
            _record(c, now, None, doubts)
            | {"verbs": [a._asdict() for a in can], "command": "craft check"}
            | {"provenance": provenance(hashes(file), {"craft": file})}
        )
        return
    print(f"{file}: a valid craft ({c.name}; wheels: {len(c.wheel_names)}, thrusters: {len(c.thrusters)}, "
          f"mass properties: {len(c.mass_properties)})")  # fmt: skip
    for a in can:
        print(wrapped(f"  {a.verb:16s} {'yes' if a.can else 'no ':3s}  ", a.note).rstrip())
    print_doubts(doubts)


def _of_filter(craft, what: str):
    """A number of the rate filter; None where there is none."""
    return getattr(craft.wheel_controller.rate_filter, what, None)


def _record(c, now, at, doubts) -> dict:
    from ..craft.model import tensor

    inertia = plain(now.inertia_kgm2)
    return {
        "craft": c.name,
        "at": at,
        "inertia_kg_m2": None if now.relative else inertia,
        "inertia_per_spin_inertia": inertia if now.relative else None,
        "wheels": [{"name": w.name, "axis": w.axis, "spin_inertia_kg_m2": w.spin_inertia} for w in now.wheels],
        "thrusters": [
            {"name": t.name, "position_m": t.position, "direction": t.direction, "nominal_thrust_N": t.nominal_thrust,
             "delay_s": t.delay, "rise_s": t.rise, "fall_s": t.fall, "branch": t.branch} for t in c.thrusters
        ],
        "wheel_controller": c.wheel_controller and {
            "bandwidth_Hz": c.wheel_controller.bandwidth, "damping": c.wheel_controller.damping,
            "kp_per_s": c.wheel_controller.kp_per_s, "kd_per_s": c.wheel_controller.kd_per_s,
            "filter_rad_s": _of_filter(c, "natural_frequency"), "filter_damping": _of_filter(c, "damping"),
            "period_s": c.wheel_controller.period, "gyroscopic": c.wheel_controller.gyroscopic,
            "acceleration": c.wheel_controller.acceleration, "tracking": c.wheel_controller.tracking,
            "inertia_kg_m2": None if c.wheel_controller.inertia is None else plain(tensor(c.wheel_controller.inertia)),
        },
        "center_of_mass_m": c.center_of_mass,
        "center_of_mass_assumed_m": c.center_of_mass_assumed,
        **doubts.record(),
    }  # fmt: skip
