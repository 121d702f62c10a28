"""What any estimator can reach for thrust, fall time and centre of mass: the bound of benchmarks/thrust_accuracy.py's own flights.

    python studies/thrust_bound.py                # 60 flights, two minutes
    python studies/thrust_bound.py --runs 20

Every flight's truth is known: when each pulse was on, what it gave, every sample's noise.  Given those, momentum and velocity are linear
in thrusts, fall time, centre of mass, spin inertias, inertia, mass, accelerometer bias and the scatter of every single pulse, each with
its prior, and the inverse of the information matrix bounds the mean square error of all of them (Van Trees' form of Cramer and Rao: with
priors).  It knows what no record tells: the instants of all pulses, how unlike thrusters are, how far pulses scatter.  The same with
thrusters alike, without scatter, and without either shows what costs how much.

The best linear estimate with all that known is made too, from the same telemetry: its error must have the bound's size, or the bound is
wrong.

Answer, 2026-11: see docs/theory/thrust.md, "How well".
"""

# ruff: noqa: E402  (threads are limited before numpy is there)
from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from thrust_accuracy import BASE, CENTER_SIGMA, FALL, FALL_SIGMA, MASS, MASS_SHARE, flown

from asflown.kit.rotations import rotation

DELAY, RISE, SPIN_SHARE, INERTIA_SHARE = 0.005, 0.020, 0.0024, 0.01
GYRO, TACHOMETER = 2e-6, 0.005  # rad/s, nominal noise
CASES = {"biasing": ("bias",), "burn": ("burn",), "biasing and burn": ("bias", "burn")}
ALIKE, EVEN = 1e-5, 1e-5  # in place of how unlike thrusters are, and of the scatter


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


class Columns:
    """Of one flight: what each parameter changes in momentum (or velocity) at its samples, and the residual at the truth."""

    def __init__(self, flight, F, fall: float, center):
        truth, tlm, t = flight.truth, flight.telemetry, flight.truth.time_s
        fired = truth.thrusters
        turn = rotation(truth.attitude)
        middle = turn[:-1] * (turn[:-1].inv() * turn[1:]) ** 0.5
        along = np.array([x.direction for x in BASE.thrusters], float)
        arms = np.cross(np.array([x.position for x in BASE.thrusters], float) - center, along)
        rates = [tlm.channel(f"body_rate_{a}") for a in "xyz"]
        at = np.rint(tlm.seconds(rates[0].tai_ns) / fired.period_s).astype(int)
        # momentum as the analyst computes it, with the craft believed and attitude as it was
        now, then = BASE.at(flight.scenario.epoch_ns), flight.craft.at(flight.scenario.epoch_ns)
        w = np.stack([c.values for c in rates], axis=1)
        wheels = np.stack([tlm.channel(f"wheel_rate_{x.name}").values for x in now.wheels], axis=1)
        axes = np.array([x.axis for x in now.wheels])
        each = wheels[:, :, None] * (np.array([x.spin_inertia for x in now.wheels])[:, None] * axes)
        here = turn[at]
        believed = here.apply(w @ now.inertia_kgm2 + each.sum(axis=1))
        self.lengths, self.thruster, pulses, later = [], [], [], []
        self.velocity, self.scatter_of = [], []
        for k, name in enumerate(fired.names):
            own = fired.pulses_of(name, t)
            for (start, on_time, level), follows in zip(own, [*(p[0] for p in own[1:]), np.inf], strict=False):
                gave, longer = (course(t - start, on_time, f, follows - start) for f in (fall, fall + 1e-4))
                self.thruster.append(k)
                self.lengths.append(on_time)
                self.scatter_of.append(level / F[k] - 1)
                pulses.append(gave)
                later.append((longer - gave) / 1e-4)
        gave, later = np.array(pulses), np.array(later)  # (p, N)
        self.thruster, self.scatter_of = np.array(self.thruster), np.array(self.scatter_of)

        def pushed(of, vectors):
            """Momentum (p, K, 3) of impulses so far (p, N) along body vectors (p, 3)."""
            out = np.empty((len(of), len(at), 3))
            for i, (u, v) in enumerate(zip(of, vectors, strict=True)):
                out[i] = np.vstack([np.zeros(3), np.cumsum(middle.apply(v) * np.diff(u)[:, None], axis=0)])[at]
            return out

        each_pulse = pushed(gave, arms[self.thruster])  # per newton
        strength = F[self.thruster] * (1 + self.scatter_of)
        self.momentum_noise = GYRO**2 * now.inertia_kgm2 @ now.inertia_kgm2.T
        self.momentum_noise += TACHOMETER**2 * np.einsum("n,ni,nj->ij", [x.spin_inertia**2 for x in now.wheels], axes, axes)
        columns = {f"thrust {k}": np.zeros((len(at), 3)) for k in range(8)}
        for p, k in enumerate(self.thruster):
            columns[f"thrust {k}"] += (1 + self.scatter_of[p]) * each_pulse[p]
        columns["fall"] = np.einsum("p,pki->ki", strength, pushed(later, arms[self.thruster]))
        totals = np.array([strength[self.thruster == k] @ gave[self.thruster == k] for k in range(8)])
        for i, unit in enumerate(np.eye(3)):
            columns[f"center {i}"] = pushed(totals, np.cross(-unit, along)).sum(axis=0)
        for n, x in enumerate(now.wheels):
            columns[f"spin {x.name}"] = -here.apply(each[:, n])
        columns["inertia"] = -here.apply(w @ now.inertia_kgm2)
        self.columns = columns
        self.pulses = F[self.thruster][:, None, None] * each_pulse  # per unit of scatter
        true = np.einsum("p,pki->ki", F[self.thruster], each_pulse)
        for n, (a, b) in enumerate(zip(now.wheels, then.wheels, strict=True)):
            true = true + columns[f"spin {a.name}"] * (b.spin_inertia / a.spin_inertia - 1)
        larger = then.inertia_kgm2[0, 0] / now.inertia_kgm2[0, 0] - 1
        self.larger = larger
        self.spin = [b.spin_inertia / a.spin_inertia - 1 for a, b in zip(now.wheels, then.wheels, strict=True)]
        true = true + larger * columns["inertia"]
        self.residual = believed - true
        self.impulse = fired.impulse_Ns[-1]
        if "accelerometer_count" in tlm:
            c = tlm.channel("accelerometer_count")
            at = np.rint(tlm.seconds(c.tai_ns) / fired.period_s).astype(int)
            # the count changes within the second before a tick: there the velocity is known to the size of a second's part
            ticks = np.flatnonzero(np.diff(c.values) > 0) + 1
            at, scale = at[ticks], BASE.accelerometer.scale
            z = along @ np.array(BASE.accelerometer.axis, float)
            mass = flight.scenario.craft_mass
            self.velocity_columns = {f"thrust {k}": z[k] / mass * ((1 + self.scatter_of[self.thruster == k]) @ gave[self.thruster == k][:, at]) for k in range(8)}  # fmt: skip
            self.velocity_columns["fall"] = (strength * z[self.thruster] / mass) @ later[:, at]
            total = (strength * z[self.thruster] / mass) @ gave[:, at]
            self.velocity_columns["mass"] = -total
            self.velocity_columns["bias"] = t[at]
            self.velocity_pulses = (F[self.thruster] * z[self.thruster] / mass)[:, None] * gave[:, at]
            rise = np.abs(np.gradient(total, t[at])) + 1e-4
            before = np.clip(rise * 1.0, 0, scale)  # m/s gone through since the count changed
            self.velocity_variance = np.maximum(before, 1e-5) ** 2 / 12
            base = (F[self.thruster] * z[self.thruster] / mass) @ gave[:, at] + flight.scenario.accelerometer_bias * t[at]
            self.velocity_residual = scale * c.values[ticks] + 0.5 * before - base
            self.mass = mass / MASS - 1


def information(parts, F, unlike: float, scatter: float):
    """Names, posterior covariance, and error of the best estimate, of the parameters at the truth."""
    names = [f"thrust {k}" for k in range(8)] + ["fall", "center 0", "center 1", "center 2"]
    names += [n for n in parts[0].columns if n.startswith("spin")] + ["inertia", "mass", "bias"]
    size = len(names)
    J, pull = np.zeros((size, size)), np.zeros(size)
    for c in parts:
        K = len(c.residual)
        A = np.zeros((3 * K, size))
        for i, n in enumerate(names):
            if n in c.columns:
                A[:, i] = c.columns[n].ravel()
        B = c.pulses.reshape(len(c.pulses), -1).T
        start = np.kron(np.ones((K, 1)), np.eye(3))  # momentum at the first sample is not known
        R = np.kron(np.eye(K), c.momentum_noise) + scatter**2 * B @ B.T + 1e4 * start @ start.T
        rows = [(A, R, c.residual.ravel())]
        if hasattr(c, "velocity_columns"):
            # both see the same pulses: one covariance
            k = len(c.velocity_residual)
            V = np.zeros((k, size))
            for i, n in enumerate(names):
                if n in c.velocity_columns:
                    V[:, i] = c.velocity_columns[n]
            A, B = np.vstack([A, V]), np.vstack([B, c.velocity_pulses.T])
            noise = np.zeros((3 * K + k, 3 * K + k))
            noise[: 3 * K, : 3 * K] = np.kron(np.eye(K), c.momentum_noise) + 1e4 * start @ start.T
            noise[3 * K :, 3 * K :] = np.diag(c.velocity_variance)
            noise[3 * K :, 3 * K :] += 1e-2  # a velocity to begin with
            rows = [(A, noise + scatter**2 * B @ B.T, np.r_[c.residual.ravel(), c.velocity_residual])]
        for A, R, r in rows:
            solved = np.linalg.solve(R, np.column_stack([A, r]))
            J += A.T @ solved[:, :-1]
            pull += A.T @ solved[:, -1]
    prior = np.zeros((size, size))
    prior[:8, :8] = (np.eye(8) - 1 / 8) / (unlike * np.mean(F)) ** 2  # alike about a mean of which nothing is known
    sigmas = {"fall": FALL_SIGMA, "inertia": INERTIA_SHARE, "mass": MASS_SHARE, "bias": 1e-2} | {f"center {i}": CENTER_SIGMA[i] for i in range(3)}
    for i, n in enumerate(names[8:], 8):
        prior[i, i] = 1 / sigmas.get(n, SPIN_SHARE) ** 2
    return names, np.linalg.inv(J + prior), pull, prior


def one(seed: int) -> dict:
    flights, F, fall, center = flown(seed, False)
    parts = {k: Columns(f, F, fall, center) for k, f in flights.items()}
    rng = np.random.default_rng(seed)  # as in ``flown``, to know what was drawn
    rng.standard_normal(1 + 3 + len(BASE.wheels))
    scatter, unlike = rng.uniform(0.01, 0.03), abs(0.05 * rng.standard_normal())
    out = {}
    for case, keys in CASES.items():
        own = [parts[k] for k in keys]
        weight = sum(p.impulse for p in own)
        weight = weight / weight.sum()
        bounds = []
        for u, s in ((unlike, scatter), (ALIKE, scatter), (unlike, EVEN), (ALIKE, EVEN)):
            names, C, pull, prior = information(own, F, max(u, ALIKE), s)
            bounds.append([100 * np.sqrt(weight @ C[:8, :8] @ weight) / 0.7, *(1e3 * np.sqrt(np.diag(C)[[8, 9, 10]]))])
            if (u, s) == (unlike, scatter):
                at_truth = np.zeros(len(names))  # the prior's centre less the truth
                at_truth[:8] = np.mean(F) - F
                at_truth[8] = FALL - fall
                at_truth[9:12] = np.array(BASE.center_of_mass) - center
                at_truth[12 : 12 + len(own[0].spin)] = -np.array(own[0].spin)
                at_truth[names.index("inertia")] = -own[0].larger
                at_truth[names.index("mass")] = -getattr(own[-1], "mass", 0.0)
                error = C @ (pull + prior @ at_truth)
                best = [100 * weight @ error[:8] / 0.7, *(1e3 * error[[8, 9, 10]])]
        lengths = np.concatenate([p.lengths for p in own])
        out[case] = (bounds, best, lengths.max())
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=60)
    wanted = parser.parse_args()
    runs = [one(seed) for seed in range(wanted.runs)]
    print("bounds (rms over the flights): steady mean [%], fall [ms], centre x, y [mm]; best: mean and rms of the error made with all known")
    for case in CASES:
        print(case)
        bounds = np.array([r[case][0] for r in runs])
        for row, what in zip(np.sqrt(np.mean(bounds**2, axis=0)), ("as drawn", "alike", "no scatter", "neither"), strict=True):
            print(f"   {what:12s} " + "  ".join(f"{v:7.3f}" for v in row))
        best = np.array([r[case][1] for r in runs])
        print("   best: mean   " + "  ".join(f"{v:7.3f}" for v in best.mean(axis=0)))
        print("   best: rms    " + "  ".join(f"{v:7.3f}" for v in np.sqrt(np.mean(best**2, axis=0))))
        pulls = best / bounds[:, 0]
        print("   best: pulls  " + "  ".join(f"{v:7.3f}" for v in np.sqrt(np.mean(pulls**2, axis=0))))


if __name__ == "__main__":
    main()
