"""Body rates by gyro, by attitude error and by quaternion: one motion, told by two or three sensors.

Two channels x = s + n and y = b s + m with noises that are not alike hold the ratio b between the slopes of y on x and of one over x
on y (Frisch 1934): r sd(y)/sd(x) and sd(y)/(r sd(x)), r their correlation.  No noise needs to be known, and channels that share
no motion say nothing: their interval is wide.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ...kit.doubts import Doubt, Kind, Severity
from ...kit.scatter import difference_sigma
from ...telemetry.attitude import MISTAKEN_UNITS
from ...telemetry.channels import AXES
from .motion import ERROR, GYRO, NAMES
from .units import units_of

if TYPE_CHECKING:
    from ..subject import Subject
    from .motion import Motion

#: A ratio is off where the interval, widened by another correlation, leaves this out.
_OFF = 1.4
#: Channels see the same motion where their correlation is so large at least, and chance makes one like it once in a thousand; an
#: attitude error answers to commands too, and is compared where nearly all of it is that motion.
_LEAST, _LEAST_OF_ERROR, _BY_CHANCE = 0.35, 0.6, 7.0
#: Another reading explains so much more: odds of a million to one, and by this ratio of squared misfit.
SIGNIFICANT, BETTER = 14.0, 1.5
#: How far channels may be stamped apart and still be looked for, and from where on they are said to be. [s], share of the cadence
LATEST_S, LATE_S, LATE_STEPS = 40.0, 2.5, 0.75
#: A channel is judged from so many samples, and is lively where so many of them differ from the one before.
_ENOUGH, _LIVELY = 30, 0.5
#: One axis of a gyro is noisier than both others by a factor that is a unit's, to this share.
_NEAR = 0.25

RATIO = Kind(
    "redundancy.ratio", Severity.SUSPECT,
    "about {axis} the motion by {first} is {ratio:.4g} times that by {second} (between {low:.3g} and {high:.3g}): {cause}?",
    "Check unit, scale and sign of these channels in the headings or in the channel dictionary.",
)  # fmt: skip
EXCHANGED = Kind(
    "redundancy.axes-exchanged", Severity.SUSPECT,
    "the motion about {axis} by {first} is that about {other} by {second}: are axes exchanged?",
    "Check the axes in the headings or in the channel dictionary.",
)  # fmt: skip
APART = Kind(
    "redundancy.stamped-apart", Severity.SUSPECT,
    "about {axis} the motion by {first} comes {late_s:.1f} s later than that by {second}: their time stamps are apart",
    "Check the time stamps of these channels, and the delay of their sensors.",
)  # fmt: skip
NOISY_AXIS = Kind(
    "redundancy.one-axis-unit", Severity.SUSPECT,
    "the noise of {channel} is {ratio:.4g} times that of the other axes: {cause}?",
    "Check the unit of this channel.",
)  # fmt: skip
FROZEN = Kind(
    "redundancy.frozen", Severity.SUSPECT,
    "{channel} keeps one value throughout while the other channels move: a sensor or a packet that is frozen",
    "Exclude the span (--exclude), or leave the channel out.",
)  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """What two sources say about one axis: ratio of the first to the second, its interval, and whether they see one motion."""

    first: str
    second: str
    axis: int
    ratio: float
    low: float
    high: float
    told: bool

    @property
    def off(self) -> bool:
        """Whether the sources contradict each other."""
        return self.told and (self.ratio < 0 or self.low > _OFF or self.high < 1 / _OFF)

    @property
    def agree(self) -> bool:
        return self.told and self.ratio > 0 and self.low < _OFF and self.high > 1 / _OFF


def compared(motion: Motion, sources: list[str]) -> list[Compared]:
    """Every pair of sources about every axis that both have."""
    quick = {n: motion.quick(motion.rates[n]) for n in sources}
    return [
        _pair(a, b, j, x[:, j], y[:, j])
        for (a, x), (b, y) in combinations(quick.items(), 2)
        for j in range(3)
        if np.isfinite(x[:, j]).all() and np.isfinite(y[:, j]).all()
    ]


def _pair(a: str, b: str, j: int, x: np.ndarray, y: np.ndarray) -> Compared:
    sx, sy = x.std(), y.std()
    if not sx > 0 or not sy > 0:
        return Compared(a, b, j, np.nan, np.nan, np.nan, told=False)
    r, ratio = float(np.mean(x * y) / (sx * sy)), float(sx / sy)
    told = (
        abs(r) >= (_LEAST_OF_ERROR if ERROR in (a, b) else _LEAST)
        and -0.5 * _worth(x, y) * np.log(max(1 - r * r, 1e-12)) > _BY_CHANCE
    )
    wide = max(r * r, 1e-9)
    sign = 1.0 if r > 0 else -1.0
    return Compared(a, b, j, sign * ratio, ratio * wide, ratio / wide, told)


def _worth(x: np.ndarray, y: np.ndarray) -> float:
    """Independent samples in the correlation of two series that do not see one motion (Bartlett 1946): both must be alike over a lag."""
    n, total = len(x), 1.0
    a, b = (v / max(np.sqrt(v @ v), 1e-300) for v in (x, y))
    for k in range(1, n // 4):
        both = float(a[:-k] @ a[k:]) * float(b[:-k] @ b[k:])
        if both < 2 / n:
            break
        total += 2 * both
    return n / total


def unlike(pairs: list[Compared], trusted: set[str]) -> tuple[list[Doubt], set[str]]:
    """Doubts about sources whose size or sign contradicts another's, and those sources.

    ``trusted``: sources that something else confirms, such as the wheels."""
    found: dict[tuple[str, str], list[Compared]] = {}
    wrong: set[str] = set()
    for p in (p for p in pairs if p.off):
        first, second = _votes(pairs, p.first, trusted), _votes(pairs, p.second, trusted)
        if first > second:  # the second is the odd one
            p = Compared(p.second, p.first, p.axis, 1 / p.ratio, 1 / p.high, 1 / p.low, p.told)
        wrong |= {p.first, p.second} if first == second else {p.first}
        found.setdefault((p.first, "" if first != second else p.second), []).append(p)
    doubts = []
    for (_, other), those in found.items():
        surest = min(those, key=lambda p: p.high / p.low)
        doubts.append(
            RATIO(axis=_axes(those), first=NAMES[surest.first], second=NAMES[surest.second], ratio=surest.ratio, low=surest.low,
                  high=surest.high, cause=_cause(surest, alone=not other))
        )  # fmt: skip
    return doubts, wrong


def _votes(pairs: list[Compared], source: str, trusted: set[str]) -> int:
    """How many say what a source says."""
    return sum(q.agree for q in pairs if source in (q.first, q.second)) + (source in trusted)


def _axes(those: list[Compared]) -> str:
    return ", ".join(dict.fromkeys(AXES[p.axis] for p in sorted(those, key=lambda p: p.axis)))


def _cause(p: Compared, *, alone: bool) -> str:
    """The unit or sign whose mistake gives such a ratio; ``alone``: it is the first source's."""
    said = [f"a reversed sign of the {NAMES[p.first] if alone else 'one or the other'}"] if p.ratio < 0 else []
    for source, ratio in ((p.first, abs(p.ratio)), (p.second, 1 / abs(p.ratio)))[: 1 if alone else 2]:
        for factor, unit in units_of(source).items():
            if abs(np.log(ratio / factor)) < max(_NEAR, 0.5 * np.log(p.high / p.low)):
                said.append(f"{NAMES[source]} in {unit}")
    return " or ".join(said) or (f"a wrong scale of the {NAMES[p.first]}" if alone else "one of them has a wrong scale")


def exchanged(motion: Motion, sources: list[str]) -> tuple[list[Doubt], set[str]]:
    """Where an axis of one source moves as another axis of a second, and not as its own."""
    quick = {n: r for n in sources if np.isfinite(r := motion.quick(motion.rates[n])).all()}
    doubts: list[Doubt] = []
    wrong: set[str] = set()
    for (a, x), (b, y) in combinations(quick.items(), 2):
        sizes = np.outer(np.linalg.norm(x, axis=0), np.linalg.norm(y, axis=0))
        r = x.T @ y / np.maximum(sizes, 1e-300)
        found = []
        for j in range(3):
            i = int(np.argmax(np.abs(r[:, j])))
            # of neither axis is its own the one that it moves as
            own, other = max(min(1 - r[j, j] ** 2, 1 - r[i, i] ** 2), 1e-12), max(1 - r[i, j] ** 2, 1e-12)
            plain = i != j and own > BETTER * other
            if plain and 0.5 * _worth(x[:, i], y[:, j]) * np.log(own / other) > SIGNIFICANT:
                found.append((i, j))
        if found:
            axis, other_axis = (", ".join(AXES[f[k]] for f in found) for k in (0, 1))
            doubts.append(EXCHANGED(axis=axis, other=other_axis, first=NAMES[a], second=NAMES[b]))
            wrong |= {a, b}
    return doubts, wrong


def apart(motion: Motion, sources: list[str]) -> tuple[list[Doubt], set[str]]:
    """Sources that see one motion at different times."""
    quick = {n: motion.quick(motion.rates[n]) for n in sources}
    doubts: list[Doubt] = []
    wrong: set[str] = set()
    for (a, x), (b, y) in combinations(quick.items(), 2):
        both = [j for j in range(3) if np.isfinite(x[:, j]).all() and np.isfinite(y[:, j]).all()]
        late = {j: s for j in both if (s := lag(motion, x[:, j], y[:, j])) is not None}
        if late:
            mean = float(np.median(list(late.values())))
            first, second = (a, b) if mean > 0 else (b, a)
            axes = ", ".join(AXES[j] for j in late)
            doubts.append(APART(axis=axes, first=NAMES[first], second=NAMES[second], late_s=abs(mean)))
            wrong |= {a, b}
    return doubts, wrong


def lag(motion: Motion, x: np.ndarray, y: np.ndarray) -> float | None:
    """By how much x (N,) is later than y (N,), whatever their scale, where that is plain. [s]"""
    if not x.std() > 0 or not y.std() > 0:
        return None
    step = motion.grid.step_s
    most = min(round(LATEST_S / step), len(x) // 4)
    shifts = np.arange(-most, most + 1)
    r = np.array([_correlation(x, y, int(k)) for k in shifts])
    best = int(np.argmax(r))
    own, left = max(1 - max(r[most], 0.0) ** 2, 1e-12), max(1 - r[best] ** 2, 1e-12)
    late = float(shifts[best] * step)
    plain = own > BETTER * left and 0.5 * _worth(x, y) * np.log(own / left) > SIGNIFICANT
    return late if plain and abs(late) > max(LATE_S, LATE_STEPS * motion.cadence_s) else None


def _correlation(x: np.ndarray, y: np.ndarray, k: int) -> float:
    """Of x a number of steps later with y; blocks that follow each other are taken for one."""
    n = len(x)
    p, q = x[max(k, 0) : n + min(k, 0)], y[max(-k, 0) : n - max(k, 0)]
    size = np.sqrt((p @ p) * (q @ q))
    return float(p @ q / size) if size > 0 else 0.0


def noisy_axis(subject: Subject) -> list[Doubt]:
    """A gyro axis whose noise is a unit's factor times that of both others."""
    tlm = subject.telemetry
    if not tlm.has_axes(GYRO):
        return []
    noise = np.array([np.nan_to_num(difference_sigma(tlm.channels[f"{GYRO}_{a}"].usable.values, 3)) for a in AXES])
    doubts = []
    for j, a in enumerate(AXES):
        others = np.delete(noise, j)
        if not others.min() > 0 or others.max() > 3 * others.min():
            continue
        ratio = float(noise[j] / np.sqrt(np.prod(others)))
        for factor, unit in MISTAKEN_UNITS.items():
            if ratio > 0 and abs(np.log(ratio / factor)) < _NEAR:
                doubts.append(NOISY_AXIS(channel=f"{GYRO}_{a}", ratio=ratio, cause=unit))
                break
    return doubts


def frozen(subject: Subject) -> list[Doubt]:
    """Axes of a sensor, or wheels, that keep one value throughout while most of their kind are lively; a wheel may rest at zero."""
    tlm = subject.telemetry
    doubts = []
    for stem in (GYRO, ERROR, "wheel_rate"):
        family = [c.usable for c in tlm.channels.values() if c.kind.stem == stem and len(c.usable.values) >= _ENOUGH]
        dead = [c for c in family if (c.values == c.values[0]).all()]
        lively = [c for c in family if np.mean(np.diff(c.values) != 0) > _LIVELY]
        rests = [c for c in dead if stem == "wheel_rate" and c.values[0] == 0]
        if len(lively) > len(dead) > len(rests):
            doubts += [FROZEN(channel=c.name) for c in dead if c not in rests]
    return doubts
