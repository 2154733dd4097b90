"""How noisy a picture is, told by what no neighbour explains."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

EVERY = 3
"""Rows that are looked at, one of so many."""


def noise_of(grey: npt.NDArray[np.uint8]) -> float:
    """The standard deviation of a pixel from what is around it, grey levels, at least 0.5."""
    part = grey[::EVERY].astype(np.float32)
    bend = part[:, :-2] - 2.0 * part[:, 1:-1] + part[:, 2:]
    return max(0.5, float(1.4826 * np.median(np.abs(bend)) / np.sqrt(6.0)))
