"""Values of a scenario as they are written: numbers with units, series, tables by name."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import BeforeValidator

from ...craft.model import _in
from ...kit.quantities import numbers, quantity


def _series(unit: str):
    """'0 60 90 s' -> a tuple of any length, SI."""

    def parse(text):
        count = len(re.findall(r"(?:^|[\s,])[-+]?(?:\d|\.\d)", str(text)))
        return numbers(text, unit, count)

    return Annotated[tuple[float, ...], BeforeValidator(parse)]


def _by_name(unit: str):
    """{ RWA1 = "600 rpm" } -> SI numbers."""

    def parse(table):
        if not isinstance(table, dict):
            raise ValueError('write it as { NAME = "value unit" }')
        return {name: quantity(text, unit) for name, text in table.items()}

    return Annotated[dict[str, float], BeforeValidator(parse)]


TorqueVector, RateVector, AngleVector = _in("N m", 3), _in("rad/s", 3), _in("rad", 3)


RadianPerSecond2, KilometrePerSecond, Kelvin = _in("rad/s2"), _in("m/s"), _in("K")
Share = Annotated[float, BeforeValidator(lambda value: quantity(value, ""))]
