"""Shared by all rooms: errors, units, time, rotations, regression, smoothing, doubts, the base of results."""
