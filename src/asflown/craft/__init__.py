"""The vehicle as data: one validated, frozen description from one TOML file."""
