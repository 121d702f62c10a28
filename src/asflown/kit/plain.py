"""Results in the few types that JSON has."""

from __future__ import annotations

import math
from datetime import date
from pathlib import Path


def finite(number) -> float | None:
    """The number as a plain float; None where it is none or not finite."""
    return None if number is None or not math.isfinite(number) else float(number)


def plain(value):
    """A value of a result in the types of JSON: numbers finite or null, arrays as lists."""
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        return finite(value)
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (Path, date)):
        return str(value)
    if hasattr(value, "tolist"):  # numpy, without importing it here
        return plain(value.tolist())
    if isinstance(value, (list, tuple, set)):
        return [plain(v) for v in value]
    raise TypeError(f"no JSON form for {type(value).__name__}")
