"""Trials of shapes as a display shows them whose nodes are a little off: curves of the model between other nodes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm, to_mm

SIXTEEN = tuple(
    f"{level}-{bias}-{state}"
    for level in ("level", "staggered")
    for bias in ("neutral", "up", "down", "asymmetric")
    for state in ("peak", "valley")
)
FEED, ANGLE, HEIGHT = mm(0.3), deg(0.4), mm(0.2)
"""Standard deviations of the errors of a trial."""


def moved(scene: Scene, random: np.random.Generator) -> Scene:
    """The scene as a trial of it has it."""
    nodes = [
        replace(node, height=node.height + HEIGHT * random.normal(), angle=node.angle + ANGLE * random.normal())
        for node in scene.nodes
    ]
    segments = [replace(each, length=each.length + FEED * random.normal()) for each in scene.segments]
    return replace(scene, nodes=tuple(nodes), segments=tuple(segments))


def curve(scene: Scene, state: str = "", points: int = 300) -> np.ndarray:
    """The curve [m] of a scene of one segment, in the state it asks for or in another."""
    (segment,) = simulate(scene)
    found = next(each for each in segment.states if each.name == (state or scene.segments[0].state))
    return found.curve(points) + np.array([0.0, scene.nodes[0].height])


def write_table(path: Path, points: np.ndarray) -> None:
    """A curve [m] as a trial's table."""
    rows = [f"{x:.3f},{y:.3f}" for x, y in to_mm(1.0) * points]
    path.write_text("\n".join(["x_mm,y_mm", *rows, ""]))


def write_trials(folder: Path, shapes: tuple[str, ...] = SIXTEEN, trials: int = 3, seed: int = 1) -> None:
    """A folder with the tables of some trials of each shape."""
    random = np.random.default_rng(seed)
    for name in shapes:
        scene = read_shape(name)
        for number in range(1, trials + 1):
            write_table(folder / f"{name}-{number}.csv", curve(moved(scene, random)))
