"""What is not sure of a thrust: what the records do not separate, and what contradicts the thrust predicted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...craft.model import STALE_NS
from ...kit.doubts import Doubt, Kind, Severity
from ...kit.timeline import NS, utc_label
from ...telemetry.channels import AXES
from ..firing import Source, thrust_slip
from ..subject import stopped
from .fit import CENTER, FALL_TIME

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry
    from ..firing import Firings, Priors
    from .fit import Fit

#: Sigma of the mean, as a share, beyond which the records say little.
_HARDLY = 0.2
#: Correlation beyond which thrust and fall time are not separated; share of a prior's sigma that data must beat.
_TIED, _UNTOLD = 0.95, 0.8
#: The prior on the fall time decides where its sigma falls by less than this factor.
_BY_PRIOR = 0.5
#: Share of the sigma of a thrust over the mean that is the centre of mass's, beyond which the two are not separated.
_MIXED = 0.75
#: Variances widened by more than this factor are told.
_WIDENED = 2.0
#: A longer fall time whose effect is told. [s]
_LONGER = 0.01
#: Records this far apart may have different thrusts. [days]
_APART_DAYS = 60.0
#: A prediction that is not stale is taken to be good to this share, assumed.
_PREDICTED_SHARE = 0.05
#: One sigma, as a share, of a thrust that comes without one: 13 ms of fall time make 8 %.
_NO_SIGMA = 0.1
#: Two branches' thrusts are not further apart than this share; assumed.
_NO_BRANCH = 0.3

HARDLY_KNOWN = Kind(
    "thrust.hardly-known", Severity.CAUTION,
    "the records say little about the thrust (sigma {percent:.0f} %): the thrusters gave little torque, or fired little",
    "Add a wheel biasing; a burn needs its accelerometer and --mass.",
)  # fmt: skip
FALL_TIME_TIED = Kind(
    "thrust.fall-time-tied", Severity.CAUTION,
    "these pulses hardly separate thrust and fall time (correlation {correlation:+.4f}): a fall time 10 ms longer would change "
    "the mean by {change_N:+.3f} N",
    "Add a burn with the accelerometer on, or longer pulses.",
)  # fmt: skip
FALL_TIME_BY_PRIOR = Kind(
    "thrust.fall-time-by-prior", Severity.CAUTION,
    "these pulses hardly separate thrust and fall time (correlation {correlation:+.4f}), and the prior on the fall time decides: a "
    "fall time 10 ms longer would change the mean by {change_N:+.3f} N",
    "Add a burn with the accelerometer on, or longer pulses; give a better fall time with --fall-time and --fall-sigma.",
)  # fmt: skip
WEAK_OR_CENTER = Kind(
    "thrust.weak-or-center-of-mass", Severity.CAUTION,
    "a weak thruster and a shifted centre of mass look alike for {thrusters}",
    "If the centre of mass is known better, give its sigma with --cm-sigma.",
)  # fmt: skip
CENTER_BY_PRIOR = Kind(
    "thrust.center-of-mass-by-prior", Severity.NOTE,
    "the records say little about the centre of mass along {axis}: it is the value assumed beforehand",
)  # fmt: skip
MISFIT = Kind(
    "thrust.misfit", Severity.SUSPECT,
    "the residuals are {ratio:.1f} times the noise assumed, and sigmas are widened by as much: swinging booms or propellant, a leak, "
    "or thrusters unlike the model",
    "Look at what is not explained (--plot), and look for a leak (asflown leak).",
)  # fmt: skip
RECORDS_APART = Kind(
    "thrust.records-apart", Severity.CAUTION,
    "the records lie {days:.0f} days apart and are given one thrust, which falls as propellant is used",
    "Estimate them one by one.",
)  # fmt: skip
OLD_PREDICTION = Kind(
    "thrust.old-prediction", Severity.CAUTION, "the predicted thrust is the last one known, of {date}: it has fallen since",
)  # fmt: skip
#: A tank that blows down or is recharged does not bring the thrust further from all that the craft file knows; assumed.
_BEYOND = 2.0
#: Sigmas of prior and fit together beyond which what is taken beforehand is contradicted: a prior's sigma is itself only assumed.
_STRAINED = 4.0
#: A thruster that differs from the mean of the others by this share, and by so many sigmas, is one whose on-times may be wrong.
_ALONE, _ALONE_SIGMAS = 0.4, 4.0

_CHECK = "Check units and names of the on-times, the wheels' rates and spin inertia, inertia and centre of mass."
_OFF = "the mean is {percent:+.0f} % from the predicted {predicted_N:.3g} N, whose sigma is assumed to be {share_percent:.0f} %: "
OFF_PREDICTION = Kind(
    "thrust.off-prediction", Severity.SUSPECT,
    _OFF + "the other branch, with its own thrust in the same places, would look like this",
    "Check which branch was in use.",
)  # fmt: skip
FAR_FROM_PREDICTION = Kind(
    "thrust.far-from-prediction", Severity.SUSPECT, _OFF + "neither blow-down nor the other branch explains so much{guess}",
    _CHECK,
)  # fmt: skip
BEYOND_THE_FILE = Kind(
    "thrust.beyond-the-craft-file", Severity.SUSPECT,
    "the mean is {ratio:.3g} times the {known_N:.3g} N of the craft file: neither blow-down nor a recharge explains so much{guess}", _CHECK,
)  # fmt: skip
NOTHING_KNOWN = Kind(
    "thrust.nothing-known", Severity.VOID,
    "the sigma of the mean, {sigma_N:.3g} N, is as large as the mean: the record does not say what the thrust is, or contradicts what "
    "is taken as known", _CHECK,
)  # fmt: skip
PRIOR_CONTRADICTED = Kind(
    "thrust.prior-contradicted", Severity.SUSPECT,
    "the {what} comes out as {found}, {sigmas:.0f} sigma from what was taken beforehand ({taken}): the fit moved it to explain what "
    "something else makes, or the value taken is wrong",
    "Check the craft file and the options that give it, and names and units of on-times and pulse counts.",
)  # fmt: skip
UNLIKE_OTHERS = Kind(
    "thrust.unlike-others", Severity.SUSPECT,
    "{thruster} comes out at {ratio:.2f} ± {ratio_sigma:.2f} times the mean: a weak thruster, or on-times that are under a wrong name, "
    "not counted or in another unit",
    "Check that every column of on-times is that of its thruster, and none is empty or zero.",
)  # fmt: skip


def joint_doubts(fit: Fit, priors: Priors, records: list[Firings]) -> Iterable[Doubt]:
    """Of the joint method."""
    mean, sigma = fit.mean()
    yield from _how_well(mean, sigma)
    correlation = fit.correlation(fit.mean_weights, FALL_TIME)
    if abs(correlation) > _TIED:
        fall_sigma_s = fit.sigma(FALL_TIME)
        kind = FALL_TIME_BY_PRIOR if fall_sigma_s > _BY_PRIOR * priors.fall_sigma_s else FALL_TIME_TIED
        yield kind(correlation=correlation, change_N=correlation * sigma / fall_sigma_s * _LONGER)
    mixed = []
    for n in fit.fired:
        weights = fit.ratio_weights(n)
        if fit.share(weights, Source.CENTER) > _MIXED * fit.combination(weights)[1]:
            mixed.append(n)
    if mixed:
        yield WEAK_OR_CENTER(thrusters=mixed)
    for axis, center, before in zip(AXES, CENTER, priors.center_sigma_m, strict=True):
        if fit.sigma(center) > _UNTOLD * before:
            yield CENTER_BY_PRIOR(axis=axis)
    yield from _against_priors(fit, priors)
    if fit.widened > _WIDENED:
        yield MISFIT(ratio=float(np.sqrt(fit.misfit)))
        for f in records:
            yield from stopped(f.subject)


def _how_well(mean_N: float, sigma_N: float) -> Iterable[Doubt]:
    if sigma_N > abs(mean_N):
        yield NOTHING_KNOWN(sigma_N=sigma_N)
    elif sigma_N > _HARDLY * abs(mean_N):
        yield HARDLY_KNOWN(percent=100 * sigma_N / abs(mean_N))


def _against_priors(fit: Fit, priors: Priors) -> Iterable[Doubt]:
    """What the fit moved further than what is known beforehand lets it, and thrusters far from the others."""
    taken = [("fall time", FALL_TIME, priors.fall_s, priors.fall_sigma_s, 1e3, "ms")]
    taken += [
        (f"centre of mass along {axis}", p, x, sigma, 1.0, "m")
        for axis, p, x, sigma in zip(AXES, CENTER, priors.center_m, priors.center_sigma_m, strict=True)
    ]
    for what, parameter, before, before_sigma, scale, unit in taken:
        found, sigma = fit.value(parameter), fit.sigma(parameter)
        apart = abs(found - before) / np.hypot(before_sigma, sigma)
        if apart > _STRAINED:
            yield PRIOR_CONTRADICTED(
                what=what, found=f"{scale * found:.3g} {unit}", sigmas=float(apart),
                taken=f"{scale * before:.3g} ± {scale * before_sigma:.2g} {unit}",
            )  # fmt: skip
    for n in fit.fired if len(fit.fired) > 1 else ():
        ratio, sigma = fit.over_mean(n)
        if abs(ratio - 1) > max(_ALONE, _ALONE_SIGMAS * abs(sigma)):
            yield UNLIKE_OTHERS(thruster=n, ratio=ratio, ratio_sigma=abs(sigma))


def doubts_of(records: list[Firings]) -> list[Doubt]:
    """Those of every record; of several, each with its record's name."""
    if len(records) == 1:
        return list(records[0].doubts)
    return [
        d.of_record(f.telemetry.source or f"record {k}") for k, f in enumerate(records, 1) for d in f.doubts
    ]  # fmt: skip


def prediction_doubts(
    telemetry: list[Telemetry], craft: Craft, mean_N: float, sigma_N: float | None
) -> Iterable[Doubt]:
    """What dates and craft file say against the mean thrust; ``sigma_N`` None: the method gives none."""
    dated_ns = [t.epoch_ns for t in telemetry if t.dated]
    apart_days = (max(dated_ns) - min(dated_ns)) / NS / 86_400 if dated_ns else 0.0
    if apart_days > _APART_DAYS:
        yield RECORDS_APART(days=apart_days)
    sigma = _NO_SIGMA * abs(mean_N) if sigma_N is None else sigma_N
    last = max((h.date for h in craft.thrust_history), default=None)
    fresh = last is not None and dated_ns and dated_ns[0] - last <= STALE_NS
    if last is not None and dated_ns and not fresh:
        yield OLD_PREDICTION(date=utc_label(last)[:10])
    told = _off_prediction(mean_N, sigma, craft.thrust_at(dated_ns[0])) if fresh else None
    if (told := told or _beyond_the_file(craft, mean_N, sigma)) is not None:
        yield told


def _off_prediction(mean_N: float, sigma_N: float, predicted_N: float) -> Doubt | None:
    off, expected = mean_N - predicted_N, np.hypot(sigma_N, _PREDICTED_SHARE * predicted_N)
    if abs(off) <= 2 * expected:
        return None
    told = {"percent": 100 * off / predicted_N, "predicted_N": predicted_N, "share_percent": 100 * _PREDICTED_SHARE}
    if abs(off) > _NO_BRANCH * predicted_N:
        return FAR_FROM_PREDICTION(**told, guess=thrust_slip(mean_N / predicted_N))
    return OFF_PREDICTION(**told)


def _beyond_the_file(craft: Craft, mean_N: float, sigma_N: float) -> Doubt | None:
    """Where the mean is further from all thrusts that the craft file knows, nominal ones included, than any tank brings it."""
    known = [h.thrust for h in craft.thrust_history] + [t.nominal_thrust for t in craft.thrusters]
    near = min(known, key=lambda k: abs(np.log(max(mean_N, 1e-300) / k)))
    ratio = mean_N / near
    if 1 / _BEYOND <= ratio <= _BEYOND or sigma_N > abs(mean_N - near):
        return None
    return BEYOND_THE_FILE(ratio=ratio, known_N=near, guess=thrust_slip(ratio))
