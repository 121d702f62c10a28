"""The closed-loop flight simulator: a craft and a scenario in, telemetry and truth out."""
