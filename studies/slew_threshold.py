"""By how much does a body rate change in a hold, and by how much in a slew?

Of every record: the swing of the rate about any axis after a running median of five samples, its noise (third differences),
its median, and the swing over the limit of estimate/subject/activity.py, beyond which it counts as a slew.  Flown: every
shipped scenario, at nominal and double noise.  Recorded and from elsewhere: ../shared/data, where it is there.

Run: python studies/slew_threshold.py [flights]

Answer, 2026-11: 5e-4 rad/s and 20 sigma of the noise, hence _SWING and _SIGMAS in estimate/subject/activity.py.  Holds by wheels
swing by 1e-5 to 1.9e-4 rad/s (a low-orbit craft while its wheels coast), holds by thrusters by 1.1e-4 to 3.9e-4 (wheel-bias-fsds);
slews by 2e-3 to 1.1e-2: four limits and more.  A burn on thrusters shakes the craft by 5.9e-4 to 7.1e-4: no hold.  INSPIRESat-1
holds with 7.7e-4, eight sigma of its gyros' 1e-4, which is why noise counts; elsewhere the rate decides.  Craft that point to the
Earth (median 1.1e-3 rad/s) swing by 4e-5 and 5e-5: what they turn by does not count.  A slew slower than 5e-4 rad/s, 1.7 degrees
a minute, is taken for a hold.
"""

import gzip
import sys
from pathlib import Path

import numpy as np

from asflown import fly, load_telemetry
from asflown.estimate.subject import activity, without_spikes
from asflown.kit.scatter import difference_sigma
from asflown.sim.scenario import shipped_scenarios

DATA = Path(__file__).parents[2] / "shared" / "data"
EXAMPLES = Path(__file__).parents[1] / "examples"


def told(what: str, rates: list[np.ndarray]) -> None:
    """One line; rates (N,) of each axis [rad/s]."""
    swing = [float(np.ptp(without_spikes(r))) for r in rates]
    sigma = [difference_sigma(r, 3) for r in rates]
    limit = [max(activity._SWING, activity._SIGMAS * s) for s in sigma]
    share = max(w / x for w, x in zip(swing, limit, strict=True))
    median = max(abs(float(np.median(r))) for r in rates)
    print(f"{what:44s}{max(swing):10.2e}{max(sigma):10.2e}{median:10.2e}{share:8.2f}", flush=True)


def of_channels(what: str, telemetry) -> None:
    rates = [telemetry.channel(f"body_rate_{a}").usable.values for a in "xyz" if f"body_rate_{a}" in telemetry]
    if rates:
        told(what, rates)


def of_leo(file: Path) -> None:
    """Its gyro columns, in deg/s."""
    head, *lines = gzip.decompress(file.read_bytes()).decode().splitlines()
    columns = [head.split(";").index(f"GYR_{a}") for a in "XYZ"]
    rows = [[line.split(";")[k] for k in columns] for line in lines]
    w = np.radians(np.array([r for r in rows if all(r)], float))
    told(f"leo/{file.name}", list(w.T))


def main(flights: int = 2) -> None:
    print(f"{'record':44s}{'swing':>10s}{'noise':>10s}{'median':>10s}{'/ limit':>8s}   [rad/s]")
    for name in shipped_scenarios():
        for noise in ("nominal", "double"):
            for seed in range(flights):
                of_channels(f"{name}, noise {noise}, seed {seed}", fly(name, noise=noise, seed=seed).telemetry)
    for file in sorted((DATA / "simulated").glob("*.csv.gz")):
        of_channels(f"simulated/{file.name}", load_telemetry(file))
    for name, file in (("inspiresat1", "is1_adcs_1hz.csv"), ("iss", "iss_20181012_hours_00_12.csv.gz")):
        if (DATA / name / file).exists():
            of_channels(f"{name}/{file}", load_telemetry(DATA / name / file, channels=EXAMPLES / f"{name}.toml"))
    for file in sorted((DATA / "leo").glob("*.csv.gz")):
        of_leo(file)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2)
