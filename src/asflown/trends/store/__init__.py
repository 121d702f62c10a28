"""The trend store: what is kept, where, and its migrations."""

from .place import label, url_of
from .store import TrendStore

__all__ = [
    "TrendStore", "label", "url_of",
]  # fmt: skip
