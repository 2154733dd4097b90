"""What is wrong with a synthetic photograph: three tiers of faults, drawn from a seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curveline.units import mm

CLEAN, LAB, HARD = TIERS = "clean", "lab", "hard"
"""A plain wall in even light; a laboratory; a bad picture of one."""


@dataclass(frozen=True)
class PictureFaults:
    """What is wrong with a photograph; grey levels are those of 255, sizes in the picture are in its pixels."""

    seed: int = 0  # of all that is drawn at random
    wall: float = 90.0  # grey level of what is behind the display
    contrast: float = 120.0  # grey levels of the rod over the wall, negative for a darker one
    blur: float = 0.8  # [px] standard deviation of what the lens smears
    noise: float = 1.0  # grey levels, standard deviation
    gradient: float = 0.0  # part of the light that is lost across the picture
    clutter: int = 0  # things on the wall
    shadow: float = 0.0  # part of the light that the rod takes from the wall
    occlusion: float = 0.0  # part of the rod that things before it hide
    quality: int = 95  # of the JPEG; 0 for a picture that was never one
    tag_error: float = 0.0  # [m] standard deviation of where tags really are


def faults_of(tier: str, seed: int) -> PictureFaults:
    """Faults of a tier as a seed has them."""
    source = np.random.default_rng([seed, 17])
    sign = -1.0 if source.uniform() < 0.4 else 1.0

    def between(low: float, high: float) -> float:
        return float(source.uniform(low, high))

    if tier == CLEAN:
        contrast = sign * between(90.0, 140.0)
        wall = between(60.0, 100.0) if sign > 0.0 else between(170.0, 210.0)
        return PictureFaults(seed, wall, contrast, between(0.6, 1.1), between(0.5, 1.5))
    if tier == LAB:
        contrast = sign * between(50.0, 110.0)
        wall = between(50.0, 110.0) if sign > 0.0 else between(140.0, 200.0)
        return PictureFaults(
            seed, wall, contrast, between(0.7, 1.6), between(2.0, 5.0), between(0.1, 0.5),
            clutter=int(source.integers(8, 25)), shadow=between(0.0, 0.3), quality=int(source.integers(80, 93)),
            tag_error=mm(0.15),
        )  # fmt: skip
    contrast = sign * between(18.0, 45.0)
    wall = between(70.0, 140.0) if sign > 0.0 else between(110.0, 180.0)
    return PictureFaults(
        seed, wall, contrast, between(1.5, 3.5), between(4.0, 8.0), between(0.2, 0.6),
        clutter=int(source.integers(15, 40)), shadow=between(0.1, 0.4), occlusion=between(0.0, 0.25),
        quality=int(source.integers(60, 85)), tag_error=mm(0.2),
    )  # fmt: skip
