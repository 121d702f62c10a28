"""The thrust-vector-control frame, in which an execution error has a magnitude and a pointing part (Wagner 2014 Appendix C)."""

from __future__ import annotations

import numpy as np

from ..kit.errors import BadInput, some_of

#: Nothing smaller is a maneuver. [m/s]
SMALLEST = 1e-6
#: Sine of the smallest angle between the dV and the craft's X axis.  Nearer than that, an error of the axis of a
#: microradian would turn the whole frame about the dV by a milliradian.
_NEAREST = 1e-3
#: How far the craft's X axis, a unit vector, may be from length one.
_UNIT = 1e-3


def tvc_axes(expected_dv_N, craft_x_N, ids=None) -> np.ndarray:
    """Axes of the TVC frame in inertial components, (N, 3, 3): rows X, Y, Z.

    Z is along the expected dV, X along the part of the craft's X axis that is perpendicular to it, Y completes the
    right-handed set.  ``expected_dv_N`` (N, 3) [m/s] and ``craft_x_N`` (N, 3) [] are inertial.
    Raises BadInput, naming the maneuvers, where the dV is zero or along the craft's X axis: X has no direction then."""
    dv, x = np.atleast_2d(np.asarray(expected_dv_N, float)), np.atleast_2d(np.asarray(craft_x_N, float))
    names = [str(k + 1) for k in range(len(dv))] if ids is None else list(ids)
    size, length = np.linalg.norm(dv, axis=1), np.linalg.norm(x, axis=1)
    _refuse(size < SMALLEST, names, "the expected dV is zero", "A maneuver has an expected dV; leave others out.")
    _refuse(
        np.abs(length - 1) > _UNIT, names, "craft_x is not a unit vector",
        "Give the spacecraft's X axis as a direction in inertial axes, of length 1.",
    )  # fmt: skip
    z = dv / size[:, None]
    across = x - np.sum(x * z, axis=1, keepdims=True) * z
    width = np.linalg.norm(across, axis=1)
    _refuse(
        width < _NEAREST, names, "the expected dV is along the craft's X axis, so that the TVC frame is not defined",
        "Resolve these maneuvers' errors in a frame of your own, and give them as pointing_error_x and _y.",
    )  # fmt: skip
    across = across / width[:, None]
    return np.stack([across, np.cross(z, across), z], axis=1)


def resolved(reconstructed_dv_N, expected_dv_N, covariance_N, axes) -> tuple[np.ndarray, ...]:
    """Errors in the TVC frame: magnitude (N,), pointing (N, 2), sigma of the magnitude (N,), covariance of the pointing
    (N, 2, 2); SI.

    Magnitude error = |reconstructed| - |expected| (positive: overburn); pointing error = what of their difference
    lies in the plane across the expected dV.  ``covariance_N`` (N, 3, 3) is that of the reconstructed dV."""
    difference = reconstructed_dv_N - expected_dv_N
    size = np.linalg.norm(reconstructed_dv_N, axis=1)
    along = reconstructed_dv_N / np.where(size > 0, size, 1)[:, None]
    along = np.where(size[:, None] > 0, along, axes[:, 2])
    variance = np.einsum("ni,nij,nj->n", along, covariance_N, along)
    turned = axes @ covariance_N @ axes.transpose(0, 2, 1)
    pointing = np.einsum("nai,ni->na", axes[:, :2], difference)
    return size - np.linalg.norm(expected_dv_N, axis=1), pointing, np.sqrt(np.maximum(variance, 0)), turned[:, :2, :2]


def _refuse(bad, names, what: str, remedy: str) -> None:
    if bad.any():
        raise BadInput(f"{what} (maneuver {some_of([names[k] for k in np.flatnonzero(bad)], 6)})", remedy=remedy)
