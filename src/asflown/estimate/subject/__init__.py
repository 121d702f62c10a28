"""What an estimate is about: telemetry with the craft on its date, its activity, its momentum on a common grid."""

from .activity import changes_as_in_a_slew, check_on_times, slews, thrusters_firing, turns, without_spikes
from .actuation import actuators, axes_and_inertias
from .assumed import GYRO_BIAS, INERTIA_SHARE, SPIN_SHARE, UNTOLD_TURN
from .grid import GAPS_BRIDGED, Grid, fit_on_grid, gap_doubts, gaps_on_grid, grid_for, splined
from .momentum import FEWEST, Samples, samples_of
from .sky import OF_THE_SUN, SUN_APART, sky_doubts
from .subject import PER_SPIN_INERTIA, Subject, subject_of
from .wheel_limits import at_limit, stopped

__all__ = [
    "FEWEST", "GAPS_BRIDGED", "GYRO_BIAS", "INERTIA_SHARE", "OF_THE_SUN", "PER_SPIN_INERTIA", "SPIN_SHARE", "SUN_APART", "UNTOLD_TURN", "Grid",
    "Samples", "Subject", "actuators", "at_limit", "axes_and_inertias", "changes_as_in_a_slew", "check_on_times",
    "fit_on_grid", "gap_doubts", "gaps_on_grid", "grid_for", "samples_of", "sky_doubts", "slews", "splined", "stopped", "subject_of",
    "thrusters_firing", "turns", "without_spikes",
]  # fmt: skip
