"""Compile the kernels once, into numba's cache: ``python -m asflown.sim.prewarm``."""

from __future__ import annotations

from .fly import fly


def prewarm() -> None:
    """A flight of two seconds: every array type the kernels will ever see."""
    fly("quiet", duration="2 s", settle="0 s")


if __name__ == "__main__":
    prewarm()
