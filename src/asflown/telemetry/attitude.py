"""The attitude against the body rates: does the quaternion turn in the direction that the gyros measure?

Rates are differenced from the quaternion under the declared convention and under its alternatives
(conjugate, other order).  The file is refused only where an alternative fits significantly better.  Where the
craft hardly moves the direction cannot be tested; a doubt says so.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..kit.doubts import Doubts
from ..kit.errors import BadInput
from ..kit.rotations import rates_between
from ..kit.timeline import NS
from .channels import AXES
from .findings import ERROR_TOO_FAST, IMPLAUSIBLE, NEVER_TOGETHER, RATE_SCALE, TURNS_TOO_LITTLE
from .frames import against_rates, commanded_doubt, readings_of
from .telemetry import BRIDGED, Telemetry, common_instants

if TYPE_CHECKING:
    from ..kit.doubts import Doubt

SIGNIFICANT = 14.0  # log-likelihood: odds of a million to one
BETTER = 1.5  # and by this ratio of squared misfit, more than a small timing error causes
COHERENT = 0.9  # share of the motion in common needed to compare scales
OFF_SCALE = 1.25
TOO_FAST = 10.0  # times the body rate: no control loop does this, a wrong unit does (57 or 1000)

#: Wrong unit suggested by a rate's scale.
MISTAKEN_UNITS = {180 / np.pi: "deg/s labelled rad/s", 1e3: "mrad/s labelled rad/s", 30 / np.pi: "rpm labelled rad/s",
                  np.pi / 180: "rad/s labelled deg/s", 1e-3: "rad/s labelled mrad/s", 1e6: "microrad/s labelled rad/s",
                  648_000 / np.pi: "arcsec/s labelled rad/s"}  # fmt: skip


def check_attitude(telemetry: Telemetry, readings: dict[str, tuple[np.ndarray, np.ndarray]] | None = None) -> Telemetry:
    """The same telemetry, with doubts about its quaternion's direction and axes, the rates' scale, and the commanded attitude.

    readings: other readings of the quaternion by name, (tai_ns (N,), q_NB (N, 4)); by default its conjugate and other orders.
    Each reading's differenced rates r are compared with the body rates w up to a free positive factor (a wrong
    unit is not a wrong direction): misfit S = sum |w - s r|^2, s >= 0; the likelihood of independent residuals
    of unknown size gives (3 M / 2) ln(S / S'), M reduced by the residuals' own correlation.
    Raises BadInput where another reading fits significantly better."""
    telemetry = _by_a_field(_commanded(_error_scale(telemetry)))
    needed = [f"quaternion_{m}" for m in "wxyz"]
    if not all(n in telemetry for n in needed) or not telemetry.has_axes("body_rate"):
        return telemetry
    tai_ns, q = together(telemetry, needed)
    if readings is None:
        readings = {words: (tai_ns, other) for words, other in readings_of(q, _orbit(telemetry, tai_ns)).items()}
        remedy = (
            "R(q) must take body vectors to inertial ones, not to the orbit's: negate quaternion_x, _y and _z, or name the columns in their order; "
            "a channel dictionary maps the columns with the direction and order they have."
        )
    else:
        remedy = "Correct [quaternion] in the channel dictionary."
    mid_ns, w = _measured(telemetry, tai_ns)
    if mid_ns is None:
        return _doubted(telemetry, NEVER_TOGETHER())
    declared, rate = _residual(tai_ns, q, mid_ns, w)
    odds = {}
    for name, (at_ns, other) in readings.items():
        order = np.argsort(at_ns, kind="stable")
        residual, _ = _residual(tai_ns, other[order[np.searchsorted(at_ns, tai_ns, sorter=order)]], mid_ns, w)
        odds[name] = _log_odds(residual, declared), float(np.sum(declared**2) / max(np.sum(residual**2), 1e-300))
    best = max(odds, key=lambda n: odds[n][1])
    if odds[best][0] > SIGNIFICANT and odds[best][1] > BETTER:
        raise BadInput(
            f"the quaternion turns against the body rates: {best} leaves {np.sqrt(odds[best][1]):.3g} times smaller "
            f"residuals (rms {_rms(declared):.3g} rad/s as it is)",
            channel="quaternion",
            remedy=remedy,
        )
    if (doubt := against_rates(rate, w)) is not None:
        return _scales(_doubted(telemetry, doubt), rate, w)
    turned = next(iter(odds))  # the conjugate comes first
    if odds[turned][0] > -SIGNIFICANT:
        telemetry = _doubted(telemetry, TURNS_TOO_LITTLE(rms_rad_s=_rms(w)))
    return _scales(telemetry, rate, w)


def together(telemetry: Telemetry, names: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Instants at which all the channels have a usable sample, (N,), and their values, (N, len(names))."""
    parts = [telemetry.channels[n].usable for n in names]
    common = common_instants(parts)
    return common, np.stack([p.values[np.searchsorted(p.tai_ns, common)] for p in parts], axis=1)


def _commanded(telemetry: Telemetry) -> Telemetry:
    """Doubt a commanded attitude that contradicts the one held."""
    four = [f"{stem}_{m}" for stem in ("quaternion", "commanded_quaternion") for m in "wxyz"]
    if not all(n in telemetry for n in four):
        return telemetry
    tai_ns, both = together(telemetry, four)
    if not len(tai_ns):
        return telemetry
    told = _at(telemetry, tai_ns, "attitude_error")
    doubt = commanded_doubt(both[:, :4], both[:, 4:], told, _orbit(telemetry, tai_ns))
    return telemetry if doubt is None else _doubted(telemetry, doubt)


def _orbit(telemetry: Telemetry, tai_ns: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Position and velocity at instants, (N, 3) each; None without them."""
    position, velocity = (_at(telemetry, tai_ns, stem) for stem in ("orbit_position", "orbit_velocity"))
    return None if position is None or velocity is None else (position, velocity)


def _at(telemetry: Telemetry, tai_ns: np.ndarray, stem: str) -> np.ndarray | None:
    """A vector between its samples, (N, 3), held beyond them; None without it."""
    if not telemetry.has_axes(stem):
        return None
    at_ns, values = together(telemetry, [f"{stem}_{a}" for a in AXES])
    if len(at_ns) < 2:
        return None
    x, at = ((v - at_ns[0]) / NS for v in (tai_ns, at_ns))
    return np.column_stack([np.interp(x, at, column) for column in values.T])


def _measured(telemetry: Telemetry, tai_ns: np.ndarray):
    """Body rates at the middle of each step between attitudes, where both are known without a gap."""
    at_ns, w = together(telemetry, [f"body_rate_{a}" for a in AXES])
    if len(tai_ns) < 10 or len(at_ns) < 10:
        return None, None
    step, cadence = np.diff(tai_ns), np.median(np.diff(at_ns))
    mid_ns = tai_ns[:-1] + step // 2
    after = np.clip(np.searchsorted(at_ns, mid_ns), 1, len(at_ns) - 1)
    near = (at_ns[after] - at_ns[after - 1] <= (BRIDGED + 1.5) * cadence) & (mid_ns >= at_ns[0]) & (mid_ns <= at_ns[-1])
    near &= step <= (BRIDGED + 1.5) * np.median(step)
    if near.sum() < 10:
        return None, None
    x = (mid_ns - at_ns[0]) / NS
    known = np.stack([np.interp(x, (at_ns - at_ns[0]) / NS, w[:, k]) for k in range(3)], axis=1)
    return near, known[near]


def _residual(tai_ns, q, near, w) -> tuple[np.ndarray, np.ndarray]:
    """Body rates less those of the quaternion times the best positive factor; and those of the quaternion."""
    _, rate = rates_between((tai_ns - tai_ns[0]) / NS, q)
    rate = rate[near]
    size = float(np.sum(rate**2))
    factor = max(0.0, float(np.sum(w * rate))) / size if size > 0 else 0.0
    return w - factor * rate, rate


def _log_odds(residual: np.ndarray, declared: np.ndarray) -> float:
    """Log-likelihood of a reading over the declared one."""
    better = min(residual, declared, key=lambda r: float(np.sum(r**2)))
    total = float(np.sum(better**2))
    rho = float(np.sum(better[1:] * better[:-1])) / total if total > 0 else 0.0
    rho = min(max(rho, 0.0), 0.99)
    count = better.size * (1 - rho) / (1 + rho)
    return count / 2 * float(np.log(max(np.sum(declared**2), 1e-300) / max(np.sum(residual**2), 1e-300)))


def _error_scale(telemetry: Telemetry) -> Telemetry:
    """Doubt the unit of the attitude error where it changes many times faster than the body turns.

    In a hold de/dt = -w.  Its slope against w is compared with a clear excess only: while the command
    moves the error follows the motion less, never more."""
    names = [f"attitude_error_{a}" for a in AXES]
    if not all(n in telemetry for n in names) or not telemetry.has_axes("body_rate"):
        return telemetry
    tai_ns, e = together(telemetry, names)
    near, w = _measured(telemetry, tai_ns)
    if near is None:
        return telemetry
    change = np.diff(e, axis=0)[near] / (np.diff(tai_ns)[near] / NS)[:, None]
    size = float(np.sum(w**2))
    if size == 0:
        return telemetry
    slope = float(np.sum(change * w)) / size
    error = float(np.sqrt(np.sum((change - slope * w) ** 2) / (w.size * size)))
    if abs(slope) - 5 * error < TOO_FAST:
        return telemetry
    unit = telemetry.channels[names[0]].unit_given or "rad"
    return _doubted(telemetry, ERROR_TOO_FAST(channels=names, ratio=abs(slope), unit=unit))


def rate_scale(telemetry: Telemetry) -> tuple[float, str] | None:
    """Ratio of the body rates to those of the quaternion, and the wrong unit it suggests ('' where it is near one).

    None where one of them is missing, or their motions do not correlate."""
    names = [f"quaternion_{m}" for m in "wxyz"]
    if not all(n in telemetry for n in names) or not telemetry.has_axes("body_rate"):
        return None
    tai_ns, q = together(telemetry, names)
    near, w = _measured(telemetry, tai_ns)
    if near is None:
        return None
    return _scale(_residual(tai_ns, q, near, w)[1], w)


def _scale(rate: np.ndarray, w: np.ndarray) -> tuple[float, str] | None:
    common = float(np.sum(w * rate))
    if common <= 0 or common**2 < COHERENT * float(np.sum(w**2)) * float(np.sum(rate**2)):
        return None
    scale = common / float(np.sum(rate**2))
    if 1 / OFF_SCALE < scale < OFF_SCALE:
        return scale, ""
    near = [u for f, u in MISTAKEN_UNITS.items() if abs(np.log(scale / f)) < np.log(OFF_SCALE)]
    return scale, f"are they {near[0]}?" if near else "check the unit of the body rates"


def _scales(telemetry: Telemetry, rate: np.ndarray, w: np.ndarray) -> Telemetry:
    """Doubt a unit where rates and attitude are correlated but differ in scale."""
    found = _scale(rate, w)
    if found is None:
        return telemetry
    if not found[1]:
        return _plausible(telemetry)
    names = [f"body_rate_{a}" for a in AXES]
    return _doubted(telemetry, RATE_SCALE(channels=names, ratio=found[0], guess=found[1]))


def _plausible(telemetry: Telemetry) -> Telemetry:
    """Without the doubt that the body rates are too large: something else turns as they say, as on a craft that tumbles."""
    kept = [
        d for d in telemetry.doubts if d.kind.id != IMPLAUSIBLE.id or not d.about["channels"].startswith("body_rate_")
    ]
    return replace(telemetry, doubts=Doubts(kept))


def _by_a_field(telemetry: Telemetry) -> Telemetry:
    """Large body rates against a vector that turns in body axes as the body turns: dB/dt = -w x B, of a magnetic field or the Sun."""
    if not telemetry.doubts.of(IMPLAUSIBLE) or not telemetry.has_axes("body_rate"):
        return telemetry
    for stem in ("magnetic_field", "sun_direction"):
        if not telemetry.has_axes(stem):
            continue
        tai_ns, b = together(telemetry, [f"{stem}_{a}" for a in AXES])
        w = _at(telemetry, tai_ns[:-1] + np.diff(tai_ns) // 2, "body_rate")
        if w is None or len(tai_ns) < 10:
            continue
        seen = np.diff(b, axis=0) / (np.diff(tai_ns) / NS)[:, None]
        found = _scale(-np.cross(w, (b[1:] + b[:-1]) / 2), seen)
        if found is not None and not found[1]:
            return _plausible(telemetry)
    return telemetry


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(x**2, axis=1))))


def _doubted(telemetry: Telemetry, doubt: Doubt) -> Telemetry:
    return replace(telemetry, doubts=telemetry.doubts + Doubts([doubt]))
