"""Where a project file `asflown.toml` lies, and whether the verb that runs has taken anything from it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..kit.result import Input

NAME = "asflown.toml"


class Defaults(dict):
    """Values of one verb's options by parameter; notes the project file as used where one is taken."""

    #: Project files that the verb running now has taken a value from.
    used: tuple[Input, ...] = ()

    def __init__(self, source: tuple[Input, ...]):
        super().__init__()
        self.source = source

    def get(self, key, default=None):
        value = super().get(key, default)
        if value is not None:
            Defaults.used = self.source
        return value


def found() -> Path | None:
    """The project file of the working folder, or of the nearest folder above it that has one."""
    try:
        here = Path.cwd()
    except OSError:  # a folder that is gone
        return None
    if os.path.isfile(NAME):
        return Path(NAME)
    return next((f / NAME for f in here.parents if os.path.isfile(f / NAME)), None)
