"""Do the Space Station's commanded torque, body rates and stored momentum tell one story?

Run: python studies/iss_stored_momentum.py [FOLDER FOR PICTURES] (3 minutes).  The recording is looked for in
$ASFLOWN_FLIGHT_DATA, else in ../shared/data.  Answer, 2026-11: yes.  dh/dt = -u - w x h with nothing but
h(0) fitted gives the reported |h| back to 3.7-8.5 N m s rms over the stretches of 0.5 h and more without a
gap, and to 3.2-13.3 where pauses of up to 30 s are bridged (0.5-1.6 h).  Turning h the wrong way leaves
42-2900.  The sign of u cannot be told: -u with -h(0) gives the same |h| to the last digit.

The second part sets the external torque (momentum method) beside the gravity gradient of the craft's
inertia, and says what part of its scatter is noise: inertia times slope of a noisy rate.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import asflown
from asflown.dynamics.environment import gravity_gradient
from asflown.dynamics.momentum import stored_momentum
from asflown.kit.regression import local_polynomial
from asflown.kit.rotations import rotation
from asflown.kit.timeline import NS, segments
from asflown.plots.figure import BLUE, GREY, ORANGE, RED, breaks, new_figure, save
from asflown.telemetry.attitude import together
from asflown.telemetry.screening import sample_noise

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("ASFLOWN_FLIGHT_DATA", ROOT.parent / "shared" / "data"))
RECORDING = DATA / "iss" / "iss_20181012_hours_00_12.csv.gz"
AXES = ("x", "y", "z")
SHORTEST_S = 1800.0
BRIDGES = (5, 30)  # missing samples in a row that do not end a stretch; 5 is the house rule
LONG_WINDOW_S = 600.0


def recorded():
    if not RECORDING.exists():
        sys.exit(f"{RECORDING.name} is not there: set ASFLOWN_FLIGHT_DATA to the folder that holds iss/")
    return asflown.load_telemetry(RECORDING, channels=ROOT / "examples" / "iss.toml")


def balance(telemetry, missing_bridged: int, shortest_s: float = SHORTEST_S):
    """Stretches of (time [s], u (N, 3), w (N, 3), |h| (N,)) in which all seven channels go on together."""
    names = [f"control_torque_{a}" for a in AXES] + [f"body_rate_{a}" for a in AXES] + ["wheel_momentum_magnitude"]
    tai_ns, v = together(telemetry, names)
    s = telemetry.seconds(tai_ns)
    for part in segments(tai_ns, missing_bridged, NS):
        if s[part][-1] - s[part][0] >= shortest_s:
            yield s[part], v[part, :3], v[part, 3:6], v[part, 6]


def fitted_momentum(time_s, u, omega, size):
    """h(0) for which |h| comes nearest to ``size``. Returns h(0) (3,), |h| (N,) and the rms left. [N m s]

    h is affine in h(0); |h| is not, so the fit starts from all six axes and the best is kept."""
    moved = stored_momentum(time_s, u, omega, np.zeros(3))
    turned = np.stack([stored_momentum(time_s, 0 * u, omega, e) for e in np.eye(3)], axis=2)

    def magnitude(h0):
        return np.linalg.norm(moved + turned @ h0, axis=1)

    starts = size[0] * np.vstack([np.eye(3), -np.eye(3)]) + 0.02 * size[0]  # off the axes: none is a saddle
    fits = [least_squares(lambda h0: magnitude(h0) - size, start) for start in starts]
    best = min(fits, key=lambda f: f.cost)
    return best.x, magnitude(best.x), float(np.sqrt(np.mean(best.fun**2)))


def pull_of_gravity(telemetry, I_B) -> tuple[np.ndarray, np.ndarray]:
    """Seconds (N,) and 3 mu / r^5 r x I r in body axes (N, 3) [N m], for a constant inertia."""
    names = [f"quaternion_{m}" for m in "wxyz"] + [f"orbit_position_{a}" for a in AXES]
    tai_ns, v = together(telemetry, names)
    return telemetry.seconds(tai_ns), gravity_gradient(I_B, rotation(v[:, :4]).inv().apply(v[:, 4:]))


def slope_noise(half_width_s: float) -> float:
    """Sigma of a local cubic's slope per unit white noise on 1-Hz samples. [1/s]"""
    t = np.arange(-3 * half_width_s, 3 * half_width_s + 1)
    fit = local_polynomial(t, np.zeros_like(t), np.zeros(1), degree=3, half_width=half_width_s)
    return float(np.sqrt(fit.variance([0, 1, 0])[0]))


def draw_balance(stretches, folder: Path) -> None:
    figure, (above, below) = new_figure(2, 1, width=9, height=2.3)
    for k, (s, u, omega, size) in enumerate(stretches):
        _, h, _ = fitted_momentum(s, u, omega, size)
        thin = slice(None, None, 10)
        above.plot(s[thin] / 3600, size[thin], color=BLUE, linewidth=2.5, label="reported |h|" if k == 0 else None)
        above.plot(
            s[thin] / 3600, h[thin], color=ORANGE, linewidth=0.9, label="from u and w, h(0) fitted" if k == 0 else None
        )
        below.plot(s[thin] / 3600, (size - h)[thin], color=GREY, linewidth=0.9)
    above.set_ylabel("|h| [N m s]")
    above.legend(fontsize=8, frameon=False, loc=(0.39, 0.05))  # no stretch there
    below.set_ylabel("reported less\nfitted [N m s]")
    below.set_xlabel("time from the epoch [h]")
    save(figure, folder / "iss-momentum.png")


def draw_torque(result, gravity, folder: Path) -> None:
    figure, panels = new_figure(3, 1, width=7.5, height=1.5)
    for j, ax in enumerate(panels):
        thin = slice(None, None, 10)
        ax.plot(
            result.time_s[thin] / 3600, result.torque_Nm[thin, j], color=BLUE, linewidth=1, label="I α + ω × Iω − u"
        )
        g_t, g = breaks(gravity[0][thin], gravity[1][thin, j], 60)
        ax.plot(g_t / 3600, g, color=RED, linewidth=1, label="gravity gradient")
        ax.set_ylabel(f"{AXES[j]} [N m]")
        ax.set_ylim(*((-9, 9) if j == 1 else (-1, 8)))
    panels[0].legend(fontsize=8, frameon=False, ncols=2, loc="lower right")
    panels[0].set_title(f"External torque on the Space Station, window {LONG_WINDOW_S:.0f} s", loc="left", fontsize=10)
    panels[-1].set_xlabel("time from the epoch [h]")
    save(figure, folder / "iss-torque.png")


def main(folder: Path | None = None) -> None:
    telemetry = recorded()
    for bridge in BRIDGES:
        print(f"\n|h| [N m s], stretches of {SHORTEST_S / 3600:g} h and more; up to {bridge} missing samples bridged")
        print(
            "  from [s]   hours   mean |h|   its std   rms left   -u: rms   w reversed: rms   h(0) x, y, z (or its negative)"
        )
        for s, u, omega, size in balance(telemetry, bridge):
            h0, _, rms = fitted_momentum(s, u, omega, size)
            mirrored, backwards = fitted_momentum(s, -u, omega, size)[2], fitted_momentum(s, u, -omega, size)[2]
            print(f"  {s[0]:8.0f} {(s[-1] - s[0]) / 3600:7.2f} {size.mean():10.0f} {size.std():9.0f} {rms:10.2f} {mirrored:9.2f}"
                  f" {backwards:17.0f}   " + " ".join(f"{v:+7.0f}" for v in h0))  # fmt: skip

    craft = asflown.load_craft("iss")
    I_B = craft.at(telemetry.epoch_ns).inertia_kgm2
    at, gravity = pull_of_gravity(telemetry, I_B)
    print("\nExternal torque [N m]: momentum method, and a gravity gradient of the craft's inertia")
    print(
        "  window   axis   mean    std   1 sigma stated   rate noise [rad/s]   I x noise x slope   gravity: mean    std   correlation"
    )
    results = {}
    for window in (None, LONG_WINDOW_S):
        result = results[window] = asflown.torque(telemetry, craft, method="momentum", window_s=window)
        half = result.settings["half_width_s"]
        known = np.isfinite(result.torque_Nm).all(axis=1)
        for j, axis in enumerate(AXES):
            T, g = result.torque_Nm[known, j], np.interp(result.time_s[known], at, gravity[:, j])
            noise = sample_noise(telemetry.channel(f"body_rate_{axis}"))
            print(f"  {2 * half:4.0f} s   {axis}    {T.mean():+6.2f} {T.std():6.2f} {np.median(result.torque_sigma_Nm[known, j]):12.2f}"
                  f" {noise:20.1e} {I_B[j, j] * noise * slope_noise(half):17.2f} {g.mean():+18.2f} {g.std():6.2f}"
                  f" {np.corrcoef(T, g)[0, 1]:+10.2f}")  # fmt: skip
        print(f"           known {known.mean():.1%} of the time; the rest is null")
    if folder is not None:
        draw_balance(list(balance(telemetry, 5)), folder)
        draw_torque(results[LONG_WINDOW_S], (at, gravity), folder)
        print(f"\npictures in {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
