"""What scenarios and missions have in common: shipped ones by name, one's own by path, changes merged key by key."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import ClassVar, Self

from pydantic import BaseModel, ConfigDict, PrivateAttr

from ..kit.config import toml_table, validated
from ..kit.errors import BadInput, some_of
from ..kit.reading import read_bytes


class Part(BaseModel):
    """A table of a plan: frozen, and no key that is not known."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Plan(Part):
    """What a TOML file says is to be flown, with the file's content kept."""

    KIND: ClassVar[str]  # 'scenario' or 'mission'
    REMEDY: ClassVar[str]  # where its keys are explained

    name: str = ""

    _written: dict = PrivateAttr(default_factory=dict)
    _folder: Path = PrivateAttr(default=Path())

    @property
    def folder(self) -> Path:
        """Where files it names are looked for."""
        return self._folder

    @property
    def as_written(self) -> dict:
        """The TOML's content, changes included: what to keep in order to fly it again."""
        return self._written

    def record(self) -> dict:
        """The JSON form, among the options of what was made of it."""
        return self._written

    @classmethod
    def load(cls, name_or_path: str | Path) -> Self:
        """A shipped one by name, or one from a TOML file.

        Raises BadInput for an unknown name, an unreadable file, an unknown key or a wrong unit."""
        return cls._checked(*_read(name_or_path, cls.KIND))

    def changed(self, **changes) -> Self:
        """Another one; values as in the TOML: ``duration="60 s"``, ``scatter={"impulse_percent": 0.0}``.

        Tables are merged key by key, lists replaced.  Raises BadInput as ``load`` does."""
        return self._checked(_merged(self._written, changes), self.name or self.KIND, self._folder)

    @classmethod
    def _checked(cls, written: dict, where: str, folder: Path) -> Self:
        # TOML has dates of its own; here they are text, as the record keeps them
        written = {k: v.isoformat() if hasattr(v, "isoformat") else v for k, v in written.items()}
        plan = validated(cls, written, where, cls.REMEDY)
        plan._written, plan._folder = written, folder
        return plan


def shipped(kind: str) -> list[str]:
    """Names of the shipped ``kind``: 'scenario' or 'mission'."""
    return sorted(p.name.removesuffix(".toml") for p in _folder(kind).iterdir() if p.name.endswith(".toml"))


def _read(name_or_path: str | Path, kind: str) -> tuple[dict, str, Path]:
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


def _merged(old: dict, new: dict) -> dict:
    """``old`` with the keys of ``new``; tables key by key, lists replaced."""
    both = dict(old)
    for key, value in new.items():
        deep = isinstance(value, dict) and isinstance(both.get(key), dict)
        both[key] = _merged(both[key], value) if deep else value
    return both


def _folder(kind: str):
    return resources.files("asflown.sim") / f"{kind}s"
