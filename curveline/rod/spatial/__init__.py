"""The full discrete elastic rod: energy with exact derivatives, relaxation, search, extrapolation, motion."""
