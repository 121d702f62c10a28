"""Crafts from TOML: the built-in ones by name, a user's own by file."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from ..kit.config import toml_table, validated
from ..kit.errors import BadInput, some_of
from ..kit.reading import read_bytes, reading
from ..kit.result import inputs_of
from .model import Craft


def built_in_crafts() -> list[str]:
    """Names of the built-in crafts.

    Returns
    -------
    list of str
        In alphabetical order, as ``load_craft`` takes them.
    """
    return sorted(p.name.removesuffix(".toml") for p in _profiles().iterdir() if p.name.endswith(".toml"))


def _profiles():
    return resources.files("asflown.craft") / "profiles"


def load_craft(name_or_file: str | Path, *, inertia=None, cm=None) -> Craft:
    """Load a built-in craft, or one from a TOML file.

    Parameters
    ----------
    name_or_file : str or Path
        A built-in craft ('cassini'), an alternative of it ('cassini@001-rounded'), or a TOML file (docs/craft.md).
    inertia : sequence of 6 floats, optional
        Ixx, Iyy, Izz, Ixy, Ixz, Iyz [kg m2], tensor elements (not negated products), body axes about the centre of mass;
        used at all dates in place of the craft's history.
    cm : sequence of 3 floats, optional
        Centre of mass [m], in the origin of the thrusters' positions.

    Returns
    -------
    Craft
        Validated, in SI; ``at`` gives it on a date.

    Raises
    ------
    BadInput
        For an unknown name, an unreadable file, an unknown key, a wrong unit, or an impossible inertia.
    """
    text, name, alternative = str(name_or_file), str(name_or_file), ""
    path = Path(text)
    if path.suffix == ".toml" or "/" in text:
        remedy = f"Give a TOML file, or a built-in craft: {some_of(built_in_crafts())}."
        source = read_bytes(path, "craft file", remedy)
    else:
        name, _, alternative = text.partition("@")
        if name not in built_in_crafts():
            own = f"{name}.toml"
            there = f"the path of a TOML file: {own}" if Path(own).is_file() else "the path of a TOML file"
            raise BadInput(
                f"no craft is named {name!r}",
                remedy=f"Built in: {some_of(built_in_crafts())}. For your own, give {there}.",
            )
        source = (_profiles() / f"{name}.toml").read_bytes()
    keys = "See docs/craft.md for the keys and their units."
    with reading(name, keys):
        craft = validated(Craft, toml_table(source, name), name, keys)
    craft._inputs = inputs_of(path) if path.suffix == ".toml" or "/" in text else ()
    if alternative:
        craft = craft.with_alternative(alternative)
    if inertia is not None or cm is not None:
        craft = craft.with_inertia(inertia, cm)
    return craft
