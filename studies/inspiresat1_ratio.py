"""Which wheel of INSPIRESat-1 turns about which body axis, which way, and how large is the body for it?

Run: python studies/inspiresat1_ratio.py [FOLDER FOR PICTURES].  The recording is looked for in
$ASFLOWN_FLIGHT_DATA, else in ../shared/data.  Answer, 2026-11: wheel 1 with x, wheel 3 with y, both
opposite to the axis; inertia over spin inertia 4100 (3800-4450) about x and 5300 (4850-6000) about y.
Wheel 2 gives no kick: z is left, and its ratio and sign cannot be had from this recording.  These are
the values in craft/profiles/inspiresat1.toml.

A wheel that sticks near rest and tears loose exchanges momentum with the body faster than any torque
from outside: I dw = -a J drho.  Noise sits on both rates, so neither regression of one on the other is
right; the slope is Deming's, with each noise measured where the wheel does not stick.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import asflown
from asflown.dynamics.momentum import wheel_momentum
from asflown.plots.figure import BLUE, GREY, ORANGE, RED, new_figure, save

ROOT = Path(__file__).resolve().parents[1]
RECORDING = (
    Path(os.environ.get("ASFLOWN_FLIGHT_DATA", ROOT.parent / "shared" / "data")) / "inspiresat1/is1_adcs_1hz.csv"
)
WHEELS, AXES = ("1", "2", "3"), ("x", "y", "z")

#: Samples in which a wheel sticks and tears loose, and in which it turns steadily: read off the picture.
STICKING = {"1": slice(352, 462), "3": slice(0, 142)}
STEADY = {"1": slice(0, 350), "3": slice(150, 476)}
STEPS_S = (1, 2, 3, 4, 5)
BLOCK_S = 12  # longer than a kick and what the controller makes of it


def recorded() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seconds from the first sample (N,), wheel rates (N, 3) and body rates (N, 3). [rad/s]"""
    if not RECORDING.exists():
        sys.exit(f"{RECORDING.name} is not there: set ASFLOWN_FLIGHT_DATA to the folder that holds inspiresat1/")
    t = asflown.load_telemetry(RECORDING, channels=ROOT / "examples" / "inspiresat1.toml")
    rho = np.stack([t.channel(f"wheel_rate_{n}").values for n in WHEELS], axis=1)
    omega = np.stack([t.channel(f"body_rate_{a}").values for a in AXES], axis=1)
    s = t.seconds(t.channel("body_rate_x").tai_ns)
    return s - s[0], rho, omega


def correlations(rho, omega, step: int = 2) -> np.ndarray:
    """(3, 3): changes over ``step`` samples of each body axis (rows) with those of each wheel (columns)."""
    return np.corrcoef((omega[step:] - omega[:-step]).T, (rho[step:] - rho[:-step]).T)[:3, 3:]


def deming(x, y, noise_ratio: float) -> float:
    """Slope of y on x where both are noisy; ``noise_ratio``: variance of y's noise over that of x's."""
    xx, yy, xy = x @ x, y @ y, x @ y
    d = yy - noise_ratio * xx
    return float((d + np.sqrt(d * d + 4 * noise_ratio * xy * xy)) / (2 * xy))


def ratio(rho, omega, wheel: str, axis: str, step: int, draws: int = 1000) -> dict:
    """I / J from changes over ``step`` seconds while the wheel sticks, positive where w and rho rise together.

    The 95 % interval resamples blocks of a kick's length (block bootstrap)."""
    x = rho[step:, WHEELS.index(wheel)] - rho[:-step, WHEELS.index(wheel)]
    y = omega[step:, AXES.index(axis)] - omega[:-step, AXES.index(axis)]
    steady, sticking = STEADY[wheel], STICKING[wheel]
    noise = np.var(y[steady][:-step]) / np.var(x[steady][:-step])
    x, y = x[sticking], y[sticking]
    x, y = x - x.mean(), y - y.mean()
    rng, n = np.random.default_rng(1), len(x)
    drawn = []
    for _ in range(draws):
        start = rng.integers(0, n - BLOCK_S + 1, n // BLOCK_S + 1)
        k = (start[:, None] + np.arange(BLOCK_S)).ravel()[:n]
        drawn.append(1 / deming(x[k], y[k], noise))
    low, high = np.percentile(drawn, [2.5, 97.5])
    return {"ratio": 1 / deming(x, y, noise), "low": low, "high": high,
            "body on wheel": (x @ x) / (x @ y), "wheel on body": (x @ y) / (y @ y)}  # fmt: skip


def turning_residual(h_xy, angle, sense: int, constant: bool) -> float:
    """Rms left of a transverse momentum (N, 2) fitted by a vector fixed in space, seen from a body turned
    by ``angle`` [rad] about z; ``sense`` -1 turns it the wrong way; ``constant`` adds one fixed in the body."""
    h = h_xy[:, 0] + 1j * h_xy[:, 1]
    columns = [np.exp(-1j * sense * angle)] + [np.ones(len(h))] * constant
    model = np.stack(columns, axis=1)
    left = h - model @ np.linalg.lstsq(model, h, rcond=None)[0]
    return float(np.sqrt(np.mean(np.abs(left) ** 2)))


def turned_about_z(omega) -> np.ndarray:
    """Angle about body z from the first sample on. [rad]"""
    return np.concatenate([[0.0], np.cumsum((omega[1:, 2] + omega[:-1, 2]) / 2)])


def whole_momentum_fit(rho, omega, inertia) -> tuple[np.ndarray, float, float]:
    """I w + h of all axes as a vector fixed in space plus the impulse of a torque fixed in the body.

    Returns that torque per spin inertia (3,) [rad/s2] and the rms left, transverse and along z [rad/s]."""
    craft = asflown.load_craft("inspiresat1").at(None)
    axes = np.array([w.axis for w in craft.wheels])
    H = wheel_momentum(axes, np.ones(3), rho) + omega * inertia
    turns = [Rotation.identity()]
    for w in (omega[1:] + omega[:-1]) / 2:
        turns.append(turns[-1] * Rotation.from_rotvec(w))
    to_space = np.stack([r.as_matrix() for r in turns])
    to_body = to_space.transpose(0, 2, 1)
    impulse = np.concatenate([np.zeros((1, 3, 3)), np.cumsum((to_space[1:] + to_space[:-1]) / 2, axis=0)])
    model = np.concatenate([to_body, to_body @ impulse], axis=2).reshape(-1, 6)
    found = np.linalg.lstsq(model, H.ravel(), rcond=None)[0]
    left = (H.ravel() - model @ found).reshape(-1, 3)
    return found[3:], float(np.sqrt(np.mean(np.sum(left[:, :2] ** 2, axis=1)))), float(np.std(left[:, 2]))


def draw(s, rho, omega, angle, folder: Path) -> None:
    figure, panels = new_figure(2, 2, width=9, height=2.5, sharex=False)
    for column, (wheel, axis, span, c) in enumerate(
        (("1", "x", slice(345, 470), 4100), ("3", "y", slice(0, 145), 5300))
    ):
        w, b = rho[span, WHEELS.index(wheel)], 1e3 * omega[span, AXES.index(axis)]
        panels[column].plot(s[span], w, color=BLUE, linewidth=1)
        panels[column].set_ylabel(f"wheel {wheel} [rad/s]")
        panels[column].set_title(f"wheel {wheel} sticks at zero and tears loose", loc="left", fontsize=10)
        below = panels[2 + column]
        below.plot(s[span], b, color=RED, linewidth=1, label=f"body {axis}, measured")
        fast = w - np.convolve(np.pad(w, 10, mode="edge"), np.ones(21) / 21, "valid")
        below.plot(s[span], 1e3 * fast / c + b.mean(), color=GREY, linewidth=1, linestyle="--",
                   label=f"quick part of wheel {wheel} / {c}")  # fmt: skip
        below.set_ylabel(f"body {axis} [mrad/s]")
        below.set_xlabel("time from the first sample [s]")
        below.legend(fontsize=7, frameon=False, loc="upper left", ncols=2)
        low, high = below.get_ylim()
        below.set_ylim(low, high + 0.25 * (high - low))
    save(figure, folder / "inspiresat1-kicks.svg")

    figure, panels = new_figure(1, 2, width=9, height=3.6, sharex=False)
    h = -rho[:, 0] - 1j * rho[:, 2]
    for ax, sense, title in ((panels[0], 1, "turning with the body"), (panels[1], -1, "turning the wrong way")):
        model = np.stack([np.exp(-1j * sense * angle), np.ones(len(h))], axis=1)
        fit = model @ np.linalg.lstsq(model, h, rcond=None)[0]
        ax.plot(h.real, h.imag, ".", markersize=2, color=BLUE, label="wheels 1 and 3")
        ax.plot(fit.real, fit.imag, color=ORANGE, linewidth=2, label="fit")
        rms = turning_residual(np.column_stack([h.real, h.imag]), angle, sense, True)
        ax.set_title(f"{title}: {rms:.2f} rad/s left", loc="left", fontsize=10)
        ax.set_xlabel("h about x per spin inertia [rad/s]")
        ax.set_aspect("equal")
        ax.legend(fontsize=7, frameon=False)
    panels[0].set_ylabel("h about y per spin inertia [rad/s]")
    save(figure, folder / "inspiresat1-turning.png")


def main(folder: Path | None = None) -> None:
    s, rho, omega = recorded()
    angle = turned_about_z(omega)
    print(f"{len(s)} samples; body z turns at {np.mean(omega[:, 2]):+.5f} rad/s, {angle[-1]:+.2f} rad in all")

    print("\nCorrelation of 2-s changes          wheel 1  wheel 2  wheel 3")
    for axis, row in zip(AXES, correlations(rho, omega), strict=True):
        print(f"  body {axis}                          " + "".join(f"{c:+9.3f}" for c in row))
    print(f"  (by chance within +-{2 / np.sqrt(len(s) / 2):.2f}, 2 sigma)")

    print("\nI/J from kicks          step    ratio   95 %              body on wheel   wheel on body")
    for wheel, axis in (("1", "x"), ("3", "y")):
        found = [ratio(rho, omega, wheel, axis, k) for k in STEPS_S]
        for k, r in zip(STEPS_S, found, strict=True):
            print(f"  wheel {wheel}, body {axis}       {k} s   {r['ratio']:6.0f}   {r['low']:5.0f} ... {r['high']:5.0f}"
                  f"   {r['body on wheel']:11.0f}   {r['wheel on body']:13.0f}")  # fmt: skip
        late = found[1:]  # over 1 s the two rates' sampling instants and averaging still matter
        print(f"    steps of 2-5 s: median {np.median([r['ratio'] for r in late]):.0f}, all 95 % intervals together "
              f"{min(r['low'] for r in late):.0f} ... {max(r['high'] for r in late):.0f}")  # fmt: skip

    x, y = rho[2:, 1] - rho[:-2, 1], omega[2:, 2] - omega[:-2, 2]
    x, y = x - x.mean(), y - y.mean()
    c, size = float(x @ y / np.sqrt((x @ x) * (y @ y))), 1 / np.sqrt(len(x) / 2)
    print(f"\nWheel 2, body z: correlation {c:+.3f} +- {size:.3f}. No kick: its noise is the tachometer's.")
    if abs(c) < 3 * size:
        print("  The sign is not established (below 3 sigma); that of wheels 1 and 3 is assumed.")
    print(
        f"  Regressions bracket I/J between {(x @ y) / (y @ y):.0f} and {(x @ x) / (x @ y):.0f}: no information. With three equal"
    )
    print("  wheels the triangle inequality leaves |Ix - Iy| ... Ix + Iy = 1200 ... 9400; 5000 is an assumption.")

    h = -rho[:, [0, 2]]
    print("\nTransverse wheel momentum per spin inertia [rad/s]: about its mean "
          f"{np.sqrt(np.sum(np.var(h, axis=0))):.2f}, in all {np.sqrt(np.mean(np.sum(h**2, axis=1))):.2f}; left after a fit")  # fmt: skip
    print("                                      fixed in space   and a part fixed in the body")
    swapped = h * [1, -1]
    for name, transverse, sense in (("as paired, turning with the body", h, 1), ("as paired, the wrong way", h, -1),
                                    ("one wheel's sign reversed", swapped, 1)):  # fmt: skip
        a, b = (turning_residual(transverse, angle, sense, constant) for constant in (False, True))
        print(f"  {name:36s} {a:10.2f} {b:20.2f}")
    print("  Reversing both signs, or both wheels and the sense, changes nothing: only kicks give the sign.")

    print("\nAll of I w + h, with a constant torque fixed in the body, per spin inertia")
    print("  Iz/J assumed   torque x, y, z [rad/s2]        left across z   along z [rad/s]")
    for iz in (1000, 3000, 5000, 7000, 9000):
        torque, across, along = whole_momentum_fit(rho, omega, np.array([4100.0, 5300.0, iz]))
        print(f"  {iz:8d}      {torque[0]:+8.3f} {torque[1]:+8.3f} {torque[2]:+8.3f} {across:18.2f} {along:14.2f}")
    if folder is not None:
        draw(s, rho, omega, angle, folder)
        print(f"\npictures in {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
