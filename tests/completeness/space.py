"""How many stable states in space are missed or invented, over random scenes, half of them drawn around folds.

    python -m tests.completeness.space --scenes 300 --seed 1
    python -m tests.completeness.space --scenes 300 --seed 1 --giving

Every scene is searched by descents from random curvatures, each of which is made exact by shooting: see `kirchhoff`. A
scene around a fold is one that a state is followed to, exactly, along a random change of all that a scene says, until
it ceases to be stable; the change is then taken back by a part of 0.001 to 0.1 of it. With `--giving` most bearings
give, or have some play: see `tilting`.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from curveline.rod.clamped_rod import ClampedRod, DeadLoad
from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.problem import Bearing, Pose
from curveline.rod.section import Section
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Rod as Material
from curveline.sections import Rectangle

from .kirchhoff import DEGREES, EVEN, Solution, descend, linking, rod_of
from .tilting import rest, tilted, tilts_of

Array = NDArray[np.float64]

STARTS = 30
FOLLOWED = 40
"""Steps along a change."""
FINEST = 1e-6
"""Part of a change to which a fold is located."""
SAME = 1e-4
"""Exact curves that are nearer to each other, over the length, are one."""
CLAIMED = 1e-3
"""How far, over the length, the product's curve may be from the exact one beside it."""
FINE = 1e-8
"""Tolerance [m] for forces that shooting may start from, where those of the default one do not do."""
TURNS = 1.0
"""States whose linking number differs by more than this have passed through themselves."""
CONFIDENCE = 1.96


LEAST = np.array(
    [-0.2, -1.3, -1.3, -1.0, -1.0, -12.0, -12.0, -1.0, -1.0, -1.0, 0.1, -40.0, -40.0, -40.0, math.log(0.04)]
)
MOST = -LEAST
MOST[10], MOST[14] = 0.9, math.log(0.8)
"""Of a scene's numbers: see `segment_of`."""


class Case(NamedTuple):
    """A scene, and an exact state that it is known to have, if it was drawn around a fold."""

    segment: ClampedRod
    known: Solution | None
    back: float


@dataclass
class Tally:
    """What a run has met; `unreached` are states of taut rods from whose forces shooting finds no equilibrium."""

    scenes: int = 0
    folds: int = 0
    states: int = 0
    missed: list[str] = field(default_factory=list)
    invented: list[str] = field(default_factory=list)
    unreached: list[str] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    scenes_missed: int = 0


GIVES, PLAYS = (0.003, 0.02, 0.1), (0.0, 0.0, 0.01, 0.1)
"""Of bearings that give [m] and [rad]."""
BEYOND_PLAY = 0.2
"""Tilts [rad] beyond the play with which descents begin, at most."""


class Held(NamedTuple):
    """What holds a rod besides its nodes: the size of the rod [m], the clamp [m], its give [m] and its play [rad]."""

    size: tuple[float, float]
    clamp: float
    give: float = 0.0
    play: float = 0.0


def segment_of(numbers: Array, held: Held) -> ClampedRod:
    """The segment of 15 numbers: dx, height, angles, yaws, rolls, weight (3), where a load is, load (3), and length."""
    numbers = np.clip(numbers, LEAST, MOST)
    rod = Material(2.45e9, Rectangle(*held.size), 0.048, 0.03, 0.0, 2.0, 2.45e9 / 2.7)
    height, start, end = numbers[0:3]
    yaw, roll, weight, load = numbers[3:5], numbers[5:7], numbers[7:10], numbers[10:14]
    flexible = rod.bending_stiffness
    chord = math.hypot(0.5, height)
    length = chord * (1.0 + math.exp(numbers[14]))
    forces = load[1:] * flexible / length**2
    acts = bool(np.any(forces))
    pose = Pose(0.5, float(height), float(start), float(end), length)
    bearing = Bearing(
        held.clamp,
        flexible,
        -float(weight[1]),
        lateral=rod.lateral_bending_stiffness,
        twisting=rod.twisting_stiffness,
        give=held.give,
        play=held.play,
    )
    return ClampedRod(
        pose,
        bearing,
        (DeadLoad(float(load[0]), *map(float, forces)),) if acts else (),
        section=Section(rod.stretching_stiffness, rod.thickness, rod.polar_gyration, 0.0),
        yaw=(float(yaw[0]), float(yaw[1])),
        roll=(float(roll[0]), float(roll[1])),
        weight_x=float(weight[0]),
        weight_z=float(weight[2]),
    )


def drawn(rng: np.random.Generator, giving: bool = False) -> tuple[Array, Held]:
    """Numbers of a random scene, and what holds its rod: in one of five `giving` ones the play's end is a stop."""
    numbers = np.zeros(15)
    numbers[0:3] = rng.uniform([-0.15, -0.9, -0.9], [0.15, 0.9, 0.9]) * rng.integers(0, 2)
    sizes = ((10.0, 2.4), (10.0, rng.uniform(1.0, 3.0)), (rng.uniform(3.0, 10.0), rng.uniform(1.0, 3.0)), (3.0, 3.0))
    width, thickness = sizes[rng.integers(0, len(sizes))]
    if width == thickness:
        # Between clamps in line, the arch of a rod of two equal stiffnesses turns about its chord for nothing.
        numbers[0:3] = rng.uniform([-0.15, -0.9, -0.9], [0.15, 0.9, 0.9])
    if rng.integers(0, 2):
        numbers[3:5] = rng.uniform(-0.5, 0.5, 2)
    tilt = rng.uniform(-math.pi / 2, math.pi / 2) * rng.integers(0, 2)
    numbers[5:7] = tilt, tilt + rng.integers(0, 3) * rng.uniform(-2.0 * math.pi, 2.0 * math.pi)
    if rng.integers(0, 2):
        down = rng.normal(size=3) if rng.integers(0, 2) else np.array([0.0, -1.0, 0.0])
        numbers[7:10] = 0.47 * down / np.linalg.norm(down)
    numbers[10] = rng.uniform(0.15, 0.85)
    if rng.integers(0, 3) == 0:
        numbers[11:14] = rng.normal(0.0, 8.0, 3)
    numbers[14] = rng.uniform(math.log(0.04), math.log(0.6))
    held = Held((1e-3 * width, 1e-3 * thickness), 0.02 * rng.integers(0, 2))
    if not giving:
        return numbers, held
    is_stopped = rng.integers(0, 5) == 0
    give = 0.0 if is_stopped else float(rng.choice(GIVES))
    return numbers, held._replace(give=give, play=float(rng.choice(PLAYS[2:] if is_stopped else PLAYS)))


def change_of(rng: np.random.Generator) -> Array:
    """A random change of a scene's numbers."""
    sizes = np.array([0.1, 0.8, 0.8, 0.4, 0.4, 1.5, 1.5, 0.1, 0.1, 0.1, 0.0, 10.0, 10.0, 10.0, 0.5])
    return np.asarray(rng.normal(0.0, 2.0, 15) * sizes)


def searched(segment: ClampedRod, rng: np.random.Generator, starts: int) -> list[Solution]:
    """The stable states of a segment that descents from random curvatures show."""
    rod = rod_of(segment)
    found: list[Solution] = []
    turn = segment.roll[1] - segment.roll[0]
    most = segment.bearing.play + (BEYOND_PLAY if segment.bearing.give > 0.0 else 0.0)
    for _ in range(starts):
        size = rng.uniform(0.5, 8.0)
        curvatures = rng.normal(0.0, size, (3, DEGREES)) / (1.0 + np.arange(DEGREES)) ** rng.uniform(0.5, 2.0)
        curvatures[2, 0] += turn + 2.0 * math.pi * rng.integers(-1, 2)
        tilts = rng.uniform(-most, most, 2) if most > 0.0 else np.empty(0)
        wrench = descend(rod_of(tilted(segment, tilts)) if most > 0.0 else rod, curvatures)
        state = None if wrench is None else rest(segment, np.append(wrench, tilts))
        if state is not None and belongs(segment, state) and not listed(state, found):
            found.append(state)
    return found


def belongs(segment: ClampedRod, state: Solution) -> bool:
    """True if an exact equilibrium is stable and has the turns that the segment's clamps ask for."""
    turn = (segment.roll[1] - segment.roll[0]) / (2.0 * math.pi)
    stands = tilted(segment, tilts_of(segment, state.wrench))
    return state.conjugate == 0 and abs(linking(rod_of(stands), state) - turn) < TURNS


def listed(state: Solution, others: list[Solution], side: float = 1.0) -> bool:
    """True if one of the others has the curve of a state, whose depth counts `side` times."""
    here = state.curve * np.array([1.0, 1.0, side])
    return any(np.max(np.abs(here - other.curve)) < SAME for other in others)


def cases(seed: int, count: int, giving: bool = False) -> Iterator[Case]:
    """Random scenes, every other one around a fold if its state has one."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        numbers, held = drawn(rng, giving)
        segment = segment_of(numbers, held)
        if number % 2:
            yield Case(segment, None, 0.0)
            continue
        found = searched(segment, rng, 6)
        change = change_of(rng)
        yield around(lambda share: segment_of(numbers + share * change, held), found[-1:], rng)  # noqa: B023


def around(scene, found: list[Solution], rng: np.random.Generator) -> Case:  # type: ignore[no-untyped-def]
    """The scene beside the fold at which a state is lost along a change; where it started if it is not lost."""
    if not found:
        return Case(scene(0.0), None, 0.0)
    share, step, state = 0.0, 1.0 / FOLLOWED, found[0]
    trail = [(0.0, state)]
    while step > FINEST and share < 1.0:
        ahead = scene(share + step)
        start = state.wrench
        if len(trail) > 1:
            (past, before), (now, _) = trail[-2:]
            start = start + (state.wrench - before.wrench) * step / (now - past)
        there = rest(ahead, start)
        if there is not None and belongs(ahead, there) and np.max(np.abs(there.curve - state.curve)) < 0.1:
            share, state = share + step, there
            trail.append((share, state))
        else:
            step *= 0.5
    if share >= 1.0:
        return Case(scene(share), state, 0.0)
    back = float(np.exp(rng.uniform(math.log(1e-3), math.log(1e-1))))
    kept = share - min(back, share)
    nearest = min(trail, key=lambda each: abs(each[0] - kept))
    known = rest(scene(kept), nearest[1].wrench)
    is_same = known is not None and belongs(scene(kept), known) and np.max(np.abs(known.curve - nearest[1].curve)) < 0.1
    return Case(scene(kept), known if is_same else None, back)


def exact(segment: ClampedRod, state: Equilibrium) -> Solution | None:
    """The exact equilibrium beside a state of the product's."""
    if state.space is None:
        return None
    length, unit = segment.free_length, segment.free_length / segment.stiffness
    wrench = -np.concatenate([state.space.forces[0] * length * unit, state.space.moments[0] * unit])
    along = np.arctan2(state.space.tangents[:, 1], state.space.tangents[:, 0])
    tilts = np.mod(along - [segment.start, segment.end] + math.pi, 2.0 * math.pi) - math.pi
    found = rest(segment, np.append(wrench, tilts))
    if found is None:
        return None
    at = np.concatenate([[0.0], np.cumsum(state.space.edges)]) / length
    claimed = (state.space.table[:, :3] - state.space.table[0, :3]) / length
    gap = [np.interp(EVEN, at, claimed[:, axis]) - found.curve[:, axis] for axis in range(3)]
    return found if np.max(np.abs(gap)) < CLAIMED + 20.0 / at.size**2 else None


def sharper(segment: ClampedRod, state: Equilibrium) -> Equilibrium:
    """The same state with forces to more digits, which shooting a taut rod needs to begin with."""
    others = model_states(segment, SearchRequest(FINE, (0,), "spatial")).states
    return min(
        others,
        key=lambda other: float(
            np.max(np.abs(other.curve(65) - state.curve(65)) + np.abs(other.depth(65) - state.depth(65))[:, None])
        ),
    )


def judge(case: Case, rng: np.random.Generator, tally: Tally, starts: int = STARTS) -> None:
    """Hold the product's states of a scene against those that are there."""
    segment = case.segment
    begin = time.process_time()
    states = [state for state in model_states(segment, SearchRequest(1e-4, (0,), "spatial")).states if state.stable]
    tally.seconds.append(time.process_time() - begin)
    true = searched(segment, rng, starts)
    if case.known is not None and not listed(case.known, true):
        true.append(case.known)
    claimed = []
    for state in states:
        found = exact(segment, state) or exact(segment, sharper(segment, state))
        said = f"scene {tally.scenes}: {state.name}, eigenvalue {state.lowest_eigenvalue:.3g}"
        if found is None:
            tally.unreached.append(said)
            continue
        claimed.append(found)
        if not belongs(segment, found):
            tally.invented.append(said)
    before = len(tally.missed)
    for each in true:
        if not listed(each, claimed) and not (segment.is_flat and listed(each, claimed, -1.0)):
            known = ", known" if each is case.known else ""
            tally.missed.append(
                f"scene {tally.scenes}: {len(true)} there, {len(claimed)} listed{known}, back {case.back:.2g}"
            )
    tally.scenes += 1
    tally.folds += case.back > 0.0
    tally.states += len(true)
    tally.scenes_missed += len(tally.missed) > before


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % confidence interval of a share (Wilson 1927)."""
    z2 = CONFIDENCE**2
    share = hits / count
    middle = (share + z2 / (2 * count)) / (1.0 + z2 / count)
    half = CONFIDENCE * math.sqrt(share * (1.0 - share) / count + z2 / (4 * count**2)) / (1.0 + z2 / count)
    return max(0.0, middle - half), min(1.0, middle + half)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--giving", action="store_true", help="between bearings of which most give")
    asked = parser.parse_args()
    tally, rng = Tally(), np.random.default_rng(asked.seed + 1000)
    for case in cases(asked.seed, asked.scenes, asked.giving):
        judge(case, rng, tally)
    print(f"{tally.scenes} scenes, {tally.folds} of them around folds, seed {asked.seed}: {tally.states} stable states")
    for what, said in (("missed", tally.missed), ("invented", tally.invented), ("not judged", tally.unreached)):
        low, high = wilson(len(said), max(tally.states, 1))
        print(f"{what}: {len(said)} states, {len(said) / max(tally.states, 1):.2%} [{low:.2%}, {high:.2%}]")
        for line in said:
            print(f"    {line}")
    low, high = wilson(tally.scenes_missed, tally.scenes)
    print(
        f"scenes with a miss: {tally.scenes_missed}, {tally.scenes_missed / tally.scenes:.2%} [{low:.2%}, {high:.2%}]"
    )
    middle, most = 1e3 * np.median(tally.seconds), 1e3 * max(tally.seconds)
    print(f"CPU time of a scene: median {middle:.0f} ms, largest {most:.0f} ms")


if __name__ == "__main__":
    main()
