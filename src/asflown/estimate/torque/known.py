"""Torques of the surroundings that are known from elsewhere: an input of the fused fit, taken off what other methods find."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubts
from ...kit.errors import BadInput, some_of
from ...kit.timeline import NS
from .result import KnownTorque
from .rods import RODS_PULSE

if TYPE_CHECKING:
    from ..environment import Air, Environment
    from ..fused import Foreknown
    from ..subject import Subject
    from .result import TorqueResult

#: Errors of the known torques that are drawn with the torques of a posterior.
_SEED = 20151028
#: What the craft file has to say for each.
_BELIEFS = {
    "gravity-gradient": "an inertia", "sunlight": "[sunlight]", "dipole": "[magnetics]", "drag": "[aerodynamics]",
    "rods": "[[torque_rods]]",
}  # fmt: skip


def check_known(names) -> tuple[str, ...]:
    """The names, each once, in the order of ``environment.NAMES``.  Raises BadInput for one that is no term."""
    if not names:
        return ()
    from ..environment import NAMES  # the surroundings are loaded where one is asked for

    for name in names:
        if name not in NAMES:
            raise BadInput(f"{name!r} is no known torque", remedy=f"Give some of {some_of(NAMES)}.")
    return tuple(n for n in NAMES if n in names)


def foreknown(subject: Subject, names: tuple[str, ...], air: Air | None = None) -> Foreknown:
    """Some torques of the surroundings at any instants: their sum, and its errors."""

    def at(tai_ns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _sums(_known(subject, tai_ns, names, air))

    return at


def with_known(result: TorqueResult, subject: Subject, names: tuple[str, ...], air: Air | None = None) -> TorqueResult:
    """The result of a fit that had some torques of the surroundings as an input, with these listed."""
    environment = _known(subject, _instants(result, subject), names, air)
    pulses = [d for d in result.doubts if d.kind is RODS_PULSE and "rods" in names]
    left = Doubts(d for d in result.doubts if d not in pulses)
    return replace(result, known=_listed(environment), doubts=left + environment.doubts)


def without_known(
    result: TorqueResult, subject: Subject, names: tuple[str, ...], air: Air | None = None
) -> TorqueResult:
    """The result less some torques of the surroundings, whose uncertainty goes into its sigma and its drawn torques.

    Raises BadInput where one of them cannot be computed."""
    environment = _known(subject, _instants(result, subject), names, air)
    total, errors = _sums(environment)
    changed = replace(
        result,
        torque_Nm=result.torque_Nm - total,
        known=_listed(environment),
        doubts=result.doubts + environment.doubts,
    )
    if result.torque_sigma_Nm is not None:
        sigma = np.sqrt(result.torque_sigma_Nm**2 + np.sum(errors**2, axis=2))
        changed = replace(changed, torque_sigma_Nm=sigma)
    return changed if result.paths_Nm is None else replace(changed, paths_Nm=_paths(result, total, errors))


def _instants(result: TorqueResult, subject: Subject) -> np.ndarray:
    return subject.telemetry.epoch_ns + np.round(result.time_s * NS).astype(np.int64)


def _known(subject: Subject, tai_ns: np.ndarray, names: tuple[str, ...], air: Air | None) -> Environment:
    """Raises BadInput where one of them cannot be computed."""
    from ..environment import environment_of

    environment = environment_of(subject, tai_ns, names, air)
    missing = [f"{name} needs {what}" for name, what in environment.left_out.items()]
    missing += [
        f"{t.name} needs {_BELIEFS[t.name]} in the craft file" for t in environment.terms if t.torque_Nm is None
    ]
    if missing:
        raise BadInput(
            f"not all known torques can be computed: {some_of(missing)}", remedy="Leave these out of --with."
        )
    return environment


def _listed(environment: Environment) -> tuple[KnownTorque, ...]:
    return tuple(KnownTorque(t.name, t.source, t.torque_Nm, t.sigma_Nm) for t in environment.terms)  # type: ignore[arg-type]


def _sums(environment: Environment) -> tuple[np.ndarray, np.ndarray]:
    """Of all torques (N, 3), and by what it is off for one sigma of each thing that makes them (N, 3, K)."""
    terms = environment.terms
    total = np.sum([t.torque_Nm for t in terms], axis=0)  # type: ignore[arg-type]
    return total, np.concatenate([t.errors_Nm for t in terms if t.errors_Nm is not None], axis=2)


def _paths(result: TorqueResult, total: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Drawn torques (K, F, 3) less the known one, each with errors drawn for it."""
    paths = result.paths_Nm
    off = np.random.default_rng(_SEED).standard_normal((len(paths), errors.shape[2]))  # type: ignore[arg-type]
    at, fine = result.time_s, result.paths_time_s

    def fitted(values):
        return values if len(fine) == len(at) else np.column_stack([np.interp(fine, at, v) for v in values.T])

    taken = fitted(total) + np.einsum(
        "kq,fjq->kfj", off, np.stack([fitted(e) for e in np.moveaxis(errors, 2, 0)], axis=2)
    )
    return paths - taken
