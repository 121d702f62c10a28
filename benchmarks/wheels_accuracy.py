"""Wheel drag: whether its intervals hold, run-downs are told from followers, and healthy months raise no trend.

    python benchmarks/wheels_accuracy.py                 # flights of drawn crafts with 3, 4, 5 and 6 wheels: pulls and coverage
    python benchmarks/wheels_accuracy.py --flights 20
    python benchmarks/wheels_accuracy.py --months 200    # drawn months of run-downs, judged: false trends, and power for 25 %

A small simulation of its own, by no law of the estimator's but Coulomb and viscous drag: a rigid body held by wheels under PD
control at 4 Hz, with the drag of all bearings, w x H, a steady torque, and drawn axes, inertias, drag, noise, cadence and
counts.  Two wheels coast, one after the other; with three wheels a thruster-like torque holds the body meanwhile.
"""

# ruff: noqa: E402  (threads are limited before numpy is there)
from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np
from scipy.spatial.transform import Rotation

from asflown.craft.model import Craft, MassProperties, Wheel
from asflown.estimate.wheels import wheels
from asflown.kit.timeline import NS, utc_to_tai_ns
from asflown.telemetry.channels import kind_of
from asflown.telemetry.telemetry import Channel, Telemetry
from asflown.trends.entries import run_down_entries
from asflown.trends.verdicts import judge

EPOCH = int(utc_to_tai_ns("2026-04-01T06:00:00"))
STEP = 0.25
CONSTANT = 0.05  # N m/A
SLOWEST = 60.0  # rad/s, at the start of a run-down that is counted


@dataclass(frozen=True)
class Flight:
    """``coulomb``, ``viscous``: (n,); ``idle``: wheel -> start and stop [s] of its motor being off; ``coasts``: those of them that
    begin well above standstill, where the null space has not brought the wheel near it."""

    telemetry: Telemetry
    craft: Craft
    names: list[str]
    coulomb: np.ndarray
    viscous: np.ndarray
    idle: dict[str, tuple[float, float]]
    coasts: dict[str, tuple[float, float]]

    @property
    def words(self) -> list[str]:
        return [f"{n}:{a:g}-{b:g}" for n, (a, b) in self.coasts.items()]


def telemetry_of(columns: dict, epoch_ns: int = EPOCH) -> Telemetry:
    """name -> (seconds, values, count)."""
    channels = {}
    for name, (t, values, count) in columns.items():
        at = np.rint(np.asarray(t) * NS).astype(np.int64) + epoch_ns
        channels[name] = Channel(
            name, at, np.asarray(values), np.ones(len(at), bool), kind_of(name).unit, count_size=count
        )
    return Telemetry(channels, epoch_ns)


def drawn_axes(rng, n: int) -> np.ndarray:
    """(n, 3): three or more wheels about a cone, each off by some degrees, the whole turned anyhow."""
    cant = np.radians(rng.uniform(30, 50))
    around = 2 * np.pi * np.arange(n) / n
    axes = np.column_stack([np.cos(cant) * np.cos(around), np.cos(cant) * np.sin(around), np.full(n, np.sin(cant))])
    axes = Rotation.random(random_state=rng).apply(axes + 0.05 * rng.standard_normal(axes.shape))
    return axes / np.linalg.norm(axes, axis=1, keepdims=True) * rng.choice([-1, 1], n)[:, None]


def craft_of(names, axes, J: float, I_B=None) -> Craft:
    made = tuple(
        Wheel(
            name=n,
            axis=" ".join(f"{x:.9f}" for x in a),
            spin_inertia=f"{J:.12g} kg m2",
            torque_constant=f"{CONSTANT} N m/A",
        )
        for n, a in zip(names, axes, strict=True)
    )
    if I_B is None:
        return Craft(name="drawn", wheels=made)
    elements = " ".join(f"{x:.9g}" for x in (*np.diag(I_B), I_B[0, 1], I_B[0, 2], I_B[1, 2]))
    body = MassProperties(date="2026-01-01", piece="flight", inertia=f"{elements} kg m2")
    return Craft(name="drawn", wheels=made, mass_properties=(body,))


def drawn_drag(rng, J, first, length):
    """Coulomb and viscous drag (n,) by which a wheel loses a third to nearly all of its rate in the length."""
    n = len(first)
    lost, share = rng.uniform(0.3, 0.9, n), rng.uniform(0.2, 0.8, n)
    # du/dt = -(a + b u), a = k (1 - share), b = k share / first
    k = -np.log(1 - share * lost) * first / (share * length)
    return J * k * (1 - share), J * k * share / first


def fly(seed: int, n: int, *, motion: float = 0.0, current: bool = False, names=None) -> Flight:
    """``motion``: by what the commanded turning of the body swings the wheels [rad/s]; ``current``: with the motors' current."""
    rng = np.random.default_rng(seed)
    names = names or [f"W{k + 1}" for k in range(n)]
    axes, J = drawn_axes(rng, n), 10 ** rng.uniform(-3.4, -0.8)
    I_B = J * 10 ** rng.uniform(3.2, 4.8) * np.diag(rng.uniform(0.7, 1.2, 3))
    first = rng.uniform(90, 280, n) * rng.choice([-1, 1], n)
    length = rng.uniform(120, 500)
    coulomb, viscous = drawn_drag(rng, J, np.abs(first), length)
    chosen = rng.choice(n, 2, replace=False)
    spans = [(40.0, 40.0 + length), (100.0 + length, 100.0 + 2 * length)]
    t = np.arange(0.0, 140.0 + 2 * length, STEP)
    coasting = np.zeros((len(t), n), bool)
    for k, (a, b) in zip(chosen, spans, strict=True):
        coasting[(t >= a) & (t < b), k] = True
    w, omega, torque = _held(rng, t, axes, J, I_B, first, coulomb, viscous, coasting, motion)
    cadence = int(rng.choice([2, 4, 8] if length < 250 else [2, 4, 8, 16]))
    ts = t[::cadence]
    noise, count = 10 ** rng.uniform(-2.7, -1.6), rng.choice([0.0, 0.1, 0.25]) * np.pi / 30
    columns = {}
    for k, name in enumerate(names):
        told = w[::cadence, k] + noise * rng.standard_normal(len(ts))
        columns[f"wheel_rate_{name}"] = (ts, np.round(told / count) * count if count else told, count)
        if current:
            scale = float(np.quantile(np.abs(torque[:, k]), 0.999))
            read = (
                torque[::cadence, k]
                + 0.01 * scale * rng.standard_normal()
                + 0.02 * scale * rng.standard_normal(len(ts))
            )
            columns[f"wheel_current_{name}"] = (ts, read / CONSTANT, 0.0)
    gyro = 10 ** rng.uniform(-6.3, -5.0)
    for j, a in enumerate("xyz"):
        columns[f"body_rate_{a}"] = (t[::2], omega[::2, j] + gyro * rng.standard_normal(len(t[::2])), 0.0)
    idle = {names[k]: s for k, s in zip(chosen, spans, strict=True)}
    coasts = {names[k]: s for k, s in zip(chosen, spans, strict=True) if abs(np.interp(s[0], t, w[:, k])) > SLOWEST}
    return Flight(telemetry_of(columns), craft_of(names, axes, J, I_B), names, coulomb, viscous, idle, coasts)


def _held(rng, t, axes, J, I_B, first, coulomb, viscous, coasting, motion):
    """Wheel rates (N, n), body rates (N, 3), motor torques (N, n)."""
    n, A, inverse = len(axes), axes.T, np.linalg.inv(I_B)
    w, omega, angle = first.copy(), np.zeros(3), np.zeros(3)
    pull = 2 * np.pi * rng.uniform(0.01, 0.03)
    noises = rng.standard_normal((len(t), 3)) * 10 ** rng.uniform(-5.5, -4.5)
    steady = 0.02 * float(np.mean(coulomb)) * rng.standard_normal(3)
    command = (
        motion * J / float(np.max(I_B)) * np.array([np.sin(2 * np.pi * t / p) for p in rng.uniform(150, 400, 3)]).T
    )
    ahead = np.gradient(command, STEP, axis=0)
    shares = {}
    rates, bodies, motors = np.empty((len(t), n)), np.empty((len(t), 3)), np.empty((len(t), n))
    for k in range(len(t)):
        off = coasting[k]
        key = off.tobytes()
        if key not in shares:
            shares[key] = np.linalg.pinv(A * ~off)
        H = I_B @ omega + J * (A @ w)
        turning = np.cross(omega, H)
        # the torque wanted on the body: angle and rate error back, the command ahead, the turning of the momentum
        wanted = I_B @ (ahead[k] - 1.6 * pull * (omega - command[k]) - pull**2 * (angle + noises[k])) + turning
        drag = coulomb * np.sign(w) + viscous * w
        motor, outside = np.zeros(n), steady
        if n == 3 and off.any():  # thrusters hold the body, and the other wheels their rates
            motor = np.where(off, 0.0, drag + 0.2 * J * (first - w))
            outside = steady + wanted + A @ (motor - drag)
        else:
            motor = np.where(off, 0.0, shares[key] @ -wanted)
        turned = STEP * (inverse @ (outside - turning - A @ (motor - drag)))
        # drag and motor over the step in closed form, so that no scheme's error looks like drag
        keep = np.exp(-viscous * STEP / J)
        push = (motor - coulomb * np.sign(w)) / np.maximum(viscous, 1e-30)
        rates[k], bodies[k], motors[k] = w, omega, motor
        w = push + (w - push) * keep - axes @ turned
        angle = angle + STEP * (omega - command[k])
        omega = omega + turned
    return rates, bodies, motors


# ---- flights ----------------------------------------------------------------------------------------------------


def one(job) -> dict:
    """Pulls of Coulomb, viscous and their sum of each run-down, and what was found that is none."""
    seed, n, way, motion = job
    flight = fly(seed, n, motion=motion, current=way == "current")
    result = wheels(flight.telemetry, flight.craft, run_down=flight.words if way == "named" else ())
    pulls, wrong = [], 0
    for k, name in enumerate(flight.names):
        w = result.wheel(name)
        span, idle = flight.coasts.get(name), flight.idle.get(name)
        for r in w.run_downs:
            middle = 0.5 * (r.start_s + r.stop_s)
            wrong += idle is None or not idle[0] <= middle <= idle[1]
        if span is None or w.fit is None or w.fit.basis != "run-down":
            continue
        f, c, v = w.fit, flight.coulomb[k], flight.viscous[k]
        total = c + v * f.mean_rate_rad_s
        pulls.append([(f.coulomb_Nm - c) / f.coulomb_sigma_Nm, (f.viscous_Nms - v) / f.viscous_sigma_Nms,
                      (f.drag_at_mean_Nm - total) / f.drag_at_mean_sigma_Nm])  # fmt: skip
    return {"pulls": pulls, "wrong": wrong, "coasts": len(flight.coasts)}


def flights(count: int, seed: int) -> None:
    print("| wheels | found | body | run-downs | found | wrong finds | std of pulls c, v, sum | in 95 % c, v, sum |")
    print("|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor(2) as pool:
        for n in (3, 4, 5, 6):
            for way, motion in (("named", 0.0), ("named", 30.0), ("shape", 0.0), ("current", 0.0)):
                done = list(pool.map(one, [(seed + s, n, way, motion) for s in range(count)], chunksize=4))
                pulls = np.array([p for d in done for p in d["pulls"]])
                total, wrong = sum(d["coasts"] for d in done), sum(d["wrong"] for d in done)
                std = ", ".join(f"{x:.2f}" for x in np.sqrt(np.mean(pulls**2, axis=0)))
                inside = ", ".join(f"{x:.2f}" for x in np.mean(np.abs(pulls) < 1.96, axis=0))
                moves = "held" if not motion else "turns"
                print(f"| {n} | {way} | {moves} | {total} | {len(pulls)} | {wrong} | {std} | {inside} |", flush=True)


# ---- months ------------------------------------------------------------------------------------------------------


def month(seed: int, n: int = 4, grown: float = 0.0, *, days: int = 8, lasting: float = 0.0) -> list:
    """Entries of a month: on each of some days every wheel is run down once.  Drag scatters with temperature: viscous 3 %,
    Coulomb 1 %, alike for all wheels in part.  ``grown``: of the first wheel's Coulomb drag over the month; ``lasting``:
    correlation of the temperature from day to day."""
    rng = np.random.default_rng(seed)
    J, axes = 10 ** rng.uniform(-3.4, -0.8), drawn_axes(rng, n)
    names = [f"W{k + 1}" for k in range(n)]
    craft, first, length = craft_of(names, axes, J), rng.uniform(90, 280, n), rng.uniform(120, 300)
    coulomb, viscous = drawn_drag(rng, J, first, length)
    noise = 10 ** rng.uniform(-2.7, -1.6)
    at = np.sort(rng.choice(30, days, replace=False))
    at = at - at[0]
    entries, warm = [], rng.standard_normal(n + 1)
    t = np.arange(0.0, length + 1.0, 1.0)
    for k, day in enumerate(at):
        keep = lasting ** (day - at[k - 1]) if k and lasting else 0.0
        warm = keep * warm + np.sqrt(1 - keep**2) * rng.standard_normal(n + 1)
        own = 0.7 * warm[0] + 0.7 * warm[1:]
        c = coulomb * (1 - 0.01 * own)
        c[0] *= 1 + grown * day / max(at[-1], 1)
        v = viscous * (1 - 0.03 * own)
        begin = first * (1 + 0.05 * rng.standard_normal(n))
        columns = {}
        for j, name in enumerate(names):
            u = (begin[j] + c[j] / v[j]) * np.exp(-v[j] * t / J) - c[j] / v[j]
            columns[f"wheel_rate_{name}"] = (t, u + noise * rng.standard_normal(len(t)), 0.0)
        telemetry = telemetry_of(columns, EPOCH + int(day) * 86_400 * NS)
        result = wheels(telemetry, craft, run_down=names)
        entries += run_down_entries(result, telemetry, craft)
    return entries


def judged(job) -> tuple[bool, bool, bool, bool]:
    """Whether any wheel, any but the first, and the first has a trend; and whether the newest value raised something."""
    seed, grown, days, lasting = job
    health = judge(month(seed, grown=grown, days=days, lasting=lasting), kind="wheels")
    rising = {f.figure for f in health.figures if f.trend_p_adjusted is not None and f.trend_p_adjusted < 0.05}
    newest = any(f.newest_p_adjusted is not None and f.newest_p_adjusted < 0.05 for f in health.figures)
    return bool(rising), bool({f for f in rising if not f.endswith("_W1")}), "coulomb_drag_W1" in rising, newest


def months(count: int, seed: int) -> None:
    print(
        "| days | growth of W1 | temperature lasts | months | any trend | a trend of W1 | of another wheel | newest deviates |"
    )
    print("|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor(2) as pool:
        for days, grown, lasting in ((8, 0.0, 0.0), (8, 0.25, 0.0), (8, 0.0, 0.7), (8, 0.05, 0.0)):
            jobs = [(seed + s, grown, days, lasting) for s in range(count)]
            found = np.mean(list(pool.map(judged, jobs, chunksize=4)), axis=0)
            shown = " | ".join(f"{100 * found[k]:.1f} %" for k in (0, 2, 1, 3))
            print(f"| {days} | {100 * grown:g} % | {'days' if lasting else 'no'} | {count} | {shown} |", flush=True)


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ask.add_argument("--flights", type=int, default=100)
    ask.add_argument("--months", type=int, default=0)
    ask.add_argument("--seed", type=int, default=1)
    given = ask.parse_args()
    if given.months:
        months(given.months, given.seed)
    else:
        flights(given.flights, given.seed)


if __name__ == "__main__":
    main()
