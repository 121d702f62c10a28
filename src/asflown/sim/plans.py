"""What scenarios and missions have in common: shipped ones by name, one's own by path, changes merged key by key."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from ..kit.config import read_bytes, toml_table
from ..kit.errors import BadInput, some_of


def shipped(kind: str) -> list[str]:
    """Names of the shipped ``kind``: 'scenario' or 'mission'."""
    return sorted(p.name.removesuffix(".toml") for p in _folder(kind).iterdir() if p.name.endswith(".toml"))


def read_plan(name_or_path: str | Path, kind: str) -> tuple[dict, str, Path]:
    """The TOML's content with its name in it, what to call the file in a complaint, and the folder it is in.

    Raises BadInput for an unknown name, or a file that cannot be read or is not TOML."""
    text, path = str(name_or_path), Path(name_or_path)
    if path.suffix == ".toml" or "/" in text:
        remedy = f"Give a TOML file, or a shipped {kind}: {some_of(shipped(kind))}."
        source, folder, name = read_bytes(path, f"{kind} file", remedy), path.parent, path.name
    else:
        if text not in shipped(kind):
            other = {"scenario": "mission", "mission": "scenario"}[kind]
            raise BadInput(
                f"no {kind} is named {text!r}",
                remedy=f"Shipped: {some_of(shipped(kind))}; as a {other}: {some_of(shipped(other))}. "
                "For your own, give the path of a TOML file.",
            )
        source, folder, name = (_folder(kind) / f"{text}.toml").read_bytes(), Path(), text
    return {"name": path.stem} | toml_table(source, name), name, folder


def merged(old: dict, new: dict) -> dict:
    """``old`` with the keys of ``new``; tables key by key, lists replaced."""
    both = dict(old)
    for key, value in new.items():
        deep = isinstance(value, dict) and isinstance(both.get(key), dict)
        both[key] = merged(both[key], value) if deep else value
    return both


def _folder(kind: str):
    return resources.files("asflown.sim") / f"{kind}s"
