"""asflown: what a spacecraft really is in flight, from its own telemetry.

Exit codes: 0 done, 2 bad input or usage, 3 done but a check failed (alarm, watch, --strict), 130 stopped by Ctrl-C.
"""

from __future__ import annotations

import errno
import itertools
import os
import sys
from contextlib import redirect_stdout, suppress

import typer

from . import (
    budget,
    craft,
    demo,
    density,
    external_torque,
    gates,
    inertia,
    jets,
    leak,
    report,
    simulate,
    sources,
    telemetry,
    thrust,
    torque,
    trend,
    tune,
    wheels,
)
from .output import NobodyReads, Shown, say

app = typer.Typer(help=__doc__, add_completion=False, rich_markup_mode=None)
app.command("torque", short_help="Reconstruct the disturbance torque.")(torque.torque)
app.command("wheels", short_help="Bearing drag and use of the wheels.")(wheels.wheels)
app.command("external-torque", short_help="The steady external torque, from the momentum gained.")(
    external_torque.external_torque
)
app.command("sources", short_help="What the torque is made of: dipole, sunlight, drag.")(sources.sources)
app.command("density", short_help="Density of the gas met in a flyby, from its torque.")(density.density)
app.command("jets", short_help="Jets of a plume, from the momentum they transfer.")(jets.jets)
app.command("leak", short_help="Leaking and weak thrusters, from residual momentum.")(leak.leak)
app.command("thrust", short_help="Thrust, fall time and centre of mass, from wheel biasing and burns.")(thrust.thrust)
app.command("simulate", short_help="Fly a scenario in the closed loop.")(simulate.simulate)
app.command("budget", short_help="Error budget of each method over many flights.")(budget.budget)
app.command("tune", short_help="The cover paper's search for a smoothing span.")(tune.tune)
app.command("demo", short_help="Fly and reconstruct the test cases of the cover paper.")(demo.demo)
app.command("report", short_help="One page for the anomaly board.")(report.report)
app.add_typer(inertia.app, name="inertia", short_help="The inertia tensor and the external torque, from slews.")
app.add_typer(trend.app, name="trend", short_help="An actuator's health over years: add, list, show, compare, watch.")
app.add_typer(gates.app, name="gates", short_help="Maneuver execution errors: fit, judge, watch, predict.")
app.add_typer(telemetry.app, name="telemetry", short_help="Check a telemetry file; list channel names.")
app.add_typer(craft.app, name="craft", short_help="List, show, start and check crafts.")


@app.callback(invoke_without_command=True)
def _program(
    context: typer.Context, version: bool = typer.Option(False, "--version", help="Print the version and stop.")
) -> None:
    if version:
        from .. import __version__

        print(f"asflown {__version__}")
        raise typer.Exit()
    if context.invoked_subcommand is None:
        print(context.get_help())
        return
    from . import project

    project.Defaults.used = ()
    file = project.found()
    if file is not None:
        from .project_file import defaults_from  # pydantic only where there is a file to check

        context.default_map = defaults_from(file, context.command)


def main() -> None:
    """Run one verb; bad input and usage become one message on standard error and exit code 2."""
    _open_streams()
    with redirect_stdout(Shown(sys.stdout)):  # type: ignore[type-var]
        code = _run()
    sys.exit(code if isinstance(code, int) else 0)


def _run() -> object:
    """The exit code of the verb that the command line names; what stands on standard output is out then."""
    from ..kit.errors import BadInput

    code: object
    try:
        code = app(standalone_mode=False, prog_name="asflown")
        sys.stdout.flush()
    except BadInput as why:
        code = _complain(str(why), told=why.record())
    except (typer.Abort, KeyboardInterrupt):
        code = 130
    except NobodyReads:  # whoever read it has enough
        _silence_output()
        code = 0
    except MemoryError:
        code = _complain("there is not enough memory for this job\nTake a shorter window or a shorter flight.")
    except Exception as why:
        if isinstance(why, OSError) and why.errno in (errno.ENOSPC, errno.EIO, errno.EBADF) and why.filename is None:
            _silence_output()
            code = _complain(f"standard output cannot be written ({why.strerror})\nMake room, or write elsewhere.")
        elif hasattr(why, "format_message"):  # usage error of the parser
            code = _complain(f"{why.format_message()}\nSee `{_verb(why)} --help`.")
        elif os.environ.get("ASFLOWN_DEBUG"):
            raise
        else:
            code = _complain(f"{type(why).__name__}: {why}\nThis is a fault of asflown, not of your data. "
                             "Please report it; ASFLOWN_DEBUG=1 shows where it happened.", 1)  # fmt: skip
    return code


def _open_streams() -> None:
    """Standard streams that were closed lead nowhere: else the next file opened would take their place."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115


def _silence_output() -> None:
    """What is still to be written on standard output is thrown away, so that the interpreter's end does not try again."""
    with suppress(OSError, ValueError):  # a stream that is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _verb(usage) -> str:
    """The command with the usage error: 'asflown telemetry check'."""
    context = getattr(usage, "ctx", None)
    words = context.command_path.split()[1:] if context else [w for w in sys.argv[1:2] if w.isalpha()]
    return " ".join(["asflown", *words])


def _complain(text: str, code: int = 2, told: dict | None = None) -> int:
    """One message on standard error; with --json also one object on standard output, so that a program need not parse words."""
    say(f"error: {text}"[:1490])
    if "--json" in sys.argv[1:]:
        import json

        what, _, remedy = text.partition("\n")
        record = told or {"what": what, "remedy": remedy, "file": None, "channel": None, "time": None, "line": None}
        words = itertools.takewhile(str.isidentifier, (w.replace("-", "_") for w in sys.argv[1:3]))
        command = " ".join(w.replace("_", "-") for w in words)
        with suppress(OSError):
            sys.stdout.write(json.dumps({"command": command, "error": record, "exit_code": code}) + "\n")
            sys.stdout.flush()
    return code


if __name__ == "__main__":
    main()
