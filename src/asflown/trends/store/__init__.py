"""The trend store: its contents, place and migrations."""

from .place import label, url_of
from .store import TrendStore

__all__ = [
    "TrendStore", "label", "url_of",
]  # fmt: skip
