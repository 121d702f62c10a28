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
    drag = "" if craft.aerodynamics else "no [aerodynamics]: needs --area and --arm"
    return (
        _ability("torque", no_inertia, inertia, no_wheels, loop),
        _ability("wheels", "" if craft.wheels else "no [[wheels]]", _spin_note(craft), _motor_note(craft)),
        _ability("inertia", "" if craft.wheels else "no [[wheels]]", _spin_note(craft)),
        _ability("external-torque", no_inertia, inertia, no_wheels),
        _ability("density", no_inertia, inertia, drag),
        _ability("jets", no_inertia, inertia),
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


def _motor_note(craft: Craft) -> str:
    named = any(w.torque_constant is not None for w in craft.wheels)
    return "" if named else "no torque_constant: wheel currents are not used"
