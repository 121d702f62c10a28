"""How near does each method come to the peak of a plume, in size and in time?

Run: python studies/plume_peak.py [FLIGHTS]      (of each density; 40 take three minutes)

Simulated flybys E3 on wheels, nominal noise: the jets of 004 Table 3 with the exponent 1 (a cusp where Cairo's axis is crossed) and
2 (a round top).  Methods as in ``asflown density``; the peak of the true curve is at +39.3 and +33.1 s.

Answer, 2026-11 (40 flights; exponent 1, then 2): fused is +1.2 ± 2.6 and +0.5 ± 2.4 % off, -3.1 ± 1.6 and -0.4 ± 1.4 s late, RMS 1.9 and 1.7 % of
the peak, the next best 3.2 and 3.4 %; the whole table is in docs/theory/density.md.  Hence fused is the default, and the doubt about a cusp's time.
"""

import sys

import numpy as np

from asflown.craft.load import load_craft
from asflown.estimate.density import density
from asflown.sim.fly import fly

CLOSEST_S, TRUE_SCALE = 180.0, 3.4222e9
METHODS = {
    "polynomial, degree 12": {"method": "polynomial", "variant": "printed"},
    "transfer, printed": {"method": "transfer", "variant": "printed"},
    "Hankel, printed (004)": {"variant": "printed"},
    "momentum": {"method": "momentum"},
    "transfer": {"method": "transfer"},
    "fused": {},
}


def flight(seed: int, exponent: int):
    return fly(
        "quiet", craft="cassini", epoch="2008-03-12T19:03:12", duration="480 s", seed=seed,
        torques=[{"shape": "plume", "closest_approach": f"{CLOSEST_S} s", "exponent": exponent}],
    )  # fmt: skip


def main(flights: int) -> None:
    craft = load_craft("cassini")
    for exponent in (1, 2):
        rows: dict[str, list] = {name: [] for name in METHODS}
        for seed in range(flights):
            f = flight(seed, exponent)
            at_s, peak, _ = f.truth.peaks[0]
            for name, how in METHODS.items():
                r = density(f.telemetry, craft, "E3", CLOSEST_S, **how)
                truth = -np.interp(r.time_s + CLOSEST_S, f.truth.time_s, f.truth.torque_Nm[:, 2]) / TRUE_SCALE
                off, late = r.peak.density_kgm3 + peak / TRUE_SCALE, r.peak.time_s + CLOSEST_S - at_s
                inside = (r.time_s > -20) & (r.time_s < 130)
                rms = np.sqrt(np.nanmean((r.density_kgm3 - truth)[inside] ** 2))
                rows[name].append((
                    100 * off * TRUE_SCALE / -peak, late, 100 * rms * TRUE_SCALE / -peak,
                    off / r.peak.sigma_shape_kgm3, late / (r.peak.sigma_time_s or np.nan),
                ))  # fmt: skip
        print(f"exponent {exponent}, {flights} flights: mean ± sd; pulls are rms; within: share of pulls below 1")
        for name, values in rows.items():
            v = np.array(values)
            pulls = np.sqrt(np.mean(v[:, 3:] ** 2, axis=0))
            within = np.mean(np.abs(v[:, 3:]) < 1, axis=0)
            print(
                f"  {name:<22} peak {v[:, 0].mean():+5.1f} ± {v[:, 0].std():4.1f} %   time {v[:, 1].mean():+5.1f} ± {v[:, 1].std():3.1f} s"
                f"   rms {v[:, 2].mean():4.1f} % of the peak   pulls {pulls[0]:.2f} {pulls[1]:.2f}   within {within[0]:.2f} {within[1]:.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
