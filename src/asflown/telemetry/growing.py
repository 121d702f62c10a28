"""A table that another program is still writing, read again as it grows."""

from __future__ import annotations

import tempfile
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..kit.errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .telemetry import Telemetry


def growing(
    path: Path, read: Callable[[Path], Telemetry], *, patience_s: float, every_s: float = 1.0
) -> Iterator[tuple[Telemetry, bool]]:
    """The telemetry so far, each time whole lines have come, and whether it is the last.

    It is the last once nothing has come for ``patience_s``.  A file too short to be read is waited for; what is wrong with
    it then is raised at the end.  Only plain CSV grows by lines."""
    path, size, since = Path(path), -1, time.monotonic()
    while True:
        whole = _whole_lines(path)
        if len(whole) != size:
            size, since = len(whole), time.monotonic()
            so_far = None
            with suppress(BadInput):  # a header alone, or too few rows: more may follow
                so_far = _read(path, whole, read)
            if so_far is not None:
                yield so_far, False
        elif time.monotonic() - since >= patience_s:
            if not whole:
                raise BadInput(
                    "no data has been written to this file", file=path, remedy="Check the path, or raise --patience."
                )
            yield _read(path, whole, read), True
            return
        time.sleep(every_s)


def _whole_lines(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return b""
    except OSError as why:
        raise BadInput(f"the file cannot be opened ({why.strerror})", file=path, remedy="Check the path and its permissions.") from None  # fmt: skip
    if data[:2] == b"\x1f\x8b" or b"\0" in data[:4096]:
        raise BadInput("only plain CSV can be followed", file=path, remedy="Leave --follow out, or write CSV.")
    return data[: data.rfind(b"\n") + 1]


def _read(path: Path, whole: bytes, read) -> Telemetry:
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder) / path.name
        part.write_bytes(whole)
        try:
            telemetry = read(part)
            inputs = tuple(i._replace(file=str(path)) if i.file == str(part) else i for i in telemetry.inputs)
            return replace(telemetry, source=str(path), inputs=inputs)
        except BadInput as why:
            raise BadInput(why.what, remedy=why.remedy, file=path, channel=why.channel, time=why.time, line=why.line) from None  # fmt: skip
