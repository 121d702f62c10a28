"""asflown: what a spacecraft really is in flight, from its own telemetry.

The public names load on first use, so that ``import asflown`` and ``asflown --help`` cost nothing.
"""

import warnings
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
    "write_table": "asflown.telemetry.write",
    "torque": "asflown.estimate.torque",
    "TorqueResult": "asflown.estimate.torque",
    "torque_comparison": "asflown.estimate.torque",
    "TorqueComparison": "asflown.estimate.torque",
    "Fused": "asflown.estimate.torque",
    "Momentum": "asflown.estimate.torque",
    "Transfer": "asflown.estimate.torque",
    "Polynomial": "asflown.estimate.torque",
    "OnTimes": "asflown.estimate.torque",
    "external_torque": "asflown.estimate.external",
    "ExternalTorqueResult": "asflown.estimate.external",
    "sources": "asflown.estimate.sources",
    "SourcesResult": "asflown.estimate.sources",
    "density": "asflown.estimate.density",
    "DensityResult": "asflown.estimate.density",
    "jets": "asflown.estimate.jets",
    "JetsResult": "asflown.estimate.jets",
    "Flyby": "asflown.dynamics.flyby",
    "Jet": "asflown.dynamics.plume",
    "Trajectory": "asflown.dynamics.trajectory",
    "leak": "asflown.estimate.leak",
    "LeakWatch": "asflown.estimate.leak",
    "LeakResult": "asflown.estimate.leak",
    "leak_known": "asflown.estimate.leak",
    "thrust": "asflown.estimate.thrust",
    "ThrustResult": "asflown.estimate.thrust",
    "thrust_priors": "asflown.estimate.firing",
    "Priors": "asflown.estimate.firing",
    "wheels": "asflown.estimate.wheels",
    "WheelsResult": "asflown.estimate.wheels",
    "inertia": "asflown.estimate.inertia",
    "InertiaResult": "asflown.estimate.inertia",
    "inertia_history": "asflown.estimate.inertia",
    "InertiaHistoryResult": "asflown.estimate.inertia",
    "slew_plan": "asflown.estimate.inertia",
    "SlewPlanResult": "asflown.estimate.inertia",
    "Scenario": "asflown.sim.scenario",
    "load_scenario": "asflown.sim.scenario",
    "fly": "asflown.sim.flight",
    "write_flight": "asflown.sim.flight",
    "figure_of_merit": "asflown.trends.entries",
    "TrendStore": "asflown.trends.store",
    "save_figure": "asflown.plots",
    "Mission": "asflown.sim.mission",
    "load_mission": "asflown.sim.mission",
    "fly_mission": "asflown.sim.mission",
    "error_budget": "asflown.campaigns.budget",
    "ErrorBudget": "asflown.campaigns.budget",
    "Gates": "asflown.maneuvers.model",
    "Maneuvers": "asflown.maneuvers.table",
    "load_maneuvers": "asflown.maneuvers.table",
    "write_maneuvers": "asflown.maneuvers.write",
    "past_model": "asflown.maneuvers.history",
    "gates_history": "asflown.maneuvers.history",
    "GatesHistoryResult": "asflown.maneuvers.history",
    "load_plan": "asflown.maneuvers.plan",
    "gates": "asflown.estimate.gates",
    "GatesResult": "asflown.estimate.gates",
    "gates_judgement": "asflown.estimate.gates",
    "GatesJudgement": "asflown.estimate.gates",
    "gates_patch": "asflown.estimate.gates",
    "GatesPatch": "asflown.estimate.gates",
    "gates_prediction": "asflown.estimate.gates",
    "GatesPredictionResult": "asflown.estimate.gates",
    "gates_watch": "asflown.estimate.gates",
    "GatesWatchResult": "asflown.estimate.gates",
}

__all__ = [*_PUBLIC, "__version__"]


#: Names of the last version, which still work and warn.
_RENAMED = {
    "disturbance_torque": "torque",
    "compare_torques": "torque_comparison",
    "ExternalTorque": "ExternalTorqueResult",
    "wheel_drag": "wheels",
    "inertia_tensor": "inertia",
    "fit_gates": "gates",
    "GatesFit": "GatesResult",
    "judge_gates": "gates_judgement",
    "watch_maneuvers": "gates_watch",
}


def __getattr__(name: str):
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    if name in _RENAMED:
        new = _RENAMED[name]
        warnings.warn(
            f"asflown.{name} is now asflown.{new}; the old name goes with the next version",
            DeprecationWarning,
            stacklevel=2,
        )
        return getattr(import_module(_PUBLIC[new]), new)
    raise AttributeError(f"module 'asflown' has no attribute {name!r}")


def __dir__():
    return sorted(__all__)


if TYPE_CHECKING:
    from asflown.campaigns.budget import ErrorBudget, error_budget
    from asflown.craft.load import built_in_crafts, load_craft
    from asflown.craft.model import Craft
    from asflown.dynamics.flyby import Flyby
    from asflown.dynamics.plume import Jet
    from asflown.dynamics.trajectory import Trajectory
    from asflown.estimate.density import DensityResult, density
    from asflown.estimate.external import ExternalTorqueResult, external_torque
    from asflown.estimate.firing import Priors, thrust_priors
    from asflown.estimate.gates import (
        GatesJudgement,
        GatesPatch,
        GatesPredictionResult,
        GatesResult,
        GatesWatchResult,
        gates,
        gates_judgement,
        gates_patch,
        gates_prediction,
        gates_watch,
    )
    from asflown.estimate.inertia import (
        InertiaHistoryResult,
        InertiaResult,
        SlewPlanResult,
        inertia,
        inertia_history,
        slew_plan,
    )
    from asflown.estimate.jets import JetsResult, jets
    from asflown.estimate.leak import LeakResult, LeakWatch, leak, leak_known
    from asflown.estimate.sources import SourcesResult, sources
    from asflown.estimate.thrust import ThrustResult, thrust
    from asflown.estimate.torque import (
        Fused,
        Momentum,
        OnTimes,
        Polynomial,
        TorqueComparison,
        TorqueResult,
        Transfer,
        torque,
        torque_comparison,
    )
    from asflown.estimate.wheels import WheelsResult, wheels
    from asflown.kit.errors import BadInput
    from asflown.maneuvers.history import GatesHistoryResult, gates_history, past_model
    from asflown.maneuvers.model import Gates
    from asflown.maneuvers.plan import load_plan
    from asflown.maneuvers.table import Maneuvers, load_maneuvers
    from asflown.maneuvers.write import write_maneuvers
    from asflown.plots import save_figure
    from asflown.sim.flight import fly, write_flight
    from asflown.sim.mission import Mission, fly_mission, load_mission
    from asflown.sim.scenario import Scenario, load_scenario
    from asflown.telemetry.load import load_telemetry
    from asflown.telemetry.telemetry import Telemetry
    from asflown.telemetry.write import write_table
    from asflown.trends.entries import figure_of_merit
    from asflown.trends.store import TrendStore
