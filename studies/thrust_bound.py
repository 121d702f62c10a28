"""What any estimator can reach for thrust, fall time and centre of mass: the bound of benchmarks/thrust_accuracy.py's own flights.

    python studies/thrust_bound.py                # 60 flights, three minutes
    python studies/thrust_bound.py --runs 20

Every flight's truth is known: when each pulse was on, what it gave, every sample's noise.  Given those, momentum and velocity are linear
in thrusts, fall time, centre of mass, spin inertias, inertia, mass, accelerometer bias and the scatter of every single pulse, each with
its prior, and the inverse of the information matrix bounds the mean square error of all of them (Van Trees' form of Cramer and Rao: with
priors).  It knows what no record tells: the instants of all pulses, how unlike thrusters are, how far pulses scatter.  The same with
thrusters alike, without scatter, and without either shows what costs how much.

The best linear estimate with all that known is made too, from the same telemetry: its error must have the bound's size, or the bound is
wrong.  It has, but for a mean 0.4 % (burn) and 0.25 % (both) too low: how long a pulse lasts depends on how strong it is.

Answer, 2026-11: docs/theory/thrust.md, "What can be reached".
"""

# ruff: noqa: E402  (threads are limited before numpy is there)
from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from thrust_accuracy import BASE, CENTER_SIGMA, FALL, FALL_SIGMA, MASS, MASS_SHARE, THRUST, UNLIKE, flown

from asflown.kit.rotations import rotation

DELAY, RISE, SPIN_SHARE, INERTIA_SHARE = 0.005, 0.020, 0.0024, 0.01
GYRO, TACHOMETER = 2e-6, 0.005  # rad/s, nominal noise
CASES = {"biasing": ("bias",), "burn": ("burn",), "biasing and burn": ("bias", "burn")}
NONE = 1e-5  # in place of how unlike thrusters are, and of the scatter
ANY_MOMENTUM, ANY_VELOCITY, ANY_BIAS = 100.0, 0.1, 1e-2  # sigmas of what is not known beforehand: N m s, m/s, m/s2

WHEELS = [w.name for w in BASE.at(None).wheels]
NAMES = [*(f"thrust {k}" for k in range(8)), "fall", *(f"center {i}" for i in range(3)), *(f"spin {w}" for w in WHEELS),
         "inertia", "mass", "bias"]  # fmt: skip
PRIORS = {"fall": FALL_SIGMA, "inertia": INERTIA_SHARE, "mass": MASS_SHARE, "bias": ANY_BIAS}
PRIORS |= {f"center {i}": s for i, s in enumerate(CENTER_SIGMA)} | {f"spin {w}": SPIN_SHARE for w in WHEELS}


def course(t, on_time: float, fall: float, next_s: float) -> np.ndarray:
    """Impulse over steady thrust so far of a pulse ordered at 0 for ``on_time``, at t (N,). [s]

    Once the same thruster's next pulse, ordered at ``next_s``, is felt, what is left of the tail goes with the rise."""
    top = 1 - np.exp(-(on_time - DELAY) / RISE)
    rising = np.clip(t, DELAY, on_time) - DELAY
    given = rising - RISE * (1 - np.exp(-rising / RISE))
    given += top * np.clip(t - on_time, 0.0, DELAY)
    cut = next_s - on_time  # from the valve's closing felt to its opening felt
    falling = np.clip(t - on_time - DELAY, 0.0, cut)
    given += top * fall * (1 - np.exp(-falling / fall))
    after = np.maximum(t - next_s - DELAY, 0.0)
    return given + top * np.exp(-cut / fall) * RISE * (1 - np.exp(-after / RISE))


@dataclass(frozen=True)
class Linear:
    """One flight as numbers r = A (parameters - truth) + B scatter + noise of covariance R; what the wheels and the mass were."""

    r: np.ndarray
    A: np.ndarray
    B: np.ndarray  # per unit of each pulse's scatter
    R: np.ndarray
    impulse: np.ndarray
    off: dict[str, float]  # by which spin inertias, inertia and mass are off what is believed


def linear(flight, F, fall: float, center) -> Linear:
    truth, tlm, t = flight.truth, flight.telemetry, flight.truth.time_s
    fired, turn = truth.thrusters, rotation(truth.attitude)
    middle = turn[:-1] * (turn[:-1].inv() * turn[1:]) ** 0.5
    along = np.array([x.direction for x in BASE.thrusters], float)
    arms = np.cross(np.array([x.position for x in BASE.thrusters], float) - center, along)
    thruster, scatter, gave, later = [], [], [], []
    for k, name in enumerate(fired.names):
        own = fired.pulses_of(name, t)
        for n, (start, on_time, level) in enumerate(own):
            follows = own[n + 1][0] - start if n + 1 < len(own) else np.inf
            short, long = (course(t - start, on_time, f, follows) for f in (fall, fall + 1e-4))
            thruster.append(k)
            scatter.append(level / F[k] - 1)
            gave.append(short)
            later.append((long - short) / 1e-4)
    thruster, scatter, gave, later = (np.array(v) for v in (thruster, scatter, gave, later))
    strength = F[thruster] * (1 + scatter)

    rates = [tlm.channel(f"body_rate_{a}") for a in "xyz"]
    at = np.rint(tlm.seconds(rates[0].tai_ns) / fired.period_s).astype(int)
    here, w = turn[at], np.stack([c.values for c in rates], axis=1)

    def pushed(of, vectors):
        """Momentum (p, K, 3) that impulses so far (p, N) along body vectors (p, 3) have given."""
        return np.stack([
            np.vstack([np.zeros(3), np.cumsum(middle.apply(v) * np.diff(u)[:, None], axis=0)])[at]
            for u, v in zip(of, vectors, strict=True)
        ])  # fmt: skip

    # momentum as an analyst computes it, with the craft believed
    now, then = BASE.at(flight.scenario.epoch_ns), flight.craft.at(flight.scenario.epoch_ns)
    axes, spin = np.array([x.axis for x in now.wheels]), np.array([x.spin_inertia for x in now.wheels])
    wheels = np.stack([tlm.channel(f"wheel_rate_{x.name}").values for x in now.wheels], axis=1)
    each = wheels[:, :, None] * (spin[:, None] * axes)
    by_pulse = pushed(gave, arms[thruster])  # per newton
    columns = {f"thrust {k}": np.einsum("p,pki->ki", (1 + scatter) * (thruster == k), by_pulse) for k in range(8)}
    columns["fall"] = np.einsum("p,pki->ki", strength, pushed(later, arms[thruster]))
    totals = np.array([strength[thruster == k] @ gave[thruster == k] for k in range(8)])
    columns |= {f"center {i}": pushed(totals, np.cross(-unit, along)).sum(axis=0) for i, unit in enumerate(np.eye(3))}
    columns |= {f"spin {x.name}": -here.apply(each[:, n]) for n, x in enumerate(now.wheels)}
    columns["inertia"] = -here.apply(w @ now.inertia_kgm2)
    off = {f"spin {a.name}": b.spin_inertia / a.spin_inertia - 1 for a, b in zip(now.wheels, then.wheels, strict=True)}
    off["inertia"] = then.inertia_kgm2[0, 0] / now.inertia_kgm2[0, 0] - 1
    r = here.apply(w @ now.inertia_kgm2 + each.sum(axis=1)) - np.einsum("p,pki->ki", F[thruster], by_pulse)
    r = (r - sum(v * columns[n] for n, v in off.items())).ravel()
    noise = GYRO**2 * now.inertia_kgm2 @ now.inertia_kgm2 + TACHOMETER**2 * (axes.T * spin**2) @ axes
    K = len(at)
    R = np.kron(np.eye(K), noise) + ANY_MOMENTUM**2 * np.kron(np.ones((K, K)), np.eye(3))
    A = np.stack([columns[n].ravel() if n in columns else np.zeros(3 * K) for n in NAMES], axis=1)
    B = (F[thruster][:, None, None] * by_pulse).reshape(len(thruster), -1).T
    if "accelerometer_count" in tlm:
        c, scale, mass = tlm.channel("accelerometer_count"), BASE.accelerometer.scale, flight.scenario.craft_mass
        # the count has changed within the second before: velocity is known to what it gains in that
        ticks = np.flatnonzero(np.diff(c.values) > 0) + 1
        at = np.rint(tlm.seconds(c.tai_ns) / fired.period_s).astype(int)[ticks]
        along_axis = (along @ np.array(BASE.accelerometer.axis, float))[thruster] / mass
        total = (strength * along_axis) @ gave[:, at]
        gained = np.clip(np.abs(np.gradient(total, t[at])) + flight.scenario.accelerometer_bias, 0, scale)
        own = {f"thrust {k}": ((1 + scatter) * along_axis * (thruster == k)) @ gave[:, at] for k in range(8)}
        own |= {"fall": (strength * along_axis) @ later[:, at], "mass": -total, "bias": t[at]}
        expected = (F[thruster] * along_axis) @ gave[:, at] + flight.scenario.accelerometer_bias * t[at]
        k = len(at)
        r = np.r_[r, scale * c.values[ticks] + 0.5 * gained - expected]
        A = np.vstack([A, np.stack([own.get(n, np.zeros(k)) for n in NAMES], axis=1)])
        B = np.vstack([B, ((F[thruster] * along_axis)[:, None] * gave[:, at]).T])
        both = np.zeros((len(r), len(r)))
        both[: 3 * K, : 3 * K], both[3 * K :, 3 * K :] = R, np.diag(gained**2 / 12) + ANY_VELOCITY**2
        R, off["mass"] = both, mass / MASS - 1
    return Linear(r, A, B, R, fired.impulse_Ns[-1], off)


def posterior(parts: list[Linear], F, fall: float, center, unlike: float, scatter: float):
    """Covariance of all parameters, and the error that the best linear estimate makes of these records."""
    precision = np.diag([1 / PRIORS[n] ** 2 if n in PRIORS else 0.0 for n in NAMES])
    precision[:8, :8] = (np.eye(8) - 1 / 8) / (unlike * np.mean(F)) ** 2  # alike about a mean of which nothing is known
    off = {n: v for p in parts for n, v in p.off.items()}
    believed = np.array([-off.get(n, 0.0) for n in NAMES])  # less the truth
    believed[:8], believed[8], believed[9:12] = np.mean(F) - F, FALL - fall, np.array(BASE.center_of_mass) - center
    pull = precision @ believed
    for p in parts:
        solved = np.linalg.solve(p.R + scatter**2 * p.B @ p.B.T, np.column_stack([p.A, p.r]))
        precision = precision + p.A.T @ solved[:, :-1]
        pull = pull + p.A.T @ solved[:, -1]
    covariance = np.linalg.inv(precision)
    return covariance, covariance @ pull


def one(seed: int) -> dict:
    """Of each case: bounds (4, 4) as drawn, alike, without scatter, without either, of the steady mean [%], fall [ms], centre x
    and y [mm]; and the best estimate's errors (4,)."""
    flights, F, fall, center = flown(seed, False)
    parts = {k: linear(f, F, fall, center) for k, f in flights.items()}
    rng = np.random.default_rng(seed)  # as ``flown`` draws them
    rng.standard_normal(4 + len(BASE.wheels))
    scatter, unlike = rng.uniform(0.01, 0.03), max(abs(UNLIKE * rng.standard_normal()), NONE)
    out = {}
    for case, keys in CASES.items():
        own = [parts[k] for k in keys]
        weight = sum(p.impulse for p in own) / sum(p.impulse.sum() for p in own)
        told = np.zeros((4, len(NAMES)))
        told[0, :8] = 100 / THRUST * weight
        told[[1, 2, 3], [8, 9, 10]] = 1e3
        bounds = []
        for u, s in ((unlike, scatter), (NONE, scatter), (unlike, NONE), (NONE, NONE)):
            covariance, error = posterior(own, F, fall, center, u, s)
            bounds.append(np.sqrt(np.einsum("ij,jk,ik->i", told, covariance, told)))
            if (u, s) == (unlike, scatter):
                best = told @ error
        out[case] = (np.array(bounds), best)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=60)
    runs = [one(seed) for seed in range(parser.parse_args().runs)]

    def row(what: str, values) -> None:
        print(f"   {what:26s} " + "  ".join(f"{v:7.3f}" for v in values))

    for case in CASES:
        bounds, best = (np.array([r[case][k] for r in runs]) for k in (0, 1))
        print(f"{case}: steady mean [%], fall [ms], centre x, y [mm]")
        for k, what in enumerate(("bound, as drawn", "alike", "without scatter", "without either")):
            row(what, np.sqrt(np.mean(bounds[:, k] ** 2, axis=0)))
        row("best estimate: mean error", best.mean(axis=0))
        row("best estimate: rms error", np.sqrt(np.mean(best**2, axis=0)))
        row("best estimate: rms pull", np.sqrt(np.mean((best / bounds[:, 0]) ** 2, axis=0)))


if __name__ == "__main__":
    main()
