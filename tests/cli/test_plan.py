"""`curveline plan`: what it prints, writes, refuses and exits with."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.plan_file import from_json, read_plan, sealed, write_plan

from .conftest import BROKEN, SHAPES, Run, failure

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


def test_a_plan_is_drawn_filmed_and_written_at_once(run: Run, tmp_path: Path) -> None:
    files = [tmp_path / f"plan{suffix}" for suffix in (".svg", ".png", ".json", ".gif")]
    code, out, err = run("plan", SHAPE, *(part for file in files for part in ("-o", file)))
    assert code == 0
    assert err.splitlines() == [f"wrote {file}" for file in files]
    assert "encoder counts" in out
    starts = (b"<?xml", b"\x89PNG", b"{", b"GIF89a")
    assert [file.read_bytes()[: len(start)] for file, start in zip(files, starts, strict=True)] == list(starts)
    again = tmp_path / "again.svg"
    code, same, _ = run("plan", files[2], "-o", again)
    assert (code, same) == (0, out)
    assert again.read_bytes() == files[0].read_bytes()


def test_no_file_is_written_if_one_of_them_may_not_be(run: Run, tmp_path: Path) -> None:
    (tmp_path / "plan.gif").write_text("mine")
    code, out, err = run("plan", SHAPE, "-o", tmp_path / "plan.json", "-o", tmp_path / "plan.gif")
    assert (code, out) == (2, "")
    assert "error[exists]" in err
    assert [file.name for file in tmp_path.iterdir()] == ["plan.gif"]
    assert (tmp_path / "plan.gif").read_text() == "mine"


def test_without_matplotlib_a_film_is_refused_before_planning(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, out, err = run("plan", SHAPE, "-o", tmp_path / "plan.gif")
    assert (code, out) == (2, "")
    assert "curveline[plot]" in err


def test_a_plan_whose_display_is_gone_is_not_drawn(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    assert run("plan", SHAPE, "-o", file).code == 0
    made = read_plan(file)
    gone = replace(made, provenance={**made.provenance, "display": str(tmp_path / "gone.toml")})
    write_plan(sealed(gone), file, force=True)
    code, _, err = run("plan", file, "-o", tmp_path / "plan.png")
    assert code == 2
    assert "gone.toml" in err
    assert not (tmp_path / "plan.png").exists()


def test_several_shapes_are_one_tour(run: Run) -> None:
    code, out, err = run("plan", SHAPES / "level-up-peak.toml", SHAPES / "level-neutral-peak.toml", "--home", "--json")
    assert (code, err) == (0, "")
    made = from_json(out, "plan.json")
    assert made.name == "level-up-peak, level-neutral-peak, home"
    assert [step.shape for step in made.steps if step.shape] == ["level-up-peak", "level-neutral-peak", "home"]
    assert made.wanted == ("straight",)


def test_a_plan_may_begin_at_a_shape_and_end_at_home(run: Run) -> None:
    code, out, _ = run("plan", "--from", SHAPE, "--home", "--json")
    made = from_json(out, "plan.json")
    assert (code, made.name, made.wanted) == (0, "home", ("straight",))
    assert made.start[1].translate_mm == pytest.approx(100.0, abs=0.01)
    assert made.steps[-1].lengths_mm == (pytest.approx(500.0, abs=0.01),)
    code, out, _ = run("plan", SHAPE, "--from", SHAPE, "--json")
    assert len(from_json(out, "plan.json").steps) == 1


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((), "no shape to plan"),
        (("--home",), "no shape to plan"),
        (("--from", SHAPE), "no shape to plan"),
        (("x.json", SHAPE), "x.json"),
        ((SHAPE, "x.toml"), "x.toml"),
    ],
)
def test_what_is_no_tour(run: Run, arguments: tuple[str | Path, ...], reason: str) -> None:
    code, out, err = run("plan", *arguments, "--json")
    assert code == 2
    assert failure(out, 2)["code"] == "invalid-input"
    assert reason in err
    assert "hint: " in err


def test_a_plan_is_looked_at_by_itself(run: Run, plan_file: Path) -> None:
    assert run("plan", plan_file).code == 0
    for more in ((SHAPE,), ("--home",), ("--from", SHAPE)):
        code, out, err = run("plan", plan_file, *more)
        assert (code, out) == (2, "")
        assert "a plan is taken by itself" in err


def test_a_state_that_does_not_exist_cannot_be_planned(run: Run, no_valley: Path, tmp_path: Path) -> None:
    code, out, err = run("plan", no_valley, "-o", tmp_path / "plan.json")
    assert (code, out) == (1, "")
    assert err.startswith("error: no-valley: segment 1 has no stable valley")
    assert "hint: " in err
    assert not (tmp_path / "plan.json").exists()


def test_an_invalid_shape_is_refused(run: Run) -> None:
    code, out, err = run("plan", BROKEN / "syntax.toml", "--json")
    assert code == 2
    assert failure(out, 2)["diagnostics"][0]["path"] == str(BROKEN / "syntax.toml")
    assert ": error[" in err
