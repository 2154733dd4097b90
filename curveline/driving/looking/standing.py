"""The shape that a display's nodes make where they stand."""

from __future__ import annotations

from collections.abc import Sequence

from curveline.drive_settings import drive_settings
from curveline.radio.protocol.codes import Counts
from curveline.replay.playback import segment_at
from curveline.scene import PEAK, WANTABLE, Display, Scene, Segment


def scene_at(
    display: Display, counts: Sequence[Counts], states: Sequence[str] = (), name: str = "as it stands"
) -> Scene:
    """A scene of a display whose nodes stand at such `counts`; of each segment the state in `states` is wanted.

    Where that is none which a shape can ask for, or not known, it is the peak.
    """
    drive, count = drive_settings(display), display.node_count - 1
    parts = [segment_at(display, drive, counts[place : place + 2], place) for place in range(count)]
    nodes = (parts[0][0][0], *(pair[1] for pair, _, _ in parts))
    known = [*states, *[""] * count]
    segments = tuple(
        Segment(length, state if state in WANTABLE else PEAK)
        for (_, length, _), state in zip(parts, known, strict=False)
    )
    begin = None if display.rod.profile is None else parts[0][2]
    return Scene(name, display, nodes, segments, begin=begin)
