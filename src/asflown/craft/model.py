"""What a spacecraft is: mass properties by date, wheels, thrusters, controller, mechanisms.

Values are SI with radians once loaded; in the TOML every value carries its unit.  Vectors are in
body axes.  Inertia tensors are written Ixx Iyy Izz Ixy Ixz Iyz, tensor elements (not negated
products of inertia), about the centre of mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr, model_validator

from ..kit.doubts import Doubt, Doubts, Kind, Severity
from ..kit.errors import BadInput, some_of
from ..kit.quantities import quantity
from ..kit.result import Input
from ..kit.timeline import NS, utc_label
from .fields import (
    AngularFrequency,
    Date,
    Described,
    Direction,
    Frequency,
    InertiaElements,
    InertiaRatio,
    Kilogram,
    KilogramMetre2,
    Metre,
    Metre2,  # noqa: F401  as _in
    MetrePerSecond,
    MetreVector,
    ModeCoupling,
    Newton,
    NewtonMetre,
    NewtonMetrePerAmpere,
    Pascal,
    Radian,
    RadianPerSecond,
    Second,
    Share,
    SpinInertia,
    ViscousDrag,
    _in,  # noqa: F401  scenarios take their units from here
)
from .surroundings import Aerodynamics, Magnetics, OrbitElements, Sunlight, TorqueRod


def tensor(elements) -> np.ndarray:
    """Ixx Iyy Izz Ixy Ixz Iyz -> 3 x 3."""
    xx, yy, zz, xy, xz, yz = elements
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], float)


def check_inertia(I_B: np.ndarray, what: str) -> None:
    """Refuse a tensor that no rigid body can have: it must be positive definite and satisfy the triangle inequality."""
    w = np.linalg.eigvalsh(I_B)
    if w[0] <= 0 or w[0] + w[1] < w[2] * (1 - 1e-9):
        raise BadInput(
            f"{what}: no rigid body has this inertia (principal moments {w[0]:.6g}, {w[1]:.6g}, {w[2]:.6g} kg m2)",
            remedy="Principal moments must be positive, and none larger than the sum of the other two. The order is "
            "Ixx, Iyy, Izz, Ixy, Ixz, Iyz in kg m2, tensor elements (not negated products of inertia).",
        )


#: What is known of a craft, from longer before or after than this, is doubted: assumed. [ns]
STALE_NS = 200 * 86_400 * NS

STATED = Kind("craft.stated", Severity.CAUTION, "{sentence}")  # a doubt that the craft's file itself states
INTERPOLATED = Kind(
    "craft.inertia-interpolated", Severity.CAUTION,
    "the inertia on {date} is interpolated by date between {before} and {after}: the propellant used in between is not known",
    "Give the inertia (--inertia), or the propellant ledger in the craft file.",
)  # fmt: skip
PREDICTED = Kind(
    "craft.inertia-predicted", Severity.CAUTION,
    "the inertia is predicted, not estimated in flight: it is used with one sigma of {sigma_percent:g} %{assumed}",
    "Estimate it from slews (asflown inertia), or state its sigma in the craft file.",
)  # fmt: skip
NEAREST = Kind(
    "craft.inertia-nearest", Severity.CAUTION,
    "the inertia is that of {date}, the nearest known date of this configuration",
    "Give the inertia on the date of the telemetry: --inertia.",
)  # fmt: skip


#: One sigma of a predicted inertia whose entry states none, as a share: assumed, wide.
PREDICTED_SHARE = 0.05


def _day(tai_ns: int) -> str:
    return utc_label(tai_ns)[:10]


class MassProperties(Described):
    """The inertia tensor on one date.  Entries of the same ``piece`` are interpolated.

    ``sigma``: one sigma of the tensor, as a share of its moments."""

    date: Date
    piece: str
    inertia: InertiaElements | None = None
    inertia_per_spin_inertia: InertiaRatio | None = None  # where only the ratio to the wheels' spin inertia is known
    basis: Literal["estimated", "predicted", "extrapolated", "inferred", "assumed"] = "estimated"
    sigma: Share | None = None
    mass: Kilogram | None = None
    source: str = ""
    doubt: str = ""

    @model_validator(mode="after")
    def _possible(self):
        if (self.inertia is None) == (self.inertia_per_spin_inertia is None):
            raise ValueError("give either inertia or inertia_per_spin_inertia")
        check_inertia(tensor(self.elements), f"mass properties {self.piece!r}")
        return self

    @property
    def elements(self):
        return self.inertia if self.inertia is not None else self.inertia_per_spin_inertia

    @property
    def share(self) -> float | None:
        """One sigma as a share: the one stated, else that assumed of a prediction; None: not stated."""
        return PREDICTED_SHARE if self.sigma is None and self.basis == "predicted" else self.sigma


class InertiaRequirement(Described):
    """How well the tensor must be known: moments as a share of themselves, products in kg m2."""

    moments: Annotated[float, BeforeValidator(lambda v: quantity(v, ""))] = Field(gt=0)
    products: KilogramMetre2 = Field(gt=0)
    source: str = ""


class PropellantUsed(Described):
    date: Date
    used: Kilogram
    source: str = ""


class Drag(Described):
    """A wheel's bearing drag.  Values are assumed unless a source is given."""

    viscous: ViscousDrag = 0.0
    coulomb: NewtonMetre = 0.0
    stiction: NewtonMetre = 0.0
    source: str = ""


class Wheel(Described):
    """A reaction wheel: momentum = spin inertia x rate relative to the body, along ``axis``."""

    name: str
    axis: Direction
    spin_inertia: SpinInertia
    valid_from: Date | None = None
    valid_to: Date | None = None
    rate_limit: RadianPerSecond | None = None
    torque_limit: NewtonMetre | None = None
    torque_constant: NewtonMetrePerAmpere | None = None  # of the motor
    drag: Drag = Drag()
    note: str = ""

    @model_validator(mode="after")
    def _unit_axis(self):
        if abs(np.linalg.norm(self.axis) - 1) > 1e-6:
            raise ValueError(f"wheel {self.name}: the axis is not a unit vector")
        return self

    def serves_at(self, tai_ns: int) -> bool:
        return (self.valid_from is None or tai_ns >= self.valid_from) and (
            self.valid_to is None or tai_ns < self.valid_to
        )


class Thruster(Described):
    """A thruster: ``direction`` is that of the force on the body."""

    name: str
    position: MetreVector
    direction: Direction
    nominal_thrust: Newton
    delay: Second = 0.0
    rise: Second = 0.0
    fall: Second = 0.0
    branch: str = ""


class ThrustHistory(Described):
    """Thrust on one date.  Entries of the same ``piece`` are interpolated; a recharge of the tank begins a new piece."""

    date: Date
    thrust: Newton
    piece: str = ""
    source: str = ""


class BlowDown(Described):
    """A tank without a regulator: thrust is proportional to a power of its pressure."""

    thrust: Newton = Field(gt=0)
    pressure: Pascal = Field(gt=0)
    exponent: float = Field(gt=0)
    source: str = ""

    def pressure_at(self, thrust_N: float) -> float:
        """Tank pressure at that thrust of each thruster. [Pa]"""
        return self.pressure * (thrust_N / self.thrust) ** (1 / self.exponent)


class ThrusterController(Described):
    """Thrusters fired outside a deadband of e + lead x rate error, a whole control cycle at a time."""

    lead: Second = Field(gt=0)
    hysteresis: Radian = Field(default=0.0, ge=0)  # firing ends this far inside
    approach_rate: RadianPerSecond = Field(gt=0)  # at most, back to the deadband
    pairs: dict[Literal["+x", "-x", "+y", "-y", "+z", "-z"], tuple[str, ...]]  # which turn the craft that way
    burn: tuple[str, ...] = ()  # which change its velocity
    source: str = ""


class RateFilter(Described):
    """Identical second-order low-pass sections in cascade."""

    natural_frequency: AngularFrequency = Field(gt=0)
    damping: float = Field(gt=0)
    sections: Literal[2] = 2


class WheelController(Described):
    """Proportional-derivative control on the (filtered) rate, with what is fed forward (cover paper eqs 12, 13; see dynamics.loop).

    u = D (KD (w_c - F(w)) + KD KP e)  [+ w x (J w + h)]  [+ J w_c']

    u the torque on the body, e the attitude's error and w_c the commanded rate, h the wheels' momentum, J the inertia that the
    controller believes and D its diagonal, F the rate filter."""

    bandwidth: Frequency = Field(gt=0)
    damping: float = Field(gt=0)
    rate_filter: RateFilter | None = None  # None: the rate itself
    period: Second | None = Field(default=None, gt=0)  # None: not known
    gyroscopic: bool | None = None  # whether w x (J w + h) is fed forward; None: not known
    acceleration: bool | None = None  # whether J x commanded acceleration is
    tracking: bool = True  # whether the rate's error is against the commanded rate; else against none
    inertia: InertiaElements | None = None  # J; None: the craft's own

    @model_validator(mode="after")
    def _possible(self):
        if self.inertia is not None:
            check_inertia(tensor(self.inertia), "[wheel_controller] inertia")
        return self

    def believed_kgm2(self, I_B: np.ndarray) -> np.ndarray:
        """J (3, 3) of a craft whose own tensor is ``I_B``."""
        return I_B if self.inertia is None else tensor(self.inertia)

    @property
    def natural_frequency_rad_s(self) -> float:
        return 2 * np.pi * self.bandwidth

    @property
    def kp_per_s(self) -> float:
        """KP = wn / (2 zn), with the loop's own damping (cover paper eq 12 prints the filter's symbol)."""
        return self.natural_frequency_rad_s / (2 * self.damping)

    @property
    def kd_per_s(self) -> float:
        return 2 * self.damping * self.natural_frequency_rad_s


class Mechanism(Described):
    """A part that moves: a cover, a boom, an antenna."""

    name: str
    mass: Kilogram
    inertia: InertiaElements  # about its own centre of mass
    from_cm: MetreVector  # its centre of mass, from the spacecraft's
    hinge_axis: Direction
    stowed: Radian
    deployed: Radian
    cycles_allowed: int | None = None
    source: str = ""
    assumptions: tuple[str, ...] = ()

    def inertia_about_craft(self) -> np.ndarray:
        """Its part of the craft's tensor: I_own + m (L.L 1 - L L^T)  (braces of cover paper eqs 4a-c)."""
        L = np.array(self.from_cm, float)
        return tensor(self.inertia) + self.mass * (L @ L * np.eye(3) - np.outer(L, L))


class FlexibleMode(Described):
    """One appendage mode in hybrid coordinates; ``coupling`` is the row delta of d/dt(delta eta_dot)."""

    name: str
    frequency: Frequency
    damping: float
    coupling: ModeCoupling
    source: str = ""


class Pendulum(Described):
    """Propellant that sloshes: a mass on a rod, held to the middle by surface tension."""

    name: str
    mass: Kilogram = Field(gt=0)  # of the swinging part
    pivot: MetreVector  # from the craft's centre of mass
    direction: Direction  # from the pivot to the mass at rest
    length: Metre = Field(gt=0)
    frequency: Frequency = Field(gt=0)
    damping: float = Field(ge=0)
    source: str = ""

    @model_validator(mode="after")
    def _directed(self):
        if np.linalg.norm(self.direction) == 0:
            raise ValueError(f"slosh {self.name!r}: the direction must not be zero")
        return self


class Accelerometer(Described):
    axis: Direction
    scale: MetrePerSecond  # per count
    source: str = ""


class Alternative(Described):
    """A named set of other published values."""

    spin_inertia: dict[str, SpinInertia] = Field(default_factory=dict)
    inertia: InertiaElements | None = None  # in place of all history
    source: str = ""


class Craft(Described):
    """A spacecraft.  ``at(date)`` gives it as it was on a date."""

    name: str
    description: str = ""
    mass_properties: tuple[MassProperties, ...] = ()
    inertia_requirement: InertiaRequirement | None = None
    propellant: tuple[PropellantUsed, ...] = ()
    wheels: tuple[Wheel, ...] = ()
    wheel_controller: WheelController | None = None
    thrusters: tuple[Thruster, ...] = ()
    thrust_history: tuple[ThrustHistory, ...] = ()
    blow_down: BlowDown | None = None
    thruster_controller: ThrusterController | None = None
    mechanisms: tuple[Mechanism, ...] = ()
    flexible_modes: tuple[FlexibleMode, ...] = ()
    slosh: tuple[Pendulum, ...] = ()
    accelerometer: Accelerometer | None = None
    aerodynamics: Aerodynamics | None = None
    orbit: OrbitElements | None = None
    magnetics: Magnetics | None = None
    torque_rods: tuple[TorqueRod, ...] = ()
    sunlight: Sunlight | None = None
    center_of_mass: MetreVector | None = None
    center_of_mass_assumed: MetreVector | None = None  # assumed, where none is known
    alternatives: dict[str, Alternative] = Field(default_factory=dict)

    _inputs: tuple[Input, ...] = PrivateAttr(default=())

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The file that describes it; empty for a built-in craft."""
        return self._inputs

    @model_validator(mode="after")
    def _consistent(self):
        for things in (self.thrusters, self.mechanisms, self.flexible_modes, self.slosh, self.torque_rods):
            names = [t.name for t in things]
            if len(set(names)) != len(names):
                raise ValueError(f"a name is used twice: {some_of(names)}")
        for name in self.wheel_names:
            spans = sorted(_service(w) for w in self.wheels if w.name == name)
            if any(a[1] > b[0] for a, b in pairwise(spans)):
                raise ValueError(
                    f"wheel {name!r} is described twice for one date: separate the entries by valid_from and valid_to"
                )
        if self.thruster_controller is not None:
            used = {n for pair in self.thruster_controller.pairs.values() for n in pair} | {
                *self.thruster_controller.burn
            }
            if unknown := used - {t.name for t in self.thrusters}:
                raise ValueError(f"thruster_controller names {some_of(unknown)}, which is not a thruster")
        relative = {w.spin_inertia is None for w in self.wheels}
        if len(relative) > 1:
            raise ValueError("give the spin inertia of every wheel or of none")
        if relative == {True} and self.wheel_controller is not None and self.wheel_controller.inertia is not None:
            raise ValueError(
                "[wheel_controller] inertia needs wheels of known spin_inertia: results are per unit of it"
            )
        return self

    @property
    def wheel_names(self) -> list[str]:
        """Names of all wheels, each once, in the order of the file."""
        return list(dict.fromkeys(w.name for w in self.wheels))

    @property
    def stated_center(self) -> tuple[float, float, float] | None:
        """Centre of mass as known, else as assumed. [m]"""
        return self.center_of_mass or self.center_of_mass_assumed

    @property
    def likely_center(self) -> tuple[float, float, float]:
        """Centre of mass as stated, else the middle of the thrusters. [m]"""
        if self.stated_center is not None:
            return self.stated_center
        x, y, z = np.mean([t.position for t in self.thrusters], axis=0)
        return float(x), float(y), float(z)

    @property
    def mass_properties_used(self) -> tuple[MassProperties, ...]:
        """Those that give the inertia, by date: the estimated, inferred and assumed ones; predicted ones where there are no others."""
        flown = [m for m in self.mass_properties if m.basis != "predicted"]
        return tuple(sorted(flown or self.mass_properties, key=lambda m: m.date))

    @property
    def inertia_share(self) -> float | None:
        """One sigma of the inertia as a share, the widest of the entries used; None where none is stated or assumed."""
        return max((m.share for m in self.mass_properties_used if m.share is not None), default=None)

    def mechanism(self, name: str) -> Mechanism:
        """The mechanism of that name.

        Raises
        ------
        BadInput
            Where there is none.
        """
        for m in self.mechanisms:
            if m.name == name:
                return m
        raise BadInput(
            f"{self.name} has no mechanism {name!r}",
            remedy=f"Its mechanisms: {some_of(m.name for m in self.mechanisms)}.",
        )

    def with_alternative(self, name: str) -> Craft:
        """The craft with a named set of other published values.

        Parameters
        ----------
        name : str
            A key of ``alternatives``.

        Returns
        -------
        Craft

        Raises
        ------
        BadInput
            Where the craft has no such alternative.
        """
        if name not in self.alternatives:
            raise BadInput(f"{self.name} has no alternative {name!r}", remedy=f"It has: {some_of(self.alternatives)}.")
        other, inertia = self.alternatives[name].spin_inertia, self.alternatives[name].inertia
        wheels = tuple(w.model_copy(update={"spin_inertia": other.get(w.name, w.spin_inertia)}) for w in self.wheels)
        return self.model_copy(update={"wheels": wheels}).with_inertia(inertia)

    def with_inertia(self, elements, cm=None) -> Craft:
        """The craft with one inertia tensor for all dates, and another centre of mass.

        Parameters
        ----------
        elements : sequence of 6 floats or None
            Ixx, Iyy, Izz, Ixy, Ixz, Iyz [kg m2], tensor elements; None keeps the craft's history.
        cm : sequence of 3 floats, optional
            Centre of mass [m], in the origin of the thrusters' positions.

        Returns
        -------
        Craft

        Raises
        ------
        BadInput
            For a tensor that no rigid body can have.
        """
        changes: dict = {}
        if elements is not None:
            given = MassProperties.model_construct(
                date=0, piece="given", inertia=tuple(elements), inertia_per_spin_inertia=None,
                basis="assumed", mass=None, source="given by the user", doubt="",
            )  # fmt: skip
            check_inertia(tensor(elements), "the inertia given")
            changes["mass_properties"] = (given,)
        if cm is not None:
            changes["center_of_mass"] = tuple(cm)
        return self.model_copy(update=changes)

    def thrust_at(self, tai_ns: int) -> float:
        """Predicted steady thrust of each thruster on a date: linear in time within a piece, constant outside.

        Parameters
        ----------
        tai_ns : int
            The date, ns TAI.

        Returns
        -------
        float
            [N]

        Raises
        ------
        BadInput
            For a craft without a thrust history.
        """
        known = sorted(self.thrust_history, key=lambda h: h.date)
        if not known:
            raise BadInput(
                f"the thrust of {self.name} is not known",
                remedy="Add a [[thrust_history]] to its file, or give the thrust.",
            )
        begun = [h for h in known if h.date <= tai_ns] or known[:1]
        piece = [h for h in known if h.piece == begun[-1].piece]
        return float(np.interp(float(tai_ns), [float(h.date) for h in piece], [h.thrust for h in piece]))

    def believed_thrust(self, tai_ns: int | None) -> float:
        """Thrust of each thruster assumed before an estimate: that of the history, else the mean nominal thrust.

        Parameters
        ----------
        tai_ns : int or None
            The date, ns TAI; None: the latest of the history.

        Returns
        -------
        float
            [N]

        Raises
        ------
        BadInput
            For a craft without thrusters.
        """
        if self.thrust_history:
            return self.thrust_at(max(h.date for h in self.thrust_history) if tai_ns is None else tai_ns)
        if not self.thrusters:
            raise BadInput(
                f"{self.name} has no thrusters", remedy="Describe them under [[thrusters]] in the craft file."
            )
        return float(np.mean([t.nominal_thrust for t in self.thrusters]))

    def at(self, tai_ns: int | None) -> CraftAt:
        """The craft on a date.

        Parameters
        ----------
        tai_ns : int or None
            The date, ns TAI; None: the latest known state.

        Returns
        -------
        CraftAt
            Inertia tensor (interpolated, (3, 3) [kg m2]), wheels in service, and doubts about them.
        """
        doubts: list[Doubt] = []
        moment = tai_ns if tai_ns is not None else max((m.date for m in self.mass_properties), default=0)
        wheels = [w for w in self.wheels if w.serves_at(moment)] if tai_ns is not None else _latest(self.wheels)
        I_B, relative = self._inertia_at(moment, doubts)
        return CraftAt(self, tai_ns, I_B, relative, tuple(wheels), Doubts(doubts).passed_on_by("craft"))

    def _inertia_at(self, moment: int, doubts: list[Doubt]):
        known = self.mass_properties_used
        if not known:
            return None, False
        if known[0].piece == "given":
            return tensor(known[0].elements), False
        if known[0].basis == "predicted":
            assumed = " (assumed: none is stated)" if any(m.sigma is None for m in known) else ""
            doubts.append(PREDICTED(sigma_percent=100 * (self.inertia_share or 0.0), assumed=assumed))
        before = [m for m in known if m.date <= moment]
        after = [m for m in known if m.date > moment]
        a = before[-1] if before else after[0]
        b = after[0] if before and after and after[0].piece == a.piece else a
        if b is not a and moment - a.date > 5 * 86_400 * 10**9:
            x, how = self._fraction(a.date, b.date, moment)
            I_B = (1 - x) * tensor(a.elements) + x * tensor(b.elements)
            doubts += [STATED(sentence=m.doubt) for m in (a, b) if m.doubt and 0 < x < 1]
            if how == "date":
                doubts.append(INTERPOLATED(date=_day(moment), before=_day(a.date), after=_day(b.date)))
        else:
            I_B = tensor(a.elements)
            if a.doubt:
                doubts.append(STATED(sentence=a.doubt))
            if abs(moment - a.date) > STALE_NS:
                doubts.append(NEAREST(date=_day(a.date)))
        return I_B, a.inertia is None

    def _fraction(self, start: int, stop: int, moment: int) -> tuple[float, str]:
        """Fraction of the way between two dates: by propellant used where the ledger covers them, else by date."""
        ledger = sorted(self.propellant, key=lambda p: p.date)
        if ledger and ledger[0].date <= start and stop <= ledger[-1].date:
            dates, used = [p.date for p in ledger], [p.used for p in ledger]
            u0, u, u1 = (float(np.interp(float(t), dates, used)) for t in (start, moment, stop))
            if u1 > u0:
                return (u - u0) / (u1 - u0), "propellant"
        return (moment - start) / (stop - start), "date"


def _service(wheel: Wheel) -> tuple[float, float]:
    return (
        -np.inf if wheel.valid_from is None else wheel.valid_from,
        np.inf if wheel.valid_to is None else wheel.valid_to,
    )


def _latest(wheels):
    """The set in service last, for data without a date."""
    return [w for w in wheels if w.valid_to is None]


@dataclass(frozen=True)
class CraftAt:
    """A craft on one date, as ``Craft.at`` returns it."""

    craft: Craft
    tai_ns: int | None
    inertia_kgm2: np.ndarray | None  # (3, 3); per unit spin inertia where ``relative``
    relative: bool
    wheels: tuple[Wheel, ...]
    doubts: Doubts = Doubts()

    def wheel(self, name: str) -> Wheel | None:
        """The wheel of that name in service on the date; None where there is none."""
        return next((w for w in self.wheels if w.name == name), None)

    def effective_inertia(self, mechanism: str) -> np.ndarray:
        """Inertia of the craft without a moving part, by the parallel-axis theorem (cover paper eqs 4, 5).

        Parameters
        ----------
        mechanism : str
            Name of the part.

        Returns
        -------
        ndarray, shape (3, 3)
            [kg m2], body axes, about the craft's centre of mass.

        Raises
        ------
        BadInput
            For an unknown mechanism, and where no rigid body has the remaining inertia.
        """
        I_B = self.inertia_kgm2 - self.craft.mechanism(mechanism).inertia_about_craft()
        check_inertia(I_B, f"{self.craft.name} without its {mechanism}")
        return I_B
