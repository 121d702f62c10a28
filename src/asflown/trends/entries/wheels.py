"""The entry of the wheels of one record: drag, spikes and use."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ...estimate.wheels import MISFIT
from ...kit.doubts import Doubts
from ...kit.plain import finite
from ...kit.timeline import NS, utc_label
from ..entry import Entry, Value
from .of_record import record_entry

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...estimate.wheels import DragFit, RunDown, WheelDrag, WheelsResult
    from ...telemetry.telemetry import Telemetry

KIND = "wheels"
_BASIS = "telemetry"


def wheel_entry(
    result: WheelsResult, telemetry: Telemetry, craft: Craft, event_id: str | None = None, *, guesses: bool = False
) -> Entry:
    """The entry of one record's wheels.

    Parameters
    ----------
    result : WheelsResult
        What was found of them.
    telemetry : Telemetry
        The record that it was found in.
    craft : Craft
        Whose wheels they are.
    event_id : str, optional
        Name of the entry; made from the date unless given.
    guesses : bool
        Whether to keep drag of run-downs that only their shape shows; without it, the best of the other ways is kept.

    Returns
    -------
    Entry
        Its doubts keep which wheel they are about, so that a verdict leaves out what is suspect.

    Raises
    ------
    BadInput
        For telemetry without an epoch.
    """
    values = tuple(v for w in result.wheels for v in _values(w, w.fit if guesses else w.known_fit))
    return record_entry(KIND, values, result.doubts, telemetry, craft, event_id, result.provenance)


def run_down_entries(
    result: WheelsResult, telemetry: Telemetry, craft: Craft, event_id: str | None = None, *, guesses: bool = False
) -> list[Entry]:
    """An entry of every run-down of one record: the drag of that wheel by that run-down alone, of the date at which it begins.

    Parameters
    ----------
    result, telemetry, craft, guesses :
        As of ``wheel_entry``.
    event_id : str, optional
        With what the names of the entries begin; 'wheels' unless given.

    Returns
    -------
    list of Entry
        In order of time.  Each has the doubts about the record, and those about its wheel and run-down.

    Raises
    ------
    BadInput
        For telemetry without an epoch.
    """
    found, provenance = [], result.provenance
    for w in result.wheels:
        for r in w.run_downs:
            if r.is_guessed and not guesses:
                continue
            date = utc_label(telemetry.epoch_ns + round(r.start_s * NS))
            name = f"{event_id or KIND}-{w.name}-{date}"
            doubts = Doubts(_about(result.doubts, w, r))
            entry = record_entry(KIND, tuple(_drag(w, w.alone(r))), doubts, telemetry, craft, name, provenance)
            found.append(replace(entry, date=date))
    return sorted(found, key=lambda e: e.day)


def _about(doubts: Doubts, w: WheelDrag, r: RunDown):
    """Those about the record, and about a wheel in one of its run-downs."""
    for d in doubts.without(MISFIT):  # that of all run-downs together
        channel = d.about.get("channel", "")
        others = "wheels" in d.about or (channel.startswith("wheel_") and not channel.endswith(f"_{w.name}"))
        elsewhere = d.numbers.get("stop_s", r.stop_s) <= r.start_s or d.numbers.get("start_s", r.start_s) >= r.stop_s
        if d.about.get("wheel", w.name) == w.name and not others and not elsewhere:
            yield d
    if (ratio := r.alone.misfits) is not None:
        yield MISFIT(wheel=w.name, ratio=ratio)


def _drag(w: WheelDrag, f: DragFit | None):
    torque, per_rate = ("N m", "N m s")
    if f is not None and f.relative:
        torque, per_rate = "rad/s^2, per unit spin inertia", "1/s, per unit spin inertia"
    yield _of(w, "coulomb_drag", f and f.coulomb_Nm, f and f.coulomb_sigma_Nm, torque)
    yield _of(w, "viscous_drag", f and f.viscous_Nms, f and f.viscous_sigma_Nms, per_rate)


def _of(w: WheelDrag, figure: str, value, sigma, unit: str) -> Value:
    value = finite(value)
    return Value(f"{figure}_{w.name}", _BASIS, value, None if value is None else sigma, unit)


def _values(w: WheelDrag, f: DragFit | None):
    def of(figure: str, value, sigma, unit: str) -> Value:
        return _of(w, figure, value, sigma, unit)

    yield from _drag(w, f)
    yield of("drag_spikes", None if w.spikes is None else len(w.spikes), None, "")
    yield of("low_speed_dwell", w.use.low_speed_dwell_s, None, "s")
    yield of("zero_crossings", w.use.zero_crossings, None, "")
    yield of("revolutions", w.use.revolutions, None, "")
