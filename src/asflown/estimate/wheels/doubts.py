"""What is not sure of a wheel's drag and use."""

from __future__ import annotations

from ...kit.doubts import Kind, Severity

_MOTOR_OFF = "If the motor was off: --run-down {wheel}:{start_s:.0f}-{stop_s:.0f}."


def _no_run_down(what: str, cause: str) -> Kind:
    """A steady slowing that something else than a bearing explains."""
    return Kind(
        f"wheels.slows-{what}", Severity.NOTE,
        "wheel {wheel} slows steadily from {start_s:.0f} to {stop_s:.0f} s (spans like this: {spans}), but "
        f"{cause}: this is not used as a run-down", _MOTOR_OFF,
    )  # fmt: skip


SLOWS_BY_COMMAND = _no_run_down("by-command", "the commanded torque explains it")
SLOWS_AS_DRIVEN = _no_run_down("as-driven", "as a motor or a steady torque on the body would slow it")
SLOWS_WITH_OTHERS = _no_run_down(
    "with-others", "other wheels change with it, as a torque on the body would change them"
)
MOTOR_AT_WORK = _no_run_down("with-motor", "the current shows that its motor is at work")
FOLLOWS = Kind(
    "wheels.follows", Severity.NOTE,
    "wheel {wheel} slows from {start_s:.0f} to {stop_s:.0f} s while wheel {other} coasts: it follows, as the wheels that hold the "
    "attitude do, and this is not used as a run-down", _MOTOR_OFF,
)  # fmt: skip
ROUGH = Kind(
    "wheels.rough", Severity.NOTE,
    "wheel {wheel} slows from {start_s:.0f} to {stop_s:.0f} s, but less smoothly than a coasting wheel of this craft: this is not "
    "used as a run-down", _MOTOR_OFF,
)  # fmt: skip
MANY_COAST = Kind(
    "wheels.many-coast", Severity.CAUTION,
    "wheels {wheel} and {others} slow together from {start_s:.0f} to {stop_s:.0f} s, each as its bearing would slow it, and at most "
    "{most} can coast while the others hold the attitude: which of them coasts is not known, so this is not used as a run-down",
    _MOTOR_OFF,
)  # fmt: skip
NAMED_BUT_DRIVEN = Kind(
    "wheels.named-but-driven", Severity.SUSPECT,
    "wheel {wheel} is said to coast from {start_s:.0f} to {stop_s:.0f} s, but its motor's torque is {torque_Nm:+.2g} N m there",
    "Check the span of --run-down, and torque_constant in the craft file.",
)  # fmt: skip
TOO_MANY_NAMED = Kind(
    "wheels.too-many-named", Severity.CAUTION,
    "wheels {wheels} are said to coast together from {start_s:.0f} to {stop_s:.0f} s, more than the {most} that can while the others "
    "hold the attitude: thrusters held it, or the spans are wrong",
    "Check the spans of --run-down, or the list.",
)  # fmt: skip
NONE_LISTED_HERE = Kind(
    "wheels.none-listed-here", Severity.NOTE, "none of the run-downs named lies in this telemetry: {wheels}"
)
TORQUE_ZERO = Kind(
    "wheels.torque-zero", Severity.NOTE,
    "wheel {wheel}, {basis}: what the torque reads where there is none cannot be told from Coulomb drag while the wheel turns one "
    "way; it is taken as 0 ± {sigma_Nm:.2g} N m ({share_percent:g} % of the largest torque, assumed), which the sigma holds",
    "A run-down, or a wheel that turns both ways, shows it.",
)  # fmt: skip
TORQUE_SCALE = Kind(
    "wheels.torque-scale", Severity.SUSPECT,
    "wheel {wheel}, {basis}: the motor's torque is {scale:.3f} ± {scale_sigma:.3f} times what its spin inertia and rate need",
    "Check torque_constant and spin_inertia in the craft file, and the unit and sense of the channel.",
)  # fmt: skip
REVERSED = Kind(
    "wheels.reversed", Severity.SUSPECT,
    "the momenta of body and wheels balance only where the sense of wheel {wheels} is reversed (as described they miss by {ratio:.0f} "
    "times as much): drag of a run-down does not depend on it, but torque and inertia do",
    "Check the wheel's axis in the craft file, and the sign of its rate.",
)  # fmt: skip
FOUND_BY_SHAPE = Kind(
    "wheels.run-down-by-shape", Severity.NOTE,
    "wheel {wheel}: a run-down is assumed from {start_s:.0f} to {stop_s:.0f} s (run-downs in all: {run_downs}): only a bearing "
    "explains the wheel's course, and nothing in the file says that the motor was off",
    "If the motor was off: --run-down {wheel}:{start_s:.0f}-{stop_s:.0f}; else --store does not keep it without --store-guesses.",
)  # fmt: skip
MISFIT = Kind(
    "wheels.misfit", Severity.SUSPECT,
    "wheel {wheel} does not slow exactly as Coulomb and viscous drag would have it (slow residuals {ratio:.1f} times the noise): "
    "the sigmas are widened by that factor",
    "Look at the run-downs: --plot.",
)  # fmt: skip
PER_SPIN_INERTIA = Kind(
    "wheels.per-spin-inertia", Severity.NOTE,
    "the spin inertia of wheel {wheel} is not known: its drag is given per unit spin inertia", "Give spin_inertia in the craft file.",
)  # fmt: skip
COMMAND_INCOMPLETE = Kind(
    "wheels.command-incomplete", Severity.CAUTION,
    "wheel {wheel}: drag from the commanded torque is the momentum that the wheel gains too little by it; what its own "
    "electronics compensate is not included",
    "A run-down shows all of the drag.",
)  # fmt: skip
COMMAND_SHOWS_NONE = Kind(
    "wheels.command-shows-none", Severity.NOTE,
    "wheel {wheel}: the commanded torque shows no drag ({drag_Nm:.1g} ± {drag_sigma_Nm:.1g} N m): something compensates it",
    "A run-down shows the drag.",
)  # fmt: skip
NOT_SEPARABLE = Kind(
    "wheels.not-separable", Severity.NOTE,
    "wheel {wheel}, {basis}: the range of speeds is too narrow to separate Coulomb from viscous drag; their sum is known, at "
    "{mean_rate_rad_s:.1f} rad/s",
    "Take a run-down over a wider range of speeds.",
)  # fmt: skip
NEGATIVE_PART = Kind(
    "wheels.negative-part", Severity.SUSPECT,
    "wheel {wheel}, {basis}: Coulomb or viscous drag is negative, so something else acts too",
)  # fmt: skip
BASES_DIFFER = Kind(
    "wheels.bases-differ", Severity.SUSPECT,
    "wheel {wheel}: drag from {basis} and from {best} differ by {difference_Nm:+.2g} N m at {mean_rate_rad_s:.0f} rad/s",
)  # fmt: skip
IN_GAPS = Kind(
    "wheels.in-gaps", Severity.NOTE,
    "wheel {wheel}: {gaps_s:.0f} s lie in gaps, so revolutions, dwell and zero crossings are lower bounds",
)  # fmt: skip
OVER_LIMIT = Kind(
    "wheels.over-limit", Severity.SUSPECT,
    "wheel {wheel} exceeds its rate limit: {largest_rad_s:.1f} of {limit_rad_s:.1f} rad/s",
    "Check the unit of its rate, and rate_limit in the craft file.",
)  # fmt: skip
DRAG_UNKNOWN = Kind(
    "wheels.drag-unknown", Severity.NOTE,
    "drag is not known of wheel {wheels}: there is no run-down, and in the loop the motor compensates drag, so that the rate alone "
    "does not show it",
    "Add wheel_current_<WHEEL>, wheel_torque_<WHEEL>, wheel_drag_torque_<WHEEL> or control_torque_x|y|z, or take a record with a run-down.",
)  # fmt: skip
ON_THE_WHEEL = Kind(
    "wheels.sign-on-the-wheel", Severity.NOTE,
    "{channel} has the sign opposite to the rate: it is taken as the torque on the wheel",
)  # fmt: skip
MAGNITUDE = Kind(
    "wheels.sign-magnitude", Severity.NOTE, "{channel} has one sign for both senses of rotation: it is taken as a magnitude"
)  # fmt: skip
