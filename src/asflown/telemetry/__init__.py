"""The only door for telemetry: whatever comes in leaves as named SI channels, each at its own times."""
