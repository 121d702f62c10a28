"""How wide should the local cubics through wheel momentum and body momentum be?

Run: python studies/momentum_window.py [flights]

Flies profiles 1 and 2 (triangles of 30 and 15 s) with nominal noise, and once without, and prints
for each pair of half-widths the error without noise at the peaks, and RMS error and largest peak error with noise.

Answer, 2026-11: 12 s for wheels and 20 s for the body, hence WHEEL_HALF_WIDTH_S and
BODY_HALF_WIDTH_S in estimate/torque_momentum.py.  Wheel rates are good (0.8 mN m s of momentum a
sample), so their window may be near the narrowest that five samples of 4 s allow; the gyro's
2 microrad/s is 10 mN m s of body momentum and needs the wider one.  RMS is flat around it (1.2 and 1.4
mN m against the printed method's 1.3 and 2.6).  No pair of windows has both small noise and small
loss at a 15-s corner: that takes all channels at once.
"""

import sys

import numpy as np

from asflown import disturbance_torque, fly, load_craft
from asflown.estimate import torque_momentum
from asflown.estimate.truth import against_truth

PAIRS = [(10, 14), (10, 20), (12, 12), (12, 16), (12, 20), (12, 24), (16, 16), (16, 20), (16, 24), (20, 20)]


def errors(flight, craft, **how):
    peaks = [(t, v) for t, v, _ in flight.truth.peaks]
    result = disturbance_torque(flight.telemetry, craft, axis="y", **how)
    return against_truth(result, flight.truth.time_s, flight.truth.torque_Nm[:, 1], peaks, "y")


def main(flights: int = 20) -> None:
    craft = load_craft("cassini")
    for profile in ("profile-1", "profile-2"):
        quiet = fly(profile, noise="none", seed=0)
        noisy = [fly(profile, seed=s) for s in range(flights)]
        print(
            f"\n{profile}: half-widths [s]   peaks without noise [%]   with noise: rms [mN m]   largest peak error [%]"
        )

        def row(name, quiet=quiet, noisy=noisy, **how):
            clean = errors(quiet, craft, **how).peak_error_percent
            found = [errors(f, craft, **how) for f in noisy]
            rms = 1e3 * np.mean([e.rms_Nm for e in found])
            worst = np.mean([np.max(np.abs(e.peak_error_percent)) for e in found])
            print(f"  {name:24s} {min(clean):+8.1f} … {max(clean):+5.1f} {rms:25.2f} {worst:24.1f}")

        row("printed", variant="printed")
        for wheels, body in PAIRS:
            torque_momentum.WHEEL_HALF_WIDTH_S, torque_momentum.BODY_HALF_WIDTH_S = float(wheels), float(body)
            row(f"wheels {wheels}, body {body}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
