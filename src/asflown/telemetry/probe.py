"""Whether the HDF5 library comes back from a file: damaged heaps let it turn for ever, in C, where nothing in Python can stop it."""

from __future__ import annotations

import os
import signal
import warnings
from contextlib import suppress
from typing import TYPE_CHECKING

from ..kit.errors import BadInput

if TYPE_CHECKING:
    from pathlib import Path

#: Names and attributes of a sound file take milliseconds [s], and little memory [bytes].
PATIENCE_S, MEMORY = 8, 1_000_000_000


def _leave_memory() -> None:
    """Let this process take no more than ``MEMORY`` beyond what it has, where the system tells."""
    import resource

    with suppress(OSError, ValueError), open("/proc/self/statm", encoding="ascii") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY, resource.RLIM_INFINITY))


def check_hdf5(path: Path) -> None:
    """Let a child process look at all names and attributes first.  Raises BadInput where it does not end in time, takes all memory, or crashes.

    A file that cannot be opened at all is left to its reader, which says why.  Without ``fork`` nothing is tried."""
    if not hasattr(os, "fork"):
        return
    import h5py

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # other threads: the child calls HDF5 alone, and ends
        child = os.fork()
    if child == 0:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(PATIENCE_S)
        code = 0  # other damage is told by the reader
        try:
            _leave_memory()
            with h5py.File(path, "r") as file:
                file.visititems(lambda _, item: dict(item.attrs) and None)
                dict(file.attrs)
        except Exception as why:  # h5py raises many kinds
            code = int(isinstance(why, MemoryError) or "alloc" in str(why).lower())
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    if status:
        what = "takes all memory" if os.WIFEXITED(status) else "crashes"
        if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGALRM:
            what = "does not end"
        raise BadInput(
            f"the HDF5 file is damaged (reading it {what})", file=path, remedy="Copy the file again, or write it anew."
        )
