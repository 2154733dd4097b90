"""Scenes and plans of the paper's shapes, made once, and the nodes' motion while they carry a plan out."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

from curveline.drive_settings import AXES, drive_settings
from curveline.plan_file import NodeTarget, Plan, Step
from curveline.planning.tours import make_plan
from curveline.scene import Display, Scene
from curveline.shapes.files import read_shape

FILES = {path.stem: path for path in sorted((Path(__file__).parent.parent / "shapes").glob("*.toml"))}
SHAPES = {name: path for name, path in FILES.items() if name.endswith(("-peak", "-valley"))}
"""The paper's, of one segment."""
TICK = 0.02
"""Seconds between samples of a motion."""

Counts = tuple[int, int, int]
Frame = tuple[float, tuple[Counts, ...]]


@cache
def scene(name: str) -> Scene:
    return read_shape(FILES[name])


@cache
def plan(name: str) -> Plan:
    """The plan of a shape, from home."""
    return make_plan(scene(name))


@cache
def next_plan(name: str, before: str) -> Plan:
    """The plan of a shape from where another one leaves the display."""
    return make_plan(scene(name), counts_of(plan(before).steps[-1].targets))


def counts_of(targets: tuple[NodeTarget, ...]) -> tuple[Counts, ...]:
    return tuple(target.counts for target in targets)


def progress(share: float) -> float:
    """Fraction of the way after a share of the time: a trapezoid of speed, a quarter of the time for either ramp."""
    ramp = 0.25
    if share <= 0.0:
        return 0.0
    if share >= 1.0:
        return 1.0
    speed = 1.0 / (1.0 - ramp)
    if share < ramp:
        return 0.5 * speed * share**2 / ramp
    if share > 1.0 - ramp:
        return 1.0 - 0.5 * speed * (1.0 - share) ** 2 / ramp
    return speed * (share - 0.5 * ramp)


def motion(of: Plan, lag: float = 0.0) -> list[Frame]:
    """Counts of the nodes while the plan is carried out; each node starts its steps `lag` s after the one before."""
    frames: list[Frame] = [(0.0, counts_of(of.start))]
    clock, before = 0.0, counts_of(of.start)
    for step in of.steps:
        after = counts_of(step.targets)
        whole = step.seconds + lag * (len(after) - 1)
        ticks = max(1, round(whole / TICK))
        for tick in range(1, ticks + 1):
            now = whole * tick / ticks
            counts = []
            for node, (old, new) in enumerate(zip(before, after, strict=True)):
                share = progress((now - node * lag) / step.seconds if step.seconds > 0.0 else 1.0)
                counts.append(tuple(round(a + share * (b - a)) for a, b in zip(old, new, strict=True)))
            frames.append((clock + now, tuple((c[0], c[1], c[2]) for c in counts)))
        clock, before = clock + whole, after
    return frames


def by_hand(display: Display, *rows: tuple[tuple[float, float, float], ...], wanted: tuple[str, ...]) -> Plan:
    """A plan that goes through rows of (feed mm, angle deg, height mm) per node, from home, and proves nothing."""
    drive = drive_settings(display)

    def target(values: tuple[float, float, float]) -> NodeTarget:
        extrude, bias, lift = (axis.counts(value) for axis, value in zip(drive.axes, values, strict=True))
        return NodeTarget(*values, counts=(extrude, bias, lift))

    def step(number: int, row: tuple[tuple[float, float, float], ...]) -> Step:
        nothing = (0.0,) * len(wanted)
        targets = tuple(map(target, row))
        return replace(
            plan("level-up-peak").steps[0], number=number, targets=targets, lengths_mm=nothing, states=wanted
        )

    home = (target((0.0,) * len(AXES)),) * display.node_count
    steps = tuple(step(number, row) for number, row in enumerate(rows, start=1))
    return Plan("by hand", drive, home, steps, wanted, (0.0,) * len(wanted))


def short_cut(goal: Plan) -> Plan:
    """Home, straight to the final length between level nodes, then to the goal."""
    length = tuple((target.extrude_mm, 0.0, 0.0) for target in goal.steps[-1].targets)
    last = tuple((each.extrude_mm, each.bias_deg, each.translate_mm) for each in goal.steps[-1].targets)
    return by_hand(scene("level-up-peak").display, length, last, wanted=goal.wanted)
