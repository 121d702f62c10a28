"""The wheel controller of the cover paper's section IV as the flight computer runs it: gains and discrete filter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import cont2discrete

from ...craft.model import CraftAt, tensor
from ...kit.errors import BadInput
from .plant import Loop

if TYPE_CHECKING:
    from ...craft.model import WheelController
    from ..scenario import Scenario


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
        a, b, c, d, _ = cont2discrete((A, B, C, D), warped, "bilinear")
    else:
        a, b, c, d, _ = cont2discrete((A, B, C, D), period_s, "zoh")
    return np.ascontiguousarray(a), np.ascontiguousarray(b[:, 0]), np.ascontiguousarray(c[0]), float(d[0, 0])


def _rate_filter_of(law: WheelController, period_s: float, rule: str):
    """As ``rate_filter``; the rate goes through where the law has none."""
    if law.rate_filter is None:
        return np.zeros((2, 2)), np.zeros(2), np.zeros(2), 1.0
    return rate_filter(law.rate_filter.natural_frequency, law.rate_filter.damping, period_s, rule)


def wheel_loop(scenario: Scenario, now: CraftAt) -> Loop:
    """The controller of a craft on a date, with what the scenario says otherwise.

    Raises BadInput for a craft without a wheel controller or with wheels that cannot turn it."""
    law, run = now.craft.wheel_controller, scenario.controller
    if law is None:
        raise BadInput(
            f"{now.craft.name} has no wheel controller, so its loop cannot be closed",
            remedy="Give the craft file a [wheel_controller], or fly another craft.",
        )
    axes = np.array([w.axis for w in now.wheels])
    if len(axes) < 3 or np.linalg.matrix_rank(axes) < 3:
        raise BadInput(
            f"the {len(axes)} wheels of {now.craft.name} do not span three axes on this date",
            remedy="Fly a date or a craft with three independent wheels.",
        )
    period = run.period or law.period
    if period is None or not 0 < period <= 10:
        raise BadInput(
            "the control period must be known and lie between 0 and 10 s",
            remedy="Give period under [wheel_controller], or in the scenario.",
        )
    a, b, c, d = _rate_filter_of(law, period, run.filter)
    believed = law.believed_kgm2(now.inertia_kgm2) if run.inertia is None else tensor(run.inertia)
    natural = run.friction_bandwidth if run.friction_compensation else 0.0
    return Loop(
        period=float(period),
        substeps=scenario.substeps,
        kp=float(law.kp_per_s),
        kd=float(law.kd_per_s),
        inertia=np.ascontiguousarray(believed, float),
        filter_a=a,
        filter_b=b,
        filter_c=c,
        filter_d=d,
        delay_cycles=run.delay_cycles,
        gyroscopic_feedforward=run.gyroscopic_feedforward,
        axes_inverse=np.ascontiguousarray(np.linalg.pinv(axes.T)),
        torque_limit=np.array([np.inf if w.torque_limit is None else w.torque_limit for w in now.wheels]),
        rate_limit=np.array([np.inf if w.rate_limit is None else w.rate_limit for w in now.wheels]),
        friction_kp=2.0 * natural,  # critically damped
        friction_ki=natural**2,
    )
