"""How fast the fused torque and what it stands on are, beside their peers in the same process.

Run: make bench.  Every answer is compared with the peer's too: a ratio of speeds means something only
between equal answers.
"""

from __future__ import annotations

import time

import numpy as np
from skmisc.loess import loess
from statsmodels.tsa.statespace import kalman_filter, kalman_smoother

import asflown
from asflown.estimate.fused.held_body import HeldBody, LoopLevels
from asflown.estimate.fused.series import ATTITUDE_ERROR, BODY_RATE, MOMENTUM, Series, arrange
from asflown.kit.ensemble import simulate
from asflown.kit.regression import local_polynomial
from asflown.kit.smoother import Measurements, Model, smooth

_DAY_S = 86_400
_CADENCE_S = {ATTITUDE_ERROR: 2, BODY_RATE: 4, MOMENTUM: 4}


def best_of(runs, work):
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        answer = work()
        times.append(time.perf_counter() - start)
    return min(times), answer


def day() -> tuple[Model, Measurements]:
    """One axis of a craft under a torque, a day of its telemetry drawn from the model itself."""
    body = HeldBody.under(asflown.load_craft("cassini").wheel_controller, inertia_kgm2=7000.0)
    levels = LoopLevels(
        torque_Nm=0.05, length_s=30.0, rate_white_rad_s=2e-6, momentum_white_Nms=0.02, error_white_rad=2e-5,
        error_slow_rad=3e-5, error_time_s=15.0, reaction_Nm_sqrt_s=0.01,
    )  # fmt: skip
    blank = [Series(row, s := np.arange(0.0, _DAY_S, cadence), np.zeros(len(s))) for row, cadence in _CADENCE_S.items()]
    times, data = arrange(blank)
    model = body.smooth_model(levels, times)
    _, read = simulate(model, data, [body.torque], 1, np.random.default_rng(0))
    return model, Measurements(data.start, data.row, read[:, 0])


def process_noise(model: Model) -> np.ndarray:
    """Of every step: all are of one length here."""
    return model.Q[0]


def peer(model: Model, data: Measurements) -> kalman_smoother.KalmanSmoother:
    """The same model and data in statsmodels, missing samples as NaN.

    Conventional filter and smoother, asked for means and covariances alone and keeping no likelihoods: the fastest of
    its methods that gives the right answer here (its univariate filter takes innovations of variance below 1e-10, an
    attitude error in radians, for certain)."""
    rows, n = sorted(_CADENCE_S), len(model.mean)
    values = np.full((len(model.which), len(rows)), np.nan)
    values[np.repeat(np.arange(len(values)), np.diff(data.start)), np.searchsorted(rows, data.row)] = data.value
    p = kalman_smoother.KalmanSmoother(k_endog=len(rows), k_states=n)
    p.bind(values)
    p["design"], p["obs_cov"] = model.H[rows], np.diag(model.R[rows])
    p["transition"], p["selection"], p["state_cov"] = model.A[0], np.eye(n), process_noise(model)
    p.initialize_known(model.mean, model.covariance)
    p.filter_method = kalman_filter.FILTER_CONVENTIONAL
    p.smooth_method = kalman_smoother.SMOOTH_CONVENTIONAL
    p.conserve_memory = kalman_filter.MEMORY_NO_LIKELIHOOD | kalman_filter.MEMORY_NO_STD_FORECAST
    p.smoother_output = kalman_smoother.SMOOTHER_STATE | kalman_smoother.SMOOTHER_STATE_COV
    return p


def smoothing() -> None:
    model, data = day()
    steps, n = len(model.which), len(model.mean)
    print(
        f"One smoothing pass of a day: {steps} steps, {n} states, beside statsmodels, conventional filter and smoother"
    )
    smooth(model, data)
    t_ours, ours = best_of(5, lambda: smooth(model, data))
    t_laid_out, covariance = best_of(5, lambda: smooth(model, data).covariance)
    their = peer(model, data)
    t_peer, theirs = best_of(3, their.smooth)
    sigma = np.sqrt(np.einsum("kii->ki", covariance))
    mean = np.abs((ours.mean - theirs.smoothed_state.T) / sigma).max()
    variance = np.abs(np.einsum("iik->ki", theirs.smoothed_state_cov) / sigma**2 - 1).max()
    print(f"{'':>44s} {'ours [ms]':>10s} {'peer [ms]':>10s} {'peer/ours':>10s}")
    for name, took in (
        ("means, covariances held once each", t_ours),
        ("means, a covariance laid out every step", t_laid_out),
    ):
        print(f"{name:>44s} {1e3 * took:10.1f} {1e3 * t_peer:10.1f} {t_peer / took:10.1f}")
    print(f"largest difference: means {mean:.1e} sigma, variances {variance:.1e} of themselves\n")


def local_regression() -> None:
    """Value, slope and curvature with their variances, beside one bare convolution and scikit-misc's loess.

    That one evaluates directly at every point, as ours does where a window misses samples."""
    rng = np.random.default_rng(0)
    span = 39
    print(f"Local regression, {span} samples a window, beside numpy.convolve and scikit-misc's loess")
    print(f"{'record':>22s} {'samples':>8s} {'ours [ms]':>10s} {'convolve':>10s} {'loess':>10s} {'ours/convolve':>14s} "
          f"{'loess/ours':>11s} {'largest difference':>19s}")  # fmt: skip
    for name, samples, lost in (
        ("Cassini, 1 s", 481, 0), ("an hour, 1 s", 3601, 0), ("an hour, 2 % missing", 3601, 72),
        ("five hours, 1 s", 18_001, 0), ("a day, 1 s", 86_401, 0),
    ):  # fmt: skip
        x = np.arange(samples, dtype=float)
        x = np.delete(x, rng.choice(np.arange(1, samples - 1), lost, replace=False))
        y = np.sin(x / 20) + 0.1 * rng.normal(size=len(x))

        def theirs(x=x, y=y):
            fit = loess(x, y, span=(span + 1e-3) / len(x), degree=2, surface="direct")
            fit.fit()
            return fit.outputs.fitted_values

        t_ours, ours = best_of(9, lambda x=x, y=y: local_polynomial(x, y, x, degree=2, neighbors=span).value)
        t_plain, _ = best_of(9, lambda y=y: np.convolve(y, np.ones(span), "same"))
        line = f"{name:>22s} {len(x):8d} {1e3 * t_ours:10.2f} {1e3 * t_plain:10.2f}"
        if len(x) > 20_000:  # the peer would take minutes
            print(f"{line} {'-':>10s} {t_ours / t_plain:14.1f}")
            continue
        t_peer, reference = best_of(2, theirs)
        print(f"{line} {1e3 * t_peer:10.1f} {t_ours / t_plain:14.1f} {t_peer / t_ours:11.0f} "
              f"{np.abs(ours - reference).max():19.1e}")  # fmt: skip
    print()


def event() -> None:
    """One axis of one flyby by the fused method, compiled and warm."""
    craft, flight = asflown.load_craft("cassini"), asflown.fly("profile-1", seed=1)

    def work():
        return asflown.torque(flight.telemetry, craft, method="fused", axis="y")

    work()
    print(f"The fused torque of one axis, profile-1: {best_of(3, work)[0]:.2f} s")


def main() -> None:
    smoothing()
    local_regression()
    event()


if __name__ == "__main__":
    main()
