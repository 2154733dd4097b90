"""Curves and frames, whatever holds them: interpolation, rotations, crossings, the curve of a state in space."""
