"""What makes no sense is refused where it is handed over: as a TypeError, or as what curveline raises."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import curveline
from curveline.errors import InvalidInput

NO_FILE = ["a\0b", "a" * 5000]
"""Names that no file can have."""

TAKES_ONE: list[Callable[[Any], object]] = [
    curveline.simulate,
    curveline.plan,
    curveline.load,
    curveline.load_map,
    curveline.fall,
    curveline.monte_carlo,
    curveline.check_display,
    curveline.connect,
    lambda display: curveline.connect("mock", display),
]


@pytest.mark.parametrize("odd", [None, 3, b"level-up-peak", [], object()], ids=repr)
@pytest.mark.parametrize("call", TAKES_ONE)
def test_a_value_of_another_kind_is_told_from_what_is_due(call: Callable[[Any], object], odd: Any) -> None:
    with pytest.raises(TypeError, match=f"is needed, not {type(odd).__name__}"):
        call(odd)


@pytest.mark.parametrize("call", [curveline.simulate_many, curveline.measure])
@pytest.mark.parametrize("one", ["level-up-peak", Path("level-up-peak.toml")])
def test_one_path_is_not_taken_for_its_letters(call: Callable[[Any], object], one: Any) -> None:
    with pytest.raises(TypeError, match=r"shapes is one path, .*: put it into a list"):
        call(one)


def test_a_session_takes_a_path_as_every_other_call_does(tmp_path: Path) -> None:
    curveline.new_display(tmp_path / "lab.toml", 3)
    assert curveline.connect("mock", tmp_path / "lab.toml", runs=tmp_path).drive.node_count == 3
    assert len(curveline.status("mock", tmp_path / "lab.toml", runs=tmp_path).nodes) == 3


@pytest.mark.parametrize("name", NO_FILE, ids=["zero", "long"])
def test_a_name_that_no_file_can_have_is_refused(name: str, tmp_path: Path) -> None:
    calls: list[Callable[[], object]] = [
        lambda: curveline.new_display(tmp_path / name, name="lab"),
        lambda: curveline.new_shape(tmp_path / name, name="lab"),
        lambda: curveline.new_keys(tmp_path / name),
        lambda: curveline.read_keys(tmp_path / name),
        lambda: curveline.log("last", tmp_path / name),
        lambda: curveline.log(name, tmp_path),
        lambda: curveline.write(curveline.simulate("level-up-peak"), tmp_path / f"{name}.json"),
    ]
    for call in calls:
        with pytest.raises(InvalidInput):
            call()
    assert list(curveline.runs(tmp_path / name)) == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a" * 101, " ", "two\nlines", os.fsdecode(b"\xff")])
@pytest.mark.parametrize("make", [curveline.new_display, curveline.new_shape])
def test_a_new_file_has_a_name_with_which_it_can_be_read(make: Any, name: str, tmp_path: Path) -> None:
    for path in (tmp_path / f"{name}.toml", None):
        with pytest.raises(InvalidInput, match="no new file calls itself") as caught:
            make(path, name=name)
        assert "at most 100 letters" in caught.value.hint
    with pytest.raises(InvalidInput, match="no new file calls itself"):
        make(tmp_path / f"{name}.toml")
    assert list(tmp_path.iterdir()) == []


def test_a_new_shape_names_no_display_that_cannot_be_written_down(tmp_path: Path) -> None:
    display = tmp_path / f"{os.fsdecode(bytes([255]))}.toml"
    display.write_text(curveline.new_display(None))
    with pytest.raises(InvalidInput, match="cannot name the display"):
        curveline.new_shape(None, display)
