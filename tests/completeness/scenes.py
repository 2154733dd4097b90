"""Random planar scenes, half of them around folds and pitchforks on purpose, with the stable states that exist there.

A scene around a fold is made by moving its parameters along a random line until a stable state ends, which is located
to 1e-10 of the line with the spectral method, and then stepping back, or on, by 1e-4 to 1e-1 of the way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Bearing, Pose

from .spectral import DOWNHILL, Array, Elastica, State, basis, is_new, multistart, newton, settled

MODULUS = 2.6e9
WIDTH = 0.01
DENSITY = 0.048 / (0.01 * 0.0024) * 9.80665
"""Of the built-in display's rod: modulus [Pa] as in docs/accuracy.md, width [m], and weight [N/m^3]."""

SPAN = 0.5
LOW = np.array([-0.44, math.radians(-75.0), math.radians(-75.0), 0.5])
HIGH = np.array([0.44, math.radians(75.0), math.radians(75.0), 0.9])
"""Height of the right node over the left one [m], angles [rad], length [m]: what the display `single` can be asked."""
SLACKEST = 1.002
"""Free length over the distance that it has to bridge, at least: what is tauter is tested in tests/extremes."""

RANDOM, FOLD, PITCHFORK, PAST = "random", "fold", "pitchfork", "past"
"""How a scene was drawn: anywhere, before a fold or a pitchfork, past either."""
TURNED = 0.25
LEAST_STEP = 1e-10


class Scene(NamedTuple):
    """A rod, how it was drawn, how far from the fold (a part of the way to it), and a state that was followed there."""

    rod: ClampedRod
    kind: str
    back: float
    starts: tuple[State, ...] = ()


class End(NamedTuple):
    """Where a state ends on a line of rods: at `reached`; the states (t, state) on the way; what kind of end."""

    reached: float
    passed: list[tuple[float, State]]
    kind: str


@dataclass(frozen=True)
class Line:
    """Rods like `rod` whose parameters move from `begin (4,)` along `way (4,)`, in the order of `LOW`."""

    rod: ClampedRod
    begin: Array
    way: Array

    def at(self, t: float) -> ClampedRod:
        """The rod at a fraction of the line."""
        height, start, end, length = (self.begin + t * self.way).tolist()
        return self.rod.moved_to(Pose(SPAN, height, start, end, length))


def elastica(rod: ClampedRod) -> Elastica:
    """A rod without loads in units of its free length and EI."""
    free, half = rod.length - rod.clamp, 0.5 * rod.clamp
    x = rod.chord[0] - half * (math.cos(rod.start) + math.cos(rod.end))
    y = rod.chord[1] - half * (math.sin(rod.start) + math.sin(rod.end))
    return Elastica((x / free, y / free), (rod.start, rod.end), rod.weight * free**3 / rod.stiffness)


def is_slack(rod: ClampedRod) -> bool:
    """True if the rod is long enough for this yardstick."""
    return math.hypot(*elastica(rod).chord) * SLACKEST < 1.0


def drawn(rng: np.random.Generator) -> Line:
    """A random scene: half are those of the display `single`, the others have any thickness, clamp and gravity."""
    thickness, clamp, gravity = 0.0024, 0.02, True
    if rng.random() < 0.5:
        thickness = float(np.exp(rng.uniform(math.log(0.001), math.log(0.005))))
        clamp = float(rng.choice([0.0, 0.02]))
        gravity = bool(rng.random() < 0.5)
    stiffness = MODULUS * WIDTH * thickness**3 / 12.0
    weight = DENSITY * WIDTH * thickness if gravity else 0.0
    while True:
        rod = ClampedRod(Pose(SPAN, 0.0, 0.0, 0.0, 0.6), Bearing(clamp, stiffness, weight))
        line = Line(rod, rng.uniform(LOW, HIGH), np.zeros(4))
        if is_slack(line.at(0.0)):
            return line


def directed(rng: np.random.Generator, line: Line) -> Line:
    """The scene with a line that leads out of the limits: along one parameter, several, or a symmetric one.

    A third of the lines are symmetric or point-symmetric, where states end at pitchforks; of those a half nearly so.
    """
    begin, mask = line.begin.copy(), rng.random(4) < 0.5
    mask[rng.integers(4)] = True
    way = rng.normal(0.0, 1.0, 4) * mask
    rod = line.rod
    if rng.random() < 0.35:
        sign = -1.0 if rod.weight or rng.random() < 0.5 else 1.0
        begin[0] = 0.0 if sign < 0.0 else begin[0]
        begin[2], way[0], way[2] = sign * begin[1], 0.0 if sign < 0.0 else way[0], sign * way[1]
        if rng.random() < 0.5:
            begin[:3] += rng.normal(0.0, 1.0, 3) * 10.0 ** rng.uniform(-7.0, -2.0)
    way = way / max(float(np.linalg.norm(way)), 1e-300) * (HIGH - LOW)
    return Line(rod, begin, way)


def length_of(line: Line) -> float:
    """How far a line leads before it leaves the limits or the rod is too taut."""
    moving = line.way != 0.0
    if not np.any(moving):
        return 0.0
    bound = np.where(line.way > 0.0, HIGH, LOW)
    far = float(np.min((bound - line.begin)[moving] / line.way[moving]))
    ticks = np.linspace(0.0, far, 60)
    taut = [t for t in ticks if not is_slack(line.at(t))]
    return max(0.0, taut[0] - ticks[1]) if taut else far


def carried(rod: ClampedRod, state: State) -> State | None:
    """The stable state of `rod` that continues a neighbour's, or None."""
    there = settled(elastica(rod), state.coefficients, state.force)
    if there is None or not there.is_stable:
        return None
    n = max(there.coefficients.size, state.coefficients.size)
    gap = np.zeros(n)
    gap[: there.coefficients.size] += there.coefficients
    gap[: state.coefficients.size] -= state.coefficients
    return there if np.max(np.abs(basis(n).values @ gap)) < TURNED else None


def followed(line: Line, state: State, far: float) -> End | None:
    """Where on a line the state ends, by steps that are halved until they are `LEAST_STEP`; None if it does not."""
    t, step = 0.0, far / 16.0
    passed = [(0.0, state)]
    while step > LEAST_STEP:
        there = carried(line.at(t + step), state) if t + step <= far else None
        if there is None:
            step *= 0.5
            continue
        t, state = t + step, there
        passed.append((t, state))
        step = min(1.5 * step, far / 16.0)
    if t > 0.98 * far or t < 0.01 * far:
        return None
    return End(t + 0.5 * step, passed, kind_of(passed, t + 0.5 * step))


def kind_of(passed: list[tuple[float, State]], reached: float) -> str:
    """Fold or pitchfork: the eigenvalue falls with the root of the distance, or with the distance."""
    gaps = np.array([reached - t for t, _ in passed])
    values = np.array([state.lowest_eigenvalue for _, state in passed])
    near = (gaps < 1e-2 * reached) & (gaps > 1e-7 * reached)
    if np.count_nonzero(near) < 2:
        return FOLD
    power = float(np.polyfit(np.log(gaps[near]), np.log(values[near]), 1)[0])
    return FOLD if power < 0.75 else PITCHFORK


def stepped(line: Line, end: End, t: float) -> State | None:
    """The followed state at a fraction of the line before its end."""
    at, state = max((each for each in end.passed if each[0] <= t), key=lambda each: each[0])
    return state if at == t else carried(line.at(t), state)


def around_fold(rng: np.random.Generator) -> Scene:
    """A scene before, or past, where a stable state of another one ends."""
    while True:
        line = directed(rng, drawn(rng))
        far = length_of(line)
        if far < 0.02:
            continue
        states = multistart(elastica(line.at(0.0)), rng, 24)
        if not states:
            continue
        end = followed(line, states[rng.integers(len(states))], far)
        if end is None:
            continue
        back = float(10.0 ** rng.uniform(-4.0, -1.0))
        if rng.random() < 0.2:
            t = end.reached * (1.0 + back)
            return Scene(line.at(t), PAST, back, (end.passed[-1][1],)) if t < far else Scene(line.at(far), PAST, back)
        state = stepped(line, end, end.reached * (1.0 - back))
        if state is not None:
            return Scene(line.at(end.reached * (1.0 - back)), end.kind, back, (state,))


def scene(seed: int, number: int) -> Scene:
    """The scene of this number: the even ones anywhere, the odd ones around a fold."""
    rng = np.random.default_rng([seed, number])
    return around_fold(rng) if number % 2 else Scene(drawn(rng).at(0.0), RANDOM, math.nan)


def truth(seed: int, number: int, drawn_scene: Scene) -> list[State]:
    """Every stable state of a scene that random starts meet, and those near the ones that were followed there."""
    rod, rng = elastica(drawn_scene.rod), np.random.default_rng([seed, number, 1])
    states = multistart(rod, rng)
    for start in drawn_scene.starts:
        n = start.coefficients.size
        mass = np.zeros((7, n))
        mass[1:, :4] = rng.normal(0.0, 0.05, (6, 4))
        near = start.coefficients + mass
        shapes, pulls, done = newton(rod, near, np.repeat(start.force[None], 7, axis=0), 0)
        fallen, forces, ended = newton(rod, near, np.repeat(start.force[None], 7, axis=0), DOWNHILL)
        for c, force, is_there in zip([*shapes, *fallen], [*pulls, *forces], [*done, *ended], strict=True):
            state = settled(rod, c, force) if is_there else None
            if state is not None and state.is_stable and is_new(state.coefficients, states):
                states.append(state)
    return states
