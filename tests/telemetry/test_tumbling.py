"""Crafts that tumble: large body rates are no wrong unit where something else turns as they say."""

import numpy as np
import pytest

from asflown import load_telemetry
from asflown.kit.rotations import rotation
from asflown.telemetry.findings import IMPLAUSIBLE

RATE = np.array([0.3, -0.5, 0.4])  # rad/s, constant
T = np.arange(0, 120, 0.5)


def record(factor=1.0, *, field=False, quaternion=False):
    """Body rates in a unit that is ``factor`` of that said, with what turns as the craft does."""
    rng = np.random.default_rng(4)
    data = {"time [s]": T} | {f"body_rate_{a} [rad/s]": factor * (w + rng.normal(0, 1e-3, len(T))) for a, w in zip("xyz", RATE, strict=True)}  # fmt: skip
    half = np.linalg.norm(RATE) * T / 2
    q = np.column_stack([np.cos(half), np.sin(half)[:, None] * RATE / np.linalg.norm(RATE)])
    if quaternion:
        data |= {f"quaternion_{m} []": q[:, k] for k, m in enumerate("wxyz")}
    if field:
        b = rotation(q).inv().apply([2e-5, 1e-5, -3e-5]) + rng.normal(0, 1e-7, (len(T), 3))
        data |= {f"magnetic_field_{a} [T]": b[:, k] for k, a in enumerate("xyz")}
    return load_telemetry(data)


@pytest.mark.parametrize("seen", [{"field": True}, {"quaternion": True}])
def test_law_what_turns_as_the_rates_say_takes_their_doubt_off(seen):
    assert not record(**seen).doubts.of(IMPLAUSIBLE)
    assert record(180 / np.pi, **seen).doubts.of(IMPLAUSIBLE)
    assert record().doubts.of(IMPLAUSIBLE)
