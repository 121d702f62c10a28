"""The other door: executed maneuvers, their frame, their adjustments, and the models flown with them."""
