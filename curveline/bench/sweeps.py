"""Many scenes at once: in this process, and as a sweep of the command line with files."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from curveline.bench.measurement import RATE, Measurement
from curveline.bench.processes import COMMAND, apart, spent, unless_it_fails
from curveline.bench.yardsticks import yardsticks
from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.simulation.shape_batch import simulate_many
from curveline.units import deg

SHAPE = "level-up-peak"
KEY = "nodes.2.angle_deg"
FROM, TO = -60.0, 0.0
"""Angles of the right node [deg]."""
SCENES = 1_000
JOBS = 2
"""The goals are for two processors."""
POINTS, FEW = 2_000, 2
"""Points of a sweep on the command line, and of one that takes hardly more than the start-up."""
GOES = 2


def rows() -> Iterator[Measurement]:
    """Scenes and points a second."""
    yield in_process()
    for name, goal, words in (
        ("points a second, CLI to NPZ", "> 5000", ("-o", "sweep.npz", "--force")),
        ("points a second, CLI to JSON", "> 2000", ("--json",)),
    ):
        yield on_the_command_line(name, goal, words)


def in_process() -> Measurement:
    """`curveline.simulate_many` on scenes that differ in one angle."""
    scenes = swept(SCENES)
    simulate_many(scenes[:FEW])
    goes = []
    for _ in range(GOES):
        begin = time.perf_counter()
        simulate_many(scenes, jobs=JOBS)
        goes.append(time.perf_counter() - begin)
    shortest = min(goes)
    how = f"{SCENES} scenes, {JOBS} jobs"
    row = Measurement("scenes a second, simulate_many", SCENES / shortest, RATE, "> 20000", how)
    return yardsticks().beside(row, shortest / SCENES)


def swept(count: int) -> list[Scene]:
    """Scenes that are one shape but for the angle of the right node."""
    scene = read_shape(SHAPE)
    left, right = scene.nodes
    angles = np.linspace(FROM, TO, count).tolist()
    return [replace(scene, nodes=(left, replace(right, angle=deg(angle)))) for angle in angles]


def on_the_command_line(name: str, goal: str, words: Sequence[str]) -> Measurement:
    """Points a second of a long sweep, less the time of a short one, which is start-up."""
    row = Measurement(name, None, RATE, goal, "start-up not counted")

    def measured() -> tuple[float, None]:
        with tempfile.TemporaryDirectory() as folder:
            output = [str(Path(folder) / word) if word.endswith(".npz") else word for word in words]
            long, short = (
                spent([*COMMAND, "simulate", SHAPE, "--sweep", f"{KEY}={FROM}:{TO}:{count}", *output], apart(folder))
                for count in (POINTS, FEW)
            )
        return (POINTS - FEW) / max(long.wall - short.wall, 1e-9), None

    return unless_it_fails(row, measured)
