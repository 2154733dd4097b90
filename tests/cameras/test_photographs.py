"""Photographs: what is read of them, what is told of damaged ones, and the lens of a picture that was turned."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pillow_heif
import pytest
from PIL import Image, ImageOps

from curveline.cameras.orientation import ORIENTATIONS, as_taken, turned, turned_lens, turned_pixels
from curveline.cameras.photographs import Photograph, lens_of, mismatch, photograph_of, read_photograph
from curveline.errors import InvalidInput

from . import scenes

KINDS = ("JPEG", "PNG", "HEIC")


def picture(seed: int = 0, size: tuple[int, int] = (96, 72)) -> Image.Image:
    """Something smooth in colours."""
    small = np.random.default_rng(seed).integers(0, 255, (6, 8, 3), dtype=np.uint8)
    return Image.fromarray(small).resize(size, Image.Resampling.BICUBIC)


def exif_of(orientation: int = 1, focal: Any = 4.25, film: Any = 26) -> Image.Exif:
    exif = Image.Exif()
    exif[0x10F], exif[0x110], exif[0x112] = "Maker", "Phone 7", orientation
    details = exif.get_ifd(0x8769)
    details[0x920A], details[0xA405] = focal, film
    return exif


def bytes_of(image: Image.Image, kind: str, exif: Image.Exif | None = None) -> bytes:
    stream = io.BytesIO()
    if kind == "HEIC":
        extra = {"exif": exif.tobytes()} if exif else {}
        pillow_heif.from_pillow(image).save(stream, quality=95, **extra)
    else:
        extra = {"exif": exif} if exif else {}
        image.save(stream, kind, **({"quality": 97} if kind == "JPEG" else {}), **extra)
    return stream.getvalue()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("orientation", ORIENTATIONS)
def test_a_picture_is_turned_as_the_camera_was_held(kind: str, orientation: int) -> None:
    image = picture(orientation)
    read = photograph_of(bytes_of(image, kind, exif_of(orientation)), "x")
    note = Image.Exif()
    note[0x112] = orientation
    marked = image.copy()
    marked.info["exif"] = note.tobytes()
    wanted = np.asarray(ImageOps.exif_transpose(marked).convert("L"), dtype=float)
    assert read.size == wanted.shape[::-1]
    assert read.orientation == orientation
    assert np.abs(read.grey - wanted).mean() < 4.0
    assert np.abs(read.as_taken - np.asarray(image.convert("L"), dtype=float)).mean() < 4.0
    assert (read.focal_length, read.equivalent) == (pytest.approx(0.00425), pytest.approx(0.026))
    assert read.camera == "Maker Phone 7"


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_picture_does_not_tell_is_not_known(kind: str) -> None:
    read = photograph_of(bytes_of(picture(), kind), "x")
    assert (read.focal_length, read.equivalent, read.camera, read.orientation) == (None, None, "", 1)
    read = photograph_of(bytes_of(picture(), kind, exif_of(9, 0.0, 0)), "x")
    assert (read.focal_length, read.equivalent, read.orientation) == (None, None, 1)


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGBA", "I;16", "CMYK"])
def test_pictures_of_every_mode_have_the_same_grey_levels(mode: str) -> None:
    grey = picture().convert("L")
    levels = np.asarray(grey)
    if mode == "I;16":
        image = Image.fromarray(levels.astype(np.uint16) * 257)
    else:
        image = grey.convert("RGB").convert(mode) if mode == "CMYK" else grey.convert(mode)
    kind = "JPEG" if mode == "CMYK" else "PNG"
    off = np.abs(photograph_of(bytes_of(image, kind), "x").grey.astype(float) - levels)
    assert off.mean() < (130.0 if mode == "1" else 3.0)


@pytest.mark.parametrize("orientation", ORIENTATIONS)
def test_the_lens_of_a_turned_picture_sees_what_the_sensor_saw(orientation: int) -> None:
    lens = scenes.lens(1200, 800)
    pixels = np.random.default_rng(orientation).uniform(0.0, 799.0, (50, 2))
    rays = lens.rays(pixels)
    swap, x, y = ORIENTATIONS[orientation]
    rays = rays[:, ::-1] if swap else rays
    rays = rays * [-1.0 if x else 1.0, -1.0 if y else 1.0]
    wanted = turned_pixels(pixels, lens.size, orientation)
    assert turned_lens(lens, orientation).pixels(rays) == pytest.approx(wanted, abs=1e-9)
    levels = np.zeros((800, 1200), np.uint8)
    column, row = np.round(pixels[0]).astype(int)
    levels[row, column] = 200
    column, row = turned_pixels(np.array([[column, row]], dtype=float), lens.size, orientation)[0].astype(int)
    assert turned(levels, orientation)[row, column] == 200
    assert (as_taken(turned(levels, orientation), orientation) == levels).all()


def test_a_picture_of_another_lens_is_refused() -> None:
    lens = replace(scenes.lens(96, 72), focal_length=0.00425, equivalent=0.026)
    fits = Photograph(np.zeros((72, 96), np.uint8), "a.jpg", 0.00425, 0.026)
    assert mismatch(fits, lens) == ""
    assert mismatch(replace(fits, focal_length=None, equivalent=None), lens) == ""
    assert mismatch(replace(fits, grey=np.zeros((96, 72), np.uint8), orientation=6), lens) == ""
    others = {
        "72 x 96 pixels": replace(fits, grey=np.zeros((96, 72), np.uint8)),
        "48 x 36 pixels": replace(fits, grey=np.zeros((36, 48), np.uint8)),
        "focal length is 5.7 mm": replace(fits, focal_length=0.0057),
        "(of 35 mm film) is 52 mm": replace(fits, equivalent=0.052),
    }
    for reason, other in others.items():
        assert reason in mismatch(other, lens)
        with pytest.raises(InvalidInput, match="calibrated"):
            lens_of(other, lens)
    assert lens_of(replace(fits, grey=np.zeros((96, 72), np.uint8), orientation=8), lens).size == (72, 96)


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", "empty"),
        (b"hello", "another-kind"),
        (b"II*\0" + bytes(100), "another-kind"),
        (b"%PDF-1.4", "another-kind"),
        (b"\xff\xd8\xff", "damaged"),
        (b"\x89PNG\r\n\x1a\n", "damaged"),
        (b"\0\0\0\x1cftypheic", "damaged"),
        (bytes_of(picture(), "JPEG")[:1500], "cut-off"),
        (bytes_of(picture(), "HEIC")[:900], "damaged"),
        (bytes_of(picture(size=(60, 90)), "PNG"), "too-small"),
    ],
)
def test_what_is_no_picture_says_so(data: bytes, code: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        photograph_of(data, "x.jpg")
    assert caught.value.diagnostics[0].code == code
    assert caught.value.hint


def test_a_picture_that_would_fill_the_memory_is_not_unpacked() -> None:
    stream = io.BytesIO()
    Image.new("1", (30_000, 30_000)).save(stream, "PNG")
    with pytest.raises(InvalidInput, match="more than 120 million pixels"):
        photograph_of(stream.getvalue(), "x.png")


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no such file"):
        read_photograph(tmp_path / "x.jpg")
    with pytest.raises(InvalidInput, match="this is a folder"):
        read_photograph(tmp_path)


def damaged(seed: int) -> bytes:
    """A picture with bytes changed, cut out, doubled, or cut off."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % 3]
    data = bytearray(bytes_of(picture(seed % 7), kind, exif_of(int(rng.integers(1, 9)))))
    for _ in range(int(rng.integers(1, 6))):
        at = int(rng.integers(0, len(data)) if rng.random() < 0.6 else rng.integers(0, min(400, len(data))))
        length = int(rng.integers(1, 40))
        match rng.integers(4):
            case 0:
                data[at : at + length] = rng.integers(0, 256, length, dtype=np.uint8).tobytes()
            case 1:
                del data[at : at + length]
            case 2:
                data[at:at] = data[at : at + length]
            case _:
                data[at] ^= 1 << int(rng.integers(8))
    if rng.random() < 0.2:
        del data[int(rng.integers(0, len(data))) :]
    return bytes(data)


def read_or_refused(seed: int) -> None:
    try:
        read = photograph_of(damaged(seed), "x")
    except InvalidInput as error:
        assert error.diagnostics[0].code  # noqa: PT017
    else:
        assert read.grey.dtype == np.uint8
        assert read.grey.ndim == 2


def test_damaged_pictures_are_read_or_refused() -> None:
    for seed in range(100):
        read_or_refused(seed)


@pytest.mark.campaign
def test_many_damaged_pictures_are_read_or_refused() -> None:
    for seed in range(50_000, 52_000):
        read_or_refused(seed)
