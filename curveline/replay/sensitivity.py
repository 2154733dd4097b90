"""How much of an outcome's variance each input makes: first-order and total effects of Sobol', with their intervals.

Rows of a design by Saltelli (2010): inputs drawn once, `base`, drawn anew, `other`, and for each input the base with
that one as in the other. The outcome is a number, or an array whose variances are summed (Lamboni et al. 2011,
Reliab. Eng. Syst. Saf. 96): of a curve, what is told is how far its points move.

A. Saltelli et al. 2010, Variance based sensitivity analysis of model output, Comput. Phys. Commun. 181.
M. J. W. Jansen 1999, Analysis of variance designs for model output, Comput. Phys. Commun. 117.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.rod.problem import Array

REPLICATES = 1000
"""Of the bootstrap."""
BLOCKS = 2000
"""Rows that the bootstrap draws from; more are joined in blocks, whose means are drawn as well."""
CONFIDENCE = 0.95


class Terms(NamedTuple):
    """What each row of a design says of variances: their means over all rows are these.

    `variance (n,)` of the outcome; of each input `sobol (n, k)` and `jansen (n, k)`, two estimates of what it makes by
    itself, and `total (n, k)`, what is left if all others stay as they are.
    """

    variance: Array
    sobol: Array
    jansen: Array
    total: Array


class Estimates(NamedTuple):
    """A number for each input, and where the true ones lie with a confidence of `CONFIDENCE`."""

    value: Array  # (k,)
    low: Array  # (k,)
    high: Array  # (k,)


class Effects(NamedTuple):
    """Shares of the variance of an outcome: by each input alone, and with all that it does together with others."""

    variance: float  # of the outcome, in its unit squared
    first: Estimates  # of each input alone
    total: Estimates  # with all that it does together with others


def row_terms(base: Array, other: Array, mixed: Array, centre: Array | float) -> tuple[float, Array, Array, Array]:
    """The `Terms` of one row, from outcomes (d,), (d,) and (k, d); the nearer `centre` is to their mean the better.

    Two outcomes that share nothing differ by twice the variance; those that share one input, or all but that, by twice
    what that leaves of it (Jansen 1999). The product is that of Saltelli et al. 2010, table 2 (b).
    """
    variance = 0.5 * float(np.sum((base - other) ** 2))
    jansen = variance - 0.5 * np.sum((other - mixed) ** 2, axis=1)
    return variance, (mixed - base) @ (other - centre), jansen, 0.5 * np.sum((base - mixed) ** 2, axis=1)


def effects_of(terms: Terms, seed: int | tuple[int, ...] = 0) -> Effects | None:
    """First-order and total effects; None where the outcome does not vary. The bootstrap follows from `seed`."""
    variance = float(np.mean(terms.variance))
    if variance <= 0.0:
        return None
    first, rows = _joined(terms, variance), _blocks(terms.variance[:, None])
    tops = np.concatenate([_blocks(first), _blocks(terms.total)], axis=1)
    replicates = _replicates(np.concatenate([rows, tops], axis=1), seed)
    low, high = np.quantile(replicates, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE], axis=0)
    k = first.shape[1]
    value = np.mean(np.concatenate([first, terms.total], axis=1), axis=0) / variance
    return Effects(
        variance, Estimates(value[:k], low[:k], high[:k]), Estimates(value[k:], low[k:], high[k:])
    )  # fmt: skip


def _joined(terms: Terms, variance: float) -> Array:
    """Of both estimates of first-order effects the mixture (n, k) that scatters least.

    Their difference is nothing on average. The product scatters little for inputs that do little, the other for those
    that do much: so the difference serves as a control variate of the ratio to the variance.
    """
    difference = terms.jansen - terms.sobol
    share = np.mean(terms.sobol, axis=0) / variance
    ratio = terms.sobol - share * terms.variance[:, None]
    spread = np.mean((difference - difference.mean(axis=0)) ** 2, axis=0)
    together = np.mean((difference - difference.mean(axis=0)) * ratio, axis=0)
    weight = np.clip(-together / np.where(spread > 0.0, spread, 1.0), 0.0, 1.0)
    joined: Array = terms.sobol + weight * difference
    return joined


def _blocks(rows: Array) -> Array:
    """Means (b, ...) of neighbouring rows, in so many blocks of one size that no more than `BLOCKS` are left."""
    size = -(-len(rows) // BLOCKS)
    whole = len(rows) // size * size
    means: Array = rows[:whole].reshape(-1, size, rows.shape[1]).mean(axis=1)
    return means


def _replicates(rows: Array, seed: int | tuple[int, ...]) -> Array:
    """Ratios (REPLICATES, columns-1) of the means of all columns to that of the first, over rows drawn from `rows`."""
    source = np.random.default_rng(seed)
    ratios = np.empty((REPLICATES, rows.shape[1] - 1))
    for replicate in range(REPLICATES):
        counts = np.bincount(source.integers(0, len(rows), len(rows)), minlength=len(rows))
        sums = counts @ rows
        # A replicate of rows in which nothing varies says nothing of shares.
        ratios[replicate] = sums[1:] / sums[0] if sums[0] > 0.0 else 0.0
    return ratios
