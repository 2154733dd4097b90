"""A natural curvature that varies along the rod: from a display file, or a CSV file beside it, to the scene."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from curveline.cli.app import app
from curveline.displays.check import check_of
from curveline.errors import InvalidInput
from curveline.rod.natural_curvature import NaturalCurvature
from curveline.scene import Profile
from curveline.shapes.files import builtin_text, read_display, read_shape

SHAPES = Path(__file__).parents[2] / "shapes"
PAIRS = Profile((0.0, 0.5), (1.0, -2.5))


def display_with(folder: Path, line: str) -> Path:
    path = folder / "bent.toml"
    path.write_text(builtin_text("single").replace("[limits]", f"{line}\n\n[limits]", 1))
    return path


def csv_beside(folder: Path, text: str) -> Path:
    (folder / "rod.csv").write_text(text)
    return display_with(folder, 'natural_curvature_file = "rod.csv"')


def test_a_display_file_says_how_the_free_rod_is_bent(tmp_path: Path) -> None:
    display = read_display(display_with(tmp_path, "natural_curvature_along = [[0, 1.0], [500.0, -2.5]]"))
    assert display.rod.profile == PAIRS
    assert read_display("single").rod.profile is None


@pytest.mark.parametrize(
    "text", ["place_mm,curvature_per_m\n0,1\n500,-2.5\n", "place_mm, curvature_per_m\r\n0, 1.0\r\n\r\n500,-2.5"]
)
def test_a_table_beside_it_says_so_too(tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = csv_beside(tmp_path, text)
    monkeypatch.chdir(tmp_path.parent)
    assert read_display(path).rod.profile == PAIRS


def test_another_table_is_another_display(tmp_path: Path) -> None:
    digests = {read_display(csv_beside(tmp_path, f"place_mm,curvature_per_m\n0,{value}\n")).digest for value in (1, 2)}
    assert len(digests) == 2


BROKEN = {
    "": (1, "header", "begin it with the line place_mm,curvature_per_m"),
    "mm,per_m\n0,1\n": (1, "header", "begin it with the line"),
    "place_mm,curvature_per_m\n": (1, "empty", "give 1 to"),
    "place_mm,curvature_per_m\n0,1\n5\n": (3, "out-of-range", "write place and curvature"),
    "place_mm,curvature_per_m\n0,nan\n": (2, "out-of-range", "write place and curvature"),
    "place_mm,curvature_per_m\n0;1\n": (2, "out-of-range", "write place and curvature"),
    "place_mm,curvature_per_m\n0,1e7\n": (2, "out-of-range", "is it in 1/m?"),
    "place_mm,curvature_per_m\n5,1\n4,1\n": (3, "out-of-range", "from the left end of the rod on"),
    "place_mm,curvature_per_m\n5,1\n2001,1\n": (3, "out-of-range", "is it in mm from its left end?"),
}


@pytest.mark.parametrize("text", BROKEN)
def test_a_faulty_table_is_refused_where_it_is_faulty(tmp_path: Path, text: str) -> None:
    line, code, hint = BROKEN[text]
    with pytest.raises(InvalidInput) as refusal:
        read_display(csv_beside(tmp_path, text))
    first = refusal.value.diagnostics[0]
    assert (first.path, first.line, first.code) == (str(tmp_path / "rod.csv"), line, code)
    assert re.search(re.escape(hint), first.hint)


@pytest.mark.parametrize("data", [b"place_mm,curvature_per_m\n\xff,1\n", b"place_mm\0,1", b"#" * 1_000_001])
def test_what_is_no_text_is_refused(tmp_path: Path, data: bytes) -> None:
    path = csv_beside(tmp_path, "")
    (tmp_path / "rod.csv").write_bytes(data)
    with pytest.raises(InvalidInput):
        read_display(path)


def test_a_table_that_is_not_there_is_missed(tmp_path: Path) -> None:
    path = display_with(tmp_path, 'natural_curvature_file = "other.csv"')
    (tmp_path / "shape.toml").write_text((SHAPES / "level-up-peak.toml").read_text().replace('"single"', '"bent.toml"'))
    for read in (lambda: read_display(path), lambda: read_shape(tmp_path / "shape.toml")):
        with pytest.raises(InvalidInput) as refusal:
            read()
        (found,) = refusal.value.diagnostics
        assert (found.path, found.code) == (str(path), "no-such-file")
        assert "other.csv" in found.source


def test_a_check_says_how_the_free_rod_is_bent(tmp_path: Path) -> None:
    path = display_with(tmp_path, "natural_curvature_along = [[0, 1.0], [500.0, -72.5]]")
    check = check_of(read_display(path)).document()
    told = check["rod"]["natural_curvature"]
    assert (told["least_along_per_m"], told["most_along_per_m"]) == (-72.5, 1.0)
    assert ("curved-rod", "rod.natural_curvature_along") in [(each["code"], each["key"]) for each in check["warnings"]]
    text = CliRunner().invoke(app, ["display", "check", str(path)]).stdout
    assert "along its length the free rod is bent by -72.5 to 1 1/m" in text
    assert "free rod is bent" not in CliRunner().invoke(app, ["display", "check", "single"]).stdout


TOO_NEAR = "give the places from the left end of the rod on"
ODD = {
    # What is no number must not make way for the next column.
    "0,abc,1.8": "write place and curvature",
    "nan,0,1.8": "write place and curvature",
    "0,1,5": "write place and curvature",
    "0,-1e6\n1e-300,1e6": TOO_NEAR,
    "0,1\n1e-322,2": TOO_NEAR,
    "0," + "1" * 200_000: "write two short numbers",
}


@pytest.mark.parametrize("rows", ODD, ids=range(len(ODD)))
def test_odd_rows_are_refused(tmp_path: Path, rows: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        read_display(csv_beside(tmp_path, f"place_mm,curvature_per_m\n{rows}\n"))
    assert ODD[rows] in refusal.value.diagnostics[0].hint


def test_an_empty_cell_behind_a_row_is_nothing(tmp_path: Path) -> None:
    assert read_display(csv_beside(tmp_path, "place_mm,curvature_per_m\n0,1\n500,-2.5,\n")).rod.profile == PAIRS


def test_pairs_that_are_too_near_are_refused_as_in_a_table(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as refusal:
        read_display(display_with(tmp_path, "natural_curvature_along = [[0, -1e6], [1e-300, 1e6]]"))
    assert TOO_NEAR in refusal.value.diagnostics[0].hint


def test_a_natural_curvature_whose_slope_is_no_number_is_refused() -> None:
    for places, values in (((0.0, 1e-300), (-1.0, 1.0)), ((0.0, 1.0), (0.0, 1e300))):
        with pytest.raises(InvalidInput):
            NaturalCurvature(np.array(places), np.array(values))
