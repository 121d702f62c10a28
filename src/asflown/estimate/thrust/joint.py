"""The joint method: momentum and velocity of all records in one model (``fit``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...telemetry.channels import AXES
from ..firing import Source, firings_of, momentum_chain, valve_of
from .accelerometer import CHANNEL, NoBurn, velocity_chain
from .contradictions import check_counted, check_names
from .doubts import doubts_of, joint_doubts
from .evidence import common_of, event_seen
from .fit import CENTER, FALL_TIME, Fit, fit_thrust, thrust_of
from .result import Pair, ThrustResult

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ..firing import Chain, Firings, Priors
    from ..subject import Subject

#: Sources of which the mean's sigma is told by parts.
_PARTS = (Source.FALL_TIME, Source.SPIN_INERTIA, Source.INERTIA, Source.CENTER, Source.MASS, Source.UNCOUNTED,
          Source.LONG_PULSES, Source.LASTING)  # fmt: skip

MASS_NOT_KNOWN = Kind(
    "thrust.mass-not-known", Severity.NOTE, "the accelerometer's counts are not used: the craft's mass is not known", "Give --mass.",
)  # fmt: skip
ACCELEROMETER_NOT_USED = Kind(
    "thrust.accelerometer-not-used", Severity.NOTE, "the accelerometer's counts are not used: {why}",
)  # fmt: skip


def joint(subjects: list[Subject], priors: Priors) -> ThrustResult:
    """Raises BadInput where no thruster fires, names or counters do not fit the craft, or channels are missing."""
    craft = subjects[0].craft.craft
    records = [_record(s, priors) for s in subjects]
    momentum = [momentum_chain(f, priors, number) for number, f in enumerate(records, 1)]
    velocity, not_used = _velocities(records, priors)
    chains = [c for m in momentum for c in (m, velocity.get(m.record)) if c is not None]
    names = records[0].names
    valve = valve_of(records[0].thrusters, priors.fall_s)
    fit = fit_thrust(chains, names, valve, priors)
    left = [r for c, r in zip(chains, fit.left, strict=True) if c.turn is not None]
    weights = fit.mean_weights
    shares = {s.value: fit.share(weights, s) for s in _PARTS}
    mean, mean_sigma = fit.mean()
    x, y, z = CENTER
    return ThrustResult(
        method="joint",
        thrust_N={n: fit.value(thrust_of(n)) if n in fit.fired else None for n in names},
        thrust_sigma_N={n: fit.sigma(thrust_of(n)) if n in fit.fired else None for n in names},
        mean_thrust_N=mean,
        mean_thrust_sigma_N=mean_sigma,
        fall_time_s=fit.value(FALL_TIME),
        fall_time_sigma_s=fit.sigma(FALL_TIME),
        center_of_mass_m=(fit.value(x), fit.value(y), fit.value(z)),
        center_of_mass_sigma_m=(fit.sigma(x), fit.sigma(y), fit.sigma(z)),
        pairs=_pairs(craft, fit),
        over_mean={n: fit.over_mean(n) for n in fit.fired} if len(fit.fired) > 1 else {},
        correlation={"fall_time": fit.correlation(weights, FALL_TIME)}
        | {f"center_{a}": fit.correlation(weights, p) for a, p in zip(AXES, CENTER, strict=True)},
        mean_thrust_sigma_parts_N={k: v for k, v in shares.items() if v > 0},
        misfit=fit.misfit,
        priors=priors.record(),
        priors_told=str(priors),
        doubts=Doubts(
            [*doubts_of(records), *priors.doubts, *not_used, *joint_doubts(fit, priors, records)],
        ),
        events=tuple(event_seen(f, r, k) for k, (f, r) in enumerate(zip(records, left, strict=True), 1)),
        **common_of(records, valve),
    )


def _record(subject: Subject, priors: Priors) -> Firings:
    f = firings_of(subject)
    if f.rates is None:
        raise BadInput(
            "body rates are not in the telemetry: between pulses the body holds momentum, and the joint method needs it",
            file=f.telemetry.source or None,
            channel="body_rate_x",
            remedy="Add body_rate_x, _y and _z, or use --method printed.",
        )
    check_counted(f)
    check_names(f, priors)
    return f


def _velocities(records: list[Firings], priors: Priors) -> tuple[dict[int, Chain], list[Doubt]]:
    """Velocity by the number of the record, where an accelerometer counts and the mass is known; why it is not used elsewhere."""
    chains: dict[int, Chain] = {}
    doubts: list[Doubt] = []
    for number, f in enumerate(records, 1):
        if CHANNEL not in f.telemetry or f.subject.craft.craft.accelerometer is None:
            continue
        if priors.mass_kg is None:
            doubts.append(MASS_NOT_KNOWN())
            continue
        try:
            chains[number] = velocity_chain(f, priors, number)
        except NoBurn as why:
            doubts.append(ACCELEROMETER_NOT_USED(why=why.what))
    return chains, doubts


def _pairs(craft: Craft, fit: Fit) -> tuple[Pair, ...]:
    """Thrusters that the craft fires together about its z axis, of those that fired."""
    pairs = craft.thruster_controller.pairs if craft.thruster_controller else {}
    together = [tuple(p) for key, p in pairs.items() if key in ("+z", "-z") and all(n in fit.fired for n in p)]
    return tuple(Pair(p, *fit.combination({n: 1 / len(p) for n in p})) for p in together)
