"""One characterization a file: telemetry and craft in, a result that doubts itself out."""
