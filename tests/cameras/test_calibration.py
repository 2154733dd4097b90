"""A lens is told by twelve pictures of the board to hundredths of a millimetre; pictures of no use say why."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from curveline.cameras.board_files import write_lens
from curveline.cameras.board_pictures import BoardOutcome, board_in
from curveline.cameras.camera_file import read_camera
from curveline.cameras.lens_calibration import LensCalibration, calibrate_lens
from curveline.cameras.lens_fit import displaced
from curveline.cameras.photographs import Photograph
from curveline.errors import InvalidInput
from curveline.shapes.files import read_display

from . import scenes

LENS = scenes.lens()
TOLERANCE = 0.02e-3


@cache
def pictures() -> tuple[Photograph, ...]:
    """Twelve of the board."""
    flat = scenes.chessboard()
    views = scenes.board_views(LENS, 12)
    taken = (scenes.photographed(flat, each, seed=number) for number, each in enumerate(views))
    return tuple(Photograph(grey, f"p{number}.jpg", 0.00425, 0.026, "Phone") for number, grey in enumerate(taken))


@cache
def calibration() -> LensCalibration:
    return calibrate_lens(pictures())


def test_twelve_pictures_tell_the_lens() -> None:
    found = calibration()
    assert found.lens is not None
    assert [each.outcome for each in found.pictures] == [BoardOutcome.USED] * 12
    off = displaced(LENS, found.lens, 1.0)
    assert float(np.sqrt(np.square(off).mean())) < TOLERANCE
    assert 0.3 * found.error < float(np.sqrt(np.square(off).mean())) < 3.0 * found.error
    assert found.lens.rms < 0.05
    assert found.covered > 0.9
    assert found.missing == ()
    assert (found.lens.focal_length, found.lens.equivalent, found.camera) == (0.00425, 0.026, "Phone")
    document = found.document()
    assert document["lens"]["picture_px"] == [1920, 1440]
    assert document["error_mm"] == pytest.approx(1e3 * found.error)
    assert len(document["pictures"]) == 12


@pytest.mark.campaign
def test_many_lenses_are_told() -> None:
    squares, stated = [], []
    flat = scenes.chessboard()
    for seed in range(50_000, 50_020):
        views = scenes.board_views(LENS, 12, seed)
        found = calibrate_lens(
            [Photograph(scenes.photographed(flat, each, seed=n), f"{n}") for n, each in enumerate(views)]
        )
        assert found.lens is not None
        squares.append(np.square(displaced(LENS, found.lens, 1.0)).mean())
        stated.append(found.error**2)
    assert np.sqrt(np.median(squares)) < TOLERANCE
    assert 0.4 < np.mean(squares) / np.mean(stated) < 2.5


def test_too_few_pictures_say_what_is_missing() -> None:
    found = calibrate_lens(pictures()[:5])
    assert found.lens is None
    assert found.missing[0] == "3 more pictures that can be used, of 8 at least"
    assert found.document()["error_mm"] is None


def test_pictures_of_no_use_say_why() -> None:
    good = pictures()[3].grey
    blurred = cv2.GaussianBlur(good, (0, 0), 7.0)
    hidden = good.copy()
    hidden[:, int(np.quantile(board_in(pictures()[3]).corners[:, 0], 0.35)) :] = 128
    others = {
        "blur": (blurred, BoardOutcome.BLURRED, "it is blurred"),
        "none": (np.full_like(good, 128), BoardOutcome.NO_BOARD, "no marker"),
        "small": (cv2.resize(good, None, fx=0.5, fy=0.5), BoardOutcome.OTHER_SIZE, "960 x 720 pixels, most have"),
        "twin": (pictures()[1].grey, BoardOutcome.ALIKE, "the board is where it is in p1.jpg"),
        "hidden": (hidden, BoardOutcome.FEW_CORNERS, "16 are needed"),
    }
    zoomed = Photograph(pictures()[4].grey, "zoom", 0.0085, 0.052)
    odd = [Photograph(grey, name) for name, (grey, _, _) in others.items()]
    found = calibrate_lens([*pictures()[:4], *odd, zoomed])
    assert found.lens is None
    by_name = {each.source: each for each in found.pictures}
    for name, (_, outcome, words) in others.items():
        assert (by_name[name].outcome, words in by_name[name].reason) == (outcome, True), by_name[name].reason
    assert by_name["zoom"].outcome is BoardOutcome.OTHER_LENS
    assert "8.5 mm, most at 4.25 mm" in by_name["zoom"].reason
    assert len(found.used) == 4


def test_a_board_that_bent_is_left_out() -> None:
    rows, columns = pictures()[5].grey.shape
    x, y = np.meshgrid(np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32))
    bent = cv2.remap(pictures()[5].grey, x + 4.0 * np.sin(y / 150.0), y, cv2.INTER_CUBIC)
    found = calibrate_lens([*pictures()[:5], Photograph(bent, "bent"), *pictures()[6:]])
    by_name = {each.source: each for each in found.pictures}
    assert by_name["bent"].outcome is BoardOutcome.BENT
    assert "pixels off where a flat board has them" in by_name["bent"].reason
    assert found.lens is not None
    assert len(found.used) == 11


def test_boards_that_face_the_camera_do_not_tell_the_lens() -> None:
    flat, lens = scenes.chessboard(), scenes.lens(960, 720)
    level = [
        scenes.view(lens, (0.126 + x, -0.16 + y, 0.45), (0.126 + x, -0.16 + y))
        for x in (-0.06, 0.0, 0.06)
        for y in (-0.05, 0.0, 0.05)
    ]
    found = calibrate_lens([Photograph(scenes.photographed(flat, each), f"{n}") for n, each in enumerate(level)])
    assert len(found.used) >= 8
    assert found.lens is None
    assert "4 more pictures with the board tilted by 20 to 40 degrees" in found.missing[0]


def test_pictures_that_were_turned_are_of_the_same_lens() -> None:
    from curveline.cameras.orientation import turned

    upright = [Photograph(turned(each.grey, 6), each.source, orientation=6) for each in pictures()[:4]]
    found = calibrate_lens([*upright, *pictures()[4:]])
    assert found.lens is not None
    assert len(found.used) == 12
    assert float(np.sqrt(np.square(displaced(LENS, found.lens, 1.0)).mean())) < TOLERANCE


def test_files_that_cannot_be_read_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.jpg").write_bytes(b"nothing")
    found = calibrate_lens([tmp_path / "a.jpg", tmp_path / "b.jpg"])
    assert [each.outcome for each in found.pictures] == [BoardOutcome.UNREADABLE] * 2
    assert "no picture in this file" in found.pictures[0].reason
    assert found.pictures[1].reason == "there is no such file"
    with pytest.raises(InvalidInput, match="no picture was named"):
        calibrate_lens([])


def test_the_lens_goes_into_a_camera_file(tmp_path: Path) -> None:
    display, path = read_display("single"), tmp_path / "camera.toml"
    write_lens(calibration(), path, display)
    setup = read_camera(path, display)
    assert calibration().lens is not None
    assert setup.lens.focal == pytest.approx(calibration().lens.focal, abs=1e-3)  # type: ignore[union-attr]
    path.write_text(path.read_text().replace("at_mm = [250, 648]", "at_mm = [251.5, 640]"))
    write_lens(calibration(), path, display)
    assert read_camera(path, display).frame.tags[1].centre == pytest.approx((0.2515, 0.64))
    with pytest.raises(InvalidInput, match="do not tell the lens"):
        write_lens(calibrate_lens(pictures()[:1]), path, display)
