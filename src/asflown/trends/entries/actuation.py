"""One actuation, from its telemetry to its entry."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...estimate.torque import TorqueResult, torque
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.ensemble import spread
from ...kit.errors import BadInput, some_of
from ...kit.timeline import NS, utc_label
from ...telemetry.channels import AXES
from ...telemetry.load import load_telemetry
from ..entry import BEST, Curve, Entry, Value
from .declared import contradictions
from .figures import FIGURES, Actuation, Torque, measure

if TYPE_CHECKING:
    from ...craft.model import Craft, Mechanism
    from ...telemetry.telemetry import Telemetry
    from .events import Event

#: Basis -> method and variant of the torque.
BASES = {
    "fused": ("fused", "corrected"),
    "momentum, printed": ("momentum", "printed"),
    "transfer, printed": ("transfer", "printed"),
}
#: Devices' channels kept with the torque (cover paper Fig 9).
DEVICES = ("motor_current", "cover_angle", "motor_temperature")
#: A check figure this many sigma from zero raises a doubt.
_OFF_ZERO = 3.0
#: A hinge within this angle of a body axis needs that axis alone.
_ALONG = 1e-6
#: A torque shows the motor's start where it is this many sigma from zero.
_ONSET = 5.0


START_UNSURE = Kind(
    "trends.start-unsure", Severity.CAUTION,
    "the motor's start is not in the event list; it is known to {sigma_s:.2g} s (1 sigma)",
    "List the event with its motor_on time.",
)  # fmt: skip
NOT_ZERO = Kind(
    "trends.not-zero", Severity.SUSPECT,
    "{figure} is {value:+.2g} ± {sigma:.1g} {unit} but should be zero: an external torque acts, or the inertia is wrong",
    "Check the inertia on that date, and other torques in the record.",
)  # fmt: skip


def analyse(event: Event, craft: Craft, telemetry: Telemetry | None = None) -> Entry:
    """Figures of merit and curves of one event; an event without a file keeps only its date.

    ``telemetry``: in place of the event's file.  Torques are about the hinge, on the body without the mechanism.
    Raises BadInput where the file cannot be used, or the craft has no mechanism that fits."""
    if event.file is None and telemetry is None:
        return Entry(craft.name, event.id, event.kind, event.date or "", event.motor, event.note)
    whole = telemetry if telemetry is not None else load_telemetry(event.file, craft=craft)
    tlm = whole.between(event.start_s, event.stop_s)
    mechanism = _mechanism(craft, event, tlm)
    first, last = (float(tlm.seconds(t)) for t in tlm.span())
    if not first <= event.motor_on_s < event.motor_off_s <= last:
        raise BadInput(
            f"event {event.id!r}: the motor runs from {event.motor_on_s:g} to {event.motor_off_s:g} s, "
            f"the telemetry from {first:g} to {last:g} s",
            file=tlm.source, remedy="Times count from the file's epoch.",
        )  # fmt: skip
    results = {basis: _torque(tlm, craft, mechanism, *how) for basis, how in BASES.items()}
    doubts: list[Doubt | None] = list(results["fused"].doubts)
    doubts += contradictions(
        event, tlm, Actuation(tlm, event, mechanism), _about_hinge(results["fused"], mechanism, event)
    )
    event = _started(event, results["fused"], mechanism)
    torques = {basis: _about_hinge(r, mechanism, event) for basis, r in results.items()}
    values: list[Value] = []
    for figure in FIGURES.values():
        of = torques if figure.of == "torque" else {"telemetry": Actuation(tlm, event, mechanism)}
        for basis, subject in of.items():
            value, doubt = measure(figure, subject, basis)
            values.append(value)
            if basis in BEST:
                doubts += [doubt, _check_doubt(figure, value)]
    if event.motor_on_sigma_s:
        doubts.append(START_UNSURE(sigma_s=event.motor_on_sigma_s))
    date = event.date or (utc_label(tlm.epoch_ns + round(event.motor_on_s * NS)) if tlm.dated else None)
    if date is None:
        raise BadInput(
            f"neither event {event.id!r} nor its telemetry has a date",
            file=tlm.source,
            remedy="Give its date in the list.",
        )
    settings = results["fused"].settings
    return Entry(
        craft.name, event.id, event.kind, date, event.motor, event.note, tuple(values),
        tuple(_curves(tlm, event, torques, mechanism)), Doubts(doubts),
        {"inputs": [{"file": tlm.source, "sha256": tlm.sha256}],
         "inertia": {k: settings[k] for k in settings if "inertia" in k},
         "fused": {k: settings[k] for k in ("prior", "loop", "seed") if k in settings},
         "motor_on_s": event.motor_on_s, "motor_off_s": event.motor_off_s, "mechanism": mechanism.name,
         "cycles_allowed": mechanism.cycles_allowed},
    )  # fmt: skip


def torque_about_hinge(tlm: Telemetry, craft: Craft, event: Event, basis: str = "fused") -> Torque:
    """The torque from which the event's figures are computed."""
    mechanism = _mechanism(craft, event, tlm)
    return _about_hinge(_torque(tlm, craft, mechanism, *BASES[basis]), mechanism, event)


def _mechanism(craft: Craft, event: Event, tlm: Telemetry) -> Mechanism:
    names = [m.name for m in craft.mechanisms]
    if not names:
        raise BadInput(
            f"the craft {craft.name} has no mechanism", remedy="Add it under [[mechanisms]] in the craft file."
        )
    if len(names) == 1:
        return craft.mechanisms[0]
    moved = [n for n in names if f"cover_angle_{n}" in tlm]
    if len(moved) != 1:
        raise BadInput(
            f"event {event.id!r}: the telemetry does not show which of the mechanisms {some_of(names)} moves",
            file=tlm.source, channel="cover_angle", remedy="Name the channel cover_angle_<MECHANISM>.",
        )  # fmt: skip
    return craft.mechanism(moved[0])


def _hinge(mechanism: Mechanism) -> tuple[np.ndarray, str]:
    """Unit vector of the hinge, and the body axis it lies along ('all' where along none)."""
    h = np.array(mechanism.hinge_axis, float)
    h /= np.linalg.norm(h)
    along = [a for a, x in zip(AXES, h, strict=True) if abs(abs(x) - 1) < _ALONG]
    return h, along[0] if along else "all"


def _torque(tlm: Telemetry, craft: Craft, mechanism: Mechanism, method: str, variant: str) -> TorqueResult:
    return torque(tlm, craft, method=method, variant=variant, axis=_hinge(mechanism)[1], moving=mechanism.name)


def _about_hinge(result: TorqueResult, mechanism: Mechanism, event: Event) -> Torque:
    h, _axis = _hinge(mechanism)
    columns = list(result.axes)
    mean = result.torque_Nm[:, columns] @ h[columns]
    known = np.isfinite(mean)
    t = result.time_s - event.motor_on_s
    if result.paths_Nm is None:
        return Torque(t[known], mean[known])
    drawn = result.paths_Nm[:, :, columns] @ h[columns]
    return Torque(t[known], mean[known], result.paths_time_s - event.motor_on_s, drawn, event.motor_on_sigma_s)


def _started(event: Event, result: TorqueResult, mechanism: Mechanism) -> Event:
    """The event with the motor's start taken from the torque's onset, where it is known only to a sampling interval."""
    if not event.motor_on_sigma_s:
        return event
    torque = _about_hinge(result, mechanism, event)
    sigma = spread(torque.drawn_Nm)
    drawn = np.abs(torque.drawn_Nm.mean(axis=0)) > _ONSET * sigma
    reach = event.motor_on_sigma_s * np.sqrt(3)
    seen = np.flatnonzero(drawn & (np.abs(torque.drawn_time_s) <= reach + 5))
    if not len(seen):
        return event
    return replace(event, motor_on_s=event.motor_on_s + float(torque.drawn_time_s[seen[0]]), motor_on_sigma_s=2.0)


def _check_doubt(figure, value: Value) -> Doubt | None:
    if not figure.is_check or value.value is None or not value.sigma or abs(value.value) <= _OFF_ZERO * value.sigma:
        return None
    return NOT_ZERO(figure=figure.name, value=value.value, sigma=value.sigma, unit=value.unit)


def _curves(tlm: Telemetry, event: Event, torques: dict[str, Torque], mechanism: Mechanism):
    for basis, found in torques.items():
        sigma = None
        if len(found.drawn_Nm):
            sigma = np.interp(found.time_s, found.drawn_time_s, spread(found.drawn_Nm))
        yield Curve(f"torque, {basis}", "N m", found.time_s, found.mean_Nm, sigma)
    actuation = Actuation(tlm, event, mechanism)
    for stem in DEVICES:
        samples = actuation.samples(stem)
        if samples is not None and len(samples[0]):
            unit = next(c.kind.unit for c in tlm.channels.values() if c.kind.stem == stem)
            yield Curve(stem, unit, samples[0], np.asarray(samples[1], float))
