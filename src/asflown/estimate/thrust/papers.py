"""The paper's two ways to a thrust (Feldman & Lee): least squares on on-times (eqs 14-23), and an accelerometer (Appendix D); both
divided by R."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import VARIANTS, Valve, expected_effective
from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput
from ..firing import Source, counters_of, firings_of, step_of, valve_of
from .accelerometer import along_of, burn_of, mass_not_known
from .contradictions import check_counted, check_names
from .doubts import doubts_of
from .evidence import common_of, event_seen
from .printed import printed_thrust
from .result import Pair, ThrustResult

if TYPE_CHECKING:
    from ..firing import Priors
    from ..subject import Subject
    from .accelerometer import Burn

#: Change of the fall time by which its effect on R is found. [s]
_SLOWER = 1e-4

CENTER_TAKEN = Kind(
    "thrust.center-of-mass-taken", Severity.NOTE,
    "the centre of mass is not known, and Feldman & Lee give none: {center} m is used", "Give --cm.",
)  # fmt: skip
NO_SIGMA = Kind(
    "thrust.printed", Severity.CAUTION,
    "the printed method is least squares without a sigma; errors of what it takes as known (13 ms of fall time: 8 %) are not "
    "included", "Use --method joint.",
)  # fmt: skip
ONE_THRUST = Kind(
    "thrust.one-thrust", Severity.NOTE,
    "all thrusters of the burn are given one thrust: the accelerometer does not separate them", "Use --method joint.",
)  # fmt: skip


def printed_result(subjects: list[Subject], variant: str, priors: Priors) -> ThrustResult:
    """Raises BadInput where no thruster fires, names or counters do not fit the craft, or channels are missing."""
    craft = subjects[0].craft.craft
    records = [firings_of(s) for s in subjects]
    for f in records:
        check_counted(f)
        check_names(f, priors)
    center = craft.center_of_mass or priors.center_m
    not_known = craft.center_of_mass is None
    found = printed_thrust(records, center)
    common = common_of(records, valve_of(records[0].thrusters, priors.fall_s))
    R, names = common["pulse_ratio"][variant], records[0].names
    one = found.single | {n: v for pair, v in found.pairs.items() for n in pair}
    others = {} if found.mean_others is None else {"mean about Z": found.mean_others}
    before = {p.name: p.thrust_N for p in (Pair(pair, v) for pair, v in found.pairs.items())}
    return ThrustResult(
        method="printed",
        variant=variant,
        thrust_N={n: one[n] / R if n in one else None for n in names},
        thrust_sigma_N=dict.fromkeys(names),
        mean_thrust_N=found.mean / R,
        mean_thrust_sigma_N=None,
        fall_time_s=priors.fall_s,
        center_of_mass_m=center,
        pairs=tuple(Pair(pair, v / R) for pair, v in found.pairs.items()),
        unadjusted_N=found.single | before | others | {"mean": found.mean},
        doubts=Doubts(
            [
                *doubts_of(records),
                CENTER_TAKEN(center=", ".join(f"{v:g}" for v in center)) if not_known else None,
                NO_SIGMA(),
                *found.doubts,
            ]
        ),
        events=tuple(event_seen(f, None, k) for k, f in enumerate(records, 1)),
        **common,
    )


def accelerometer_result(subjects: list[Subject], variant: str, priors: Priors) -> ThrustResult:
    """Raises BadInput for several records, without a mass, and where counts or a burn are missing."""
    if len(subjects) > 1:
        raise BadInput("the accelerometer method takes one burn", remedy="Give one file, or use --method joint.")
    if priors.mass_kg is None:
        raise mass_not_known()
    subject = subjects[0]
    tlm, craft = subject.telemetry, subject.craft.craft
    thrusters, counters, doubts = counters_of(subject)
    burn = burn_of(tlm, craft, thrusters, counters)
    share = np.abs(along_of(craft, thrusters))
    which = np.flatnonzero((share > 0.5) & (burn.on_time_s > 0))
    names = tuple(t.name for t in thrusters)
    valve, step_s = valve_of(thrusters, priors.fall_s), step_of(craft, counters.on_time_s)
    R = {v: _ratio(burn, which, step_s, valve, v) for v in VARIANTS}
    along = float(share[which] @ burn.on_time_s[which])
    plain, wrong = (priors.mass_kg * abs(burn.delta_v_m_s(sign)) / along for sign in (-1.0, +1.0))
    shares = _shares(burn, which, R["corrected"], _ratio(burn, which, step_s, _slower(valve)), priors)
    return ThrustResult(
        craft=craft.name,
        epoch=tlm.epoch_label,
        method="accelerometer",
        variant=variant,
        names=names,
        thrust_N={name: plain / R[variant] if k in which else None for k, name in enumerate(names)},
        thrust_sigma_N=dict.fromkeys(names),
        mean_thrust_N=plain / R[variant],
        mean_thrust_sigma_N=plain / R[variant] * shares.total,
        pulse_ratio=R,
        on_time_s=dict(zip(names, burn.on_time_s.tolist(), strict=True)),
        pulses=dict(zip(names, burn.pulses.tolist(), strict=True)),
        pulses_counted=counters.counted,
        fall_time_s=priors.fall_s,
        fall_time_sigma_s=priors.fall_sigma_s,
        unadjusted_N={"bias subtracted": plain, "bias added, as printed": wrong},
        mean_thrust_sigma_parts_N={
            Source.FALL_TIME.value: plain * shares.fall_time,
            Source.MASS.value: plain * shares.mass,
            "pulses": plain * shares.pulses,
            "counts and bias": plain * burn.delta_v_sigma_m_s / abs(burn.delta_v_m_s()),
        },
        burn=burn,
        priors=priors.record(),
        priors_told=f"fall time {1e3 * priors.fall_s:g} ± {1e3 * priors.fall_sigma_s:g} ms; mass {priors.mass_kg:g} kg",
        doubts=Doubts([*doubts, ONE_THRUST()]),
    )


def _ratio(burn: Burn, which, step_s: float, valve: Valve, variant: str = "corrected") -> float:
    """R of the burn's pulses of the thrusters ``which``."""
    on, n = burn.on_time_s[which], burn.pulses[which]
    return float(expected_effective(on, n, step_s, valve, variant).sum() / on.sum())


def _slower(valve: Valve) -> Valve:
    return replace(valve, fall_s=valve.fall_s + _SLOWER)


@dataclass(frozen=True)
class _Shares:
    """One sigma of the thrust by source, as a share of it."""

    velocity: float
    fall_time: float
    pulses: float
    mass: float

    @property
    def total(self) -> float:
        return float(np.sqrt(self.velocity**2 + self.fall_time**2 + self.pulses**2 + self.mass**2))


def _shares(burn: Burn, which, ratio: float, ratio_slower: float, priors: Priors) -> _Shares:
    return _Shares(
        velocity=burn.delta_v_sigma_m_s / abs(burn.delta_v_m_s()),
        fall_time=abs(ratio_slower / ratio - 1) / _SLOWER * priors.fall_sigma_s,
        pulses=priors.pulse_scatter * float(np.sqrt(burn.squares_s2[which].sum()) / burn.on_time_s[which].sum()),
        mass=priors.mass_share,
    )
