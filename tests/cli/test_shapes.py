"""`curveline shapes`, and the built-in shapes by name wherever a shape file is taken."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from curveline.shapes.library import builtin_shapes

from .conftest import SHAPES, Run


def test_the_list_has_every_shape_of_the_source_tree(run: Run) -> None:
    code, out, err = run("shapes")
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    files = {file.stem: file for file in SHAPES.rglob("*.toml") if file.parent.name != "displays"}
    assert len(files) == 20
    assert [line.split()[0] for line in out.splitlines()[1:]] == sorted(files)
    (row,) = (line for line in out.splitlines() if line.startswith("roofline"))
    assert re.split(r"\s{2,}", row) == ["roofline", "quad", "4", "valley, peak, peak, peak"]
    document = json.loads(run("shapes", "--json").out)
    assert {shape["name"]: Path(shape["file"]) for shape in document["shapes"]} == files
    assert document["shapes"][0] == {
        "name": "leaning",
        "display": "leaning",
        "segments": 1,
        "wanted": ["valley"],
        "file": str(SHAPES / "space" / "leaning.toml"),
    }


@pytest.mark.parametrize(
    "command",
    [
        ("simulate", "{}", "--no-drawing"),
        ("simulate", "{}", "--sweep", "nodes.1.angle_deg=20:30:2"),
        ("plan", "{}"),
        ("load", "{}", "--most-N", "1"),
        ("send", "{}", "--dry-run"),
        ("plan", "--from", "{}", "--home"),
    ],
    ids=" ".join,
)
def test_a_name_will_do_wherever_a_file_does(run: Run, command: tuple[str, ...], tmp_path: Path) -> None:
    by_name, by_file = (
        run(*(part.format(name) for part in command)) for name in ("level-up-peak", SHAPES / "level-up-peak.toml")
    )
    assert by_name.code == by_file.code == 0, by_name.err
    numbers = re.compile(r"\d[\d.]* (m?s|points per second|process)\b")
    assert numbers.sub("", by_name.out) == numbers.sub("", by_file.out)


def test_a_file_comes_before_a_built_in_shape(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = builtin_shapes()["level-up-peak"].read_text().replace('"level-up-peak"', '"my own"')
    (tmp_path / "level-up-peak").write_text(text)
    assert run("simulate", "level-up-peak", "--no-drawing").out.startswith("my own\n")


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("level-up-peek", "did you mean level-up-peak?"),
        ("nowhere/level-up-peak.toml", "a built-in shape is called level-up-peak"),
        ("single", "single is a built-in display, not a shape"),
        ("arhc.toml", "did you mean arch.toml?"),
        ("lab/arhc.toml", "did you mean lab/arch.toml?"),
        ("xyz", "`curveline shapes` lists the built-in ones"),
    ],
)
def test_a_name_that_is_none_leads_to_one_that_is(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, hint: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab").mkdir()
    for folder in ("", "lab"):
        (tmp_path / folder / "arch.toml").write_bytes((SHAPES / "level-up-peak.toml").read_bytes())
    for command in ("simulate", "plan", "load"):
        code, out, err = run(command, name)
        assert (code, out) == (2, "")
        assert "error[no-such-file]" in err
        assert hint in err


def test_a_shape_is_no_display(run: Run) -> None:
    code, _, err = run("display", "check", "level-up-peak")
    assert code == 2
    assert "level-up-peak is a built-in shape, not a display" in err


def test_what_can_be_read_once_is_not_measured_with(run: Run) -> None:
    code, _, err = run("bench", "-", "--quick")
    assert code == 2
    assert "what is piped in only once" in err
