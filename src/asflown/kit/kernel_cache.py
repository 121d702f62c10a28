"""Numba's cache of compiled kernels, which may be missing, read-only or damaged: kernels are then compiled anew."""

from __future__ import annotations

from contextlib import suppress

from numba import njit


def compiled(function):
    """``function`` compiled at its first call, and kept in numba's cache where there is a place for it."""
    try:
        dispatcher = njit(cache=True)(function)
    except RuntimeError:  # no folder for the cache may be written
        return njit(function)
    cache = getattr(dispatcher, "_cache", None)
    if cache is not None:  # there is none where NUMBA_DISABLE_JIT leaves the function
        _forgive(cache)
    return dispatcher


def _forgive(cache) -> None:
    """What cannot be read from the cache counts as missing, and what cannot be kept is compiled again next time."""
    load, save = cache.load_overload, cache.save_overload

    def load_overload(signature, target):
        try:
            return load(signature, target)
        except Exception:  # cut short or foreign: pickle, zlib and LLVM raise many kinds
            with suppress(Exception):
                cache.flush()
            return None

    def save_overload(signature, data) -> None:
        with suppress(Exception):  # a full or read-only disk
            save(signature, data)

    cache.load_overload, cache.save_overload = load_overload, save_overload
