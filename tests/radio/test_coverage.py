"""Every branch of the parts that decide what moves is taken by the tests that are about them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
MODULES = (
    "host/conductor",
    "host/journal",
    "host/polling",
    "host/peer",
    "host/resume",
    "host/service",
    "node/machine",
    "node/settings_flash",
    "node/state",
    "protocol/frames",
    "protocol/keys",
    "protocol/motion",
    "protocol/node_settings",
    "protocol/page_frames",
    "protocol/settings_frames",
)
SUITES = (
    "conductor",
    "frames",
    "journal",
    "motion",
    "node",
    "node_homing",
    "node_settings",
    "old_frames",
    "polling",
    "peer",
    "resume",
    "service",
    "settings_flash",
)
BESIDE = ("driving/test_lines", "driving/test_new_settings", "driving/test_node_trials")
"""Tests of what is built on these parts, for what only that asks of them."""
SLOW = (
    *("random_payloads", "bit_flip", "session_numbers_come_again", "taken_from_its_living_host"),
    *("decoding_gives_back", "moves_keep_the_limits", "longer_than_the_field"),
)
"""Names of tests with many repetitions, which take no branch that the others do not take."""


def run(*command: str, env: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]


@pytest.mark.campaign
def test_every_branch_is_taken(tmp_path: Path) -> None:
    env = {**os.environ, "COVERAGE_FILE": str(tmp_path / "data")}
    sources = ",".join(f"curveline/radio/{name}.py" for name in MODULES)
    suites = [str(HERE / f"test_{name}.py") for name in SUITES] + [str(HERE.parent / f"{name}.py") for name in BESIDE]
    suite = ("pytest", "-q", "-p", "no:cacheprovider", "-k", " and ".join(f"not {name}" for name in SLOW), *suites)
    run("coverage", "run", "--branch", f"--include={sources}", "-m", *suite, env=env)
    run("coverage", "json", "-o", str(tmp_path / "found.json"), env=env)
    found = json.loads((tmp_path / "found.json").read_text())["files"]
    assert len(found) == len(MODULES)
    missing = {name: each["missing_branches"] + each["missing_lines"] for name, each in found.items()}
    assert {name: gaps for name, gaps in missing.items() if gaps} == {}
    assert sum(each["summary"]["num_branches"] for each in found.values()) > 300
