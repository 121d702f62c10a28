"""Figures of execution errors: they are drawn, and their labels keep clear of each other."""

from dataclasses import replace

import numpy as np
import pytest

from asflown.estimate.gates.fit import fit_gates
from asflown.estimate.gates.judge import judge_gates
from asflown.estimate.gates.watch import watch_maneuvers
from asflown.maneuvers.history import past_model
from asflown.plots.figure import new_figure, save_figures
from asflown.plots.labels import label_points
from asflown.plots.maneuvers import degradation_figure, gates_figures, watch_figure
from asflown.sim.maneuver_sets import RCS_SET, a_branch, execute

RCS = past_model("rcs/2012-1").model


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
    fit = fit_gates(execute(RCS, replace(RCS_SET, count=count), 1))
    figures = gates_figures(fit, judge_gates(fit, draws=30))
    assert set(figures) >= {"magnitude", "pointing", "plane", "directions"} and ("distribution" in figures) == fit.known
    for path in save_figures(figures, tmp_path):
        text = path.read_text()
        assert text.startswith("<?xml") and ("dV [m/s]" in text or path.name == "distribution.svg")


def test_without_pointing_only_magnitudes_are_drawn(tmp_path):
    m = replace(execute(RCS, RCS_SET, 1), pointing_error_mps=None, pointing_covariance=None)
    fit = fit_gates(m)
    assert set(gates_figures(fit, judge_gates(fit, draws=30))) == {"magnitude", "distribution"}


@pytest.mark.parametrize("weaker", [0.1])
def test_degradation_is_drawn(weaker, tmp_path):
    m = a_branch(past_model("rcs/2008-01").model, weaker, 1)
    w = watch_maneuvers(m)
    paths = save_figures({"watch": watch_figure(w), "degradation": degradation_figure(w, m)}, tmp_path)
    assert ("up to OTM-169: alarm" in paths[1].read_text()) == (weaker > 0)


@pytest.mark.parametrize("count", [1, 12])
def test_burns_of_one_size_without_errors_are_drawn(count, tmp_path):
    m = execute(RCS, replace(RCS_SET, count=count), 1)
    m = replace(
        m, dv_mps=np.full(count, 0.1), magnitude_error_mps=np.zeros(count), pointing_error_mps=np.zeros((count, 2))
    )
    fit = fit_gates(replace(m, pointing_covariance=np.zeros((count, 2, 2)), sigma_magnitude_mps=np.zeros(count)))
    assert save_figures(gates_figures(fit, judge_gates(fit, draws=20)), tmp_path)
