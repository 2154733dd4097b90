"""What every mixture of uneven progress means: axes of nodes anywhere between two layouts, ways through a box."""

from __future__ import annotations

import numpy as np

from curveline.planning.layout import Box, Layout
from curveline.rod.problem import Array, Pose
from curveline.scene import Node

KNOTS = 24
"""Poses of an uneven way."""


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
    begin, end = np.array(before), np.array(after)
    return np.asarray(begin + shares * (end - begin))
