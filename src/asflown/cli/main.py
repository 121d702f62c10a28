"""asflown: what a spacecraft really is in flight, from its own telemetry.

Exit codes: 0 done, 2 bad input or usage, 3 done but a check failed (alarm, watch).
"""

from __future__ import annotations

import os
import sys

import typer

from . import craft, demo, simulate, telemetry, torque

app = typer.Typer(help=__doc__, add_completion=False, no_args_is_help=True, rich_markup_mode=None)
app.command("torque")(torque.torque)
app.command("simulate")(simulate.simulate)
app.command("demo")(demo.demo)
app.add_typer(telemetry.app, name="telemetry")
app.add_typer(craft.app, name="craft")


@app.callback(invoke_without_command=True)
def _program(version: bool = typer.Option(False, "--version", help="Print the version and stop.")) -> None:
    if version:
        from asflown import __version__

        print(f"asflown {__version__}")
        raise typer.Exit()


def main() -> None:
    """Run one verb; bad input and usage become one message on standard error and exit code 2."""
    from asflown.kit.errors import BadInput

    code: object
    try:
        code = app(standalone_mode=False)
    except BadInput as why:
        code = _complain(str(why))
    except typer.Abort:
        code = 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    except Exception as why:
        if hasattr(why, "format_message"):  # the parser's own complaint about usage
            code = _complain(f"{why.format_message()}\nSee `asflown {' '.join(_verb())} --help`.")
        elif os.environ.get("ASFLOWN_DEBUG"):
            raise
        else:
            code = _complain(f"{type(why).__name__}: {why}\nThis is a fault of asflown, not of your data. "
                             "Please report it; ASFLOWN_DEBUG=1 shows where it happened.", 1)  # fmt: skip
    sys.exit(code if isinstance(code, int) else 0)


def _verb() -> list[str]:
    words = []
    for word in sys.argv[1:3]:
        if word.startswith("-") or "." in word or "/" in word:
            break
        words.append(word)
    return words[:1] if words and words[0] not in ("telemetry", "craft") else words


def _complain(text: str, code: int = 2) -> int:
    print(f"error: {text}"[:1490], file=sys.stderr)
    return code


if __name__ == "__main__":
    main()
