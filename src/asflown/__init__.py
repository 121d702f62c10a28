"""asflown: what a spacecraft really is in flight, from its own telemetry.

The public names load on first use, so that ``import asflown`` and ``asflown --help`` cost nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

__version__ = "0.1.0"

_PUBLIC = {
    "BadInput": "asflown.kit.errors",
    "Craft": "asflown.craft.model",
    "load_craft": "asflown.craft.load",
    "built_in_crafts": "asflown.craft.load",
    "Telemetry": "asflown.telemetry.telemetry",
    "load_telemetry": "asflown.telemetry.load",
    "write_table": "asflown.telemetry.tables",
    "disturbance_torque": "asflown.estimate.torque",
    "TorqueResult": "asflown.estimate.result",
    "compare_torques": "asflown.estimate.compare",
    "external_torque": "asflown.estimate.external_torque",
    "ExternalTorque": "asflown.estimate.external_result",
    "density": "asflown.estimate.density",
    "DensityResult": "asflown.estimate.density_result",
    "jets": "asflown.estimate.jets",
    "JetsResult": "asflown.estimate.jets_result",
    "leak": "asflown.estimate.leak",
    "LeakWatch": "asflown.estimate.leak",
    "LeakResult": "asflown.estimate.leak_result",
    "thrust": "asflown.estimate.thrust",
    "ThrustResult": "asflown.estimate.thrust_result",
    "wheel_drag": "asflown.estimate.wheel_drag",
    "WheelsResult": "asflown.estimate.wheel_result",
    "inertia_tensor": "asflown.estimate.inertia",
    "InertiaResult": "asflown.estimate.inertia_result",
    "Scenario": "asflown.sim.scenario",
    "load_scenario": "asflown.sim.scenario",
    "fly": "asflown.sim.fly",
    "write_flight": "asflown.sim.fly",
    "figure_of_merit": "asflown.trends.figures",
    "TrendStore": "asflown.trends.store",
    "Mission": "asflown.sim.mission",
    "load_mission": "asflown.sim.mission",
    "fly_mission": "asflown.sim.fly_mission",
    "error_budget": "asflown.campaigns.budget",
    "Gates": "asflown.maneuvers.model",
    "Maneuvers": "asflown.maneuvers.table",
    "load_maneuvers": "asflown.maneuvers.table",
    "write_maneuvers": "asflown.maneuvers.write",
    "past_model": "asflown.maneuvers.history",
    "fit_gates": "asflown.estimate.gates_fit",
    "GatesFit": "asflown.estimate.gates_result",
    "judge_gates": "asflown.estimate.gates_judge",
    "watch_maneuvers": "asflown.estimate.gates_watch",
}

__all__ = [*_PUBLIC, "__version__"]


def __getattr__(name: str):
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'asflown' has no attribute {name!r}")


def __dir__():
    return sorted(__all__)


if TYPE_CHECKING:
    from asflown.campaigns.budget import error_budget
    from asflown.craft.load import built_in_crafts, load_craft
    from asflown.craft.model import Craft
    from asflown.estimate.compare import compare_torques
    from asflown.estimate.density import density
    from asflown.estimate.density_result import DensityResult
    from asflown.estimate.external_result import ExternalTorque
    from asflown.estimate.external_torque import external_torque
    from asflown.estimate.gates_fit import fit_gates
    from asflown.estimate.gates_judge import judge_gates
    from asflown.estimate.gates_result import GatesFit
    from asflown.estimate.gates_watch import watch_maneuvers
    from asflown.estimate.inertia import inertia_tensor
    from asflown.estimate.inertia_result import InertiaResult
    from asflown.estimate.jets import jets
    from asflown.estimate.jets_result import JetsResult
    from asflown.estimate.leak import LeakWatch, leak
    from asflown.estimate.leak_result import LeakResult
    from asflown.estimate.result import TorqueResult
    from asflown.estimate.thrust import thrust
    from asflown.estimate.thrust_result import ThrustResult
    from asflown.estimate.torque import disturbance_torque
    from asflown.estimate.wheel_drag import wheel_drag
    from asflown.estimate.wheel_result import WheelsResult
    from asflown.kit.errors import BadInput
    from asflown.maneuvers.history import past_model
    from asflown.maneuvers.model import Gates
    from asflown.maneuvers.table import Maneuvers, load_maneuvers
    from asflown.maneuvers.write import write_maneuvers
    from asflown.sim.fly import fly, write_flight
    from asflown.sim.fly_mission import fly_mission
    from asflown.sim.mission import Mission, load_mission
    from asflown.sim.scenario import Scenario, load_scenario
    from asflown.telemetry.load import load_telemetry
    from asflown.telemetry.tables import write_table
    from asflown.telemetry.telemetry import Telemetry
    from asflown.trends.figures import figure_of_merit
    from asflown.trends.store import TrendStore
