"""What is to be flown: a frozen, checked description read from TOML, units in the values."""

from .control import Controller
from .motion import CoverMotion, Slew
from .recording import Gap, Sampling
from .scenario import NoiseName, Scenario, load_scenario, shipped_scenarios
from .thrusters import BranchSwap, Burn, CatalystBeds, ThrusterControl, ThrusterFault, ThrusterUse
from .torques import Constant, Passage, Plume, Table, Triangles, axis_number
from .wheels import Coast, DragSpike, WheelBias

__all__ = [
    "BranchSwap", "Burn", "CatalystBeds", "Coast", "Constant", "Controller", "CoverMotion", "DragSpike", "Gap",
    "NoiseName", "Passage", "Plume", "Sampling", "Scenario", "Slew", "Table", "ThrusterControl", "ThrusterFault",
    "ThrusterUse", "Triangles", "WheelBias", "axis_number", "load_scenario", "shipped_scenarios",
]  # fmt: skip
