"""The next slew: laws of its information, limits of the wheels, and what the plan's sigmas are worth."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asflown.cli.inertia_plan import plan as verb
from asflown.craft.load import load_craft
from asflown.dynamics.rigid_body import ELEMENTS, elements_of
from asflown.estimate.inertia.plan import momentum_noise, plan_slew, what_was_flown
from asflown.kit.errors import BadInput
from asflown.kit.timeline import utc_to_tai_ns
from asflown.sim.flight.closed_loop import fly
from asflown.telemetry.attitude import together
from asflown.telemetry.load import load_telemetry
from cli.program import strict_json
from conftest import flight_data

CASSINI = load_craft("cassini", inertia=(7362, 6130, 3750, -164, -12, 149))
NOW = CASSINI.at(int(utc_to_tai_ns("2005-02-09T00:00:00")))
RPM = 2 * np.pi / 60


def test_nothing_flown_starts_from_the_requirement():
    plan = plan_slew(NOW)
    assert plan.rank_before == 0 and plan.best.rank == 3 and not plan.best.limited
    assert plan.sigma_before == pytest.approx([736.2, 75, 75, 613.0, 75, 375.0], rel=0.005)  # 10 %, 75 kg m2
    assert plan.best.gain == max(o.gain for o in plan.options)
    assert plan.best.duration_s == pytest.approx(np.radians(25) / 2e-3 + 100)


@pytest.mark.parametrize("stop, axis, rank", [(1160, 2, 6), (600, None, 5)])
def test_recovery_what_has_been_flown_decides(stop, axis, rank):
    now, flown = what_was_flown(fly("slews").telemetry.between(0, stop), CASSINI)
    assert flown["rate_sigma"] == pytest.approx(2e-6, rel=0.25)
    plan = plan_slew(now, **flown)
    assert plan.best.rank == rank and plan.rank_before < rank
    if axis is None:
        assert abs(plan.best.axis[0]) < 0.1  # x has been flown
    else:
        assert abs(plan.best.axis[axis]) > 0.98
    assert (plan.best.sigma <= plan.sigma_before * (1 + 1e-9)).all()


def test_law_the_sigmas_are_those_with_the_start_momentum_unknown():
    """Set against all rows with the start momentum as three more unknowns, turned into the body at each instant."""
    plan = plan_slew(NOW)
    noise = plan.momentum_sigma
    for o in plan.options:
        t = np.arange(-60.0, o.duration_s + 60, 4.0)
        r = np.clip(2e-5 * np.minimum(t, o.duration_s - t), 0, 2e-3)
        back = Rotation.from_rotvec(-np.outer(np.cumsum(r) * 4.0, o.axis)).as_matrix()
        rows = np.concatenate([
            np.hstack([_row_of(rate * o.axis), -R]) / noise[:, None] for rate, R in zip(r, back, strict=True)
        ])  # fmt: skip
        whole = rows.T @ rows
        exact = whole[:6, :6] - whole[:6, 6:] @ np.linalg.solve(whole[6:, 6:], whole[6:, :6])
        bound = np.sqrt(np.diag(np.linalg.inv(np.diag(plan.sigma_before**-2.0) + exact)))
        assert (o.sigma > 0.98 * bound).all() and (o.sigma < 1.07 * bound).all()


def _row_of(w):
    x, y, z = w
    return np.array([[x, y, z, 0, 0, 0], [0, x, 0, y, z, 0], [0, 0, x, 0, y, z]])


def test_law_noise_of_the_momentum_is_that_of_its_parts():
    rng = np.random.default_rng(1)
    axes = np.array([w.axis for w in NOW.wheels])
    spin = np.array([w.spin_inertia for w in NOW.wheels])
    h = (
        2e-6 * rng.standard_normal((20000, 3)) @ NOW.inertia_kgm2
        + (0.005 * rng.standard_normal((20000, 3)) * spin) @ axes
    )
    assert momentum_noise(NOW.inertia_kgm2, NOW.wheels, 2e-6, 0.005) == pytest.approx(h.std(axis=0), rel=0.03)


def test_wheels_near_their_limits_turn_the_craft_slower_or_not_at_all():
    free, full = plan_slew(NOW), plan_slew(NOW, wheel_rates=RPM * np.array([1700, -1700, 1500]))
    assert full.best.gain <= free.best.gain
    assert any(o.limited for o in full.options) or any("however slow" in d for d in full.doubts)
    fast = plan_slew(NOW, rate=20e-3, acceleration=1e-2).best
    assert fast.limited and 2e-3 < fast.rate < 20e-3
    assert plan_slew(NOW, angle=0.02).best.rate == pytest.approx(np.sqrt(0.02 * 2e-5))  # no coast
    weak = [w.model_copy(update={"torque_limit": 0.02}) for w in CASSINI.wheels]
    held = plan_slew(CASSINI.model_copy(update={"wheels": tuple(weak)}).at(NOW.tai_ns))
    assert held.best.limited and not any("torque limit" in d for d in held.doubts)
    assert any("torque limit" in d for d in free.doubts)
    with pytest.raises(BadInput, match="however slow"):
        plan_slew(NOW, angle=np.radians(170), wheel_rates=RPM * np.array([2015, -2015, 2015]))


def test_recovery_a_flight_as_planned_meets_the_speed_of_the_wheels():
    """What the plan allows at a wheel's limit, the simulator can fly."""
    rates = RPM * np.array([1200, -900, 1000])
    o = plan_slew(NOW, wheel_rates=rates, rate=4e-3, acceleration=4e-5).best
    text = " ".join(f"{v:.12f}" for v in o.axis / np.linalg.norm(o.axis))
    flight = fly(
        "slews", craft=CASSINI, duration="600 s", wheel_rates=dict(zip(("RWA1", "RWA2", "RWA4"), map("{} rad/s".format, rates), strict=True)),
        slews=[{"start": "60 s", "axis": text, "angle": "25 deg", "rate": f"{o.rate} rad/s", "acceleration": f"{o.acceleration} rad/s2"}],
    )  # fmt: skip
    assert flight.ended == "reached 600 s"
    w = together(flight.telemetry, [f"body_rate_{a}" for a in "xyz"])[1]
    assert np.abs(w @ o.axis).max() == pytest.approx(o.rate, rel=0.01)


def test_bad_input():
    for wrong in ({"angle": 0.0}, {"rate": -1.0}, {"acceleration": np.nan}, {"wheel_rates": [1.0]}):
        with pytest.raises(BadInput):
            plan_slew(NOW, **wrong)
    unknown = CASSINI.model_copy(update={"mass_properties": ()})
    with pytest.raises(BadInput, match="not known"):
        plan_slew(unknown.at(None))


def test_ratios_only_and_a_craft_without_wheels():
    ratios = plan_slew(load_craft("inspiresat1").at(None))
    assert (
        ratios.relative
        and ratios.record()["unit"] == "per spin inertia"
        and ratios.record()["momentum_sigma_Nms"] is None
    )
    assert elements_of(ratios.inertia)[[0, 3, 5]] == pytest.approx([4100, 5300, 5000])
    assert any("1 % of the mean moment" in d for d in ratios.doubts)
    assert any("rate limit" in d for d in plan_slew(load_craft("iss").at(None)).doubts)


def test_the_verb(tmp_path, capsys):
    verb(None, "cassini", "25 deg", "2 mrad/s", "2e-5 rad/s2", "2005-02-09", None, None, None, None, None, True)
    record = strict_json(capsys.readouterr().out)
    assert (
        record["command"] == "inertia plan"
        and record["criterion"] == "D-optimal"
        and set(record["best"]["sigma"]) == set(ELEMENTS)
    )
    file = flight_data("simulated/slew.csv.gz")
    inertia = "7362,6130,3750,-164,-12,149"
    verb(file, "cassini", "25 deg", "2 mrad/s", "2e-5 rad/s2", None, None, "540", None, None, inertia, False)
    said = capsys.readouterr().out
    assert "rank so far 3" in said and "DOUBT" in said and "Ixx" in said
    assert load_telemetry(file) is not None
