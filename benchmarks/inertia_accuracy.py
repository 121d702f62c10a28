"""How well the inertia tensor comes back from simulated slews: pulls, scatter against the Cramér-Rao bound, coverage.

Run: python benchmarks/inertia_accuracy.py [--runs 200] [--also 60] [--others 20] [--scenario slews] [--jobs 2] [--orbit 0].
About 3 s a fit and core; --orbit N: N drawn small satellites in low orbit instead (orbit_slews.py), 8 s each.

Every flight is fitted by `consistent` as a user would.  The first of them are fitted twice more: with the noise levels
known, whose covariance is the bound (the inverse Fisher information of the same model), and with both scale errors
drawn from their priors and put into the craft file and the telemetry, for which the total sigma must cover.
--others puts flights under other conditions beside.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from orbit_slews import craft_of, drawn
from orbit_slews import flight as flown

from asflown.craft.load import load_craft
from asflown.dynamics.rigid_body import ELEMENTS, elements_of
from asflown.estimate.inertia.gather import slew_record
from asflown.estimate.inertia.tensor import RATE_SCALE, inertia
from asflown.estimate.inertia.whole_motion import fit_slews
from asflown.estimate.subject import SPIN_SHARE
from asflown.estimate.subject.subject import subject_of
from asflown.sim.flight.closed_loop import fly
from asflown.sim.flight.sensors import NOISE, stream

CONDITIONS = {
    "nominal": {},
    "half noise": {"noise": "half"},
    "double noise": {"noise": "double"},
    "booms": {"flexible": True},
    "slosh": {"slosh": True, "craft_mass": "3170 kg"},
    "slosh, not described": {"slosh": True, "craft_mass": "3170 kg"},
    "booms, not described": {"flexible": True},
    "1 % lost": {"telemetry": {"dropout": 0.01}},
    "random phases": {"telemetry": {"random_phases": True}},
    "gap in a slew": {"telemetry": {"gaps": [{"start": "150 s", "stop": "210 s"}]}},
    "rubbing wheels": {"friction": True},
    "inertia 2 % high in the loop": {"controller": {"inertia": "7509 6253 3825 -164 -12 149 kg m2"}},
}


def one(task):
    scenario, seed, changes, more, told = task
    craft = load_craft("cassini")
    if not told:
        craft = craft.model_copy(update={"slosh": (), "flexible_modes": ()})
    flight = fly(scenario, seed=seed, changes=changes)
    truth = elements_of(flight.inertia_kgm2)
    result = inertia(flight.telemetry, craft)
    sigma = elements_of(result.inertia_sigma_random_kgm2)
    out = {"error": elements_of(result.inertia_kgm2) - truth, "sigma": sigma,
           "torque": result.external_torque_Nm - _torque(flight), "torque_sigma": result.external_torque_sigma_Nm}  # fmt: skip
    if more:
        noise = NOISE[changes.get("noise", "nominal")]
        record = slew_record(subject_of(flight.telemetry, craft, moving=None))
        free = fit_slews(record)
        known = replace(
            free.levels, wheel=noise.wheel_rad_s, rate=noise.gyro_rad_s, attitude=noise.attitude_white_rad,
            coloured=noise.attitude_coloured_rad, coloured_s=noise.attitude_time_s,
        )  # fmt: skip
        fit = fit_slews(record, levels=known)
        out["bound"] = np.sqrt(np.diag(fit.covariance)[:6])

        wheel = SPIN_SHARE * stream(seed, "wheel scale").standard_normal()
        rate = RATE_SCALE * stream(seed, "rate scale").standard_normal()
        wheels = tuple(w.model_copy(update={"spin_inertia": w.spin_inertia * (1 + wheel)}) for w in craft.wheels)
        channels = {
            n: replace(c, values=c.values * (1 + rate)) if n.startswith("body_rate") else c
            for n, c in flight.telemetry.channels.items()
        }
        drawn = inertia(replace(flight.telemetry, channels=channels), craft.model_copy(update={"wheels": wheels}))
        out["drawn"] = (elements_of(drawn.inertia_kgm2) - truth) / elements_of(drawn.inertia_sigma_kgm2)
    return out


def in_orbit(task):
    """One drawn craft in low orbit, by one method: pulls of the six elements, whether it settled, and the largest error over the moments."""
    seed, method = task
    made = drawn(seed)
    result = inertia(flown(made), craft_of(made), method=method)
    error = elements_of(result.inertia_kgm2 - made.inertia)
    share = np.abs(error).max() / np.diag(made.inertia).mean()
    return error / elements_of(result.inertia_sigma_random_kgm2), result.settled, share


def report_orbit(method, found) -> None:
    pulls = np.array([p for p, settled, _ in found if settled])
    print(f"in low orbit, {method}: {len(found)} flights, {len(pulls)} settled" + "".join(f"{e:>9}" for e in ELEMENTS))
    print(row("mean pull", pulls.mean(axis=0)))
    print(row("width of the pulls", pulls.std(axis=0, ddof=1)))
    print(row("95 % interval holds", np.mean(np.abs(pulls) < 1.96, axis=0)))
    share = np.array([s for _, _, s in found])
    print(f"  all elements: width {np.sqrt(np.mean(pulls**2)):.2f}, {np.mean(np.abs(pulls) < 1.96):.3f} held, largest pull {np.abs(pulls).max():.1f}; "
          f"largest error of an element over the mean moment: median {100 * np.median(share):.4f} %, worst {100 * share.max():.4f} %", flush=True)  # fmt: skip


def _torque(flight) -> np.ndarray:
    given = [t.torque for t in flight.scenario.torques if t.shape == "constant"]
    return np.sum(given, axis=0) if given else np.zeros(3)


def row(name, values, digits=2):
    return f"  {name:34}" + "".join(f"{v:>9.{digits}f}" for v in values)


def report(name, found) -> None:
    error, sigma = (np.array([f[k] for f in found]) for k in ("error", "sigma"))
    pull = error / sigma
    torque = np.array([f["torque"] / f["torque_sigma"] for f in found])
    print(f"{name}: {len(found)} flights" + " " * (26 - len(name)) + "".join(f"{e:>9}" for e in ELEMENTS))
    print(row("mean pull", pull.mean(axis=0)))
    print(row("width of the pulls", pull.std(axis=0, ddof=1)))
    print(row("scatter [kg m2]", error.std(axis=0, ddof=1), 3))
    print(row("stated sigma [kg m2]", sigma.mean(axis=0), 3))
    print(row("95 % interval holds", np.mean(np.abs(pull) < 1.96, axis=0)))
    print(row("external torque: pulls, mean, width", [*torque.mean(axis=0), *torque.std(axis=0, ddof=1)]), flush=True)
    more = [f for f in found if "bound" in f]
    if more:
        print(f" of {len(more)} of them")
        floor, drawn = (np.array([f[k] for f in more]) for k in ("bound", "drawn"))
        print(row("Cramér-Rao bound [kg m2]", floor.mean(axis=0), 3))
        print(row("all flights' scatter over it", error.std(axis=0, ddof=1) / np.sqrt(np.mean(floor**2, axis=0))))
        print(row("scales drawn: 95 % of the total holds", np.mean(np.abs(drawn) < 1.96, axis=0)))
        print(row("scales drawn: width of total pulls", drawn.std(axis=0, ddof=1)), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--also", type=int, default=60, help="flights with the bound and with scale errors drawn")
    parser.add_argument("--others", type=int, default=20, help="flights under each other condition")
    parser.add_argument("--only", help="one condition of the list")
    parser.add_argument("--scenario", default="slews")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--orbit", type=int, default=0, help="so many drawn craft in low orbit, and nothing else")
    asked = parser.parse_args()
    with ProcessPoolExecutor(asked.jobs) as pool:
        if asked.orbit:
            for method in ("gls", "consistent"):
                report_orbit(method, list(pool.map(in_orbit, [(seed, method) for seed in range(asked.orbit)])))
            return
        for name, changes in CONDITIONS.items():
            if asked.only not in (None, name):
                continue
            runs, also = (asked.runs, asked.also) if name == "nominal" else (asked.others, 0)
            told = not name.endswith("not described")
            tasks = [(asked.scenario, seed, changes, seed < also, told) for seed in range(runs)]
            if tasks:
                report(name, list(pool.map(one, tasks)))


if __name__ == "__main__":
    main()
