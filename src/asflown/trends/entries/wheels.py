"""The entry of the wheels of one record: drag, spikes and use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...kit.plain import finite
from ..entry import Entry, Value
from .of_record import record_entry

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...estimate.wheels import DragFit, WheelDrag, WheelsResult
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


def _values(w: WheelDrag, f: DragFit | None):
    torque, per_rate = ("N m", "N m s")
    if f is not None and f.relative:
        torque, per_rate = "rad/s^2, per unit spin inertia", "1/s, per unit spin inertia"

    def of(figure: str, value, sigma, unit: str) -> Value:
        value = finite(value)
        return Value(f"{figure}_{w.name}", _BASIS, value, None if value is None else sigma, unit)

    yield of("coulomb_drag", f and f.coulomb_Nm, f and f.coulomb_sigma_Nm, torque)
    yield of("viscous_drag", f and f.viscous_Nms, f and f.viscous_sigma_Nms, per_rate)
    yield of("drag_spikes", None if w.spikes is None else len(w.spikes), None, "")
    yield of("low_speed_dwell", w.use.low_speed_dwell_s, None, "s")
    yield of("zero_crossings", w.use.zero_crossings, None, "")
    yield of("revolutions", w.use.revolutions, None, "")
