"""Plans, Monte Carlo runs, and displays of many segments, no two alike: every state of each, and a proven plan."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial

from curveline.bench.many_segments import row as row_of
from curveline.bench.measurement import Measurement
from curveline.bench.methods.stopwatch import timed
from curveline.bench.one_rod import EXPONENT_NOISE
from curveline.bench.trade import fitted_exponent
from curveline.bench.yardsticks import timed_row, yardsticks
from curveline.errors import Infeasible
from curveline.planning.tours import make_plan
from curveline.replay.monte_carlo import Errors, Setup
from curveline.replay.trials import TrialsRequest, play_trials
from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import simulate

SEGMENTS = (4, 16, 64)
TOO_MANY = 256
"""Segments for which rod is fed that a node's status cannot tell."""
RUNS, JOBS = 1000, 2
"""Runs with errors, and the processes that share them, whose start counts."""


def rows() -> Iterator[Measurement]:
    """All of them."""
    lone, roofline = read_shape("level-up-peak"), read_shape("roofline")
    yield timed_row("plan of a lone shape", timed(partial(make_plan, lone), 0.5), "ms", "< 80", "level-up-peak")
    yield timed_row("plan of roofline", timed(partial(make_plan, roofline), 1.0), "s", "< 0.3", "four segments")
    yield _monte_carlo(roofline)
    yield _refusal(row_of(TOO_MANY))
    yield from many_segments()


def _monte_carlo(scene: Scene) -> Measurement:
    """What it takes to play a plan a thousand times with errors."""
    setup = Setup(scene.display, make_plan(scene), Errors())
    took = play_trials(setup, TrialsRequest(runs=RUNS, jobs=JOBS)).seconds
    return Measurement(f"Monte Carlo of roofline, {RUNS}", took, "s", "< 3", f"{JOBS} processes")


def _refusal(scene: Scene) -> Measurement:
    """What it takes to refuse a row whose nodes would have to feed more than they can tell by radio."""

    def refused() -> None:
        with suppress(Infeasible):
            make_plan(scene)

    return timed_row(f"refusal of {TOO_MANY} segments", timed(refused, 0.5), "ms", "< 100", "too much feed")


def many_segments(sizes: Sequence[int] = SEGMENTS) -> Iterator[Measurement]:
    """Displays of many segments: every state of each, a proven plan, and how their times grow."""
    scenes = [row_of(size) for size in sizes]
    action: Callable[[Scene], object]
    for name, unit, action, goal in (
        ("simulate", "ms", simulate, "< 15"),
        ("plan", "s", make_plan, "< 1.5"),
    ):
        spent = [timed(partial(action, scene), 0.2) for scene in scenes]
        last = spent[-1]
        row = timed_row(f"{name} {sizes[-1]} segments", last, unit, goal, "no two alike")
        yield yardsticks().beside(row, last.best / sizes[-1] if action is simulate else None)
        exponent = fitted_exponent(sizes, [each.best for each in spent])
        how = f"{sizes[0]} to {sizes[-1]} segments"
        yield Measurement(f"{name} time, power of segments", exponent, "", "< 1.1", how, EXPONENT_NOISE)
