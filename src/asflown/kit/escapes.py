"""Outside text where it is shown: names of files, headings and ids may hold what commands a terminal or breaks a line."""

from __future__ import annotations

import re

#: Control characters (also those above ASCII), line separators, marks that turn the direction of writing, halves of characters.
_UNSHOWN = re.compile(
    r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff]"
)
#: Signs of our own tables in ASCII.
_IN_ASCII = str.maketrans({"±": "+/-", "·": "|", "…": "...", "−": "-", "–": "-", "µ": "u", "μ": "u", "²": "^2", "°": "deg", "τ": "tau"})  # fmt: skip


def visible(text: str) -> str:
    """Text of any number of lines with everything in it shown: '\\x1b[2J' as the characters \\x1b[2J."""
    return _UNSHOWN.sub(lambda found: found.group().encode("unicode_escape").decode("ascii"), text)


def on_one_line(text: str) -> str:
    """The same, a line end as \\n."""
    return visible(text).replace("\n", "\\n")


def encodable(text: str, encoding: str | None) -> str:
    """Text that ``encoding`` can write: signs it lacks in ASCII, other characters as escapes."""
    try:
        text.encode(encoding or "utf-8")
        return text
    except (UnicodeEncodeError, LookupError):
        return text.translate(_IN_ASCII).encode("ascii", "backslashreplace").decode("ascii")
