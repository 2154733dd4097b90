"""An atlas that the workers of a Dask scheduler compute: the same, or a word about what is wrong with the cluster."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

import curveline
from curveline.atlases import cluster, curves
from curveline.atlases.atlas import Atlas
from curveline.atlases.cluster import connected, identity, perform_as
from curveline.atlases.entries import PoseTask, segment_rod
from curveline.atlases.grid import AtlasRequest, grid_of
from curveline.atlases.results import to_npz
from curveline.errors import CurvelineError, InvalidInput, MissingExtra

pytest.importorskip("distributed")

PACKAGE = Path(curveline.__file__).parent
REQUEST = AtlasRequest({"angle_deg": (-40, 40, 9), "length_mm": (520, 640, 7)})
SOON_S = 60.0
"""How long a process of a cluster may take to start on a busy machine."""


class Process:
    """A process of a cluster, and what it says."""

    def __init__(self, *command: str, path: Path = PACKAGE.parent, cwd: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(path), "DASK_DISTRIBUTED__WORKER__DAEMON": "False"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "dask", *command],
            env=environment,
            cwd=cwd,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.said: list[str] = []
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.said.append(line)

    def waited_for(self, pattern: str) -> str:
        """What of its words fits a pattern."""
        end = time.monotonic() + SOON_S
        while time.monotonic() < end:
            if found := re.search(pattern, "".join(self.said)):
                return found[0]
            assert self.process.poll() is None, "".join(self.said)
            time.sleep(0.05)
        raise AssertionError("".join(self.said))

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self._listener.join()
        assert self.process.stderr is not None
        self.process.stderr.close()


@contextmanager
def process(*command: str, path: Path = PACKAGE.parent, cwd: Path) -> Iterator[Process]:
    started = Process(*command, path=path, cwd=cwd)
    try:
        yield started
    finally:
        started.kill()


@contextmanager
def scheduler(cwd: Path) -> Iterator[str]:
    """The address of one."""
    with process("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", cwd=cwd) as started:
        yield started.waited_for(r"tcp://127\.0\.0\.1:\d+")


@contextmanager
def worker(address: str, cwd: Path, path: Path = PACKAGE.parent) -> Iterator[Process]:
    options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
    with process("worker", address, *options, path=path, cwd=cwd) as started:
        started.waited_for("Starting established connection")
        yield started


@pytest.fixture(scope="module")
def here() -> Atlas:
    return curveline.atlas("single", REQUEST)


def test_two_workers_find_the_same(here: Atlas, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(curves, "POSES", 300)
    monkeypatch.setattr(curves.cache, "home", lambda: tmp_path / "here")
    alone = curveline.stable_curves("single")
    monkeypatch.setattr(curves.cache, "home", lambda: tmp_path / "there")
    with ExitStack() as stack:
        address = stack.enter_context(scheduler(tmp_path))
        for _ in range(2):
            stack.enter_context(worker(address, tmp_path))
        there = curveline.atlas("single", REQUEST, scheduler=address)
        shared = curveline.stable_curves("single", scheduler=address)
    assert to_npz(there) == to_npz(here)
    assert shared.entries.tobytes() == alone.entries.tobytes()


def test_what_a_worker_that_dies_leaves_another_does(
    here: Atlas, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "LOOK_S", 0.2)
    grid, rod = grid_of(here.display, REQUEST), segment_rod(here.display)
    tasks = [PoseTask(rod, grid.all_poses()[place : place + 1], 1e-4, place) for place in range(len(here.poses))]
    with ExitStack() as stack:
        address = stack.enter_context(scheduler(tmp_path))
        first, second = (stack.enter_context(worker(address, tmp_path)) for _ in range(2))
        doer = stack.enter_context(connected(address))
        answers = doer(tasks)
        found = [next(answers)]
        first.process.kill()
        found += answers
        assert b"".join(each.tobytes() for each in found) == here.entries.tobytes()
        answers = doer(tasks * 20)
        next(answers)
        second.process.kill()
        monkeypatch.setattr(cluster, "PATIENCE_S", 1.0)
        with pytest.raises(CurvelineError, match=r"the workers of .* are gone"):
            list(answers)


def test_a_scheduler_that_goes_is_told_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "LOOK_S", 0.2)
    rod = segment_rod(curveline.read_display("single"))
    poses = grid_of(curveline.read_display("single"), REQUEST).all_poses()
    with ExitStack() as stack:
        begun = process("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", cwd=tmp_path)
        started = stack.enter_context(begun)
        address = started.waited_for(r"tcp://127\.0\.0\.1:\d+")
        stack.enter_context(worker(address, tmp_path))
        doer = stack.enter_context(connected(address))
        answers = doer([PoseTask(rod, poses, 1e-4)] * 100)
        next(answers)
        started.process.kill()
        begin = time.monotonic()
        with pytest.raises(CurvelineError, match=r"scheduler at .* is gone"):
            list(answers)
        assert time.monotonic() - begin < 30.0


def older(folder: Path) -> Path:
    """A folder with a curveline of another version, the same but for that."""
    package = folder / "older" / "curveline"
    package.mkdir(parents=True)
    for each in PACKAGE.iterdir():
        if each.name not in ("_version.py", "__pycache__"):
            (package / each.name).symlink_to(each)
    (package / "_version.py").write_text('"""Another."""\n\n__version__ = "0.0.1"\n')
    return package.parent


def without_atlas(folder: Path) -> Path:
    """A folder with a curveline that knows of no atlas."""
    package = folder / "oldest" / "curveline"
    package.mkdir(parents=True)
    for name in ("__init__.py", "_version.py"):
        (package / name).write_text((PACKAGE / name).read_text())
    return package.parent


@pytest.mark.parametrize(
    ("make", "message"),
    [(older, "a worker has curveline 0.0.1; here is"), (without_atlas, "a worker has no curveline that can do this")],
)
def test_workers_with_another_curveline_are_not_asked(
    tmp_path: Path, make: Callable[[Path], Path], message: str
) -> None:
    with ExitStack() as stack:
        address = stack.enter_context(scheduler(tmp_path))
        stack.enter_context(worker(address, tmp_path))
        stack.enter_context(worker(address, tmp_path, make(tmp_path)))
        with pytest.raises(CurvelineError, match=message):
            curveline.atlas("single", REQUEST, scheduler=address)


def test_a_task_is_not_done_by_another_curveline() -> None:
    poses = grid_of(curveline.read_display("single"), REQUEST).all_poses()
    task = PoseTask(segment_rod(curveline.read_display("single")), poses[40:41], 1e-4)
    assert len(perform_as(identity(), task)) == 2
    with pytest.raises(CurvelineError, match="built otherwise"):
        perform_as(f"{curveline.__version__} other", task)


def test_a_scheduler_that_is_not_there_is_told_of_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "PATIENCE_S", 0.5)
    begin = time.monotonic()
    with pytest.raises(CurvelineError, match=r"no scheduler answers at tcp://127\.0\.0\.1:9") as caught:
        curveline.atlas("single", REQUEST, scheduler="tcp://127.0.0.1:9")
    assert "dask scheduler" in caught.value.hint
    assert time.monotonic() - begin < 20.0


def test_a_scheduler_without_workers_is_told_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "PATIENCE_S", 2.0)
    with scheduler(tmp_path) as address, pytest.raises(CurvelineError, match="has no workers"):
        curveline.atlas("single", REQUEST, scheduler=address)


@pytest.mark.parametrize("address", ["127.0.0.1:8786", "http://host:1", "tcp://host", "tcp://", "tcp://a b:1"])
def test_what_is_no_address_is_refused(address: str) -> None:
    with pytest.raises(InvalidInput, match="is no address of a scheduler"):
        curveline.atlas("single", REQUEST, scheduler=address)


def test_without_dask_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match="clusters need dask") as caught:
        curveline.atlas("single", REQUEST, scheduler="tcp://127.0.0.1:9")
    assert "curveline[cluster]" in caught.value.hint
