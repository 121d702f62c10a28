"""Which method: by name with its options, by what the record holds, or by what is wanted of it."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, ClassVar

from ...kit.doubts import Doubts, Kind, Severity
from ...kit.errors import BadInput, check_choice
from ...telemetry.channels import AXES
from .answer import VARIANTS, Answer, Method
from .fused import Fused
from .momentum import Momentum
from .on_times import OnTimes
from .polynomial import Polynomial
from .transfer import Transfer

if TYPE_CHECKING:
    from ..fused import Foreknown
    from ..subject import Subject

#: Methods by name.
METHODS: dict[str, type[Method]] = {m.name: m for m in (Fused, Momentum, Transfer, Polynomial, OnTimes)}
#: What a method's options are called on the command line, and who takes them.
_FLAGS = {
    "model": ("--model", "transfer or polynomial"),
    "order": ("--order", "polynomial (6, 12, 15, 18)"),
    "window_s": ("--window", "momentum or transfer"),
    "prior": ("--prior", "fused"),
    "loop": ("--loop", "fused"),
    "considered": ("--consider", "fused"),
    "variant": ("--variant", "momentum, transfer or polynomial"),
}

CANNOT_FUSE = Kind(
    "torque.cannot-fuse", Severity.NOTE, "the fused method cannot be used ({why}): this is the {method} method",
    "Use --method fused to see what it lacks.",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Automatic(Method):
    """Fused where it can be; else momentum, or transfer where attitude error alone is telemetered, with a doubt."""

    name: ClassVar[str] = "automatic"
    foreknown: Foreknown | None = None

    def estimate(self, subject: Subject, axes: tuple[int, ...]) -> Answer:
        from ..fused import CannotFuse

        try:
            return Fused(foreknown=self.foreknown).estimate(subject, axes)
        except CannotFuse as why:
            found = f"{why.channel}: {why.what}" if why.channel else why.what
        method = Transfer() if _attitude_alone(subject) else Momentum()
        answer = method.estimate(subject, axes)  # where this too is asked too much, its complaint is the plainer one
        return replace(answer, doubts=Doubts([CANNOT_FUSE(why=found, method=method.name), *answer.doubts]))


def _attitude_alone(subject: Subject) -> bool:
    """Whether the attitude's error is telemetered, and nothing of the actuators."""
    stems = {c.kind.stem for c in subject.telemetry.channels.values()}
    return "attitude_error" in stems and not stems & {"wheel_rate", "wheel_momentum", "control_torque"}


def method_called(
    name: str | None = None,
    *,
    variant: str = "corrected",
    model: str | None = None,
    order: int | None = None,
    window_s: float | None = None,
    prior: str | None = None,
    loop: str | None = None,
    considered: dict[str, float] | None = None,
) -> Method:
    """The method of that name with the options given.

    None: momentum for the printed variant or with a window, ``Fused`` with its options, else ``Automatic``.
    Raises BadInput for a name or value that is not known, and for an option that the method does not take."""
    check_choice(name, (None, *METHODS), "method")
    check_choice(variant, VARIANTS, "variant")
    options = {
        "model": model,
        "order": order,
        "window_s": window_s,
        "prior": prior,
        "loop": loop,
        "considered": considered,
    }
    told: dict = {n: v for n, v in options.items() if v is not None}
    if variant != "corrected":
        told["variant"] = variant
    if name is None and not told:
        return Automatic()
    name = name or ("momentum" if {"variant", "window_s"} & set(told) else "fused")
    takes = {f.name for f in fields(METHODS[name]) if f.init}
    for option, value in told.items():
        if option not in takes:
            flag, others = _FLAGS[option]
            what = (
                "is in no paper" if option == "variant" else f"has no {option.removesuffix('_s')} to choose ({value})"
            )
            raise BadInput(f"the {name} method {what}", remedy=f"Leave {flag} out, or use --method {others}.")
    return METHODS[name](**told)


def chosen_method(subject: Subject, axes: tuple[int, ...] = (0, 1, 2)) -> Method:
    """The method for the surroundings' torque alone, as in a flyby.

    On-times where thrusters fire.  Transfer where body rates are missing, attitude error is there and the controller is
    described: it responds to the body's motion too, as wheels alone do not.  Else ``Automatic``."""
    if subject.firing:
        return OnTimes()
    tlm = subject.telemetry
    bodiless = [AXES[j] for j in axes if f"body_rate_{AXES[j]}" not in tlm]
    known = subject.craft.craft.wheel_controller is not None
    if bodiless and known and f"attitude_error_{bodiless[0]}" in tlm:
        return Transfer()
    return Automatic()
