"""Compile every kernel once, into numba's cache: ``python -m asflown.cli.prewarm``."""

from __future__ import annotations


def prewarm() -> None:
    """Short flights, a torque by the fused method, a tensor from a slew: all array types the kernels will ever see."""
    from ..craft.load import load_craft
    from ..estimate.inertia import inertia
    from ..estimate.torque import torque
    from ..sim.flight import fly

    flight = fly("quiet", changes={"duration": "120 s", "settle": "0 s"})
    torque(flight.telemetry, load_craft("cassini"), method="fused", axis="y")
    inertia(fly("slews", changes={"duration": "500 s"}).telemetry, load_craft("cassini"))


if __name__ == "__main__":
    prewarm()
