"""A display as it is in truth: what its file says, with what was drawn of the errors that it may have."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curveline.replay.kept_curvature import with_kept
from curveline.rod.problem import Array
from curveline.scene import Display, DisplayErrors, Profile, Rod

SHARES = ("stiffness", "mass", "clamp_stiffness", "clamp_play", "clamp", "friction", "set_share")
"""Of which errors one share is drawn, in this order; of `span` there is one for each gap. New ones come after them."""


class RealDisplay(NamedTuple):
    """What the nodes of a run stand on, and the rod in it."""

    gaps: tuple[Display, ...]  # of each segment, left to right: all alike but for the span
    friction: float  # [m]


def real_display(
    display: Display, errors: DisplayErrors, shares: Array, gaps: Array, kept: Profile | None = None
) -> RealDisplay:
    """What a `display` is where `shares (len(SHARES),)` and those of its `gaps (segments,)` say how far into a range.

    `kept` is the curvature of which its rod may keep a part. A share of clamp stiffness is one of the compliance: a
    bearing that hardly gives is as rigid as one that does not.
    """
    ranges = errors.given
    if not ranges:
        return RealDisplay((display,) * gaps.size, 0.0)
    drawn = {
        name: ranges[name].at(share)
        for name, share in zip(SHARES, shares.tolist(), strict=True)
        if name in ranges and name != "clamp_stiffness"
    }
    rod = _real_rod(display.rod, 1.0 + drawn.get("stiffness", 0.0), 1.0 + drawn.get("mass", 0.0))
    real = replace(
        display,
        rod=with_kept(rod, kept, drawn["set_share"]) if kept is not None and drawn.get("set_share") else rod,
        clamp=drawn.get("clamp", display.clamp),
        clamp_play=drawn.get("clamp_play", display.clamp_play),
        clamp_stiffness=_clamp_stiffness(display, errors, float(shares[SHARES.index("clamp_stiffness")])),
    )
    wider = [errors.span.at(share) if errors.span else 0.0 for share in gaps.tolist()]
    return RealDisplay(tuple(replace(real, span=real.span + by) for by in wider), drawn.get("friction", 0.0))


def _real_rod(rod: Rod, stiffness: float, mass: float) -> Rod:
    """The rod with all its stiffnesses times one number, and its mass times another."""
    return replace(
        rod,
        youngs_modulus=rod.youngs_modulus * stiffness,
        shear_modulus=rod.shear_modulus * stiffness,
        mass_per_length=rod.mass_per_length * mass,
    )


def _clamp_stiffness(display: Display, errors: DisplayErrors, share: float) -> float:
    if errors.clamp_stiffness is None:
        return display.clamp_stiffness
    stiffest, softest = 1.0 / errors.clamp_stiffness.high, 1.0 / errors.clamp_stiffness.low
    compliance = stiffest + share * (softest - stiffest)
    return 1.0 / compliance if compliance > 0.0 else math.inf


def held_back(feeds: Array, friction: float) -> Array:
    """Where the rod in each node is, (poses, nodes) [m], that motors feed so far: it lags by up to `friction` [m].

    The pinion winds up, or goes through its play, until the rod slides; back it goes through twice of that. At the
    start the rod is where the motor is. That is the play operator (Krasnosel'skii and Pokrovskii 1989, Systems with
    Hysteresis).
    """
    if friction == 0.0:
        return feeds
    lagging, least, most = feeds.copy(), feeds - friction, feeds + friction
    for place in range(1, len(feeds)):
        lagging[place] = np.minimum(np.maximum(lagging[place - 1], least[place]), most[place])
    return lagging
