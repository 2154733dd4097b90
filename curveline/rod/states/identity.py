"""Which state is this: whether two states are one curve, and what the states of a rod are called.

A name says on which side of the others, or of the straight line, a curve lies; it hangs on no rounding. Where heights
over the chord differ by no more than they are known to, neither of the curves is the higher one: both are "middle".

In space a curve may lie outside the display's plane: as seen along the chord its mean is then farther from the plane
than `ASIDE` times from the chord. It is in "front" of the plane or at its "back", and no peak or valley whatever its
height. That is an angle of 63.4 deg: where clamps rolled by 45 or 90 deg, or by any whole number of degrees, turn a
curve about its chord, they do not leave it on this border.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from curveline.rod.states.equilibrium import Equilibrium, Outcome
from curveline.rod.states.refined import CLEARLY, LEVEL, SAME_CURVE

PEAK = "peak"
VALLEY = "valley"
MIDDLE = "middle"
FRONT = "front"
BACK = "back"
STRAIGHT = "straight"
"""Names of states that a display can show; all but the first two and the last have a number."""

LOOP = "loop"
CROSSING = "crossing"
WRAPPED = "wrapped"
BUCKLED = "buckled"
LOST = "lost"
"""Names of states that cannot be shown: tangled in three ways, not stable in their plane, and gone in space."""
GONE = (Outcome.LOST, Outcome.UNREACHED, Outcome.UNSTABLE, Outcome.UNWOUND)

ASIDE = 2.0
"""Mean distance from the display's plane over that from the chord, from which on a curve lies outside the plane."""
ALIKE = 5e-3
"""Curves of one state by two models of a rod, one of which lets it stretch, differ by less than this part of the
length, those of two states by more, except just before a fold."""
POINTS = 33
"""Of a curve, to compare it by."""
MOMENTS = 8
"""Of a curve, that states are put in order by."""


def same_curve(one: Equilibrium, other: Equilibrium) -> bool:
    """True if two states of one rod are one curve; most differ so much in their mean heights that these tell."""
    return _agree(one, other, 1.0)


def are_twins(one: Equilibrium, other: Equilibrium) -> bool:
    """True if two states of one rod are each other's reflection in the display's plane."""
    return _agree(one, other, -1.0)


def called(state: Equilibrium, others: Sequence[Equilibrium]) -> str:
    """The name of the one of `others` that is `state` by another model of the rod; that of `state` alone if none is."""
    gaps = [float(np.max(np.abs(other.curve(POINTS) - state.curve(POINTS)))) for other in others]
    if gaps and min(gaps) < ALIKE * state.rod.length:
        return others[gaps.index(min(gaps))].name
    return named([state])[0].name


def as_straight(states: Sequence[Equilibrium]) -> list[Equilibrium]:
    """The states of a rod that `slack.is_straight`: the only one that is not tangled by that name, if it is stable.

    Where there are several, it may lie either way, and none of them is.
    """
    untangled = [state for state in states if state.is_untangled]
    if len(untangled) != 1 or not (untangled[0].stable and untangled[0].simple):
        return list(states)
    return [state.but(name=STRAIGHT) if state is untangled[0] else state for state in states]


def _agree(one: Equilibrium, other: Equilibrium, side: float) -> bool:
    """True if two states agree where the depth of the other one counts `side` times."""
    near = SAME_CURVE * one.rod.length + one.error + other.error
    if one.winding != other.winding:
        return False
    if abs(one.mean_height - other.mean_height) > near + CLEARLY * one.rod.length:
        return False
    gap = np.linalg.norm(one.curve(POINTS) - other.curve(POINTS), axis=1)
    if one.space is not None or other.space is not None:
        gap = np.hypot(gap, one.depth(POINTS) - side * other.depth(POINTS))
    return bool(np.max(gap) < near)


def named(states: Sequence[Equilibrium]) -> list[Equilibrium]:
    """The states with their names, in the order in which they are listed: see `placed`."""
    return [states[number].but(name=name) for number, name in placed(states)]


def placed(states: Sequence[Equilibrium], beside: Sequence[Equilibrium] = ()) -> list[tuple[int, str]]:
    """Numbers of the states in the order in which they are listed, and their names.

    Of those that can be shown the highest is the peak, the lowest the valley; a single one goes by its side. A planar
    state that leaves its plane is none of them, but counts among them, as do those `beside` that have no place in the
    list: the others keep the names that they have in the plane. What cannot be shown comes last, by what keeps it.
    """
    ranked = _ordered([state for state in (*states, *beside) if _counts(state)])
    others = _ordered([state for state in states if not _counts(state)])
    sides = [*_sides(ranked), *("" for _ in others)]
    places = {id(state): number for number, state in enumerate(states)}
    numbers: Counter[str] = Counter()
    out = []
    for state, side in zip([*ranked, *others], sides, strict=True):
        name = _hindrance(state) or side
        if name not in (PEAK, VALLEY) and id(state) in places:
            numbers[name] += 1
            name = f"{name}-{numbers[name]}"
        out.append((places.get(id(state), -1), name))
    return [each for each in out if each[0] >= 0]


def _counts(state: Equilibrium) -> bool:
    """True if a state is one of those that names compare."""
    return _hindrance(state) in ("", BUCKLED) and (state.space is None or not state.leaves_plane)


def _hindrance(state: Equilibrium) -> str:
    """What keeps a state from being shown, in the word that its name has; empty if nothing does."""
    if state.outcome in GONE:
        return LOST
    if not state.is_untangled:
        return LOOP if state.winding else CROSSING if state.crosses_itself else WRAPPED
    return BUCKLED if state.leaves_plane else ""


def _sides(ranked: Sequence[Equilibrium]) -> list[str]:
    """On which side states lie, the highest of them first."""
    names = [_aside(state) for state in ranked]
    level = [place for place, name in enumerate(names) if not name]
    states = [ranked[place] for place in level]
    for place in level:
        names[place] = MIDDLE
    if len(level) == 1 and abs(states[0].mean_height) > _doubt(states[0]):
        names[level[0]] = PEAK if states[0].mean_height > 0.0 else VALLEY
    elif len(level) > 1:
        names[level[0]] = MIDDLE if _tied(*states[:2]) else PEAK
        names[level[-1]] = MIDDLE if _tied(*states[-2:]) else VALLEY
    return names


def _aside(state: Equilibrium) -> str:
    """In front of the display's plane or at its back; empty for a curve that does not lie outside it."""
    depth = state.space.mean_depth if state.space is not None else 0.0
    if abs(depth) <= max(ASIDE * abs(state.mean_height), _doubt(state)):
        return ""
    return FRONT if depth > 0.0 else BACK


def _ordered(states: Sequence[Equilibrium], moment: int = 0) -> list[Equilibrium]:
    """The highest first; of those that are as high, the foremost; then the one that leans to the left, and so on.

    States that agree in one `_moment` are told apart by the next, so that rounding does not put them in order.
    """
    if len(states) < 2 or moment == MOMENTS:
        return list(states)
    moments = sorted(((_moment(state, moment), state) for state in states), key=lambda pair: -pair[0])
    groups = [[moments[0][1]]]
    for (above, before), (below, state) in pairwise(moments):
        if above - below > _doubt(before) + _doubt(state):
            groups.append([])
        groups[-1].append(state)
    return [state for group in groups for state in _ordered(group, moment + 1)]


def _tied(higher: Equilibrium, lower: Equilibrium) -> bool:
    """True if nothing tells which of two states is the higher one."""
    return higher.mean_height - lower.mean_height <= _doubt(higher) + _doubt(lower)


def _doubt(state: Equilibrium) -> float:
    """How far the mean height of a state may be off [m]."""
    return state.error + LEVEL * state.rod.length


def _moment(state: Equilibrium, moment: int) -> float:
    """Mean of the height over the chord (even) or of the depth (odd) times a Legendre polynomial, rising [m]."""
    degree, is_depth = divmod(moment, 2)
    if is_depth and state.space is None:
        return 0.0
    if degree == 0:
        return state.space.mean_depth if is_depth and state.space is not None else state.mean_height
    x, y = state.curve(POINTS).T
    height = (state.rod.chord[0] * y - state.rod.chord[1] * x) / max(math.hypot(*state.rod.chord), 1e-300)
    weight = np.polynomial.Legendre.basis(degree)(np.linspace(1.0, -1.0, POINTS))
    return float(np.mean((state.depth(POINTS) if is_depth else height) * weight))
