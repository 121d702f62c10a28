"""What thrusters did: on-times and pulse counts, missed pulses, branches, the impulse that firing gave."""

from .branches import branch_change, other_branch, undescribed
from .chains import Chain, Nuisance, Parameter, Source, momentum_chain
from .clock import check_clock
from .counters import Counters, check_thrusters, control_step_s, counters_of, step_of
from .firings import Firings, firings_of
from .impulse import THRUST_SHARE, Gained, gained
from .missed_pulses import PULSES, gained_idle, pulse_Nms, uncounted
from .priors import CENTER_SIGMA, Priors, center_doubts, thrust_priors
from .slips import thrust_slip
from .valve import valve_of

__all__ = [
    "CENTER_SIGMA", "PULSES", "THRUST_SHARE", "Chain", "Counters", "Firings", "Gained", "Nuisance", "Parameter", "Priors",
    "Source", "branch_change", "center_doubts", "check_clock", "check_thrusters", "control_step_s", "counters_of", "firings_of", "gained",
    "gained_idle", "momentum_chain", "other_branch", "pulse_Nms", "step_of", "thrust_priors", "thrust_slip", "uncounted", "undescribed",
    "valve_of",
]  # fmt: skip
