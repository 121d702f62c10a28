"""Doubts: what a user should know before trusting a result.

A ``Kind`` is declared once, next to the code that finds it.  Calling it with what was found makes a ``Doubt``, whose text is
the sentence a person reads.  Code asks for kinds and severities, never for words:

    UNEXPLAINED = Kind("fused.unexplained", Severity.SUSPECT,
                       "the model does not explain {channel} about {axis} (correlation {correlation:.2f})",
                       remedy="Look at the residuals: --plot.")
    found.append(UNEXPLAINED(channel=channel, axis=axis, correlation=r))
    ...
    if result.doubts.has(UNEXPLAINED): ...
"""

from __future__ import annotations

import string
from dataclasses import dataclass, field, replace
from enum import IntEnum
from numbers import Real
from typing import TYPE_CHECKING, Any

from .errors import some_of
from .plain import finite

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


class Severity(IntEnum):
    """How much a doubt weakens a result."""

    NOTE = 1  # a choice was made for the user
    CAUTION = 2  # a known error is not in the sigma
    SUSPECT = 3  # the data contradict the model
    VOID = 4  # the result says nothing

    @property
    def label(self) -> str:
        """'note', 'caution', 'suspect' or 'void'."""
        return self.name.lower()


_KINDS: dict[str, Kind] = {}


@dataclass(frozen=True)
class Kind:
    """One kind of doubt.

    ``id``: unique, 'room.what'; ``says``: the sentence, with named values in braces as ``str.format`` takes them;
    ``remedy``: what the user can do, '' where there is none.  Raises ValueError for an id that is taken."""

    id: str
    severity: Severity
    says: str
    remedy: str = ""

    def __post_init__(self):
        other = _KINDS.setdefault(self.id, self)
        if other is not self and other != self:
            raise ValueError(f"two kinds of doubt are called {self.id!r}")

    @property
    def names(self) -> frozenset[str]:
        """Values that the sentence and the remedy need."""
        parsed = string.Formatter().parse(self.says + " " + self.remedy)
        return frozenset(name.split("[")[0].split(".")[0] for _, name, _, _ in parsed if name)

    def __call__(self, **told: Any) -> Doubt:
        """A doubt of this kind; numbers by their unit-bearing names, all else as text, lists joined.

        Raises TypeError where the sentence names a value that is not given."""
        missing = self.names - set(told)
        if missing:
            raise TypeError(f"doubt {self.id!r} needs {', '.join(sorted(missing))}")
        numbers = {n: v for n, v in told.items() if isinstance(v, Real) and not isinstance(v, bool)}
        about = {n: _text(v) for n, v in told.items() if n not in numbers}
        return Doubt(self, numbers, about)


def _text(value) -> str:
    return some_of(value) if isinstance(value, (list, tuple, set, frozenset)) else str(value)


#: A sentence that came without a kind: of a store written before kinds were kept, or of a file's own free text.
UNTOLD = Kind("untold", Severity.CAUTION, "{sentence}")


@dataclass(frozen=True, eq=False)
class Doubt:
    """One thing to doubt: its kind, the numbers and names in its sentence, and where it was found.

    ``origin``: '' for the result's own, else what passed it on, such as 'craft', 'telemetry' or 'torque'."""

    kind: Kind
    numbers: dict[str, Any] = field(default_factory=dict)
    about: dict[str, str] = field(default_factory=dict)
    origin: str = ""

    def __str__(self) -> str:
        record = self.about.get("record", "")
        sentence = self.kind.says.format(**self.about, **self.numbers)
        return sentence if not record or "record" in self.kind.names else f"{record}: {sentence}"

    def __eq__(self, other) -> bool:
        return isinstance(other, Doubt) and (self.kind.id, str(self)) == (other.kind.id, str(other))

    def __hash__(self) -> int:
        return hash((self.kind.id, str(self)))

    @property
    def severity(self) -> Severity:
        return self.kind.severity

    @property
    def remedy(self) -> str:
        return self.kind.remedy.format(**self.about, **self.numbers)

    @property
    def is_grave(self) -> bool:
        """Suspect or void: marked wherever the result is shown."""
        return self.severity >= Severity.SUSPECT

    def passed_on_by(self, origin: str) -> Doubt:
        """The same doubt in another result; the first origin stays."""
        return self if self.origin else replace(self, origin=origin)

    def of_record(self, record: str) -> Doubt:
        """The same doubt of one of several records, whose name its sentence then begins with."""
        return replace(self, about={"record": record, **self.about})

    def record(self) -> dict:
        """The JSON form, an element of ``doubts_detail``."""
        return {
            "kind": self.kind.id,
            "severity": self.severity.label,
            "sentence": str(self),
            "numbers": {n: v if isinstance(v, int) else finite(v) for n, v in self.numbers.items()},
            "about": self.about,
            "remedy": self.remedy,
            "origin": self.origin,
        }


class Doubts(tuple["Doubt", ...]):
    """Doubts of one result, in the order found, without repeats.

    Takes doubts, other ``Doubts`` and None (ignored); a plain sentence becomes a doubt of unknown kind."""

    def __new__(cls, found: Iterable[Doubt | str | None] = ()) -> Doubts:
        whole = (UNTOLD(sentence=d) if isinstance(d, str) else d for d in found if d is not None)
        return super().__new__(cls, dict.fromkeys(whole))  # type: ignore[arg-type]

    def __getnewargs__(self):
        return (tuple(self),)

    def __add__(self, other) -> Doubts:  # type: ignore[override]
        return Doubts([*self, *other])

    def __radd__(self, other) -> Doubts:
        return Doubts([*other, *self])

    def has(self, *kinds: Kind) -> bool:
        """Whether there is a doubt of one of these kinds."""
        return bool(self.of(*kinds))

    def of(self, *kinds: Kind) -> Doubts:
        """Those of these kinds."""
        ids = {k.id for k in kinds}
        return Doubts(d for d in self if d.kind.id in ids)

    def without(self, *kinds: Kind) -> Doubts:
        """Those of other kinds."""
        ids = {k.id for k in kinds}
        return Doubts(d for d in self if d.kind.id not in ids)

    def about(self, **which: str) -> Doubts:
        """Those about a channel, an axis, …: ``doubts.about(channel="body_rate_x")``."""
        return Doubts(d for d in self if all(d.about.get(n) == v for n, v in which.items()))

    def passed_on_by(self, origin: str) -> Doubts:
        return Doubts(d.passed_on_by(origin) for d in self)

    @property
    def worst(self) -> Severity | None:
        """The gravest severity; None where there is no doubt."""
        return max((d.severity for d in self), default=None)

    @property
    def gravest_first(self) -> Doubts:
        """Void, suspect, caution, note; within a severity as found."""
        ordered: list[Doubt] = sorted(self, key=lambda d: -d.severity)
        return Doubts(ordered)

    def sentences(self) -> list[str]:
        return [str(d) for d in self]

    def record(self) -> dict:
        """Two keys of every JSON: the sentences, and the same with kind, severity, numbers and remedy."""
        return {"doubts": self.sentences(), "doubts_detail": [d.record() for d in self]}


#: Parts that differ between events in otherwise equal doubts.
_OF_ONE_EVENT = frozenset({"date", "time", "first", "last", "start", "stop", "spans"})


def grouped(doubts: Iterable[Doubt]) -> Iterator[tuple[Doubt, int]]:
    """Doubts of many results: those that differ only in numbers and dates as one, the first, with how many there are."""
    groups: dict[tuple, list[Doubt]] = {}
    for d in doubts:
        same = tuple(sorted((n, v) for n, v in d.about.items() if n not in _OF_ONE_EVENT))
        groups.setdefault((d.kind.id, same), []).append(d)
    for those in groups.values():
        yield those[0], len(those)


def doubt_mark(doubt: Doubt) -> str:
    """'DOUBT', and for a suspect or void result 'DOUBT!'."""
    return "DOUBT!" if doubt.is_grave else "DOUBT"


def kinds() -> dict[str, Kind]:
    """Every kind declared by the modules imported so far, by id."""
    return dict(sorted(_KINDS.items()))


def doubt_from(record: dict) -> Doubt:
    """A doubt from its JSON form; one whose id is no longer known keeps severity and sentence."""
    kind = _KINDS.get(record["kind"])
    if kind is not None and kind.names <= set(record["numbers"]) | set(record["about"]):
        return Doubt(kind, record["numbers"], record["about"], record.get("origin", ""))
    severity = Severity[record["severity"].upper()]
    loose = object.__new__(Kind)  # not registered: it is another version's
    for name, value in (("id", record["kind"]), ("severity", severity), ("says", "{sentence}"), ("remedy", "")):
        object.__setattr__(loose, name, value)
    return Doubt(loose, {}, {"sentence": record["sentence"]}, record.get("origin", ""))
