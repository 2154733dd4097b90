"""What is printed for a camera: a chessboard with markers to calibrate its lens, and tags for the display's frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from curveline.cameras.opencv import opencv
from curveline.cameras.paper import SIZES, Paper
from curveline.cameras.printed_page import Ink, PrintedBox, PrintedPage, Words
from curveline.cameras.tag_layout import TAG_SIZE, frame_for
from curveline.cameras.view import Frame
from curveline.errors import InvalidInput
from curveline.scene import Display
from curveline.units import mm, to_deg, to_mm

COLUMNS, ROWS = 7, 9
"""Squares of the chessboard: odd counts, of which all versions of OpenCV have the same pattern."""
OF_A_SQUARE = 0.75
"""Side of a marker in its white square."""
DICTIONARY = "DICT_5X5_100"
SIDE_ROOM, FOOT_ROOM, HEAD_ROOM = 17.0, 30.0, 15.0
"""[mm] beside the chessboard for a ruler, below it for another and what to do, above it for a title."""
EDGE = 8.0
"""[mm] of a page that some printers leave white."""
RULER = 150.0
TICK = 3.0
LABEL = 9.0
LEAST_TAG = mm(20.0)


@dataclass(frozen=True)
class CameraBoard:
    """All that is printed for a camera, page by page."""

    pages: tuple[PrintedPage, ...]  # the chessboard first, then the tags
    frame: Frame  # where the tags are to be glued, unless they cannot be there
    square: float  # [m] of the chessboard


def camera_board(display: Display, paper: Paper | str = Paper.A4, tag: float = TAG_SIZE) -> CameraBoard:
    """The chessboard and the tags for the frame of a display, on pages of a size of `paper`; `tag` [m] is their side.

    InvalidInput for tags that are too small to be seen, or too large for the paper; MissingExtra without OpenCV.
    """
    if paper not in tuple(Paper):
        raise InvalidInput(f"no paper is called {paper!r}", f"choose one of {', '.join(Paper)}")
    size = SIZES[Paper(paper)]
    square = float(min((size[0] - 2.0 * SIDE_ROOM) // COLUMNS, (size[1] - FOOT_ROOM - HEAD_ROOM) // ROWS))
    frame = frame_for(display, tag)
    sheets = tuple(_tag_pages(display, frame, size))
    return CameraBoard((_board_page(square, size), *sheets), frame, mm(square))


def charuco_board(square: float) -> Any:
    """OpenCV's idea of the chessboard, whose squares are so wide."""
    return opencv().aruco.CharucoBoard((COLUMNS, ROWS), square, OF_A_SQUARE * square, _dictionary(DICTIONARY))


def _dictionary(name: str) -> Any:
    aruco = opencv().aruco
    return aruco.getPredefinedDictionary(getattr(aruco, name))


def _board_page(square: float, size: tuple[float, float]) -> PrintedPage:
    board = charuco_board(square)
    left, top = 0.5 * (size[0] - COLUMNS * square), HEAD_ROOM
    markers = [np.asarray(each)[:, :2].min(axis=0) for each in board.getObjPoints()]
    marked = {(int(x // square), int(y // square)) for x, y in markers}
    squares = tuple(
        PrintedBox(left + column * square, top + row * square, square, square)
        for row in range(ROWS)
        for column in range(COLUMNS)
        if (column, row) not in marked
    )
    inks = [Ink(squares)]
    for number, (x, y) in zip(np.ravel(board.getIds()), markers, strict=True):
        inks.append(_pattern(DICTIONARY, int(number), (left + x, top + y, OF_A_SQUARE * square)))
    about = f"{COLUMNS} x {ROWS} squares of {square:g} mm, markers of {OF_A_SQUARE * square:g} mm, {DICTIONARY}"
    title = Words(left, top - 5.0, 3.5, f"curveline: board for the lens, ChArUco, {about}")
    foot = top + ROWS * square + 6.0
    how = (
        "Glue it onto something flat. Take 12 pictures or more: near, tilted four ways, in each corner of the picture."
    )
    words = [title, Words(left, foot, 3.5, how)]
    across, across_words = _ruler(left, foot + 4.0, is_upright=False)
    upright, upright_words = _ruler(EDGE, top, is_upright=True)
    return PrintedPage("lens", *size, (*inks, across, upright), (*words, *across_words, *upright_words))


def _tag_pages(display: Display, frame: Frame, size: tuple[float, float]) -> Iterator[PrintedPage]:
    side = to_mm(frame.size)
    margin = side / 8.0 + TICK
    width, height = side + 2.0 * margin, side + 2.0 * margin + LABEL
    columns, rows = int((size[0] - 2.0 * EDGE) // width), int((size[1] - 2.0 * EDGE - 22.0) // height)
    if frame.size < LEAST_TAG:
        raise InvalidInput(f"tags of {side:g} mm are too small to be seen from afar", "make them 60 to 80 mm")
    if columns * rows == 0:
        most = int((size[0] - 2.0 * EDGE - 2.0 * TICK) / 1.25)
        raise InvalidInput(f"tags of {side:g} mm do not fit on this paper", f"take larger paper, or at most {most} mm")
    each_page = columns * rows
    pages = -(-len(frame.tags) // each_page)
    for page in range(pages):
        inks: list[Ink] = []
        words = [
            Words(EDGE, EDGE + 4.0, 3.5, f"curveline: tags for the frame of {display.name}, {page + 1} of {pages}")
        ]
        for place, tag in enumerate(frame.tags[page * each_page : (page + 1) * each_page]):
            row, column = divmod(place, columns)
            corner = EDGE + column * width, EDGE + 7.0 + row * height
            inks += _tag(tag.number, corner, side)
            where = f"x = {to_mm(tag.centre[0]):g}, y = {to_mm(tag.centre[1]):g} mm, turned by {to_deg(tag.turn):g} deg"
            foot = corner[1] + height - 3.0
            words += [Words(corner[0] + 3.0, foot, 7.0, str(tag.number)), Words(corner[0] + 16.0, foot, 3.0, where)]
        across, across_words = _ruler(EDGE, size[1] - EDGE - 12.0, is_upright=False)
        yield PrintedPage(f"tags-{page + 1}", *size, (*inks, across), (*words, *across_words))


def _tag(number: int, corner: tuple[float, float], side: float) -> list[Ink]:
    """A tag in its cell, with marks of its middle on all sides beyond the white that it needs, and where to cut."""
    margin = side / 8.0 + TICK
    x, y = corner
    width, height = side + 2.0 * margin, side + 2.0 * margin + LABEL
    middle, thin = 0.5 * width, 0.2
    marks = (
        PrintedBox(x + middle - 0.5 * thin, y, thin, TICK - 1.0),
        PrintedBox(x + middle - 0.5 * thin, y + width - TICK + 1.0, thin, TICK - 1.0),
        PrintedBox(x, y + middle - 0.5 * thin, TICK - 1.0, thin),
        PrintedBox(x + width - TICK + 1.0, y + middle - 0.5 * thin, TICK - 1.0, thin),
    )
    cuts = (
        PrintedBox(x, y, width, 0.1),
        PrintedBox(x, y + height, width, 0.1),
        PrintedBox(x, y, 0.1, height),
        PrintedBox(x + width, y, 0.1, height),
    )
    return [Ink(cuts, 0.6), Ink(marks), _pattern("DICT_APRILTAG_36h11", number, (x + margin, y + margin, side))]


def _pattern(dictionary: str, number: int, where: tuple[float, float, float]) -> Ink:
    """The black of a marker of a dictionary, whose upper left corner is at x and y, and its side [mm]."""
    known = _dictionary(dictionary)
    modules = int(known.markerSize) + 2
    black = np.asarray(opencv().aruco.generateImageMarker(known, number, modules)) == 0
    x, y, side = where
    step = side / modules
    boxes = []
    for row, line in enumerate(black):
        ends = np.flatnonzero(np.diff(np.concatenate([[False], line, [False]]).astype(int)))
        for begin, end in ends.reshape(-1, 2):
            boxes.append(PrintedBox(x + begin * step, y + row * step, (end - begin) * step, step))
    return Ink(tuple(boxes))


def _ruler(x: float, y: float, *, is_upright: bool) -> tuple[Ink, list[Words]]:
    """A ruler from a corner on, to the right or downwards, with what it is for."""
    boxes = [PrintedBox(x, y, 0.2, RULER) if is_upright else PrintedBox(x, y, RULER, 0.2)]
    words = []
    for at in np.arange(0.0, RULER + 1.0, 5.0):
        long = 3.0 if at % 10.0 == 0.0 else 1.8
        boxes.append(PrintedBox(x, y + at - 0.1, long, 0.2) if is_upright else PrintedBox(x + at - 0.1, y, 0.2, long))
        if at % 50.0 == 0.0:
            place = (x + 3.5, y + at + 1.0) if is_upright else (x + at - 1.0, y + 6.0)
            words.append(Words(*place, 2.8, f"{at:g}"))
    if not is_upright:
        words.append(Words(x, y + 10.5, 2.8, "Hold a ruler to these mm. If they differ, print again, in actual size."))
    return Ink(tuple(boxes)), words
