"""Quintic Hermite interpolation: meets values, slopes and second derivatives at both ends of an interval."""

from __future__ import annotations

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import njit, shipped


@njit
def weights(t):
    """Weights at the fraction `t` of a unit interval: of both values, both slopes, both second derivatives.

    On an interval of length h the slopes are multiplied by h, the second derivatives by h^2.
    """
    t3 = t * t * t
    late = t3 * (10.0 - 15.0 * t + 6.0 * t * t)
    return (
        1.0 - late,
        late,
        t - t3 * (6.0 - 8.0 * t + 3.0 * t * t),
        -t3 * (4.0 - 7.0 * t + 3.0 * t * t),
        0.5 * t * t - t3 * (1.5 - 1.5 * t + 0.5 * t * t),
        t3 * (0.5 - t + 0.5 * t * t),
    )


@shipped(Matrix, Vector)
def integral(rows, edges):
    """Integral of what has the values, slopes and second derivatives `rows (m+1, 3)` at the ends of `edges (m,)`.

    That of the quintics between them, which is of sixth order in the edges: on each h/2 of the sum of both values,
    h^2/10 of the difference of the slopes, h^3/120 of the sum of the second derivatives.
    """
    total = 0.0
    for j in range(edges.size):
        h, here, there = edges[j], rows[j], rows[j + 1]
        total += 0.5 * h * (here[0] + there[0])
        total += h * h / 10.0 * (here[1] - there[1]) + h * h * h / 120.0 * (here[2] + there[2])
    return total


@shipped(Matrix, Vector, Vector, Matrix)
def interpolate(table, edges, places, out):
    """Positions `out (k, 3)` at the sorted arc lengths `places (k,)`, from vertices `table (m+1, 9)` on `edges (m,)`.

    The table holds position, its slope and its second derivative by the arc length.
    """
    j = 0
    begin = 0.0
    for i in range(places.size):
        while j < edges.size - 1 and places[i] > begin + edges[j]:
            begin += edges[j]
            j += 1
        h = edges[j]
        share = weights(min(max((places[i] - begin) / h, 0.0), 1.0))
        for axis in range(3):
            total = 0.0
            for end in range(2):
                row = table[j + end]
                total += share[end] * row[axis] + share[2 + end] * h * row[3 + axis]
                total += share[4 + end] * h * h * row[6 + axis]
            out[i, axis] = total
