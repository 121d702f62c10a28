"""The papers' two ways to a thrust: least squares on on-times (001 eqs 14-23), and an accelerometer (Appendix D); both over R."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.pulses import expected_effective
from ...kit.errors import BadInput
from ..firing import Priors, counters_of, firings_of, step_of, valve_of
from ..subject import subject_of
from .accelerometer import along_of, burn_of
from .contradictions import check_counted, check_names
from .evidence import common_of, doubts_of, event_seen
from .printed import printed_thrust
from .result import ThrustResult

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry


def printed_result(telemetry: list[Telemetry], craft: Craft, variant: str, priors: Priors) -> ThrustResult:
    records = [firings_of(t, craft) for t in telemetry]
    doubts = []
    for f in records:
        check_counted(f, craft)
        check_names(f, priors)
    center = craft.center_of_mass or priors.center_m
    if craft.center_of_mass is None:
        doubts.append(
            f"the centre of mass is not known (001 gives none): {', '.join(f'{v:g}' for v in center)} m is taken. Give --cm"
        )
    p = printed_thrust(records, center)
    valve = valve_of(records[0].thrusters, priors.fall_s)
    common = common_of(records, craft, telemetry[0], valve)
    R = common["pulse_ratio"][variant]
    names = records[0].names
    one = {n: v for n, v in p.single.items()} | {n: v for pair, v in p.pairs.items() for n in pair.split("+")}
    unadjusted = (
        p.single | p.pairs | ({} if p.mean_others is None else {"mean about Z": p.mean_others}) | {"mean": p.mean}
    )
    doubts.append(
        "printed method: least squares without a sigma; what it takes as known (fall time to 13 ms: 8 %) is not in it"
    )
    return ThrustResult(
        method="printed",
        variant=variant,
        thrust_N={n: one[n] / R if n in one else None for n in names},
        sigma_N=dict.fromkeys(names),
        mean_thrust_N=p.mean / R,
        mean_sigma_N=None,
        fall_time_s=priors.fall_s,
        center_m=center,
        pairs={n: (v / R, None) for n, v in p.pairs.items()},
        unadjusted_N=unadjusted,
        doubts=(*doubts_of(records), *doubts, *p.doubts),
        events=tuple(event_seen(f, None, k) for k, f in enumerate(records, 1)),
        **common,
    )


def accelerometer_result(telemetry: list[Telemetry], craft: Craft, variant: str, priors: Priors) -> ThrustResult:
    if len(telemetry) > 1:
        raise BadInput("the accelerometer method takes one burn", remedy="Give one file, or use --method joint.")
    if priors.mass_kg is None:
        raise BadInput(
            "the craft's mass is not known, and F = M dV / on-time needs it", remedy='Give --mass "3160 kg".'
        )
    tlm = telemetry[0]
    subject = subject_of(tlm, craft)
    thrusters, counters, doubts = counters_of(subject)
    burn = burn_of(tlm, craft, thrusters, counters)
    share = np.abs(along_of(craft, thrusters))
    which = np.flatnonzero((share > 0.5) & (burn.on_time_s > 0))
    names = tuple(t.name for t in thrusters)
    valve, step_s = valve_of(thrusters, priors.fall_s), step_of(craft, counters.on_time_s)
    on, n = burn.on_time_s[which], burn.pulses[which]
    R = {v: float(expected_effective(on, n, step_s, valve, v).sum() / on.sum()) for v in ("printed", "corrected")}
    along = float(share[which] @ on)
    sums = {word: priors.mass_kg * abs(burn.delta_v_m_s(sign)) / along for word, sign in (("bias subtracted", -1.0), ("bias added, as printed", +1.0))}  # fmt: skip
    plain, dv = sums["bias subtracted"], abs(burn.delta_v_m_s())
    later = float(expected_effective(on, n, step_s, replace(valve, fall_s=valve.fall_s + 1e-4)).sum() / on.sum())
    of_fall = abs(later / R["corrected"] - 1) / 1e-4 * priors.fall_sigma_s
    of_pulses = priors.pulse_scatter * float(np.sqrt(burn.squares_s2[which].sum()) / on.sum())
    sigma = (
        plain
        / R[variant]
        * float(np.sqrt((burn.delta_v_sigma_m_s / dv) ** 2 + of_fall**2 + of_pulses**2 + priors.mass_share**2))
    )
    return ThrustResult(
        craft=craft.name,
        epoch=tlm.epoch_label,
        method="accelerometer",
        variant=variant,
        names=names,
        thrust_N={name: plain / R[variant] if k in which else None for k, name in enumerate(names)},
        sigma_N={name: None for name in names},
        mean_thrust_N=plain / R[variant],
        mean_sigma_N=sigma,
        pulse_ratio=R,
        on_time_s=dict(zip(names, burn.on_time_s.tolist(), strict=True)),
        pulses=dict(zip(names, burn.pulses.tolist(), strict=True)),
        pulses_counted=counters.counted,
        fall_time_s=priors.fall_s,
        fall_time_sigma_s=priors.fall_sigma_s,
        unadjusted_N=sums,
        mean_sigma_parts_N={"fall time": plain * of_fall, "mass": plain * priors.mass_share, "pulses": plain * of_pulses,
                            "counts and bias": plain * burn.delta_v_sigma_m_s / dv},
        delta_v={"delta_v_m_s": burn.delta_v_m_s(), "sigma_m_s": burn.delta_v_sigma_m_s, "duration_s": burn.duration_s,
                 "bias_m_s2": burn.bias_m_s2, "bias_added_delta_v_m_s": burn.delta_v_m_s(+1.0)},
        priors=priors.record(),
        priors_told=f"fall time {1e3 * priors.fall_s:g} +- {1e3 * priors.fall_sigma_s:g} ms; mass {priors.mass_kg:g} kg",
        doubts=(*doubts, "one thrust for all thrusters of the burn: the accelerometer does not tell them apart"),
    )  # fmt: skip
