"""What every mixture of uneven progress means: axes of nodes anywhere between two layouts, ways through a box."""

from __future__ import annotations

import numpy as np

from curveline.plan_file import Plan
from curveline.planning.layout import Box, Layout
from curveline.rod.problem import Array, Pose
from curveline.scene import Node
from playing import Frame, counts_of

KNOTS = 24
"""Poses of an uneven way."""
PARTS = 40
"""Frames of a step in an uneven motion."""


def mixed(before: Layout, after: Layout, shares: Array) -> Layout:
    """The layout in which each node has made these `shares (nodes, 3)` of its way: feed, angle, height."""
    nodes, feeds = [], []
    for i, (old, new) in enumerate(zip(before.nodes, after.nodes, strict=True)):
        feed, angle, height = shares[i]
        feeds.append(before.feeds[i] + feed * (after.feeds[i] - before.feeds[i]))
        nodes.append(Node(old.height + height * (new.height - old.height), old.angle + angle * (new.angle - old.angle)))
    return Layout(tuple(nodes), tuple(feeds))


def box_between(before: Pose, after: Pose) -> Box:
    """The box of a lone segment: both poses are corners of it."""
    pairs = list(zip(before, after, strict=True))
    return Box(Pose(*map(min, pairs)), Pose(*map(max, pairs)))


def uneven_way(chance: np.random.Generator, before: Pose, after: Pose) -> Array:
    """Poses (KNOTS, 5) from one to another, each number growing at its own pace, or one after the other."""
    times = np.linspace(0.0, 1.0, KNOTS)[:, None]
    if chance.random() < 0.4:
        shares = np.clip(5.0 * times - chance.permutation(5), 0.0, 1.0)
    else:
        shares = times ** chance.uniform(0.2, 5.0, 5)
    begin, end = np.array(before[:5]), np.array(after[:5])
    return np.asarray(begin + shares * (end - begin))


def uneven_motion(of: Plan, chance: np.random.Generator) -> list[Frame]:
    """Counts of the nodes while a plan is carried out and each axis of each begins late and ends early as it likes.

    In some steps one node has finished before the next one begins.
    """
    before = counts_of(of.start)
    frames: list[Frame] = [(0.0, before)]
    for step in of.steps:
        after = counts_of(step.targets)
        begins, ends = np.sort(chance.random((2, len(after), 3)), axis=0)
        if chance.random() < 0.3:
            order = chance.permutation(len(after))[:, None]
            begins, ends = (order + begins) / len(after), (order + ends) / len(after)
        ways = np.subtract(after, before)
        for part in range(1, PARTS + 1):
            shares = np.clip((part / PARTS - begins) / (ends - begins + 1e-9), 0.0, 1.0) if part < PARTS else 1.0
            counts = np.rint(before + shares * ways).astype(int).tolist()
            frames.append((frames[-1][0] + step.seconds / PARTS, tuple((c[0], c[1], c[2]) for c in counts)))
        before = after
    return frames
