"""Numbers as a person reads them: value and sigma to the digits that the sigma allows."""

from __future__ import annotations

import numpy as np


def plus_minus(value: float, sigma: float) -> str:
    """Value and sigma, to two digits of the sigma: 2.013 +- 0.012."""
    if not (np.isfinite(sigma) and sigma > 0):
        return f"{value:.4g}"
    digits = 1 - int(np.floor(np.log10(sigma)))
    if digits < 0 and abs(value) < 1e6:
        return f"{value:.0f} +- {sigma:.0f}"
    if not -1 < digits <= 7:
        return f"{value:.4g} +- {sigma:.2g}"
    return f"{value:.{digits}f} +- {sigma:.{digits}f}"
