"""Many flights over the years: which actuations, when, and how the mechanism ages; read from TOML, units in the values.

``fly_mission`` flies one.  docs/simulator.md lists every key.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ...craft.model import Kilogram, NewtonMetre, RadianPerSecond, Second, _in
from ...kit.config import toml_table
from ...kit.errors import BadInput, some_of
from ...kit.reading import read_bytes
from ...kit.timeline import NS, utc_to_tai_ns
from ..plans import Part, Plan, shipped
from ..scenario import NoiseName

Kind = Literal["deploy", "stow"]
_DAY_NS = 86_400 * NS


def _utc(text):
    try:
        utc_to_tai_ns(str(text))
    except BadInput as why:
        raise ValueError(why.what) from None
    return str(text)


NewtonMetreSecond = _in("N m s")
Date = Annotated[str, BeforeValidator(_utc)]  # UTC
Percent = Annotated[float, Field(gt=-100, le=1000, allow_inf_nan=False)]
Sigma = Annotated[float, Field(ge=0, le=30, allow_inf_nan=False)]
Factor = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]


class Actuation(Part):
    """One actuation; one that is not flown counts for dormancy and cycles only."""

    id: str = Field(default="", pattern=r"^([A-Za-z0-9][A-Za-z0-9._-]*)?$")  # it names a folder
    kind: Kind
    date: Date
    flown: bool = True
    note: str = ""

    @property
    def name(self) -> str:
        return self.id or f"{self.kind}-{self.date[:10]}"

    @property
    def tai_ns(self) -> int:
        return int(utc_to_tai_ns(self.date))


class Motion(Part):
    """How a kind moves, and its true figures of merit when ageing starts; torques on the body, with their sign."""

    scenario: str
    impulse: NewtonMetreSecond  # from motor-on to 81 s after it
    peak_positive: NewtonMetre = Field(gt=0)  # mean of the two largest excursions after that
    peak_negative: NewtonMetre = Field(lt=0)


class Ageing(Part):
    """Figures change in a straight line in time from ``start``, where they are the motion's, to ``stop`` and beyond."""

    start: Date
    stop: Date
    impulse_change_percent: Percent
    excursion_change_percent: Percent

    @model_validator(mode="after")
    def _in_order(self):
        if int(utc_to_tai_ns(self.start)) >= int(utc_to_tai_ns(self.stop)):
            raise ValueError("start comes before stop")
        return self


class Scatter(Part):
    """From event to event, one standard deviation; each figure on its own."""

    impulse_percent: Sigma = 0.0
    excursion_percent: Sigma = 0.0
    timing: Second = Field(default=0.0, ge=0, le=3)  # of each turn of the excursions


class Cold(Part):
    """What a long rest does to the figures of the next actuation; ``after``: the paper's cold start, as ``trends.COLD_DAYS``."""

    after: Second = Field(default=200 * 86_400.0, gt=0)
    impulse_factor: Factor = 1.0
    excursion_factor: Factor = 1.0


class Fault(Part):
    """A sudden change that stays, from an event on."""

    since: str
    kind: Kind | None = None  # both kinds unless given
    impulse_factor: Factor = 1.0
    excursion_factor: Factor = 1.0


class CraftMass(Part):
    date: Date
    mass: Kilogram = Field(gt=0)
    source: str


class Mission(Plan):
    """Actuations of one mechanism over the years."""

    KIND = "mission"
    REMEDY = "See docs/simulator.md, Missions, for the keys; every value carries its unit."

    description: str = ""
    craft: str = "cassini"
    seed: int = Field(default=1, ge=0)
    noise: NoiseName = "nominal"
    least_wheel_rate: RadianPerSecond = Field(ge=0)  # size of each wheel's rate at the start, drawn between the two
    most_wheel_rate: RadianPerSecond = Field(ge=0)
    ageing: Ageing
    scatter: Scatter = Scatter()
    cold: Cold = Cold()
    faults: tuple[Fault, ...] = ()
    motions: dict[Kind, Motion]
    craft_mass: tuple[CraftMass, ...] = Field(min_length=1)
    events: tuple[Actuation, ...] = Field(min_length=1)
    assumptions: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _consistent(self):
        names = [e.name for e in self.events]
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise ValueError(f"two events are called {twice[0]!r}: give one an id")
        if any(a.tai_ns >= b.tai_ns for a, b in pairwise(self.events)):
            raise ValueError("the events are not in order of date")
        if not self.flown:
            raise ValueError("no event is flown")
        lacking = {e.kind for e in self.flown} - set(self.motions)
        if lacking:
            raise ValueError(f"motions: there is none for {some_of(sorted(lacking))}")
        unknown = [f.since for f in self.faults if f.since not in names]
        if unknown:
            raise ValueError(f"faults: no event is called {unknown[0]!r}; the first are {some_of(names[:3])}")
        dates = [int(utc_to_tai_ns(m.date)) for m in self.craft_mass]
        if dates != sorted(set(dates)):
            raise ValueError("craft_mass: the dates do not increase")
        if self.least_wheel_rate > self.most_wheel_rate:
            raise ValueError("least_wheel_rate is above most_wheel_rate")
        return self

    @property
    def flown(self) -> tuple[Actuation, ...]:
        return tuple(e for e in self.events if e.flown)

    def rest_days(self) -> dict[str, int | None]:
        """Days between calendar dates since the actuation before, of any kind; None for the first."""
        days = [round(int(utc_to_tai_ns(e.date[:10])) / _DAY_NS) for e in self.events]
        rests = [None, *(b - a for a, b in pairwise(days))]
        return {e.name: rest for e, rest in zip(self.events, rests, strict=True)}

    def mass_kg(self, tai_ns: int) -> float:
        """Mass of the whole craft on a date: straight in time between those given."""
        dates = [float(utc_to_tai_ns(m.date)) for m in self.craft_mass]
        return float(np.interp(tai_ns, dates, [m.mass for m in self.craft_mass]))


def shipped_missions() -> list[str]:
    """Names that ``load_mission`` and ``fly_mission`` take without a file."""
    return shipped("mission")


def is_mission(name_or_path: str | Path) -> bool:
    """Whether this is a mission rather than a scenario: a shipped name, or a TOML file with [[events]]."""
    path = Path(name_or_path)
    if str(name_or_path) in shipped_missions():
        return True
    if path.suffix != ".toml" or not path.is_file():
        return False
    try:
        return "events" in toml_table(read_bytes(path, "mission file", ""), path)
    except BadInput:
        return False  # the scenario's door says what is wrong with it


def load_mission(name_or_path: str | Path) -> Mission:
    """A shipped mission by name, or one from a TOML file.

    Raises BadInput for an unknown name, an unreadable file, an unknown key or a wrong unit."""
    return Mission.load(name_or_path)
