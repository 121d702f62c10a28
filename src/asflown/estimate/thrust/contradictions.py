"""Where momentum and firings contradict each other: thrusters misnamed, and thrusters that fire uncounted."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ...dynamics.pulses import moment_matrix
from ...kit.errors import BadInput
from ...kit.timeline import runs
from ..firing import PULSES, Firings, Priors, gained_idle, pulse_Nms, uncounted
from .printed import balance

#: Share of the momentum gained that one thrust for all leaves unexplained, above which names, places or units are wrong; and
#: the factor by which an exchange of names must reduce it to be named.
_UNEXPLAINED, _BETTER = 0.5, 0.3
#: Share of all the momentum gained that a span without commands may have.
_IDLE = 0.05


def check_names(f: Firings, priors: Priors) -> None:
    """Raises BadInput where the momentum contradicts the thrusters named, and exchanging the names of one or two pairs would
    remove the contradiction, or turning the senses of all wheels."""
    center = f.subject.craft.craft.center_of_mass or priors.center_m
    Q = moment_matrix([t.position for t in f.thrusters], [t.direction for t in f.thrusters], center)
    known = ~f.at_limit[1:]
    V, on = balance(f)[known], (f.known.on_time_s[1:] - f.known.on_time_s[0])[known]

    def unexplained(order, sense: float = 1.0) -> float:
        u, v = sense * (on[:, order] @ Q.T).ravel(), V.ravel()
        F = max(float(u @ v) / max(float(u @ u), 1e-300), 0.0)
        return float(np.linalg.norm(v - F * u)) / max(float(np.linalg.norm(v)), 1e-300)

    order = np.arange(len(Q.T))
    own = unexplained(order)
    if own < _UNEXPLAINED:
        return
    reverse = unexplained(order, -1.0)
    if reverse < _BETTER * own:
        raise BadInput(
            f"momentum and firings contradict each other ({100 * own:.0f} % unexplained): a negative thrust leaves {100 * reverse:.0f} %",
            file=f.telemetry.source or None,
            channel="wheel_rate",
            remedy="Check the senses of all wheels (axes, signs of their rates), and the thrusters' directions: of the force on the craft.",
        )
    single = list(combinations(order, 2))
    double = [(a, b) for a, b in combinations(single, 2) if not set(a) & set(b)]
    for exchanges in ([(p,) for p in single], double):
        tried = []
        for pairs in exchanges:
            swapped = order.copy()
            for a, b in pairs:
                swapped[[a, b]] = swapped[[b, a]]
            tried.append((unexplained(swapped), pairs))
        best, pairs = min(tried, key=lambda t: t[0])
        if best < _BETTER * own:
            named = " and ".join(f"{f.names[a]} with {f.names[b]}" for a, b in pairs)
            raise BadInput(
                f"momentum and firings contradict each other ({100 * own:.0f} % unexplained); exchanging {named} leaves {100 * best:.0f} %",
                file=f.telemetry.source or None,
                channel=f"on_time_{f.names[pairs[0][0]]}",
                remedy="Correct the names of the on-time columns, or the thrusters in the craft file.",
            )


def check_counted(f: Firings) -> None:
    """Raises BadInput where momentum changes as by many pulses while no on-time rises; without body rates nothing is checked."""
    if f.rates is None:
        return
    steps, body = np.diff(f.in_space, axis=0), f.turned.apply(f.body)
    ordered = (np.diff(f.known.on_time_s, axis=0) > 0).any(axis=1) | f.broken
    for s in runs(~ordered):
        gained = gained_idle(f.in_space[s.start : s.stop + 1], body[s.start : s.stop + 1])
        pulses = gained / pulse_Nms(f.subject.craft.craft, f.thrusters, f.step_s, f.telemetry.date_ns)
        if pulses > PULSES and gained > _IDLE * np.linalg.norm(steps, axis=1).sum():
            a, b = (f.telemetry.describe_time(int(f.tai_ns[k])) for k in (s.start, s.stop))
            raise uncounted(gained, pulses, f"from {a} to {b}", f.telemetry.source)
