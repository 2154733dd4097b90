"""Readings of strips: what a file says becomes numbers in SI, and what is wrong with it is told line by line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from curveline.errors import InvalidInput
from curveline.material.drum_readings import DrumReading, read_drum_readings

HEAD = "drum_radius_mm,held,after,curvature_per_m"


def read(folder: Path, *lines: str, end: str = "\n") -> tuple[DrumReading, ...]:
    path = folder / "strip.csv"
    path.write_bytes(end.join([*lines, ""]).encode())
    return read_drum_readings(path)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("between", [",", ";", " , "])
def test_a_row_is_a_reading(tmp_path: Path, between: str, end: str) -> None:
    rows = "# strip 3", HEAD.replace(",", between), "", between.join(["100", "8h", "10min", "1.5"])
    assert read(tmp_path, *rows, end=end) == (DrumReading(10.0, 28_800.0, 600.0, 1.5, 23.0),)


def test_columns_come_in_any_order_and_may_say_the_temperature(tmp_path: Path) -> None:
    rows = "held,temperature_C,after,curvature_per_m,drum_radius_mm", "1w,30,1d,-0.5,50", "1w,,1d,-0.5,50"
    assert [each.temperature for each in read(tmp_path, *rows)] == [30.0, 23.0]


def test_the_curvature_may_be_that_of_a_radius_or_of_an_arc(tmp_path: Path) -> None:
    (by_radius,) = read(tmp_path, "drum_radius_mm,held,after,radius_mm", "100,8h,1h,400")
    assert by_radius.curvature == pytest.approx(2.5)
    # A circle of 400 mm over a chord of 150 mm.
    height = 400.0 - math.sqrt(400.0**2 - 75.0**2)
    (by_arc,) = read(tmp_path, "drum_radius_mm,held,after,arc_height_mm,chord_mm", f"100,8h,1h,{height},150")
    assert by_arc.curvature == pytest.approx(2.5)
    (other_way,) = read(tmp_path, "drum_radius_mm,held,after,arc_height_mm,chord_mm", f"100,8h,1h,{-height},150")
    assert other_way.curvature == pytest.approx(-2.5)


def test_how_a_strip_was_curved_before_is_subtracted(tmp_path: Path) -> None:
    rows = read(tmp_path, HEAD, "100,0s,0s,0.2", "100,0s,0s,0.4", "100,8h,1min,2.0", "100,8h,1h,1.0")
    assert [each.curvature for each in rows] == pytest.approx([1.7, 0.7])


@pytest.mark.parametrize(
    ("rows", "line", "code", "told", "hint"),
    [
        ((), 1, "empty", "nothing in it", "drum_radius_mm"),
        (("# only a remark",), 1, "empty", "nothing in it", "drum_radius_mm"),
        ((HEAD,), 1, "empty", "no strip was held", "let it go"),
        ((HEAD, "100,0s,0s,0.2"), 1, "empty", "no strip was held", "let it go"),
        (("drum_radius,held,after,curvature_per_m",), 1, "unknown-column", "'drum_radius'", "drum_radius_mm?"),
        (("colour,held,after,curvature_per_m",), 1, "unknown-column", "'colour'", "columns are"),
        (("held,after,curvature_per_m",), 1, "missing-column", "drum_radius_mm", "first line"),
        (("100,8h,1h,2.0",), 1, "unknown-column", "'100'", "first line"),
        ((f"{HEAD},held",), 1, "duplicate-column", "held", "one of them"),
        ((f"{HEAD},radius_mm",), 1, "two-ways", "two ways", "radius_mm"),
        (("drum_radius_mm,held,after",), 1, "missing-column", "no column gives the curvature", "radius_mm"),
        (("drum_radius_mm,held,after,chord_mm",), 1, "missing-column", "no column gives", "arc_height_mm"),
        ((HEAD, "100,8h,1h"), 2, "item-count", "3 values for 4 columns", "comma"),
        ((HEAD, "100,8h,1h,1,5"), 2, "item-count", "5 values for 4 columns", "comma"),
        ((HEAD, "", "# a", "100,8,1h,1.5"), 4, "bad-value", "held: '8' has no unit", "8h"),
        ((HEAD, "100,8h,soon,1.5"), 2, "bad-value", "after: 'soon' is no time", "30min"),
        ((HEAD, "100,8h,-1h,1.5"), 2, "bad-value", "after: '-1h'", "from 0"),
        ((HEAD, "0,8h,1h,1.5"), 2, "bad-value", "drum_radius_mm: '0' must be above 0", "above 0"),
        ((HEAD, "-100,8h,1h,1.5"), 2, "bad-value", "must be above 0", "above 0"),
        ((HEAD, "100,8h,1h,nan"), 2, "bad-value", "no ordinary number", "finite"),
        ((HEAD, "100,8h,1h,1e999"), 2, "bad-value", "no ordinary number", "finite"),
        ((HEAD, "100,8h,1h,"), 2, "bad-value", "curvature_per_m: '' is no number", "write a number"),
        ((HEAD.replace(",", ";"), "100;8h;1h;1,5"), 2, "bad-value", "'1,5' is no number", "write 1.5, with a point"),
        (("drum_radius_mm,held,after,radius_mm", "100,8h,1h,0"), 2, "bad-value", "radius of 0", "curvature_per_m = 0"),
        (
            ("drum_radius_mm,held,after,arc_height_mm,chord_mm", "100,8h,1h,80,150"),
            2,
            "bad-value",
            "higher than half its chord",
            "shorter chord",
        ),
        ((f"{HEAD},temperature_C", "100,8h,1h,1.5,296"), 2, "bad-value", "temperature_C: nothing is known", "Celsius"),
    ],
)
def test_what_is_wrong_is_told_with_its_line_and_what_to_do(tmp_path, rows, line, code, told, hint) -> None:
    with pytest.raises(InvalidInput) as refusal:
        read(tmp_path, *rows)
    first = refusal.value.diagnostics[0]
    assert (first.line, first.code) == (line, code)
    assert told in first.message
    assert hint in first.hint


def test_every_row_that_is_wrong_is_told_of(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as refusal:
        read(tmp_path, HEAD, "100,8h,1h,x", "100,8h,1h,1.5", "0,8h,1h,1.5", "100,8h")
    assert [each.line for each in refusal.value.diagnostics] == [2, 4, 5]
    with pytest.raises(InvalidInput) as refusal:
        read(tmp_path, HEAD, *["100,8h,1h,x"] * 1000)
    assert len(refusal.value.diagnostics) == 100


def test_another_file_of_ours_is_called_by_its_name(tmp_path: Path) -> None:
    from curveline.shapes.files import builtin_text

    with pytest.raises(InvalidInput, match="this is a display file, not readings of strips"):
        read(tmp_path, builtin_text("single"))


def test_a_file_of_another_size_or_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="no such file"):
        read_drum_readings(tmp_path / "none.csv")
    with pytest.raises(InvalidInput, match="larger than"):
        read(tmp_path, HEAD, "x" * 1_000_001)
    (tmp_path / "strip.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidInput, match="UTF-8"):
        read_drum_readings(tmp_path / "strip.csv")


def test_a_line_that_no_cell_can_hold_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as refusal:
        read(tmp_path, HEAD, "1" * 200_000)
    assert [each.code for each in refusal.value.diagnostics] == ["too-large"]
