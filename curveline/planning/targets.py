"""Layouts in the numbers of motors, and back."""

from __future__ import annotations

import math
from collections.abc import Sequence

from curveline.drive_settings import DriveSettings
from curveline.plan_file import NodeTarget
from curveline.planning.layout import Layout
from curveline.scene import Node
from curveline.units import deg, mm, to_deg, to_mm

Counts = tuple[int, int, int]


def layout_at(drive: DriveSettings, counts: Sequence[Counts]) -> Layout:
    """Where a display stands, from its encoder counts."""
    feed, bias, lift = drive.axes
    nodes = tuple(Node(mm(lift.value(node[2])), deg(bias.value(node[1]))) for node in counts)
    return Layout(nodes, tuple(mm(feed.value(node[0])) for node in counts))


def targets_of(drive: DriveSettings, layout: Layout) -> tuple[NodeTarget, ...]:
    """Where every node goes, in mm, degrees and counts."""
    targets = []
    for node, feed in zip(layout.nodes, layout.feeds, strict=True):
        # Adding 0 makes a negative zero a plain one.
        values = (to_mm(feed) + 0.0, to_deg(node.angle) + 0.0, to_mm(node.height) + 0.0)
        counts = tuple(axis.counts(value) for axis, value in zip(drive.axes, values, strict=True))
        targets.append(NodeTarget(*values, counts=(counts[0], counts[1], counts[2])))
    return tuple(targets)


def extremes_of(drive: DriveSettings, layout: Layout) -> tuple[Counts, Counts]:
    """The least and the most counts of each axis of all nodes."""
    angles, heights = zip(*((node.angle, node.height) for node in layout.nodes), strict=True)
    ways = (to_mm, layout.feeds), (to_deg, angles), (to_mm, heights)
    ends = [
        (axis.counts(unit(min(values))), axis.counts(unit(max(values))))
        for axis, (unit, values) in zip(drive.axes, ways, strict=True)
    ]
    (feed, fed), (angle, turned), (height, lifted) = ends
    return (feed, angle, height), (fed, turned, lifted)


def seconds_between(drive: DriveSettings, before: Layout, after: Layout) -> float:
    """Time of a step, to the millisecond: all axes of all nodes take as long as the slowest of them."""
    fed = max(map(_apart, before.feeds, after.feeds))
    turned = max(_apart(old.angle, new.angle) for old, new in zip(before.nodes, after.nodes, strict=True))
    lifted = max(_apart(old.height, new.height) for old, new in zip(before.nodes, after.nodes, strict=True))
    ways = (to_mm(fed), to_deg(turned), to_mm(lifted))
    slowest = max(axis.seconds(way) for axis, way in zip(drive.axes, ways, strict=True))
    return math.ceil(1e3 * slowest) / 1e3


def _apart(first: float, second: float) -> float:
    return abs(first - second)
