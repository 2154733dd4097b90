"""A plan carried out many times with the errors of real nodes: how often it ends in the wanted states.

    setup = Setup(display, plan, Errors(angle=deg(3.0)))
    outcome = summarise(setup, list(run_trials(setup, range(1, 1001))))

Every run has a seed of its own, from which alone its errors follow: it can be played again by itself, and the outcome
does not depend on how many processes shared the runs.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple, TypeVar

import numpy as np

from curveline.drive_settings import drive_settings
from curveline.errors import InvalidInput
from curveline.kernels import cache
from curveline.plan_file import NodeTarget, Plan
from curveline.replay.kept_curvature import kept_curvature
from curveline.replay.landmarks import Landmarks
from curveline.replay.outcome import TAUT, MonteCarloOutcome, Reason, Share, TrialRun
from curveline.replay.real_display import SHARES, RealDisplay, held_back, real_display
from curveline.rod.branches.quasi_static import FELL, move_through
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.states.slack import has_spare
from curveline.scene import (
    LOST,
    PEAK,
    STRAIGHT,
    UNNAMED,
    VALLEY,
    Display,
    DisplayErrors,
    Node,
    Profile,
)
from curveline.shapes.error_keys import check_fit
from curveline.simulation.simulate import clamped_rod
from curveline.system.workers import WorkerDied, Workers
from curveline.units import deg, mm

T = TypeVar("T")

OTHER = {PEAK: VALLEY, VALLEY: PEAK}
EVEN = Profile((0.0,), (0.0,))
"""Of a rod that is alike all along."""

PIECES = 16
"""Poses per step that the rod is taken through; each is reached straight from the one before."""

DETOUR = mm(1.0)
"""Nodes are out of line where their clamps take up more rod than this beyond the chord: play and stretch give less."""

NEARLY_STRAIGHT = 5e-3
"""The excess of length over chord below which a rod is as straight as errors of the feed let it be."""


@dataclass(frozen=True)
class Errors:
    """How large the errors of nodes are; the defaults are those of the motors and gears in use.

    For `feed`, `angle` and `height` one size stands for two errors of each node: the standard deviation of a constant
    one (calibration), and half of the width of a uniform one that is fresh at each step (play). `feed_scale` is the
    standard deviation of a node's error in what it feeds per turn, and `bow` that of how far the middle of the straight
    rod stands out upwards. `unevenness` is the largest part of a step's time by which an axis starts late, and of what
    is left by which it is early.
    """

    feed: float = mm(0.3)  # [m]
    feed_scale: float = 0.002
    angle: float = deg(1.0)  # [rad]
    height: float = mm(0.3)  # [m]
    bow: float = mm(5.0)  # [m]
    unevenness: float = 0.5

    def __post_init__(self) -> None:
        sizes = (self.feed, self.feed_scale, self.angle, self.height, self.bow)
        if not all(math.isfinite(size) and size >= 0.0 for size in sizes):
            raise InvalidInput("the size of an error is below 0 or not a number", "choose 0 to leave an error out")
        if not 0.0 <= self.unevenness <= 1.0:
            raise InvalidInput(f"an unevenness of {self.unevenness:g} is no part of a step's time", "choose 0 to 1")


@dataclass(frozen=True)
class Setup:
    """What is played: a plan on its display, with errors of some size, and what that display may be in truth.

    The file of a display may say that, too; where both do, these `ranges` count.
    """

    display: Display  # of the plan
    plan: Plan  # what is played
    errors: Errors = field(default_factory=Errors)  # their sizes
    ranges: DisplayErrors = field(default_factory=DisplayErrors)

    def __post_init__(self) -> None:
        if self.plan.drive.digest != self.display.digest:
            raise InvalidInput(f"{self.plan.name} was not planned for display {self.display.name}", "plan again")
        check_fit(self.display_errors, self.display)

    @cached_property
    def display_errors(self) -> DisplayErrors:
        """What the display may be in truth."""
        return self.ranges.over(self.display.errors)

    @cached_property
    def targets(self) -> Array:
        """As `targets_of` has them."""
        return targets_of(self.display, self.plan)

    @cached_property
    def kept(self) -> Profile | None:
        """The curvature of which the rod may keep a part, None if it keeps none: see `kept_before`."""
        return None if self.display_errors.set_share is None else kept_before(self.display, self.plan)

    @cached_property
    def landmarks(self) -> tuple[tuple[Landmarks, Landmarks], ...]:
        """Of each segment, left to right: the states that are known at the start and at the end."""
        pairs = (self.targets[[0, -1], segment : segment + 2] for segment in range(len(self.plan.wanted)))
        return tuple(
            (Landmarks(_segment_of(self.display, start, segment)), Landmarks(_segment_of(self.display, end, segment)))
            for segment, (start, end) in enumerate(pairs)
        )


def targets_of(display: Display, plan: Plan) -> Array:
    """Where the axes of all nodes are meant to be at the start and after each step: (steps+1, nodes, 3), in SI."""
    axes = drive_settings(display).axes

    def values(target: NodeTarget) -> tuple[float, float, float]:
        feed, bias, lift = (axis.value(counts) for axis, counts in zip(axes, target.counts, strict=True))
        return mm(feed), deg(bias), mm(lift)

    rows = [plan.start, *(step.targets for step in plan.steps)]
    return np.array([[values(target) for target in row] for row in rows])


def kept_before(display: Display, plan: Plan) -> Profile | None:
    """The curvature of which a rod may have kept a part before a plan; None if it was straight.

    It is that of the states at the start, where the plan says which. From home it is that of the other states at the
    end: of all that the rod may have been in, they pull hardest away from the wanted ones.
    """
    # Where material counts, it is counted.
    counted = replace(display, rod=replace(display.rod, profile=display.rod.profile or EVEN))
    targets = targets_of(display, plan)
    held = []
    for segment, (start, wanted) in enumerate(zip(plan.granted, plan.wanted, strict=True)):
        is_known = start not in ("", STRAIGHT, *UNNAMED)
        axes = targets[0 if is_known else -1, segment : segment + 2]
        held.append((_segment_of(counted, axes, segment), start if is_known else OTHER.get(wanted, "")))
    return kept_curvature(held)


def run_trials(setup: Setup, seeds: Sequence[int], jobs: int = 1) -> Generator[TrialRun, None, None]:
    """Play a run for each of `seeds`, in order, on so many processes."""
    yield from played(partial(play_run, setup), seeds, jobs)


def played(play: Callable[[int], T], seeds: Sequence[int], jobs: int) -> Generator[T, None, None]:
    """What `play` makes of each of the `seeds`, in order, on so many processes."""
    if jobs == 1:
        yield from map(play, seeds)
        return
    with cache.shared(), Workers(play, jobs) as workers:
        for _, run in workers.map(seeds, len(seeds)):
            if isinstance(run, WorkerDied):
                raise run
            yield run


class Draws(NamedTuple):
    """Errors of a run in units of their sizes: of the calibration, of the play at each step, of when axes move.

    Of the display, how far into their ranges.
    """

    offsets: Array  # (nodes, 3)
    scales: Array  # (nodes,)
    bows: Array  # (segments,)
    plays: Array  # (steps+1, nodes, 3)
    delays: Array  # (2, steps, nodes, 3): see `_uneven`
    shares: Array  # (len(SHARES),), from 0 to 1
    gaps: Array  # (segments,), from 0 to 1, of the errors of the spans


def draw(setup: Setup, seed: int | tuple[int, ...]) -> Draws:
    """The errors that follow from `seed`. What is drawn later in it changes nothing of what is drawn before."""
    source = np.random.default_rng(seed)
    nodes, steps = len(setup.plan.start), len(setup.plan.steps)
    return Draws(
        source.standard_normal((nodes, 3)),
        source.standard_normal(nodes),
        source.standard_normal(nodes - 1),
        source.uniform(-1.0, 1.0, (steps + 1, nodes, 3)),
        source.uniform(0.0, 1.0, (2, steps, nodes, 3)),
        source.uniform(0.0, 1.0, len(SHARES)),
        source.uniform(0.0, 1.0, nodes - 1),
    )


class RealRun(NamedTuple):
    """What a run really is: the display in truth, and where the axes of all its nodes are, (poses, nodes, 3) in SI."""

    real: RealDisplay
    values: Array

    def rod(self, segment: int, place: int) -> ClampedRod:
        """The rod of a segment at one of the poses."""
        return _segment_of(self.real.gaps[segment], self.values[place, segment : segment + 2], segment)


def course_of(setup: Setup, draws: Draws) -> RealRun:
    """A run with some errors from its start to its end."""
    real = real_display(setup.display, setup.display_errors, draws.shares, draws.gaps, setup.kept)
    values = _motion(setup, draws)
    values[:, :, 0] = held_back(values[:, :, 0], real.friction)
    return RealRun(real, values)


def play_run(setup: Setup, seed: int) -> TrialRun:
    """Play the plan once with the errors that follow from `seed`."""
    draws = draw(setup, seed)
    return TrialRun(seed, endings_of(setup, draws, course_of(setup, draws)), size_of(setup, draws))


def endings_of(setup: Setup, draws: Draws, course: RealRun) -> tuple[str, ...]:
    """How each segment ends in a run."""
    bows = setup.errors.bow * draws.bows
    return tuple(_ending(setup, segment, course, float(bow)) for segment, bow in enumerate(bows))


def size_of(setup: Setup, draws: Draws) -> float:
    """How large the errors of a run are: see `TrialRun`."""
    drawn = [draws.offsets.ravel(), draws.scales, draws.bows]
    ranges = setup.display_errors.given
    uniform = [share for name, share in zip(SHARES, draws.shares.tolist(), strict=True) if name in ranges]
    uniform += draws.gaps.tolist() if "span" in ranges else []
    # A uniform share has a twelfth of variance.
    drawn.append(math.sqrt(12.0) * (np.array(uniform) - 0.5))
    return float(np.sqrt(np.mean(np.concatenate(drawn) ** 2)))


def _motion(setup: Setup, draws: Draws) -> Array:
    """Where the axes of all nodes are from the start to the end of a run, (poses, nodes, 3) in SI, errors included."""
    errors = setup.errors
    targets = setup.targets.copy()
    targets[:, :, 0] *= 1.0 + errors.feed_scale * draws.scales
    targets += np.array([errors.feed, errors.angle, errors.height]) * (draws.offsets + draws.plays)
    return _uneven(targets, errors.unevenness * draws.delays)


def summarise(setup: Setup, runs: Sequence[TrialRun]) -> MonteCarloOutcome:
    """How often the wanted states were reached, and what happened else."""
    wanted = setup.plan.wanted
    bad = [run for run in runs if run.endings != wanted]
    counts = Counter(
        (number, ending)
        for run in bad
        for number, (ending, name) in enumerate(zip(run.endings, wanted, strict=True), start=1)
        if ending != name
    )
    return MonteCarloOutcome(
        total=Share(len(runs) - len(bad), len(runs)),
        segments=tuple(
            Share(sum(run.endings[place] == name for run in runs), len(runs)) for place, name in enumerate(wanted)
        ),
        reasons=tuple(Reason(*what, count) for what, count in counts.most_common()),
        worst=min(bad, key=lambda run: run.size, default=None),
    )


def _uneven(targets: Array, draws: Array) -> Array:
    """Where the axes are at `PIECES` moments of every step, (poses, nodes, 3), each on a course of its own.

    `draws (2, steps, nodes, 3)` say how late each axis starts, as a part of the step, and how early it is there, as a
    part of what is left.
    """
    late, early = draws[:, :, None]
    moments = (np.arange(PIECES)[:, None, None] + 1.0) / PIECES
    # A course that is late by all of its time jumps at its end.
    needed = np.maximum((1.0 - late) * (1.0 - early), 1e-9)
    progress = np.clip((moments - late) / needed, 0.0, 1.0)
    progress[:, -1] = 1.0
    moved = targets[:-1, None] + progress * (targets[1:] - targets[:-1])[:, None]
    return np.concatenate([targets[:1], moved.reshape(-1, *targets.shape[1:])])


def _ending(setup: Setup, segment: int, course: RealRun, bow: float) -> str:
    """How the rod of a segment ends in a run."""
    poses = _poses(course.real.gaps[segment], course.values[:, segment : segment + 2], segment)
    first, last = course.rod(segment, 0), course.rod(segment, -1)
    if np.any(~has_spare(poses, first.bearing) & (_detour(poses, first.bearing) > DETOUR)):
        return TAUT
    at_start, at_end = setup.landmarks[segment]
    state, events = move_through(poses, first, at_start.state(first, setup.plan.granted[segment]), bow)
    # A rod that is all but straight has nowhere to fall to: it buckles again with more rod to spare.
    gone = [event.place for event in events if event.kind == FELL and event.state is None]
    if not all(_is_nearly_straight(course.rod(segment, place)) for place in gone):
        return LOST
    if setup.plan.wanted[segment] == STRAIGHT and _is_nearly_straight(last):
        return STRAIGHT
    return at_end.name_of(last, state)


def _poses(display: Display, values: Array, segment: int) -> Array:
    """What the nodes of a segment, from 0, impose, (m, 6) as `Pose` has it, from their axes' `values (m, 2, 3)`."""
    (left_feed, left_angle, left_height), (right_feed, right_angle, right_height) = values.transpose(1, 2, 0)
    span = np.full(len(values), display.span)
    begins = np.array([display.material_at(segment, feed) for feed in left_feed.tolist()])
    lengths = span + left_feed - right_feed
    return np.column_stack([span, right_height - left_height, left_angle, right_angle, lengths, begins])


def _segment_of(display: Display, values: Array, segment: int) -> ClampedRod:
    """The rod of a segment, from 0, whose nodes' axes have `values (2, 3)`."""
    left, right = (Node(float(height), float(angle)) for _, angle, height in values)
    length = display.span + float(values[0, 0] - values[1, 0])
    return clamped_rod(display, (left, right), length, display.material_at(segment, float(values[0, 0])))


def _is_nearly_straight(rod: ClampedRod) -> bool:
    return rod.free_length < math.hypot(*rod.free_chord) * (1.0 + NEARLY_STRAIGHT)


def _detour(poses: Array, bearing: Bearing) -> Array:
    """How much rod (m,) [m] beyond the chord a thin beam takes up on its way between its clamps, to second order.

    Slopes a and b of its ends against the chord L take up L ((a^2 + b^2) / 15 - a b / 30), as of a cubic.
    """
    at = Pose(*poses.T)
    chord = np.hypot(at.x, at.y) - bearing.clamp
    line = np.arctan2(at.y, at.x)
    left, right = at.start - line, at.end - line
    taken: Array = chord * ((left**2 + right**2) / 15.0 - left * right / 30.0)
    return taken
