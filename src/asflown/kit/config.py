"""TOML into validated data, with messages a user can act on."""

from __future__ import annotations

import tomllib
from difflib import get_close_matches
from typing import TypeVar, get_args

from pydantic import BaseModel, ValidationError

from .errors import BadInput
from .reading import read_bytes, reading

Model = TypeVar("Model", bound=BaseModel)


def toml_table(source: bytes, file: object) -> dict:
    """The content of a TOML file.  Raises BadInput, naming the place, where it is not TOML."""
    try:
        return tomllib.loads(source.decode("utf-8-sig"))
    except (ValueError, RecursionError) as why:  # syntax, encoding, a number of 5000 digits, a thousand brackets
        said = "nested too deeply" if isinstance(why, RecursionError) else str(why)[:200]
        raise BadInput(f"not a TOML file ({said})", file=file, remedy="Check the syntax near that place.") from None


def validated(model: type[Model], table: dict, file: object, remedy: str) -> Model:
    """``table`` as a ``model``.  Raises BadInput for unknown keys, wrong units and impossible values."""
    with reading(file, remedy):
        try:
            return model.model_validate(table)
        except BadInput as why:
            raise BadInput(why.what, file=file, channel=why.channel, remedy=why.remedy) from None
        except ValidationError as why:
            raise BadInput(_in_words(why, model), file=file, remedy=remedy) from None


def document(
    model: type[Model], source: object, called: str, what: str, hint: str, remedy: str
) -> tuple[Model, object]:
    """What a TOML file, or a dict of the same keys, holds as a ``model``, and what to call it in messages: its path, or ``called``.

    ``what`` it should be and ``hint`` serve where there is no file.  Raises BadInput as ``read_bytes``, ``toml_table``, ``validated``."""
    if isinstance(source, dict):
        return validated(model, source, called, remedy), called
    content = read_bytes(source, what, hint)  # type: ignore[arg-type]
    return validated(model, toml_table(content, source), source, remedy), source


def _in_words(why: ValidationError, model: type[BaseModel]) -> str:
    said = []
    for e in why.errors()[:5]:
        where = ".".join(str(p) for p in e["loc"])
        unknown = e["type"] == "extra_forbidden"
        kind = (
            f"unknown key{_meant(model, e['loc'])}"
            if unknown
            else e["msg"].removeprefix("Value error, ").split("\n")[0]
        )
        said.append(f"{where}: {kind}" if where else kind)
    more = len(why.errors()) - 5
    return "; ".join(said) + (f"; and {more} more" if more > 0 else "")


def _meant(model: type[BaseModel], place: tuple) -> str:
    """The key most like an unknown one, as a question; '' where none is."""
    tables = [model]
    for step in place[:-1]:
        if isinstance(step, str):
            tables = [t for m in tables if step in m.model_fields for t in _tables_in(m.model_fields[step].annotation)]
    near = get_close_matches(str(place[-1]), {name for t in tables for name in t.model_fields}, 1, 0.7)
    return f" (did you mean {near[0]}?)" if near else ""


def _tables_in(kind: object) -> list[type[BaseModel]]:
    """Every table that a field may hold."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return [kind]
    return [t for part in get_args(kind) for t in _tables_in(part)]


def changes_of(settings, option: str) -> dict:
    """('a.b=2', 'c=10 s') -> {'a': {'b': 2}, 'c': '10 s'}: values as in TOML; anything that is not a TOML value is text.

    Raises BadInput for text that is not a key and a value, and for a key set twice."""
    changes: dict = {}
    for text in settings:
        key, equals, value = text.partition("=")
        *tables, last = key.strip().split(".")
        if not equals or not all([*tables, last]):
            raise BadInput(
                f"{option} {text!r} is not a key and a value", remedy="Write it as in duration=60 s, or table.key=2."
            )
        at = changes
        for name in tables:
            at = at.setdefault(name, {})
        if not isinstance(at, dict) or last in at:
            raise BadInput(f"{option} sets {key.strip()!r} twice", remedy="Give each key once.")
        try:
            at[last] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            at[last] = value.strip()
    return changes
