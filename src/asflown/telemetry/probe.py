"""Whether the HDF5 library comes back from a file: damaged heaps let it turn for ever, in C, where nothing in Python can stop it."""

from __future__ import annotations

import os
import signal
import warnings
from typing import TYPE_CHECKING

from ..kit.errors import BadInput

if TYPE_CHECKING:
    from pathlib import Path

#: Names and attributes of a sound file take milliseconds. [s]
PATIENCE_S = 8


def check_hdf5(path: Path) -> None:
    """Let a child process look at all names and attributes first.  Raises BadInput where it does not end in time, or crashes.

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
        try:
            with h5py.File(path, "r") as file:
                file.visititems(lambda _, item: dict(item.attrs) and None)
                dict(file.attrs)
        finally:
            os._exit(0)  # whatever happened: only not to end, and to crash, counts
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        what = "does not end" if os.WTERMSIG(status) == signal.SIGALRM else "crashes"
        raise BadInput(
            f"the HDF5 file is damaged (reading it {what})", file=path, remedy="Copy the file again, or write it anew."
        )
