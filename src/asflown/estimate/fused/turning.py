"""A body that turns while its attitude error stays small: what a loop about a fixed attitude would leave out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Kind, Severity
from ...telemetry.channels import AXES
from .series import BODY_RATE, white_noise

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from .series import Series

#: A mean rate x H left out counts where it is more than this share of the torque's sigma.
_COUNTS = 0.1
#: The mean rate left out is told from the sensor's noise where it is more than this. [sigma]
_SURE = 4.0

COMMAND_SMOOTHED = Kind(
    "fused.command-smoothed", Severity.NOTE,
    "the craft turns (rate x H about {axis} is {torque_Nm:.2g} N m, sigma {sigma_Nm:.2g} N m) and its commanded motion is not "
    "in the telemetry: it is taken to be the smoothed body rates, which is right in a hold",
    "Add commanded_rate_x, _y and _z.",
)  # fmt: skip


class CommandNotKnown(Exception):
    """The modelled loop leaves out a turn that counts; ``told``: the numbers of the doubt."""

    def __init__(self, **told):
        super().__init__("the commanded motion is not known")
        self.told = told


def check_turn(
    series: Mapping[int, Sequence[Series]],
    modelled: np.ndarray,
    I_B: np.ndarray,
    stored_Nms: np.ndarray,
    sigma_Nm: np.ndarray,
) -> None:
    """Raises CommandNotKnown where the mean rate that the model leaves out, crossed into the momentum, counts beside the sigma.

    ``modelled``: (M, 3), the model's rates; ``stored_Nms``: (M, 3); ``sigma_Nm``: (3,).  Axes without rates are left alone."""
    rate = np.zeros(3)
    for j, of_axis in series.items():
        measured = next(s for s in of_axis if s.row == BODY_RATE)
        off = float(np.mean(measured.values) - np.mean(modelled[:, j]))
        if abs(off) > _SURE * white_noise(measured, 1e-12) / np.sqrt(len(measured.values)):
            rate[j] = off
    left_out = np.abs(np.cross(rate, modelled.mean(axis=0) @ I_B + rate @ I_B + stored_Nms.mean(axis=0)))
    worst = max(series, key=lambda j: left_out[j] / sigma_Nm[j])
    if left_out[worst] > _COUNTS * sigma_Nm[worst]:
        raise CommandNotKnown(axis=AXES[worst], torque_Nm=float(left_out[worst]), sigma_Nm=float(sigma_Nm[worst]))
