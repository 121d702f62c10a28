"""Jets of a plume: densities and widths from what they did to the craft."""

from .fit import jets
from .result import JetsResult

__all__ = [
    "JetsResult", "jets",
]  # fmt: skip
