"""Pictures of results.  Each result's file draws into axes it is given; this registry says which file that is.

A plot computes nothing: results carry the numbers.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

#: Result -> (module, function that draws its main panel into axes, function that saves the whole figure).
_DRAWN = {
    "ExternalTorqueResult": ("external_torque", "draw_external_torque", "save_external_torque_figure"),
    "TorqueResult": ("torque", "draw_torque", "save_torque_figure"),
    "SourcesResult": ("sources", "draw_sources", "save_sources_figure"),
    "DensityResult": ("density", "draw_density", "save_density_figure"),
    "JetsResult": ("jets", "draw_jets", "save_jets_figure"),
    "InertiaResult": ("inertia", "draw_inertia", "save_inertia_figure"),
    "WheelsResult": ("wheels", "draw_wheels", "save_wheels_figure"),
    "ThrustResult": ("thrust", "draw_thrust", "save_thrust_figure"),
    "LeakResult": ("leak", "draw_leak", "save_leak_figure"),
    "GatesResult": ("gates", "draw_gates", "save_gates_figure"),
    "GatesWatchResult": ("gates_watch", "draw_watch", "save_watch_figure"),
}


def draw(result, ax=None):
    """Draw a result's main panel into ``ax``, or into new axes, and return them.  Raises TypeError for what has no picture."""
    module, function, _ = _of(result)
    from .figure import as_written, new_figure

    ax = new_figure()[1][0] if ax is None else ax
    drawn = getattr(import_module(f".{module}", __name__), function)(result, ax)
    as_written(ax)
    return drawn


def save_figure(result, path: str | Path) -> None:
    """The result's whole figure into a file: SVG, PNG or PDF by its suffix, with its doubts beneath."""
    module, _, function = _of(result)
    getattr(import_module(f".{module}", __name__), function)(result, path)


def _of(result) -> tuple[str, str, str]:
    name = type(result).__name__
    if name not in _DRAWN:
        raise TypeError(f"there is no picture of {name}")
    return _DRAWN[name]
