"""How far numbers that were fitted may be off: from how much shapes disagree, not points.

All that is seen of a shape errs together: its points by what its nodes do, its trials by what the model lacks there.
So the fit without each shape in turn, to first order, tells how far it may be off (the cluster jackknife, or CR3: Bell
and McCaffrey 2002), with the degrees of freedom that such a variance has if distances are as they are taken to be
(Satterthwaite).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curveline.calibrating.descent import Fitted, information
from curveline.material.drum_fit import T_975
from curveline.trial import Array


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Of the free numbers (p,): `covariance (p, p)` grouped by shape, `reach (p,)` how far they may be off at 95 %.

    `matrix (p, p)` is what is told of them, one over a covariance if distances are as they are taken to be.
    """

    covariance: Array
    reach: Array
    freedom: Array
    matrix: Array


def uncertainty_of(fit: Fitted) -> Uncertainty:
    """The uncertainty of a fit of at least two shapes."""
    told, rising = information(fit.sought, fit.misfit)
    shapes = np.unique(fit.misfit.shapes)
    by_shape = np.array([told[fit.misfit.shapes == shape].sum(axis=0) for shape in shapes])
    slopes = np.array([rising[fit.misfit.shapes == shape].sum(axis=0) for shape in shapes])
    sure = np.diag(fit.sought.sure[fit.sought.free])
    matrix = by_shape.sum(axis=0) + sure
    whole = np.linalg.inv(matrix)
    without = np.linalg.inv(matrix - by_shape)
    steps = np.einsum("gpq,gq->gp", without, slopes)
    share = (len(shapes) - 1.0) / len(shapes)
    grouped = share * steps.T @ steps
    covariance = grouped + whole @ sure @ whole
    freedom = _freedom(by_shape, whole, without)
    own = np.diag(whole @ sure @ whole)
    grouped_own = np.diag(grouped)
    # What is known of a number by itself has as many degrees of freedom as one likes.
    freedom = freedom * ((grouped_own + own) / np.maximum(grouped_own, 1e-300)) ** 2
    reach = np.array([_quantile(each) for each in freedom]) * np.sqrt(np.diag(covariance))
    return Uncertainty(covariance, reach, freedom, matrix)


def _freedom(by_shape: Array, whole: Array, without: Array) -> Array:
    """Degrees of freedom (p,) of the variance of each number."""
    count, size = by_shape.shape[:2]
    out = np.empty(size)
    for number in range(size):
        directions = without[:, :, number]
        moved = np.einsum("gpq,gq->gp", by_shape, directions)
        spread = -moved @ whole @ moved.T
        spread[np.diag_indices(count)] += np.einsum("gp,gp->g", moved, directions)
        out[number] = np.trace(spread) ** 2 / np.sum(spread**2)
    return out


def _quantile(freedom: float) -> float:
    """Student's t for 95 %, either way."""
    places = np.arange(1.0, len(T_975) + 1.0)
    if freedom >= places[-1]:
        return 1.96 + 2.7 / float(freedom)
    return float(np.interp(1.0 / max(freedom, 1.0), 1.0 / places[::-1], T_975[::-1]))
