"""The loads of a shape count: what they ask of rod and motors, the margin under them, how near they are to a snap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curveline.errors import Infeasible
from curveline.loading.pushes import Push
from curveline.loading.snap_through import load
from curveline.planning.feasibility import RESERVE, check_goal
from curveline.planning.tours import make_plan
from curveline.planning.verification import Verifier
from curveline.scene import Load, Node, Scene, Segment
from curveline.shapes.files import read_display
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm

SINGLE = read_display("single")


def shape(*loads: Load, state: str = "valley", angle: float = -40.0) -> Scene:
    """Nodes tilted against each other by 40 deg, 660 mm of rod between them."""
    nodes = (Node(0.0, deg(angle)), Node(0.0, deg(-angle)))
    return Scene("shape", SINGLE, nodes, (Segment(mm(660.0), state),), loads)


def down(newton: float) -> Load:
    return Load(0, 0.5, (0.0, -newton))


def strong(scene: Scene) -> Scene:
    """The same on a display whose rod and motors bear anything."""
    display = scene.display
    drive = replace(display.drive, max_force=1e3, max_moment=1e2)
    return replace(scene, display=replace(display, rod=replace(display.rod, max_strain=0.2), drive=drive))


def test_the_strain_of_the_reproduction() -> None:
    """Fault 10: under 60 N the strain is 3.5 %, and the rod bears 3; the radius of 34 mm is that strain."""
    with pytest.raises(Infeasible, match="under its loads: in segment 1 the rod would bend to a radius of 34 mm, its"):
        make_plan(shape(down(60.0)))


def test_the_motors_of_the_reproduction() -> None:
    """With a rod that bears the strain, each clamp holds 30 N up, more along the rod, and the motors give 8."""
    display = replace(SINGLE, rod=replace(SINGLE.rod, max_strain=0.05))
    with pytest.raises(Infeasible, match=r"under its loads: .* takes [34]\d\.\d N, the motor gives 8\.0 N"):
        make_plan(replace(shape(down(60.0)), display=display))


def test_what_loads_ask_is_what_the_loaded_state_asks() -> None:
    """Against the state that is found afresh with the loads on it."""
    scene = shape(down(3.0), Load(0, 0.3, (0.4, -0.5)))
    burden = check_goal(Verifier(SINGLE, lambda: None), scene)
    (segment,) = simulate(scene)
    assert burden is not None
    assert segment.wanted is not None
    assert burden.load.curvature == pytest.approx(segment.wanted.max_curvature, rel=5e-3)
    assert burden.lowest <= 1.01 * segment.wanted.lowest_eigenvalue
    up = float(np.max(np.abs(segment.wanted.clamp_force[:, 1])))
    assert burden.load.force > 0.98 * up


@pytest.mark.parametrize(("share", "is_borne"), [(0.99 / RESERVE, True), (1.01 / RESERVE, False), (0.995, False)])
def test_loads_are_borne_up_to_four_fifths_of_what_snaps_the_shape_through(share: float, is_borne: bool) -> None:
    """The snap-through load is that of `load`, which finds it in another way."""
    bare = strong(shape(state="peak", angle=5.0))
    snap = load(bare, Push(most=60.0)).snap
    assert snap is not None
    laden = replace(bare, loads=(down(share * snap.force),))
    if is_borne:
        assert make_plan(laden).steps[-1].margin > 0.05
    else:
        with pytest.raises(
            Infeasible, match=rf"snaps at 1?\d\d % of its loads; it must withstand {100 * RESERVE:.0f} %"
        ):
            make_plan(laden)


def test_loads_on_one_segment_of_a_row_count_at_the_nodes_of_both() -> None:
    quad = read_display("quad")
    nodes = tuple(Node(0.0, 0.0) for _ in range(quad.node_count))
    segments = tuple(Segment(mm(560.0), "valley") for _ in range(quad.node_count - 1))
    scene = Scene("row", quad, nodes, segments, (Load(1, 0.5, (0.0, -2.0)),))
    verifier = Verifier(quad, lambda: None)
    burden = check_goal(verifier, scene)
    assert burden is not None
    weight = quad.rod.weight_per_length * mm(560.0)
    # The node between two hanging segments carries half of both, and half of what hangs on one of them.
    assert burden.load.force >= 0.95 * (weight + 1.0)
