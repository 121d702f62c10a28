"""Made-up histories of an actuator, for tests of what is read from them."""

import numpy as np

from asflown.trends.entry import Curve, Entry, Value

#: 000 Tables 1, 2 and B1: kind, date; those it does not trend but whose dates its days since the last imply come last.
DEPLOYS = [
    "2004-12-09",
    "2005-07-09",
    "2006-05-19",
    "2006-06-29",
    "2007-08-28",
    "2008-10-30",
    "2009-10-13",
    "2009-10-31",
    "2010-11-28",
    "2011-09-10",
    "2012-10-12",
    "2015-07-14",
    "2015-09-29",
]
STOWS = ["2006-05-22", "2008-11-01", "2009-10-14", "2011-09-14", "2012-10-19", "2015-07-14", "2015-09-30"]
IMPLIED = [
    "2004-07-01",
    "2005-06-27",
    "2005-10-12",
    "2007-07-20",
    "2008-10-24",
    "2010-06-20",
    "2011-01-11",
    "2012-05-20",
]


def torque(time_s, size: float = 1.0, late_s: float = 0.0) -> np.ndarray:
    """A torque like a cover's: a slow push, then three swings. [N m]"""
    t = np.asarray(time_s) - late_s
    push = -0.004 * np.clip(t / 10, 0, 1) * np.clip((81 - t) / 10, 0, 1)
    swings = 0.012 * np.sin(2 * np.pi * (t - 81) / 30) * ((t > 81) & (t < 171))
    return size * (push + swings)


def history(change: float = 0.0, scatter: float = 0.03, seed: int = 0, curves: bool = False) -> list[Entry]:
    """Entries at the papers' dates; impulse and peaks change by ``change`` over the years, relative."""
    rng = np.random.default_rng(seed)
    first, last = (np.datetime64(d) for d in (DEPLOYS[0], DEPLOYS[-1]))
    time_s = np.arange(-60.0, 361.0)
    entries = []
    for kind, dates in (("deploy", DEPLOYS), ("stow", STOWS)):
        for d in dates:
            line = 1 + change * float((np.datetime64(d) - first) / (last - first))
            values = tuple(
                Value(name, "fused", v * line * (1 + scatter * rng.standard_normal()), 0.01 * abs(v), "N m")
                for name, v in (("angular_impulse", -0.28), ("peak_positive", 0.012), ("peak_negative", -0.012))
            )
            size = line * (1 + scatter * rng.standard_normal())
            wobble = 2e-4 * np.convolve(rng.standard_normal(len(time_s)), np.ones(9) / 3, "same")
            shape = torque(time_s, size, rng.normal(0, 0.5)) + wobble
            drawn = (Curve("torque, fused", "N m", time_s, shape, np.full_like(time_s, 1e-4)),) if curves else ()
            hour = "12" if kind == "stow" else "00"
            entries.append(
                Entry("cassini", f"{kind}-{d}", kind, f"{d}T{hour}:01:00", values=values, curves=drawn, revision=1)
            )
    entries += [Entry("cassini", f"stow-{d}", "stow", f"{d}T00:00:00", revision=1) for d in IMPLIED]
    return entries
