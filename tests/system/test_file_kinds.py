"""A file that is given in place of another one is called by its name, with the command that takes it."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from curveline.errors import InvalidInput
from curveline.plan_file import read_plan
from curveline.shapes.files import builtin_text, read_display, read_shape
from curveline.system.file_kinds import DISPLAY, IMAGE, KEY_FILE, PLAN, RESULT, SHAPE, FileKind, kind_of

ROOT = Path(__file__).parents[2]
LEVEL = (ROOT / "shapes" / "level-up-peak.toml").read_text()
FILES = {
    "a shape.toml": (SHAPE, LEVEL),
    "items.toml": (SHAPE, "[[nodes]]\nheight_mm = 0.0\n[[segments]]\nlength_mm = 600\n"),
    "mine.toml": (DISPLAY, builtin_text("single")),
    "plan.json": (PLAN, json.dumps({"curveline_plan": 3, "name": "x"})),
    "laid-out.json": (PLAN, json.dumps({"curveline_plan": 3, "name": "x"}, indent=1)),
    "peak.json": (RESULT, json.dumps({"curveline": "1.0", "shape": "x"})),
    "site.json": (KEY_FILE, json.dumps({"curveline_site": 2, "master": "5ec7e7" * 4})),
    "node.hex": (IMAGE, ":0800000000180020C1000000FF\n:00000001FF\n"),
}
READERS: dict[FileKind, Callable[[Path], object]] = {SHAPE: read_shape, DISPLAY: read_display, PLAN: read_plan}


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_known_by_its_first_lines(name: str) -> None:
    kind, text = FILES[name]
    assert kind_of(text) is kind


@pytest.mark.parametrize("path", sorted((ROOT / "shapes").rglob("*.toml")), ids=lambda path: path.stem)
def test_the_shapes_and_displays_of_the_project_are_what_they_are(path: Path) -> None:
    assert kind_of(path.read_text()) is (DISPLAY if path.parent.name == "displays" else SHAPE)


@pytest.mark.parametrize(
    "text", ["", "a = 1", "[rod]\n" + LEVEL, "span_mm = 1\n" + LEVEL, "[]", "{}", "{ a", "name = 1"]
)
def test_what_is_nothing_or_a_bit_of_both_is_for_the_reader_to_refuse(text: str) -> None:
    assert kind_of(text) is None


@pytest.mark.parametrize("wanted", READERS, ids=lambda kind: kind.name)
@pytest.mark.parametrize("name", FILES)
def test_another_kind_of_file_is_called_by_its_name(name: str, wanted: FileKind, tmp_path: Path) -> None:
    kind, text = FILES[name]
    if kind is wanted:
        return
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InvalidInput) as caught:
        READERS[wanted](path)
    (found,) = caught.value.diagnostics
    assert (found.code, found.line, found.column) == ("wrong-kind", 1, 1)
    assert found.message == f"this is {kind.name}, not {wanted.name}"
    assert kind is RESULT or shlex.quote(str(path)) in found.hint
    assert "5ec7e7" not in str(caught.value) + found.hint


def test_what_the_hints_name_are_commands() -> None:
    from typer.main import get_command

    from curveline.cli.app import app

    known = get_command(app).commands  # type: ignore[attr-defined]
    for kind, _ in FILES.values():
        for line in re.findall(r"`curveline ([^`]*)`", kind.use):
            command, *rest = line.split()
            assert command in known
            assert not hasattr(known[command], "commands") or rest[0] in known[command].commands
