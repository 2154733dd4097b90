"""Camera files: read strictly with the place of every mistake, written and changed with comments kept."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.cameras.board_files import check_camera
from curveline.cameras.camera_file import folds, read_camera
from curveline.cameras.camera_text import lens_keys, new_text, with_lens
from curveline.cameras.setup import SeenNode
from curveline.cameras.view import SeenRod
from curveline.errors import InvalidInput
from curveline.shapes.files import read_display, read_shape

from . import scenes

DISPLAY = read_display("single")
LENS = replace(scenes.lens(), rms=0.21, focal_length=0.00425, equivalent=0.026)
KEYS = lens_keys(LENS, "Maker Phone")
TEXT = new_text(DISPLAY, scenes.frame(), KEYS)


def read(text: str, folder: Path) -> object:
    (folder / "camera.toml").write_text(text)
    return read_camera(folder / "camera.toml", DISPLAY)


def found(text: str, folder: Path) -> list[tuple[str, str]]:
    """Codes of what is wrong, and the lines in which it stands."""
    with pytest.raises(InvalidInput) as caught:
        read(text, folder)
    for each in caught.value.diagnostics:
        assert each.hint
        assert each.path.endswith("camera.toml")
    return [(each.code, each.source.split("#")[0].strip()) for each in caught.value.diagnostics]


def test_a_new_file_says_what_was_to_be_said(tmp_path: Path) -> None:
    (tmp_path / "camera.toml").write_text(TEXT)
    setup = read_camera(tmp_path / "camera.toml", DISPLAY)
    assert setup.lens.focal == pytest.approx(LENS.focal, abs=1e-3)
    assert setup.lens.distortion == pytest.approx(LENS.distortion, abs=1e-7)
    assert (setup.lens.size, setup.lens.rms) == (LENS.size, 0.21)
    assert (setup.lens.focal_length, setup.lens.equivalent) == pytest.approx((0.00425, 0.026))
    assert setup.frame.tags == scenes.frame().tags
    assert (setup.frame.size, setup.frame.depth) == pytest.approx((0.07, -0.012))
    assert setup.rod == SeenRod(back=DISPLAY.rod.thickness, depth=DISPLAY.rod.width)
    assert setup.node == SeenNode(0.025, 0.025)
    assert setup.source == str(tmp_path / "camera.toml")


def test_what_the_file_does_not_say_is_as_the_display_has_it(tmp_path: Path) -> None:
    short = TEXT[: TEXT.index("[rod]")]
    (tmp_path / "camera.toml").write_text(short)
    setup = read_camera(tmp_path / "camera.toml", DISPLAY)
    assert setup.rod == SeenRod(back=DISPLAY.rod.thickness, depth=DISPLAY.rod.width)
    assert setup.node == SeenNode(0.025, 0.025)


def test_teeth_and_nodes(tmp_path: Path) -> None:
    text = TEXT.replace('teeth = "none"', 'teeth = "down"\nteeth_mm = 2.25\npitch_mm = 3.1416\n#')
    text = text.replace("fibre_mm = 0.0", "fibre_mm = 0.08").replace("half_width_mm = 25", "half_width_mm = 40")
    (tmp_path / "camera.toml").write_text(text)
    setup = read_camera(tmp_path / "camera.toml", DISPLAY)
    rod = setup.rod
    assert (rod.teeth, rod.pitch, rod.fibre) == pytest.approx((0.00225, 0.0031416, 0.00008))
    assert rod.side == -1
    assert setup.node == SeenNode(0.04, 0.025)


def test_every_mistake_is_told_with_its_place(tmp_path: Path) -> None:
    for wrong, code in {
        "focal_px = [1, 2000.0]": "out-of-range",
        'focal_px = ["x", 2000.0]': "wrong-type",
        "focal_px = [2000.0]": "item-count",
        "focal_px = [nan, 2000.0]": "not-finite",
        "focus_px = [2000.0, 2000.0]": "unknown-key",
    }.items():
        line = next(line for line in TEXT.splitlines() if line.startswith("focal_px"))
        codes = dict(found(TEXT.replace(line, wrong), tmp_path))
        assert code in codes
    tag = "{ number = 1, at_mm = [250, 360], turn_deg = 0 },"
    assert tag in TEXT
    for wrong, code in {
        tag.replace("1", "0", 1): "duplicate-tag",
        tag.replace("[250, 360]", "[-100, 310]"): "tags-overlap",
        tag.replace("1", "587", 1): "out-of-range",
        tag.replace("turn_deg", "turned"): "unknown-key",
        tag.replace("360", "[1]"): "wrong-type",
    }.items():
        ((got, line),) = found(TEXT.replace(tag, wrong), tmp_path)
        assert got == code
        assert line == wrong


def test_what_does_not_fit_together(tmp_path: Path) -> None:
    assert found(TEXT.replace('"none"', '"up"  '), tmp_path) == [("no-teeth", 'teeth = "up"')] * 2
    assert found(TEXT.replace("[nodes]", "pitch_mm = 3\n[nodes]"), tmp_path) == [("no-side", "pitch_mm = 3")]
    wild = TEXT.replace("distortion = [0.09,", "distortion = [-9.0,")
    assert [code for code, _ in found(wild, tmp_path)] == ["lens-folds"]
    centre = next(line for line in TEXT.splitlines() if line.startswith("centre_px"))
    codes = [code for code, _ in found(TEXT.replace(centre, "centre_px = [99999, 700]"), tmp_path)]
    assert "out-of-range" in codes


def test_what_is_missing_says_what_makes_it(tmp_path: Path) -> None:
    text = new_text(DISPLAY, scenes.frame())
    with pytest.raises(InvalidInput) as caught:
        read(text, tmp_path)
    (only,) = caught.value.diagnostics
    assert (only.code, only.message) == ("missing-key", "lens is missing")
    assert "curveline camera calibrate PICTURES" in only.hint
    with pytest.raises(InvalidInput, match="the file says nothing"):
        read("", tmp_path)
    assert found("[lens", tmp_path)[0][0] == "toml-syntax"


def test_other_files_are_called_by_their_names(tmp_path: Path) -> None:
    display = Path("curveline/shapes/displays/single.toml")
    (tmp_path / "camera.toml").write_text((Path(__file__).parents[2] / display).read_text())
    with pytest.raises(InvalidInput, match="this is a display file, not a camera file"):
        read_camera(tmp_path / "camera.toml", DISPLAY)
    (tmp_path / "camera.toml").write_text(TEXT)
    with pytest.raises(InvalidInput, match="this is a camera file, not a display file"):
        read_display(tmp_path / "camera.toml")
    with pytest.raises(InvalidInput, match="this is a camera file, not a shape"):
        read_shape(tmp_path / "camera.toml")
    with pytest.raises(InvalidInput, match="a camera file ends in"):
        check_camera(tmp_path / "camera.json")


def test_a_new_lens_leaves_everything_else_as_it_was() -> None:
    mine = TEXT.replace("# side of the black square", "# mine").replace("[nodes]", "[nodes] # measured")
    other = lens_keys(scenes.lens(4032, 3024))
    changed = with_lens(mine, other, "camera.toml")
    assert tomllib.loads(changed) == {**tomllib.loads(mine), "lens": other}
    kept = [line for line in mine.splitlines() if not line.startswith(tuple(KEYS))]
    assert [line for line in changed.splitlines() if not line.startswith(tuple(KEYS))] == kept
    assert "# width and height, as the sensor takes pictures" in changed
    back = with_lens(changed, KEYS, "camera.toml")
    assert tomllib.loads(back) == tomllib.loads(mine)


def test_a_lens_is_added_to_a_file_without_one() -> None:
    text = new_text(DISPLAY, scenes.frame())
    changed = with_lens(text, KEYS, "camera.toml")
    assert changed.startswith(text.rstrip())
    assert tomllib.loads(changed)["lens"] == KEYS
    assert tomllib.loads(with_lens("", KEYS, "x")) == {"lens": KEYS}


def test_a_lens_that_is_written_in_another_way_is_left_alone() -> None:
    with pytest.raises(InvalidInput, match="left as it is"):
        with_lens("lens = { picture_px = [1, 2] }\n", KEYS, "x")
    with pytest.raises(InvalidInput, match="this is not TOML"):
        with_lens("[lens", KEYS, "x")


def test_names_that_toml_could_not_have() -> None:
    keys = lens_keys(LENS, 'A "B" \\C')
    assert tomllib.loads(with_lens("", keys, "x"))["lens"]["camera"] == "A B C"


def test_lenses_that_fold() -> None:
    assert not folds(LENS)
    assert not folds(replace(LENS, distortion=(-0.3, 0.1, 0.0, 0.0, 0.0)))
    assert folds(replace(LENS, distortion=(-2.0, 0.0, 0.0, 0.0, 0.0)))
