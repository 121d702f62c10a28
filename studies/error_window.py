"""How wide should the local cubic through attitude error be?

Run: python studies/error_window.py [flights]

Answer, 2026-11: a half-width of 18 s, hence ERROR_HALF_WIDTH_S in estimate/torque/transfer.py.  RMS
error is least at 20 s on 15-s triangles (1.1 mN m) and flat from there on 30-s ones (0.9 to 1.0); each
second of width costs another 1 % of a 15-s peak, so a little less than 20 s is taken.  The second
derivative of 5 microrad of white noise at 2 s forbids much less.
"""

import sys

import numpy as np

from asflown import fly, load_craft
from asflown.estimate.torque import transfer as torque_transfer

sys.path.insert(0, __file__.rsplit("/", 1)[0])
from momentum_window import errors


def main(flights: int = 20) -> None:
    craft = load_craft("cassini")
    for profile in ("profile-1", "profile-2"):
        quiet = fly(profile, noise="none", seed=0)
        noisy = [fly(profile, seed=s) for s in range(flights)]
        print(
            f"\n{profile}: half-width [s]   peaks without noise [%]   with noise: rms [mN m]   largest peak error [%]"
        )
        for width in (10, 12, 14, 16, 18, 20, 24, 30):
            torque_transfer.ERROR_HALF_WIDTH_S = float(width)
            clean = errors(quiet, craft, method="transfer").peak_error_percent
            found = [errors(f, craft, method="transfer") for f in noisy]
            rms = 1e3 * np.mean([e.rms_Nm for e in found])
            worst = np.mean([np.max(np.abs(e.peak_error_percent)) for e in found])
            print(f"  {width:12d} {min(clean):+16.1f} … {max(clean):+5.1f} {rms:25.2f} {worst:24.1f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
