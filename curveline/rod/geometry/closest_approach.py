"""Kernel that finds how near a curve comes to itself, fast where it does not come near."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix
from curveline.kernels.kernel import shipped


@shipped(Matrix, int, float)
def nearest_parts(points, apart, enough):
    """Smallest distance between `points (k, 3)` that are at least `apart` (an index distance) from each other.

    Distances from `enough` on do not matter: `enough` is returned. Along a curve no distance falls by more than what is
    gone along, so that most points are passed over.
    """
    k = points.shape[0]
    spacing = 0.0
    for i in range(k - 1):
        square = 0.0
        for axis in range(3):
            square += (points[i + 1, axis] - points[i, axis]) ** 2
        spacing = max(spacing, np.sqrt(square))
    nearest = enough
    for i in range(k - apart):
        j = i + apart
        while j < k:
            square = 0.0
            for axis in range(3):
                square += (points[j, axis] - points[i, axis]) ** 2
            distance = np.sqrt(square)
            nearest = min(nearest, distance)
            j += max(1, int((distance - nearest) / spacing))
    return nearest
