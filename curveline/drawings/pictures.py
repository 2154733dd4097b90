"""The edge of a silhouette in a PNG or JPEG picture."""

from __future__ import annotations

import io
import warnings
from typing import Any

import numpy as np

from curveline.drawings.lengths import INCH, in_mm
from curveline.drawings.silhouettes import Greys, Unclear, edge_in
from curveline.drawings.sketch import UPPER, HowToRead, Piece, Sketch
from curveline.phrases import counted
from curveline.system.files import printable, refuse_file

MOST_PIXELS = 30_000_000
ANY_SCREEN = 72.0
"""Dots per inch that programs write who know no scale."""
KINDS = {"PNG": b"\x89PNG", "JPEG": b"\xff\xd8\xff"}


def read(data: bytes, how: HowToRead, name: str) -> Sketch:
    """The edge of the silhouette in a picture, upper unless the lower one was asked for, in pixels, y upwards.

    InvalidInput for a picture that is damaged, too large, says no scale when none was given, or has no silhouette.
    """
    image = picture_of(data, name)
    wide, high = image.size
    said = f"{image.format or 'picture'} of {wide} x {high} pixels"
    unit, scale = scale_of(image, how, name, "silhouette")
    greys, kind = _greys(image, name)
    edge = how.edge or UPPER
    try:
        found = edge_in(greys, edge)
    except Unclear as why:
        refuse_file(name, why.code, str(why), why.hint)
    tone = kind or ("dark on light" if found.is_dark else "light on dark")
    said += f", {edge} edge of what is {tone}{scale}"
    if found.specks:
        said += f", {counted(found.specks, 'speck')} left out"
    return Sketch((Piece(found.points),), unit, said)


def picture_of(data: bytes, name: str) -> Any:
    """A picture with its pixels, as its camera was held."""
    from PIL import Image, ImageOps

    kind = next((kind for kind, begin in KINDS.items() if data.startswith(begin)), "PNG")
    try:
        with warnings.catch_warnings():
            # The size is looked at below, before any pixel is unpacked.
            warnings.simplefilter("ignore")
            image = Image.open(io.BytesIO(data), formats=[kind])
            if image.width * image.height > MOST_PIXELS:
                raise Image.DecompressionBombError
            image.load()
            turned = ImageOps.exif_transpose(image)
    except (Image.DecompressionBombError, MemoryError):
        refuse_file(name, "too-large", f"it has more than {MOST_PIXELS // 10**6} million pixels", "scale it down")
    except (OSError, SyntaxError, ValueError, TypeError, KeyError, IndexError, OverflowError, EOFError) as error:
        what = printable(str(error)[:80]) or type(error).__name__
        code = "cut-off" if "truncated" in what else "damaged"
        refuse_file(name, code, f"this picture is damaged: {what}", "save or copy it again")
    except Exception as error:  # struct.error, zlib.error and whatever else plugins of Pillow raise
        refuse_file(name, "damaged", f"this picture is damaged: {type(error).__name__}", "save or copy it again")
    turned.format = kind
    turned.info.update(image.info)
    return turned


def scale_of(image: Any, how: HowToRead, name: str, what: str) -> tuple[float, str]:
    """Metres per pixel, 0 where only the width of `what` it shows is known, and how that is said."""
    if how.width_mm is not None:
        return 0.0, ""
    hint = f"say how wide the {what} is: --width-mm 500"
    if how.unit:
        refuse_file(name, "two-units", f"a picture has pixels, and no {how.unit}", hint)
    try:
        across, down = (float(each) for each in image.info.get("dpi", (0.0, 0.0)))
    except (TypeError, ValueError, ZeroDivisionError):
        across = down = 0.0
    if not (1.0 <= across <= 1e5 and 1.0 <= down <= 1e5):
        refuse_file(name, "no-unit", "this picture does not say how large its pixels are", hint)
    if abs(across - ANY_SCREEN) < 0.5:
        message = "it says 72 dots per inch, which programs write that do not know how large its pixels are"
        refuse_file(name, "no-unit", message, hint)
    if abs(across - down) > 0.01 * across:
        refuse_file(name, "no-unit", f"its pixels are not square: {across:g} x {down:g} dots per inch", hint)
    return INCH / across, f", {across:.5g} dots per inch, 1 pixel = {in_mm(INCH / across)} mm"


def _greys(image: Any, name: str) -> tuple[Greys, str]:
    """Greys (rows, columns) from 0 to 255; of a picture with clear parts how opaque it is, and how that is said."""
    has_alpha = "A" in image.getbands() or "transparency" in image.info
    if has_alpha:
        alpha = np.asarray(image.convert("RGBA").getchannel("A"), dtype=np.float32)
        if alpha.min() < 128.0 <= alpha.max():
            return alpha, "opaque"
    if image.mode.startswith(("I", "F")):
        values = np.asarray(image, dtype=np.float32)
        low, high = float(values.min()), float(values.max())
        if not np.isfinite([low, high]).all() or not high > low:
            refuse_file(name, "no-silhouette", "it is of one grey all over", "make it a dark silhouette on white")
        return (values - low) * np.float32(255.0 / (high - low)), ""
    return np.asarray(image.convert("L"), dtype=np.float32), ""
