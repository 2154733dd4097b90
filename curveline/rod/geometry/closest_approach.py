"""Kernel that finds how near a curve comes to itself, fast where it does not come near."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix
from curveline.kernels.kernel import leaf, shipped

STRIDE = 8
"""Points that are passed over at once where nothing comes near the first of them."""


@shipped(Matrix, int, float)
def nearest_parts(points, apart, enough):
    """Smallest distance between `points (k, 3)` that are at least `apart` (an index distance) from each other.

    Distances from `enough` on do not matter: `enough` is returned. Along a curve no distance falls by more than what is
    gone along, so that most points are passed over.
    """
    k = points.shape[0]
    spacing = 0.0
    for i in range(k - 1):
        spacing = max(spacing, _distance(points, i, i + 1))
    nearest = enough
    i = 0
    while i < k - apart:
        if _is_clear(points, i, i + apart, nearest + STRIDE * spacing, spacing):
            i += STRIDE
            continue
        for begin in range(i, min(i + STRIDE, k - apart)):
            j = begin + apart
            while j < k:
                distance = _distance(points, begin, j)
                nearest = min(nearest, distance)
                j += max(1, int((distance - nearest) / spacing))
        i += STRIDE
    return nearest


@leaf
def _is_clear(points, i, begin, enough, spacing):
    """True if point `i` is at least `enough` from all points from `begin` on, by what is gone from one to the next."""
    j = begin
    while j < points.shape[0]:
        distance = _distance(points, i, j)
        if not distance >= enough:
            return False
        j += max(1, int((distance - enough) / spacing))
    return True


@leaf
def _distance(points, i, j):
    """Distance between two of the `points (k, 3)`."""
    x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    return np.sqrt(x * x + y * y + z * z)
