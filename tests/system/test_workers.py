"""Worker processes: order, exceptions, deaths, and none left behind."""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from itertools import count
from pathlib import Path

import pytest

import chores
from curveline.errors import CurvelineError
from curveline.system import workers
from curveline.system.workers import WorkerDied, Workers

UNFIT = """
import multiprocessing, os
if multiprocessing.current_process().name != "MainProcess":
    os._exit(4)
def work(task):
    return 1
"""


@pytest.fixture(autouse=True)
def _nothing_is_left() -> Iterator[None]:
    yield
    assert multiprocessing.active_children() == []


def test_answers_come_in_the_order_of_the_tasks() -> None:
    with Workers(chores.square, 3) as pool:
        assert list(pool.map(iter(range(60)), 60)) == [(number, number * number) for number in range(60)]
        assert list(pool.map([], 0)) == []


def test_tasks_are_drawn_only_a_little_ahead() -> None:
    drawn: list[int] = []
    tasks = (drawn.append(number) or number for number in count())
    with Workers(chores.square, 2) as pool, closing(pool.map(tasks, 1000)) as answers:
        assert [next(answers)[1] for _ in range(5)] == [0, 1, 4, 9, 16]
    assert len(drawn) <= 2 * (workers.AHEAD + 2) * workers.LARGEST_CHUNK


def test_what_a_task_raises_is_raised_here_and_says_where() -> None:
    with pytest.raises(LookupError) as caught, Workers(chores.refuse_seven, 2) as pool:
        list(pool.map(range(20), 20))
    assert "in refuse_seven" in "".join(caught.value.__notes__)


def test_a_task_that_kills_is_found_and_the_others_are_answered() -> None:
    with Workers(chores.die_at_seven, 2) as pool:
        answers = dict(pool.map(range(40), 40))
    dead = answers.pop(7)
    assert isinstance(dead, WorkerDied)
    assert "killed by SIGKILL" in dead.message
    assert "--jobs" in dead.hint
    assert answers == {number: number for number in range(40) if number != 7}


@pytest.mark.parametrize("total", [8, 40])
def test_a_worker_that_dies_once_costs_no_answer(tmp_path: Path, total: int) -> None:
    # Eight tasks are handed out one by one, forty in chunks.
    with Workers(partial(chores.die_once, str(tmp_path)), 2) as pool:
        assert list(pool.map(range(total), total)) == [(number, number) for number in range(total)]
    assert (tmp_path / "died").exists()


def test_when_all_die_the_machine_is_to_blame(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "MOST_LOST", 1)
    with pytest.raises(CurvelineError) as caught, Workers(chores.die, 2) as pool:
        list(pool.map(range(40), 40))
    assert "keep dying: the last one ended with exit code 9" in caught.value.message


def test_workers_that_cannot_start_are_no_endless_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "unfit.py").write_text(UNFIT)
    monkeypatch.syspath_prepend(tmp_path)
    import unfit  # type: ignore[import-not-found]

    with pytest.raises(CurvelineError) as caught, Workers(unfit.work, 2) as pool:
        list(pool.map(range(40), 40))
    assert "did not start: it ended with exit code 4" in caught.value.message
    del sys.modules["unfit"]


def test_interrupts_reach_the_parent_alone() -> None:
    with Workers(chores.hears_interrupts, 1) as pool:
        assert list(pool.map([1], 1)) == [(1, False)]
