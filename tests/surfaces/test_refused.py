"""Surfaces that are none, too small, or damaged: refused with where, what and what to do; never a traceback."""

from __future__ import annotations

import contextlib
import io
import random
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import trimesh
from PIL import Image

from curveline.drawings.drawing import LARGEST
from curveline.errors import CurvelineError, InvalidInput, MissingExtra
from curveline.shapes.files import read_display
from curveline.surfaces import meshes
from curveline.surfaces.how_to_read import HowToReadSurface
from curveline.surfaces.laying import Laying, laid
from curveline.surfaces.reading import read_surface, surface_of_formula
from drawings.curves import written

from .meshes_known import IN_MM, box, field_of, sheet, stl

Array = npt.NDArray[np.float64]
Write = Callable[[str, str | bytes], Path]
PLATE = box((0.0, 0.0, 0.0), (500.0, 600.0, 30.0))
DAMAGED = 500
LONGEST_S = 20.0


@pytest.fixture
def write(tmp_path: Path) -> Write:
    return written(tmp_path)


def refusal(path: Path, how: HowToReadSurface = IN_MM) -> tuple[str, str, str]:
    """The code, the message and the hint with which a file is refused."""
    with pytest.raises(InvalidInput) as caught:
        read_surface(path, how)
    (first,) = caught.value.diagnostics
    assert first.path == str(path)
    assert first.hint
    return first.code, first.message, first.hint


def picture(mode: str = "L", size: tuple[int, int] = (20, 10), value: object = 128) -> bytes:
    stream = io.BytesIO()
    Image.new(mode, size, value).save(stream, "PNG")  # type: ignore[arg-type]
    return stream.getvalue()


def test_a_mesh_says_no_unit(write: Write) -> None:
    code, _, hint = refusal(write("plate.stl", stl(PLATE)), HowToReadSurface())
    assert code == "no-unit"
    assert "--unit mm" in hint


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("a.stl", b"", "empty"),
        ("a.stl", b" \n", "empty"),
        ("a.stl", b"solid nothing\nendsolid\n", "no-faces"),
        ("a.stl", b"hello", "damaged"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\n", "no-faces"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "damaged"),
        ("a.ply", b"hello", "damaged"),
        ("a.step", b"ISO-10303-21;", "kind"),
        ("a", b"ISO-10303-21;", "kind"),
        ("a.tif", b"II*\0", "kind"),
        ("a.png", b"hello", "damaged"),
        ("a.stl", stl(np.full((1, 3, 3), np.nan)), "not-finite"),
        ("a.stl", stl(np.full((2, 3, 3), np.inf)), "not-finite"),
        ("a.stl", stl(np.full((1, 3, 3), 5.0)), "no-width"),
        ("a.stl", stl(1e6 * PLATE), "far-away"),
        ("a.stl", stl(np.full((1, 3, 3), 3e38) * np.eye(3)), "far-away"),
        ("a.stl", stl(PLATE)[:200], "damaged"),
    ],
)
def test_files_that_are_no_surfaces(write: Write, name: str, content: bytes, code: str) -> None:
    how = HowToReadSurface(width_mm=100.0, height_mm=(0.0, 1.0)) if name.endswith("png") else IN_MM
    assert refusal(write(name, content), how)[0] == code


@pytest.mark.parametrize(
    ("content", "how", "code"),
    [
        (picture(), HowToReadSurface(width_mm=100.0), "no-height"),
        (picture(), HowToReadSurface(height_mm=(0.0, 50.0)), "no-unit"),
        (picture(), HowToReadSurface(unit="mm", height_mm=(0.0, 50.0)), "two-units"),
        (picture(), HowToReadSurface(width_mm=100.0, height_mm=(0.0, 50.0), up="y"), "up"),
        (picture("RGB", value=(200, 10, 10)), HowToReadSurface(width_mm=100.0, height_mm=(0.0, 50.0)), "coloured"),
        (picture("LA", value=(200, 10)), HowToReadSurface(width_mm=100.0, height_mm=(0.0, 50.0)), "clear"),
        (picture("L", (300, 200), 9)[:75], HowToReadSurface(width_mm=100.0, height_mm=(0.0, 50.0)), "cut-off"),
    ],
)
def test_pictures_that_are_no_surfaces(write: Write, content: bytes, how: HowToReadSurface, code: str) -> None:
    assert refusal(write("grey.png", content), how)[0] == code


@pytest.mark.parametrize(
    "how",
    [
        {"unit": "miles"},
        {"up": "w"},
        {"width_mm": -1.0},
        {"width_mm": float("nan")},
        {"width_mm": 5.0, "unit": "mm"},
        {"height_mm": (0.0, float("nan"))},
    ],
)
def test_ways_to_read_that_make_no_sense(how: dict[str, object]) -> None:
    with pytest.raises(InvalidInput):
        HowToReadSurface(**how)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "how",
    [
        {"lines": 0},
        {"lines": 65},
        {"pitch": 0.0},
        {"pitch": float("nan")},
        {"scale": "height"},
        {"shift_mm": float("inf")},
        {"depth_from_mm": float("nan")},
    ],
)
def test_layings_that_make_no_sense(how: dict[str, object]) -> None:
    with pytest.raises(InvalidInput):
        Laying(**how)  # type: ignore[arg-type]


def test_packages_that_are_missing_are_named(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    plate, grey = write("plate.stl", stl(PLATE)), write("grey.png", picture())
    for package in ("trimesh", "PIL"):
        monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtra, match="trimesh") as caught:
        read_surface(plate, IN_MM)
    assert "curveline[draw]" in caught.value.hint
    with pytest.raises(MissingExtra, match="Pillow"):
        read_surface(grey, HowToReadSurface(width_mm=100.0, height_mm=(0.0, 50.0)))


def test_heights_of_meshes_are_their_own(write: Write) -> None:
    with pytest.raises(InvalidInput, match="for pictures"):
        read_surface(write("plate.stl", stl(PLATE)), HowToReadSurface(unit="mm", height_mm=(0.0, 5.0)))


@pytest.mark.parametrize("text", ["x*z", "1/0*x", "sqrt(y-5)", "x+", "__import__('os')", "f(y)", "y.real", "log(-1)"])
def test_formulas_that_are_none(text: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        laid(surface_of_formula(text), read_display("single"), Laying(2))
    assert caught.value.hint


def test_a_formula_without_a_value_is_told_where() -> None:
    with pytest.raises(InvalidInput, match=r"has no value at x = 0 mm, y = 75 mm"):
        laid(surface_of_formula("sqrt(70-y)"), read_display("single"), Laying(2))


@pytest.mark.parametrize(
    ("triangles", "laying", "code"),
    [
        (PLATE * 0.5, Laying(), "too-narrow"),
        (PLATE, Laying(shift_mm=10.0), "too-narrow"),
        (PLATE, Laying(shift_mm=-10.0), "too-narrow"),
        (PLATE, Laying(10), "too-shallow"),
        (PLATE, Laying(depth_from_mm=100.0), "too-shallow"),
        (PLATE, Laying(depth_from_mm=-10.0), "too-shallow"),
        (
            sheet(lambda x, y: x, np.array([0.0, 500.0]), np.array([0.0, 50.0, 400.0]))[1:],
            Laying(2, depth_from_mm=10.0),
            "hole",
        ),
    ],
)
def test_surfaces_that_do_not_reach(triangles: Array, laying: Laying, code: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        laid(field_of(triangles), read_display("single"), laying)
    assert caught.value.diagnostics[0].code == code
    assert caught.value.diagnostics[0].hint


def test_a_hole_is_told_with_its_line_and_its_place() -> None:
    left, right = box((0.0, 0.0, 0.0), (200.0, 600.0, 30.0)), box((260.0, 0.0, 0.0), (500.0, 600.0, 30.0))
    under = box((0.0, 0.0, 0.0), (500.0, 300.0, 30.0))
    with pytest.raises(InvalidInput) as caught:
        laid(field_of(np.concatenate([left, right, under])), read_display("single"), Laying())
    message = caught.value.diagnostics[0].message
    assert message.startswith("under line 5, at y = 337.5 mm, nothing is there from x = 200 to 260 mm")


def test_what_rounding_leaves_between_faces_is_no_hole() -> None:
    left, right = box((0.0, 0.0, 0.0), (200.0, 600.0, 30.0)), box((200.005, 0.0, 0.0), (499.9, 600.0, 30.0))
    found = laid(field_of(np.concatenate([left, right])), read_display("single"), Laying())
    assert len(found.depths) == 8


def test_nothing_is_scaled_silently() -> None:
    where = laid(field_of(PLATE * 2.0), read_display("single"), Laying())
    assert "scaled" not in where.understood
    assert where.depths[0] == pytest.approx(0.3375)
    where = laid(field_of(PLATE * 2.0), read_display("single"), Laying(scale="width"))
    assert "scaled by 0.5 to the width of the display" in where.understood
    assert where.depths[0] == pytest.approx(2.0 * 0.0375)


def test_what_is_scaled_is_as_it_was_in_small() -> None:
    def hill(x: Array, y: Array) -> Array:
        return 40.0 * np.sin(np.pi * x / 500.0) * np.cos(np.pi * y / 900.0) + 0.02 * y

    small = sheet(hill, np.linspace(0.0, 500.0, 51), np.linspace(0.0, 600.0, 61))
    where = laid(field_of(small), read_display("single"), Laying(3, depth_from_mm=50.0))
    scaled = laid(field_of(0.5 * small), read_display("single"), Laying(3, scale="width", depth_from_mm=50.0))
    for one, other, depth, y in zip(where.sections, scaled.sections, where.depths, scaled.depths, strict=True):
        assert y == pytest.approx(0.5 * depth)
        x = np.linspace(0.0, 0.5, 99)
        heights = [np.interp(x, *each.points.T) for each in (one, other)]
        assert np.abs(heights[0] - heights[1]).max() < 1e-6
        assert np.ptp(heights[0]) > 0.03


def test_a_mesh_goes_where_nodes_can_be() -> None:
    where = laid(field_of(PLATE + np.array([30.0, 0.0, 4000.0])), read_display("single"), Laying())
    assert where.sections[0].points[:, 1] == pytest.approx(0.0)
    where = laid(surface_of_formula("44"), read_display("single"), Laying())
    assert where.sections[0].points[:, 1] == pytest.approx(0.044)


def test_files_that_are_too_large(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write("plate.stl", stl(PLATE))
    monkeypatch.setattr(meshes, "MOST_FACES", 11)
    assert refusal(path)[0] == "too-large"
    monkeypatch.setattr("curveline.surfaces.reading.MAX_BYTES", 100)
    assert refusal(path)[0] == "too-large"


def test_a_header_that_promises_more_than_there_is(write: Write) -> None:
    data = bytearray(stl(PLATE))
    data[80:84] = b"\xff\xff\xff\xff"
    assert refusal(write("plate.stl", bytes(data)))[0] == "damaged"
    begin = b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty double x\nend_header\n"
    assert refusal(write("plate.ply", begin + b"\0" * 64))[0] in ("damaged", "too-large")


def test_damaged_files_never_end_in_a_traceback(write: Write) -> None:
    source = random.Random(7)
    mesh = trimesh.Trimesh(PLATE.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    whole = {"stl": stl(PLATE)}
    for kind in ("obj", "ply", "stl_ascii"):
        made = mesh.export(file_type=kind)
        whole[kind] = made.encode() if isinstance(made, str) else made
    display, laying = read_display("single"), Laying(2)
    for number in range(DAMAGED):
        kind = ("stl", "stl", "stl_ascii", "obj", "ply")[number % 5]
        path = write(f"damaged.{kind[:3]}", damaged(whole[kind], source))
        begin = time.monotonic()
        with contextlib.suppress(CurvelineError):
            for section in laid(read_surface(path, IN_MM), display, laying).sections:
                assert np.abs(section.points).max() <= LARGEST
        assert time.monotonic() - begin < LONGEST_S


def damaged(data: bytes, source: random.Random) -> bytes:
    """A file with bytes changed, taken out, doubled or cut off."""
    out = bytearray(data)
    for _ in range(source.choice((1, 1, 3, 20))):
        place = source.randrange(len(out)) if out else 0
        match source.randrange(5):
            case 0:
                out[place : place + 1] = bytes([source.randrange(256)])
            case 1:
                del out[place : place + source.choice((1, 4, 50))]
            case 2:
                out[place:place] = out[place : place + 50]
            case 3:
                out[place : place + 4] = source.choice(
                    (b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f", b" nan", b"1e99", b"-  \n")
                )
            case 4:
                del out[source.randrange(len(out) // 2, len(out) + 1) if len(out) > 1 else 0 :]
    return bytes(out)
