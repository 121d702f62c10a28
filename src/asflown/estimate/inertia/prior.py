"""What is known of a tensor before anything is flown, and what no rigid body can have."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...dynamics.rigid_body import ELEMENTS, elements_of, nearest_possible
from ...kit.doubts import Doubt, Kind, Severity
from ...kit.errors import BadInput

if TYPE_CHECKING:
    from ..subject import Subject
    from .excitation import Excitation

#: What is known of any craft beforehand, one sigma: the requirement of Feldman and Lee, moments to 10 % and products to
#: 75 kg m2, which is 1.3 % of Cassini's mean moment.
MOMENT_SHARE, PRODUCT_SHARE = 0.10, 0.013

RANK_DEFICIENT = Kind(
    "inertia.rank-deficient", Severity.CAUTION,
    "the craft turns about {directions} only (rms rates {rates} mrad/s), so the rank is {rank} of 6. Identifiable: "
    "{identifiable}. Not identifiable: {not_identifiable}",
    "Add slews about other axes: asflown inertia plan says which.",
)  # fmt: skip
FROM_CRAFT = Kind(
    "inertia.from-craft", Severity.CAUTION,
    "elements that the slews do not identify come from the craft's own tensor, with a prior of {moment_percent:.0f} % on moments "
    "and {product_percent:.1f} % of the mean moment on products", "Give a better tensor (--inertia), or add slews.",
)  # fmt: skip
AT_THE_EDGE = Kind(
    "inertia.at-the-edge", Severity.SUSPECT,
    "the most likely tensor is impossible for a rigid body: the nearest possible one is given, at the edge of what is possible",
    "Check wheel axes, spin inertia and units, or add slews.",
)  # fmt: skip


class Prior(NamedTuple):
    """Mean (6,) and information (6, 6) of a tensor's elements."""

    mean: np.ndarray
    information: np.ndarray


def prior_sigma(I_B) -> np.ndarray:
    """One sigma of the six elements (6,) before anything is flown, about a tensor (3, 3)."""
    size = elements_of(I_B)
    product = PRODUCT_SHARE * np.trace(I_B) / 3
    return np.where([c[1] == c[2] for c in ELEMENTS], MOMENT_SHARE * size, product)


def prior_for(subject: Subject, excited: Excitation) -> tuple[Prior | None, list[Doubt]]:
    """The craft's own tensor where the slews do not identify all of it, None where they do; and its doubts.

    Raises BadInput where the body does not turn at all, and where the craft's tensor is not known."""
    if excited.rank == 6:
        return None, []
    if excited.rank == 0:
        raise BadInput(
            "no slew is in this record: the body hardly turns, and its inertia is not identifiable",
            file=subject.telemetry.source or None,
            remedy="Take a window with slews (--start, --stop); asflown inertia plan says which slew would help.",
        )
    I_B = subject.inertia_kgm2
    if I_B is None:
        raise BadInput(
            f"the slews do not identify {', '.join(excited.not_identifiable)}, and the inertia of {subject.craft.craft.name} is "
            "not known",
            file=subject.telemetry.source or None,
            remedy='Give a tensor as prior: --inertia "Ixx,Iyy,Izz,Ixy,Ixz,Iyz" in kg m2, or take more slews.',
        )
    deficient = RANK_DEFICIENT(
        directions=excited.counted, rates=", ".join(f"{1e3 * r:.2g}" for r in excited.rate_rms_rad_s), rank=excited.rank,
        identifiable=excited.identifiable, not_identifiable=excited.not_identifiable,
    )  # fmt: skip
    from_craft = FROM_CRAFT(moment_percent=100 * MOMENT_SHARE, product_percent=100 * PRODUCT_SHARE)
    prior = Prior(elements_of(I_B), np.diag(1 / prior_sigma(I_B) ** 2))
    return prior, [deficient, *subject.craft.doubts, from_craft]


def possible(elements: np.ndarray, information: np.ndarray) -> tuple[np.ndarray, list[Doubt]]:
    """The nearest elements (6,) that a rigid body can have, and a doubt where they had to move."""
    found, moved = nearest_possible(elements, information)
    return found, [AT_THE_EDGE()] if moved else []
