"""Findings of the screening: counted, listed by `telemetry check`, and doubts of every result that uses the channels concerned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..kit.doubts import Doubts, Kind, Severity

if TYPE_CHECKING:
    from collections.abc import Iterable


@dataclass(frozen=True)
class Finding:
    """One kind of fault found in a channel ('' for the whole file): how often, and where first."""

    channel: str
    what: str  # duplicate, conflict, disorder, repeat, spike, stuck, still, wrap, fall, norm, nan, gap, dropout, orbit, ignored, excluded, fill, declared, stray, form
    count: int
    first_tai_ns: int
    detail: str


_CHECK = "Run asflown telemetry check on the file."

IMPLAUSIBLE = Kind(
    "telemetry.implausible", Severity.SUSPECT,
    "{channels}: values reach {largest:.4g} {unit}, beyond {limit_of} of {limit:.4g} {unit}{guess}",
    "Check the unit in the heading or in the channel dictionary.",
)  # fmt: skip
ERROR_TOO_FAST = Kind(
    "telemetry.attitude-error-scale", Severity.SUSPECT,
    "{channels}: the attitude error changes {ratio:.3g} times as fast as the body turns: are the values mrad or deg labelled {unit}?",
    "Check the unit in the heading or in the channel dictionary.",
)  # fmt: skip
NEVER_TOGETHER = Kind(
    "telemetry.attitude-untested", Severity.NOTE,
    "the direction of the quaternion cannot be tested: body rates and attitude are rarely known at the same time",
)  # fmt: skip
TURNS_TOO_LITTLE = Kind(
    "telemetry.turns-too-little", Severity.NOTE,
    "the direction of the quaternion cannot be tested: the body turns too little (rms rate {rms_rad_s:.2g} rad/s)",
)  # fmt: skip
RATE_SCALE = Kind(
    "telemetry.rate-scale", Severity.SUSPECT,
    "{channels}: the body rates are {ratio:.4g} times those of the quaternion: {guess}",
    "Check the unit of the body rates.",
)  # fmt: skip
OTHER_FRAME = Kind(
    "telemetry.attitude-other-frame", Severity.SUSPECT,
    "the quaternion turns about other axes than the body rates: its rates fit (to {left_percent:.2g} %) if turned by {turn}.  Is it of "
    "another body frame, such as a star tracker's mounting?",
    "Turn the quaternion or the body rates into the craft's axes; or take a bias off the body rates.",
)  # fmt: skip
NO_READING = Kind(
    "telemetry.attitude-no-reading", Severity.SUSPECT,
    "body rates ({rates_rad_s:.2g} rad/s rms) and the turn of the quaternion ({quaternion_rad_s:.2g} rad/s) fit under no reading: not as "
    "its conjugate, in another order, or turned into other body axes",
    "Is the quaternion relative to the orbit's axes? It must be body to inertial. Check time stamps, and a bias of the body rates.",
)  # fmt: skip
COMMAND_APART = Kind(
    "telemetry.command-apart", Severity.SUSPECT,
    "the commanded quaternion contradicts the attitude ({off_deg:.0f} degrees, median): {how}",
    "Give commanded_quaternion_w, _x, _y, _z body to inertial, scalar and order as of the quaternion.",
)  # fmt: skip
NO_SIGN = Kind(
    "telemetry.no-sign", Severity.SUSPECT,
    "{channels}: the rate falls to zero and rises again at the same pace: is it a speed without its sign?",
    "Give the rate with its sign, or divide the record at the zero and reverse one part.",
)  # fmt: skip
NOT_UNIT = Kind(
    "telemetry.sun-not-unit", Severity.SUSPECT,
    "sun_direction has a length of {length:.3g} (median where it is not zero): it must be a unit vector, or zero in shadow",
    "Divide it by its length; zeros must mean shadow.",
)  # fmt: skip

#: Finding -> its doubt.  Findings not listed here do no harm: samples that are missing (gap, dropout),
#: excluded by the user (excluded) or not requested (ignored), declared fill values (declared), how the file was read (form).
OF_FINDING = {
    "duplicate": Kind("telemetry.duplicates", Severity.NOTE,
                      "{count} samples are copies of others with the same time stamp{where}; they were left out", _CHECK),
    "conflict": Kind("telemetry.conflicts", Severity.SUSPECT,
                     "{count} samples have the time stamp of another sample and other values{where}; they were left out",
                     "Give time stamps with more digits, or the cadence under [time] of a channel dictionary."),
    "disorder": Kind("telemetry.disorder", Severity.CAUTION, "{count} late samples{where} were sorted by time", _CHECK),
    "repeat": Kind("telemetry.repeats", Severity.CAUTION,
                   "{count} samples repeat the previous value bit for bit{where}: stale frames", _CHECK),
    "fill": Kind("telemetry.fill", Severity.CAUTION,
                 "{count} samples hold fill values or come from unfilled packets{where}; they were left out",
                 "Declare fill values in a channel dictionary (fill = [...])."),
    "stray": Kind("telemetry.strays", Severity.CAUTION,
                  "{count} samples are stamped far off those beside them in the file{where}; they were left out", _CHECK),
    "saturated": Kind("telemetry.saturated", Severity.SUSPECT,
                      "{count} samples hold the channel's extreme value{where}: a sensor at the end of its range? They were left out", _CHECK),
    "unit": Kind("telemetry.unit-contradiction", Severity.SUSPECT,
                 "the headings of {count} columns name another unit than the channel dictionary{where}; the dictionary was followed",
                 "Correct the unit in the channel dictionary, or the heading."),
    "spike": Kind("telemetry.spikes", Severity.CAUTION, "{count} spikes were left out{where}", _CHECK),
    "stuck": Kind("telemetry.stuck", Severity.CAUTION,
                  "a noisy sensor repeats one value for {count} samples{where}; they were left out", _CHECK),
    "still": Kind("telemetry.still", Severity.CAUTION,
                  "one value repeats for {count} samples{where}: a stuck sensor, or no motion? They are used", _CHECK),
    "wrap": Kind("telemetry.wraps", Severity.NOTE, "{count} declared wraps were unwrapped{where}"),
    "fall": Kind("telemetry.falls", Severity.SUSPECT,
                 "a counter decreases or a value jumps over its whole range {count} times{where}: an undeclared wrap or a reset?",
                 "Declare the wrap in a channel dictionary, or divide the record at the reset."),
    "norm": Kind("telemetry.norm", Severity.SUSPECT, "{count} quaternions do not have unit length; they were left out", _CHECK),
    "nan": Kind("telemetry.nan", Severity.NOTE, "{count} cells contain 'nan' or another word for no value{where}; they count as blank"),
    "orbit": Kind("telemetry.no-orbit", Severity.CAUTION, "{count} quaternions were sampled while the orbit is not known; they were left out"),
}  # fmt: skip


def found_in(findings: Iterable[Finding], used: Iterable[str]) -> Doubts:
    """One doubt of each kind for the channels used; a finding about the whole file concerns all of them."""
    used = set(used)
    by_kind: dict[str, list[Finding]] = {}
    for f in findings:
        if f.what in OF_FINDING and used and (not f.channel or f.channel in used):
            by_kind.setdefault(f.what, []).append(f)
    doubts = []
    for what, those in by_kind.items():
        channels = list(dict.fromkeys(f.channel for f in those if f.channel))
        where = (
            f" in {', '.join(channels[:3])}{f' and {len(channels) - 3} more' if len(channels) > 3 else ''}"
            if channels
            else ""
        )
        doubts.append(
            OF_FINDING[what](count=sum(f.count for f in those), where=where, channels=channels).passed_on_by(
                "telemetry"
            )
        )
    return Doubts(doubts)
