"""How often random targets are refused, why, how long that takes, and which plans promise what the rod cannot keep.

    python -m tests.planning.refusals --on single --targets 300 --seed 1

A target is a shape whose wanted state exists, by name, according to `simulate`; every other one is drawn towards a
fold: along a random direction to where the state ends, and back by a random part of the way. Its fine truth is that of
`simulate`, too: how far the state is from losing its stability in the plane and out of it, and what it asks for.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from curveline.errors import Infeasible, InvalidInput
from curveline.planning.tours import make_plan
from curveline.planning.verification import LEAST_STABILITY, STIFFEST
from curveline.rod.models.model_error import judge
from curveline.rod.states.equilibrium import SPATIAL, Equilibrium
from curveline.scene import Display, Node, Range, Scene, Segment
from curveline.sections import Rectangle
from curveline.shapes.files import read_display
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm

MARGIN = LEAST_STABILITY * STIFFEST
STATES = ("peak", "valley")
SLOW = 5.0
"""Seconds of processor time that no refusal may take."""


@dataclass(frozen=True)
class Target:
    """A shape, and of its least stable segment the lowest eigenvalues in the plane and out of it, in EI/L^2.

    `asks` is the largest share of what rod and motors give that a state itself asks for.
    """

    scene: Scene
    inside: float
    outside: float
    asks: float

    @property
    def is_good(self) -> bool:
        """True if nothing of the shape itself speaks against it."""
        return self.inside > MARGIN and self.outside > MARGIN and self.asks < 1.0

    @property
    def is_true(self) -> bool:
        """True if the display can show the shape at all."""
        return self.inside > 0.0 and self.outside > 0.0


class Draw(NamedTuple):
    """A display, and the largest height [m], angle [rad] and length [m] that shapes are drawn with."""

    display: Display
    height: float
    angle: float
    longest: float = math.inf


def single(_: np.random.Generator) -> Draw:
    """The built-in display."""
    return Draw(read_display("single"), mm(150.0), deg(70.0))


def quad(_: np.random.Generator) -> Draw:
    """The built-in display of four segments, with lengths whose forces its motors bear in most shapes."""
    display = read_display("quad")
    return Draw(display, mm(40.0), deg(20.0), 1.12 * display.span)


def anything(chance: np.random.Generator) -> Draw:
    """A display of two nodes with a rod of any thickness and motors that suit it more or less."""
    display = read_display("single")
    span = chance.uniform(mm(200.0), mm(900.0))
    thickness, width = mm(math.exp(chance.uniform(math.log(0.4), math.log(4.0)))), mm(chance.uniform(2.0, 15.0))
    rod = replace(
        display.rod,
        section=Rectangle(max(width, thickness), thickness),
        mass_per_length=1450.0 * thickness * max(width, thickness),
        total_length=5.0 * span,
    )
    strength = rod.bending_stiffness / display.rod.bending_stiffness * (display.span / span) ** 2
    strength *= chance.uniform(0.8, 3.0)
    scale = span / display.span
    limits = replace(
        display.limits,
        height=Range(scale * display.limits.height.low, scale * display.limits.height.high),
        length=Range(span, 1.8 * span),
    )
    drive = replace(
        display.drive,
        max_force=display.drive.max_force * strength,
        max_moment=display.drive.max_moment * strength * scale,
    )
    made = replace(
        display,
        name="made",
        span=span,
        clamp=chance.uniform(0.0, mm(40.0)),
        gravity=bool(chance.random() < 0.7),
        rod=rod,
        limits=limits,
        drive=drive,
        digest=f"{chance.integers(2**62):x}",
    )
    return Draw(made, 0.3 * span, deg(65.0))


def square(_: np.random.Generator) -> Draw:
    """The built-in display with a rod of 3 x 3 mm, whose motors are as strong as that needs."""
    display = read_display("single")
    rod = replace(display.rod, section=Rectangle(mm(3.0), mm(3.0)), mass_per_length=0.013)
    return Draw(replace(display, name="square", rod=rod, digest="3x3"), mm(150.0), deg(70.0))


DISPLAYS = {"single": single, "quad": quad, "random": anything, "square": square}


def targets(kind: str, seed: int) -> Iterator[Target]:
    """Random shapes whose states exist, without end."""
    chance = np.random.default_rng(seed)
    while True:
        display, height, angle, longest = DISPLAYS[kind](chance)
        longest = min(longest, display.limits.length.high, display.rod.total_length / (display.node_count - 1))
        nodes = tuple(
            Node(float(chance.uniform(-height, height)), float(chance.uniform(-angle, angle)))
            for _ in range(display.node_count)
        )
        segments = []
        for left, right in pairwise(nodes):
            chord = math.hypot(display.span, right.height - left.height)
            shortest = max(1.01 * chord, display.limits.length.low)
            length = float(chance.uniform(shortest, max(longest, shortest)))
            segments.append(Segment(length, STATES[int(chance.integers(2))]))
        target = judged(Scene("target", display, nodes, tuple(segments)))
        if target is not None:
            yield target
            yield near_an_end(chance, target.scene) or target


def near_an_end(chance: np.random.Generator, scene: Scene) -> Target | None:
    """The shape moved along a random direction towards where its states end; None if they do not end on that way."""
    limits = scene.display.limits
    angles, heights = (chance.normal(0.0, size, len(scene.nodes)) for size in (deg(60.0), 0.2 * scene.display.span))
    fed = chance.normal(0.0, 0.2 * scene.display.span, len(scene.segments))
    moved = list(zip(scene.nodes, heights, angles, strict=True))

    def at(share: float) -> Scene:
        places = ((node.height + share * up, node.angle + share * turn) for node, up, turn in moved)
        nodes = tuple(Node(_within(limits.height, up), _within(limits.angle, turn)) for up, turn in places)
        segments = tuple(
            replace(segment, length=_within(limits.length, segment.length + share * more))
            for segment, more in zip(scene.segments, fed, strict=True)
        )
        return replace(scene, nodes=nodes, segments=segments)

    low, high = 0.0, 1.0
    if judged(at(high)) is not None:
        return None
    for _ in range(14):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if judged(at(middle)) is None else (middle, high)
    return judged(at(low * (1.0 - 10.0 ** chance.uniform(-3.5, -0.5))))


def _within(limits: Range, value: float) -> float:
    return float(min(max(value, limits.low), limits.high))


def judged(scene: Scene) -> Target | None:
    """The shape with its fine truth; None if a wanted state does not exist in its plane."""
    inside, outside, states = math.inf, math.inf, []
    for index, found in enumerate(simulate(scene, model="planar")):
        state = next((each for each in found.states if _was(each, scene.segments[index].state, found.states)), None)
        if state is None:
            return None
        sideways = judge(state).sideways
        inside, outside = min(inside, state.lowest_eigenvalue), min(outside, sideways.eigenvalue)
        states.append(state)
    return Target(scene, inside, outside, _asked(scene.display, states))


def _was(state: Equilibrium, name: str, states: tuple[Equilibrium, ...]) -> bool:
    """True if a state has a name, or would have it if it stayed in its plane."""
    flat = sorted((each for each in states if each.is_untangled), key=lambda each: -each.mean_height)
    if state.model == SPATIAL or state not in flat:
        return False
    if len(flat) == 1:
        return (state.mean_height > 0.0) == (name == "peak")
    return state is (flat[0] if name == "peak" else flat[-1])


def _asked(display: Display, states: list[Equilibrium]) -> float:
    """The share of what rod and motors give that the states of a row of segments ask for."""
    drive = display.drive
    needs = np.zeros((len(states) + 1, 3))
    for number, state in enumerate(states):
        rod = state.rod
        for side, angle in enumerate((rod.start, rod.end)):
            sign = 1.0 - 2.0 * side
            (x, y), moment = state.clamp_force[side], state.clamp_moment[side]
            along = x * math.cos(angle) + y * math.sin(angle) - sign * 0.5 * moment**2 / rod.stiffness
            about = moment + sign * 0.5 * rod.clamp * (y * math.cos(angle) - x * math.sin(angle))
            needs[number + side] += [along, y, about]
    bent = max(state.max_curvature for state in states) / display.rod.max_curvature
    return float(np.max([bent, *(np.abs(needs) / [drive.max_force, drive.max_force, drive.max_moment]).ravel()]))


def main() -> None:
    """Plan for targets and print what came of it."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--on", choices=DISPLAYS, default="single")
    parser.add_argument("--targets", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--verbose", action="store_true")
    asked = parser.parse_args()
    results: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    slowest, spent = 0.0, []
    for number, target in zip(range(asked.targets), targets(asked.on, asked.seed), strict=False):
        begin = time.process_time()
        try:
            make_plan(target.scene)
            reason = ""
        except (Infeasible, InvalidInput) as refusal:
            reason = refusal.message
        took = time.process_time() - begin
        spent.append(took)
        truth = "good" if target.is_good else "over a limit" if target.is_true else "not showable"
        results[f"{'refused' if reason else 'planned'}, {truth}"] += 1
        if reason:
            slowest = max(slowest, took)
            results["refused after over 5 s"] += took > SLOW
        if reason and target.is_good:
            reasons[kind_of(reason)] += 1
        if asked.verbose and (took > SLOW or (bool(reason) == target.is_good)):
            nodes = ", ".join(f"{1e3 * n.height:.1f} / {math.degrees(n.angle):.1f}" for n in target.scene.nodes)
            lengths = ", ".join(f"{1e3 * s.length:.1f} {s.state}" for s in target.scene.segments)
            print(
                f"{number}: {took:.1f} s, {target.inside / STIFFEST:.3f} {target.outside / STIFFEST:.3f} "
                f"{target.asks:.2f}: {nodes}; {lengths}: {reason}"
            )
    print(f"{asked.targets} targets on {asked.on}, seed {asked.seed}")
    for what, count in sorted(results.items()):
        print(f"  {what:30s}{count:5d}  {100.0 * count / asked.targets:5.1f} %")
    for what, count in reasons.most_common():
        print(f"    refused, good: {what:40s}{count:5d}")
    mean, median = np.mean(spent), np.median(spent)
    print(f"  processor time: slowest refusal {slowest:.1f} s, mean of all {mean:.2f} s, median {median:.2f} s")


def kind_of(reason: str) -> str:
    """The reason of a refusal in a few words."""
    for words in ("not found", "loses its stability", "losing stability", "another state", "taut", "radius", "takes"):
        if words in reason:
            return words
    return reason[-60:]


if __name__ == "__main__":
    main()
