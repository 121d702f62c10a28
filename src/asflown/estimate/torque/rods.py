"""Torque rods that switch faster than a torque is resolved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ...telemetry.channels import AXES

if TYPE_CHECKING:
    from ...telemetry.telemetry import Telemetry

#: What lasts less than this is averaged out of a torque [s]; the field of a low orbit, where there is no magnetometer [T].
_AVERAGED_S, _FIELD_T = 60.0, 4e-5
#: Share of the torque's sigma from which it counts.
_COUNTS = 0.5

RODS_PULSE = Kind(
    "torque.rods-pulse", Severity.SUSPECT,
    "the torque rods switch faster than the torque is resolved: {size_Nm:.2g} N m (rms) of what they exert is averaged out, and the band "
    "does not contain it",
    "Add --with rods: the fused method then has their pulses as a known torque.",
)  # fmt: skip


def rods_doubt(telemetry: Telemetry, sigma_Nm: np.ndarray | None) -> Doubt | None:
    """That the rods' pulses are not in the band of a torque with the sigma (M, 3) [N m]; None where they do not matter.

    Without a sigma every pulse matters."""
    if not telemetry.has_axes("torque_rod_dipole"):
        return None
    known = np.zeros(1) if sigma_Nm is None else sigma_Nm[np.isfinite(sigma_Nm)]
    tai_ns, dipole = together(telemetry, [f"torque_rod_dipole_{a}" for a in AXES])
    if len(tai_ns) < 3 or len(known) == 0:
        return None
    width = round(_AVERAGED_S * NS / max(float(np.median(np.diff(tai_ns))), 1.0))
    sums, at = np.vstack([np.zeros(3), np.cumsum(dipole, axis=0)]), np.arange(len(dipole))
    low, high = np.maximum(at - width // 2, 0), np.minimum(at + width // 2 + 1, len(dipole))
    pulses = dipole - (sums[high] - sums[low]) / (high - low)[:, None]
    size = _field(telemetry) * float(np.sqrt(2 * np.mean(pulses**2)))  # a dipole turns the body about two of three axes
    return RODS_PULSE(size_Nm=size) if size > _COUNTS * float(np.median(known)) else None


def _field(telemetry: Telemetry) -> float:
    """Size (rms) of the magnetic field. [T]"""
    if not telemetry.has_axes("magnetic_field"):
        return _FIELD_T
    return float(np.sqrt(sum(np.mean(telemetry.channels[f"magnetic_field_{a}"].usable.values ** 2) for a in AXES)))
