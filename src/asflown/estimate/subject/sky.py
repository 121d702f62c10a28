"""Field and Sun as a craft measures them, against where they must be: IGRF, the ephemeris, and the Earth's shadow.

Where they are elsewhere, how else the vectors may be meant is tried: in inertial axes, in the orbit's, Earth-fixed, opposite, under the
other direction of the quaternion, or in sensor axes that are turned against the body's (by least squares).  Where one turn mends field and
Sun alike, it is the quaternion's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.frames import earth_fixed, lvlh_axes
from ...dynamics.orbit import BODIES, Orbit, flown
from ...dynamics.sun import sun_direction, sunlit
from ...kit.doubts import Doubt, Doubts, Kind, Severity
from ...kit.errors import BadInput
from ...kit.rotations import angle_between, best_rotation, quaternion, rotation, words_of
from ...kit.timeline import NS
from ...telemetry.attitude import together
from ...telemetry.channels import AXES
from ...telemetry.frames import READINGS

if TYPE_CHECKING:
    from ...craft.model import Craft
    from ...telemetry.telemetry import Telemetry

#: Beyond these a direction contradicts what it is held against. [rad]  A coarse sun sensor errs by a few degrees, IGRF in low orbit by
#: less than one, a magnetometer that is not calibrated by ten.
_SUN_OFF, _FIELD_OFF = np.radians(15), np.radians(20)
#: A reading explains a direction within this share of that.
_EXPLAINS = 0.5
#: The field's size is right within this factor: a wrong unit is not.
_SIZE = 1.5
_UNITS = {1e9: "nT labelled T", 1e6: "microtesla labelled T", 1e4: "gauss labelled T", 1e3: "nT labelled microtesla",
          1e-3: "microtesla labelled nT", 1e-6: "T labelled microtesla", 1e-9: "T labelled nT"}  # fmt: skip
#: Shadow by the sun sensor and by geometry may differ for so long at an edge. [s]
_EDGE_S = 60.0
#: Fewest samples of a vector that are judged, and the most.
_FEWEST, _MOST = 8, 240
#: A vector this short is none.
_NONE = 0.1

FIELD_SIZE = Kind(
    "subject.field-size", Severity.SUSPECT,
    "the measured magnetic field is {ratio:.3g} times as strong as IGRF's at the orbit's position (median){guess}",
    "Check the unit of magnetic_field, and that of the positions.",
)  # fmt: skip
FIELD_APART = Kind(
    "subject.field-apart", Severity.SUSPECT,
    "the measured magnetic field stands {off_deg:.0f} degrees from IGRF's at the orbit's position and attitude (median): {how}",
    "Give magnetic_field_x, _y, _z in the craft's body axes; check the epoch and the quaternion.",
)  # fmt: skip
SUN_APART = Kind(
    "subject.sun-apart", Severity.SUSPECT,
    "the measured Sun stands {off_deg:.0f} degrees from where it is on that date and in that attitude (median): {how}",
    "Give sun_direction_x, _y, _z in the craft's body axes; check the epoch and the quaternion.",
)  # fmt: skip
ATTITUDE_APART = Kind(
    "subject.attitude-apart", Severity.SUSPECT,
    "field and Sun both stand elsewhere than date, orbit and attitude say ({field_deg:.0f} and {sun_deg:.0f} degrees, medians), and both fit "
    "{how}",
    "Give the quaternion body to inertial, of the same body axes as the vectors.",
)  # fmt: skip
SHADOW_APART = Kind(
    "subject.shadow-apart", Severity.SUSPECT,
    "the sun sensor's shadow is not the Earth's: {dark_s:.0f} s dark where orbit and date give light, {light_s:.0f} s light where they give "
    "shadow. The sensor is believed",
    "Check orbit_position and the epoch; a sun vector of zero must mean shadow, not a Sun outside the sensor's view.",
)  # fmt: skip
#: Those about the Sun alone.
OF_THE_SUN = (SUN_APART, SHADOW_APART)


def sky_doubts(telemetry: Telemetry, craft: Craft | None = None) -> Doubts:
    """What measured field and Sun contradict.

    Parameters
    ----------
    telemetry : Telemetry
        Field and Sun where it has them; quaternion and epoch to judge their directions, positions for the field and the shadow.
    craft : Craft, optional
        Its ``orbit`` serves where the telemetry has no positions.

    Returns
    -------
    Doubts
        None where nothing can be judged.
    """
    if not telemetry.dated or not (telemetry.has_axes("magnetic_field") or telemetry.has_axes("sun_direction")):
        return Doubts()
    field, sun = _field(telemetry, craft), _sun(telemetry, craft)
    doubts: list[Doubt | None] = [None if field is None else _size(field), _shadow(telemetry, craft)]
    both = _of_both(field, sun)
    if both is not None:
        return Doubts([*doubts, both])
    doubts += [
        FIELD_APART(off_deg=np.degrees(field.off), how=field.how())
        if field is not None and field.off > _FIELD_OFF
        else None
    ]
    doubts += [
        SUN_APART(off_deg=np.degrees(sun.off), how=sun.how()) if sun is not None and sun.off > _SUN_OFF else None
    ]
    return Doubts(doubts)


@dataclass(frozen=True)
class _Vector:
    """A vector measured in body axes and as it must be in inertial ones, (N, 3) each; attitude, body to inertial (N, 3, 3); instants
    [s TAI] and the orbit's axes (N, 3, 3); ``limit``: how far off it may be [rad]."""

    measured_B: np.ndarray
    true_N: np.ndarray
    R_NB: np.ndarray
    tai_s: np.ndarray
    lvlh: np.ndarray
    limit: float

    @property
    def expected_B(self) -> np.ndarray:
        return np.einsum("nji,nj->ni", self.R_NB, self.true_N)

    @property
    def off(self) -> float:
        return self.off_from(self.expected_B)

    def turned(self):
        """The turn of the expected vectors that fits best, whether they tell it, and how far off they then are."""
        a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (self.measured_B, self.expected_B))
        turn, told = best_rotation(a, b)
        return turn, told, self.off_from(turn.apply(b))

    def how(self) -> str:
        """How else it may be meant, in words."""
        lefts = {words: self.off_from(v) for words, v in (self._other_axes() | self.other_attitudes()).items()}
        best = min(lefts, key=lambda k: lefts[k])
        if lefts[best] < _EXPLAINS * self.limit:
            return f"it fits {best} (to {np.degrees(lefts[best]):.2g} degrees)"
        turn, told, left = self.turned()
        back = words_of(turn.inv())
        if left < _EXPLAINS * self.limit:
            sure = "" if told else ", or any turn more about itself"
            return (
                f"it fits (to {np.degrees(left):.2g} degrees) if turned by {back}{sure}. Is that the sensor's mounting?"
            )
        return f"it fits under no reading; turned by {back} it is still {np.degrees(left):.0f} degrees off"

    def _other_axes(self) -> dict[str, np.ndarray]:
        """What would be measured in other axes, (N, 3)."""
        return {
            "as a vector in inertial axes": self.true_N,
            "as a vector in Earth-fixed axes": np.einsum("nij,nj->ni", earth_fixed(self.tai_s), self.true_N),
            "as a vector in the orbit's axes (LVLH)": np.einsum("nij,nj->ni", self.lvlh, self.true_N),
            "with the opposite sign": -self.expected_B,
        }

    def other_attitudes(self) -> dict[str, np.ndarray]:
        """What would be measured if the quaternion meant another attitude, (N, 3)."""
        q = quaternion(scipy.spatial.transform.Rotation.from_matrix(self.R_NB))
        made = {
            f"if the quaternion is taken as {words}": rotation(read(q)).inv().apply(self.true_N)
            for words, read in READINGS.items()
        }
        in_orbit = np.einsum("nij,nj->ni", self.lvlh, self.true_N)
        return made | {
            "if the quaternion is relative to the orbit's axes (LVLH)": np.einsum("nji,nj->ni", self.R_NB, in_orbit)
        }

    def off_from(self, other: np.ndarray) -> float:
        return float(np.median(angle_between(self.measured_B, other)))


def _of_both(field: _Vector | None, sun: _Vector | None) -> Doubt | None:
    """Field and Sun off by one and the same mistake in the attitude, or by one turn, found from both."""
    if field is None or sun is None or field.off < _FIELD_OFF or sun.off < _SUN_OFF:
        return None
    off = {"field_deg": np.degrees(field.off), "sun_deg": np.degrees(sun.off)}

    def mended(a: np.ndarray, b: np.ndarray) -> bool:
        return field.off_from(a) < _EXPLAINS * _FIELD_OFF and sun.off_from(b) < _EXPLAINS * _SUN_OFF

    others = zip(field.other_attitudes().items(), sun.other_attitudes().values(), strict=True)
    for (words, a), b in others:
        if mended(a, b):
            return ATTITUDE_APART(how=words, **off)
    pairs = []
    for v in (field, sun):
        weight = 1 / np.sqrt(len(v.measured_B))
        pairs.append([weight * x / np.linalg.norm(x, axis=1, keepdims=True) for x in (v.measured_B, v.expected_B)])
    turn, told = best_rotation(*(np.concatenate(x) for x in zip(*pairs, strict=True)))
    if not told or not mended(turn.apply(field.expected_B), turn.apply(sun.expected_B)):
        return None
    return ATTITUDE_APART(
        how=f"if turned by {words_of(turn.inv())}: the quaternion is of another body frame than they are", **off
    )


def _size(field: _Vector) -> Doubt | None:
    ratio = float(np.median(np.linalg.norm(field.measured_B, axis=1) / np.linalg.norm(field.true_N, axis=1)))
    if 1 / _SIZE < ratio < _SIZE:
        return None
    unit = [said for factor, said in _UNITS.items() if 1 / _SIZE < ratio / factor < _SIZE]
    return FIELD_SIZE(ratio=ratio, guess=f": {unit[0]}?" if unit else "")


def _field(telemetry: Telemetry, craft: Craft | None) -> _Vector | None:
    from ...dynamics.magnetic_field import field_at

    try:
        return _held_against(telemetry, craft, "magnetic_field", field_at, _FIELD_OFF)
    except BadInput:  # another date than the model's, or below the surface: said where the orbit is used
        return None


def _sun(telemetry: Telemetry, craft: Craft | None) -> _Vector | None:
    """Of an Earth orbiter, or one whose place is not told: the Sun as the Earth sees it."""
    return _held_against(telemetry, craft, "sun_direction", lambda _, tai_s: sun_direction(tai_s), _SUN_OFF)


def _held_against(telemetry: Telemetry, craft: Craft | None, stem: str, true, off: float) -> _Vector | None:
    """A measured vector beside ``true`` (positions (N, 3) [m], TAI (N,) [s] -> (N, 3), inertial); None where there is no telling."""
    found = _measured(telemetry, stem)
    if found is None:
        return None
    tai_ns, vector, R = found
    state = _state(telemetry, craft, tai_ns)
    if state is None:
        return None
    return _Vector(vector, true(state[0], tai_ns / NS), R, tai_ns / NS, lvlh_axes(*state), off)


def _measured(telemetry: Telemetry, stem: str):
    """Instants (N,) [ns TAI], a measured vector that is not zero (N, 3), and the attitude (N, 3, 3); None without one of them."""
    four = [f"quaternion_{m}" for m in "wxyz"]
    if not telemetry.has_axes(stem) or not all(n in telemetry for n in four):
        return None
    tai_ns, v = together(telemetry, [f"{stem}_{a}" for a in AXES])
    at_ns, q = together(telemetry, four)
    size = np.linalg.norm(v, axis=1)
    limit = _NONE if stem == "sun_direction" else 0.0
    if len(at_ns) < 2:
        return None
    use = np.flatnonzero((size > limit) & (tai_ns >= at_ns[0]) & (tai_ns <= at_ns[-1]))
    if len(use) < _FEWEST:
        return None
    use = use[np.unique(np.linspace(0, len(use) - 1, _MOST).round().astype(int))]
    R = scipy.spatial.transform.Slerp((at_ns - at_ns[0]) / NS, rotation(q))((tai_ns[use] - at_ns[0]) / NS).as_matrix()
    return tai_ns[use], v[use], R


def _state(telemetry: Telemetry, craft: Craft | None, tai_ns: np.ndarray):
    """Position and velocity about the Earth at instants, (N, 3) each; None where the craft is not known to orbit it."""
    if telemetry.has_axes("orbit_position"):
        at_ns, r = together(telemetry, [f"orbit_position_{a}" for a in AXES])
        if len(at_ns) < _FEWEST or tai_ns[0] < at_ns[0] - 10 * NS or tai_ns[-1] > at_ns[-1] + 10 * NS:
            return None
        orbit = Orbit((at_ns - at_ns[0]) / NS, r)
        found, earth = orbit.acceleration(), BODIES[0]
        at_earth = found.free_fall and found.body == earth if found.told else orbit.nearest_m < 1e8
        if not at_earth or orbit.nearest_m < earth.radius_m:
            return None
        t = (tai_ns - at_ns[0]) / NS
        return orbit.at(t), orbit.velocity_at(t)
    if craft is None or craft.orbit is None:
        return None
    try:
        return flown(craft.orbit, tai_ns / NS)
    except BadInput:
        return None


def _shadow(telemetry: Telemetry, craft: Craft | None) -> Doubt | None:
    """The sun sensor's zeros against the Earth's shadow."""
    if not telemetry.has_axes("sun_direction"):
        return None
    tai_ns, s = together(telemetry, [f"sun_direction_{a}" for a in AXES])
    if len(tai_ns) < _FEWEST:
        return None
    state = _state(telemetry, craft, tai_ns)
    if state is None:
        return None
    seen, lit = np.linalg.norm(s, axis=1) > _NONE, sunlit(state[0], sun_direction(tai_ns / NS)) > 0.5
    step = np.minimum(np.diff(tai_ns, append=tai_ns[-1]) / NS, _EDGE_S / 2)
    dark, light = (float(np.sum(step[m])) for m in (lit & ~seen, ~lit & seen))
    return SHADOW_APART(dark_s=dark, light_s=light) if max(dark, light) > _EDGE_S else None
