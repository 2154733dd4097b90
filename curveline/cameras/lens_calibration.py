"""A lens from photographs of the printed board: which of them were used, how exact it is, what is still missing."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from curveline.cameras.board_pictures import BoardOutcome, BoardPicture, apart, board_in
from curveline.cameras.camera_file import folds
from curveline.cameras.camera_text import lens_keys
from curveline.cameras.lens_fit import fit_lens, lens_error
from curveline.cameras.opencv import opencv
from curveline.cameras.photographs import SAME_FOCAL, Photograph, read_photograph, require_pictures
from curveline.cameras.view import Array, Lens
from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.phrases import counted
from curveline.units import deg, mm, to_deg, to_mm

LEAST_PICTURES = 8
DISTANCE = 1.0
"""[m] from the camera at which the error of positions is told."""
BENT = 3.0
BENT_PX = 0.5
"""How much worse than the middle one a picture fits whose board was bent or moved, and by how many pixels at least."""
CELLS = (6, 4)
"""Across and down, into which a picture is divided to see where the board was."""
LEAST_COVERED = 0.75
"""Of these."""
TILTED = deg(15.0)
LEAST_TILTED = 4
MOST_ERROR = mm(0.2)
"""[m] at `DISTANCE`, beyond which a lens is not told well enough."""


@dataclass(frozen=True)
class LensCalibration:
    """What photographs of the board tell of a lens."""

    lens: Lens | None  # None if they do not tell enough
    pictures: tuple[BoardPicture, ...]  # in the order in which they were given
    error: float  # [m] standard error of a position 1 m away, along x or y; infinite if there is no telling
    covered: float  # part of the picture in which the board was seen
    missing: tuple[str, ...]  # what to photograph besides, in sentences; of a lens that is told, what would be better
    camera: str = ""  # maker and model, if the pictures tell one

    @property
    def used(self) -> tuple[BoardPicture, ...]:
        """The pictures by which the lens was found."""
        return tuple(each for each in self.pictures if each.outcome is BoardOutcome.USED)

    def document(self) -> dict[str, Any]:
        """All of it as JSON has it."""
        return {
            "lens": None if self.lens is None else lens_keys(self.lens, self.camera),
            "error_mm": to_mm(self.error) if np.isfinite(self.error) else None,
            "error_at_mm": to_mm(DISTANCE),
            "covered": round(self.covered, 4),
            "missing": list(self.missing),
            "pictures": [
                {
                    "picture": each.source,
                    "outcome": each.outcome.value,
                    "reason": each.reason,
                    "corners": len(each.numbers),
                    "rms_px": round(each.rms, 4),
                    "tilt_deg": round(to_deg(each.tilt), 2),
                }
                for each in self.pictures
            ],
        }


@dataclass(frozen=True)
class _Taken:
    """A `picture` of the board, its `size` [px], and with what `camera` and focal lengths [m] it was taken."""

    picture: BoardPicture
    size: tuple[int, int]
    focal_length: float | None = None
    equivalent: float | None = None
    camera: str = ""


def calibrate_lens(
    pictures: Sequence[str | os.PathLike[str] | Photograph], listener: Listener = SILENT
) -> LensCalibration:
    """The lens of a camera from photographs of the board that `camera_board` prints: files, or what was read of them.

    A picture that cannot be used says why; `lens` is None if the others are too few or too much alike, and `missing`
    says what to photograph besides. InvalidInput for no picture at all; MissingExtra without OpenCV or Pillow.
    """
    if not pictures:
        raise InvalidInput("no picture was named", "take 12 pictures of the board that `curveline camera board` prints")
    opencv()
    require_pictures()
    taken = []
    with listener.progress("looking for the board, pictures", len(pictures)) as heard:
        for done, each in enumerate(pictures, start=1):
            taken.append(_taken(each))
            heard(done)
    taken = _of_one_lens(_of_one_size(taken))
    used = [each for each in taken if each.picture.outcome is BoardOutcome.USED]
    size = used[0].size if used else (1, 1)
    found = apart([each.picture for each in taken], size[0])
    calibration = _calibrated(found, size)
    if calibration.lens is None or not used:
        return calibration
    told = {key: _commonest(used, key) for key in ("focal_length", "equivalent")}
    return replace(calibration, lens=replace(calibration.lens, **told), camera=_commonest(used, "camera") or "")


def _taken(picture: str | os.PathLike[str] | Photograph) -> _Taken:
    """A picture of the board; what is wrong with its file is why it is not used."""
    try:
        photograph = picture if isinstance(picture, Photograph) else read_photograph(picture)
    except InvalidInput as error:
        reason = error.diagnostics[0].message if error.diagnostics else error.message
        return _Taken(BoardPicture(str(picture), BoardOutcome.UNREADABLE, reason), (0, 0))
    rows, columns = photograph.as_taken.shape
    told = photograph.focal_length, photograph.equivalent, photograph.camera
    return _Taken(board_in(photograph), (columns, rows), *told)


def _commonest(taken: Sequence[_Taken], key: str) -> Any:
    """What most of those pictures tell that tell it; None if none does."""
    told = Counter(value for each in taken if (value := getattr(each, key)))
    return told.most_common(1)[0][0] if told else None


def _of_one_size(taken: Sequence[_Taken]) -> list[_Taken]:
    """The same pictures, those refused whose size is not that of most."""
    able = [each for each in taken if each.picture.outcome is BoardOutcome.USED]
    size = _commonest(able, "size")
    kept = []
    for each in taken:
        picture = each.picture
        if picture.outcome is BoardOutcome.USED and each.size != size:
            has, most = (f"{width} x {height}" for width, height in (each.size, size))
            reason = f"it has {has} pixels, most have {most}: a lens is calibrated for one size"
            picture = picture.refused(BoardOutcome.OTHER_SIZE, reason)
        kept.append(replace(each, picture=picture))
    return kept


def _of_one_lens(taken: Sequence[_Taken]) -> list[_Taken]:
    """The same pictures, those refused whose focal length is not that of most, in either way of telling it."""
    able = [each for each in taken if each.picture.outcome is BoardOutcome.USED]
    common = {key: _commonest(able, key) for key in ("focal_length", "equivalent")}
    kept = []
    for each in taken:
        picture = each.picture
        for key, most in common.items():
            own = getattr(each, key)
            if picture.outcome is BoardOutcome.USED and own and abs(own - most) > SAME_FOCAL * most:
                zoom = f"at {to_mm(own):.3g} mm, most at {to_mm(most):.3g} mm"
                reason = f"it was taken {zoom}: a lens is calibrated for one zoom"
                picture = picture.refused(BoardOutcome.OTHER_LENS, reason)
        kept.append(replace(each, picture=picture))
    return kept


def _calibrated(pictures: Sequence[BoardPicture], size: tuple[int, int]) -> LensCalibration:
    used = [each for each in pictures if each.outcome is BoardOutcome.USED]
    covered = _covered(used, size)
    if len(used) < LEAST_PICTURES:
        few = f"{counted(LEAST_PICTURES - len(used), 'more picture')} that can be used, of {LEAST_PICTURES} at least"
        missing = (few, *_not_covered(used, size)) if used else (few,)
        return LensCalibration(None, tuple(pictures), np.inf, covered, missing)
    lens, fitted = fit_lens(used, size)
    most = max(BENT_PX, BENT * float(np.median([each.rms for each in fitted])))
    told = iter(each if each.rms <= most else _bent(each) for each in fitted)
    after = tuple(next(told) if each.outcome is BoardOutcome.USED else each for each in pictures)
    if any(each.rms > most for each in fitted):
        return _calibrated(after, size)
    error = lens_error(lens, fitted, DISTANCE)
    is_enough, missing = _judged(fitted, size, error)
    return LensCalibration(lens if is_enough and not folds(lens) else None, after, error, covered, missing)


def _bent(picture: BoardPicture) -> BoardPicture:
    reason = f"its corners are {picture.rms:.2g} pixels off where a flat board has them: bent, or moved"
    return picture.refused(BoardOutcome.BENT, reason)


def _judged(fitted: Sequence[BoardPicture], size: tuple[int, int], error: float) -> tuple[bool, tuple[str, ...]]:
    """Whether pictures tell enough of a lens, and what would be better."""
    missing = list(_not_covered(fitted, size))
    tilted = sum(each.tilt > TILTED for each in fitted)
    if tilted < LEAST_TILTED:
        more = counted(LEAST_TILTED - tilted, "more picture")
        missing.insert(0, f"{more} with the board tilted by 20 to 40 degrees, to the left, the right, up and down")
    if error > MOST_ERROR and not missing:
        missing.append("sharper pictures, from nearer, of a board that is flat")
    return tilted >= LEAST_TILTED and error <= MOST_ERROR, tuple(missing)


def _cells(pictures: Sequence[BoardPicture], size: tuple[int, int]) -> Array:
    """In which cells of the picture (down, across) a corner of the board was seen."""
    seen = np.zeros(CELLS[::-1], dtype=float)
    for each in pictures:
        places = np.clip((each.corners / size * CELLS).astype(int), 0, np.subtract(CELLS, 1))
        seen[places[:, 1], places[:, 0]] = 1.0
    return seen


def _covered(pictures: Sequence[BoardPicture], size: tuple[int, int]) -> float:
    return float(_cells(pictures, size).mean())


def _not_covered(pictures: Sequence[BoardPicture], size: tuple[int, int]) -> Iterator[str]:
    """Where the board should be seen, too."""
    seen = _cells(pictures, size)
    corners = {
        "upper left": seen[:2, :2],
        "upper right": seen[:2, -2:],
        "lower left": seen[-2:, :2],
        "lower right": seen[-2:, -2:],
    }
    bare = [name for name, part in corners.items() if part.mean() < LEAST_COVERED]
    if bare:
        yield f"the board in the {', '.join(bare)} of the picture"
    elif seen.mean() < LEAST_COVERED:
        yield "the board nearer, so that it fills the picture"
