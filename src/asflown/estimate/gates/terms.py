"""Parameters of a Gates model: sigmas and biases, each fixed or proportional to the dV."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ...maneuvers.model import Quantity


class Law(StrEnum):
    """How a sigma or a bias grows with the dV."""

    FIXED = "fixed"
    PROPORTIONAL = "proportional"


#: Scale and unit that people read proportional terms in.
_READ = {Quantity.MAGNITUDE: (100.0, "%"), Quantity.POINTING: (1e3, "mrad")}


@dataclass(frozen=True)
class Term:
    """One parameter.  ``bias_axis``: None of a sigma, '' of a magnitude bias, 'X' or 'Y' of a pointing bias."""

    quantity: Quantity
    law: Law
    bias_axis: str | None = None

    @property
    def name(self) -> str:
        """Within its quantity: 'fixed', 'bias X, fixed'."""
        return str(self.law) if self.bias_axis is None else f"{f'bias {self.bias_axis}'.strip()}, {self.law}"

    @property
    def key(self) -> str:
        """As a figure of the trend store and a term to hold are called: 'magnitude_fixed', 'pointing_bias_x_fixed'."""
        return "_".join(str(self).replace(",", "").lower().split())

    @property
    def unit(self) -> str:
        """In SI; a share of the dV is an angle across it."""
        return "m/s" if self.law is Law.FIXED else "" if self.quantity is Quantity.MAGNITUDE else "rad"

    @property
    def read_in(self) -> tuple[float, str]:
        """Scale and unit that people read."""
        return (1e3, "mm/s") if self.law is Law.FIXED else _READ[self.quantity]

    def __str__(self) -> str:
        return f"{self.quantity} {self.name}"


def sigmas_of(quantity: Quantity) -> tuple[Term, ...]:
    return tuple(Term(quantity, law) for law in Law)


def biases_of(quantity: Quantity) -> tuple[Term, ...]:
    return tuple(Term(quantity, law, axis) for axis in quantity.axes for law in Law)


#: Sigmas, which can be held, by the name they are held by.
SIGMAS = {t.key: t for q in Quantity for t in sigmas_of(q)}
