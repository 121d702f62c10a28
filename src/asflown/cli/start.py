"""The installed command: Ctrl-C ends it quietly, also while the program is still being loaded."""

from __future__ import annotations

import os


def main() -> None:
    """Run ``asflown.cli.main``; exit code 130 on Ctrl-C."""
    try:
        from .main import main as program

        program()
    except KeyboardInterrupt:
        os._exit(130)  # loading was cut off anywhere: nothing is left to be put in order
