"""Many scenes at once: in this process, and as a sweep of the command line with files."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from curveline.bench.measurement import RATE, Measurement
from curveline.bench.methods import cases
from curveline.bench.processes import COMMAND, apart, spent, unless_it_fails
from curveline.bench.yardsticks import yardsticks
from curveline.rod.problem import Array
from curveline.shapes.files import read_shape
from curveline.simulation.pose_batch import states_at_poses
from curveline.simulation.simulate import scene_rod
from curveline.units import deg

SHAPE = "level-up-peak"
KEY = "nodes.2.angle_deg"
FROM, TO = -60.0, 0.0
"""Angles of the right node [deg]; there is a fold between."""
CLEAR = -50.0
"""From here on there is none."""
POSES = 10_000
JOBS = 2
"""The goals are for two processors."""
POINTS, FEW = 2_000, 2
"""Points of a sweep on the command line, and of one that takes hardly more than the start-up."""
GOES = 3


def rows() -> Iterator[Measurement]:
    """Scenes and points a second."""
    yield from in_process()
    for name, goal, words in (
        ("points a second, CLI to NPZ", "> 5000", ("-o", "sweep.npz", "--force")),
        ("points a second, CLI to JSON", "> 2000", ("--json",)),
    ):
        yield on_the_command_line(name, goal, words)


def in_process() -> Iterator[Measurement]:
    """`curveline.simulate_poses` where one angle differs and no fold is near, and at random poses."""
    rod = scene_rod(read_shape(SHAPE), 0)
    angles = np.linspace(deg(CLEAR), deg(TO), POSES).tolist()
    poses = np.array([rod.pose._replace(end=angle) for angle in angles])
    yield at_poses("scenes a second, simulate_poses", poses, "> 20000")
    drawn = np.array([scene_rod(each, 0).pose for each in cases.random_scenes(POSES // 10)])
    yield at_poses("random scenes, simulate_poses", drawn, "")


def at_poses(name: str, poses: Array, goal: str) -> Measurement:
    """Scenes a second by one call."""
    scene = read_shape(SHAPE)
    goes = []
    for _ in range(GOES):
        begin = time.perf_counter()
        states_at_poses(scene, poses, jobs=JOBS)
        goes.append(time.perf_counter() - begin)
    shortest = min(goes)
    row = Measurement(name, len(poses) / shortest, RATE, goal, f"{len(poses)} poses, {JOBS} threads")
    return yardsticks().beside(row, shortest / len(poses))


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
