"""Whether errors keep one bias through the table, and whether they kept their signs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.special import log_ndtr

from ...kit.doubts import Doubt, Kind, Severity
from ...maneuvers.model import Quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...maneuvers.table import Maneuvers
    from .result import Part

#: Burns that a comparison takes, and on either side of a change.
_FEWEST, _SIDE = 12, 4
#: Sequences drawn for the p-value, of so many numbers at most, and the p-values below which chance is not believed.
_DRAWS, _NUMBERS, _P_CHANGE, _P_SIGNS = 2000, 10_000_000, 0.005, 0.02

BIAS_CHANGES = Kind(
    "gates.bias-changes", Severity.SUSPECT,
    "magnitude errors from {burn} on differ from those before it by {shift_mps:+.2g} m/s in the mean (p = {p:.1g}): a patch, another "
    "reference, or a sign that is turned from there on",
    "Say the first burn after a patch with --patch; else check the table from that burn on.",
)  # fmt: skip
ONE_SIGN = Kind(
    "gates.one-sign", Severity.SUSPECT,
    "not one {quantity} error of {burns} burns is {way} zero, which this model makes unlikely (p = {p:.1g}): are the signs lost?",
    "Errors are reconstructed minus expected, with their sign: an underburn is negative.",
)  # fmt: skip


def course_doubts(m: Maneuvers, parts: list[Part]) -> Iterator[Doubt]:
    """Of a fit to these burns, in their order."""
    if len(m) < _FEWEST:
        return
    for part in parts:
        if not part.known:
            continue
        columns = part.problem.X.shape[1] > 0
        v, axes = m.dv_mps, len(part.quantity.axes)
        bias = np.reshape(part.point.beta, (axes, 2)) if columns else np.zeros((axes, 2))
        mean = bias[:, :1] + bias[:, 1:] * v  # (axes, N)
        sigma2 = part.point.fixed**2 + (part.point.proportional * v) ** 2
        if part.quantity is Quantity.MAGNITUDE:
            errors, tracking = m.magnitude_error_mps[None], m.sigma_magnitude_mps[None] ** 2
        else:
            errors, tracking = m.across[0].T, np.einsum("nii->in", m.across[1])
        sigma = np.sqrt(np.maximum(sigma2 + tracking, 1e-24))
        yield from _of_signs(str(part.quantity), errors, mean / sigma)
        if part.quantity is Quantity.MAGNITUDE:
            yield from _of_changes(m.id, errors[0] - mean[0], sigma[0], v, biased=columns)


def _of_signs(quantity: str, errors, expected) -> Iterator[Doubt]:
    """``errors`` and the model's means over their sigmas, (axes, N)."""
    for sign, way in ((1, "below"), (-1, "above")):
        if (sign * errors > 0).all():
            p = float(np.exp(log_ndtr(sign * expected).sum()))
            if p < _P_SIGNS:
                yield ONE_SIGN(quantity=quantity, burns=errors.shape[1], way=way, p=p)


def _of_changes(ids, left, sigma, v, *, biased: bool) -> Iterator[Doubt]:
    """The clearest change of the mean or of its share of the dV at any burn, against sequences without one."""
    n = len(left)
    gains = np.stack([1 / sigma, v / sigma])  # (2, N)
    basis = np.linalg.qr(gains.T)[0] if biased else np.zeros((n, 0))

    def changes(z):  # (..., N) -> pull of the burns up to each one, on the mean and on the share, (..., 2, K)
        z = z - (z @ basis) @ basis.T
        pull = np.cumsum(z[..., None, :] * gains, axis=-1)
        part = np.cumsum(gains**2, axis=-1) / np.sum(gains**2, axis=-1, keepdims=True)
        return (pull - part * pull[..., -1:])[..., _SIDE - 1 : n - _SIDE]

    drawn = changes(np.random.default_rng(0).standard_normal((min(_DRAWS, max(_NUMBERS // n, 200)), n)))
    usual = np.maximum(drawn.std(axis=0), 1e-300)
    own = np.abs(changes(left / sigma)) / usual
    p = float((1 + np.sum(np.abs(drawn / usual).max(axis=(1, 2)) >= own.max())) / (1 + len(drawn)))
    if p < _P_CHANGE:
        k = int(own.max(axis=0).argmax()) + _SIDE
        before, after = (np.average(left[part], weights=1 / sigma[part] ** 2) for part in (slice(k), slice(k, None)))
        yield BIAS_CHANGES(burn=ids[k], shift_mps=float(after - before), p=p)
