"""What a display can show: stable curves of a segment over its limits, and maps of states, folds and forces."""
