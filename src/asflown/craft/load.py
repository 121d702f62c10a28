"""Crafts from TOML: the built-in ones by name, a user's own by file."""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path

from pydantic import ValidationError

from ..kit.errors import BadInput, some_of
from .model import Craft


def built_in_crafts() -> list[str]:
    return sorted(p.name.removesuffix(".toml") for p in _profiles().iterdir() if p.name.endswith(".toml"))


def _profiles():
    return resources.files("asflown.craft") / "profiles"


def load_craft(name_or_file: str | Path, *, inertia=None, cm=None) -> Craft:
    """A built-in craft ('cassini'), an alternative of it ('cassini@001-rounded'), or a TOML file.

    ``inertia``: six elements Ixx, Iyy, Izz, Ixy, Ixz, Iyz [kg m2] used as given in place of the
    craft's history; ``cm``: centre of mass [m] in the thruster positions' origin.
    Raises BadInput for an unknown name, an unreadable file, an unknown key or a wrong unit.
    """
    text, name, alternative = str(name_or_file), str(name_or_file), ""
    path = Path(text)
    if path.suffix == ".toml" or "/" in text:
        if not path.is_file():
            raise BadInput(
                "there is no such craft file",
                file=path,
                remedy=f"Give a TOML file, or a built-in craft: {some_of(built_in_crafts())}.",
            )
        source = path.read_bytes()
    else:
        name, _, alternative = text.partition("@")
        if name not in built_in_crafts():
            raise BadInput(
                f"no craft is named {name!r}",
                remedy=f"Built in: {some_of(built_in_crafts())}. For your own, give the path of a TOML file.",
            )
        source = (_profiles() / f"{name}.toml").read_bytes()
    try:
        craft = Craft.model_validate(tomllib.loads(source.decode("utf-8")))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as why:
        raise BadInput(f"not a TOML file ({why})", file=name, remedy="Check the syntax near that place.") from why
    except BadInput as why:
        raise BadInput(why.what, file=name, remedy=why.remedy) from why
    except ValidationError as why:
        raise BadInput(in_words(why), file=name, remedy="See docs/craft.md for the keys and their units.") from None
    if alternative:
        craft = craft.with_alternative(alternative)
    if inertia is not None or cm is not None:
        craft = craft.with_inertia(inertia, cm)
    return craft


def in_words(why: ValidationError) -> str:
    lines = []
    for e in why.errors()[:5]:
        where = ".".join(str(p) for p in e["loc"])
        kind = (
            "unknown key" if e["type"] == "extra_forbidden" else e["msg"].removeprefix("Value error, ").split("\n")[0]
        )
        lines.append(f"{where}: {kind}" if where else kind)
    more = len(why.errors()) - 5
    return "; ".join(lines) + (f"; and {more} more" if more > 0 else "")
