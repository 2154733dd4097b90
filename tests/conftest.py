"""How the suite is run: on all processors, every kernel compiled by one of them, and nothing kept of the user's."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import order

MANY = 20
"""Files of tests from which on more than one process pays; fewer are done before a second one has begun."""
MOST = 8
"""Processes at most: each collects all tests for itself."""
WAITING = 2
"""How many more than there are processors: a tenth of the time a test waits for another process, or for a clock."""

for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # on busy processors those of small matrices wait for each other, and spin
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # hundreds of processes are started, and read the same sources


def files_in(arguments: list[str]) -> int:
    """How many files of tests the arguments of pytest stand for."""
    paths = [Path(argument.split("::")[0]) for argument in arguments]
    return sum(len(list(path.rglob("test_*.py"))) if path.is_dir() else 1 for path in paths)


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Where neither the number of processes was chosen nor what only one can do: enough for all processors."""
    options = config.option
    if "PYTEST_XDIST_WORKER" in os.environ:  # it is one of them: without this each starts more, without end
        return
    if getattr(options, "numprocesses", 0) is not None or options.usepdb or options.trace or options.collectonly:
        return
    if options.capture != "no" and files_in(config.args) >= MANY and processors() > 1:
        options.numprocesses = min(processors() + WAITING, MOST)
        options.dist, options.loadscopereorder = "loadfile", False


def pytest_configure(config: pytest.Config) -> None:
    """What one process is compiling, the others wait for."""
    if hasattr(config, "workerinput"):
        from compiling import take_turns

        take_turns()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files come first, so that all processes end together, which must find the same tests."""
    for item in items:
        if " at 0x" in item.nodeid:
            raise pytest.UsageError(f"{item.nodeid}: in every process this test has another name; give its rows ids")
    items.sort(key=lambda item: order.place(item.path))


def pytest_collection_finish() -> None:
    """What is there now stays: it is not looked through for garbage time and again, and what comes not as often."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 50)


@pytest.fixture(autouse=True, scope="session")
def _runs_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Records of runs go to a folder of this process: nothing is left, and no other process holds it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CURVELINE_RUNS", str(tmp_path_factory.mktemp("runs")))
        yield
