"""What the evidence says of a change: which thruster, leaking or weak, since when, and by how much."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from .doubts import FROM_THE_START, SMALL_TORQUE, THRUSTER_OPEN, direction_doubt, loss_doubt, mixture

if TYPE_CHECKING:
    from ...kit.doubts import Doubt
    from .firing import Geometry
    from .known import Known
    from .likelihood import Evidence

#: Posterior below which the thruster named is doubted.
_SURE = 0.95
#: Torque of a leak, in sigmas of the steady external torque, below which that may have changed instead.
_LARGE = 5


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """A change; None: not known, or does not apply.  Times are seconds from the epoch.

    ``kind``: 'leak', an uncommanded thrust, or 'weak', pulses that give less than ordered.  ``posterior``: over the
    thrusters, both kinds together, given that one of them is at fault.  ``torque_Nm`` (3,): of a leak, about the centre of
    mass, free in its direction, body axes; ``leak_N``: of the thruster named.  ``loss``: share of each pulse.  ``together``:
    thrusters that make the torque between them, where no one alone would."""

    kind: str | None = None
    thruster: str | None = None
    posterior: dict[str, float] | None = None
    onset_s: float | None = None
    onset_ci95_s: tuple[float, float] | None = None
    torque_Nm: np.ndarray | None = None
    torque_sigma_Nm: np.ndarray | None = None
    leak_N: float | None = None
    leak_sigma_N: float | None = None
    loss: float | None = None
    loss_sigma: float | None = None
    together: list[str] | None = None


def diagnosed(
    e: Evidence, time_s: np.ndarray, geometry: Geometry, known: Known, thrust_N: float, pulse_Nms: float
) -> tuple[Diagnosis, list[Doubt]]:
    """The likeliest change and what is not sure of it.  ``time_s`` (N,): of all instants; ``pulse_Nms``: momentum of one pulse."""
    weights, names = e.weights(thrust_N), geometry.names
    j, by_hypothesis = len(names), weights.sum(axis=0)
    posterior = by_hypothesis[:j] + by_hypothesis[j:]
    k = int(posterior.argmax())
    weak = by_hypothesis[j + k] > by_hypothesis[k]
    h = k + j if weak else k
    b = int(e.log_ratio[:, h].argmax())
    since = time_s[e.onset - 1]  # a change within a step counts from its beginning
    found = Diagnosis(
        kind="weak" if weak else "leak",
        thruster=names[k],
        posterior=dict(zip(names, posterior.tolist(), strict=True)),
        onset_s=float(since[b]),
        onset_ci95_s=_onset_interval(weights.sum(axis=1), since, time_s[e.onset], b),
    )
    C = e.free_c[b]
    torque = np.linalg.solve(C, e.free_d[b])
    better = 0.5 * float(e.free_d[b] @ torque) - 0.5 * float(e.d[b, h] ** 2 / e.c[b, h])
    mixed = mixture(better, torque, C, geometry)
    pulses = float(np.linalg.norm(torque)) * (time_s[e.instant] - since[b]) / pulse_Nms
    doubts = [direction_doubt(better, mixed, pulses)]
    if len(mixed) > 1:
        found = replace(found, together=mixed)
    size, sigma = float(e.d[b, h] / e.c[b, h]), float(1 / np.sqrt(e.c[b, h]))
    if weak:
        found = replace(found, loss=size, loss_sigma=sigma)
        doubts.append(loss_doubt(size, sigma))
    else:
        torque_sigma = np.sqrt(np.diag(np.linalg.inv(C)))
        found = replace(found, leak_N=size, leak_sigma_N=sigma, torque_Nm=torque, torque_sigma_Nm=torque_sigma)
        doubts.append(SMALL_TORQUE() if np.linalg.norm(torque) < _LARGE * known.torque_Nm else None)
    if posterior[k] < _SURE:
        second = int(np.argsort(posterior)[-2])
        doubts.append(
            THRUSTER_OPEN(
                thruster=names[k], posterior=posterior[k], second=names[second], posterior_of_second=posterior[second]
            )
        )
    if e.onset[b] <= 2:
        doubts.append(FROM_THE_START())
    return found, [d for d in doubts if d is not None]


def _onset_interval(weights: np.ndarray, since: np.ndarray, until: np.ndarray, best: int) -> tuple[float, float]:
    """The shortest 95 % interval of the onset that holds the ``best`` candidate; each, of these ``weights``, lies between ``since`` and
    ``until``.  It grows from the best to the side that is likelier per second, so that no far tail moves it off what is stated."""
    dense = np.r_[0.0, weights / np.maximum(np.diff(until, prepend=since[0]), 1e-9), 0.0]
    low = high = best
    held, whole = weights[best], weights.sum()
    while held < 0.95 * whole and (low > 0 or high < len(weights) - 1):
        if high == len(weights) - 1 or (low > 0 and dense[low] >= dense[high + 2]):
            low -= 1
            held += weights[low]
        else:
            high += 1
            held += weights[high]
    # a candidate stands for the instants since the one before it that is kept
    return float(until[low - 1] if low else since[0]), float(until[high])
