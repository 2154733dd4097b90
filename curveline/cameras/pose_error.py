"""How exact the place of a camera is, and with it all positions that its picture gives.

Two things move a corner of a tag: the noise of pixels, each corner by itself, and where the tag was glued, all four
corners of it together. The second is told by how the tags disagree, and usually matters more.
"""

from __future__ import annotations

import numpy as np

from curveline.cameras.tag_fit import LEAST_NOISE, Placed, corners_of, moved, offsets, slopes
from curveline.cameras.view import Array, Frame, View
from curveline.units import mm

GLUED = mm(0.15)
OF_SO_MANY = 2
"""How exactly tags are placed before anything is seen of them, and how many observations that is worth."""
_SMALL = 1e-6


def covariance_of(placed: Placed, frame: Frame) -> Array:
    """Covariance (6, 6) of a turn [rad] and a shift [m] of what the camera sees."""
    shifts = np.array([offsets(placed.view, each, frame).mean(axis=0) for each in placed.tags])
    freedom = max(0, shifts.size - 6)
    glued = (np.square(shifts).sum() + OF_SO_MANY * GLUED**2) / (freedom + OF_SO_MANY)
    covariance = placed.covariance.copy()
    for each in placed.tags:
        corners = corners_of(each.tag, frame)
        seen = slopes(placed.view, corners)
        pairs = [(corners + step, corners - step) for step in _SMALL * np.eye(3)[:2]]
        by_shift = np.column_stack([np.ravel(placed.view.pixels(a) - placed.view.pixels(b)) for a, b in pairs])
        by_shift /= 2.0 * _SMALL
        turned = placed.covariance @ seen.T @ by_shift / max(each.noise, LEAST_NOISE) ** 2
        covariance += glued * turned @ turned.T
    return covariance


def errors_at(view: View, covariance: Array, points: Array) -> Array:
    """Standard errors (n,) [m], along x or y, of positions `points (n, 2)` [m] in the plane of the rod's middle."""
    pixels = view.pixels(np.column_stack([points, np.zeros(len(points))]))
    change = np.stack(
        [
            (moved(view, step).in_plane(pixels) - moved(view, -step).in_plane(pixels)) / (2.0 * _SMALL)
            for step in _SMALL * np.eye(6)
        ],
        axis=-1,
    )
    errors: Array = np.sqrt(np.einsum("nik,kl,nil->n", change, covariance, change) / 2.0)
    return errors
