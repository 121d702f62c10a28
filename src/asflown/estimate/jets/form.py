"""The form that jets are given, and telemetry as a regression on them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...dynamics.plume import ANGLES, Jet, jet_density, plume_density
from ...kit.errors import BadInput, check_choice
from .surface import Surface

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...dynamics.flyby import Flyby
    from .data import JetData

WIDTHS = ("own", "common")
_POWERS = (0.5, 4.0)
#: Most sources: combinations of own widths grow as 44 to their power, choices of positive densities as 2 to it.
_MOST = {"own": 3, "common": 8}


@dataclass(frozen=True)
class JetForm:
    """exp(-(theta / width)^power), the angle theta in the flyby's plane or in space, widths own or one common.

    Raises BadInput for choices that are not there and for a power outside 0.5 to 4."""

    widths: str = "own"
    power: float = 1
    angle: str = "plane"

    def __post_init__(self):
        check_choice(self.widths, WIDTHS, "widths")
        check_choice(self.angle, ANGLES, "angle")
        if not _POWERS[0] <= self.power <= _POWERS[1]:
            raise BadInput(
                f"the power must lie between {_POWERS[0]:g} and {_POWERS[1]:g}, and it is {self.power:g}",
                remedy="The plume paper's is 1, or 2 as in its eq 24.",
            )

    @property
    def common(self) -> bool:
        return self.widths == "common"

    @property
    def most(self) -> int:
        """How many sources can be fitted at most."""
        return _MOST[self.widths]

    def free(self, sources: int) -> int:
        """Parameters: densities, widths, a constant."""
        return sources + (1 if self.common else sources) + 1

    def of(self, jet: Jet, flyby: Flyby, time_s) -> np.ndarray:
        """Density of one jet. [kg/m3]"""
        return jet_density(jet, flyby, time_s, power=self.power, angle=self.angle)

    def together(self, jets: Sequence[Jet], flyby: Flyby, time_s) -> np.ndarray:
        """Density of all jets. [kg/m3]"""
        return plume_density(jets, flyby, time_s, power=self.power, angle=self.angle)


@dataclass(frozen=True)
class JetRegression:
    """Telemetry (``data``) explained by jets of one form from some sources, as a flyby passes them."""

    data: JetData
    flyby: Flyby
    sources: tuple[Jet, ...]
    form: JetForm

    def columns(self, widths_rad: np.ndarray) -> np.ndarray:
        """What each jet of unit density gives, for every one of its widths (J, W). (J, W, N)"""
        shapes = [
            [self.form.of(replace(j, density_kgm3=1.0, width_rad=w), self.flyby, self.data.nodes_s) for w in widths]
            for j, widths in zip(self.sources, widths_rad, strict=True)
        ]
        return np.array(shapes) @ self.data.A.T

    def surface(self, columns: np.ndarray, widths_rad: np.ndarray | None = None) -> Surface:
        """Misfit of every combination of these widths."""
        return Surface(self.data.y, columns, common=self.form.common, widths_rad=widths_rad)

    def answer(self, jets: Sequence[Jet]) -> np.ndarray:
        """What jets give. (N,)"""
        return self.data.A @ self.form.together(jets, self.flyby, self.data.nodes_s)
