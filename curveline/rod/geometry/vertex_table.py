"""The columns of a table of vertices of a planar curve, by name; a row of it is one vertex."""

from __future__ import annotations

X, Y, ANGLE, CURVATURE, STRAIN, STRAIN_SLOPE = range(6)
"""Position, tangent angle [rad], curvature, axial strain and its slope by the unstretched arc length."""
COLUMNS = 6
