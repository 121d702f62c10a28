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
    "TorqueResult": "asflown.estimate.torque",
    "compare_torques": "asflown.estimate.torque",
    "external_torque": "asflown.estimate.external",
    "ExternalTorqueResult": "asflown.estimate.external",
    "density": "asflown.estimate.density",
    "DensityResult": "asflown.estimate.density",
    "jets": "asflown.estimate.jets",
    "JetsResult": "asflown.estimate.jets",
    "leak": "asflown.estimate.leak",
    "LeakWatch": "asflown.estimate.leak",
    "LeakResult": "asflown.estimate.leak",
    "thrust": "asflown.estimate.thrust",
    "ThrustResult": "asflown.estimate.thrust",
    "wheel_drag": "asflown.estimate.wheels",
    "WheelsResult": "asflown.estimate.wheels",
    "inertia_tensor": "asflown.estimate.inertia",
    "InertiaResult": "asflown.estimate.inertia",
    "Scenario": "asflown.sim.scenario",
    "load_scenario": "asflown.sim.scenario",
    "fly": "asflown.sim.flight",
    "write_flight": "asflown.sim.flight",
    "figure_of_merit": "asflown.trends.entries",
    "TrendStore": "asflown.trends.store",
    "Mission": "asflown.sim.mission",
    "load_mission": "asflown.sim.mission",
    "fly_mission": "asflown.sim.mission",
    "error_budget": "asflown.campaigns.budget",
    "Gates": "asflown.maneuvers.model",
    "Maneuvers": "asflown.maneuvers.table",
    "load_maneuvers": "asflown.maneuvers.table",
    "write_maneuvers": "asflown.maneuvers.write",
    "past_model": "asflown.maneuvers.history",
    "fit_gates": "asflown.estimate.gates",
    "GatesFit": "asflown.estimate.gates",
    "judge_gates": "asflown.estimate.gates",
    "watch_maneuvers": "asflown.estimate.gates",
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
    from asflown.estimate.density import DensityResult, density
    from asflown.estimate.external import ExternalTorqueResult, external_torque
    from asflown.estimate.gates import GatesFit, fit_gates, judge_gates, watch_maneuvers
    from asflown.estimate.inertia import InertiaResult, inertia_tensor
    from asflown.estimate.jets import JetsResult, jets
    from asflown.estimate.leak import LeakResult, LeakWatch, leak
    from asflown.estimate.thrust import ThrustResult, thrust
    from asflown.estimate.torque import TorqueResult, compare_torques, disturbance_torque
    from asflown.estimate.wheels import WheelsResult, wheel_drag
    from asflown.kit.errors import BadInput
    from asflown.maneuvers.history import past_model
    from asflown.maneuvers.model import Gates
    from asflown.maneuvers.table import Maneuvers, load_maneuvers
    from asflown.maneuvers.write import write_maneuvers
    from asflown.sim.flight import fly, write_flight
    from asflown.sim.mission import Mission, fly_mission, load_mission
    from asflown.sim.scenario import Scenario, load_scenario
    from asflown.telemetry.load import load_telemetry
    from asflown.telemetry.tables import write_table
    from asflown.telemetry.telemetry import Telemetry
    from asflown.trends.entries import figure_of_merit
    from asflown.trends.store import TrendStore
