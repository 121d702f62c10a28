"""How heavy should the tail of the torque slope's jumps be in the fused method?

Run: python studies/jump_freedom.py [flights]

Answer, 2026-11 (4 flights each): 0.3.  RMS on triangles of 30 and 15 s and on the cover is 0.31, 0.43 and 1.11 mN m;
with 1.0 it is 0.33, 0.40 and 1.18, and the cover's 95 % band covers 0.88 for 0.90; with 2.0 it is 0.39 and
0.52 on the triangles and corners are held in 0.82 of the cases for 0.90 and more.  At 0.1 the sampler
no longer moves between scales: 0.53, 0.91 and 2.63.
"""

import sys

from asflown import error_budget, load_craft
from asflown.estimate import torque_fused


def main(flights: int = 4) -> None:
    craft = load_craft("cassini")
    print("degrees of freedom   scenario       rms [mN m]   68 %   95 %   95 % at corners")
    for freedom in (0.1, 0.3, 1.0, 2.0):
        torque_fused.JUMP_FREEDOM = freedom
        for scenario in ("profile-1", "profile-2", "cover-deploy"):
            (row,) = error_budget(scenario, craft, ["fused"], runs=flights, seed=100)
            corner = "" if row.corner_coverage_95 is None else f"{row.corner_coverage_95.value:.2f}"
            print(f"{freedom:18.1f}   {scenario:14s} {1e3 * row.rms_Nm.value:10.2f} {row.coverage_68.value:6.2f} "
                  f"{row.coverage_95.value:6.2f}   {corner}")  # fmt: skip


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4)
