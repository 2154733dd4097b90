"""What a rod remembers of the shapes that it was held in: a bend for every term of its law, all along it.

Places are material arc length [m] from the left end of the rod. A bend is the curvature away from that of the rod as it
was made [1/m]. Each step is exact for a bend that stays the same, or a rod that is free, so that 8 h and twice 4 h are
the same to rounding. Bends out of the display's plane leave no set in this model.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from curveline.errors import InvalidInput
from curveline.material.relaxation import Relaxation
from curveline.units import mm, to_mm

Array = npt.NDArray[np.float64]
Piece = tuple[npt.ArrayLike, npt.ArrayLike]
"""Places (k,) [m] along a piece of rod between two bearings, rising, and its angles (k,) [rad] there."""

SPACING = mm(5.0)
"""Of the places at which a rod remembers."""
MOST_PLACES = 100_000
MOST_BEND = 1e6
"""Bend [1/m] beyond which no display file's rod is curved."""


@dataclass(frozen=True, eq=False)
class RodMemory:
    """The memory of a rod: `bends (terms, places)` [1/m], at places that divide its length evenly, ends included.

    Nothing changes it: what a rod goes through gives another one.
    """

    law: Relaxation  # by which it takes a set
    total_length: float  # [m]
    bends: Array

    def __post_init__(self) -> None:
        bends = np.asarray(self.bends, dtype=np.float64)
        if bends.ndim != 2 or bends.shape[0] != len(self.law.times) or not 2 <= bends.shape[1] <= MOST_PLACES:
            raise InvalidInput(
                f"a rod of {len(self.law.times)} terms has no memory of the shape {bends.shape}",
                f"give a row for every term, with 2 to {MOST_PLACES} places",
            )
        if not np.all(np.abs(bends) <= MOST_BEND):
            raise InvalidInput("a bend that is remembered is no number, or too large", "give all of them in 1/m")
        _check_length(self.total_length)
        object.__setattr__(self, "bends", bends)

    @classmethod
    def new(cls, law: Relaxation, total_length: float, spacing: float = SPACING) -> RodMemory:
        """The memory of a rod that was never bent, at places `spacing` [m] apart, or a little less."""
        _check_length(total_length)
        if not (spacing > 0.0 and total_length / spacing <= MOST_PLACES - 2):
            hint = f"give a distance above 0 that cuts the rod into at most {MOST_PLACES - 2} pieces"
            raise InvalidInput(f"a rod does not remember every {to_mm(spacing):g} mm", hint)
        # Rounding must not make a further place of a length that is a multiple.
        places = max(math.ceil(total_length / spacing - 1e-9), 1) + 1
        return cls(law, total_length, np.zeros((len(law.times), places)))

    @property
    def places(self) -> Array:
        """Where it remembers (places,) [m]."""
        return np.linspace(0.0, self.total_length, self.bends.shape[1])

    @property
    def set_curvature(self) -> Array:
        """The set now (places,) [1/m]: what to add to the natural curvature of the rod as it was made."""
        return np.asarray(self.law.fractions) @ self.bends

    def held(self, bend: npt.ArrayLike, seconds: float, temperature: float | None = None) -> RodMemory:
        """After so long in a shape that bends the rod by `bend` (places,), or a number; see `mean_bends`.

        InvalidInput for a time, a temperature [C] or a bend that makes no sense.
        """
        return self.bent(bend, bend, seconds, temperature)

    def bent(
        self, start: npt.ArrayLike, end: npt.ArrayLike, seconds: float, temperature: float | None = None
    ) -> RodMemory:
        """After so long in which its bend changed evenly from `start` to `end`, each (places,) or a number.

        Exact for that. InvalidInput as for `held`.
        """
        first, last = self._bend(start), self._bend(end)
        ages = self.law.reduced(seconds, temperature) / np.asarray(self.law.times)
        gone = -np.expm1(-ages)[:, None]
        # Of a bend that grows evenly, what the memory lags behind: it has followed all of it when that took long.
        followed = 1.0 - gone / np.where(ages > 0.0, ages, 1.0)[:, None]
        return replace(self, bends=self.bends + gone * (first - self.bends) + followed * (last - first))

    def straight(self, seconds: float, temperature: float | None = None) -> RodMemory:
        """After so long in which it was held straight, as at home, and was straight when it was made."""
        return self.held(0.0, seconds, temperature)

    def free(self, seconds: float, temperature: float | None = None) -> RodMemory:
        """After so long in which nothing held it: no moment, so that its bend is its set, which fades."""
        return replace(self, bends=fading(self.law, self.law.reduced(seconds, temperature)) @ self.bends)

    def within(self, begin: float, end: float) -> Array:
        """How much of what each place stands for lies from `begin` to `end` [m]: (places,), from 0 to 1."""
        edges = self._edges
        overlap = np.minimum(edges[1:], end) - np.maximum(edges[:-1], begin)
        return np.asarray(np.maximum(overlap, 0.0) / np.diff(edges))

    @property
    def _edges(self) -> Array:
        """Half way from each place to its neighbours, (places+1,) [m], and the ends of the rod."""
        places = self.places
        return np.concatenate((places[:1], 0.5 * (places[1:] + places[:-1]), places[-1:]))

    def _bend(self, bend: npt.ArrayLike) -> Array:
        given = np.asarray(bend, dtype=np.float64)
        if given.ndim > 1 or (given.ndim == 1 and given.size != self.bends.shape[1]):
            raise InvalidInput(f"{given.size} bends for {self.bends.shape[1]} places", "give one for every place")
        if not np.all(np.abs(given) <= MOST_BEND):
            raise InvalidInput("a bend is no number, or too large", "give all of them in 1/m")
        return given

    def mean_bends(self, pieces: Iterable[Piece], natural: npt.ArrayLike = 0.0) -> Array:
        """Bends (places,) of a rod of which some pieces are held in curves, and the rest straight, as in bearings.

        Means over what lies half way to the neighbouring places, so that the angle between two pieces of straight rod
        is kept, wherever bearings are. `natural` [1/m], a number or (places,), is the curvature of the rod as it was
        made. Angles between the places of a piece are interpolated linearly: give many. InvalidInput for a piece that
        makes no sense.
        """
        edges = self._edges
        turned = np.zeros(edges.size)
        for piece in pieces:
            turned += np.interp(edges, *_checked(piece))
        return np.asarray(np.diff(turned) / np.diff(edges) - np.asarray(natural))


def fading(law: Relaxation, seconds: float) -> Array:
    """What `seconds` at the reference temperature make of the memories of a free rod: a matrix (terms, terms).

    Of d m_k / dt = (sum_j f_j m_j - m_k) / t_k. In units of 1 / sqrt(f_k t_k) its matrix is symmetric, with negative
    eigenvalues, so that the exponential is exact.
    """
    times, fractions = np.asarray(law.times), np.asarray(law.fractions)
    root = np.sqrt(fractions / times)
    rates, vectors = np.linalg.eigh(np.outer(root, root) - np.diag(1.0 / times))
    unit = np.sqrt(fractions * times)
    decayed: Array = (vectors * np.exp(rates * seconds)) @ vectors.T
    return np.asarray(decayed * unit[None, :] / unit[:, None])


def arc_height(places: Array, curvature: Array, chord: float) -> float:
    """How far [m] a free rod of such a curvature (places,) [1/m] lies at most from a chord of so much of its length.

    Of all pieces as long as `chord` [m] the worst; of the whole rod if it is shorter. Each as a flat curve, so that the
    height is too large for a rod that is not nearly straight.
    """
    angle = np.concatenate(([0.0], np.cumsum(0.5 * np.diff(places) * (curvature[1:] + curvature[:-1]))))
    height = np.concatenate(([0.0], np.cumsum(0.5 * np.diff(places) * (angle[1:] + angle[:-1]))))
    count = max(1, min(int(np.searchsorted(places, chord * (1.0 - 1e-9))), places.size - 1))
    worst = 0.0
    for first in range(places.size - count):
        piece = height[first : first + count + 1]
        worst = max(worst, float(np.max(np.abs(piece - np.linspace(piece[0], piece[-1], count + 1)))))
    return worst


def seconds_until_flat(memory: RodMemory, height: float, chord: float, temperature: float | None = None) -> float:
    """How long [s] a rod must be held straight until, free, it lies within `height` [m] of any chord [m]; to 1 %.

    infinite if it takes longer than the slowest term of its law tells of. 0 if it lies so now.
    """

    def is_flat(seconds: float) -> bool:
        left = memory.straight(seconds, temperature).set_curvature
        return arc_height(memory.places, left, chord) <= height

    if is_flat(0.0):
        return 0.0
    early, late = 1e-3, 10.0 * memory.law.times[-1]
    if not is_flat(late):
        return math.inf
    while late > 1.01 * early:
        middle = math.sqrt(early * late)
        early, late = (early, middle) if is_flat(middle) else (middle, late)
    return late


def _checked(piece: Piece) -> tuple[Array, Array]:
    places, angles = (np.asarray(each, dtype=np.float64) for each in piece)
    if places.ndim != 1 or places.shape != angles.shape or places.size < 2 or not np.all(np.diff(places) > 0.0):
        raise InvalidInput("a piece of rod needs an angle at each of some rising places", "give two places or more")
    if not (np.all(np.isfinite(places)) and np.all(np.isfinite(angles))):
        raise InvalidInput("a place or an angle of a piece of rod is no number", "give all of them in m and rad")
    return places, angles


def _check_length(length: float) -> None:
    if not 0.0 < length < 1e9:
        raise InvalidInput(f"no rod is {length:g} m long", "give its length in m")
