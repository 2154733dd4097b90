"""Shape and display files: TOML in the units people write to a `Scene` in SI, or every problem of the file at once."""
