"""Extreme shapes through `curveline simulate` in a process of its own: exit codes, sentences, no traceback, no NaN."""

from __future__ import annotations

import importlib.resources
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

SHAPE = """
name = "{name}"
display = "extreme.toml"
nodes = [ {{ height_mm = 0.0, angle_deg = {start} }}, {{ height_mm = {height}, angle_deg = {end} }} ]
segments = [ {{ length_mm = {length}, state = "{state}" }} ]
{more}
"""

ANSWERED = {
    "away": {"start": 170, "end": -170, "length": 2500},
    "taut": {"start": 30, "end": -30, "length": 503.0},
    "long": {"start": 10, "end": 0, "length": 3000, "height": 200},
    "folded": {"start": 41, "end": -41, "length": 700, "more": "loads = [{segment=1, at=0.5, force_N=[0.0, -90.0]}]"},
}


def write(folder: Path, name: str, values: dict[str, object]) -> str:
    """A shape file; returns its name."""
    values = {"start": 0, "end": 0, "height": 0.0, "length": 600, "state": "peak", "more": "", **values}
    (folder / f"{name}.toml").write_text(SHAPE.format(name=name, **values))
    return f"{name}.toml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the shapes lie, beside a display without limits."""
    path = tmp_path_factory.mktemp("extreme")
    text = (importlib.resources.files("curveline") / "shapes" / "displays" / "single.toml").read_text()
    text = re.sub(r"angle_deg = \[.*?\]", "angle_deg = [-180.0, 180.0]", text)
    text = re.sub(r"length_mm = \[.*?\]", "length_mm = [500.0, 3000.0]", text)
    text = re.sub(r"total_length_mm = \S+", "total_length_mm = 9000.0", text)
    (path / "extreme.toml").write_text(text)
    return path


def simulate(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    environment = {**os.environ, "CURVELINE_RUNS": str(folder / "runs"), "NO_COLOR": "1"}
    command = [sys.executable, "-m", "curveline", "simulate", *arguments]
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert "Traceback" not in done.stderr
    assert "NaN" not in done.stdout
    return done


def test_extreme_shapes_are_answered(folder: Path) -> None:
    names = [write(folder, name, values) for name, values in ANSWERED.items()]
    done = simulate(folder, *names, "--json", "--model", "planar")
    documents = [json.loads(line) for line in done.stdout.splitlines()]
    assert [document["shape"] for document in documents] == list(ANSWERED)
    assert done.returncode in (0, 1)
    for document in documents:
        (segment,) = document["segments"]
        assert segment["states"], document["shape"]
        for state in segment["states"]:
            assert state["stable"] == (state["outcome"] == "converged")
            assert state["error_mm"] <= 0.1


def test_what_cannot_be_answered_says_what_to_change(folder: Path) -> None:
    # Long enough by its file, but the bearings' 20 mm point away from each other.
    done = simulate(folder, write(folder, "short", {"length": 500.0, "height": 0.0}), "--no-drawing")
    assert done.returncode in (1, 2)
    assert re.search(r"length|longer", done.stderr)
