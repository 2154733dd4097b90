"""How sharp a straight edge between black and white is in a picture."""

from __future__ import annotations

import numpy as np

from curveline.cameras.view import Array, Grey

STEP = 0.25
"""[px] between samples across an edge."""
LEAST_CONTRAST = 12.0
"""[grey levels] between black and white, below which an edge is none."""
LEAST_REACH = 1.5
MOST_REACH = 24.0
"""[px] to look on either side of an edge."""
OF_LENGTH = 0.1
"""Of an edge between two squares, to look on either side: markers begin behind that."""
OF_A_BLUR = 0.7978845608
"""Area between a step and the same step blurred by a Gaussian, in standard deviations: sqrt(2 / pi)."""
TEN_TO_NINETY = 2.563
"""From a tenth to nine tenths of a blurred step, in standard deviations."""


def edge_between(grey: Grey, begin: Array, end: Array) -> float | None:
    """Width [px] of the edge between black and white along a line, from a tenth to nine tenths of its contrast.

    Black may be on either side. None where there is no edge, or one that is too short to be looked at.
    """
    along = end - begin
    length = float(np.hypot(*along))
    reach = min(OF_LENGTH * length, MOST_REACH)
    if reach < LEAST_REACH:
        return None
    across = np.arange(-reach, reach + STEP / 2.0, STEP)
    places = begin + np.linspace(0.1, 0.9, max(8, int(length)))[:, None] * along
    beside = np.array([along[1], -along[0]]) / length
    profile = _sampled(grey, places[:, None, :] + across[None, :, None] * beside).mean(axis=0)
    ends = max(2, len(across) // 6)
    first, last = float(profile[:ends].mean()), float(profile[-ends:].mean())
    if abs(last - first) < LEAST_CONTRAST:
        return None
    # Rising from 0 to 1; what is beside a step of the same area is blur, and noise has no say in that.
    shares = (profile - first) / (last - first)
    where = across[-1] - STEP * (float(shares.sum()) - 0.5)
    area = STEP * float(np.where(across > where, 1.0 - shares, shares).sum())
    return max(0.0, TEN_TO_NINETY * area / OF_A_BLUR)


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
