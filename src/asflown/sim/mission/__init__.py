"""Many actuations over years: a mechanism that ages, flown one by one."""

from .flown import MissionRecord, check_mission, fly_mission
from .mission import Mission, is_mission, load_mission

__all__ = [
    "Mission", "MissionRecord", "check_mission", "fly_mission", "is_mission", "load_mission",
]  # fmt: skip
