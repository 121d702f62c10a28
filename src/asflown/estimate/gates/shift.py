"""Since when do burns fall short: the likeliest change point of a watched sequence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kit.schema import Annotated, Doc, Interval, Number, TypedDict

if TYPE_CHECKING:
    from .foreseen import Foreseen

#: Sequences drawn for the p-value, and burns it takes.
_DRAWS, _FEWEST = 4000, 3


#: Its key "from" is a word of Python.
ShiftRecord = TypedDict(
    "ShiftRecord",
    {
        "from": Annotated[str, Doc("first burn after the change")],
        "share": Annotated[Number, Doc("of the dV; negative: underburns")],
        "share_ci95": Interval,
        "ci95": Annotated[Interval, Doc("kept for this version; see share_ci95")],
        "p": Number,
        "posterior": Annotated[
            dict[str, Number], Doc("burn -> chance that the change is there, given that there is one")
        ],
    },
)


@dataclass(frozen=True)
class Shift:
    """From burn ``id`` on, errors are off by a share of the dV (negative: underburns).

    ``p``: how often chance has a change as clear anywhere in a sequence as long; ``posterior``: chance of each place of the
    change, given that there is one, all places alike before."""

    id: str
    share: float
    share_ci95: tuple[float, float]
    p: float
    posterior: dict[str, float]

    def record(self) -> dict:
        interval = list(self.share_ci95)
        return {
            "from": self.id, "share": self.share, "share_ci95": interval, "ci95": interval, "p": self.p, "posterior": self.posterior,
        }  # fmt: skip

    def __str__(self) -> str:
        low, high = (100 * x for x in self.share_ci95)
        return (
            f"likeliest change: from {self.id} on by {100 * self.share:+.2g} % ({low:+.2g} to {high:+.2g}), "
            f"posterior of that burn {100 * self.posterior[self.id]:.0f} %, p = {self.p:.2g}"
        )


def find_shift(ids, dv_mps, error_mps, foreseen: list[Foreseen]) -> Shift | None:
    """The change point of N watched burns: each standardised by what was foreseen of it; None with fewer than three."""
    n = len(ids)
    if n < _FEWEST:
        return None
    sigma = np.array([np.sqrt(f.covariance[0, 0]) for f in foreseen])
    score = np.array([f.score(e) for f, e in zip(foreseen, error_mps, strict=True)])
    gain = np.asarray(dv_mps) / sigma  # a share s of the dV moves a score by s * gain
    weight = np.cumsum((gain**2)[::-1])[::-1]
    pulled = np.cumsum((gain * score)[::-1])[::-1]
    ratio = pulled**2 / weight
    best = int(np.argmax(ratio))
    draws = np.random.default_rng(0).standard_normal((_DRAWS, n))
    chance = (np.cumsum((draws * gain)[:, ::-1], axis=1)[:, ::-1] ** 2 / weight).max(axis=1)
    share, spread = pulled[best] / weight[best], 1 / np.sqrt(weight[best])
    posterior = np.exp(0.5 * (ratio - ratio.max()))
    posterior /= posterior.sum()
    return Shift(
        ids[best], float(share), (float(share - 1.96 * spread), float(share + 1.96 * spread)),
        float((1 + np.sum(chance >= ratio[best])) / (1 + _DRAWS)), dict(zip(ids, posterior.tolist(), strict=True)),
    )  # fmt: skip
