"""Photographs as cameras and phones store them: JPEG, PNG and HEIC, held as they were taken, with what lens."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from os import fspath
from typing import Any, NoReturn

import numpy as np

from curveline.cameras.orientation import ORIENTATIONS, as_taken, turned, turned_lens
from curveline.cameras.view import Grey, Lens
from curveline.errors import MissingExtra
from curveline.system.files import AnyPath, printable, read_file, refuse_file
from curveline.units import mm, to_mm

MAX_BYTES = 100_000_000
MOST_PIXELS = 120_000_000
"""More than phones take; a picture of so many fits into the memory of a small computer."""
LEAST_SIDE = 64
"""[px] below which there is nothing to see."""
LONGEST_NAME = 80
SAME_FOCAL = 0.03
"""Part by which focal lengths of the same zoom may differ: some cameras round them."""

JPEG, PNG, HEIC = "JPEG", "PNG", "HEIC"
BEGINNINGS = {JPEG: b"\xff\xd8\xff", PNG: b"\x89PNG\r\n\x1a\n"}
HEIC_BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1")
OTHERS: Mapping[bytes, str] = {
    b"II*\0": "a TIFF or raw picture",
    b"MM\0*": "a TIFF or raw picture",
    b"GIF8": "a GIF picture",
    b"RIFF": "a WebP picture or a film",
    b"BM": "a BMP picture",
    b"%PDF": "a PDF document",
    b"<svg": "an SVG drawing",
    b"<?xml": "an XML document",
    b"PK": "a packed folder",
}
"""What people try, by how it begins."""

_MODEL, _MAKE, _ORIENTATION, _DETAILS = 0x110, 0x10F, 0x112, 0x8769
_FOCAL, _EQUIVALENT = 0x920A, 0xA405


@dataclass(frozen=True)
class Photograph:
    """A picture in grey levels, and what its file tells of the camera."""

    grey: Grey  # (rows, columns), as the camera was held
    source: str  # the file as the user named it
    focal_length: float | None = None  # [m] of the lens; None if the file does not tell
    equivalent: float | None = None  # [m] the same for a frame of 36 x 24 mm, digital zoom included; None as above
    camera: str = ""  # maker and model; "" as above
    orientation: int = 1  # as EXIF numbers how it was turned after the sensor took it

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        rows, columns = self.grey.shape
        return columns, rows

    @property
    def as_taken(self) -> Grey:
        """Grey levels as the sensor saw them, which is what a lens is calibrated for."""
        return as_taken(self.grey, self.orientation)


def mismatch(photograph: Photograph, lens: Lens) -> str:
    """Why a lens is not the one that took a photograph, in a sentence; "" if it may be."""
    wanted = turned_lens(lens, photograph.orientation).size
    if photograph.size != wanted:
        had, has = (f"{width} x {height}" for width, height in (wanted, photograph.size))
        if photograph.size == wanted[::-1]:
            return f"it has {has} pixels, the lens was calibrated with {had}: it was turned, and does not say how"
        return f"it has {has} pixels, the lens was calibrated with {had}: scaled or cropped pictures cannot be used"
    pairs = (
        ("focal length", photograph.focal_length, lens.focal_length),
        ("focal length (of 35 mm film)", photograph.equivalent, lens.equivalent),
    )
    for what, told, calibrated in pairs:
        if told and calibrated and abs(told - calibrated) > SAME_FOCAL * calibrated:
            return f"its {what} is {to_mm(told):.3g} mm, the lens was calibrated at {to_mm(calibrated):.3g} mm"
    return ""


def lens_of(photograph: Photograph, lens: Lens) -> Lens:
    """The lens as a photograph is turned; InvalidInput if `mismatch` has a reason against it."""
    if reason := mismatch(photograph, lens):
        hint = "use a picture as the camera stored it, with the lens and zoom of the calibration, or calibrate again"
        refuse_file(photograph.source, "another-lens", reason, hint)
    return turned_lens(lens, photograph.orientation)


def read_photograph(path: AnyPath) -> Photograph:
    """A photograph from a JPEG, PNG or HEIC file, by what is in it; turned as the camera was held.

    InvalidInput for a file that is damaged, too large or none of these; MissingExtra where a package is missing.
    """
    name = fspath(path)
    return photograph_of(read_file(path, MAX_BYTES), name)


def photograph_of(data: bytes, name: str) -> Photograph:
    """A photograph from the bytes of a file; errors as of `read_photograph`."""
    kind = _kind_of(data, name)
    image = _unpacked(data, kind, name)
    told = _exif_of(image)
    orientation = 1
    if kind == HEIC:  # libheif has turned it, and the note says so
        orientation = _whole(image.info.get("original_orientation"))
        levels = as_taken(_levels(image), orientation)
    else:
        orientation = _whole(told.get(_ORIENTATION))
        levels = _levels(image)
    if min(levels.shape) < LEAST_SIDE:
        message = f"it has {levels.shape[1]} x {levels.shape[0]} pixels: nothing is to be seen in so few"
        refuse_file(name, "too-small", message, "use the picture as the camera stored it")
    camera = " ".join(filter(None, (_text(told.get(_MAKE)), _text(told.get(_MODEL)))))
    return Photograph(
        turned(levels, orientation),
        name,
        _length(told.get(_FOCAL)),
        _length(told.get(_EQUIVALENT)),
        camera,
        orientation,
    )


def _kind_of(data: bytes, name: str) -> str:
    """What kind of picture the bytes are; InvalidInput for none that is read."""
    found = next((kind for kind, begin in BEGINNINGS.items() if data.startswith(begin)), "")
    if data[4:8] == b"ftyp" and data[8:12] in HEIC_BRANDS:
        found = HEIC
    if not found:
        _refuse_kind(data, name)
    return found


def _refuse_kind(data: bytes, name: str) -> NoReturn:
    if not data:
        refuse_file(name, "empty", "this file is empty", "copy the picture again")
    head = data.lstrip()[:16].lower() if data[:1] in b"< \n" else data[:16]
    what = next((words for begin, words in OTHERS.items() if head.startswith(begin)), "")
    message = f"this is {what}" if what else "there is no picture in this file that is known here"
    refuse_file(name, "another-kind", message, "name a photograph as JPEG, PNG or HEIC, as the camera stored it")


def _unpacked(data: bytes, kind: str, name: str) -> Any:
    """The picture with its pixels; what any decoder has against it, as InvalidInput."""
    require_pictures(kind)
    from PIL import Image

    try:
        with warnings.catch_warnings():
            # The size is looked at below, before any pixel is unpacked.
            warnings.simplefilter("ignore")
            image = _opened(data, kind)
            width, height = image.size
            if width * height > MOST_PIXELS:
                raise Image.DecompressionBombError
            if kind == HEIC:
                return image.to_pillow()
            if kind == JPEG:
                image.draft("L", image.size)  # colours are not needed
            image.load()
            return image
    except (Image.DecompressionBombError, MemoryError):
        refuse_file(name, "too-large", f"it has more than {MOST_PIXELS // 10**6} million pixels", "scale it down")
    except Exception as error:  # decoders raise whatever they like
        what = printable(str(error)[:80]) or type(error).__name__
        code = "cut-off" if "truncated" in what else "damaged"
        refuse_file(name, code, f"this picture is damaged: {what}", "copy it from the camera again")


def _opened(data: bytes, kind: str) -> Any:
    if kind == HEIC:
        import pillow_heif

        return pillow_heif.open_heif(io.BytesIO(data), convert_hdr_to_8bit=True)
    from PIL import Image

    return Image.open(io.BytesIO(data), formats=[kind])


def require_pictures(kind: str = JPEG) -> None:
    """MissingExtra unless pictures of a kind can be read."""
    try:
        import PIL  # noqa: F401

        if kind == HEIC:
            import pillow_heif  # noqa: F401
    except ImportError as error:
        what = "pillow-heif" if "heif" in str(error) else "Pillow"
        raise MissingExtra(
            f"reading {kind} pictures needs {what}, which is not installed", hint="pip install 'curveline[photo]'"
        ) from None


def _levels(image: Any) -> Grey:
    """Grey levels (rows, columns) of a picture of any mode."""
    if image.mode.startswith("I;16"):
        return np.asarray(np.asarray(image, dtype=np.uint32) >> 8, dtype=np.uint8)
    if image.mode in ("I", "F"):
        values = np.asarray(image, dtype=float)
        return np.asarray(np.clip(values / 257.0, 0.0, 255.0), dtype=np.uint8)
    return np.array(image.convert("L"), dtype=np.uint8)


def _exif_of(image: Any) -> dict[int, Any]:
    """What a picture tells of its camera, by the numbers that EXIF has; a note that is damaged tells nothing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            exif = image.getexif()
            return {**dict(exif), **dict(exif.get_ifd(_DETAILS))}
    except Exception:  # as above
        return {}


def _whole(value: Any) -> int:
    """How a picture was turned, 1 where nobody knows."""
    return value if isinstance(value, int) and value in ORIENTATIONS else 1


def _length(value: Any) -> float | None:
    """A length in m from one in mm, None for what is none."""
    try:
        length = float(value)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return mm(length) if math.isfinite(length) and 0.1 < length < 1e4 else None


def _text(value: Any) -> str:
    return printable(value.strip(" \0"))[:LONGEST_NAME] if isinstance(value, str) else ""
