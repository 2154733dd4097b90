"""Which commit a clone stands at, as git says it."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from curveline.system.work_tree import commit_of


def git(folder: Path, *words: str) -> None:
    named = ("-c", "user.name=x", "-c", "user.email=x@example.org")
    subprocess.run(["git", *named, "-C", str(folder), *words], check=True, capture_output=True)


def test_a_clone_has_a_commit_and_changes_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert commit_of(tmp_path) is None
    git(tmp_path, "init", "-q")
    assert commit_of(tmp_path) is None  # nothing was committed
    (tmp_path / "file").write_text("a")
    git(tmp_path, "add", "file")
    git(tmp_path, "commit", "-qm", "first")
    commit = commit_of(tmp_path)
    assert commit is not None
    assert re.fullmatch("[0-9a-f]{40}", commit)
    (tmp_path / "other").write_text("is not tracked")
    assert commit_of(tmp_path) == commit
    (tmp_path / "file").write_text("b")
    assert commit_of(tmp_path) == f"{commit}+"
    (tmp_path / "within").mkdir()
    assert commit_of(tmp_path / "within") is None  # a package in somebody's repository has not that one's commit
    monkeypatch.setenv("PATH", str(tmp_path))
    assert commit_of(tmp_path) is None
