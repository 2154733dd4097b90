"""`curveline plan`: what it prints, writes, refuses and exits with."""

from __future__ import annotations

import json
from pathlib import Path

from curveline.plan import from_json, read_plan

from .conftest import BROKEN, SHAPES, Run

SHAPE = SHAPES / "staggered-up-valley.toml"


def test_a_plan_is_shown_as_tables_on_80_columns(run: Run) -> None:
    code, out, err = run("plan", SHAPE)
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    for word in ("extrude", "bias", "translate", "margin of step", "encoder counts", "ends in: valley"):
        assert word in out
    assert "-0.00" not in out


def test_json_and_a_dash_are_the_plan_file(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    code, out, err = run("plan", SHAPE, "-o", file)
    assert (code, err) == (0, f"wrote {file}\n")
    assert "encoder counts" in out
    plan = read_plan(file)
    assert plan.wanted == ("valley",)
    for option in (("--json",), ("-o", "-")):
        code, out, err = run("plan", SHAPE, *option)
        assert (code, err) == (0, "")
        assert from_json(out, "stdout") == plan


def test_an_existing_file_is_kept_unless_forced(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    file.write_text("mine")
    code, out, err = run("plan", SHAPE, "-o", file)
    assert (code, out) == (2, "")
    assert "error[exists]" in err
    assert file.read_text() == "mine"
    assert run("plan", SHAPE, "-o", file, "--force").code == 0
    assert json.loads(file.read_text())["name"] == "staggered-up-valley"


def test_a_plan_is_json(run: Run, tmp_path: Path) -> None:
    code, _, err = run("plan", SHAPE, "-o", tmp_path / "plan.toml")
    assert code == 2
    assert "ends in .json" in err


def test_several_shapes_are_planned_one_by_one(run: Run) -> None:
    code, out, err = run("plan", SHAPE, SHAPE)
    assert (code, out) == (2, "")
    assert "one by one" in err


def test_a_state_that_does_not_exist_cannot_be_planned(run: Run, no_valley: Path, tmp_path: Path) -> None:
    code, out, err = run("plan", no_valley, "-o", tmp_path / "plan.json")
    assert (code, out) == (1, "")
    assert err.startswith("error: no-valley: segment 1 has no stable valley")
    assert "hint: " in err
    assert not (tmp_path / "plan.json").exists()


def test_an_invalid_shape_is_refused(run: Run) -> None:
    code, out, err = run("plan", BROKEN / "syntax.toml", "--json")
    assert (code, out) == (2, "")
    assert ": error[" in err
