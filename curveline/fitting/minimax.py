"""From a row whose mean distance is small to one whose largest distance is: a sequence of linear programmes.

In each the distances and the limits are straight lines in the numbers, which may change by no more than a trust that
shrinks where that misleads (Madsen 1975, J. Inst. Maths Applics 16).
"""

from __future__ import annotations

import numpy as np

from curveline.fitting.row import MET, Array, FittedRow, Wanted, limits_of, parts_of, row_at, within

FIRST_TRUST, LEAST_TRUST, MOST_TRUST = 0.05, 2e-6, 0.3
"""By how much numbers may change in a step, in m, rad and roots of the excess."""
SHRINKS, GROWS = 0.35, 2.0
GOOD = 0.6
"""Part of a predicted gain that makes the trust grow."""
STEPS = 40
LITTLE_GAIN = 1e-4
"""As a part of the largest distance, by which a search ends."""
COUNTS = 5.0
"""What a limit that is missed by 1 counts for [m]."""


def flattened(wanted: Wanted, row: FittedRow) -> FittedRow:
    """The row that steps lead to from one, with a smaller largest distance, or itself; limits are kept."""
    trust, worth = FIRST_TRUST, _worth(wanted, row)
    for _ in range(STEPS):
        step, promised = _programme(wanted, row, trust)
        if worth - promised < LITTLE_GAIN * worth or trust < LEAST_TRUST:
            break
        trial = row_at(wanted, within(wanted, row.numbers + step), row.held)
        gained = worth - _worth(wanted, trial) if trial is not None else -1.0
        if trial is None or gained <= 0.0:
            trust *= SHRINKS
            continue
        if gained > GOOD * (worth - promised):
            trust = min(GROWS * trust, MOST_TRUST)
        row, worth = trial, worth - gained
    return row


def largest_off(wanted: Wanted, row: FittedRow) -> float:
    """The largest distance of a row [m]."""
    return float(np.max(np.abs(row.off) / parts_of(wanted)))


def _worth(wanted: Wanted, row: FittedRow) -> float:
    """The largest distance, and what the most missed limit counts for [m]."""
    return largest_off(wanted, row) + COUNTS * max(float(row.asks.max()) - 0.5 * MET, 0.0)


def _programme(wanted: Wanted, row: FittedRow, trust: float) -> tuple[Array, float]:
    """The step to where the largest distance is smallest, were all straight; and what it would come to there [m]."""
    # Not at the top: it takes a tenth of a second to import, which most fits do without.
    from scipy.optimize import linprog

    part = parts_of(wanted)
    off, slopes, count = row.off / part, row.slopes() / part[:, None], row.numbers.size
    largest, missed = np.ones((off.size, 1)), np.ones((row.asks.size, 1))
    matrix = np.vstack(
        [
            np.hstack([slopes, -largest, 0.0 * largest]),
            np.hstack([-slopes, -largest, 0.0 * largest]),
            np.hstack([row.by_numbers, 0.0 * missed, -missed]),
        ]
    )
    right = np.concatenate([-off, off, 0.5 * MET - row.asks])
    low, high = limits_of(wanted, row.numbers)
    low, high = np.maximum(low - row.numbers, -trust), np.minimum(high - row.numbers, trust)
    ends = [*zip(np.minimum(low, 0.0), np.maximum(high, 0.0), strict=True), (0.0, None), (0.0, None)]
    found = linprog(np.concatenate([np.zeros(count), [1.0, COUNTS]]), A_ub=matrix, b_ub=right, bounds=ends)
    if found.x is None:
        return np.zeros(count), np.inf
    return found.x[:count], float(found.fun)
