"""The scene decides the model, a user may override it, and either way what was left out is said and never hidden."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curveline
from curveline.rod.spatial.lifting import lift
from curveline.rod.spatial.relax import is_stable
from curveline.rod.states.equilibrium import Equilibrium, Outcome
from curveline.scene import Load, Node, Scene
from curveline.sections import Rectangle
from curveline.simulation.simulate import SegmentStates, scene_rod, simulate
from curveline.units import deg, mm

SHAPES = Path(__file__).parents[2] / "shapes"
PLAIN = curveline.read_shape(SHAPES / "level-neutral-peak.toml")
SMALL = 1e-6


def with_rod(scene: Scene, **changes: Any) -> Scene:
    return replace(scene, display=replace(scene.display, rod=replace(scene.display.rod, **changes)))


def with_length(scene: Scene, length_mm: float) -> Scene:
    return replace(scene, segments=(replace(scene.segments[0], length=mm(length_mm)),))


NARROW = with_length(with_rod(PLAIN, section=Rectangle(mm(2.0), mm(2.4))), 850.0)
"""A rod that is narrower than thick, and long: both planar states are unstable out of the plane."""
PUSHED = replace(PLAIN, loads=(Load(0, 0.4, (0.0, -0.2), 0.3),))


def only(scene: Scene, **asked: Any) -> SegmentStates:
    (segment,) = simulate(scene, **asked)
    return segment


def apart(one: Equilibrium, other: Equilibrium) -> float:
    gap = np.linalg.norm(one.curve(101) - other.curve(101), axis=1)
    return float(np.max(np.hypot(gap, one.depth(101) - other.depth(101))))


def test_a_plain_scene_is_planar_and_says_why() -> None:
    segment = only(PLAIN)
    assert segment.model == "planar"
    assert segment.terms == ("bend", "gravity")
    assert set(segment.left_out) == {"stretch", "twist", "contact"}
    told = " ".join(segment.reasons)
    assert "by the planar model" in told
    assert "nothing points out of the plane" in told
    for name, bound in segment.left_out.items():
        (sentence,) = (each for each in segment.reasons if each.startswith(f"left out: {name}"))
        assert "mm" in sentence
        assert bound.why in sentence


def test_a_small_tolerance_asks_for_stretch() -> None:
    plain, fine = only(PLAIN), only(PLAIN, tolerance=SMALL)
    assert fine.model == "extensible"
    assert "stretch" in fine.terms
    assert "stretch" not in fine.left_out
    assert any("stretch might move" in sentence for sentence in fine.reasons)
    for one, other in zip(plain.states, fine.states, strict=True):
        assert other.model == "extensible"
        assert other.error <= SMALL < apart(one, other) <= plain.left_out["stretch"].bound
    # Just below the bound plus the error stretch counts, just above it does not.
    worst = max(state.error for state in plain.states) + plain.left_out["stretch"].bound
    assert only(PLAIN, tolerance=1.5 * worst).model == "planar"
    assert only(PLAIN, tolerance=0.5 * worst).model == "extensible"


@pytest.mark.parametrize(
    ("scene", "what"),
    [
        (PUSHED, "a load that points out of the plane"),
        (replace(PLAIN, nodes=(replace(PLAIN.nodes[0], yaw=deg(10.0)), PLAIN.nodes[1])), "the yaw of its clamps"),
        (replace(PLAIN, nodes=(replace(PLAIN.nodes[0], roll=deg(30.0)), PLAIN.nodes[1])), "the roll of its clamps"),
        (replace(PLAIN, display=replace(PLAIN.display, down=(0.6, -0.8, 0.0))), "gravity that does not point straight"),
        (replace(PLAIN, display=replace(PLAIN.display, down=(0.0, -0.8, 0.6))), "gravity that does not point straight"),
        (with_rod(PLAIN, lateral_curvature=0.3), "curvature out of the plane"),
    ],
    ids=["load", "yaw", "roll", "gravity along the row", "gravity out of the plane", "curvature"],
)
def test_what_a_plane_cannot_have_is_spatial_and_bounded_where_it_is_left_out(scene: Scene, what: str) -> None:
    free, flat = only(scene), only(scene, model="planar")
    assert (free.model, flat.model) == ("spatial", "planar")
    assert any(what in sentence for sentence in free.reasons)
    assert [state.name for state in free.states] == [state.name for state in flat.states] == ["peak", "valley"]
    assert [state.wanted for state in free.states] == [True, False]
    assert set(free.left_out) == {"contact"}
    truth = max(apart(one, other) for one, other in zip(free.states, flat.states, strict=True))
    assert 1e-4 < truth <= flat.left_out["twist"].bound <= 3.0 * truth
    assert any("more than the tolerance" in sentence and "twist" in sentence for sentence in flat.reasons)


def test_a_rod_that_leaves_its_plane_is_flagged_and_never_wanted() -> None:
    segment = only(NARROW)
    assert segment.model == "spatial"
    assert any("would not stay in the plane" in sentence for sentence in segment.reasons)
    assert segment.wanted is None
    assert [state.name for state in segment.states] == ["buckled-1"]
    (state,) = segment.states
    assert state.stable
    assert state.leaves_plane
    assert not state.simple
    assert float(np.max(np.abs(state.depth(101)))) > 0.1
    # Both planar states fall into this one, which is said.
    assert any("listed already" in sentence for sentence in segment.reasons)


@pytest.mark.parametrize("model", ["planar", "extensible"])
def test_an_override_is_obeyed_but_never_calls_stable_what_is_not(model: str) -> None:
    segment = only(NARROW, model=model)
    assert segment.model == model
    assert len(segment.states) == 2
    for state in segment.states:
        assert state.model == model
        assert not state.stable
        assert not state.wanted
        assert state.outcome is Outcome.BUCKLES
        assert "spatial model" in state.outcome.value
        assert state.name.startswith("buckled")
    (free,) = only(NARROW).states
    assert max(apart(state, free) for state in segment.states) <= segment.left_out["twist"].bound
    assert any("more than the tolerance" in sentence and "twist" in sentence for sentence in segment.reasons)


def test_no_state_is_called_stable_that_is_not_stable_in_space() -> None:
    """Random rods of any section, by both planar models: what is called stable is so in the other solver's eyes."""
    rng = np.random.default_rng(21)
    called = refused = 0
    for _ in range(12):
        nodes = tuple(Node(0.0, float(angle)) for angle in np.radians(rng.uniform(-40.0, 40.0, 2)))
        strip = Rectangle(mm(float(2.4 * 10.0 ** rng.uniform(-0.3, 0.4))), mm(2.4))
        scene = with_length(replace(with_rod(PLAIN, section=strip), nodes=nodes), float(rng.uniform(560.0, 900.0)))
        segment = scene_rod(scene, 0)
        for model in ("planar", "extensible"):
            for state in only(scene, model=model, windings=(0, 1)).states:
                called += state.stable
                refused += not state.stable
                assert is_stable(*lift(segment, state, 192)) or not state.stable
    assert min(called, refused) > 10


def test_what_stretch_takes_away_is_said() -> None:
    """A rod as thick as this would rather be shortened by its thrust than arch against its clamps."""
    upwards = replace(PLAIN, nodes=(Node(0.0, deg(2.0)), Node(0.0, deg(-2.0))))
    scene = with_length(with_rod(upwards, section=Rectangle(mm(300.0), mm(30.0))), 501.0)
    hard, soft = only(scene, model="planar"), only(scene)
    assert [state.name for state in hard.states] == ["peak", "valley"]
    assert hard.left_out["stretch"].bound > 0.02
    assert soft.model == "extensible"
    assert [state.name for state in soft.states] == ["peak"]
    assert any("valley is gone when the rod may stretch" in sentence for sentence in soft.reasons)


def test_a_weightless_display_bounds_its_weight_in_every_model() -> None:
    light = replace(PLAIN, display=replace(PLAIN.display, gravity=False))
    for model in ("planar", "extensible", "spatial"):
        segment, heavy = only(light, model=model), only(PLAIN, model=model)
        assert "gravity" not in segment.terms
        truth = max(apart(one, other) for one, other in zip(segment.states, heavy.states, strict=True))
        assert 1e-4 < truth <= segment.left_out["gravity"].bound <= 2.0 * truth


def test_states_in_space_go_by_their_heights_there() -> None:
    """Both clamps turned by half a turn, the rod stands on its head; by a quarter, it lies on its side."""
    left, right = PLAIN.nodes
    upright = only(PLAIN, model="spatial")
    turned = only(replace(PLAIN, nodes=(replace(left, roll=deg(180.0)), replace(right, roll=deg(180.0)))))
    assert [state.name for state in turned.states] == [state.name for state in upright.states] == ["peak", "valley"]
    assert [state.wanted for state in turned.states] == [True, False]
    for one, other in zip(upright.states, turned.states, strict=True):
        assert apart(one, other) <= one.error + other.error
    side = only(replace(PLAIN, nodes=(replace(left, yaw=deg(40.0)), replace(right, yaw=deg(40.0)))))
    heights = [state.mean_height for state in side.states]
    # A state and its twin are as high, up to their errors, on edges of their own: what ranks them then is how far in
    # front they are.
    assert heights == pytest.approx(sorted(heights, reverse=True), abs=max(state.error for state in side.states))
    for state in side.states if len(side.states) == 1 else ():
        assert state.name == ("peak" if state.mean_height > 0.0 else "valley")


def test_a_state_that_is_not_found_in_space_is_listed_as_lost() -> None:
    left, right = PLAIN.nodes
    wound = only(replace(PLAIN, nodes=(left, replace(right, roll=deg(3600.0)))))
    assert wound.wanted is None
    lost = [state for state in wound.states if not state.stable]
    assert lost
    assert all(state.name.startswith("lost-") and state.outcome is not Outcome.CONVERGED for state in lost)
    assert any("was not found in space" in sentence for sentence in wound.reasons)
