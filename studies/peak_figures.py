"""How should a figure of merit take a peak's height from drawn torques?

Run: python studies/peak_figures.py [seed]     (a minute)

Flies the shipped mission, and takes both peak figures of all twenty actuations from each drawn torque's own extreme
within some reach of the mean curve's, for several reaches; 0 is the draws at the mean curve's extreme itself.
Prints the error's mean and scatter, the pulls, and how often the 95 % interval holds.

Answer, 2026-11 (seed 5): reach 0.  A mechanism's torque is smoother than drawn ones, whose extremes are too high.

    reach [s]   error [%]        pulls: mean, rms   in 95 %
    0.0         +1.9 +- 6.8       +0.25   0.86       0.95
    0.5         +5.7 +- 6.9       +0.70   1.11       0.90
    1.0         +7.7 +- 6.9       +1.00   1.35       0.85
    2.5         +9.5 +- 6.7       +1.33   1.64       0.82

Triangles are the other way round: there the extreme of the mean curve is 2 to 4 % low, and the result's own peaks
(TorqueResult.peak) take each draw's extreme within 2.5 s.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from asflown import load_craft, load_telemetry
from asflown.kit.ensemble import spread
from asflown.sim.mission.flown import fly_mission
from asflown.trends.entries.actuation import torque_about_hinge
from asflown.trends.entries.events import load_events


def main(seed: int) -> None:
    craft = load_craft("cassini")
    with tempfile.TemporaryDirectory() as folder:
        truth = {e["id"]: e["true"] for e in fly_mission("cassini-mission", folder, seed=seed)["events"]}
        flown = [e for e in load_events(Path(folder) / "events.toml") if e.file is not None]
        torques = [(torque_about_hinge(load_telemetry(e.file), craft, e), truth[e.id]) for e in flown]
    print("reach [s]   error [%]        pulls: mean, rms   in 95 %")
    for reach in (0.0, 0.5, 1.0, 2.5):
        errors, pulls = [], []
        for torque, true in torques:
            for sign, name in ((1, "peak_positive_Nm"), (-1, "peak_negative_Nm")):
                drawn = np.mean([extreme(torque, t, sign, reach) for t in torque.excursions(81.0, sign)[:2]], axis=0)
                errors.append(100 * (drawn.mean() / true[name] - 1))
                pulls.append(sign * (drawn.mean() - true[name]) / spread(drawn))
        print(f"{reach:.1f}         {np.mean(errors):+.1f} +- {np.std(errors):.1f}       {np.mean(pulls):+.2f}   "
              f"{np.sqrt(np.mean(np.square(pulls))):.2f}       {np.mean(np.abs(pulls) < 1.96):.2f}")  # fmt: skip


def extreme(torque, at_s: float, sign: int, reach_s: float) -> np.ndarray:
    """(K,), each drawn torque's own extreme within reach of a time."""
    near = np.abs(torque.drawn_time_s - at_s) <= reach_s + 1e-9
    return sign * np.max(sign * torque.drawn_Nm[:, near], axis=1)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
