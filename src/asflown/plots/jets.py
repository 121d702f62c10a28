"""The jets of a plume over the density reconstructed without them."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

from .density import SCALE, draw_density, finish
from .figure import GREEN, ORANGE, PURPLE, RED, SKY, new_figure, save

if TYPE_CHECKING:
    from ..estimate.jets import JetsResult

#: Colours of sources, again from the first where there are more.
OF_JETS = (GREEN, ORANGE, PURPLE, SKY, "black")


def draw_jets(result: JetsResult, ax):
    """Density of all jets together and of each, as in the plume paper's Figures 11 and 12.  Returns ax."""
    t = result.density.time_s
    draw_model(result, ax)
    for source, rho, color in zip(result.sources, result.each_kgm3, cycle(OF_JETS)):
        known = "" if source.density_known else " (not identified)"
        ax.plot(t, SCALE * rho, color=color, linewidth=1.0, label=source.jet.name + known)
    ax.set_ylabel("density [10⁻¹² kg/m³]")
    return ax


def draw_model(result: JetsResult, ax):
    """Density of all jets together.  Returns ax."""
    ax.plot(result.density.time_s, SCALE * result.model_kgm3, color=RED, linewidth=1.4, label="jets together")
    return ax


def save_jets_figure(result: JetsResult, path) -> None:
    """The jets' density over the one reconstructed; altitude along the top, doubts beneath."""
    figure, (ax,) = new_figure(1, height=4.4)
    draw_density(result.density, ax)
    draw_jets(result, ax)
    d = result.density
    finish(figure, ax, d, f"Jets met by {d.craft}, {d.flyby.name}: power {result.form.power:g}", result.doubts)
    save(figure, path)
