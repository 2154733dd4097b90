"""The examples of the documentation run as they are printed."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

import standby

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))
SAYS = {
    "dry_run_in_ci": "sent: done, the rod shows peak",
    "loop_over_shapes": "level-up-peak: peak, valley; the peak has",
    "new_display": "2 of 2 shapes as wanted",
    "own_display": "arch: ",
    "plot": "wrote shapes.svg and plan.svg",
    "sweep_to_pandas": "nodes.1.angle_deg  lowest_eigenvalue  energy_mJ",
}


def test_every_example_says_something() -> None:
    assert [path.stem for path in EXAMPLES] == sorted(SAYS)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(path: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "CURVELINE_RUNS": str(tmp_path / "runs")}
    command = [*standby.python(environment), str(path), str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert SAYS[path.stem] in " ".join(done.stdout.split("\n")) or SAYS[path.stem] in done.stdout
    lines = path.read_text().splitlines()
    assert len(lines) <= 25
