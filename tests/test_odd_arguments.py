"""What makes no sense is refused where it is handed over: as a TypeError, or as what curveline raises."""

from __future__ import annotations

import math
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


@pytest.mark.parametrize("odd", [None, 3, b"level-up-peak", [], object()], ids=lambda odd: type(odd).__name__)
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


@pytest.mark.parametrize("tolerance", [0, -1e-4, math.nan, math.inf])
def test_no_curve_has_such_a_tolerance(tolerance: float) -> None:
    with pytest.raises(InvalidInput, match="no curve has a tolerance of"):
        curveline.simulate("level-up-peak", tolerance)
    with pytest.raises(InvalidInput, match="no curve has a tolerance of"):
        curveline.Settings(tolerance)


@pytest.mark.parametrize("points", [-3, 0, 1])
def test_no_curve_has_so_few_points(points: int, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=f"no curve has {points} points"):
        curveline.write(curveline.simulate("level-up-peak"), tmp_path / "curves.json", points=points)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "odd", [{"tolerance": "1"}, {"points": 1.5}, {"windings": 1}, {"windings": ("a",)}, {"windings": (0.5,)}], ids=str
)
def test_settings_of_another_kind_are_told_from_what_is_due(odd: dict[str, Any]) -> None:
    with pytest.raises(TypeError, match="is needed, not"):
        curveline.Settings(**odd)


def test_a_run_is_resumed_by_the_path_of_its_folder_and_a_node_is_a_number(tmp_path: Path) -> None:
    with curveline.connect("mock:fresh", runs=tmp_path) as session:
        session.send("level-up-peak")
        (run,) = session.runs()
        with pytest.raises(InvalidInput, match="done to its end"):
            session.resume(run.folder)
        with pytest.raises(TypeError):
            session.resume(None)  # type: ignore[arg-type]
        with pytest.raises(TypeError, match="the number of a node is needed, not str"):
            session.node("1")  # type: ignore[arg-type]
