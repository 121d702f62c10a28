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
    if getattr(dispatcher, "_cache", None) is not None:  # not where NUMBA_DISABLE_JIT leaves the function
        dispatcher._cache = _forgiving(dispatcher._cache)
    return dispatcher


def _forgiving(cache):
    """The cache; what cannot be read from it counts as missing, and what cannot be kept is compiled again next time."""
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
    return cache
