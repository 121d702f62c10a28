"""The joint method: momentum and velocity of all records in one model (``fit``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput, some_of
from ..firing import Firings, Priors, firings_of, momentum_chain, valve_of
from ..subject import stopped
from .accelerometer import CHANNEL, velocity_chain
from .contradictions import check_counted, check_names
from .evidence import common_of, doubts_of, event_seen
from .fit import Fit, fit_thrust
from .result import ThrustResult

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry


def joint(telemetry: list[Telemetry], craft: Craft, _: str, priors: Priors) -> ThrustResult:
    records, chains, doubts = [], [], list(priors.doubts)
    for number, tlm in enumerate(telemetry, 1):
        f = firings_of(tlm, craft)
        if f.rates is None:
            raise BadInput(
                "body rates are not in the telemetry: between pulses the body holds what they gave, and the joint method needs it",
                file=tlm.source or None,
                channel="body_rate_x",
                remedy="Add body_rate_x, _y and _z, or use --method printed.",
            )
        check_counted(f, craft)
        check_names(f, priors)
        records.append(f)
        chains.append(momentum_chain(f, priors, number))
        if CHANNEL in tlm and craft.accelerometer is not None:
            if priors.mass_kg is None:
                doubts.append("accelerometer counts are not used: the craft's mass is not known. Give --mass")
                continue
            try:
                chains.append(velocity_chain(tlm, craft, f.thrusters, f.counters, f.step_s, priors, number))
            except BadInput as why:
                doubts.append(f"accelerometer counts are not used: {why.what}")
    names = records[0].names
    fit = fit_thrust(chains, names, valve_of(records[0].thrusters, priors.fall_s), priors)
    left = [r for c, r in zip(chains, fit.left, strict=True) if c.turn is not None]
    weights = fit.mean_weights
    parts = {"fall time": ("fall",), "spin inertia": ("spin inertia",), "inertia": ("inertia",), "centre of mass": ("center",),
             "mass": ("mass",), "pulses not counted": ("pulses not",), "pulses of minutes": ("pulse ",), "pulses that last": ("lasting",)}  # fmt: skip
    shares = {label: fit.share(weights, *keys) for label, keys in parts.items()}
    mean, mean_sigma = fit.mean()
    value = {n: fit.value(f"thrust {n}") if n in fit.fired else None for n in names}
    valve = valve_of(records[0].thrusters, priors.fall_s)
    return ThrustResult(
        method="joint",
        variant="corrected",
        thrust_N=value,
        sigma_N={n: fit.sigma(f"thrust {n}") if n in fit.fired else None for n in names},
        mean_thrust_N=mean,
        mean_sigma_N=mean_sigma,
        fall_time_s=fit.value("fall"),
        fall_time_sigma_s=fit.sigma("fall"),
        center_m=(fit.value("center x"), fit.value("center y"), fit.value("center z")),
        center_sigma_m=(fit.sigma("center x"), fit.sigma("center y"), fit.sigma("center z")),
        pairs={"+".join(p): fit.combination({n: 1 / len(p) for n in p}) for p in _pairs(craft, fit.fired)},
        over_mean={n: fit.over_mean(n) for n in fit.fired} if len(fit.fired) > 1 else {},
        correlation={"fall_time": fit.correlation(weights, "fall")}
        | {f"center_{a}": fit.correlation(weights, f"center {a}") for a in "xyz"},
        mean_sigma_parts_N={k: v for k, v in shares.items() if v > 0},
        misfit=fit.misfit,
        priors=priors.record(),
        priors_told=str(priors),
        doubts=(*doubts_of(records), *doubts, *_joint_doubts(fit, priors, records)),
        events=tuple(event_seen(f, r, k) for k, (f, r) in enumerate(zip(records, left, strict=True), 1)),
        **common_of(records, craft, telemetry[0], valve),
    )


def _joint_doubts(fit: Fit, priors: Priors, records: list[Firings]) -> list[str]:
    doubts = []
    mean, sigma = fit.mean()
    if sigma > _HARDLY * abs(mean):
        doubts.append(
            f"the records hardly tell the thrust (sigma {100 * sigma / abs(mean):.0f} %): what fired gave little torque, or fired little. A "
            "burn wants its accelerometer and --mass"
        )
    tied = fit.correlation(fit.mean_weights, "fall")
    if abs(tied) > _TIED:
        lean = " and the prior on the fall time decides" if fit.sigma("fall") > 0.5 * priors.fall_sigma_s else ""
        doubts.append(
            f"thrust and fall time are hardly told apart by these pulses (correlation {tied:+.4f}){lean}: with a fall time 10 ms longer the "
            f"mean would be {tied * sigma / fit.sigma('fall') * 0.01:+.3f} N away. A burn with the accelerometer on, or longer pulses, would tell"
        )
    mixed = []
    for n in fit.fired:
        weights = fit.ratio_weights(n)
        if fit.share(weights, "center") > _MIXED * fit.combination(weights)[1]:
            mixed.append(n)
    if mixed:
        doubts.append(
            f"a weak thruster and a centre of mass off its place look alike ({some_of(mixed)}): if the centre is known better, say so with "
            "--cm-sigma"
        )
    for axis, before in zip("xyz", priors.center_sigma_m, strict=True):
        if fit.sigma(f"center {axis}") > _UNTOLD * before:
            doubts.append(f"the records hardly tell the centre of mass along {axis}: it is what was taken beforehand")
    if fit.widened > 2:
        doubts.append(
            f"what the fit leaves is {np.sqrt(fit.misfit):.1f} times the noise taken for it, and sigmas are widened so: booms or propellant "
            "that swing, a leak, or thrusters unlike the model"
        )
        doubts += [d for f in records for d in stopped(f.subject)]
    return doubts


def _pairs(craft: Craft, fired) -> list[tuple[str, ...]]:
    """Thrusters that the craft fires together about its z axis, of those that fired."""
    pairs = craft.thruster_controller.pairs if craft.thruster_controller else {}
    return [p for key, p in pairs.items() if key in ("+z", "-z") and all(n in fired for n in p)]


#: Correlation beyond which thrust and fall time are not told apart, and share of a prior's sigma that data must beat.
_TIED, _UNTOLD = 0.95, 0.8


#: Share of the sigma of a thrust over the mean that is the centre of mass's, beyond which the two are not told apart.
_MIXED = 0.75


#: Sigma of the mean, as a share, beyond which the records say little.
_HARDLY = 0.2
