"""Telemetry: files are read here only, and become named SI channels, each at its own times."""
