"""Figures of execution errors: they are drawn, and their labels keep clear of each other."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.estimate.gates import gates, gates_judgement, gates_watch
from asflown.maneuvers.history import past_model
from asflown.plots.figure import new_figure, save_figures
from asflown.plots.gates import gates_figures
from asflown.plots.gates_watch import watch_figures
from asflown.plots.labels import label_points
from asflown.sim.maneuver_sets import RCS_SET, a_branch, execute

RCS = past_model("rcs/2012-1").model


def judged(m):
    """A fit with its judgement."""
    fit = gates(m)
    return fit.with_judgement(gates_judgement(fit, draws=30))


def test_labels_do_not_collide():
    rng = np.random.default_rng(1)
    x, y = rng.lognormal(0, 1, 25), rng.normal(size=25)
    figure, (ax,) = new_figure(1, 1, height=4.2)
    ax.set_xscale("log")
    ax.plot(x, y, "o", ms=4)
    label_points(ax, x[:15], y[:15], [f"OTM-{k}" for k in range(15)], avoid=(x, y))
    figure.draw_without_rendering()
    boxes = [t.get_window_extent() for t in ax.texts]
    assert len(boxes) == 15
    assert not [1 for k, a in enumerate(boxes) for b in boxes[:k] if a.overlaps(b)]


@pytest.mark.parametrize("count", [3, 49])
def test_every_figure_is_drawn(count, tmp_path):
    fit = judged(execute(RCS, replace(RCS_SET, count=count), 1))
    figures = gates_figures(fit)
    assert set(figures) >= {"magnitude", "pointing", "plane", "directions"} and ("distribution" in figures) == fit.known
    for path in save_figures(figures, tmp_path):
        text = path.read_text()
        assert text.startswith("<?xml") and ("dV [m/s]" in text or path.name == "distribution.svg")


def test_without_pointing_only_magnitudes_are_drawn(tmp_path):
    m = replace(execute(RCS, RCS_SET, 1), pointing_error_mps=None, pointing_covariance=None)
    fit = judged(m)
    assert set(gates_figures(fit)) == {"magnitude", "distribution"}


@pytest.mark.parametrize("weaker", [0.1])
def test_degradation_is_drawn(weaker, tmp_path):
    m = a_branch(past_model("rcs/2008-01").model, weaker, 1)
    paths = save_figures(watch_figures(gates_watch(m)), tmp_path)
    assert ("up to OTM-169: alarm" in paths[1].read_text()) == (weaker > 0)


@pytest.mark.parametrize("count", [1, 12])
def test_burns_of_one_size_without_errors_are_drawn(count, tmp_path):
    m = execute(RCS, replace(RCS_SET, count=count), 1)
    m = replace(
        m, dv_mps=np.full(count, 0.1), magnitude_error_mps=np.zeros(count), pointing_error_mps=np.zeros((count, 2))
    )
    fit = judged(replace(m, pointing_covariance=np.zeros((count, 2, 2)), sigma_magnitude_mps=np.zeros(count)))
    assert save_figures(gates_figures(fit), tmp_path)
