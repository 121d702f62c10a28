"""The only use of numba: kernels are compiled where it is installed and run as plain Python where it is not.

Kernels that call each other stand in one module: numba's cache does not notice a callee that changed
in another file.
"""

from __future__ import annotations

from functools import cached_property, update_wrapper


def jit(function):
    """Compile and cache ``function`` when it is first called; NUMBA_DISABLE_JIT=1, or numba missing, leaves it as it is.

    To load numba and one kernel from its cache takes half a second, which most verbs need not spend."""
    return _Kernel(function)


class _Kernel:
    """A function that is compiled at its first call."""

    def __init__(self, function):
        update_wrapper(self, function)
        self.function = function

    def __call__(self, *args):
        return self.compiled(*args)

    @cached_property
    def compiled(self):
        """Compiled, as are from then on all kernels of its module: numba knows those it calls by their names there."""
        try:
            from numba import njit
        except ImportError:
            return self.function
        of_module = self.function.__globals__
        for name, kernel in list(of_module.items()):
            if isinstance(kernel, _Kernel):
                own = kernel.function.__globals__ is of_module
                of_module[name] = njit(cache=True)(kernel.function) if own else kernel.compiled
        return of_module[self.function.__name__]
