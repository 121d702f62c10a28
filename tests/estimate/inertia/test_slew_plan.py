"""The next slew: laws of its information, limits of the wheels, and what the plan's sigmas are worth."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asflown.craft.load import load_craft
from asflown.dynamics.rigid_body import ELEMENTS, elements_of
from asflown.estimate.inertia import plan as doubt
from asflown.estimate.inertia.plan import momentum_noise, slew_plan
from asflown.kit.errors import BadInput
from asflown.kit.timeline import utc_to_tai_ns
from asflown.sim.flight.closed_loop import fly
from asflown.telemetry.attitude import together
from cli.program import run
from conftest import flight_data

CASSINI = load_craft("cassini", inertia=(7362, 6130, 3750, -164, -12, 149))
DATE = "2005-02-09T00:00:00"
NOW = CASSINI.at(int(utc_to_tai_ns(DATE)))
RPM = 2 * np.pi / 60


def test_nothing_flown_starts_from_the_requirement():
    plan = slew_plan(CASSINI, date=DATE)
    assert plan.rank_before == 0 and plan.best.rank == 3 and not plan.best.limited
    assert plan.inertia_sigma_before_kgm2 == pytest.approx(
        [736.2, 75, 75, 613.0, 75, 375.0], rel=0.005
    )  # 10 %, 75 kg m2
    assert plan.best.gain == max(o.gain for o in plan.turns)
    assert plan.best.duration_s == pytest.approx(np.radians(25) / 2e-3 + 100)


@pytest.mark.parametrize("stop, axis, rank", [(1160, 2, 6), (600, None, 5)])
def test_recovery_what_has_been_flown_decides(stop, axis, rank):
    plan = slew_plan(CASSINI, fly("slews").telemetry.between(0, stop))
    assert plan.rate_sigma_rad_s == pytest.approx(2e-6, rel=0.25)
    assert plan.best.rank == rank and plan.rank_before < rank
    if axis is None:
        assert abs(plan.best.axis[0]) < 0.1  # x has been flown
    else:
        assert abs(plan.best.axis[axis]) > 0.98
    assert (plan.best.inertia_sigma_kgm2 <= plan.inertia_sigma_before_kgm2 * (1 + 1e-9)).all()


def test_law_the_sigmas_are_those_with_the_start_momentum_unknown():
    """Set against all rows with the start momentum as three more unknowns, turned into the body at each instant."""
    plan = slew_plan(CASSINI, date=DATE)
    noise = plan.momentum_sigma_Nms
    for o in plan.turns:
        t = np.arange(-60.0, o.duration_s + 60, 4.0)
        r = np.clip(2e-5 * np.minimum(t, o.duration_s - t), 0, 2e-3)
        back = Rotation.from_rotvec(-np.outer(np.cumsum(r) * 4.0, o.axis)).as_matrix()
        rows = np.concatenate([
            np.hstack([_row_of(rate * o.axis), -R]) / noise[:, None] for rate, R in zip(r, back, strict=True)
        ])  # fmt: skip
        whole = rows.T @ rows
        exact = whole[:6, :6] - whole[:6, 6:] @ np.linalg.solve(whole[6:, 6:], whole[6:, :6])
        bound = np.sqrt(np.diag(np.linalg.inv(np.diag(plan.inertia_sigma_before_kgm2**-2.0) + exact)))
        assert (o.inertia_sigma_kgm2 > 0.98 * bound).all() and (o.inertia_sigma_kgm2 < 1.07 * bound).all()


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
    free = slew_plan(CASSINI, date=DATE)
    full = slew_plan(CASSINI, date=DATE, wheel_rates_rad_s=RPM * np.array([1700, -1700, 1500]))
    assert full.best.gain <= free.best.gain
    assert any(o.limited for o in full.turns) or full.doubts.has(doubt.NO_TURN_ABOUT)
    fast = slew_plan(CASSINI, date=DATE, rate_rad_s=20e-3, acceleration_rad_s2=1e-2).best
    assert fast.limited and 2e-3 < fast.rate_rad_s < 20e-3
    assert slew_plan(CASSINI, date=DATE, angle_rad=0.02).best.rate_rad_s == pytest.approx(
        np.sqrt(0.02 * 2e-5)
    )  # no coast
    weak = [w.model_copy(update={"torque_limit": 0.02}) for w in CASSINI.wheels]
    held = slew_plan(CASSINI.model_copy(update={"wheels": tuple(weak)}), date=DATE)
    assert held.best.limited and not held.doubts.has(doubt.LIMIT_UNKNOWN)
    assert free.doubts.of(doubt.LIMIT_UNKNOWN).about(limit="torque limit")
    with pytest.raises(BadInput, match="however slow"):
        slew_plan(CASSINI, date=DATE, angle_rad=np.radians(170), wheel_rates_rad_s=RPM * np.array([2015, -2015, 2015]))


def test_recovery_a_flight_as_planned_meets_the_speed_of_the_wheels():
    """What the plan allows at a wheel's limit, the simulator can fly."""
    rates = RPM * np.array([1200, -900, 1000])
    o = slew_plan(CASSINI, date=DATE, wheel_rates_rad_s=rates, rate_rad_s=4e-3, acceleration_rad_s2=4e-5).best
    text = " ".join(f"{v:.12f}" for v in o.axis / np.linalg.norm(o.axis))
    flight = fly(
        "slews",
        craft=CASSINI,
        changes={
            "duration": "600 s",
            "wheel_rates": dict(zip(("RWA1", "RWA2", "RWA4"), map("{} rad/s".format, rates), strict=True)),
            "slews": [
                {
                    "start": "60 s",
                    "axis": text,
                    "angle": "25 deg",
                    "rate": f"{o.rate_rad_s} rad/s",
                    "acceleration": f"{o.acceleration_rad_s2} rad/s2",
                }
            ],
        },
    )
    assert flight.ended == "reached 600 s"
    w = together(flight.telemetry, [f"body_rate_{a}" for a in "xyz"])[1]
    assert np.abs(w @ o.axis).max() == pytest.approx(o.rate_rad_s, rel=0.01)


def test_bad_input():
    for wrong in (
        {"angle_rad": 0.0},
        {"rate_rad_s": -1.0},
        {"acceleration_rad_s2": np.nan},
        {"wheel_rates_rad_s": [1.0]},
    ):
        with pytest.raises(BadInput):
            slew_plan(CASSINI, date=DATE, **wrong)
    unknown = CASSINI.model_copy(update={"mass_properties": ()})
    with pytest.raises(BadInput, match="not known"):
        slew_plan(unknown)


def test_ratios_only_and_a_craft_without_wheels():
    ratios = slew_plan(load_craft("inspiresat1"))
    assert (
        ratios.relative
        and ratios.record()["unit"] == "per spin inertia"
        and ratios.record()["momentum_sigma_Nms"] is None
    )
    assert elements_of(ratios.inertia_kgm2)[[0, 3, 5]] == pytest.approx([4100, 5300, 5000])
    assert ratios.doubts.has(doubt.RATIOS_ONLY)
    with pytest.raises(BadInput, match="no wheels"):
        slew_plan(load_craft("iss"))


def test_the_verb():
    record = run("inertia", "plan", "--craft", "cassini", "--at", "2005-02-09", "--json").record
    assert (
        record["command"] == "inertia plan"
        and record["criterion"] == "D-optimal"
        and set(record["best"]["sigma"]) == set(ELEMENTS)
    )
    file, inertia = flight_data("simulated/slew.csv.gz"), "7362,6130,3750,-164,-12,149"
    said = run("inertia", "plan", file, "--craft", "cassini", "--stop", "540", "--inertia", inertia).out
    assert "rank so far 3" in said and "DOUBT" in said and "Ixx" in said
