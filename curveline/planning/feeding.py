"""Rod through many nodes: the order in which they feed it, so that no segment runs short or over on the way.

Nodes do not feed in lockstep. While two neighbours feed the same way, the segment between them may have lost already
what the one takes out, but not have got what the other brings. So a node takes out only what is there beyond the least
length, and brings in only what there is room for, both counted before the step; rod travels through a long display in
waves.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from curveline.planning.verification import Refused
from curveline.units import to_mm

STEPS = 1000
CLOSE = 1e-7
"""Feeds [m] that differ by less are the same: a fiftieth of an encoder count."""


@dataclass(frozen=True)
class Room:
    """The least and the most rod that every segment may have on the way [m]."""

    least: tuple[float, ...]
    most: tuple[float, ...]


def schedule(span: float, feeds: Sequence[float], goal: Sequence[float], room: Room) -> Iterator[tuple[float, ...]]:
    """The feeds of all nodes [m] after each of the steps that lead from `feeds` to `goal`.

    Raises Refused where no node can move.
    """
    here = list(feeds)
    for _ in range(STEPS):
        if max(abs(there - now) for there, now in zip(goal, here, strict=True)) < CLOSE:
            return
        moves = _moves(span, here, goal, room)
        if max(map(abs, moves)) < CLOSE:
            break
        here = [
            there if abs(there - now - move) < CLOSE else now + move
            for there, now, move in zip(goal, here, moves, strict=True)
        ]
        yield tuple(here)
    raise Refused(
        "there is no room to move the rod through the display: "
        f"segments must keep {to_mm(min(room.least)):.0f} to {to_mm(max(room.most)):.0f} mm"
    )


def _moves(span: float, feeds: Sequence[float], goal: Sequence[float], room: Room) -> list[float]:
    """How far every node feeds in one step; those that the rod passes first have the first choice."""
    lengths = [span + left - right for left, right in itertools.pairwise(feeds)]
    above = [most - length for most, length in zip(room.most, lengths, strict=True)]
    below = [length - least for least, length in zip(room.least, lengths, strict=True)]
    ways = [there - now for there, now in zip(goal, feeds, strict=True)]
    moves = [0.0] * len(feeds)
    rightwards = [node for node, way in enumerate(ways) if way > 0.0]
    leftwards = [node for node, way in reversed(list(enumerate(ways))) if way < 0.0]
    for node in (*rightwards, *leftwards):
        into, out = (node, node - 1) if ways[node] > 0.0 else (node - 1, node)
        free = abs(ways[node])
        free = min(free, above[into]) if 0 <= into < len(lengths) else free
        free = max(0.0, min(free, below[out]) if 0 <= out < len(lengths) else free)
        if 0 <= into < len(lengths):
            above[into] -= free
        if 0 <= out < len(lengths):
            below[out] -= free
        moves[node] = free if ways[node] > 0.0 else -free
    return moves
