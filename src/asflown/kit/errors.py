"""One kind of error for bad input: what, where, and what to do next."""

from __future__ import annotations

from .escapes import on_one_line


class BadInput(ValueError):
    """Input that cannot be used.  The command line turns it into one message and exit code 2.

    ``what`` says what is wrong, ``remedy`` what to do about it.  ``file``, ``channel``, ``time``
    and ``line`` say where, in the message and as attributes for code.
    """

    LONGEST = 1400  # characters, so that a message needs no scrolling

    def __init__(
        self,
        what: str,
        *,
        remedy: str,
        file: object = None,
        channel: str | None = None,
        time: str | None = None,
        line: int | None = None,
    ):
        self.what, self.remedy = what, remedy
        self.file = None if file is None else str(file)
        self.channel, self.time, self.line = channel, time, line
        place = self.file or ""
        if line is not None:
            place += f", line {line}" if place else f"line {line}"
        if channel is not None:
            short = channel if len(channel) <= 80 else channel[:79] + "…"
            place += f", channel {short}" if place else f"channel {short}"
        if time is not None:
            place += f", at {time}" if place else f"at {time}"
        head = f"{place}: {what}" if place else what
        head, remedy = on_one_line(head), on_one_line(remedy)  # much of it was written by others
        room = self.LONGEST - len(remedy) - 2
        if len(head) > room:
            head = head[: room - 1] + "…"
        super().__init__(f"{head}\n{remedy}")

    def record(self) -> dict:
        """The JSON form, ``error`` of a verb that was refused."""
        return {
            "what": self.what, "remedy": self.remedy, "file": self.file, "channel": self.channel, "time": self.time,
            "line": self.line,
        }  # fmt: skip

    def __reduce__(self):
        return _again, (self.what, self.remedy, self.file, self.channel, self.time, self.line)

    def within(self, file: object) -> BadInput:
        """The same error, with the file where none is named yet."""
        if self.file is not None or not file:
            return self
        return BadInput(self.what, remedy=self.remedy, file=file, channel=self.channel, time=self.time, line=self.line)


def check_choice(value, allowed, what: str) -> None:
    """Raise BadInput where ``value`` is not one of those allowed; the message does not list None."""
    if value not in allowed:
        raise BadInput(
            f"{what} {value!r} is not known", remedy=f"Choose one of: {some_of(a for a in allowed if a is not None)}."
        )


def some_of(names, most: int = 12) -> str:
    """A list of names for a message, cut to a readable length."""
    names = [str(n) for n in names]
    if len(names) <= most:
        return ", ".join(names) if names else "none"
    return ", ".join(names[:most]) + f" and {len(names) - most} more"


def _again(what, remedy, file, channel, time, line) -> BadInput:
    """A BadInput that came from another process."""
    return BadInput(what, remedy=remedy, file=file, channel=channel, time=time, line=line)
