"""Looking at a display again and again: which states it shows, and when a rod snapped that nobody told to."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curveline.driving.looking.looks import Look, look_at
from curveline.driving.looking.opening import camera_for, source_for
from curveline.driving.run_listener import UNHEARD, RunListener
from curveline.errors import InvalidInput
from curveline.scene import Scene

if TYPE_CHECKING:
    from curveline.comparing.photographed import CameraUse
    from curveline.driving.looking.picture_sources import PictureSource
    from curveline.system.files import AnyPath

LONGEST = 86_400.0
"""A day: what is asked less often is not watched."""


@dataclass(frozen=True)
class Sighting:
    """A look at a display that is watched.

    `snapped` are the segments, from 1, that were in another state when they were last seen, with that state.
    """

    at: float  # [s since 1970]
    look: Look  # what was seen
    snapped: tuple[tuple[int, str], ...] = ()

    def line(self) -> str:
        """What was seen, in a sentence."""
        told = self.look.line()
        for segment, before in self.snapped:
            told += f"; segment {segment} snapped from {before} to {self.look.states[segment - 1]}"
        return told

    def document(self) -> dict[str, Any]:
        """The sighting as plain data."""
        snapped = [
            {"segment": segment, "before": before, "after": self.look.states[segment - 1]}
            for segment, before in self.snapped
        ]
        return {"at": self.at, **self.look.document(), "snapped": snapped}


@dataclass(frozen=True)
class WatchRequest:
    """How a display is watched: by which camera file, every so often [s]; a mock display also over which `radio`."""

    camera: AnyPath | CameraUse | None = None  # its file, which a mock display needs none of
    every: float = 2.0  # [s]
    radio: str = "mock"
    runs: AnyPath | None = None  # folder of the records, the user's if None

    def __post_init__(self) -> None:
        if not 0.0 <= self.every <= LONGEST:
            raise InvalidInput(f"no camera is asked every {self.every:g} s", f"choose 0 to {LONGEST:g}")


def watch(
    source: str | PictureSource,
    shape: AnyPath | Scene,
    request: WatchRequest | None = None,
    listener: RunListener = UNHEARD,
) -> Iterator[Sighting]:
    """Look at a display that shows a shape, for as long as somebody asks: a sighting per picture.

    The source is one as of `VerifyRequest`. Nobody moves the display meanwhile: a rod in another state than before was
    snapped over by hand, or crept. InvalidInput for a camera that does not exist, NoPicture if it gives none.
    """
    from curveline.driving.session import connect
    from curveline.shapes.files import read_shape

    asked = request or WatchRequest()
    scene = shape if isinstance(shape, Scene) else read_shape(shape)
    use = camera_for(source, asked.camera, scene.display)
    runs = None if asked.runs is None else Path(asked.runs)
    with (
        connect(asked.radio, scene.display, runs=runs, listener=listener) as session,
        tempfile.TemporaryDirectory() as folder,
    ):
        eye = source_for(source, use, session, scene.display)
        before: tuple[str, ...] = ()
        for number in count(1):
            begin = time.monotonic()
            picture = eye.take(Path(folder) / f"look-{number}")
            look = look_at(picture, scene, use)
            yield Sighting(time.time(), look, _snapped(before, look))
            before = look.states if look.is_told else before
            if picture.parent == Path(folder):
                picture.unlink(missing_ok=True)
            time.sleep(max(0.0, asked.every - (time.monotonic() - begin)))


def _snapped(before: tuple[str, ...], look: Look) -> tuple[tuple[int, str], ...]:
    """The segments, from 1, that are in another state than `before`, with that state."""
    pairs = enumerate(zip(before, look.states, strict=False), start=1)
    return tuple((segment, was) for segment, (was, now) in pairs if was != now)
