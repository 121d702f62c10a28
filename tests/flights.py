"""What tests of many kinds start from: Cassini, flights simulated once, recordings, telemetry with changes, files."""

import json
from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
import pytest

from asflown.craft.load import load_craft
from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS, utc_to_tai_ns
from asflown.sim.flight.closed_loop import Flight, fly
from asflown.telemetry.channels import kind_of
from asflown.telemetry.load import load_telemetry
from asflown.telemetry.telemetry import Channel, Telemetry
from asflown.telemetry.write import write_table
from conftest import ROOT, flight_data

CASSINI = load_craft("cassini")
EPOCH = utc_to_tai_ns("2015-09-29T00:00:00")


# ---- flights and recordings ---------------------------------------------------------------------------------


def flown(scenario: str, **changes) -> Flight:
    """``fly``, once for all who ask for the same flight; its telemetry is read-only."""
    return _flown(scenario, json.dumps(changes, sort_keys=True))


@lru_cache(maxsize=16)
def _flown(scenario: str, changes: str) -> Flight:
    flight = fly(scenario, changes=json.loads(changes))
    for c in flight.telemetry.channels.values():
        for column in (c.tai_ns, c.values, c.valid):
            column.flags.writeable = False
    return flight


def past_e3(seed: int = 3, exponent: int = 2, **changes) -> Flight:
    """Through a plume as the flyby E3, held by wheels: 480 s with the closest approach at 180 s."""
    plume = {"shape": "plume", "closest_approach": "180 s", "exponent": exponent}
    return flown("quiet", epoch="2008-03-12T19:03:12", duration="480 s", seed=seed, torques=[plume], **changes)


def assert_refused(scenario: str, **changes) -> None:
    """``fly`` refuses it, in words: enough of them, and not too many."""
    with pytest.raises(BadInput) as why:
        fly(scenario, changes=changes)
    assert 20 < len(str(why.value)) < 1400


@cache
def inspiresat1() -> Telemetry:
    return load_telemetry(flight_data("inspiresat1/is1_adcs_1hz.csv"), channels=ROOT / "examples" / "inspiresat1.toml")


@cache
def iss() -> Telemetry:
    """Twelve hours of the space station."""
    return load_telemetry(flight_data("iss/iss_20181012_hours_00_12.csv.gz"), channels=ROOT / "examples" / "iss.toml")


# ---- telemetry ----------------------------------------------------------------------------------------------


def telemetry_of(epoch_ns=EPOCH, **columns) -> Telemetry:
    """name=(seconds, values) -> Telemetry, nothing screened."""
    channels = {}
    for name, (seconds, values) in columns.items():
        at = np.rint(np.asarray(seconds, float) * NS).astype(np.int64) + epoch_ns
        channels[name] = Channel(name, at, np.asarray(values), np.ones(len(at), bool), kind_of(name).unit)
    return Telemetry(channels, epoch_ns)


def _are(c: Channel, names) -> bool:
    return c.name in names or c.kind.stem in names


def only(tlm: Telemetry, *names: str) -> Telemetry:
    """The channels of these names or stems alone."""
    return replace(tlm, channels={n: c for n, c in tlm.channels.items() if _are(c, names)})


def without(tlm: Telemetry, *names: str) -> Telemetry:
    """All but the channels of these names or stems."""
    return replace(tlm, channels={n: c for n, c in tlm.channels.items() if not _are(c, names)})


def changed(tlm: Telemetry, name: str, change) -> Telemetry:
    """``change`` of each channel of this name or stem in its place."""
    return replace(tlm, channels={n: change(c) if _are(c, (name,)) else c for n, c in tlm.channels.items()})


def scaled(tlm: Telemetry, name: str, factor) -> Telemetry:
    """Values of this name or stem times a number, or times one for each sample."""
    return changed(tlm, name, lambda c: replace(c, values=factor * c.values))


def conjugated(tlm: Telemetry) -> Telemetry:
    """The attitude the other way round."""
    return changed(tlm, "quaternion", lambda c: c if c.member == "w" else replace(c, values=-c.values))


def with_values(tlm: Telemetry, name: str, values) -> Telemetry:
    return with_channels(tlm, replace(tlm.channel(name), values=np.asarray(values)))


def with_channels(tlm: Telemetry, *channels: Channel) -> Telemetry:
    """These channels besides, or instead of, those there are."""
    return replace(tlm, channels=tlm.channels | {c.name: c for c in channels})


def renamed(tlm: Telemetry, members: dict[str, str], *stems: str) -> Telemetry:
    """Wheels or thrusters under other names, {old: new}; with stems, only channels of these."""
    channels = {}
    for c in tlm.channels.values():
        hit = c.member in members and (not stems or c.kind.stem in stems)
        name = f"{c.kind.stem}_{members[c.member]}" if hit else c.name
        channels[name] = replace(c, name=name)
    return replace(tlm, channels=channels)


# ---- files --------------------------------------------------------------------------------------------------


def written(folder: Path, content: str | bytes, name: str = "t.csv") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def saved(tlm: Telemetry, folder: Path, name: str = "t.csv") -> Path:
    """The table of this telemetry."""
    write_table(tlm, folder / name)
    return folder / name
