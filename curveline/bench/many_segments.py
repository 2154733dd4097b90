"""Displays and shapes of many segments, to measure and to test with: no two alike, and every wanted state exists."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from random import Random

from curveline.scene import PEAK, VALLEY, Display, Node, Scene, Segment
from curveline.shapes.files import read_display
from curveline.units import deg, mm

PATTERN = (PEAK, VALLEY, VALLEY, PEAK, PEAK)
"""States wanted of the segments, again and again: neighbours of every kind."""

HEIGHTS = mm(15.0)
ANGLES = deg(8.0)
EXCESS = (mm(24.0), mm(44.0))
"""Heights and angles are up to these either way, and rod beyond the span: little enough for half of all the excess of
64 segments to stay in the range that a node's status can tell, 1184 mm of feed."""
TAILS = mm(2000.0)
"""Rod beyond the segments of a row, at both ends together."""


def row_display(segments: int) -> Display:
    """A display of any number of segments that is `quad` node for node, with an address for each and rod enough."""
    quad = read_display("quad")
    radio = replace(quad.radio, addresses=tuple(f"C1C1C1C2{node:02X}" for node in range(1, segments + 2)))
    rod = replace(quad.rod, total_length=segments * (quad.span + EXCESS[1]) + TAILS)
    name, digest = f"row-{segments}", f"{segments:064x}"
    return replace(quad, name=name, node_count=segments + 1, rod=rod, radio=radio, digest=digest)


def row(segments: int, pattern: Sequence[str] = PATTERN, seed: int = 5) -> Scene:
    """A shape of any number of segments, no two alike, whose wanted states go on as in `pattern`; both states exist."""
    chance = Random(seed)
    nodes = tuple(Node(chance.uniform(-HEIGHTS, HEIGHTS), chance.uniform(-ANGLES, ANGLES)) for _ in range(segments + 1))
    display = row_display(segments)
    parts = tuple(
        Segment(
            math.hypot(display.span, right.height - left.height) + chance.uniform(*EXCESS),
            pattern[index % len(pattern)],
        )
        for index, (left, right) in enumerate(pairwise(nodes))
    )
    return Scene(f"row-{segments}", display, nodes, parts)
