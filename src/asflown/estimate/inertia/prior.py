"""What is known of a tensor before anything is flown."""

from __future__ import annotations

import numpy as np

from ...dynamics.rigid_body import ELEMENTS, elements_of


def prior_sigma(I_B) -> np.ndarray:
    """One sigma of the six elements (6,) before anything is flown, about a tensor (3, 3)."""
    size = elements_of(I_B)
    product = _PRODUCT_SHARE * np.trace(I_B) / 3
    return np.where([c[1] == c[2] for c in ELEMENTS], _MOMENT_SHARE * size, product)


#: What is known of any craft beforehand, one sigma: 001's requirement, moments to 10 % and products to 75 kg m2, which
#: is 1.3 % of Cassini's mean moment.
_MOMENT_SHARE, _PRODUCT_SHARE = 0.10, 0.013
