"""Options that several verbs share, declared once."""

from __future__ import annotations

import typer

CRAFT = typer.Option(
    None,
    "--craft",
    help="A built-in craft (asflown craft list) or a TOML file; else that of the project file asflown.toml.",
)
INERTIA = typer.Option(
    None, "--inertia", help='Inertia used as given: "Ixx,Iyy,Izz,Ixy,Ixz,Iyz" in kg m2, tensor elements.'
)
CM = typer.Option(None, "--cm", help='Centre of mass "x,y,z" in m, in the thruster positions\' origin.')
CHANNELS = typer.Option(None, "--channels", help="Channel dictionary (TOML) for a table with other names and units.")
EXCLUDE = typer.Option(None, "--exclude", help="Spans to exclude: CSV of start, stop, channel, reason.")
START = typer.Option(None, "--start", help="Start of the window: seconds from the epoch, or UTC.")
STOP = typer.Option(None, "--stop", help="End of the window: seconds from the epoch, or UTC.")
KEEP_IN = typer.Option(None, "--store", help="Keep the result in a trend store: a path (SQLite) or a URL.")
KEEP_AS = typer.Option(None, "--id", help="Name of the entry; made from the date unless given.")
PLOT_DIR = typer.Option(None, "--plot-dir", help="Draw the figures into this folder (SVG).")
UNLIKE = typer.Option(
    None, "--unlike", help="One sigma of one thruster against the others, as a share; 0.05 (leak: 0.03)."
)
INERTIA_SIGMA = typer.Option(None, "--inertia-sigma", help="One sigma of the inertia, as a share; 0.01.")
SPIN_SIGMA = typer.Option(None, "--spin-sigma", help="One sigma of a wheel's spin inertia, as a share; 0.0024.")
AIR = typer.Option(
    None,
    "--air",
    help='F10.7 of the day before, its 81-day mean and Ap, for NRLMSIS: "150,145,12"; else exponential.',
)
JSON = typer.Option(False, "--json", help="One JSON object on standard output.")


def craft_named(name: str | None) -> str:
    """The name given, or that of the project.  Raises BadInput where there is neither."""
    from ..kit.errors import BadInput

    if name is None:
        raise BadInput(
            "no craft is named, and the answer depends on the craft",
            remedy="Give --craft NAME (asflown craft list), or --craft FILE of your own (asflown craft new makes one), "
            'or write craft = "NAME" into a project file asflown.toml.',
        )
    return name


def craft_from(name: str | None, inertia: str | None, cm: str | None):
    """The craft that --craft, --inertia and --cm name."""
    from ..craft.load import load_craft
    from ..kit.quantities import plain_numbers

    return load_craft(
        craft_named(name),
        inertia=plain_numbers(inertia, 6, "--inertia") if inertia is not None else None,
        cm=plain_numbers(cm, 3, "--cm") if cm is not None else None,
    )


def numbers_of(text: str, option: str) -> list[float]:
    """'5,10,15' -> numbers."""
    from ..kit.errors import BadInput

    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise BadInput(f"{option} {text!r} is not a list of numbers", remedy='Write it as in "5,10,15".') from None


def names_of(text: str | None) -> tuple[str, ...] | None:
    """'drag,dipole' -> names; None for none."""
    return None if text is None else tuple(n.strip() for n in text.split(",") if n.strip())


def air_of(text: str | None):
    """The Sun's flux and activity that --air gives, or None."""
    from ..estimate.environment import Air
    from ..kit.errors import BadInput

    if text is None:
        return None
    three = numbers_of(text, "--air")
    if len(three) != 3 or min(three) < 0:
        raise BadInput(
            f"--air {text!r} is not three numbers", remedy='Give F10.7, its 81-day mean and Ap: --air "150,145,12".'
        )
    return Air(*three)


def hashes(*files) -> dict[str, str]:
    """SHA-256 of every file named, for the provenance; anything else (a built-in name, None) is skipped."""
    from ..kit.result import inputs_of

    return dict(inputs_of(*files))
