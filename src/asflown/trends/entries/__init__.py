"""Entries of one event: figures of merit from telemetry and from results."""

from .actuation import BASES, analyse
from .events import find_events, is_event_list, load_events
from .figures import END_WITHIN, FIGURES, FIRST_PHASE_S, figure_of_merit, load_figures
from .gates import gates_entry
from .inertia import history_entries, inertia_entry
from .sources import sources_entry
from .thrust import thrust_entry
from .wheels import run_down_entries, wheel_entry

__all__ = [
    "BASES", "END_WITHIN", "FIGURES", "FIRST_PHASE_S", "analyse", "figure_of_merit", "find_events", "gates_entry",
    "history_entries", "inertia_entry", "is_event_list", "load_events", "load_figures", "run_down_entries", "sources_entry",
    "thrust_entry", "wheel_entry",
]  # fmt: skip
