"""Numbers written into the rod of a display file: they are there, and everything else is as it was."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from curveline.errors import InvalidInput
from curveline.shapes.files import builtin_displays, builtin_text, read_display
from curveline.shapes.new_files import new_display
from curveline.shapes.rod_keys import write_set

KEYS = {"set_strength": 1.23, "set_exponent": 0.31}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "mine.toml"


def lines_of(text: str) -> list[str]:
    return [line for line in text.splitlines() if not line.startswith("set_")]


@pytest.mark.parametrize("source", [*builtin_displays(), "new"])
def test_a_file_takes_the_lines_and_keeps_the_others(path: Path, source: str) -> None:
    text = new_display(None) if source == "new" else builtin_text(source)
    path.write_text(text)
    write_set(path, KEYS)
    written = path.read_text()
    assert lines_of(written) == text.splitlines()
    before = tomllib.loads(text)
    assert tomllib.loads(written) == {**before, "rod": {**before["rod"], **KEYS}}
    assert read_display(path).rod.relaxation is not None


def test_lines_that_are_there_take_the_new_numbers_and_keep_their_remarks(path: Path) -> None:
    path.write_text(builtin_text("single").replace("total_length", "set_strength = 1.0   # strip 3\ntotal_length", 1))
    write_set(path, KEYS)
    assert "\nset_strength = 1.23   # strip 3\ntotal_length" in path.read_text()
    write_set(path, {"set_strength": 0.5})
    assert "set_strength = 0.5   # strip 3" in path.read_text()
    assert "set_exponent" not in path.read_text()


def test_the_rod_may_be_the_last_table_without_a_line_end(path: Path) -> None:
    text = builtin_text("single")
    rod, after = text.index("[rod]"), text.index("[limits]")
    path.write_text(f"{text[:rod]}{text[after:]}\n{text[rod:after].rstrip()}   # it is\n    # two metres")
    write_set(path, KEYS)
    assert path.read_text().endswith("# it is\n    # two metres\nset_strength = 1.23\nset_exponent = 0.31")
    assert read_display(path).rod.relaxation is not None


def test_line_ends_and_a_byte_order_mark_stay(path: Path) -> None:
    data = b"\xef\xbb\xbf" + builtin_text("single").replace("\n", "\r\n").encode()
    path.write_bytes(data)
    write_set(path, KEYS)
    written = path.read_bytes()
    assert written.startswith(b"\xef\xbb\xbf#")
    assert written.count(b"\r\n") == written.count(b"\n") == data.count(b"\n") + 2


def test_a_rod_in_one_line_is_left_alone_and_the_lines_are_told(path: Path) -> None:
    table = tomllib.loads(builtin_text("single"))["rod"]
    inline = "rod = { " + ", ".join(f"{key} = {value}" for key, value in table.items()) + " }"
    text = builtin_text("single")
    rod, after = text.index("[rod]"), text.index("[limits]")
    path.write_text(f"{text[:rod]}{inline}\n{text[after:]}")
    before = path.read_bytes()
    with pytest.raises(InvalidInput, match="left as it is") as refusal:
        write_set(path, KEYS)
    assert "`set_strength = 1.23` and `set_exponent = 0.31`" in refusal.value.hint
    assert path.read_bytes() == before


def test_a_set_said_time_by_time_is_left_alone(path: Path) -> None:
    series = "relaxation_times_s = [1.0]\nrelaxation_fractions = [0.1]\n"
    path.write_text(builtin_text("single").replace("total_length", f"{series}total_length", 1))
    before = path.read_bytes()
    with pytest.raises(InvalidInput, match="say what set the rod takes") as refusal:
        write_set(path, KEYS)
    assert "take them out" in refusal.value.hint
    assert path.read_bytes() == before


def test_a_file_that_is_no_display_is_refused(path: Path) -> None:
    for text in ("", "name = 3\n", "this is\n"):
        path.write_text(text)
        with pytest.raises(InvalidInput):
            write_set(path, KEYS)
        assert path.read_text() == text


def test_a_built_in_display_is_not_written(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    with pytest.raises(InvalidInput):
        write_set("single", KEYS)
