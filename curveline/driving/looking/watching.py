"""Looking at a display again and again: which states it shows, and when a rod snapped that nobody told to."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curveline.driving.looking.looks import Look, look_at

if TYPE_CHECKING:
    from curveline.comparing.photographed import CameraUse
    from curveline.driving.looking.picture_sources import PictureSource
    from curveline.scene import Scene


@dataclass(frozen=True)
class Sighting:
    """A look at a display that is watched.

    `snapped` are the segments, from 1, that were in another state when they were last seen, with that state.
    """

    at: float  # [s since 1970]
    look: Look
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


def watch(source: PictureSource, scene: Scene, camera: CameraUse, every: float = 2.0) -> Iterator[Sighting]:
    """Look at a display that shows the shape of `scene` every so often [s], for as long as somebody asks.

    Nobody moves it meanwhile: a rod in another state than before was snapped over by hand, or crept. NoPicture if the
    camera gives none.
    """
    before: tuple[str, ...] = ()
    with tempfile.TemporaryDirectory() as folder:
        number = 0
        while True:
            begin = time.monotonic()
            number += 1
            picture = source.take(Path(folder) / f"look-{number}")
            look = look_at(picture, scene, camera)
            if look.is_told:
                pairs = enumerate(zip(before, look.states, strict=False), start=1)
                snapped = tuple((segment, was) for segment, (was, now) in pairs if was != now)
                before = look.states
            else:
                snapped = ()
            yield Sighting(time.time(), look, snapped)
            if picture.parent == Path(folder):
                picture.unlink(missing_ok=True)
            time.sleep(max(0.0, every - (time.monotonic() - begin)))
