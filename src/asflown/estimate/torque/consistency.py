"""Wheels against attitude error: signs and units betray themselves."""

from __future__ import annotations

import numpy as np

from ...kit.errors import BadInput
from ...telemetry.channels import AXES
from ..subject import Subject, slews, thrusters_firing
from . import momentum, transfer

_SLIPS = {
    60 / (2 * np.pi): "wheel rates in rpm labelled rad/s",
    2 * np.pi / 60: "wheel rates in rad/s labelled rpm",
    1e-3: "attitude error in mrad labelled rad",
    1e3: "attitude error in rad labelled mrad, or wheel rates a thousand times too large",
    np.pi / 180: "attitude error in degrees labelled rad",
    180 / np.pi: "attitude error in rad labelled degrees",
}


def consistency_doubts(grid_a, from_wheels, sigma_wheels, grid_b, from_error, sigma_error) -> list[str]:
    """What wheels and attitude error say of each other's sign and unit, axis by axis."""
    doubts = []
    ta = grid_a.start_ns * 1e-9 + grid_a.seconds
    tb = grid_b.start_ns * 1e-9 + grid_b.seconds
    for j, axis in enumerate(AXES):
        b = np.interp(ta, tb, from_error[:, j], left=np.nan, right=np.nan)
        good = np.isfinite(from_wheels[:, j]) & np.isfinite(b)
        if good.sum() < 30:
            continue
        x, y = from_wheels[good, j], b[good]
        loud_x = np.std(x) > 3 * np.nanmedian(sigma_wheels[:, j])
        loud_y = np.std(y) > 3 * np.nanmedian(sigma_error[:, j])
        if not (loud_x and loud_y):
            continue  # noise against noise says nothing
        r = float(np.corrcoef(x, y)[0, 1])
        if r < -0.3:
            doubts.append(
                f"torque {axis} from wheels and from attitude error run against each other (correlation {r:.2f}): "
                "a sign is wrong, most often that of the attitude error (commanded minus estimated) or of a wheel axis"
            )
        ratio = float(np.std(x) / np.std(y))
        for factor, slip in _SLIPS.items():
            if abs(r) > 0.5 and abs(np.log(ratio / factor)) < 0.3:
                doubts.append(f"torque {axis} from wheels is {ratio:.3g} times that from attitude error: {slip}?")
    return doubts


def consistency(subject: Subject, ready: dict) -> list[str]:
    """Set wheels against attitude error where both are there: signs and units betray themselves."""
    tlm = subject.telemetry
    if slews(tlm) or thrusters_firing(tlm):
        return []  # the attitude error then answers to more than the disturbance
    wheels = bool(tlm.members("wheel_rate")) and not subject.relative
    errors = any(f"attitude_error_{a}" in tlm for a in AXES)
    if not (wheels and errors) or subject.inertia_kgm2 is None or subject.craft.craft.wheel_controller is None:
        return []
    try:
        a = ready.get("momentum") or momentum.corrected(subject)
        b = ready.get("transfer") or transfer.corrected(subject)
    except BadInput:
        return []  # one of the two cannot be had: nothing to set against each other
    return consistency_doubts(a[0], a[1], a[2], b[0], b[1], b[2])
