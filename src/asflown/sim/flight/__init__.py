"""The closed loop: plant, controllers, sensors, thrusters, and the telemetry that they send."""

from .closed_loop import Flight, fly
from .cover import MovingPart, momentum_per_rate, moving_part
from .sensors import stream
from .write import check_flight, check_record, digests, write_flight

__all__ = [
    "Flight", "MovingPart", "check_flight", "check_record", "digests", "fly", "momentum_per_rate", "moving_part", "stream", "write_flight",
]  # fmt: skip
