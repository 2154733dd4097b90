"""Which state is this: whether two states are one curve, and what the states of a rod are called.

A name says on which side of the others, or of the straight line, a curve lies; it hangs on no rounding. Where heights
over the chord differ by no more than they are known to, neither of the curves is the higher one: both are "middle".
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curveline.rod.equilibrium import Equilibrium

PEAK = "peak"
VALLEY = "valley"
MIDDLE = "middle"

SAME_CURVE = 1e-5
"""Curves that are nearer to each other than this part of the length, beside their errors, are one: the next ones that a
search tells apart, at its coarsest, are a hundred times as far away."""
CLEARLY = 0.01
"""Difference of mean heights over the length that no error in these explains: they are sums over 48 edges or more."""
LEVEL = 1e-6
"""Mean height over the length, beside its error, that does not tell one side of a rod from the other: what a change of
a billionth in any number of a scene makes of it, a hundred times over, and more near a fold."""
POINTS = 33
"""Of a curve, to compare it by."""


def same_curve(one: Equilibrium, other: Equilibrium) -> bool:
    """True if two states of one rod are one curve; most differ so much in their mean heights that these tell."""
    near = SAME_CURVE * one.rod.length + one.error + other.error
    if one.winding != other.winding:
        return False
    if abs(one.mean_height - other.mean_height) > near + CLEARLY * one.rod.length:
        return False
    gap = np.linalg.norm(one.curve(POINTS) - other.curve(POINTS), axis=1)
    if one.space is not None or other.space is not None:
        gap = np.hypot(gap, one.depth(POINTS) - other.depth(POINTS))
    return bool(np.max(gap) < near)


def named(states: Sequence[Equilibrium]) -> list[Equilibrium]:
    """The states with their names: of those that can be shown the highest is the peak, the lowest the valley.

    A single one goes by its side. States that cannot be shown come last, by what keeps them from it.
    """
    shown = _by_height([state for state in states if state.simple])
    others = sorted((state for state in states if not state.simple), key=lambda state: -state.mean_height)
    names = _sides(shown)
    for state in others:
        kind = "loop" if state.winding else "crossing" if state.crosses_itself else "wrapped"
        names.append(f"{kind}-{1 + sum(name.startswith(kind) for name in names)}")
    return [state.but(name=name) for state, name in zip([*shown, *others], names, strict=True)]


def _sides(shown: Sequence[Equilibrium]) -> list[str]:
    """Names of states, the highest first."""
    names = [""] * len(shown)
    if len(shown) == 1 and abs(shown[0].mean_height) > _doubt(shown[0]):
        names = [PEAK if shown[0].mean_height > 0.0 else VALLEY]
    elif len(shown) > 1:
        names[0] = "" if _tied(*shown[:2]) else PEAK
        names[-1] = "" if _tied(*shown[-2:]) else VALLEY
    middle = 0
    for place, name in enumerate(names):
        if not name:
            middle += 1
            names[place] = f"{MIDDLE}-{middle}"
    return names


def _by_height(states: Sequence[Equilibrium]) -> list[Equilibrium]:
    """The highest first; of those that are as high, the one that leans to the left."""
    ordered = sorted(states, key=lambda state: -state.mean_height)
    begin = 0
    for end in range(1, len(ordered) + 1):
        if end == len(ordered) or not _tied(ordered[end - 1], ordered[end]):
            ordered[begin:end] = sorted(ordered[begin:end], key=_lean) if end - begin > 1 else ordered[begin:end]
            begin = end
    return ordered


def _tied(higher: Equilibrium, lower: Equilibrium) -> bool:
    """True if nothing tells which of two states is the higher one."""
    return higher.mean_height - lower.mean_height <= _doubt(higher) + _doubt(lower)


def _doubt(state: Equilibrium) -> float:
    """How far the mean height of a state may be off [m]."""
    return state.error + LEVEL * state.rod.length


def _lean(state: Equilibrium) -> float:
    """How much more of the area over its chord a curve has on its right than on its left [m]."""
    x, y = state.curve(POINTS).T
    height = (state.rod.chord[0] * y - state.rod.chord[1] * x) / np.hypot(*state.rod.chord)
    return float(np.mean(height * np.linspace(-1.0, 1.0, POINTS)))
