"""Where a whole display stands: the pose of every node, and how much rod each of them has fed.

One rod runs through all nodes, so lengths and feeds are one linear budget: what a node feeds to the right leaves the
segment on its left, or the tail, and arrives in the one on its right. Between two layouts every axis of every node may
be anywhere on its way, whatever the others do; what a segment can then meet is a box of poses.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

from curveline.rod.problem import Pose
from curveline.scene import Display, Node, Scene
from curveline.units import to_deg, to_mm

DIGITS = 9
SAME = 2.5 * 10.0**-DIGITS
"""Lengths [m] and angles [rad] that differ by less are the same: by no more than rounding, also of a sum of two."""


@dataclass(frozen=True)
class Layout:
    """All nodes, left to right, and how much rod each has fed to the right since home [m]."""

    nodes: tuple[Node, ...]
    feeds: tuple[float, ...]

    @property
    def segments(self) -> range:
        """Numbers of the segments, from 0."""
        return range(len(self.nodes) - 1)


@dataclass(frozen=True)
class Box:
    """The poses between `low` and `high`, each number for itself, but where of the rod it begins and where it ends
    instead of where it begins and how long it is."""

    low: Pose
    high: Pose

    def corners(self) -> Iterator[Pose]:
        """Every mixture of the extremes; one for a box without extent."""
        sides = [(low,) if high - low < SAME else (low, high) for low, high in self._extremes()]
        yield from map(_pose_between, itertools.product(*sides))

    def edges(self, before: Pose, after: Pose) -> Iterator[tuple[Pose, Pose]]:
        """Every edge, from the corner nearest to `before` outwards, so that each begins where another has ended.

        Along the edges one number changes after the other, in every order. The first of the ways leads from `before` to
        its corner, and the last one to `after` from its own, if they are no corners themselves.
        """
        root, last = self._nearest(before), self._nearest(after)
        if root != before:
            yield before, root
        axes = [axis for axis, (low, high) in enumerate(self._extremes()) if high - low >= SAME]
        for size in range(len(axes)):
            for moved in itertools.combinations(axes, size):
                here = self._across(root, moved)
                for axis in axes:
                    if axis not in moved:
                        yield here, self._across(here, (axis,))
        if last != after:
            yield last, after

    def _nearest(self, pose: Pose) -> Pose:
        """The corner nearest to a pose."""
        sides = zip(self._extremes(), _sides(pose), strict=True)
        return _pose_between(
            low if high - low < SAME or here - low <= high - here else high for (low, high), here in sides
        )

    def _across(self, corner: Pose, axes: Sequence[int]) -> Pose:
        """The corner on the other side in some of the numbers."""
        numbers = list(_sides(corner))
        for axis, (low, high) in enumerate(self._extremes()):
            if axis in axes:
                numbers[axis] = low if abs(numbers[axis] - high) < SAME else high
        return _pose_between(numbers)

    def _extremes(self) -> Iterator[tuple[float, float]]:
        """Low and high, of what each pose is independently."""
        return zip(_sides(self.low), _sides(self.high), strict=True)


def _sides(pose: Pose) -> tuple[float, ...]:
    """A pose in numbers that the axes of two nodes set one by one: the rod's end instead of its length."""
    return (*pose[:4], pose.begin + pose.length, pose.begin)


def _pose_between(sides: Iterable[float]) -> Pose:
    """The pose of such numbers."""
    *others, end, begin = sides
    return rounded_pose(*others, end - begin, begin)


def home(display: Display) -> Layout:
    """Nodes level and upright, the rod straight."""
    return Layout((Node(0.0, 0.0),) * display.node_count, (0.0,) * display.node_count)


def centred(display: Display, nodes: Sequence[Node], lengths: Sequence[float]) -> Layout:
    """Nodes with `lengths` [m] of rod between them and equal tails at both ends."""
    feeds = [0.5 * (math.fsum(lengths) - display.span * len(lengths))]
    for length in lengths:
        feeds.append(feeds[-1] - (length - display.span))
    return Layout(tuple(nodes), tuple(feeds))


def layout_of(scene: Scene) -> Layout:
    """Where a display shows `scene`, with equal tails if that does not say where of the rod it begins."""
    display = scene.display
    layout = centred(display, scene.nodes, [segment.length for segment in scene.segments])
    if scene.begin is None:
        return layout
    more = display.material_at(0, layout.feeds[0]) - scene.begin
    return Layout(layout.nodes, tuple(feed + more for feed in layout.feeds))


def lengths_of(display: Display, layout: Layout) -> tuple[float, ...]:
    """Rod between the pivots of every segment [m]."""
    return tuple(display.span + left - right for left, right in itertools.pairwise(layout.feeds))


def tails_of(display: Display, layout: Layout) -> tuple[float, float]:
    """Rod beyond the first and the last node [m], of one that lies centred at home."""
    spare = 0.5 * (display.rod.total_length - display.span * len(layout.segments))
    return spare - layout.feeds[0], spare + layout.feeds[-1]


def pose_of(display: Display, layout: Layout, segment: int) -> Pose:
    """What the two nodes of a segment impose on its rod."""
    left, right = layout.nodes[segment : segment + 2]
    feed = layout.feeds[segment]
    length, begin = display.span + feed - layout.feeds[segment + 1], display.material_at(segment, feed)
    return rounded_pose(display.span, right.height - left.height, left.angle, right.angle, length, begin)


def middle_begin(display: Display, length: float) -> float:
    """Where of the rod's material the middle segment begins, were all of them of this `length` [m]."""
    middle = (display.node_count - 1) // 2
    feeds = centred(display, (), (length,) * (display.node_count - 1)).feeds
    return display.material_at(middle, feeds[middle])


def rests(before: Layout, after: Layout, segment: int) -> bool:
    """True if the nodes of a segment are where they were."""
    both = slice(segment, segment + 2)
    return before.nodes[both] == after.nodes[both] and before.feeds[both] == after.feeds[both]


def box_of(display: Display, before: Layout, after: Layout, segment: int) -> Box:
    """Every pose that a segment can meet on the way from one layout to another."""
    (one, two), (other, another) = before.nodes[segment : segment + 2], after.nodes[segment : segment + 2]
    lows = min(one.height, other.height), min(two.height, another.height)
    highs = max(one.height, other.height), max(two.height, another.height)
    fed = before.feeds[segment], after.feeds[segment]
    taken = before.feeds[segment + 1], after.feeds[segment + 1]
    span = display.span
    lengths, begins = (span + min(fed) - max(taken), span + max(fed) - min(taken)), (0.0, 0.0)
    if display.rod.profile is not None:
        begins = display.material_at(segment, max(fed)), display.material_at(segment, min(fed))
        ends = display.material_at(segment + 1, max(taken)), display.material_at(segment + 1, min(taken))
        lengths = ends[0] - begins[0], ends[1] - begins[1]
    angles = (one.angle, other.angle), (two.angle, another.angle)
    return Box(
        rounded_pose(span, lows[1] - highs[0], min(angles[0]), min(angles[1]), lengths[0], begins[0]),
        rounded_pose(span, highs[1] - lows[0], max(angles[0]), max(angles[1]), lengths[1], begins[1]),
    )


@lru_cache(8192)
def rounded_pose(*numbers: float) -> Pose:
    """A pose to the nanometre, so that one met again is known again; adding 0 makes a negative zero a plain one."""
    return Pose(*(round(number, DIGITS) + 0.0 for number in numbers))


def between(before: Layout, after: Layout, fraction: float) -> Layout:
    """The layout on the straight way between two others."""

    def blend(first: float, second: float) -> float:
        return first + fraction * (second - first)

    nodes = tuple(
        Node(blend(a.height, b.height), blend(a.angle, b.angle)) for a, b in zip(before.nodes, after.nodes, strict=True)
    )
    return Layout(nodes, tuple(blend(a, b) for a, b in zip(before.feeds, after.feeds, strict=True)))


def posed(layout: Layout, angles: Sequence[float], heights: Sequence[float]) -> Layout:
    """The same feeds with other angles [rad] and heights [m]."""
    return Layout(tuple(itertools.starmap(Node, zip(heights, angles, strict=True))), layout.feeds)


def angles_of(layout: Layout) -> tuple[float, ...]:
    """Angle of every node [rad]."""
    return tuple(node.angle for node in layout.nodes)


def heights_of(layout: Layout) -> tuple[float, ...]:
    """Height of every node [m]."""
    return tuple(node.height for node in layout.nodes)


def describe(pose: Pose) -> str:
    """A pose in words, for a refusal."""
    return (
        f"length {to_mm(pose.length):.1f} mm, angles {to_deg(pose.start):.1f} and {to_deg(pose.end):.1f} deg, "
        f"right node {to_mm(pose.y):.1f} mm above the left"
    )
