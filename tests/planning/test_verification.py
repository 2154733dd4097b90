"""A step that passed its proof holds for every mixture of uneven progress, not only for those that were followed."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from curveline.planning.layout import Box, Layout, centred, pose_of
from curveline.planning.moves import DisplayState, Leg, Travel, advance
from curveline.planning.verification import LEAST_STABILITY, STIFFEST, Passed, Refused, Verifier
from curveline.rod.branches.continuation import coarse_start, follow
from curveline.rod.branches.control_path import between, straight_path
from curveline.rod.branches.quasi_static import pass_through
from curveline.rod.branches.tracking import tracked
from curveline.rod.problem import Pose
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states
from curveline.scene import Node
from curveline.shapes.files import read_display
from curveline.units import deg

from .boxes import box_between, mixed, uneven_way

SINGLE = read_display("single")
SPAN = SINGLE.span
MOVES = 60
WAYS = 6
"""Uneven ways through the box of each move."""
SAME = 0.02
"""Edges of the same state turn by no more than this [rad] from a coarse rod to a fine one."""
SHORTFALL = 0.02
"""An inner mixture may be so much nearer to losing its stability than what was followed, in units of `STIFFEST`."""


def nobody() -> None:
    pass


@cache
def verifier() -> Verifier:
    return Verifier(SINGLE, nobody)


def drawn(chance: np.random.Generator) -> tuple[Pose, Pose, Equilibrium] | None:
    """A move of height, angles and length, each of which may stay, and a state to begin in; None for a bad draw."""
    height, start, end = chance.uniform([-0.15, -1.0, -1.0], [0.15, 1.0, 1.0])
    before = Pose(SPAN, height, start, end, math.hypot(SPAN, height) + chance.uniform(0.03, 0.25))
    change = chance.uniform(-1.0, 1.0, 4) * [0.1, 0.5, 0.5, 0.12] * (chance.random(4) < 0.75)
    numbers = np.round([SPAN, *(np.array(before[1:5]) + change)], 9)
    before, after = Pose(*(round(each, 9) for each in before)), Pose(*numbers.tolist())
    if any(pose.length < 1.02 * math.hypot(*verifier().rod(pose).free_chord) + 0.02 for pose in (before, after)):
        return None
    states = [state for state in verifier().states(before) if state.max_curvature < SINGLE.rod.max_curvature]
    return (before, after, states[int(chance.integers(len(states)))]) if states else None


def state_at(pose: Pose, angles: np.ndarray) -> Equilibrium:
    """The state of the rod, found afresh, that has these angles."""
    states = find_states(verifier().rod(pose), 1e-5)
    return min(states, key=lambda state: float(np.max(np.abs(coarse_start(state)[0] - angles))))


def check(chance: np.random.Generator, move: tuple[Pose, Pose, Equilibrium], passed: Passed) -> None:
    """Go through the box on an uneven way and look on it where nothing was followed."""
    before, after, state = move
    assert passed.hold is not None
    inside = np.array(before[:5]) + chance.random(5) * np.subtract(after[:5], before[:5])
    inner = Pose(*inside.tolist())
    angles, forces = coarse_start(state)
    way = uneven_way(chance, before, inner)
    done, angles, forces, _ = pass_through(way, verifier().bearing, angles, forces)
    assert done == len(way) - 1
    met = state_at(inner, angles)
    assert np.max(np.abs(coarse_start(met)[0] - angles)) < SAME
    margin = met.lowest_eigenvalue / STIFFEST
    assert margin > max(passed.margin, LEAST_STABILITY) - SHORTFALL
    assert met.max_curvature < 1.05 * passed.clamp_loads.curvature + 0.1
    way = uneven_way(chance, inner, after)
    done, angles, forces, _ = pass_through(way, verifier().bearing, angles, forces)
    assert done == len(way) - 1
    assert np.max(np.abs(angles - passed.hold.angles)) < SAME


def test_what_passed_is_never_contradicted_by_any_mixture() -> None:
    chance = np.random.default_rng(20)
    passed = refused = 0
    while passed + refused < MOVES:
        move = drawn(chance)
        if move is None:
            continue
        before, after, state = move
        try:
            found = verifier().keep(before, after, box_between(before, after), tracked(state))
        except Refused:
            refused += 1
            continue
        if found.clamp_loads.curvature > SINGLE.rod.max_curvature:
            continue
        passed += 1
        for _ in range(WAYS):
            check(chance, move, found)
    assert passed > 0.7 * MOVES
    assert refused > 2


# While the right node turns first and the left one follows, before any rod is drawn in, this valley loses its
# stability, though it is at home in every corner and on the straight ways to them.
NARROW = Pose(0.5, 0.114292079, -1.025563604, -0.9648204, 0.67854821)
NARROWED = Pose(0.5, 0.114292079, -0.039023107, -0.716716723, 0.581545982)


def lowest_on(before: Pose, after: Pose, state: Equilibrium) -> float:
    branch = follow(straight_path(before, after), verifier().bearing, *coarse_start(state))
    assert branch.reached == 1.0
    return float(branch.lowest.min()) / STIFFEST


def test_a_box_whose_corners_all_pass_can_be_too_narrow_between_them() -> None:
    box = box_between(NARROW, NARROWED)
    (valley,) = verifier().states(NARROW)
    assert min(lowest_on(NARROW, corner, valley) for corner in (*box.corners(), NARROWED)) > LEAST_STABILITY
    tilted = NARROW._replace(end=NARROWED.end)
    turned = follow(straight_path(NARROW, tilted), verifier().bearing, *coarse_start(valley))
    assert turned.reached == 1.0
    assert (
        follow(
            straight_path(tilted, NARROWED._replace(length=NARROW.length)),
            verifier().bearing,
            turned.phi,
            turned.multipliers,
        ).reached
        < 1.0
    )
    with pytest.raises(Refused, match="the state loses its stability at") as caught:
        verifier().keep(NARROW, NARROWED, box, tracked(valley))
    assert not caught.value.is_final


def layout_for(pose: Pose) -> Layout:
    """A lone segment with this pose: the left node stays at height 0."""
    return centred(SINGLE, [Node(0.0, pose.start), Node(pose.y, pose.end)], [pose.length])


def axis_by_axis(before: Layout, after: Layout, order: np.ndarray) -> list[Layout]:
    """The layouts on the way if the six axes of two nodes move one after the other, in 12 parts each."""
    shares = np.zeros(6)
    way = []
    for axis in order:
        for part in range(12):
            shares[axis] = (part + 1) / 12
            way.append(mixed(before, after, shares.reshape(2, 3)))
    return way


def played(stage: DisplayState, after: Layout, order: np.ndarray) -> np.ndarray | None:
    """Angles in which the rod ends if one axis moves after the other; None if it loses its state."""
    (hold,) = stage.holds
    assert hold is not None
    layouts = [stage.layout, *axis_by_axis(stage.layout, after, order)]
    poses = np.array([pose_of(SINGLE, each, 0) for each in layouts])
    done, angles, *_ = pass_through(poses, verifier().bearing, hold.angles, hold.multipliers)
    return np.asarray(angles) if done == len(poses) - 1 else None


def one_that_only_keeps_in_step() -> tuple[DisplayState, Layout]:
    """The first drawn move that keeps its state if all axes go in step, and does not if they do not."""
    chance = np.random.default_rng(3)
    while True:
        move = drawn(chance)
        if move is None:
            continue
        before, after, state = move
        hold = tracked(state)
        try:
            verifier().keep(before, after, Box(before, before), hold)
        except Refused:
            continue
        try:
            verifier().keep(before, after, box_between(before, after), hold)
        except Refused as refusal:
            if "loses its stability" in refusal.message and not refusal.is_final:
                return DisplayState(layout_for(before), (hold,)), layout_for(after)


def test_a_step_that_only_nodes_in_step_survive_is_cut_until_any_do() -> None:
    begin, goal = one_that_only_keeps_in_step()
    chance = np.random.default_rng(4)
    orders = [chance.permutation(6) for _ in range(24)]
    assert any(played(begin, goal, order) is None for order in orders)
    travel = advance(verifier(), Travel((), begin), Leg("move", goal))
    assert len(travel.moves) > 1
    assert travel.moves[-1].end == goal
    before = begin.layout
    stage = begin
    for move in travel.moves:
        assert move.margin >= LEAST_STABILITY
        after = advance(verifier(), Travel((), stage), Leg("move", move.end, halvings=0)).stage
        (hold,) = after.holds
        assert hold is not None
        for order in orders:
            angles = played(stage, move.end, order)
            assert angles is not None
            assert np.max(np.abs(angles - hold.angles)) < SAME
        stage, before = after, move.end
    assert before == goal


@pytest.mark.parametrize("spare", [4e-4, 1e-4, 0.0])
def test_a_rod_without_any_to_spare_is_pulled_taut_between_clamps_out_of_line(spare: float) -> None:
    for angle in (0.1, -0.5):
        pose = Pose(SPAN, 0.0, angle, angle, SPAN)
        chord = math.hypot(*verifier().rod(pose).free_chord)
        pose = pose._replace(length=chord * (1.0 + spare) + SINGLE.clamp)
        with pytest.raises(Refused, match="pulled taut"):
            verifier().weigh(pose)
        # With some to spare what is asked is known, and far beyond the motors for the larger angle.
        slack = verifier().weigh(pose._replace(length=chord * 1.0006 + SINGLE.clamp))
        assert -slack.low[0] > SINGLE.drive.max_force
    level = Pose(SPAN, 0.0, 0.0, deg(1.0), SPAN * (1.0 + spare))
    assert np.all(verifier().weigh(level).high == -math.inf)


def test_ways_that_end_in_different_states_are_refused_though_all_are_stable() -> None:
    # Beyond the cusp where peak and valley become one: which node turns back first decides what it is afterwards.
    before, after = Pose(SPAN, 0.0, 0.926, 0.737, 0.552), Pose(SPAN, 0.069, -0.012, -0.123, 0.649)
    (state,) = verifier().states(before)
    with pytest.raises(Refused, match=r"uneven progress by way of .* would end in another state") as caught:
        verifier().keep(before, after, box_between(before, after), tracked(state))
    assert not caught.value.is_final


def test_a_way_that_ends_just_before_a_fold_is_refused_with_its_margin() -> None:
    level = Pose(SPAN, 0.0, 0.0, 0.0, 0.56)
    peak = verifier().states(level)[0]
    tilted = level._replace(start=-0.9, end=0.5)
    gone = follow(straight_path(level, tilted), verifier().bearing, *coarse_start(peak, 768)).reached
    assert 0.0 < gone < 1.0
    for share, is_kept in ((0.8, True), (0.9995, False)):
        there = between(level, tilted, share * gone)
        if is_kept:
            margin = verifier().keep(level, there, Box(level, level), tracked(peak)).margin
            assert margin > LEAST_STABILITY
            continue
        with pytest.raises(Refused, match=r"the state comes within 0\.0[0-4]\d of losing stability"):
            verifier().keep(level, there, Box(level, level), tracked(peak))
