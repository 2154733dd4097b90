"""`curveline camera`: what it writes and says, and its exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import pytest

from curveline.cameras.camera_text import lens_keys, new_text
from curveline.shapes.files import read_display
from tests.cameras import scenes

from .conftest import Run

LENS = scenes.lens(1440, 1080)
"""Of the pictures here."""


@pytest.fixture
def camera(tmp_path: Path) -> Path:
    """A camera file for the display `single`."""
    path = tmp_path / "camera.toml"
    path.write_text(new_text(read_display("single"), scenes.frame(), lens_keys(LENS)))
    return path


def picture(path: Path, moved: dict[int, tuple[float, float, float]] | None = None) -> Path:
    view = scenes.view(LENS, (0.3, 0.1, 1.25), (0.25, 0.0))
    assert cv2.imwrite(str(path), scenes.photographed(scenes.wall(scenes.frame(), moved), view))
    return path


def test_board(run: Run, tmp_path: Path) -> None:
    code, out, err = run("camera", "board", "-o", tmp_path / "b.pdf", "-o", tmp_path / "camera.toml", "--paper", "a3")
    assert code == 0
    assert "the board for the lens, whose squares are 37 mm, and 6 tags of 70 mm" in " ".join(out.split())
    assert "5   500  -648" in out
    assert f"wrote {tmp_path / 'camera.toml'}" in err
    assert (tmp_path / "b.pdf").read_bytes().startswith(b"%PDF")
    code, _, err = run("camera", "board", "-o", tmp_path / "b.pdf")
    assert code == 2
    assert "--force" in err
    assert run("camera", "board", "-o", tmp_path / "b.pdf", "--force", "--tag-mm", "60").code == 0
    code, _, err = run("camera", "board")
    assert (code, "add -o board.pdf" in err) == (2, True)


def test_pose(run: Run, tmp_path: Path, camera: Path) -> None:
    code, out, _ = run("camera", "pose", picture(tmp_path / "a.png"), "--camera", camera)
    assert code == 0
    assert "the camera stood at x = 300, y = 100 mm, 1250 mm before the rod" in " ".join(out.split())
    assert len([line for line in out.splitlines() if line.split()[0] in "012345"]) == 6
    picture(tmp_path / "b.png", {1: (5e-3, 0.0, 0.0)})
    code, out, _ = run("camera", "pose", tmp_path / "b.png", "--camera", camera, "--json")
    document = json.loads(out)
    assert code == 0
    assert document["notes"] == ["tag 1 is left out, off by 5.0 mm: its middle is at x = 255.0, y = 360.0 mm"]
    assert [tag["used"] for tag in document["tags"]] == [True, False, True, True, True, True]


def test_a_pose_that_cannot_be_told(run: Run, tmp_path: Path, camera: Path) -> None:
    picture(tmp_path / "a.png", {1: (5e-3, 0.0, 0.0), 3: (0.0, 8e-3, 0.0)})
    code, out, _ = run("camera", "pose", tmp_path / "a.png", "--camera", camera)
    assert code == 1
    assert out.startswith("tags-disagree: by tags 0, 2, 4, 5, which agree: tag 1 is")
    code, out, _ = run("camera", "pose", tmp_path / "a.png", "--camera", camera, "--json")
    assert (code, json.loads(out)["outcome"]) == (1, "tags-disagree")
    assert run("camera", "pose", tmp_path / "a.png").code == 2
    assert run("camera", "pose", tmp_path / "none.png", "--camera", camera).code == 2
    assert run("camera", "pose", camera, "--camera", camera).code == 2


def test_calibrate(run: Run, tmp_path: Path) -> None:
    flat, lens = scenes.chessboard(), scenes.lens(960, 720)
    names = []
    for number, view in enumerate(scenes.board_views(lens, 10)):
        names.append(tmp_path / f"{number}.png")
        assert cv2.imwrite(str(names[-1]), scenes.photographed(flat, view, seed=number))
    (tmp_path / "bad.jpg").write_bytes(b"nothing")
    output = tmp_path / "camera.toml"
    code, out, err = run("camera", "calibrate", *names, tmp_path / "bad.jpg", "-o", output)
    assert code == 0
    words = " ".join(out.split())
    assert "10 of 11 pictures used" in words
    assert "bad.jpg is not used: there is no picture in this file that is known here" in words
    assert "positions on a display 1000 mm away will be off by 0.0" in words
    assert f"wrote [lens] into {output}" in err
    assert output.read_text().count("[lens]") == 1
    before = output.read_text()
    code, out, _ = run("camera", "calibrate", *names[:3], "-o", output, "--json")
    assert code == 1
    document = json.loads(out)
    assert document["lens"] is None
    assert document["missing"][0] == "5 more pictures that can be used, of 8 at least"
    assert output.read_text() == before
    (tmp_path / "shape.toml").write_text('name = "x"\ndisplay = "single"\n[[nodes]]\n[[segments]]\n')
    code, _, err = run("camera", "calibrate", *names[:3], "-o", tmp_path / "shape.toml")
    assert (code, "this is a shape, not a camera file" in err) == (2, True)
