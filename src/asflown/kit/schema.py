"""JSON records as types, and the JSON Schema of a verb made from them.

A result's record is described once, as a ``TypedDict`` beside the result; ``Annotated[..., Doc("…")]`` gives the meaning of a key.
Unknown values are null, so numbers are ``Number``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, NotRequired

from typing_extensions import Doc, TypedDict

if TYPE_CHECKING:
    from collections.abc import Mapping

Number = float | None
Numbers = list[Number]
Vector = Annotated[list[Number], Doc("x, y, z")]
Rows = list[list[Number]]
Matrix = Annotated[list[list[Number]], Doc("3 x 3")]
Interval = Annotated[list[Number], Doc("[low, high]; null for an open end")]
Intervals = list[Interval]

__all__ = [
    "Annotated", "Doc", "Interval", "Intervals", "Matrix", "NotRequired", "Number", "Numbers", "Rows", "TypedDict", "Vector",
    "json_schema", "verb_record",
]  # fmt: skip


class DoubtRecord(TypedDict):
    """One doubt: kind as listed in docs/doubts.md, severity note, caution, suspect or void."""

    kind: str
    severity: str
    sentence: str
    numbers: dict[str, Any]
    about: dict[str, str]
    remedy: str
    origin: str


class InputRecord(TypedDict):
    file: str
    sha256: str


class ProvenanceRecord(TypedDict):
    inputs: list[InputRecord]
    versions: dict[str, str]
    options: dict[str, Any]
    seed: int | None


def verb_record(record: type, old: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Keys of a verb's JSON object with their types: those of the record, and those of every verb.

    ``old``: keys of earlier versions that are kept (see ``Estimate.OLD_KEYS``); those at the top only."""
    from typing import get_type_hints

    own = get_type_hints(record, include_extras=True)
    kept = {
        k: Annotated[own[now], Doc(f"kept for this version; see {now}")]
        for k, now in (old or {}).items()
        if now in own and "[]" not in k
    }
    every = {"command": str, "doubts": list[str], "doubts_detail": list[DoubtRecord], "provenance": ProvenanceRecord}
    return {"command": every.pop("command"), **own, **{k: NotRequired[v] for k, v in kept.items()}, **every}


def json_schema(verb: str, record: type, old: Mapping[str, str] | None = None) -> dict:
    """The JSON Schema (draft 2020-12) of a verb's object; further keys are allowed, missing ones are not."""
    from pydantic import TypeAdapter

    whole: Any = TypedDict(f"asflown {verb}", verb_record(record, old))  # type: ignore[operator]
    schema = TypeAdapter(whole).json_schema(mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": f"asflown {verb} --json"}
