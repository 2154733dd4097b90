"""`curveline node settings` as people use it: a file changes, the nodes are told, and hints lead there."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from curveline.cli import consent

from .conftest import Run

MOCK = ("--radio", "mock")


@pytest.fixture
def lab(run: Run, tmp_path: Path) -> Path:
    """A display file of two nodes, in which the mock's boards were set up."""
    path = tmp_path / "lab.toml"
    assert run("new", "display", "-o", path)[0] == 0
    assert run("status", "-d", path, *MOCK)[0] == 0
    return path


def edited(path: Path, key: str, value: object) -> Path:
    text = path.read_text()
    assert re.search(rf"^{key} = ", text, re.MULTILINE), text
    path.write_text(re.sub(rf"^{key} = \S+", f"{key} = {value}", text, flags=re.MULTILINE))
    return path


def test_a_display_file_changes_and_its_nodes_follow(run: Run, lab: Path) -> None:
    old = lab.with_name("old.toml")
    old.write_text(lab.read_text())
    edited(lab, "channel", 90)
    assert "silent" in run("status", "-d", lab, *MOCK).out
    code, out, err = run("node", "settings", "-d", lab, "--old-display", old, *MOCK, "--yes")
    assert code == 0
    assert re.search(r"1 +channel +\d+ +90\n +2 +channel", out)
    assert "changed: nodes 1, 2" in out
    assert "node 2: it answers under its new settings, and is told to keep them" in err
    assert run("status", "-d", lab, *MOCK).code == 0
    again = run("node", "settings", "-d", lab, *MOCK, "--yes")
    assert (again.code, again.out.strip()) == (0, "as it should be: nodes 1, 2\nnothing to change")


def test_other_limits_are_refused_and_the_hint_works(run: Run, lab: Path) -> None:
    """From the edit to a display that moves again, by what is printed alone."""
    edited(lab, "counts_per_turn", 3000)
    refused = run("send", "--home", "-d", lab, *MOCK, "--yes")
    assert refused.code == 3
    (command,) = re.findall(r"`curveline (node settings \d[^`]*)`", refused.err)
    assert run(*command.split(), *MOCK, "--yes").code == 0
    both = run("node", "settings", "-d", lab, *MOCK, "--yes")
    assert "not homed: nodes 1, 2: `curveline node home N`" in both.out
    for number in (1, 2):
        assert run("node", "home", number, "-d", lab, *MOCK, "--yes").code == 0
    assert run("send", "--home", "-d", lab, *MOCK, "--yes").code == 0


def test_json_has_what_changes_and_what_came_of_it(run: Run, lab: Path) -> None:
    old = lab.with_name("old.toml")
    old.write_text(lab.read_text())
    edited(lab, "channel", 91)
    code, out, _ = run("node", "settings", 2, "-d", lab, "--old-display", old, *MOCK, "--yes", "--json")
    told = json.loads(out)
    assert code == 0
    assert [each["node"] for each in told["changes"]] == [2]
    assert told["changes"][0]["settings"][0]["name"] == "channel"
    assert told["done"] == [{"node": 2, "changed": True, "generation": 1, "must_home": False}]


def test_a_stray_node_is_found_and_the_hint_brings_it_back(run: Run, lab: Path) -> None:
    radio = ("--radio", "mock:channel=2")
    code, _, err = run("node", "settings", 2, "-d", lab, *radio, "--yes")
    assert code == 3
    (command,) = re.findall(r"`curveline (node settings 2 --old-channel \d+[^`]*)`", err)
    assert "--old-channel 23" in command
    assert run(*command.split(), *radio, "--yes").code == 0
    assert run("status", "-d", lab, *MOCK).code == 0


def test_nothing_changes_without_consent(run: Run, lab: Path) -> None:
    code, out, err = run("node", "settings", "-d", lab, *MOCK)
    assert code == 2
    assert out == ""
    assert "add --yes to agree" in err


def test_whoever_is_asked_is_told_what_changes(run: Run, lab: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old = lab.with_name("old.toml")
    old.write_text(lab.read_text())
    edited(lab, "channel", 90)
    monkeypatch.setattr(consent, "require_terminal", lambda why, hint: None)
    monkeypatch.setattr(consent, "agrees", lambda question: False)
    code, out, err = run("node", "settings", "-d", lab, "--old-display", old, *MOCK, "--json")
    assert code == 1
    assert re.search(r"1 +channel +\d+ +90\n +2 +channel", err)
    assert json.loads(out)["error"]["code"] == "no"


def test_calibrate_points_here(run: Run, lab: Path) -> None:
    said = run(
        *("node", "calibrate", 1, "extrude", "--times", 1, "--measured", 50.5, "-d", lab, "-o", lab, *MOCK, "--yes"),
    )
    (command,) = re.findall(r"`curveline (node settings [^`]*)`", said.err)
    assert run(*command.split(), *MOCK, "--yes").code == 0
