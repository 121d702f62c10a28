"""External impulse on a craft about one axis between samples: momentum gained, less what its thrusters gave (the plume paper,
section IV).

    impulse = [I w + h_w] - sum_k  arm_k F_k t_k + B u + noise

with t_k the effective time of the pulses, from on-times and counts (``dynamics.pulses``).  Unknowns of the thrusters, u, remain:
their common thrust, how each differs, the fall time, the centre of mass.  The drift of the body between two pulses shows the
external torque, and the pulses show their thrust.  On wheels nothing fires, and momentum is all there is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.banded import Covariance
from ...kit.errors import BadInput
from ...kit.regression import noise_sigma
from ...kit.scatter import difference_sigma
from ...telemetry.channels import AXES
from ..subject import samples_of
from .chains import Chain, momentum_chain
from .firings import Firings, firings_of
from .priors import Priors, thrust_priors
from .valve import valve_of

if TYPE_CHECKING:
    from ...kit.doubts import Doubts
    from ..subject import Subject

#: One sigma of the thrust that a craft's history gives for a date, as a share: assumed. [1]
THRUST_SHARE = 0.2
#: A hold turns by no more than this. [rad]
_HOLD = 0.03
#: Samples closer than this while something fires are taken one by one. [s]
_EVERY_S = 0.25
#: Runs of samples without firing from which the noise is taken; with fewer all are.
_FEWEST_RUNS = 10
#: Noise is at least this share of what the momentum swings by.
_LEAST = 1e-4


@dataclass(frozen=True)
class Gained:
    """K steps between K + 1 instants [s from the epoch], about one body axis.

    ``impulse_Nms`` (K,): gained, less what thrusters of the thrust believed gave.  ``columns`` (K, m): what one sigma of each of
    the m unknowns ``names`` adds to that.  ``covariance``: of the steps, which share their samples' noise.
    ``inertia_share``: one sigma of the body's inertia, by which everything is off together.  ``thrust_believed_N`` and
    ``thrust_share``: the thrust taken and its sigma as a share; None on wheels, where nothing fires."""

    axis: str
    time_s: np.ndarray
    impulse_Nms: np.ndarray
    columns: np.ndarray
    names: tuple[str, ...]
    covariance: Covariance
    inertia_share: float
    settings: dict
    doubts: Doubts
    thrust_believed_N: float | None = None
    thrust_share: float | None = None


def gained(subject: Subject, axis: str) -> Gained:
    """Raises BadInput where momentum or on-times are not known, and for a craft that turns while thrusters fire."""
    return _on_thrusters(subject, axis) if subject.firing else _on_wheels(subject, axis)


def _on_wheels(subject: Subject, axis: str) -> Gained:
    """Nothing fires: what momentum gains is the impulse."""
    subject.known_inertia()
    s, j = samples_of(subject), AXES.index(axis)
    t = subject.telemetry.seconds(s.tai_ns)
    sigma = noise_sigma(t, s.momentum[:, j], degree=2, half_width=3.5 * float(np.median(np.diff(t))))
    sigma = max(sigma, 1e-9)
    main = np.full((len(t) - 1, 1, 1), 2 * sigma**2)
    return Gained(
        axis=axis,
        time_s=t,
        impulse_Nms=np.diff(s.momentum[:, j]),
        columns=np.zeros((len(t) - 1, 0)),
        names=(),
        covariance=Covariance.of(main, -0.5 * main[1:]),
        inertia_share=subject.inertia_share,
        settings={"momentum_noise_Nms": sigma},
        doubts=subject.doubts + s.doubts,
    )


def _on_thrusters(subject: Subject, axis: str) -> Gained:
    craft = subject.craft.craft
    priors = thrust_priors(craft)
    f = _hold(subject)
    j = AXES.index(axis)
    whole = momentum_chain(f, priors, 1)
    arms = np.cross(whole.places - priors.center_m, whole.along)[:, j]
    chain = replace(whole, steps=whole.steps[:, [j]], turn=None, places=arms, nuisances=())
    sigma = _noise(chain)
    chain = replace(chain, sample_sigma=np.full(len(f.tai_ns), sigma))
    valve, thrust = valve_of(f.thrusters, priors.fall_s), craft.believed_thrust(f.telemetry.date_ns)
    given = arms * thrust * chain.effective(valve)  # (K, j)
    names, columns = _unknowns(f, chain, valve, thrust, arms, j, given, priors)
    settings = {
        "momentum_noise_Nms": sigma, "thrust_believed_N": thrust, "thrust_share": THRUST_SHARE,
        "fall_time_s": [priors.fall_s, priors.fall_sigma_s], "pulse_scatter": priors.pulse_scatter,
        "pulses": float(f.total_pulses[np.abs(arms) > 0].sum()), "pulses_counted": f.counters.counted,
    }  # fmt: skip
    return Gained(
        axis=axis,
        time_s=f.telemetry.seconds(f.tai_ns),
        impulse_Nms=chain.steps[:, 0] - given.sum(axis=1),
        columns=columns,
        names=names,
        covariance=chain.covariance(
            np.full(len(arms), thrust), priors.center_m, valve, priors.pulse_scatter, chain.noise(chain.steps)
        ),
        inertia_share=priors.inertia_share,
        settings=settings,
        doubts=f.doubts,
        thrust_believed_N=thrust,
        thrust_share=THRUST_SHARE,
    )


def _hold(subject: Subject) -> Firings:
    """The record's firings; raises BadInput without body rates, and where the craft turns."""
    f = firings_of(subject, _EVERY_S)
    if f.rates is None:
        raise BadInput(
            "body rates are not in the telemetry: between pulses the body holds momentum, and it is needed here",
            file=f.telemetry.source or None,
            channel="body_rate_x",
            remedy="Add body_rate_x, _y and _z.",
        )
    turned = float(np.linalg.norm(f.turned.as_rotvec(), axis=1).max())
    if turned > _HOLD:
        raise BadInput(
            f"the craft turns by {np.degrees(turned):.1f} degrees in this record, and on-times are balanced in a hold",
            file=f.telemetry.source or None,
            remedy="Narrow the span to the flyby with --start and --stop.",
        )
    return f


def _noise(chain: Chain) -> float:
    """One sigma of a sample of the momentum: third differences, where nothing fires if that is often enough. [N m s]"""
    s, quiet = chain.steps[:, 0], chain.on_time_s.sum(axis=1) == 0
    still = quiet[:-2] & quiet[1:-1] & quiet[2:]
    momentum = np.concatenate([[0.0], np.cumsum(s)])
    sigma = difference_sigma(momentum, 3, still if still.sum() >= _FEWEST_RUNS else None)
    # a simulated record may have no noise but rounding: the covariance must not become singular
    return max(sigma, _LEAST * float(np.abs(momentum).max()), 1e-9)


def _unknowns(f: Firings, chain: Chain, valve, thrust: float, arms, j: int, given, priors: Priors):
    """Names (m,) and what one sigma of each adds to the impulse, (K, m)."""
    found = {"thrust": -THRUST_SHARE * given.sum(axis=1)}
    for k, name in enumerate(f.names):
        if np.any(given[:, k]):
            found[f"thrust {name}"] = -priors.unlike * given[:, k]
    slower = replace(valve, fall_s=priors.fall_s + priors.fall_sigma_s)
    found["fall time"] = given.sum(axis=1) - (arms * thrust * chain.effective(slower)).sum(axis=1)
    for i, sigma in enumerate(priors.center_sigma_m):
        moved = np.cross(-np.eye(3)[i], chain.along)[:, j]
        column = -sigma * (given / np.where(arms == 0, 1.0, arms) * np.where(arms == 0, 0.0, moved)).sum(axis=1)
        if np.any(np.abs(column) > 1e-12):
            found[f"center {'xyz'[i]}"] = column
    if not f.counters.counted:
        found["pulses not counted"] = given.sum(axis=1) - (arms * thrust * chain.effective(valve, chain.spread)).sum(
            axis=1
        )
    return tuple(found), np.stack(list(found.values()), axis=1)
