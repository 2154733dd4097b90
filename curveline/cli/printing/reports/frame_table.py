"""Frames that stage the steps of a plan, as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from curveline.cli.printing import screen
from curveline.radio.host.frame_listing import FrameRecord

HEAD = ("step", "action", "node", "address", "release", "extrude", "bias", "translate", "ms")


def table(frames: Sequence[FrameRecord]) -> Iterator[str]:
    """Lines of text, a frame each."""
    yield "frames that stage each step, decoded"
    yield from screen.table([HEAD, *map(_cells, frames)], frozenset({1, 3}))


def _cells(frame: FrameRecord) -> tuple[str, ...]:
    names = (str(frame.step), frame.action, str(frame.node), frame.address, str(frame.release))
    return (*names, *map(str, frame.target), str(frame.move_ms))
