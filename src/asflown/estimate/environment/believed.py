"""The terms of a craft at given instants, with what its file believes of them.

    environment = environment_of(subject, tai_ns, which=("gravity-gradient", "dipole"))
    for term in environment.terms: term.torque_Nm, term.errors_Nm, term.design, term.source

Laws (body axes; r, v from the planet's centre, s to the Sun, B the field):
gravity gradient 3 mu / r^5 r x (I r); sunlight lit (lever x s); dipole m x B; drag rho / rho_0 lever x (-v/|v|); rods m_rods x B.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...craft.model import PREDICTED_SHARE
from ...dynamics.environment import gravity_gradient_regressor
from ...dynamics.orbit import BODIES
from ...dynamics.rigid_body import ELEMENTS, elements_of
from ...dynamics.surfaces import drag_torque, sunlight_torque
from ...kit.doubts import Doubts
from ...kit.errors import BadInput, check_choice, some_of
from ...kit.timeline import NS
from ...telemetry.channels import AXES
from ..subject import OF_THE_SUN, sky_doubts
from .orbits import carried, flown_through, gravity_words, longest_gap, orbit_in, refuse_contradictions
from .sky import Place, Seen, attitude_at, believed_sun, field_at_craft, rods_at, sun_at_craft
from .term import Term, levers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...craft.model import Craft
    from ..subject import Subject

NAMES = ("gravity-gradient", "sunlight", "dipole", "drag", "rods")

#: The longest stretch without a position, as a share of an orbit (by circular motion).
_GAP = 0.1
#: Height over which thin air falls by e, where no model of it is given: 50 to 70 km at 500 km. [m]
_SCALE_HEIGHT_M = 60e3
#: One sigma of a density, as shares: of its mean, and of its swing over an orbit (day and night differ by a factor of 2 to 4).
_AIR_MODELLED, _AIR_ASSUMED = (0.2, 0.1), (0.3, 0.3)
#: One sigma of the torque on facets, as a share: their areas and optical constants are seldom known better.
_FACETS = 0.1
#: An inertia that was inferred or assumed, without a sigma, is known no better than a predicted one.
_GUESSED = ("inferred", "assumed", "extrapolated")
#: One sigma of a torque rod's dipole, as a share: hysteresis and rise time. Assumed.
_RODS = 0.05


@dataclass(frozen=True)
class Air:
    """Solar flux of the day and its mean over 81 days [1e-22 W/(m2 Hz)], and Ap: what NRLMSIS needs."""

    f107: float
    f107_mean: float
    ap: float


@dataclass(frozen=True)
class Environment:
    """Terms at N instants, what is missing for those left out, and doubts about orbit, field and Sun.

    Attributes
    ----------
    tai_ns : ndarray of int64, shape (N,)
    terms : tuple of Term
        In the order of ``NAMES``.
    left_out : dict of str to str
        Term -> what it lacks.
    R_NB : ndarray, shape (N, 3, 3), or None
        Attitude, body to inertial.
    lit : ndarray, shape (N,), or None
        Share of the Sun that is seen.
    phase_rad : ndarray, shape (N,), or None
        How far the craft has gone round its orbit since the first instant.
    doubts : Doubts
    """

    tai_ns: np.ndarray
    terms: tuple[Term, ...]
    left_out: dict[str, str]
    R_NB: np.ndarray | None
    lit: np.ndarray | None
    phase_rad: np.ndarray | None
    doubts: Doubts

    def term(self, name: str) -> Term | None:
        return next((t for t in self.terms if t.name == name), None)


def environment_of(
    subject: Subject, tai_ns: np.ndarray, which: Sequence[str] = NAMES, air: Air | None = None
) -> Environment:
    """The environment's torques on a craft at instants ``tai_ns`` (N,) [ns TAI], in any attitude.

    Parameters
    ----------
    subject : Subject
        Telemetry (quaternion; orbit, field, Sun and rods where there are) and the craft on its date.
    tai_ns : ndarray of int64, shape (N,)
        Increasing, within the quaternion's span.
    which : sequence of str
        Of ``NAMES``.
    air : Air, optional
        For NRLMSIS; without it the density falls exponentially with height.

    Returns
    -------
    Environment

    Raises
    ------
    BadInput
        For a name that is no term, and for positions that contradict themselves (another unit, Earth-fixed axes, underground).
    """
    for name in which:
        check_choice(name, NAMES, "term")
    tai_ns = np.asarray(tai_ns, np.int64)
    place, doubts, why = _place(subject, tai_ns)
    tlm, craft = subject.telemetry, subject.craft.craft
    field, no_field = field_at_craft(tlm, place) if {"dipole", "rods"} & set(which) else (None, "")
    sun, no_sun, of_sun = sun_at_craft(tlm, place) if "sunlight" in which else (None, "", [])
    if "sunlight" in which:
        of_sun = believed_sun(sun, of_sun, sky_doubts(tlm, craft).of(*OF_THE_SUN))
    makers = {
        "gravity-gradient": partial(_gravity, subject, place, why),
        "sunlight": partial(_sunlight, craft, sun, no_sun),
        "dipole": partial(_dipole, craft, field, no_field),
        "drag": partial(_drag, craft, place, air, why),
        "rods": partial(_rods, subject, tai_ns, field, no_field),
    }
    made = {name: makers[name]() for name in NAMES if name in which}
    return Environment(
        tai_ns=tai_ns,
        terms=tuple(t for t in made.values() if isinstance(t, Term)),
        left_out={name: t for name, t in made.items() if isinstance(t, str)},
        R_NB=place.R_NB,
        lit=None if sun is None else sun.share,
        phase_rad=None if place.velocity_N is None else place.phase,
        doubts=Doubts([*doubts, *of_sun]),
    )


#: What the craft file has to say for each.
_BELIEFS = {
    "gravity-gradient": "an inertia", "sunlight": "[sunlight]", "dipole": "[magnetics]", "drag": "[aerodynamics]",
    "rods": "[[torque_rods]]",
}  # fmt: skip


def known_terms(subject: Subject, tai_ns: np.ndarray, names: Sequence[str], air: Air | None = None) -> Environment:
    """Terms whose torque the craft file knows, to be taken off.  Raises BadInput where one of them cannot be computed."""
    around = environment_of(subject, tai_ns, names, air)
    missing = [f"{name} needs {what}" for name, what in around.left_out.items()]
    missing += [f"{t.name} needs {_BELIEFS[t.name]} in the craft file" for t in around.terms if t.torque_Nm is None]
    if missing:
        raise BadInput(
            f"not all known torques can be computed: {some_of(missing)}", remedy="Leave these out of --with."
        )
    return around


def _place(subject: Subject, tai_ns: np.ndarray) -> tuple[Place, Doubts, str]:
    """Where the craft is and how it points, doubts, and why there is no orbit ('' where there is one)."""
    tlm, craft = subject.telemetry, subject.craft.craft
    start = int(tai_ns[0])
    t = (tai_ns - start) / NS
    words = gravity_words(None if subject.relative else subject.inertia_kgm2, float(t[-1]))
    orbit, body, doubts, count = orbit_in(tlm, start, words)
    refuse_contradictions(tlm, doubts)
    position, velocity, why = None, None, "orbit_position_x, _y, _z, or [orbit] in the craft file"
    if orbit is not None:
        orbit, gaps = flown_through(orbit, body)
        doubts = Doubts([*doubts, gaps])
        gap = longest_gap(orbit, float(t[0]), float(t[-1]))
        if gap <= _GAP * 2 * np.pi * np.sqrt(orbit.nearest_m**3 / orbit.mu):
            at = np.clip(t, orbit.time_s[0], orbit.time_s[-1])
            position, velocity, why = orbit.at(at), orbit.velocity_at(at), ""
        else:
            orbit, why = None, f"positions over the whole span ({gap:.0f} s without one)"
    elif count:
        why = "an orbit that can be believed" if doubts else f"more than {count} positions"
    elif craft.orbit is not None and tlm.dated:
        from ...dynamics.orbit import Orbit, flown

        position, velocity = flown(craft.orbit, tai_ns / NS)
        orbit, body, why = Orbit(t, position), BODIES[0].name, ""
        doubts = Doubts([*doubts, carried(craft.orbit.epoch, tai_ns)])
    R = attitude_at(tlm, tai_ns)
    return Place(tai_ns, tlm.dated, R, orbit, position, velocity, body), doubts, why


# ---- the terms: a Term, or what is missing for it ----


def _gravity(subject: Subject, place: Place, why: str) -> Term | str:
    if place.orbit is None or place.position_N is None:
        return why
    if place.R_NB is None:
        return "the quaternion"
    G = gravity_gradient_regressor(place.to_body(place.position_N), place.orbit.mu)
    torque = errors = None
    if subject.inertia_kgm2 is not None and not subject.relative:
        torque = G @ elements_of(subject.inertia_kgm2)
        errors = G * inertia_sigma(subject)
    source = "position and attitude from the telemetry" if subject.telemetry.has_axes("orbit_position") else "[orbit]"
    return Term("gravity-gradient", ELEMENTS, "kg m2", G, f"{source}, {place.body}", torque, errors)


def inertia_sigma(subject: Subject) -> np.ndarray:
    """One sigma of the six elements (6,): the share stated, of each moment; of a product half that share of its two moments' mean.

    Half: errors of the mass's second moments that favour no axes have sigma s in the diagonal and s / sqrt(2) beside it; a moment of
    inertia is the sum of two of the first, a product one of the second."""
    moments = np.diag(subject.inertia_kgm2)  # type: ignore[arg-type]
    i, j = np.triu_indices(3)
    used = subject.craft.craft.mass_properties_used
    guessed = any(m.basis in _GUESSED and m.sigma is None and m.piece != "given" for m in used)
    return (
        max(subject.inertia_share, PREDICTED_SHARE * guessed)
        * np.sqrt(moments[i] * moments[j])
        * np.where(i == j, 1.0, 0.5)
    )


def _sunlight(craft: Craft, sun: Seen | None, missing: str) -> Term | str:
    if sun is None:
        return missing
    design = sun.share[:, None, None] * levers(sun.u_B)
    torque = errors = None
    if craft.sunlight is not None:
        torque = sun.share[:, None] * sunlight_torque(craft, sun.u_B)
        sigma = craft.sunlight.sigma_Nm
        errors = _FACETS * torque[:, :, None] if sigma is None else design * sigma
    return Term("sunlight", AXES, "N m", design, sun.source, torque, errors)


def _dipole(craft: Craft, field: Seen | None, missing: str) -> Term | str:
    if field is None:
        return missing
    design = levers(field.u_B)
    torque = errors = None
    if craft.magnetics is not None:
        torque, errors = design @ craft.magnetics.residual_dipole_Am2, design * craft.magnetics.sigma_Am2
    return Term("dipole", AXES, "A m2", design, field.source, torque, errors, measured=field.measured)


def _drag(craft: Craft, place: Place, air: Air | None, why: str) -> Term | str:
    if place.position_N is None or place.velocity_N is None:
        return why
    if place.R_NB is None:
        return "the quaternion"
    if not place.at_earth:
        return "an orbit of the Earth"
    velocity = place.to_body(place.velocity_N)
    known = craft.aerodynamics if craft.aerodynamics is not None and craft.aerodynamics.in_orbit else None
    reference = None if known is None or known.lever is None else known.reference_density
    ratio, density, shares, source = _density(place, air, reference)
    design = ratio[:, None, None] * levers(-velocity / np.linalg.norm(velocity, axis=1, keepdims=True))
    torque = errors = None
    if known is not None and density is not None:
        torque = drag_torque(craft, velocity, density)
        of_lever = _FACETS * torque[:, :, None] if known.sigma_Nm is None else design * known.sigma_Nm
        phase = place.phase
        swing = np.stack([np.ones(len(ratio)), np.cos(phase), np.sin(phase)], axis=1)
        sizes = np.array([shares[0], shares[1], shares[1]])
        errors = np.concatenate([of_lever, torque[:, :, None] * (swing * sizes)[:, None, :]], axis=2)
    return Term("drag", AXES, "N m", design, f"air stream from the orbit, density {source}", torque, errors)


def _density(place: Place, air: Air | None, reference: float | None):
    """Density over the reference, or over its mean along the arc without one (N,); the density itself [kg/m3] where it is known;
    one sigma of its mean and of its swing, as shares; its source in words."""
    if air is not None and place.dated:
        from ...dynamics.thermosphere import density_at

        rho = density_at(place.position, place.tai_s, air.f107, air.f107_mean, air.ap)
        return rho / (reference or rho.mean()), rho, _AIR_MODELLED, "by NRLMSIS 2.1 (pymsis)"
    height = np.linalg.norm(place.position, axis=1)
    share = np.exp(-(height - height.mean()) / _SCALE_HEIGHT_M)
    share = share / share.mean()
    return share, None if reference is None else reference * share, _AIR_ASSUMED, "that falls by e over 60 km of height"


def _rods(subject: Subject, tai_ns: np.ndarray, field: Seen | None, missing: str) -> Term | str:
    m = rods_at(subject.telemetry, tai_ns)
    if m is None:
        return "torque_rod_dipole_x, _y, _z"
    if field is None:
        return missing
    torque = np.cross(m, field.u_B)
    return Term("rods", ("scale",), "", torque[:, :, None], field.source, torque, _RODS * torque[:, :, None])
