"""Pictures of the chessboard: where its corners are in each, or why a picture is of no use for a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from curveline.cameras.boards import COLUMNS, ROWS, charuco_board
from curveline.cameras.edge_width import edge_between
from curveline.cameras.opencv import opencv
from curveline.cameras.photographs import Photograph
from curveline.cameras.tag_detection import MOST_SMEAR, smear
from curveline.cameras.view import Array, Grey

CORNERS = (COLUMNS - 1) * (ROWS - 1)
LEAST_CORNERS = 16
"""Of a picture: fewer say nothing that is sure of how the board lies."""
MOST_BLUR = 0.12
"""Of a square: the width of its edges, from a tenth of the contrast to nine tenths."""
ALIKE = 0.02
"""Of the width of a picture, by which the corners must be elsewhere than in every other one."""
WIDE = 2200
"""[px] of the longer side at which markers are looked for first."""


class BoardOutcome(StrEnum):
    """What came of a picture of the board: `USED`, or why not."""

    USED = "used"
    UNREADABLE = "unreadable"
    OTHER_SIZE = "other-size"
    OTHER_LENS = "other-lens"
    NO_BOARD = "no-board"
    FEW_CORNERS = "few-corners"
    BLURRED = "blurred"
    ALIKE = "alike"
    BENT = "bent"


@dataclass(frozen=True)
class BoardPicture:
    """A picture of the chessboard, with its corners in pixels of the sensor."""

    source: str  # as the user named it
    outcome: BoardOutcome  # whether it was used, and if not, why
    reason: str = ""  # in a sentence, why it was not used; "" if it was
    numbers: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))  # (n,) of the corners seen
    corners: Array = field(default_factory=lambda: np.empty((0, 2)))  # (n, 2) [px]
    rms: float = 0.0  # [px] by which the calibrated lens misses the corners; 0 if not used
    tilt: float = 0.0  # [rad] of the board from facing the camera; 0 if not used

    def refused(self, outcome: BoardOutcome, reason: str) -> BoardPicture:
        """The same, not to be used."""
        return replace(self, outcome=outcome, reason=reason)


def board_in(photograph: Photograph) -> BoardPicture:
    """The corners of the chessboard in a photograph; MissingExtra without OpenCV."""
    grey = photograph.as_taken
    numbers, corners, markers = _found(grey)
    picture = BoardPicture(photograph.source, BoardOutcome.USED, "", numbers, corners)
    if len(numbers) < LEAST_CORNERS and smear(grey) > MOST_SMEAR:
        return picture.refused(BoardOutcome.BLURRED, "it is blurred: no edge in it is sharp")
    if markers == 0:
        return picture.refused(BoardOutcome.NO_BOARD, "no marker of the board is seen in it")
    blur = _blur(grey, numbers, corners)
    if blur > MOST_BLUR:
        reason = f"it is blurred: edges are {100.0 * blur:.0f} % of a square wide, at most {100.0 * MOST_BLUR:.0f} %"
        return picture.refused(BoardOutcome.BLURRED, f"{reason} can be used")
    if len(numbers) < LEAST_CORNERS:
        reason = f"{len(numbers)} of the {CORNERS} corners of the board are seen, {LEAST_CORNERS} are needed"
        return picture.refused(BoardOutcome.FEW_CORNERS, f"{reason}: come nearer, or cover less of it")
    return picture


def _found(grey: Grey) -> tuple[npt.NDArray[np.int64], Array, int]:
    """Numbers and places of corners, and how many markers were seen."""
    cv2 = opencv()
    longer = max(grey.shape)
    best: tuple[npt.NDArray[np.int64], Array, int] = (np.empty(0, np.int64), np.empty((0, 2)), 0)
    for scale in (min(1.0, WIDE / longer), 1.0):
        if len(best[0]) >= LEAST_CORNERS:
            break
        small = grey if scale == 1.0 else cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        corners, numbers, _, marker_numbers = cv2.aruco.CharucoDetector(charuco_board(1.0)).detectBoard(small)
        count = 0 if marker_numbers is None else len(marker_numbers)
        if numbers is not None and len(numbers) >= len(best[0]):
            rough = (np.asarray(corners, dtype=float).reshape(-1, 2) + 0.5) / scale - 0.5
            best = np.ravel(numbers).astype(np.int64), _exact(grey, rough, np.ravel(numbers)), count
        elif count > best[2]:
            best = best[0], best[1], count
    return best


def _exact(grey: Grey, rough: Array, numbers: npt.NDArray[np.int64]) -> Array:
    """Corners to a few hundredths of a pixel: where the four squares around each meet as a saddle."""
    cv2 = opencv()
    if len(rough) < 2:
        return rough
    # Within the white around the markers, however the board is turned.
    reach = int(np.clip(0.1 * _side(rough, numbers), 3, 12))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-4)
    corners = np.ascontiguousarray(rough, dtype=np.float32).reshape(-1, 1, 2)
    return np.asarray(cv2.cornerSubPix(grey, corners, (reach, reach), (-1, -1), stop), dtype=float).reshape(-1, 2)


def _pairs(numbers: npt.NDArray[np.int64]) -> list[tuple[int, int]]:
    """Positions of corners that are neighbours in a row of the board or in a column."""
    place = {int(number): index for index, number in enumerate(numbers)}
    wide = COLUMNS - 1
    found = []
    for number, index in place.items():
        if number % wide < wide - 1 and number + 1 in place:
            found.append((index, place[number + 1]))
        if number + wide in place:
            found.append((index, place[number + wide]))
    return found


def _side(corners: Array, numbers: npt.NDArray[np.int64]) -> float:
    """The shortest side of a square [px]; 30 where no two corners are neighbours."""
    return min((float(np.hypot(*(corners[one] - corners[other]))) for one, other in _pairs(numbers)), default=30.0)


def _blur(grey: Grey, numbers: npt.NDArray[np.int64], corners: Array) -> float:
    """Width of the edges between squares, as a part of a square: of the blurrier of the two directions."""
    widths: dict[bool, list[float]] = {True: [], False: []}
    for one, other in _pairs(numbers):
        found = edge_between(grey, corners[one], corners[other])
        if found is not None:
            is_row = abs(int(numbers[one]) - int(numbers[other])) == 1
            widths[is_row].append(found / float(np.hypot(*(corners[one] - corners[other]))))
    known = [float(np.median(each)) for each in widths.values() if each]
    # Where two corners are neighbours and no edge is between them, it is washed out.
    return max(known) if known else float(bool(_pairs(numbers)))


def apart(pictures: Sequence[BoardPicture], width: int) -> list[BoardPicture]:
    """The same pictures, those refused that show the board where an earlier one does."""
    kept: list[BoardPicture] = []
    found = []
    for each in pictures:
        if each.outcome is BoardOutcome.USED:
            twin = next((other for other in kept if _is_alike(each, other, width)), None)
            if twin is None:
                kept.append(each)
            else:
                reason = f"the board is where it is in {twin.source}: move it, or the camera, between pictures"
                each = each.refused(BoardOutcome.ALIKE, reason)
        found.append(each)
    return found


def _is_alike(one: BoardPicture, other: BoardPicture, width: int) -> bool:
    shared, here, there = np.intersect1d(one.numbers, other.numbers, return_indices=True)
    if len(shared) < LEAST_CORNERS // 2:
        return False
    off = np.hypot(*(one.corners[here] - other.corners[there]).T)
    return float(np.sqrt(np.square(off).mean())) < ALIKE * width
