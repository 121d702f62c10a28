"""The set of figures of one flyby: geometry to scale, what the telemetry shows, torque, momentum, density, jets.

After the plume paper: geometry is its Figures 9 (from the pole) and 10, attitude and rate errors its 4, 5, A3, C2 and C3, body
rates A2, torque 6 and 8, momentum 7, components 11, model and reconstruction 12.  Time is from closest approach.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kit.doubts import Doubts
from .density import draw_density, draw_whole_density, finish, shown_s
from .figure import GREY, new_figure
from .flyby_geometry import draw_from_pole, draw_geometry
from .flyby_record import draw_momentum, draw_readings, draw_torque
from .jets import draw_jets, draw_model

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..dynamics.plume import Jet
    from ..estimate.density import DensityResult
    from ..estimate.jets import JetsResult
    from ..telemetry.telemetry import Telemetry

#: Family of channels -> file name, label, what one SI unit is in it.
_READINGS = {
    "attitude_error": ("attitude-error", "attitude error [mrad]", 1e3),
    "rate_error": ("rate-error", "rate error [10⁻⁵ rad/s]", 1e5),
    "body_rate": ("body-rate", "body rate [10⁻⁵ rad/s]", 1e5),
}


def flyby_figures(
    result: DensityResult,
    telemetry: Telemetry,
    jets: JetsResult | None = None,
    sources: Sequence[Jet] | None = None,
) -> dict:
    """Figures by file name; those whose channels or places are not known are left out.

    ``sources``: in place of the published ones; those of ``jets`` where they are fitted."""
    if jets is not None:
        sources = [s.jet for s in jets.sources]
    return _geometry(result, sources) | _over_time(result, telemetry) | _densities(result, jets)


def _geometry(result: DensityResult, sources: Sequence[Jet] | None) -> dict:
    figures = {}
    if result.flyby.latitude_south_rad is not None:
        figures["geometry"] = _alone(draw_geometry, result, sources, height=5.6, width=7.2)
    if result.flyby.longitude_west_rad is not None:
        figures["geometry-pole"] = _alone(draw_from_pole, result, sources, height=5.4, width=6.6)
    return figures


def _over_time(result: DensityResult, telemetry: Telemetry) -> dict:
    """Readings, torque, momentum."""
    figures, name = {}, result.flyby.name
    for stem, (file, label, scale) in _READINGS.items():
        if telemetry.has_axes(stem):
            figure, (ax,) = new_figure(1, height=3.4)
            draw_readings(telemetry, stem, result.closest_s, ax, scale)
            ax.set_ylabel(label)
            figures[file] = _timed(figure, ax, result, f"{label.split(' [')[0].capitalize()}, {name}")
    figure, (ax,) = new_figure(1, height=3.6)
    draw_torque(result, ax)
    figures["torque"] = _timed(figure, ax, result, f"Torque about {result.axis}, {name}")
    if result.momentum is not None:
        figure, (ax,) = new_figure(1, height=3.4)
        draw_momentum(result.momentum, result.axis, ax)
        figures["momentum"] = _timed(figure, ax, result, f"Momentum about {result.axis}, {name}")
    return figures


def _densities(result: DensityResult, jets: JetsResult | None) -> dict:
    """The density, and with jets their components and their sum over it."""
    figures, name = {}, result.flyby.name
    figures["density"], (ax,) = new_figure(1, height=4.0)
    draw_whole_density(result, ax)
    finish(figures["density"], ax, result, f"Density, {name}", result.doubts)
    if jets is not None:
        figures["components"], (ax,) = new_figure(1, height=4.0)
        draw_jets(jets, ax)
        title = f"Jets and their sum, {name}: power {jets.form.power:g}"
        finish(figures["components"], ax, result, title, jets.doubts)
        figures["model"], (ax,) = new_figure(1, height=4.0)
        draw_model(jets, draw_density(result, ax))
        finish(figures["model"], ax, result, f"Density reconstructed and of the jets, {name}", Doubts())
    return figures


def _alone(draw, result: DensityResult, sources, **size):
    figure, (ax,) = new_figure(1, **size)
    draw(result, ax, sources)
    return figure


def _timed(figure, ax, result: DensityResult, title: str):
    low, high = shown_s(result)
    if high > low:
        ax.set_xlim(low, high)
        _fit_height(ax, low, high)
    ax.axvline(0, color=GREY, linewidth=0.6, linestyle=":")
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set_xlabel(f"time from closest approach, {result.closest_approach} [s]")
    ax.set_title(title, loc="left", fontsize=11)
    ax.legend(frameon=False, fontsize=8, ncols=3)
    return figure


def _fit_height(ax, low: float, high: float) -> None:
    """What lies outside the span shown does not set the scale; bands count as lines do."""
    drawn = [np.column_stack([np.asarray(v, float) for v in line.get_data()]) for line in ax.lines]
    drawn += [path.vertices for band in ax.collections for path in band.get_paths()]
    seen = np.concatenate([xy[(xy[:, 0] >= low) & (xy[:, 0] <= high), 1] for xy in drawn])
    seen = seen[np.isfinite(seen)]
    if len(seen) and np.ptp(seen) > 0:
        ax.set_ylim(seen.min() - 0.12 * np.ptp(seen), seen.max() + 0.22 * np.ptp(seen))
