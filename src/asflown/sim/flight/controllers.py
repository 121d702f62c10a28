"""The wheel controller of the cover paper's section IV as the flight computer runs it: gains and discrete filter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ...craft.model import CraftAt, tensor
from ...kit.errors import BadInput
from .plant import Loop, Rods

if TYPE_CHECKING:
    from ...craft.model import WheelController
    from ..scenario import NullSpace, Scenario


def rate_filter(natural_rad_s: float, damping: float, period_s: float, rule: str):
    """One second-order low-pass section as x' = A x + B u, y = C x + D u; two make the fourth order.

    ``tustin``: bilinear, warped to be exact at the natural frequency.  ``zoh``: exact for a held input.
    Tustin lies closer to the continuous loop: the held input costs half a cycle's delay a section.
    At the loop's bandwidth (0.03 Hz, 0.125 s cycle) e/T is 1.9 % off with tustin and 4.0 % with zoh;
    1.8 % of that is the wheel torque's own hold over the cycle (measured in tests/sim/test_loop.py)."""
    A = np.array([[0.0, 1.0], [-(natural_rad_s**2), -2 * damping * natural_rad_s]])
    B = np.array([[0.0], [natural_rad_s**2]])
    C, D = np.array([[1.0, 0.0]]), np.zeros((1, 1))
    if rule == "tustin":
        warped = 2 / natural_rad_s * np.tan(natural_rad_s * period_s / 2)
        a, b, c, d, _ = scipy.signal.cont2discrete((A, B, C, D), warped, "bilinear")
    else:
        a, b, c, d, _ = scipy.signal.cont2discrete((A, B, C, D), period_s, "zoh")
    return np.ascontiguousarray(a), np.ascontiguousarray(b[:, 0]), np.ascontiguousarray(c[0]), float(d[0, 0])


def _rate_filter_of(law: WheelController, period_s: float, rule: str):
    """As ``rate_filter``; the rate goes through where the law has none."""
    if law.rate_filter is None:
        return np.zeros((2, 2)), np.zeros(2), np.zeros(2), 1.0
    return rate_filter(law.rate_filter.natural_frequency, law.rate_filter.damping, period_s, rule)


def wheel_loop(scenario: Scenario, now: CraftAt, off: np.ndarray) -> Loop:
    """The controller of a craft on a date, as its file has it, with what the scenario says otherwise; ``off`` (N, wheels) bool:
    whose motors are off.

    Raises BadInput for wheels that cannot turn the craft."""
    law, run, period = _law_of(scenario, now), scenario.controller, control_period(scenario, now)
    axes = np.array([w.axis for w in now.wheels])
    if len(axes) < 3 or np.linalg.matrix_rank(axes) < 3:
        raise BadInput(
            f"the {len(axes)} wheels of {now.craft.name} do not span three axes on this date",
            remedy="Fly a date or a craft with three independent wheels.",
        )
    a, b, c, d = _rate_filter_of(law, period, run.filter)
    believed = law.believed_kgm2(np.asarray(now.inertia_kgm2, float)) if run.inertia is None else tensor(run.inertia)
    natural = run.friction_bandwidth if run.friction_compensation else 0.0
    return Loop(
        period=period,
        substeps=scenario.substeps,
        kp=float(law.kp_per_s),
        kd=float(law.kd_per_s),
        inertia=np.ascontiguousarray(believed, float),
        filter_a=a,
        filter_b=b,
        filter_c=c,
        filter_d=d,
        delay_cycles=run.delay_cycles,
        gyroscopic_feedforward=_first_known(run.gyroscopic_feedforward, law.gyroscopic),
        acceleration_feedforward=_first_known(run.acceleration_feedforward, law.acceleration),
        tracking=_first_known(run.tracking, law.tracking),
        **_sets_of_wheels(axes, off, run.null_space),
        null_rate=_null_rates(scenario, now),
        torque_limit=np.array([np.inf if w.torque_limit is None else w.torque_limit for w in now.wheels]),
        rate_limit=np.array([np.inf if w.rate_limit is None else w.rate_limit for w in now.wheels]),
        friction_kp=2.0 * natural,  # critically damped
        friction_ki=natural**2,
    )


def control_period(scenario: Scenario, now: CraftAt) -> float:
    """Of the control cycle. [s]  Raises BadInput where it is not known, and for a craft without a wheel controller."""
    period = scenario.controller.period or _law_of(scenario, now).period
    if period is None or not 0 < period <= 10:
        raise BadInput(
            "the control period must be known and lie between 0 and 10 s",
            remedy="Give period under [wheel_controller], or in the scenario.",
        )
    return float(period)


def _law_of(scenario: Scenario, now: CraftAt) -> WheelController:
    law, run = now.craft.wheel_controller, scenario.controller
    if law is None:
        raise BadInput(
            f"{now.craft.name} has no wheel controller, so its loop cannot be closed",
            remedy="Give the craft file a [wheel_controller], or fly another craft.",
        )
    flown = {"bandwidth": run.bandwidth, "damping": run.damping}
    return law.model_copy(update={name: value for name, value in flown.items() if value is not None})


def _first_known(*answers: bool | None) -> bool:
    """Whether a term is fed forward: by the scenario, else by the craft's file, else it is."""
    return next((known for known in answers if known is not None), True)


def _sets_of_wheels(axes: np.ndarray, off: np.ndarray, balance: NullSpace | None) -> dict[str, Any]:
    """Which wheels turn the craft while others coast: the fields of ``Loop`` that say so."""
    n = len(axes)
    patterns, turning = np.unique(off, axis=0, return_inverse=True)
    inverses, projectors, outside = [], [], []
    for pattern in patterns:
        on = ~pattern
        outside.append(bool(pattern.any() and np.linalg.matrix_rank(axes[on]) < 3))
        if outside[-1]:
            on = np.ones(n, bool)
        inverse, projector = np.zeros((n, 3)), np.zeros((n, n))
        inverse[on] = np.linalg.pinv(axes[on].T)
        projector[np.ix_(on, on)] = np.eye(on.sum()) - inverse[on] @ axes[on].T
        inverses.append(inverse)
        projectors.append(projector * (balance.gain if balance else 0.0))
    return {
        "turning": turning.reshape(-1), "axes_inverse": np.array(inverses), "from_outside": np.array(outside),
        "null_space": np.array(projectors), "null_limit": balance.torque if balance else 0.0,
    }  # fmt: skip


def _null_rates(scenario: Scenario, now: CraftAt) -> np.ndarray:
    balance = scenario.controller.null_space
    kept = scenario.wheel_rates | (balance.rates if balance else {})
    return np.array([kept.get(w.name, 0.0) for w in now.wheels])


def rods_of(scenario: Scenario, now: CraftAt, period_s: float) -> Rods:
    """The craft's torque rods and the law that the scenario runs them by; none where it does not.

    Raises BadInput for a craft without rods."""
    law = scenario.unloading
    if law is None:
        return Rods()
    if not now.craft.torque_rods:
        raise BadInput(
            f"{now.craft.name} has no torque rods to unload its wheels with",
            remedy="Describe them under [[torque_rods]] in the craft file.",
        )
    axes = np.array([r.axis for r in now.craft.torque_rods], float)
    every = max(round(law.period / period_s), 1)
    return Rods(
        axes=axes,
        axes_inverse=np.ascontiguousarray(np.linalg.pinv(axes.T)),
        limit=np.array([r.max_dipole for r in now.craft.torque_rods], float),
        gain=law.gain,
        target=np.array(law.target, float),
        every=every,
        acting=max(round(law.duty * every), 1),
    )
