"""From first numbers to those that fit best: Gauss and Newton's steps, damped as Levenberg and Marquardt do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from curveline.calibrating.bent_rod import Bent
from curveline.calibrating.misfit import REST, Misfit, SeenSegment, misfit_at, weights_of, whitened
from curveline.calibrating.unknowns import Unknowns
from curveline.trial import Array

ITERATIONS = 40
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-10, 1e8
HARDER, EASIER = 5.0, 0.2
ROUNDS, LITTLE_CHANGE = 4, 0.1
"""In which it is looked how much of the distances no node makes; the part by which that may still change."""
LITTLE_GAIN = 1e-5
"""Part of the sum of squares by which a search ends."""


@dataclass(frozen=True, eq=False)
class SoughtNumbers:
    """What is fitted: what was seen, which numbers are free, and what is known of each by itself.

    `told (size,)` are its likely values, `sure (size,)` one over their variances. Curves are off by a `rest` [m] that
    no node makes.
    """

    unknowns: Unknowns
    seen: tuple[SeenSegment, ...]
    free: npt.NDArray[np.bool_]
    told: Array
    sure: Array
    rest: float = REST


@dataclass(frozen=True, eq=False)
class Fitted:
    """Numbers that fit best, with the misfit there."""

    sought: SoughtNumbers
    misfit: Misfit

    @property
    def numbers(self) -> Array:
        """The numbers, free and fixed."""
        return self.misfit.numbers


def fitted(sought: SoughtNumbers, numbers: Array, held: Sequence[Bent]) -> Fitted | None:
    """The best numbers near some, in states near those held; None if these have no states.

    What no node makes is taken to be as large as it turns out, so that a rod that the model does not fit is laid along
    its trials, and not bent like them.
    """
    found = _downhill(sought, numbers, held)
    for _ in range(ROUNDS):
        if found is None:
            return None
        white = whitened(found.misfit, found.misfit.whiteners(sought.rest))
        rest = max(REST, found.misfit.rest(weights_of(white)))
        if abs(rest / sought.rest - 1.0) < LITTLE_CHANGE:
            break
        sought = replace(sought, rest=rest)
        found = _downhill(sought, found.numbers, found.misfit.held)
    return found


def _downhill(sought: SoughtNumbers, numbers: Array, held: Sequence[Bent]) -> Fitted | None:
    here = misfit_at(sought.seen, numbers, held, sloped=True)
    if here is None:
        return None
    damping = FIRST_DAMPING
    for _ in range(ITERATIONS):
        whiteners = here.whiteners(sought.rest)
        counts = whiteners, weights_of(whitened(here, whiteners))
        square = _square(sought, here, counts)
        there, after = None, square
        while there is None and damping < MOST_DAMPING:
            trial = sought.unknowns.clipped(here.numbers + _step(sought, here, counts, damping))
            there = misfit_at(sought.seen, trial, here.held, sloped=False)
            after = square if there is None else _square(sought, there, counts)
            if not after < square:
                there, damping = None, damping * HARDER
        if there is None:
            break
        sloped = misfit_at(sought.seen, there.numbers, there.held, sloped=True)
        if sloped is None:
            break
        here, damping = sloped, max(EASIER * damping, LEAST_DAMPING)
        if square - after < LITTLE_GAIN * square:
            break
    return Fitted(sought, here)


def _square(sought: SoughtNumbers, misfit: Misfit, counts: tuple[Array, Array]) -> float:
    whiteners, weights = counts
    off = whitened(misfit, whiteners)
    return float(weights @ np.sum(off**2, axis=1) + sought.sure @ (misfit.numbers - sought.told) ** 2)


def information(sought: SoughtNumbers, misfit: Misfit) -> tuple[Array, Array]:
    """What each curve tells of the free numbers, (c, p, p), and half of the slopes of its squares, (c, p)."""
    whiteners = misfit.whiteners(sought.rest)
    return _told(sought, misfit, (whiteners, weights_of(whitened(misfit, whiteners))))


def _told(sought: SoughtNumbers, misfit: Misfit, counts: tuple[Array, Array]) -> tuple[Array, Array]:
    whiteners, weights = counts
    white = np.matmul(whiteners, misfit.slopes[:, :, sought.free])
    told = weights[:, None, None] * np.matmul(white.transpose(0, 2, 1), white)
    off = whitened(misfit, whiteners)
    return told, weights[:, None] * np.matmul(white.transpose(0, 2, 1), off[:, :, None])[:, :, 0]


def _step(sought: SoughtNumbers, misfit: Misfit, counts: tuple[Array, Array], damping: float) -> Array:
    """A damped step of the free numbers, 0 of the others."""
    told, rising = _told(sought, misfit, counts)
    sure = sought.sure[sought.free]
    matrix = told.sum(axis=0) + np.diag(sure)
    gradient = rising.sum(axis=0) + sure * (misfit.numbers - sought.told)[sought.free]
    matrix[np.diag_indices_from(matrix)] += damping * np.diag(matrix)
    step = np.zeros(misfit.numbers.size)
    step[sought.free] = -np.linalg.solve(matrix, gradient)
    return step
