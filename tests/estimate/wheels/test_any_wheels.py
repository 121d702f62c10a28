"""Any number of wheels: followers in the null space, named spans, motor current, and what a trend makes of them."""

from functools import cache

import numpy as np
import pytest

from asflown.craft.model import Wheel
from asflown.estimate.wheels import wheels
from asflown.estimate.wheels.doubts import (
    FOLLOWS,
    FOUND_BY_SHAPE,
    MANY_COAST,
    MISFIT,
    NAMED_BUT_DRIVEN,
    NONE_LISTED_HERE,
    TOO_MANY_NAMED,
    TORQUE_SCALE,
    TORQUE_ZERO,
)
from asflown.estimate.wheels.motor import ZERO_SHARE
from asflown.estimate.wheels.named import NamedRunDown, named_run_downs
from asflown.kit.errors import BadInput
from asflown.trends.entries.wheels import wheel_entry
from asflown.trends.entry import Entry, Value
from asflown.trends.verdicts import DOUBTED, judge
from cli.program import complaint, run
from flights import CASSINI, telemetry_of
from leo import DAYS, flown_day, run_downs, said, table, wheel_craft, wheel_craft_file

WAYS = ("current", "shape", "named")


def spans(day: int) -> tuple[str, ...]:
    return tuple(f"RW{k}:{a:g}-{b:g}" for k, (a, b) in enumerate(said(run_downs(day))["truth"]["coasting_s"], start=1))


@cache
def found(day: int, way: str):
    return wheels(flown_day(day, way != "shape"), wheel_craft(), run_down=spans(day) if way == "named" else ())


@pytest.mark.parametrize("way", WAYS)
def test_recovery_of_every_wheels_drag_on_a_craft_with_four(way):
    pulls = []
    for day in DAYS:
        told, result = said(run_downs(day))["truth"], found(day, way)
        for k, w in enumerate(result.wheels):
            (r,) = w.run_downs
            assert (w.fit.basis, r.found_by) == ("run-down", way)
            assert told["coasting_s"][k][0] <= r.start_s < r.stop_s <= told["coasting_s"][k][1]
            c, v = told["coulomb_Nm"][k], told["viscous_Nms"][k]
            pulls.append(((w.fit.coulomb_Nm - c) / w.fit.coulomb_sigma_Nm, (w.fit.viscous_Nms - v) / w.fit.viscous_sigma_Nms))  # fmt: skip
        assert result.doubts.has(FOUND_BY_SHAPE) == (way == "shape") and not result.doubts.has(MISFIT)
    assert np.mean(np.abs(pulls) < 1.96) >= 0.9 and np.abs(pulls).max() < 3


def test_recovery_of_drag_from_motor_current_in_the_loop():
    pulls = []
    for day in DAYS:
        told = said(run_downs(day))["truth"]
        for k, w in enumerate(found(day, "current").wheels):
            f = w.fits[1]
            assert f.basis == "motor current" and f.separable
            pulls.append(((f.coulomb_Nm - told["coulomb_Nm"][k]) / f.coulomb_sigma_Nm, (f.viscous_Nms - told["viscous_Nms"][k]) / f.viscous_sigma_Nms))  # fmt: skip
    assert np.mean(np.abs(pulls) < 1.96) >= 0.88 and np.abs(pulls).max() < 4


@pytest.mark.parametrize("way", WAYS)
def test_recovery_of_a_month_in_which_one_wheel_ages(way):
    entries = [
        wheel_entry(found(d, way), flown_day(d, way != "shape"), wheel_craft(), guesses=way == "shape") for d in DAYS
    ]
    health = judge(entries, kind="wheels")
    grown = health.figure("coulomb_drag_RW3")
    low, high = grown.trend.change_percent_ci95
    assert low < 25 < high and grown.verdict == "watch"
    assert {f.figure for f in health.figures if f.verdict != "pass"} == {"coulomb_drag_RW3"}


# ---- motors of a craft made up here --------------------------------------------------------------------------


def driven(seed, *, current=True, constant=0.05, J=0.02, coulomb=0.002, viscous=2e-5, bias=0.0):
    """A wheel in a loop that works hard: its torque changes within a sample, and the rate and current are noisy."""
    rng = np.random.default_rng(seed)
    step, every = 0.25, 4
    t = np.arange(0.0, 1200.0, step)
    torque = 0.008 * np.sin(t / 60) + 0.002 * rng.standard_normal(len(t)) + coulomb + viscous * 100
    w = np.empty(len(t))
    w[0] = 100.0
    for k in range(1, len(t)):
        w[k] = w[k - 1] + step / J * (torque[k - 1] - coulomb * np.sign(w[k - 1]) - viscous * w[k - 1])
    t, w, torque = t[::every], w[::every], torque[::every] + bias
    w = w + 0.005 * rng.standard_normal(len(t))
    channel = {"wheel_current_RWA1": (t, torque / constant + 1e-3 * rng.standard_normal(len(t)))}
    return telemetry_of(wheel_rate_RWA1=(t, w), **(channel if current else {"wheel_torque_RWA1": (t, torque)}))


def one_wheel(J=0.02, constant=0.05):
    axis = CASSINI.wheels[0].axis
    return CASSINI.model_copy(
        update={
            "wheels": (
                CASSINI.wheels[0].model_copy(update={"spin_inertia": J, "axis": axis, "torque_constant": constant}),
            )
        }
    )


@pytest.mark.parametrize("current", [True, False])
def test_recovery_pulls_of_motor_torque_are_unit_normal(current):
    pulls = []
    for seed in range(30):
        bias = ZERO_SHARE * 0.018 * np.random.default_rng(seed).standard_normal()  # N m, of the largest torque
        f = wheels(driven(seed, current=current, bias=bias), one_wheel()).wheel("RWA1").fit
        assert f.basis == ("motor current" if current else "wheel command")
        total = 0.002 + 2e-5 * f.mean_rate_rad_s
        pulls.append(((f.coulomb_Nm - 0.002) / f.coulomb_sigma_Nm, (f.viscous_Nms - 2e-5) / f.viscous_sigma_Nms, (f.drag_at_mean_Nm - total) / f.drag_at_mean_sigma_Nm))  # fmt: skip
    assert np.abs(np.mean(pulls, axis=0)).max() < 0.7 and np.std(pulls) < 1.4 and np.abs(pulls).max() < 4


def test_a_wrong_torque_constant_is_doubted():
    result = wheels(driven(1), one_wheel(constant=0.06))
    assert result.doubts.about(wheel="RWA1").has(TORQUE_SCALE)
    assert not wheels(driven(1), one_wheel()).doubts.has(TORQUE_SCALE)
    assert wheels(driven(1), one_wheel()).doubts.has(TORQUE_ZERO)


def four(noise):
    """One of four wheels coasts, and the others follow exactly but for what the controller adds."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 400.0, 1.0)
    J, c, v = 0.01, 0.001, 1e-5
    u = (150 + c / v) * np.exp(-v * t / J) - c / v
    way = np.array([1, -1, 1, -1])
    channels = {}
    for k in range(4):
        wander = np.convolve(rng.standard_normal(len(t) + 20), np.ones(20) / 20, "same")[:400]
        # a follower's own momentum was another one: it coasts by the law of the other
        own = way[k] * (u + 10.0 * k) + (noise * wander if k else 0.0)
        channels[f"wheel_rate_W{k + 1}"] = (t, own + 0.003 * rng.standard_normal(len(t)))
    s = 1 / np.sqrt(3)
    axes = [(s, s, s), (-s, s, s), (-s, -s, s), (s, -s, s)]
    made = tuple(Wheel.model_construct(**{**CASSINI.wheels[0].__dict__, "name": f"W{k + 1}", "axis": a, "spin_inertia": J}) for k, a in enumerate(axes))  # fmt: skip
    return telemetry_of(**channels), CASSINI.model_copy(update={"wheels": made})


def test_law_at_most_one_of_four_wheels_coasts_and_it_is_the_smoothest():
    telemetry, four_wheels = four(0.05)
    result = wheels(telemetry, four_wheels)
    assert [w.name for w in result.wheels if w.run_downs] == ["W1"] and result.doubts.has(FOLLOWS)
    assert result.wheel("W1").fit.coulomb_Nm == pytest.approx(0.001, rel=0.02)


def test_law_of_equal_courses_none_is_taken():
    result = wheels(*four(0.0))
    assert not any(w.run_downs for w in result.wheels) and result.doubts.has(MANY_COAST)


def test_law_a_named_span_excludes_the_finds_of_others():
    telemetry, four_wheels = four(0.0)
    result = wheels(telemetry, four_wheels, run_down=("W2:10-390",))
    assert [w.name for w in result.wheels if w.run_downs] == ["W2"]
    (r,) = result.wheel("W2").run_downs
    assert (r.found_by, r.start_s, r.stop_s) == ("named", 10.0, 390.0)


def test_a_named_wheel_whose_motor_works_is_doubted():
    t = np.arange(0.0, 600.0, 1.0)
    w, current = 200 - 0.1 * t, np.full(len(t), -0.02)
    craft_ = one_wheel()
    result = wheels(telemetry_of(wheel_rate_RWA1=(t, w), wheel_current_RWA1=(t, current)), craft_, run_down=("RWA1:50-550",))  # fmt: skip
    assert result.doubts.has(NAMED_BUT_DRIVEN)


# ---- words and verb --------------------------------------------------------------------------------------------


def test_run_downs_are_named_in_three_forms(tmp_path):
    listed = tmp_path / "list.csv"
    listed.write_text("wheel,start,stop\nRW3,60,240\nRW1,2026-04-01T06:00:00,2026-04-01T06:01:00\n")
    named = named_run_downs(["RW1, RW2", "RW3:60-240", str(listed)])
    assert named[:3] == (NamedRunDown("RW1"), NamedRunDown("RW2"), NamedRunDown("RW3", 60.0, 240.0))
    assert named[3:] == (NamedRunDown("RW3", "60", "240"), NamedRunDown("RW1", "2026-04-01T06:00:00", "2026-04-01T06:01:00"))  # fmt: skip
    broken = tmp_path / "broken.csv"
    broken.write_text("wheel,start\nRW3,60\n")
    for word in ("", "RW3:60", "RW3:240-60", "RW3:a-b", "RW3:1.2.3-4", str(tmp_path / "none.csv"), str(broken)):
        with pytest.raises(BadInput):
            named_run_downs([word])
    t = np.arange(0.0, 400.0, 4.0)
    away = wheels(telemetry_of(wheel_rate_RWA1=(t, 50 + 0 * t)), CASSINI, run_down=("RWA1:5000-6000",))
    assert away.doubts.has(NONE_LISTED_HERE)


def test_the_verb_keeps_what_is_known(tmp_path):
    path, dictionary = table(1, current=False)
    words = ["wheels", path, "--channels", dictionary, "--craft", wheel_craft_file(), "--store", tmp_path / "s.db"]
    guessed = run(*words)
    assert guessed.code == 0 and "only guessed: drag of RW1, RW2, RW3, RW4" in guessed.err
    for more in (["--store-guesses"], [w for s in spans(1) for w in ("--run-down", s)]):
        done = run(*words, *more)
        assert done.code == 0 and "guessed" not in done.err and "kept as" in done.err
    complaint(*words, "--run-down", "RW3:60")


def test_figures_with_suspect_doubts_are_shown_and_not_judged():
    entries = []
    for k in range(10):
        values = [Value(f"coulomb_drag_{w}", "telemetry", 0.001 * (1 + 0.05 * k), 1e-6, "N m") for w in ("W1", "W2")]
        doubts = [MISFIT(wheel="W1", ratio=5.0)] if k > 1 else []
        entries.append(Entry("any", f"e{k}", "wheels", f"2026-04-{k + 1:02d}T00:00:00", values=tuple(values), doubts=doubts))  # fmt: skip
    health = judge(entries, kind="wheels")
    doubted, sound = health.figure("coulomb_drag_W1"), health.figure("coulomb_drag_W2")
    assert (len(doubted.rows), len(doubted.doubted), doubted.verdict) == (2, 8, "pass")
    assert (len(sound.rows), len(sound.doubted), sound.verdict) == (10, 0, "watch")
    assert health.doubts.has(DOUBTED)


# ---- a month in one call ---------------------------------------------------------------------------------------


def made_month(tmp_path):
    """Three days of two wheels of four: one ages.  Files, craft file and list."""
    s = 1 / np.sqrt(3)
    axes = [(s, s, s), (-s, s, s), (-s, -s, s), (s, -s, s)]
    text = 'name = "four"\n' + "".join(
        f'[[wheels]]\nname = "W{k}"\naxis = "{a[0]} {a[1]} {a[2]}"\nspin_inertia = "0.01 kg m2"\n'
        for k, a in enumerate(axes, start=1)
    )
    (tmp_path / "four.toml").write_text(text)
    rng, t, rows, files = np.random.default_rng(1), np.arange(0.0, 700.0, 1.0), ["wheel,start,stop"], []
    for day in (1, 11, 21):
        columns = {"time [s]": t}
        for k, c in enumerate((0.001, 0.001 * (1 + 0.01 * day)), start=1):
            on, off = 20 + 330 * (k - 1), 20 + 330 * (k - 1) + 300
            b, J = 1e-5, 0.01
            x = np.clip(t, on, off) - on
            u = (150 + c / b) * np.exp(-b * x / J) - c / b
            columns[f"wheel_rate_W{k} [rad/s]"] = u + 0.003 * rng.standard_normal(len(t))
            rows.append(f"W{k},2026-04-{day:02d}T00:{on // 60:02d}:{on % 60:02d},2026-04-{day:02d}T00:{off // 60:02d}:{off % 60:02d}")  # fmt: skip
        path = tmp_path / f"day{day:02d}.csv"
        lines = [",".join(f"{v[i]:.6f}" for v in columns.values()) for i in range(len(t))]
        path.write_text("\n".join([f"# epoch: 2026-04-{day:02d}T00:00:00 UTC", ",".join(columns), *lines]) + "\n")
        files.append(path)
    (tmp_path / "list.csv").write_text("\n".join(rows) + "\n")
    return files, tmp_path / "four.toml", tmp_path / "list.csv"


def test_recovery_of_a_month_in_one_call(tmp_path):
    files, vessel, listed = made_month(tmp_path)
    words = ["wheels", *files, "--craft", vessel, "--run-downs", listed, "--store", tmp_path / "s.db"]
    done = run(*words, "--json")
    assert done.code == 0 and done.err.count("kept as wheels-W") == 6
    of_each = {w["name"]: w for w in done.record["wheels"]}
    for name, grown in (("W1", 0.0), ("W2", 0.01)):
        assert [r["found_by"] for r in of_each[name]["run_downs"]] == ["named"] * 3
        for r, day in zip(of_each[name]["run_downs"], (1, 11, 21), strict=True):
            d = r["alone"]
            assert r["start_s"] == pytest.approx((day - 1) * 86400 + (20 if name == "W1" else 350), abs=1)
            assert abs(d["coulomb_Nm"] - 0.001 * (1 + grown * day)) < 4 * d["coulomb_sigma_Nm"] < 4e-6
    assert of_each["W1"]["seen_s"] == 3 * 699
    told = run("wheels", *files, "--craft", vessel, "--run-downs", listed)
    assert told.code == 0 and told.out.count("W2") >= 4 and "Coulomb [mN m]" in told.out
    kept = run("trend", "show", "--store", tmp_path / "s.db", "--craft", vessel, "--kind", "wheels", "--json").record
    (aged,) = [f for f in kept["figures"] if f["figure"] == "coulomb_drag_W2"]
    assert [r["date"][:10] for r in aged["rows"]] == ["2026-04-01", "2026-04-11", "2026-04-21"]


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("W9,2026-04-01T00:01:00,2026-04-01T00:02:00", "no wheel 'W9'"),
        ("W1,2026-04-01T00:02:00,2026-04-01T00:01:00", "ends before it starts"),
        ("W1,2026-05-01T00:01:00,2026-05-01T00:02:00", "outside of the telemetry"),
        ("W1,20,320", "in seconds"),
        ("W1,soon,later", "is not a time"),
        ("W1,20,2026-04-01T00:02:00", "the other way round"),
        ("W1,2026-04-01T00:09:00,2026-04-01T00:11:00", "does not slow down"),
        ("W1,,", "lacks its wheel"),
    ],
)
def test_a_bad_list_is_one_error_with_its_line(row, says, tmp_path):
    files, vessel, listed = made_month(tmp_path)
    good = listed.read_text().splitlines()
    listed.write_text("\n".join([*good[:3], row]) + "\n")
    told = complaint("wheels", *files, "--craft", vessel, "--run-downs", listed, "--store", tmp_path / "s.db")
    assert says in told and "list.csv, line 4" in told


def test_more_wheels_than_can_coast_are_said(tmp_path):
    files, vessel, listed = made_month(tmp_path)
    listed.write_text(
        "wheel,start,stop\nW1,2026-04-01T00:00:20,2026-04-01T00:05:20\nW2,2026-04-01T00:05:00,2026-04-01T00:11:00\n"
    )
    done = run("wheels", *files, "--craft", vessel, "--run-downs", listed, "--json")
    assert done.code == 0 and "wheels.too-many-named" in {d["kind"] for d in done.record["doubts_detail"]}
    # three wheels never hold the attitude while one coasts: nothing to say
    alone = telemetry_of(wheel_rate_RWA1=(np.arange(0, 400.0), 100 - 0.1 * np.arange(0, 400.0)))
    assert not wheels(alone, CASSINI, run_down=("RWA1:20-300",)).doubts.has(TOO_MANY_NAMED)
