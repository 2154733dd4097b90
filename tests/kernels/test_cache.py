"""Compiled kernels are kept, found again, and thrown away when any kernel source changes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from curveline.kernels import cache

KERNEL = """
from curveline.kernels.kernel import njit

@njit
def twice(x):
    return 2.0 * x
"""

RUN = """
from pathlib import Path
from curveline.kernels import cache, readiness
cache.PACKAGE, cache.SOURCES = Path.cwd(), ("kernels",)
is_first = readiness.is_first_run()
from kernels.small import twice
assert twice(1.5) == 3.0
print(cache.folder(), is_first, sum(twice.dispatcher.stats.cache_hits.values()), sep="\\n")
"""


def run(folder: Path, home: Path, preparation: str = "") -> tuple[Path, bool, int]:
    """Call a kernel in a fresh process: its cache folder, whether it was new, kernels loaded from it."""
    env = {**os.environ, "CURVELINE_CACHE": str(home), "CURVELINE_KERNELS": "numba"}
    command = [sys.executable, "-c", preparation + RUN]
    done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=True)
    cache, first, hits = done.stdout.split("\n")[:3]
    return Path(cache), first == "True", int(hits)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with a kernel."""
    package = tmp_path / "kernels"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "small.py").write_text(KERNEL)
    (package / "other.py").write_text("VALUE = 1\n")
    return package


def test_kernels_are_compiled_once_and_again_when_a_source_changes(tmp_path: Path, package: Path) -> None:
    home = tmp_path / "cache"
    cold, warm = run(tmp_path, home), run(tmp_path, home)
    assert cold[0].parent == home
    assert list(cold[0].rglob("*.nbi"))
    assert cold[1:] == (True, 0)
    assert warm == (cold[0], False, 1)
    (package / "other.py").write_text("VALUE = 2\n")
    changed = run(tmp_path, home)
    assert changed[0] not in (cold[0], home)
    assert changed[1:] == (True, 0)


NO_WRITING = """
import os, resource, tempfile
resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
"""
CLOSED = (
    NO_WRITING
    + """
really = os.access
os.access = lambda path, mode: mode != os.W_OK and really(path, mode)
"""
)
NOWHERE = (
    CLOSED
    + """
def mkdtemp(**options):
    raise FileNotFoundError(2, "No usable temporary directory found")
tempfile.mkdtemp = tempfile.TemporaryFile = mkdtemp
"""
)


def test_kernels_that_are_there_are_used_whatever_cannot_be_written(tmp_path: Path, package: Path) -> None:
    home = tmp_path / "cache"
    folder, _, _ = run(tmp_path, home)
    for trouble in (NO_WRITING, CLOSED, NOWHERE):
        assert run(tmp_path, home, trouble) == (folder, False, 1), trouble


@pytest.mark.parametrize("trouble", [NO_WRITING, NOWHERE], ids=["full", "nowhere"])
def test_kernels_that_cannot_be_kept_are_compiled(tmp_path: Path, package: Path, trouble: str) -> None:
    for _ in range(2):
        folder, first, hits = run(tmp_path, tmp_path / "cache", trouble)
        assert (folder.parent, first, hits) == (tmp_path / "cache", True, 0)


def test_the_folder_is_named_by_the_users_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CURVELINE_CACHE", "/elsewhere")
    assert cache.home() == Path("/elsewhere")
    monkeypatch.delenv("CURVELINE_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", "/caches")
    assert cache.home() == Path("/caches/curveline")
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache.home() == Path.home() / ".cache" / "curveline"


def test_a_folder_that_cannot_be_written_is_replaced_for_the_process(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    private = cache.usable(tmp_path / "file" / "cache")
    assert private.is_dir()
    assert tmp_path not in private.parents
    assert cache.usable(tmp_path / "new" / "cache") == tmp_path / "new" / "cache"


def test_processes_that_are_started_use_the_same_kernels(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("CURVELINE_CACHE", raising=False)
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "home" / "0123")
    with cache.shared():
        assert cache.home() == tmp_path / "home"
    assert "CURVELINE_CACHE" not in os.environ
