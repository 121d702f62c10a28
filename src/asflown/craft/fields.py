"""What the values of a craft file are: text with a unit, kept as SI with radians; dates; shares."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict

from ..kit.errors import BadInput
from ..kit.quantities import numbers, quantity
from ..kit.timeline import utc_to_tai_ns


class Described(BaseModel):
    """A table of a craft file: unknown keys are refused, values never change."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def _in(unit: str, count: int = 0) -> Any:
    """A field written as text with a unit, kept as SI."""
    parse = (lambda v: numbers(v, unit, count)) if count else (lambda v: quantity(v, unit))
    kind: Any = tuple[(float,) * count] if count else float
    return Annotated[kind, BeforeValidator(parse)]


def _cycles(text):
    return _turns(text) / (2 * np.pi)


def _turns(text):
    """A frequency in cycles or in radians a second -> rad/s."""
    if str(text).rstrip().endswith(" Hz"):  # the usual way
        return 2 * np.pi * quantity(text, "Hz")
    try:
        return quantity(text, "rad/s")
    except BadInput as why:
        try:
            return 2 * np.pi * quantity(text, "Hz")
        except BadInput:
            raise BadInput(why.what, remedy='Give it in "Hz" or in "rad/s".') from None


if TYPE_CHECKING:  # what the values are once loaded
    Kilogram = float
    Second = float
    Newton = float
    Pascal = float
    Frequency = float
    AngularFrequency = float
    KilogramMetre2 = float
    NewtonMetre = float
    NewtonMetreSecond = float
    Radian = float
    RadianPerSecond = float
    Metre = float
    Metre2 = float
    MetrePerSecond = float
    ViscousDrag = float
    NewtonMetrePerAmpere = float
    MetreVector = tuple[float, float, float]
    Direction = tuple[float, float, float]
    ModeCoupling = tuple[float, float, float]
    InertiaElements = tuple[float, float, float, float, float, float]
    InertiaRatio = tuple[float, float, float, float, float, float]
    TorqueVector = tuple[float, float, float]
    DipoleVector = tuple[float, float, float]
    AmpereMetre2 = float
    KilogramPerMetre3 = float
else:  # how they are written in TOML
    Kilogram, Second, Newton, Pascal = _in("kg"), _in("s"), _in("N"), _in("Pa")
    Frequency = Annotated[float, BeforeValidator(_cycles)]  # in Hz or rad/s, kept as Hz
    AngularFrequency = Annotated[float, BeforeValidator(_turns)]  # in Hz or rad/s, kept as rad/s
    KilogramMetre2, NewtonMetre, NewtonMetreSecond = _in("kg m2"), _in("N m"), _in("N m s")
    Radian, RadianPerSecond, ViscousDrag = _in("rad"), _in("rad/s"), _in("N m s / rad")
    NewtonMetrePerAmpere = _in("N m / A")
    Metre, Metre2, MetrePerSecond = _in("m"), _in("m2"), _in("m/s")
    MetreVector, Direction, ModeCoupling = _in("m", 3), _in("", 3), _in("kg(1/2) m", 3)
    InertiaElements, InertiaRatio = _in("kg m2", 6), _in("", 6)
    TorqueVector, DipoleVector = _in("N m", 3), _in("A m2", 3)
    AmpereMetre2, KilogramPerMetre3 = _in("A m2"), _in("kg / m3")


def _spin_inertia(value):
    if str(value).strip() == "unknown":
        return None
    inertia = quantity(value, "kg m2")
    if inertia <= 0:
        raise ValueError(f"{value!r} is not positive; the sign of rotation belongs to the axis")
    return inertia


SpinInertia = Annotated[float | None, BeforeValidator(_spin_inertia)]


def _utc_ns(value):
    return utc_to_tai_ns(str(value))


Date = Annotated[int, BeforeValidator(_utc_ns)]  # int64 ns TAI


def _share(value):
    share = quantity(value, "")
    if not 0 < share < 1:
        raise ValueError(f'{value!r} is no share between 0 and 1: write 5 % as "5 %" or 0.05')
    return share


Share = Annotated[float, BeforeValidator(_share)]
