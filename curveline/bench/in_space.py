"""Rods in space: against what others need to come as close, and what scenes cost that leave the plane."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from curveline.bench.measurement import Measurement
from curveline.bench.methods.cases import SEED, Case, clamps
from curveline.bench.methods.own import Method, one_spatial_level
from curveline.bench.methods.peers import PEERS
from curveline.bench.methods.stopwatch import Timed, timed
from curveline.bench.one_rod import error_row, true_error
from curveline.bench.search import of_scenes
from curveline.bench.trade import is_installed
from curveline.bench.yardsticks import timed_row, yardsticks
from curveline.rod.states.equilibrium import EXTENSIBLE, SPATIAL
from curveline.scene import PEAK, Display, Node, Scene, Segment
from curveline.sections import Rectangle
from curveline.shapes.files import read_display
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm

NARROW = ((2.0, 850.0), (2.2, 700.0), (2.4, 780.0))
"""Widths [mm] of rods that are 2.4 mm thick, and lengths [mm] between level nodes: planar states do not stay."""
SPATIAL_SCENES = 60
"""Few: today each takes a quarter of a second."""

MOST_DEG = (45.0, 45.0, 15.0, 15.0, 30.0)
"""Of a random scene: both angles, both yaws, roll of the right node [deg], either way."""


def rows() -> Iterator[Measurement]:
    """All of them."""
    yield from against_peers()
    yield from _leaving_the_plane()
    yield _random_scenes()


def against_peers() -> Iterator[Measurement]:
    """The rod in space of 100 edges between clamps in its plane, and what others need to come as close."""
    case = clamps().cases[0]
    ours = one_spatial_level(case, 100)
    if ours is None:
        return
    error = true_error(case, EXTENSIBLE, ours)
    row = timed_row("spatial, 100 edges", Timed(ours.seconds, ours.spread), "ms", "< 5", "from a spline guess")
    yield yardsticks().beside(row, ours.seconds)
    yield error_row("its true error, in space", error)
    for peer in PEERS:
        if error is not None and peer.few and is_installed(peer):
            took = time_at(case, peer, error)
            if took is None:
                continue
            how = f"{1e3 * took:.3g} ms at that error"
            yield Measurement(f"{peer.name} over spatial", took / ours.seconds, "x", "> 50", how)


def time_at(case: Case, peer: Method, error: float) -> float | None:
    """Time [s] that a peer would take to an error [m], from its two finest settings on logarithmic scales."""
    finest = []
    for setting in peer.settings[-2:]:
        answer = peer.solve(case, setting)
        missed = None if answer is None else true_error(case, peer.truth or peer.model, answer)
        if answer is not None and missed is not None:
            finest.append((missed, answer.seconds))
    if len(finest) < 2:
        return None
    (rough, short), (fine, long) = finest
    power = math.log(long / short) / math.log(rough / fine)
    return float(long * (fine / error) ** power)


def _leaving_the_plane() -> Iterator[Measurement]:
    """Scenes in which nothing points out of the plane, whose rod leaves it all the same: both models are solved."""
    display = read_display("single")
    times = []
    for width, length in NARROW:
        rod = replace(display.rod, section=Rectangle(mm(width), mm(2.4)))
        scene = _scene(replace(display, rod=rod), (Node(0.0, 0.0), Node(0.0, 0.0)), mm(length))
        if simulate(scene)[0].model == SPATIAL:
            times.append(timed(partial(simulate, scene), 0.3))
    name, goal = "planar scenes that go to space", "< 50"
    if not times:
        yield Measurement(name, None, "ms", goal, "none of them went there")
        return
    slowest = max(times)
    row = timed_row(name, slowest, "ms", goal, f"slowest of {len(times)}")
    yield yardsticks().beside(row, slowest.best)


def _random_scenes() -> Measurement:
    """Scenes that yaw and roll, drawn at random."""
    display = read_display("single")
    rng = np.random.default_rng(SEED)
    scenes = []
    for _ in range(SPATIAL_SCENES):
        height, length = rng.uniform([-0.12, 0.56], [0.12, 0.8]).tolist()
        left, right, yaw, other_yaw, roll = map(deg, rng.uniform(-1.0, 1.0, 5) * MOST_DEG)
        nodes = (Node(0.0, left, yaw), Node(height, right, other_yaw, roll))
        scenes.append(_scene(display, nodes, length))
    return of_scenes("random spatial scenes, median", scenes, "< 10", np.median, goes=2)


def _scene(display: Display, nodes: tuple[Node, Node], length: float) -> Scene:
    return Scene("drawn", display, nodes, (Segment(float(length), PEAK),))
