"""A film in GIF: what moves is drawn anew for every frame over what stays, in few colours that all frames share."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from curveline.figures.common import DARK

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from PIL.Image import Image

PIXELS_PER_INCH = 100
SHADES = 14
"""Of every colour, from itself to nearly white: what the edges of lines and letters need."""


class Film:
    """Frames of a `figure` in which the artists `moving` change and all else stays as it is when the film begins.

    `colours` are those of what is drawn, besides `DARK` text and white; the canvas must be that of `new_figure`.
    """

    def __init__(self, figure: Figure, moving: Sequence[Artist], colours: Sequence[str]) -> None:
        self._figure = figure
        self._canvas = cast(Any, figure.canvas)
        self._moving = moving
        self._palette = _palette([DARK, *colours])
        self._frames: list[Image] = []
        self._durations_ms: list[int] = []
        figure.set_dpi(PIXELS_PER_INCH)
        self._canvas.draw()
        # The layout made room for what moves as it stands now; from here on it must not follow it.
        figure.set_layout_engine("none")
        for artist in moving:
            artist.set_animated(True)
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(figure.bbox)

    def shoot(self, duration_ms: int) -> None:
        """Add the figure as it is now, for so long."""
        from PIL import Image

        self._canvas.restore_region(self._still)
        for artist in self._moving:
            self._figure.draw_artist(artist)
        picture = Image.fromarray(np.asarray(self._canvas.buffer_rgba())).convert("RGB")
        self._frames.append(picture.quantize(palette=self._palette, dither=Image.Dither.NONE))
        self._durations_ms.append(duration_ms)

    def gif(self) -> bytes:
        """The film, which runs over and over."""
        stream = io.BytesIO()
        first, *others = self._frames
        first.save(stream, "GIF", save_all=True, append_images=others, duration=self._durations_ms, loop=0)
        return stream.getvalue()


def _palette(colours: Sequence[str]) -> Image:
    """An image of no size that holds the colours and what lies between each and white."""
    from matplotlib.colors import to_rgb
    from PIL import Image

    shades = [
        round(255.0 * (1.0 - (1.0 - part) * step / SHADES))
        for colour in dict.fromkeys(colours)
        for step in range(1, SHADES + 1)
        for part in to_rgb(colour)
    ]
    palette = Image.new("P", (1, 1))
    palette.putpalette([255, 255, 255, *shades])
    return palette
