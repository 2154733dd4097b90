"""Scenes and plans of the paper's shapes, made once, and the nodes' motion while they carry a plan out."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from curveline.plan_file import NodeTarget, Plan
from curveline.planning.tours import make_plan
from curveline.scene import Scene
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
