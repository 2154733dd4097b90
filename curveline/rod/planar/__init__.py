"""The rod in the plane: its energy and equilibria on few edges, the sweep that meets them all, extrapolation."""
