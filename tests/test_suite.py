"""How the suite is run: no worker starts workers, what is named exists, and of two processes one compiles."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import order
from conftest import MANY, WAITING, files_in, pytest_cmdline_main, pytest_collection_modifyitems

HERE = Path(__file__).parent


def processes(arguments: list[str], **options: Any) -> int | None:
    """How many processes a run of pytest would be given by default."""
    plain = {"numprocesses": None, "usepdb": False, "trace": False, "collectonly": False, "capture": "fd", "dist": "no"}
    option = SimpleNamespace(**{**plain, **options})
    pytest_cmdline_main(SimpleNamespace(option=option, args=arguments))  # type: ignore[arg-type]
    return option.numprocesses


@pytest.fixture
def _by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTEST_XDIST_WORKER", raising=False)
    monkeypatch.setattr("conftest.processors", lambda: 2)


@pytest.mark.usefixtures("_by_hand")
def test_all_processors_take_the_whole_and_one_a_few_files() -> None:
    assert processes([str(HERE)]) == 2 + WAITING
    assert processes([str(HERE / "test_suite.py"), f"{HERE}/rod/test_planar.py::test_x"]) is None


@pytest.mark.usefixtures("_by_hand")
@pytest.mark.parametrize("option", [{"numprocesses": 0}, {"usepdb": True}, {"capture": "no"}, {"collectonly": True}])
def test_what_one_process_does_is_left_to_it(option: dict[str, Any]) -> None:
    assert not processes([str(HERE)], **option)


def test_a_worker_starts_no_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTEST_XDIST_WORKER", "gw0")
    monkeypatch.setattr("conftest.processors", lambda: 2)
    assert processes([str(HERE)]) is None


def test_files_are_counted_in_folders_too() -> None:
    assert files_in([str(HERE / "rod")]) == len(list((HERE / "rod").glob("test_*.py"))) >= MANY
    assert files_in([f"{HERE}/test_suite.py::test_x[a]"]) == 1


def test_a_test_has_the_same_name_in_every_process() -> None:
    item: Any = SimpleNamespace(nodeid=f"test_x[{object()!r}]", path=HERE / "test_x.py")
    with pytest.raises(pytest.UsageError, match="in every process this test has another name"):
        pytest_collection_modifyitems([item])


def test_files_that_come_first_exist() -> None:
    assert [name for name in order.LONGEST_FIRST if not (HERE / name).is_file()] == []


KERNEL = """
import sys, time
from pathlib import Path
from compiling import take_turns
from curveline.kernels.kernel import njit
take_turns()

@njit
def twice(x):
    return 2.0 * x

print("ready", flush=True)
while not Path("go").exists():
    time.sleep(0.001)
assert twice(1.5) == 3.0
print(sum(twice.dispatcher.stats.cache_hits.values()))
"""


def test_one_of_two_processes_compiles_and_the_other_loads(tmp_path: Path) -> None:
    (tmp_path / "kernel.py").write_text(KERNEL)
    paths = [str(HERE), str(HERE.parent), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "CURVELINE_CACHE": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(paths)}
    both = [
        subprocess.Popen(
            [sys.executable, "kernel.py"], cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    for each in both:
        assert each.stdout is not None
        assert each.stdout.readline() == "ready\n"
    (tmp_path / "go").touch()
    assert sorted(each.communicate()[0] for each in both) == ["0\n", "1\n"]
