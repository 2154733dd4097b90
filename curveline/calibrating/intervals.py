"""How far numbers that were fitted may be off: from how much shapes disagree, not points.

All that is seen of a shape errs together: its points by what its nodes do, its trials by what the model lacks there.
So the fit without each shape in turn, to first order, tells how far it may be off (the cluster jackknife, or CR3: Bell
and McCaffrey 2002), with the degrees of freedom that such a variance has if distances are as they are taken to be
(Satterthwaite).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curveline.calibrating.descent import Fitted, information
from curveline.material.drum_fit import T_975
from curveline.trial import Array


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Of the free numbers (p,): `covariance (p, p)` grouped by shape, `reach (p,)` how far they may be off at 95 %.

    `by_shape (g, p, p)` is what each shape tells of them, `sure (p, p)` what is known of each by itself: together one
    over a covariance if distances are as they are taken to be.
    """

    covariance: Array
    reach: Array
    by_shape: Array
    sure: Array

    @property
    def matrix(self) -> Array:
        """All of what is told, (p, p)."""
        return np.asarray(self.by_shape.sum(axis=0) + self.sure)


def uncertainty_of(fit: Fitted) -> Uncertainty:
    """The uncertainty of a fit of at least two shapes."""
    told, rising = information(fit.sought, fit.misfit)
    shapes = np.unique(fit.misfit.shapes)
    by_shape = np.array([told[fit.misfit.shapes == shape].sum(axis=0) for shape in shapes])
    slopes = np.array([rising[fit.misfit.shapes == shape].sum(axis=0) for shape in shapes])
    sure = np.diag(fit.sought.sure[fit.sought.free])
    known = _Known.of(by_shape, sure)
    steps = np.einsum("gpq,gq->gp", known.without, slopes)
    covariance = known.share * steps.T @ steps + known.given
    reach = known.quantiles(np.diag(known.share * steps.T @ steps)) * np.sqrt(np.diag(covariance))
    return Uncertainty(covariance, reach, by_shape, sure)


def expected_reach(by_shape: Array, sure: Array) -> Array:
    """How far numbers (p,) would be off at 95 % if distances are as they are taken to be.

    It takes what each shape tells of them, (g, p, p), and what is known of them by themselves, (p, p).
    """
    known = _Known.of(by_shape, sure)
    grouped = known.share * np.array([np.trace(spread) for spread in known.spreads])
    return np.asarray(known.quantiles(grouped) * np.sqrt(grouped + np.diag(known.given)))


class _Known(NamedTuple):
    """What shapes tell: covariances `without (g, p, p)` each shape, if distances are as they are taken to be.

    The `share` is that of squared steps in a jackknife's variance. `given (p, p)` is what is known of numbers by
    themselves, as a part of the covariance; `spreads (p, g, g)` are covariances of the steps that shapes make.
    """

    share: float
    without: Array
    given: Array
    spreads: Array

    @classmethod
    def of(cls, by_shape: Array, sure: Array) -> _Known:
        count, size = by_shape.shape[:2]
        matrix = by_shape.sum(axis=0) + sure
        whole = np.linalg.inv(matrix)
        without = np.linalg.inv(matrix - by_shape)
        spreads = np.empty((size, count, count))
        for number in range(size):
            directions = without[:, :, number]
            moved = np.einsum("gpq,gq->gp", by_shape, directions)
            spreads[number] = -moved @ whole @ moved.T
            spreads[number][np.diag_indices(count)] += np.einsum("gp,gp->g", moved, directions)
        return cls((count - 1.0) / count, without, whole @ sure @ whole, spreads)

    def quantiles(self, grouped: Array) -> Array:
        """Student's t (p,) of the variances: of what shapes tell, `grouped (p,)`, and of what is known besides.

        What is known of a number by itself has as many degrees of freedom as one likes.
        """
        freedom = np.array([np.trace(spread) ** 2 / np.sum(spread**2) for spread in self.spreads])
        freedom *= (1.0 + np.diag(self.given) / np.maximum(grouped, 1e-300)) ** 2
        return np.array([_quantile(each) for each in freedom])


def _quantile(freedom: float) -> float:
    """Student's t for 95 %, either way."""
    places = np.arange(1.0, len(T_975) + 1.0)
    if freedom >= places[-1]:
        return 1.96 + 2.7 / float(freedom)
    return float(np.interp(1.0 / max(freedom, 1.0), 1.0 / places[::-1], T_975[::-1]))
