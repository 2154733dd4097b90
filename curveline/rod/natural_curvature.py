"""The natural curvature of a rod as a function of its material, for rods that are not bent alike all along when free.

The material is counted by its arc length from the rod's left end, so that the function is carried along as nodes feed:

    bent = NaturalCurvature(places, values)     # [m], [1/m]: a smooth curve through these points
    bent.table                                  # what kernels take: `Bearing.profile`
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curveline.errors import InvalidInput
from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import shipped
from curveline.rod.problem import Array
from curveline.rod.profile import expanded, interval_at

MOST_PLACES = 100_000
LEAST_APART = 1e-12
"""Of two places [m]: a cubic between nearer ones is lost in rounding, or has slopes that are no numbers."""
MOST = 1e9
"""Curvature [1/m] beyond which no rod is bent, whatever it has taken for a set besides."""


@dataclass(frozen=True, eq=False)
class NaturalCurvature:
    """Curvature (k,) [1/m] of the free rod in the plane at `places (k,)` [m] along its material, k at least 1.

    Between the places it is the cubic that does not overshoot (Fritsch and Butland 1984), once differentiable; beyond
    them it stays as it is at the last one. Raises InvalidInput for places that do not rise, and for what is no number.
    """

    places: Array
    values: Array

    def __post_init__(self) -> None:
        places, values = (np.array(each, dtype=np.float64) for each in (self.places, self.values))
        if places.ndim != 1 or places.shape != values.shape or not 1 <= places.size <= MOST_PLACES:
            raise InvalidInput(
                f"a natural curvature needs one value at each of 1 to {MOST_PLACES} places",
                hint=f"there are arrays of {places.shape} and {values.shape}",
            )
        if not (np.all(np.isfinite(places)) and np.all(np.abs(values) <= MOST)):
            raise InvalidInput("a place or a natural curvature is not a number, or too large", "give them in m and 1/m")
        if np.any(np.diff(places) < LEAST_APART):
            late = int(np.argmax(np.diff(places) < LEAST_APART)) + 1
            raise InvalidInput(
                f"place {late + 1} of a natural curvature, {places[late]:g} m, is not beyond the one before it",
                hint="sort the places; for a step give two that are a little apart",
            )
        places.flags.writeable = values.flags.writeable = False
        object.__setattr__(self, "places", places)
        object.__setattr__(self, "values", values)

    @property
    def table(self) -> Array:
        """For kernels, (k, 3): place [m], curvature [1/m], its slope [1/m^2]; see `rod.profile`."""
        return np.column_stack([self.places, self.values, slopes_of(self.places, self.values)])

    def __call__(self, places: Array) -> Array:
        """The curvature at any `places (m,)` [m]: (m,) [1/m]."""
        return np.asarray(curvatures_at(self.table, np.ascontiguousarray(places, dtype=np.float64)))


def slopes_of(places: Array, values: Array) -> Array:
    """Slopes (k,) with which cubics through `values (k,)` at `places (k,)` do not overshoot.

    Inside the harmonic mean of the neighbouring ones, weighted by the gaps; none at an extreme and at both ends.
    """
    slopes = np.zeros(values.size)
    gaps = np.diff(places)
    rates = np.diff(values) / gaps
    one, other = rates[:-1], rates[1:]
    share = (gaps[:-1] + 2.0 * gaps[1:]) / (3.0 * (gaps[:-1] + gaps[1:]))
    under = (1.0 - share) * one + share * other
    monotone = one * other > 0.0
    slopes[1:-1][monotone] = one[monotone] * other[monotone] / under[monotone]
    return slopes


@shipped(Matrix, Vector)
def curvatures_at(profile, places):
    """Curvatures (m,) of a `profile (k, 3)` at `places (m,)`."""
    out = np.empty(places.size)
    for i in range(places.size):
        out[i] = expanded(profile, interval_at(profile, places[i], 0), places[i])[0]
    return out
