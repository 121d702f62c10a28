"""Figures of merit: exact on torques made for it, with sigmas that hold, and a user's own beside them."""

import numpy as np
import pytest

from asflown import fly
from asflown.kit.errors import BadInput
from asflown.trends.entries.actuation import analyse
from asflown.trends.entries.events import Event
from asflown.trends.entries.figures import FIGURES, ONE_EXCURSION, Torque, figure_of_merit, load_figures, measure
from flights import CASSINI

TIME = np.arange(-60.0, 361.0)
EVENT = Event("e", "deploy", "2015-09-29T00:00:00", None, 60.0, 420.0)


def swings(heights, first=100.0, rise=10.0):
    """Triangles of these heights, one after the other."""
    t = first + rise * np.arange(2 * len(heights) + 1)
    v = np.zeros(len(t))
    v[1::2] = heights
    return np.interp(TIME, t, v)


def test_law_impulse_of_lines_is_exact():
    torque = Torque(TIME, np.interp(TIME, [0, 40, 80], [0, -0.004, 0.0]))
    assert torque.impulse(0.0, 81.0).value == pytest.approx(-0.16, rel=1e-12)
    assert torque.impulse(0.25, 0.75).value == pytest.approx(-0.5e-4 * (0.75**2 - 0.25**2), rel=1e-9)
    assert torque.impulse(0.0, 81.0).sigma is None
    beyond = torque.impulse(0.0, 500.0)
    assert beyond.value is None and "does not cover 0 to 500 s" in beyond.doubt


def test_law_peaks_are_the_two_largest_of_each_sign():
    torque = Torque(TIME, swings([0.010, -0.008, 0.012, -0.006, 0.004, -0.003]))
    assert measure(FIGURES["peak_positive"], torque, "fused")[0].value == pytest.approx(0.011)
    assert measure(FIGURES["peak_negative"], torque, "fused")[0].value == pytest.approx(-0.007)
    assert measure(FIGURES["time_of_peak_positive"], torque, "fused")[0].value == 150.0
    one, doubt = measure(FIGURES["peak_positive"], Torque(TIME, swings([0.010])), "fused")
    assert one.value == pytest.approx(0.010) and doubt.kind == ONE_EXCURSION
    assert measure(FIGURES["peak_negative"], Torque(TIME, swings([0.010])), "fused")[0].value is None


def test_law_sigma_is_that_of_the_draws():
    rng = np.random.default_rng(1)
    mean = swings([0.010, -0.008, 0.012, -0.006])
    size = 1 + 0.05 * rng.standard_normal(4000)
    torque = Torque(TIME, mean, TIME, size[:, None] * mean)
    peak = measure(FIGURES["peak_positive"], torque, "fused")[0]
    assert peak.sigma == pytest.approx(0.05 * 0.011, rel=0.05)
    momentum = measure(FIGURES["peak_momentum"], torque, "fused")[0]
    assert momentum.value == pytest.approx(0.14, rel=0.02) and momentum.sigma == pytest.approx(0.05 * 0.14, rel=0.05)


def test_law_a_start_known_badly_widens_the_impulse():
    mean = np.full_like(TIME, 0.002) * (TIME > 40)
    sure, unsure = (Torque(TIME, mean, TIME, np.tile(mean, (50, 1)), s).impulse(0, 81).sigma for s in (0.0, 10.0))
    assert sure == 0 and unsure == pytest.approx(0.02)


@pytest.mark.parametrize("kind", ["deploy", "stow"])
def test_recovery_figures_of_a_flown_actuation(kind):
    flight = fly(f"cover-{kind}", seed=11)
    entry = analyse(Event("e", kind, None, None, 60.0, 420.0), CASSINI, flight.telemetry)
    truth = Torque(flight.truth.time_s - 60, flight.truth.torque_Nm[:, 1])
    for name in ("angular_impulse", "peak_positive", "peak_negative", "peak_momentum", "net_impulse"):
        v, true = entry.value(name, "fused"), measure(FIGURES[name], truth, "truth")[0].value
        assert abs(v.value - true) < 4 * v.sigma, name
    assert entry.value("net_impulse", "fused").sigma < 0.01  # N m s
    assert entry.value("end_angle", "telemetry").value == pytest.approx(
        np.radians(179.2 if kind == "deploy" else 32.75)
    )
    assert entry.value("microswitch", "telemetry").value == 1
    assert entry.value("run_current", "telemetry").value == pytest.approx(0.10)
    assert entry.value("stall_current", "telemetry").value == pytest.approx(0.16)
    assert entry.date.endswith("T00:01:00") and entry.curve("motor_current") is not None
    printed = entry.value("angular_impulse", "momentum, printed")
    assert printed.sigma is None and printed.value != entry.value("angular_impulse", "fused").value


def test_an_event_outside_its_telemetry_is_refused():
    telemetry = fly("cover-deploy", noise="none").telemetry
    with pytest.raises(BadInput, match="the motor runs from 60 to 4200 s"):
        analyse(Event("e", "deploy", None, None, 60.0, 4200.0), CASSINI, telemetry)


def test_a_users_figure_is_computed_beside_the_shipped(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        "from asflown import figure_of_merit\n\n"
        '@figure_of_merit("N m s")\n'
        "def late_impulse(torque):\n"
        '    """Area under the torque from minute 1.35 to 3."""\n'
        "    return torque.impulse(81.0, 180.0)\n"
    )
    try:
        load_figures(path)
        value, _ = measure(FIGURES["late_impulse"], Torque(TIME, swings([0.010])), "fused")
        assert value.value == pytest.approx(0.1) and value.unit == "N m s"
    finally:
        FIGURES.pop("late_impulse", None)
    path.write_text("import nothing_of_this_name\n")
    with pytest.raises(BadInput, match="does not run"):
        load_figures(path)
    with pytest.raises(TypeError, match="one argument"):
        figure_of_merit("N m")(lambda a, b: None)
