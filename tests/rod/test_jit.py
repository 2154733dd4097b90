"""Compiled kernels are kept, found again, and thrown away when any kernel source changes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from curveline.rod import _jit

KERNEL = """
from {package}._jit import CACHE, FIRST_RUN, njit

@njit
def twice(x):
    return 2.0 * x

if __name__ == "__main__":
    assert twice(1.5) == 3.0
    hits = sum(twice.stats.cache_hits.values())
    print(CACHE, FIRST_RUN, hits, sep="\\n")
"""


def run(folder: Path, home: Path) -> tuple[Path, bool, int]:
    """Import the copy of `_jit` in a fresh process: its cache folder, whether it was new, kernels loaded from it."""
    env = {**os.environ, "CURVELINE_CACHE": str(home)}
    command = [sys.executable, "-m", "kernels.small"]
    done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=True)
    cache, first, hits = done.stdout.split("\n")[:3]
    return Path(cache), first == "True", int(hits)


def test_kernels_are_compiled_once_and_again_when_a_source_changes(tmp_path: Path) -> None:
    package, home = tmp_path / "kernels", tmp_path / "cache"
    package.mkdir()
    (package / "__init__.py").write_text("")
    shutil.copy(str(_jit.__file__), package / "_jit.py")
    (package / "small.py").write_text(KERNEL.format(package="kernels"))
    (package / "other.py").write_text("VALUE = 1\n")
    cold, warm = run(tmp_path, home), run(tmp_path, home)
    assert cold[0].parent == home
    assert list(cold[0].rglob("*.nbi"))
    assert cold[1:] == (True, 0)
    assert warm == (cold[0], False, 1)
    (package / "other.py").write_text("VALUE = 2\n")
    changed = run(tmp_path, home)
    assert changed[0] not in (cold[0], home)
    assert changed[1:] == (True, 0)


def test_the_folder_is_named_by_the_users_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CURVELINE_CACHE", "/elsewhere")
    assert _jit._cache_home() == Path("/elsewhere")
    monkeypatch.delenv("CURVELINE_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", "/caches")
    assert _jit._cache_home() == Path("/caches/curveline")
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert _jit._cache_home() == Path.home() / ".cache" / "curveline"


def test_a_folder_that_cannot_be_written_is_replaced_for_the_process(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    private = _jit._usable(tmp_path / "file" / "cache")
    assert private.is_dir()
    assert tmp_path not in private.parents
    assert _jit._usable(tmp_path / "new" / "cache") == tmp_path / "new" / "cache"
