"""How well thrust, fall time and centre of mass are told, with the truth drawn from the priors: hundreds of biasings and burns.

    python benchmarks/thrust_accuracy.py                  # 200 of each, some ten minutes on two cores
    python benchmarks/thrust_accuracy.py --runs 20
    python benchmarks/thrust_accuracy.py --alike          # thrusters all alike, the priors' 5 % not drawn
    python benchmarks/thrust_accuracy.py --alike --unlike 0.002     # and the fit told so

Every run has a fall time, a centre of mass, spin inertias, an inertia, a mass, thrusters unlike each other and a scatter
from pulse to pulse (1 to 3 %) of its own.  The records: a wheel biasing like that of 28 January 2005, counters every 16 or 64 s, with and without
pulse counts, and a burn of 0.25 m/s with the accelerometer.  Errors are counted against the steady thrust, and against the thrust that flew:
impulse over effective on-time.  The two differ where one pulse lasts for minutes and its scatter with it.
"""

# ruff: noqa: E402  (threads are limited before numpy is there)
from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np

from asflown.craft.load import load_craft
from asflown.dynamics.pulses import Valve
from asflown.estimate.firing.priors import CENTER_SIGMA, FALL, FALL_SIGMA, MASS_SHARE, UNLIKE, thrust_priors
from asflown.estimate.thrust.methods import thrust
from asflown.sim.flight.closed_loop import fly
from asflown.sim.scenario.scenario import load_scenario

BASE, THRUST, MASS = load_craft("cassini", cm=(0, 0, 1.35)), 0.7, 3160.0
CASES = {
    "biasing, counters every 16 s": (("bias",), 1, True),
    "the same, pulses not counted": (("bias",), 1, False),
    "biasing, counters every 64 s": (("bias",), 4, True),
    "the same, pulses not counted ": (("bias",), 4, False),
    "burn": (("burn",), 1, True),
    "biasing and burn": (("bias", "burn"), 1, True),
}


def flown(seed: int, alike: bool):
    """A biasing and a burn of one craft, its thrusts (8,), fall time [s] and centre of mass [m]."""
    rng = np.random.default_rng(seed)
    fall = max(FALL + FALL_SIGMA * rng.standard_normal(), 0.02)
    center = np.array(BASE.center_of_mass) + CENTER_SIGMA * rng.standard_normal(3)
    wheels = tuple(
        w.model_copy(update={"spin_inertia": w.spin_inertia * (1 + 0.0024 * rng.standard_normal())})
        for w in BASE.wheels
    )
    scatter, unlike = rng.uniform(0.01, 0.03), abs(UNLIKE * rng.standard_normal()) * (not alike)
    F, larger = THRUST * (1 + unlike * rng.standard_normal(8)), 1 + 0.01 * rng.standard_normal()
    mass = MASS * (1 + MASS_SHARE * rng.standard_normal())
    weak = [{"thruster": t.name, "start": "0 s", "factor": f / THRUST} for t, f in zip(BASE.thrusters, F, strict=True)]
    how = {"thrust": f"{THRUST} N", "fall": f"{1e3 * fall} ms", "pulse_scatter": float(scatter)}
    flights = {}
    for key, name, counters in (("bias", "wheel-bias-day28", "16 s"), ("burn", "rcs-burn", "4 s")):
        craft = BASE.model_copy(update={"wheels": wheels})
        I = larger * craft.at(load_scenario(name).epoch_ns).inertia_kgm2  # noqa: E741
        craft = craft.with_inertia((I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]), tuple(center))
        sampling = {"on_time": counters, "pulse_count": counters, "accelerometer_count": "1 s"} if key == "burn" else {"on_time": counters, "pulse_count": counters}  # fmt: skip
        flights[key] = fly(
            name,
            craft=craft,
            seed=seed,
            changes={"thrusters": how, "thruster_faults": weak, "telemetry": sampling, "craft_mass": f"{mass} kg"},
        )
    return flights, F, fall, center


def thinned(tlm, count: int, counted: bool):
    """Every ``count``-th reading of the counters, with or without those of pulses."""
    kept = {}
    for name, c in tlm.channels.items():
        if c.kind.stem == "pulse_count" and not counted:
            continue
        counter = c.kind.stem in ("on_time", "pulse_count")
        kept[name] = c.where(np.arange(len(c.values)) % count == 0) if counter else c
    return replace(tlm, channels=kept)


def one(seed: int, alike: bool, unlike: float) -> dict:
    """Errors and pulls of every case: mean thrust, the same against what flew, fall time, centre x and y, single thrusts."""
    flights, F, fall, center = flown(seed, alike)
    valve, found = Valve(0.005, 0.020, fall), {}
    for case, (keys, count, counted) in CASES.items():
        fired = [flights[k].truth.thrusters for k in keys]
        impulse = sum(f.impulse_Ns[-1] for f in fired)
        lengths = [
            p[1]
            for k, f in zip(keys, fired, strict=True)
            for n in f.names
            for p in f.pulses_of(n, flights[k].truth.time_s)
        ]
        steady, flew = impulse @ F / impulse.sum(), impulse.sum() / valve.effective(lengths).sum()
        records = [thinned(flights[k].telemetry, count, counted) for k in keys]
        r = thrust(records, BASE, priors=thrust_priors(BASE, mass_kg=MASS, unlike=unlike))
        singles = [(r.thrust_N[t.name] - f) / r.thrust_sigma_N[t.name] for t, f in zip(BASE.thrusters, F, strict=True) if r.thrust_N[t.name] is not None]  # fmt: skip
        errors = np.array([r.mean_thrust_N - steady, r.mean_thrust_N - flew, r.fall_time_s - fall, *(np.array(r.center_of_mass_m) - center)[:2]])  # fmt: skip
        sigmas = np.array(
            [r.mean_thrust_sigma_N, r.mean_thrust_sigma_N, r.fall_time_sigma_s, *r.center_of_mass_sigma_m[:2]]
        )
        found[case] = (errors, errors / sigmas, singles, r.mean_thrust_sigma_N)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--alike", action="store_true", help="all thrusters alike")
    parser.add_argument("--unlike", type=float, default=UNLIKE, help="what the fit is told of how unlike they are")
    parser.add_argument("--jobs", type=int, default=2)
    wanted = parser.parse_args()
    with ProcessPoolExecutor(wanted.jobs) as pool:
        runs = list(pool.map(partial(one, alike=wanted.alike, unlike=wanted.unlike), range(wanted.runs)))
    print(
        f"{wanted.runs} runs; error and scatter of the mean in % of the thrust; pulls: mean thrust, fall time, centre x, y, each thruster"
    )
    for case in CASES:
        errors, pulls = (np.array([r[case][k] for r in runs]) for k in (0, 1))
        single = np.concatenate([r[case][2] for r in runs])
        low, wide = 100 * errors[:, :2].mean(axis=0) / THRUST, 100 * errors[:, :2].std(axis=0) / THRUST
        sigma = 100 * np.mean([r[case][3] for r in runs]) / THRUST
        print(
            f"{case:32s} steady {low[0]:+.2f} {wide[0]:.2f}  flown {low[1]:+.2f} {wide[1]:.2f}  sigma {sigma:.2f}  "
            f"pulls {' '.join(f'{p:.2f}' for p in pulls.std(axis=0))} {np.std(single):.2f}  "
            f"fall {1e3 * errors[:, 2].std():.1f} ms  centre {1e3 * errors[:, 3].std():.0f}, {1e3 * errors[:, 4].std():.0f} mm"
        )


if __name__ == "__main__":
    main()
