"""From one row of nodes downhill to the nearest one: Gauss and Newton's steps, damped as Levenberg and Marquardt do.

What a limit is missed by counts as a further distance, more and more until it is met; numbers at the display's limits
stay there (Nocedal and Wright 2006, sections 10.3 and 17.1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curveline.fitting.row import MET, Array, FittedRow, HeldState, Wanted, lengths_of, limits_of, row_at, within

HOLDING_OFF = 0.05, 0.5, 5.0
"""What a limit that is missed by 1 counts for [m]: first, and where that does not do."""
ITERATIONS = 60
SMALL = 1e-7
"""Largest change of a number, in m or rad, that ends a search."""
NOTHING = 1e-9
"""By how much [m or rad] a number may be beyond a limit: floats are."""
LITTLE_GAIN = 1e-6
"""As a part of the mean square, by which it ends, too."""
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e6
CHANGES = 8
"""Of which limits a step would miss, until it is taken as it is."""
HARDER, EASIER = 6.0, 0.2
"""What damping is multiplied by after a step that did not lead downhill, and one that did."""


def descended(wanted: Wanted, numbers: Array, held: Sequence[HeldState]) -> FittedRow | None:
    """The row that steps downhill lead to from some numbers, and that meets the limits; None if none does."""
    row = row_at(wanted, within(wanted, numbers), held)
    for weight in HOLDING_OFF:
        if row is None:
            return None
        row = _downhill(wanted, row, weight)
        if float(row.asks.max()) <= MET:
            return row if _is_of_display(wanted, row.numbers) else None
    return None


def _is_of_display(wanted: Wanted, numbers: Array) -> bool:
    """True for numbers that a shape file of the display may have: straight segments may point where no node does."""
    limits, count = wanted.display.limits, wanted.nodes
    given = (
        (numbers[:count], limits.height),
        (numbers[count : 2 * count], limits.angle),
        (lengths_of(wanted, numbers), limits.length),
    )
    return all(limit.contains(value, NOTHING) for values, limit in given for value in values.tolist())


def _downhill(wanted: Wanted, row: FittedRow, weight: float) -> FittedRow:
    """Where steps downhill lead to, missed limits counting by their weight [m]."""
    damping, square = FIRST_DAMPING, _square(row, weight)
    for _ in range(ITERATIONS):
        there = within(wanted, row.numbers + _step(wanted, row, weight, damping))
        if float(np.max(np.abs(there - row.numbers))) < SMALL:
            break
        trial = row_at(wanted, there, row.held)
        if trial is None or not _square(trial, weight) < square:
            damping *= HARDER
            if damping > MOST_DAMPING:
                break
            continue
        before, row = square, trial
        square, damping = _square(row, weight), max(EASIER * damping, LEAST_DAMPING)
        if before - square < LITTLE_GAIN * before:
            break
    return row


def _square(row: FittedRow, weight: float) -> float:
    """The mean square distance, and what missed limits count for [m^2]."""
    missed = weight * np.maximum(row.asks, 0.0)
    return float(row.off @ row.off + missed @ missed)


def _step(wanted: Wanted, row: FittedRow, weight: float, damping: float) -> Array:
    """A damped step within the limits of the numbers, which counts the limits that it would miss."""
    matrix, gradient = row.curvature.copy(), row.gradient
    matrix[np.diag_indices_from(matrix)] += damping * (np.diag(matrix) + 1e-9)
    is_missed = row.asks > 0.0
    for _ in range(CHANGES):
        slopes, asks = weight * row.by_numbers[is_missed], weight * row.asks[is_missed]
        step = _bounded(wanted, row.numbers, matrix + slopes.T @ slopes, gradient + slopes.T @ asks)
        would_miss = row.asks + row.by_numbers @ step > 0.0
        if np.array_equal(would_miss, is_missed):
            break
        is_missed = would_miss
    return step


def _bounded(wanted: Wanted, numbers: Array, matrix: Array, gradient: Array) -> Array:
    """The step to where a gradient vanishes, within the limits of the numbers as they are; what has no room stays."""
    low, high = limits_of(wanted, numbers)
    step, free = np.zeros(numbers.size), low < high
    while np.any(free):
        held = matrix[np.ix_(free, ~free)] @ step[~free]
        step[free] = -np.linalg.solve(matrix[np.ix_(free, free)], gradient[free] + held)
        reached = np.clip(numbers + step, low, high) - numbers
        beyond = free & (np.abs(reached - step) > 1e-12)
        if not np.any(beyond):
            break
        step[beyond] = reached[beyond]
        free &= ~beyond
    return step
