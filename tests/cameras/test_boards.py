"""What is printed has its size to a hundredth of a millimetre, and OpenCV finds it again."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import numpy as np
import pytest

from curveline.cameras.board_files import write_board
from curveline.cameras.board_pictures import CORNERS
from curveline.cameras.boards import camera_board, charuco_board
from curveline.cameras.camera_file import read_camera
from curveline.cameras.camera_text import lens_keys, with_lens
from curveline.cameras.paper import SIZES, Paper
from curveline.cameras.printed_page import PrintedPage, Words, to_pdf, to_svg
from curveline.cameras.tag_layout import frame_for
from curveline.errors import InvalidInput
from curveline.shapes.files import read_display
from curveline.units import mm, to_mm

from . import scenes

SINGLE, QUAD = read_display("single"), read_display("quad")
BOARD = camera_board(SINGLE)
SCALE = 8
"""Pixels of a mm, when pages are looked at."""
Boxes = list[tuple[float, tuple[float, float, float, float]]]
"""Grey level from 0 to 1; x, y, width and height [mm] from the upper left corner."""


def boxes_of_svg(data: bytes) -> Boxes:
    """What an SVG file draws: its own numbers, read by another program than that which wrote them."""
    root = ET.fromstring(data)
    width, height = (float(root.attrib[key].removesuffix("mm")) for key in ("width", "height"))
    assert [float(each) for each in root.attrib["viewBox"].split()] == [0.0, 0.0, width, height]
    found: Boxes = []
    for path in root.iter("{http://www.w3.org/2000/svg}path"):
        fill = path.attrib["fill"]
        grey = 1.0 if fill == "white" else int(re.findall(r"\d+", fill)[0]) / 255.0
        for box in re.findall(r"M([-\d.]+) ([-\d.]+)h([-\d.]+)v([-\d.]+)h([-\d.]+)z", path.attrib["d"]):
            x, y, across, down, back = map(float, box)
            assert across == -back
            found.append((grey, (x, y, across, down)))
    return found


def boxes_of_pdf(data: bytes) -> list[Boxes]:
    """What a PDF file draws on each page, through its own matrix from mm to points."""
    pages = []
    for content in re.findall(rb"stream\n(.*?)\nendstream", data, re.DOTALL):
        lines = content.decode("latin-1").splitlines()
        a, _, _, d, _, up = map(float, lines[0].removesuffix(" cm").split())
        assert a == -d
        found: Boxes = []
        for line in lines[1:]:
            if line.endswith(" f"):
                grey, rest = line.split(" g ", 1)
                numbers = np.array([float(each) for each in re.findall(r"[-\d.]+", rest)]).reshape(-1, 4)
                for x, y, width, height in numbers:
                    points = (a * x, up + d * y, a * width, -d * height)
                    inch = [each / 72.0 * 25.4 for each in points]
                    found.append((float(grey), (inch[0], up / 72.0 * 25.4 - inch[1], inch[2], inch[3])))
        pages.append(found)
    return pages


def drawn(boxes: Boxes, size: tuple[float, float]) -> np.ndarray:
    """A page as a picture of `SCALE` pixels a mm."""
    picture = np.full((round(size[1] * SCALE), round(size[0] * SCALE)), 255, np.uint8)
    for grey, (x, y, width, height) in boxes:
        rows, columns = (slice(round(a * SCALE), round((a + b) * SCALE)) for a, b in ((y, height), (x, width)))
        picture[rows, columns] = round(255 * grey)
    return picture


def test_an_svg_page_and_a_pdf_page_are_the_same() -> None:
    pages = boxes_of_pdf(to_pdf(BOARD.pages))
    assert len(pages) == len(BOARD.pages) == 3
    for page, from_pdf in zip(BOARD.pages, pages, strict=True):
        from_svg = boxes_of_svg(to_svg(page))[1:]
        assert len(from_svg) == len(from_pdf)
        for (_, one), (_, other) in zip(from_svg, from_pdf, strict=True):
            assert one == pytest.approx(other, abs=1e-3)


@pytest.mark.parametrize("paper", Paper)
def test_the_chessboard_is_found_and_has_its_size(paper: Paper) -> None:
    board = camera_board(SINGLE, paper)
    page = board.pages[0]
    assert (page.width, page.height) == SIZES[paper]
    picture = drawn(boxes_of_svg(to_svg(page)), SIZES[paper])
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(charuco_board(1.0)).detectBoard(picture)
    assert sorted(np.ravel(numbers)) == list(range(CORNERS))
    places = np.asarray(corners).reshape(-1, 2)[np.argsort(np.ravel(numbers))] / SCALE
    wanted = np.asarray(charuco_board(to_mm(board.square)).getChessboardCorners())[:, :2]
    off = (places - places.mean(axis=0)) - (wanted - wanted.mean(axis=0))
    assert np.abs(off).max() < 0.02
    squares = {round(box[2], 4) for grey, box in boxes_of_svg(to_svg(page)) if grey == 0.0 and box[2] == box[3]}
    assert round(to_mm(board.square), 4) in squares


@pytest.mark.parametrize(("display", "side"), [(SINGLE, 70.0), (QUAD, 60.0), (SINGLE, 43.7)])
def test_tags_are_found_and_have_their_size(display: object, side: float) -> None:
    board = camera_board(display, tag=mm(side))  # type: ignore[arg-type]
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
    found: list[int] = []
    for page in board.pages[1:]:
        boxes = boxes_of_svg(to_svg(page))
        corners, numbers, _ = detector.detectMarkers(drawn(boxes, (page.width, page.height)))
        found += [int(number) for number in np.ravel(numbers)]
        for each in corners:
            low, high = each.reshape(4, 2).min(axis=0) / SCALE, (each.reshape(4, 2).max(axis=0) + 1.0) / SCALE
            assert high - low == pytest.approx([side, side], abs=0.3)
            # Of the boxes that are drawn, the outermost ones of this tag, to a hundredth of a millimetre.
            inside = [box for grey, box in boxes if grey == 0.0 and is_within(box, low - 1.0, high + 1.0)]
            left, top = min(box[0] for box in inside), min(box[1] for box in inside)
            right, foot = max(box[0] + box[2] for box in inside), max(box[1] + box[3] for box in inside)
            assert (right - left, foot - top) == pytest.approx((side, side), abs=0.01)
            # A printed tag has a white square around it, and marks of its middle beyond.
            middle = 0.5 * (left + right)
            marks = [box for grey, box in boxes if grey == 0.0 and abs(box[0] + 0.5 * box[2] - middle) < 0.01]
            assert any(box[2] == 0.2 and box[1] < top - side / 8.0 for box in marks)
    assert sorted(found) == [tag.number for tag in board.frame.tags]


def is_within(box: tuple[float, float, float, float], low: np.ndarray, high: np.ndarray) -> bool:
    x, y, width, height = box
    return bool(x >= low[0] and y >= low[1] and x + width <= high[0] and y + height <= high[1])


def test_the_ruler_has_its_length() -> None:
    for page in BOARD.pages:
        lines = [box for _, box in boxes_of_svg(to_svg(page)) if min(box[2:]) == 0.2 and max(box[2:]) == 150.0]
        assert lines
        assert any(box[2] == 150.0 for box in lines)
    assert any(box[3] == 150.0 for _, box in boxes_of_svg(to_svg(BOARD.pages[0])))


def test_nothing_is_printed_where_printers_leave_white() -> None:
    for paper in Paper:
        for page in camera_board(QUAD, paper).pages:
            for ink in page.inks:
                for x, y, width, height in ink.boxes:
                    assert min(x, y) >= 5.0
                    assert x + width <= page.width - 5.0
                    assert y + height <= page.height - 5.0
            assert all(words.y <= page.height - 4.0 for words in page.words)


@pytest.mark.parametrize("display", [SINGLE, QUAD])
def test_no_rod_can_be_before_a_tag(display: object) -> None:
    made = frame_for(display)  # type: ignore[arg-type]
    limits = SINGLE.limits
    assert len(made.tags) >= 6
    for tag in made.tags:
        # Of a rod between two rails, the sum of the ways to both ends is at most its length.
        edge = abs(tag.centre[1]) - 0.5 * made.size
        reach = [np.hypot(0.25, edge - height) * 2.0 for height in (limits.height.high, -limits.height.low)]
        assert min(reach) > limits.length.high
    assert {tag.centre[1] > 0.0 for tag in made.tags} == {True, False}


def test_a_long_row_has_tags_all_along() -> None:
    from dataclasses import replace

    assert [len(frame_for(replace(QUAD, node_count=count)).tags) for count in (5, 24, 128)] == [10, 48, 44]


def test_text_that_pdf_and_svg_must_escape() -> None:
    page = PrintedPage("a<b", 100.0, 100.0, (), (Words(1.0, 2.0, 3.0, "(50 % \\ <&> é)"),))
    assert ET.fromstring(to_svg(page))[-1].text == "(50 % \\ <&> é)"
    assert rb"(\(50 % \\ <&> " + "é".encode("latin-1") + rb"\))" in to_pdf([page])


def test_a_pdf_has_a_table_of_where_its_parts_are() -> None:
    data = to_pdf(BOARD.pages)
    start = int(re.findall(rb"startxref\n(\d+)", data)[0])
    assert data[start : start + 4] == b"xref"
    for number, offset in enumerate(re.findall(rb"(\d{10}) 00000 n", data), start=1):
        assert data[int(offset) :].startswith(b"%d 0 obj" % number)
    assert b"/PrintScaling /None" in data


@pytest.mark.parametrize(
    ("paper", "tag", "words"),
    [("a5", 70.0, "no paper is called"), ("a4", 10.0, "too small"), ("a4", 151.0, "do not fit")],
)
def test_what_cannot_be_printed(paper: str, tag: float, words: str) -> None:
    with pytest.raises(InvalidInput, match=words) as caught:
        camera_board(SINGLE, paper, mm(tag))
    assert caught.value.hint


def test_the_largest_tag_that_is_advised_fits() -> None:
    for paper in Paper:
        with pytest.raises(InvalidInput) as caught:
            camera_board(SINGLE, paper, mm(1000.0))
        most = float(re.findall(r"at most ([\d.]+) mm", caught.value.hint)[0])
        assert len(camera_board(SINGLE, paper, mm(most)).pages) == 7


def test_files(tmp_path: Path) -> None:
    paths = [tmp_path / "b.pdf", tmp_path / "b.svg", tmp_path / "camera.toml"]
    names = write_board(BOARD, SINGLE, paths)
    assert [Path(name).name for name in names] == [
        "b.pdf",
        "b-lens.svg",
        "b-tags-1.svg",
        "b-tags-2.svg",
        "camera.toml",
    ]
    with pytest.raises(InvalidInput, match="exists already"):
        write_board(BOARD, SINGLE, paths[:1])
    write_board(BOARD, SINGLE, paths, force=True)
    with pytest.raises(InvalidInput, match="cannot tell the format"):
        write_board(BOARD, SINGLE, [tmp_path / "b.png"])
    text = (tmp_path / "camera.toml").read_text()
    (tmp_path / "camera.toml").write_text(with_lens(text, lens_keys(scenes.lens()), "camera.toml"))
    read = read_camera(tmp_path / "camera.toml", SINGLE)
    assert read.frame == BOARD.frame
