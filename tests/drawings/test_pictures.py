"""Edges of silhouettes in pictures: known to a third of a pixel, whatever is dark, and refused where unclear."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image, ImageDraw

from curveline.drawings.drawing import Drawing
from curveline.drawings.reading import read_drawing
from curveline.drawings.sketch import HowToRead
from drawings.curves import arc, off, refusal

WIDE, HIGH = 600, 240
FINE = 8
"""Into how many parts pixels are cut to see how much of them is covered."""
EXACT = 0.3
"""Of a pixel."""

Shape = Callable[[Any, Any], Any]


def hill(x: Any, y: Any) -> Any:
    return y < 60 + 120 * np.sin(np.pi * x / WIDE) + 10 * np.sin(7 * np.pi * x / WIDE)


def hanging(x: Any, y: Any) -> Any:
    return y > 180 - 100 * np.sin(np.pi * x / WIDE)


def disc(x: Any, y: Any) -> Any:
    return np.hypot(x - 301.3, y - 117.8) < 100.4


def house(x: Any, y: Any) -> Any:
    """Walls at 100.25 and 499.75, and a roof."""
    return (x > 100.25) & (x < 499.75) & (y > 20) & (y < 180 - abs(x - 300) / 4)


def grey(shape: Shape, dark: float = 30.0, light: float = 225.0) -> npt.NDArray[np.float64]:
    """A picture of a shape: of each pixel what part of it is covered, y upwards."""
    x = (np.arange(WIDE * FINE) + 0.5) / FINE
    y = HIGH - (np.arange(HIGH * FINE) + 0.5) / FINE
    inside = shape(x[None, :], y[:, None]).reshape(HIGH, FINE, WIDE, FINE).mean(axis=(1, 3))
    return light + (dark - light) * inside


def saved(path: Path, values: Any, **how: Any) -> Path:
    Image.fromarray(np.clip(np.round(values), 0, 255).astype(np.uint8)).save(path, **how)
    return path


def edge(path: Path, side: str = "upper", width: float = WIDE) -> Drawing:
    """With a millimetre per pixel, where that is the width of the silhouette."""
    return read_drawing(path, HowToRead(edge=side, width_mm=width))


X = np.linspace(0, WIDE, 4001)
HILL = np.column_stack([X, 60 + 120 * np.sin(np.pi * X / WIDE) + 10 * np.sin(7 * np.pi * X / WIDE)])


@pytest.mark.parametrize(
    ("dark", "light", "said"), [(30, 225, "dark on light"), (225, 30, "light on dark"), (90, 130, "dark on light")]
)
def test_the_edge_of_a_hill(dark: float, light: float, said: str, tmp_path: Path) -> None:
    drawing = edge(saved(tmp_path / "hill.png", grey(hill, dark, light)))
    assert off(drawing, HILL) < EXACT
    assert f"PNG of 600 x 240 pixels, upper edge of what is {said}, 1 unit = 1 mm" in drawing.understood


def test_the_lower_edge_of_what_hangs(tmp_path: Path) -> None:
    drawing = edge(saved(tmp_path / "cloth.png", grey(hanging)), "lower")
    x = np.linspace(0, WIDE, 4001)
    assert off(drawing, np.column_stack([x, 180 - 100 * np.sin(np.pi * x / WIDE)])) < EXACT


@pytest.mark.parametrize(("side", "sign"), [("upper", -1), ("lower", 1)])
def test_a_disc_from_its_left_end_to_its_right_one(side: str, sign: int, tmp_path: Path) -> None:
    drawing = edge(saved(tmp_path / "disc.png", grey(disc)), side, 200.8)
    assert off(drawing, arc((301.3, 117.8), 100.4, 180, 180 + 180 * sign)) < 3 * EXACT
    assert drawing.points[0, 0] * 1e3 == pytest.approx(200.9, abs=EXACT)
    middle = drawing.points[abs(drawing.points[:, 0] - 0.3013) < 0.09]
    assert np.max(abs(np.hypot(*(middle * 1e3 - [301.3, 117.8]).T) - 100.4)) < EXACT


def test_walls_are_no_part_of_an_edge(tmp_path: Path) -> None:
    drawing = edge(saved(tmp_path / "house.png", grey(house)), width=399.5)
    assert off(drawing, np.array([[100.25, 130.06], [300, 180], [499.75, 130.06]])) < EXACT


@pytest.mark.parametrize("seed", range(4))
def test_noise_of_an_edge_and_of_greys_stays_small(seed: int, tmp_path: Path) -> None:
    random = np.random.default_rng(seed)
    wobble = random.normal(0.0, 0.1, WIDE)

    def rough(x: Any, y: Any) -> Any:
        return hill(x, y - np.repeat(wobble, FINE)[None, :])

    values = grey(rough) + random.normal(0.0, 4.0, (HIGH, WIDE))
    drawing = edge(saved(tmp_path / "rough.png", values))
    y = np.interp(HILL[:, 0], *drawing.points.T * 1e3)
    assert np.sqrt(np.mean((y - HILL[:, 1]) ** 2)) < 0.15
    assert np.max(abs(y - HILL[:, 1])) < 0.6


def test_a_jpeg_is_almost_as_good(tmp_path: Path) -> None:
    path = saved(tmp_path / "hill.jpg", grey(hill), quality=90, dpi=(254, 254))
    drawing = read_drawing(path)
    assert off(Drawing(drawing.points * 10), HILL) < 2 * EXACT
    assert "254 dots per inch, 1 pixel = 0.1 mm" in drawing.understood


def test_a_camera_that_was_turned(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6  # the top of the scene is at the right of what is stored
    turned = np.rot90(grey(hill), 1)
    drawing = edge(saved(tmp_path / "hill.jpg", turned, quality=95, exif=exif))
    assert off(drawing, HILL) < 2 * EXACT


def test_specks_are_left_out(tmp_path: Path) -> None:
    values = grey(hill)
    for x, y in ((100, 20), (300, 10), (301, 11), (500, 40)):
        values[y, x] = 0.0
    drawing = edge(saved(tmp_path / "dust.png", values))
    assert off(drawing, HILL) < EXACT
    assert "4 specks left out" in drawing.understood


def test_what_is_opaque_is_the_silhouette(tmp_path: Path) -> None:
    alpha = grey(hill, 255.0, 0.0)
    for mode, colours in (("RGBA", 3), ("LA", 1)):
        layers = [np.full((HIGH, WIDE), 200.0)] * colours + [alpha]
        image = Image.merge(mode, [Image.fromarray(np.round(each).astype(np.uint8)) for each in layers])
        image.save(tmp_path / "clear.png")
        drawing = edge(tmp_path / "clear.png")
        assert off(drawing, HILL) < EXACT
        assert "what is opaque" in drawing.understood


@pytest.mark.parametrize("mode", ["1", "P", "RGB", "I;16", "RGBA"])
def test_kinds_of_pixels(mode: str, tmp_path: Path) -> None:
    values = np.round(grey(hill)).astype(np.uint8)
    image = Image.fromarray(values.astype(np.uint16) * 256) if mode == "I;16" else Image.fromarray(values).convert(mode)
    image.save(tmp_path / "hill.png")
    assert off(edge(tmp_path / "hill.png"), HILL) < (1.6 if mode == "1" else EXACT)


@pytest.mark.parametrize(("dpi", "code"), [(None, "no-unit"), ((72, 72), "no-unit"), ((300, 150), "no-unit")])
def test_a_picture_without_a_scale_is_refused(dpi: Any, code: str, tmp_path: Path) -> None:
    path = saved(tmp_path / "hill.png", grey(hill), **({"dpi": dpi} if dpi else {}))
    found, _, hint, _ = refusal(path)
    assert found == code
    assert "--width-mm 500" in hint
    drawing = read_drawing(path, HowToRead(width_mm=500.0))
    assert drawing.points[-1, 0] - drawing.points[0, 0] == pytest.approx(0.5)


def test_a_picture_has_no_unit_but_a_width(tmp_path: Path) -> None:
    code, _, hint, _ = refusal(saved(tmp_path / "hill.png", grey(hill)), unit="mm")
    assert (code, hint) == ("two-units", "say how wide the silhouette is: --width-mm 500")


def two(x: Any, y: Any) -> Any:
    return (np.hypot(x - 150, y - 100) < 60) | (np.hypot(x - 450, y - 100) < 50)


def half(x: Any, y: Any) -> Any:
    return (x < 300) & (y > -1)


def nothing(x: Any, y: Any) -> Any:
    return (x < -1) & (y < -1)


@pytest.mark.parametrize(
    ("shape", "code"), [(two, "several-curves"), (half, "no-background"), (nothing, "no-silhouette")]
)
def test_what_is_no_silhouette_is_refused(shape: Shape, code: str, tmp_path: Path) -> None:
    assert refusal(saved(tmp_path / "bad.png", grey(shape)), width_mm=500.0)[0] == code


def test_a_drawn_line_has_an_edge_too(tmp_path: Path) -> None:
    image = Image.new("L", (WIDE, HIGH), 255)
    ImageDraw.Draw(image).line([(50, 200), (300, 60), (550, 200)], fill=0, width=5)
    image.save(tmp_path / "line.png")
    drawing = edge(tmp_path / "line.png", width=500)
    peak = float(drawing.points[:, 1].max() * 1e3)
    assert peak == pytest.approx(HIGH - 60 + 2.5, abs=2.0)


def header(wide: int, high: int) -> bytes:
    """A PNG file that says it has so many pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = zlib.compress(bytes(1_000_000))
    start = chunk(b"IHDR", struct.pack(">IIBBBBB", wide, high, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + start + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(100_000, 100_000), (2**31 - 1, 2**31 - 1), (6_000, 6_000)])
def test_a_huge_picture_is_refused_before_it_is_unpacked(size: tuple[int, int], tmp_path: Path) -> None:
    path = tmp_path / "huge.png"
    path.write_bytes(header(*size))
    assert refusal(path, width_mm=500.0)[0] == "too-large"


@pytest.mark.parametrize("kind", ["png", "jpg"])
def test_what_is_left_of_a_picture_is_refused(kind: str, tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.fromarray(np.round(grey(hill)).astype(np.uint8)).save(stream, "PNG" if kind == "png" else "JPEG")
    path = tmp_path / f"cut.{kind}"
    path.write_bytes(stream.getvalue()[: len(stream.getvalue()) // 2])
    assert refusal(path, width_mm=500.0)[0] in ("cut-off", "damaged")


def test_a_photo_that_is_blurred_and_unevenly_lit(tmp_path: Path) -> None:
    random = np.random.default_rng(7)
    values = grey(hill)
    for axis in (0, 1, 0, 1):
        values = sum(np.roll(values, k, axis) for k in range(-2, 3)) / 5.0
    values[:8], values[-8:] = grey(hill)[:8], grey(hill)[-8:]
    values[:, :8], values[:, -8:] = grey(hill)[:, :8], grey(hill)[:, -8:]
    values = values * np.linspace(0.85, 1.0, WIDE) + random.normal(0.0, 3.0, values.shape)
    drawing = edge(saved(tmp_path / "photo.jpg", values, quality=85))
    y = np.interp(HILL[:, 0], *drawing.points.T * 1e3)
    assert np.sqrt(np.mean((y - HILL[:, 1]) ** 2)) < 0.6
