"""Velocity from an accelerometer's counts: its bias, what a burn gave, and instants at which the velocity is known well.

Counts are integers.  While nothing fires only the bias changes them, and at the tick from one count to the next the velocity is
known much better than to a count.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput
from ...kit.timeline import NS
from ..firing import Chain, Counters, Nuisance, Parameter, Source

if TYPE_CHECKING:
    from ...craft.model import Accelerometer, Craft, Thruster
    from ...telemetry.telemetry import Telemetry
    from ..firing import Firings, Priors

CHANNEL = "accelerometer_count"
#: A burn is where its thrusters are on for more than this share of the most they are.
_BURNING = 0.2
#: Sigma of the velocity at a tick is at least this share of a count, however often it is sampled: an accelerometer has noise.
_TICK = 0.1
#: Sigma of a bias that is not known beforehand. [m/s2]
_ANY_BIAS = 1.0


class NoBurn(BadInput):
    """No burn is in the record, or the counts do not reach beyond both its ends."""


@dataclass(frozen=True)
class Burn:
    """Change of counts over a burn, its length, and the bias found before it."""

    duration_s: float
    counts: float
    scale_m_s: float
    bias_m_s2: float
    bias_sigma_m_s2: float
    on_time_s: np.ndarray  # (j,)
    pulses: np.ndarray  # (j,)
    squares_s2: np.ndarray  # (j,): of the pulses' lengths, added up

    def delta_v_m_s(self, sign: float = -1.0) -> float:
        """Velocity gained along the accelerometer's axis.

        Feldman & Lee, Appendix D, add the bias times the time (``sign`` +1); a bias that is the output's own drift must be
        subtracted (-1)."""
        return self.counts * self.scale_m_s + sign * self.bias_m_s2 * self.duration_s

    @property
    def delta_v_sigma_m_s(self) -> float:
        return float(np.hypot(self.scale_m_s / np.sqrt(6), self.bias_sigma_m_s2 * self.duration_s))

    def record(self) -> dict:
        return {
            "delta_v_m_s": self.delta_v_m_s(),
            "delta_v_sigma_m_s": self.delta_v_sigma_m_s,
            "duration_s": self.duration_s,
            "bias_m_s2": self.bias_m_s2,
            "bias_added_delta_v_m_s": self.delta_v_m_s(+1.0),
        }


def mass_not_known() -> BadInput:
    return BadInput("the craft's mass is not known, and F = M dV / on-time needs it", remedy='Give --mass "3160 kg".')


def accelerometer_of(craft: Craft) -> Accelerometer:
    """Raises BadInput for a craft without one."""
    if craft.accelerometer is None:
        raise BadInput(
            f"{craft.name} has no accelerometer", remedy="Give its file an [accelerometer], or use --method joint."
        )
    return craft.accelerometer


def along_of(craft: Craft, thrusters: tuple[Thruster, ...]) -> np.ndarray:
    """What a newton second of each gives along the accelerometer's axis, in newton seconds, (j,)."""
    axis = np.array(accelerometer_of(craft).axis, float)
    return np.array([t.direction for t in thrusters], float) @ axis / np.linalg.norm(axis)


def burn_of(tlm: Telemetry, craft: Craft, thrusters: tuple[Thruster, ...], counters: Counters) -> Burn:
    """The burn in a record: its counts from before to after, and the bias before.

    Raises BadInput without counts, NoBurn without a burn or where the record does not reach beyond both its ends."""
    share = along_of(craft, thrusters)
    if CHANNEL not in tlm:
        raise BadInput(
            "the accelerometer's counts are not in the telemetry",
            file=tlm.source or None,
            channel=CHANNEL,
            remedy="Add the channel, or use --method joint.",
        )
    c = tlm.channel(CHANNEL).usable
    t, t_on = (np.asarray(v - counters.tai_ns[0], float) / NS for v in (c.tai_ns, counters.tai_ns))
    duty = (np.diff(counters.on_time_s, axis=0) @ np.abs(share)) / np.diff(t_on)
    burning = np.flatnonzero(duty > _BURNING * duty.max()) if len(duty) and duty.max() > 0 else np.empty(0, int)
    if not len(burning):
        raise NoBurn("no burn is in this record", file=tlm.source or None, remedy="Take the span of a burn.")
    first, last = burning[0], burning[-1] + 1
    before, after = np.flatnonzero(t <= t_on[first]), np.flatnonzero(t >= t_on[last])
    if len(before) < 3 or not len(after):
        raise NoBurn(
            "the accelerometer's counts do not reach from before the burn to after it",
            file=tlm.source or None,
            channel=CHANNEL,
            remedy="Take a longer span: the bias is that of the counts before the burn.",
        )
    scale = accelerometer_of(craft).scale
    bias, sigma = _bias(t[before], c.values[before], scale)
    a, b = before[-1], after[0]
    ends = counters.at(c.tai_ns[[a, b]])
    on_time_s, pulses, squares = (np.diff(x, axis=0)[0] for x in (ends.on_time_s, ends.pulses, ends.squares))
    return Burn(
        duration_s=float(t[b] - t[a]),
        counts=float(c.values[b] - c.values[a]),
        scale_m_s=scale,
        bias_m_s2=bias,
        bias_sigma_m_s2=sigma,
        on_time_s=on_time_s,
        pulses=pulses,
        squares_s2=squares,
    )


def _bias(t, counts, scale: float) -> tuple[float, float]:
    """Slope of counts before a burn and its sigma. [m/s2]"""
    ticks = np.flatnonzero(np.diff(counts) != 0)
    if len(ticks) < 2:
        return 0.0, scale / max(float(np.ptp(t)), 1e-9)
    at, level = 0.5 * (t[ticks] + t[ticks + 1]), np.maximum(counts[ticks], counts[ticks + 1])
    slope, cadence = scale * np.polyfit(at, level, 1)[0], float(np.median(np.diff(t)))
    own = np.hypot(_TICK * scale, abs(slope) * cadence / np.sqrt(12))
    return float(slope), float(own / (np.std(at) * np.sqrt(len(at))))


def velocity_chain(f: Firings, priors: Priors, number: int) -> Chain:
    """The velocity where it is known: at ticks while nothing fires, and at the ends of such spans.

    Raises BadInput as ``burn_of`` does, and for priors without a mass."""
    if priors.mass_kg is None:
        raise mass_not_known()
    tlm, craft, thrusters, counters = f.telemetry, f.subject.craft.craft, f.thrusters, f.counters
    share = along_of(craft, thrusters)
    burn_of(tlm, craft, thrusters, counters)
    scale = accelerometer_of(craft).scale
    c = tlm.channel(CHANNEL).usable
    inside = (c.tai_ns >= counters.tai_ns[0]) & (c.tai_ns <= counters.tai_ns[-1])
    tai_ns, counts = c.tai_ns[inside], c.values[inside]
    quiet = np.diff(counters.at(tai_ns).on_time_s @ np.abs(share)) == 0
    tick = quiet & (np.abs(np.diff(counts)) == 1)
    edge = np.flatnonzero(np.diff(np.r_[False, quiet, False].astype(int)))  # first and last sample of each quiet span
    middle_ns = (tai_ns[:-1] + tai_ns[1:]) // 2
    found = [
        (int(ns), scale * max(a, b), True)
        for ns, a, b in zip(middle_ns[tick], counts[:-1][tick], counts[1:][tick], strict=True)
    ]
    found += [(int(tai_ns[k]), scale * (counts[k] + 0.5), False) for k in np.unique(np.minimum(edge, len(counts) - 1))]
    found.sort()
    at, v, ticking = (np.array(column) for column in zip(*found, strict=True))
    t = (at - at[0]) / NS
    cadence = float(np.median(np.diff(tai_ns))) / NS
    apart = float(np.median(np.diff(t[ticking]))) if ticking.sum() > 2 else cadence
    tick_sigma = scale * np.hypot(_TICK, cadence / max(apart, cadence) / np.sqrt(12))
    return Chain(
        what=f"velocity of record {number}",
        steps=np.diff(v)[:, None],
        turn=None,
        along=np.array([x.direction for x in thrusters], float),
        places=share / priors.mass_kg,
        known=counters.at(at),
        used=np.ones(len(v) - 1, bool),
        step_s=f.step_s,
        record=number,
        long_of=counters.lengths.thruster,
        weak=counters.weak(priors.pulse_scatter),
        sample_sigma=np.where(ticking, tick_sigma, scale / np.sqrt(12)),
        nuisances=(Nuisance(Parameter(Source.ACCELEROMETER_BIAS, f"record {number}"), np.diff(t)[:, None], _ANY_BIAS),),
    )
