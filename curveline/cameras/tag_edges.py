"""How sharp a straight edge between black and white is in a picture."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from curveline.cameras.view import Array

Grey = npt.NDArray[np.uint8]

MODULES = 8
"""Squares along an edge of a tag of the family 36h11: six of its pattern and the black border on both sides."""
PIECES = 8
"""Into which an edge is cut: each is averaged along itself, and tells one point."""
STEP = 0.25
"""[px] between samples across an edge."""
LEAST_CONTRAST = 12.0
"""[grey levels] between black and white, below which an edge is none."""
LEAST_REACH = 2.0
MOST_REACH = 24.0
"""[px] to look on either side of an edge, within the black square of a border and the white one outside."""
OF_A_BLUR = 0.7978845608
"""Area between a step and the same step blurred by a Gaussian, in standard deviations: sqrt(2 / pi)."""
TEN_TO_NINETY = 2.563
"""From a tenth to nine tenths of a blurred step, in standard deviations."""


def edge_between(grey: Grey, begin: Array, end: Array) -> float | None:
    """Width [px] of the edge between black and white along a line, from a tenth to nine tenths of its contrast.

    Black may be on either side; what is farther from the line than a tenth of its length is not looked at. None where
    there is no edge.
    """
    reach = 0.1 * float(np.hypot(*(end - begin)))
    found = _points_on(grey, begin, end, reach) or _points_on(grey, end, begin, reach)
    return None if found is None else found[1]


def _points_on(grey: Grey, begin: Array, end: Array, reach: float) -> tuple[Array, float] | None:
    """Points (n, 2) [px] on the edge between two corners, and its width [px]; None where there is no edge."""
    along = end - begin
    length = float(np.hypot(*along))
    module = length / MODULES
    reach = min(max(reach, LEAST_REACH), MOST_REACH, 0.75 * module)
    if module < LEAST_REACH:
        return None
    outwards = np.array([along[1], -along[0]]) / length
    across = np.arange(-reach, reach + STEP / 2.0, STEP)
    each = max(2, int(0.85 * length / PIECES))
    places = np.linspace(0.09, 0.91, PIECES * each)
    at = begin + places[:, None] * along
    sampled = _sampled(grey, at[:, None, :] + across[None, :, None] * outwards)
    profiles = sampled.reshape(PIECES, each, -1).mean(axis=1)
    ends = max(2, len(across) // 6)
    dark, light = profiles[:, :ends].mean(axis=1), profiles[:, -ends:].mean(axis=1)
    if (light - dark).min() < LEAST_CONTRAST:
        return None
    shares = (profiles - dark[:, None]) / (light - dark)[:, None]
    where = across[-1] - STEP * (shares.sum(axis=1) - 0.5)  # what is dark up to there has the same area as all of it
    if np.abs(where).max() > 0.8 * reach:
        return None
    points = at.reshape(PIECES, each, 2).mean(axis=1) + where[:, None] * outwards
    return points, _width(shares, across, where)


def _sampled(grey: Grey, at: Array) -> Array:
    """Grey levels (...) at places (..., 2) [px] between pixels; OpenCV would round these to a thirty-second."""
    rows, columns = grey.shape
    x, y = np.clip(at[..., 0], 0.0, columns - 1.001), np.clip(at[..., 1], 0.0, rows - 1.001)
    left, top = x.astype(int), y.astype(int)
    right, low = x - left, y - top
    upper = grey[top, left] * (1.0 - right) + grey[top, left + 1] * right
    lower = grey[top + 1, left] * (1.0 - right) + grey[top + 1, left + 1] * right
    levels: Array = upper * (1.0 - low) + lower * low
    return levels


def _width(shares: Array, across: Array, where: Array) -> float:
    """From a tenth of an edge to nine tenths of it [px], by its area beside a step: noise has no say in that."""
    beyond = across[None, :] > where[:, None]
    area = STEP * np.where(beyond, 1.0 - shares, shares).sum(axis=1)
    return max(0.0, TEN_TO_NINETY * float(np.median(area)) / OF_A_BLUR)
