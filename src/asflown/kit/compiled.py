"""The only use of numba (with its cache, ``kernel_cache``): kernels are compiled where it is installed and run as plain Python where it is not.

Kernels that call each other stand in one module: numba's cache does not notice a callee that changed
in another file.
"""

from __future__ import annotations


def jit(function):
    """Compile and cache ``function``; NUMBA_DISABLE_JIT=1, or numba missing, leaves it as it is."""
    try:
        from .kernel_cache import compiled

        return compiled(function)
    except ImportError:
        return function
