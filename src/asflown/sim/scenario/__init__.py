"""What is to be flown: a frozen, checked description read from TOML, units in the values."""

from .control import Controller, NullSpace
from .motion import CoverMotion, Slew
from .orbiting import Environment, OrbitFlown, Pointing, Sensors, Unloading
from .recording import Gap, Sampling
from .scenario import NoiseName, Scenario, load_scenario, shipped_scenarios
from .thrusters import BranchSwap, Burn, CatalystBeds, ThrusterControl, ThrusterFault, ThrusterUse
from .torques import Constant, Passage, Plume, Table, Triangles, axis_number
from .wheels import Coast, DragGrowth, DragSpike, WheelBias

__all__ = [
    "BranchSwap", "Burn", "CatalystBeds", "Coast", "Constant", "Controller", "CoverMotion", "DragGrowth", "DragSpike",
    "Environment", "Gap", "NoiseName", "NullSpace", "OrbitFlown", "Passage", "Plume", "Pointing", "Sampling", "Scenario",
    "Sensors", "Slew", "Table", "ThrusterControl", "ThrusterFault", "ThrusterUse", "Triangles", "Unloading", "WheelBias",
    "axis_number", "load_scenario", "shipped_scenarios",
]  # fmt: skip
