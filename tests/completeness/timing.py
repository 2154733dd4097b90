"""How long the search for states takes, against another version of it, scene by scene in turn, on a busy machine too.

    python -m tests.completeness.timing ../other-clone --scenes 600

prints medians and means over the shapes of the project and over random scenes of the display `single`, and their
ratios, this version's over the other's. The best of five runs of a scene counts; no test hangs on it.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from curveline.rod.clamped_rod import ClampedRod, DeadLoad
from curveline.rod.problem import Bearing, Pose
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import scene_rod

from .scenes import HIGH, LOW, is_slack

RUNS = 5
WARM = 60
TOLERANCE = 1e-4
HERE = Path(__file__).parents[2]


def shapes() -> list[ClampedRod]:
    """The rods of the shapes of the project that have one segment."""
    scenes = (read_shape(path) for path in sorted((HERE / "shapes").glob("*.toml")))
    return [scene_rod(scene, 0) for scene in scenes if len(scene.segments) == 1]


def drawn(like: ClampedRod, count: int, seed: int) -> list[ClampedRod]:
    """Rods as `like`, anywhere within the limits of the display `single`."""
    rng = np.random.default_rng(seed)
    rods: list[ClampedRod] = []
    while len(rods) < count:
        height, start, end, length = rng.uniform(LOW, HIGH).tolist()
        rod = like.moved_to(Pose(like.pose.x, height, start, end, length))
        rods += [rod] if is_slack(rod) else []
    return rods


def work() -> None:
    """Time one rod a line of JSON, in microseconds; run in a process of its own for either version."""
    from curveline.rod.states.planar_states import find_states

    for line in sys.stdin:
        fields = json.loads(line)
        loads = tuple(DeadLoad(*load) for load in fields["loads"])
        best = float("inf")
        for _ in range(RUNS):
            rod = ClampedRod(Pose(*fields["pose"]), Bearing(*fields["bearing"]), loads)
            begin = time.perf_counter()
            find_states(rod, TOLERANCE)
            best = min(best, time.perf_counter() - begin)
        print(1e6 * best, flush=True)


def asked(process: subprocess.Popen[str], rod: ClampedRod) -> float:
    """The time of one rod by one of the versions [us]."""
    assert process.stdin is not None
    assert process.stdout is not None
    fields = dataclasses.asdict(rod)
    # What is 0 or empty at the end may have no name yet in the other version.
    for name in ("pose", "bearing"):
        numbers = fields[name]
        fields[name] = numbers[: max(i for i, each in enumerate(numbers) if np.any(each)) + 1]
    process.stdin.write(json.dumps(fields) + "\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def started(clone: Path) -> subprocess.Popen[str]:
    """A process that works with the package of `clone`, and with this file."""
    code = f"import sys; sys.path.insert(0, {str(clone)!r}); import curveline; sys.path.insert(1, {str(HERE)!r})"
    command = [sys.executable, "-c", f"{code}; from tests.completeness.timing import work; work()"]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd="/", env=dict(os.environ, PYTHONPATH=""), stdin=pipe, stdout=pipe, text=True)


def main() -> None:
    """Time both versions and print what they took."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path)
    parser.add_argument("--scenes", type=int, default=600)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    both = [started(chosen.other.resolve()), started(HERE)]
    of_project = shapes()
    sets = {"shapes": of_project, "random": drawn(of_project[0], chosen.scenes, chosen.seed)}
    for rod in sets["random"][:WARM]:
        for process in both:
            asked(process, rod)
    print(f"{'':8} {'other us':>18} {'this us':>18} {'ratio':>14}\n{'':8}" + f" {'median':>9} {'mean':>8}" * 2)
    for name, rods in sets.items():
        other, this = zip(*([asked(process, rod) for process in both] for rod in rods), strict=True)
        middle, mean = (
            (statistics.median(other), statistics.median(this)),
            (statistics.mean(other), statistics.mean(this)),
        )
        line = f"{name:8} {middle[0]:9.0f} {mean[0]:8.0f} {middle[1]:9.0f} {mean[1]:8.0f}"
        print(f"{line}   {middle[1] / middle[0]:.2f}, {mean[1] / mean[0]:.2f}")
    for process in both:
        process.terminate()


if __name__ == "__main__":
    main()
