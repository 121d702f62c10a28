"""What each verb can do with a craft as its file describes it, and what is missing."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .model import Craft


class Ability(NamedTuple):
    """One verb: ``can`` do it, and what is missing, or what its answer rests on."""

    verb: str
    can: bool
    note: str


def abilities(craft: Craft) -> tuple[Ability, ...]:
    """Verb by verb, what the file allows.  What the telemetry must hold is not asked here.

    Parameters
    ----------
    craft : Craft
        Any.

    Returns
    -------
    tuple of Ability
        In the order of the verbs in docs/cli.md.
    """
    no_wheels = "" if craft.wheels else "no [[wheels]]: needs wheel_momentum_x|y|z"
    inertia = _inertia_note(craft)
    no_inertia = "" if craft.mass_properties else "no [[mass_properties]]: give the inertia there or with --inertia"
    thrusters = "" if craft.thrusters else "no [[thrusters]]"
    center = "" if craft.stated_center else "no center_of_mass: taken as the middle of the thrusters"
    loop = "" if craft.wheel_controller else "no [wheel_controller]: the actuators' action is taken as measured"
    drag = "" if craft.aerodynamics and craft.aerodynamics.in_flyby else "no drag of a flyby in [aerodynamics]"
    orbit = "" if craft.orbit else "no [orbit]: needs orbit_position_x|y|z"
    known = _known_note(craft)
    return (
        _ability("torque", no_inertia, inertia, no_wheels, loop, known),
        _ability("wheels", "" if craft.wheels else "no [[wheels]]", _spin_note(craft), _motor_note(craft)),
        _ability("inertia", "" if craft.wheels else "no [[wheels]]", _spin_note(craft)),
        _ability("external-torque", no_inertia, inertia, no_wheels, known),
        _ability("sources", no_inertia, inertia, no_wheels, orbit, _not_described(craft)),
        _ability("density", no_inertia or drag, inertia),
        _ability("jets", no_inertia or drag, inertia),
        _ability("leak", thrusters or no_inertia, inertia, center),
        _ability("thrust", thrusters or no_inertia, inertia, center),
    )


def _ability(verb: str, missing: str, *notes: str) -> Ability:
    return Ability(verb, not missing, missing or "; ".join(n for n in notes if n))


def _inertia_note(craft: Craft) -> str:
    share, used = craft.inertia_share, craft.mass_properties_used
    if used and used[0].basis == "predicted":
        return f"inertia predicted only, used with {100 * (share or 0.0):g} %"
    return "" if share is None else f"inertia used with {100 * share:g} %"


def _spin_note(craft: Craft) -> str:
    return "spin inertia unknown: answers per unit of it" if any(w.spin_inertia is None for w in craft.wheels) else ""


def _known_note(craft: Craft) -> str:
    """Which torques of the surroundings the file describes, as --with takes them."""
    air = craft.aerodynamics
    described = {
        "gravity-gradient": craft.orbit, "sunlight": craft.sunlight, "dipole": craft.magnetics,
        "drag": air is not None and air.in_orbit,
    }  # fmt: skip
    named = [name for name, there in described.items() if there]
    return f"known torques (--with): {', '.join(named)}" if named else ""


def _not_described(craft: Craft) -> str:
    """What ``sources`` then fits without a value from before the flight."""
    air = craft.aerodynamics
    missing = [
        table for table, there in (
            ("[magnetics]", craft.magnetics), ("[sunlight]", craft.sunlight),
            ("[aerodynamics]", air is not None and air.in_orbit),
        ) if not there
    ]  # fmt: skip
    return f"no {', '.join(missing)}: fitted from the telemetry alone" if missing else ""


def _motor_note(craft: Craft) -> str:
    named = any(w.torque_constant is not None for w in craft.wheels)
    return "" if named else "no torque_constant: wheel currents are not used"
