"""Speed of the inertia fit, beside the same fit with SciPy's general-purpose least squares and a numerical Jacobian.

Run: python benchmarks/inertia_speed.py [--day].

The problem: 2,400 s of Cassini's slews, 17 constants (tensor, momentum, torque, two time offsets, bias), noise levels
given.  Ours solves for all constants in one filter pass, which carries their columns along.  The peer asks
scipy.optimize.least_squares for the constants that make the whitened innovations least; its residuals come either from
a Kalman filter in NumPy, as one would write it in an afternoon, or from our compiled one.  --day adds a day of
telemetry at 4 Hz, whole: slews found, levels fitted, everything.
"""

from __future__ import annotations

import argparse
import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from asflown.craft.load import load_craft
from asflown.estimate.inertia.gather import slew_record
from asflown.estimate.inertia.likelihood import Around, solved
from asflown.estimate.inertia.linear import linearized
from asflown.estimate.inertia.motion import Reference, instants
from asflown.estimate.inertia.tensor import inertia
from asflown.estimate.inertia.whole_motion import carried, fit_slews
from asflown.estimate.subject.subject import subject_of
from asflown.kit.regressed import run
from asflown.sim.flight.closed_loop import fly


def numpy_innovations(s) -> np.ndarray:
    """Whitened innovations of a Steps, by the textbook."""
    x, P, out = np.zeros(s.A.shape[1]), s.covariance.copy(), np.empty(len(s.y))
    for k in range(len(s.kind)):
        if k > 0:
            x = s.A[k] @ x + s.b[k]
            P = s.A[k] @ P @ s.A[k].T + np.tensordot(s.scale[k], s.driven[:, s.kind[k]], axes=1)
        for m in range(s.start[k], s.start[k + 1]):
            h = s.H[m]
            Ph = P @ h
            S = h @ Ph + s.R[m]
            e = s.y[m] - h @ x
            out[m] = e / np.sqrt(S)
            x = x + Ph * (e / S)
            P = P - np.outer(Ph, Ph) / S
    return out


def compiled_innovations(s) -> np.ndarray:
    f = run(replace(s, Z=s.Z[:, :0]))
    return f.innovation[:, 0] / np.sqrt(f.variance)


def timed(work, repeat: int):
    best = np.inf
    for _ in range(repeat):
        start = time.perf_counter()
        answer = work()
        best = min(best, time.perf_counter() - start)
    return answer, best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--day", action="store_true")
    asked = parser.parse_args()
    craft = load_craft("cassini")
    flight = fly("slews", seed=1)
    record = slew_record(subject_of(flight.telemetry, craft, moving=None))
    fit = fit_slews(record)
    layout, away = fit.layout, fit.beta.copy()
    away[:6] *= 1.02  # where both begin: a tensor 2 % off, and no torque
    away[layout.torque] = 0
    scale = fit.sigma
    free = Around(np.zeros((layout.size, layout.size)), np.zeros(layout.size))

    def model_at(beta):
        motion = fit.motion.at(instants(record, beta))
        model = linearized(Reference(record, beta, motion), "body", fit.levels, np.eye(3))
        loosened = carried(fit.weighted.loosened, fit.motion, motion)
        return model.at(fit.levels, loosened, np.ones(len(model.y), bool))

    def ours():
        beta = away.copy()
        for _ in range(8):
            f = run(model_at(beta))
            step = solved(f, layout, free)[0]
            beta += step
            if np.max(np.abs(step) / scale) < 1e-3:
                break
        return beta

    def peer(innovations):
        def residuals(x):
            return innovations(model_at(away + x * scale))

        return away + scale * least_squares(residuals, np.zeros(len(away)), jac="2-point", xtol=1e-6, ftol=1e-8).x

    ours()
    mine, quick = timed(ours, 5)
    compiled, middle = timed(lambda: peer(compiled_innovations), 1)
    plain, slow = timed(lambda: peer(numpy_innovations), 1)
    print(f"ours                                          {1e3 * quick:10.1f} ms")
    for name, answer, took in (
        ("least_squares, filter in NumPy", plain, slow),
        ("least_squares, our compiled filter", compiled, middle),
    ):
        apart = np.max(np.abs(answer - mine)[:6] / scale[:6])
        print(f"{name:44}  {1e3 * took:10.1f} ms   {took / quick:6.1f} times ours; tensors {apart:.1g} sigma apart")
    _, whole = timed(lambda: fit_slews(record), 2)
    print(f"whole fit, levels fitted too                  {1e3 * whole:10.1f} ms")
    if asked.day:
        rates = {"wheel_rate": "0.25 s", "body_rate": "0.25 s", "quaternion": "0.25 s", "attitude_error": "0 s"}
        day = fly("slews", seed=1, changes={"duration": "86400 s", "telemetry": rates}).telemetry
        samples = sum(len(c.values) for c in day.channels.values())
        result, took = timed(lambda: inertia(day, craft), 1)
        print(f"a day at 4 Hz, {samples:,} samples             {took:10.1f} s    {result.settings['rounds']} rounds")


if __name__ == "__main__":
    main()
