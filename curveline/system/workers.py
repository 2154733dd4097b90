"""Many like tasks on several processes: answers in the order of the tasks, whatever dies or is interrupted meanwhile.

Workers are spawned, not forked: a forked child of a process with threads or compiled kernels is safe on no Mac and not
always on Linux. Each has a pipe of its own; when the other end goes away, it ends, so none outlives its parent.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any, Generic, TypeVar

from curveline.errors import CurvelineError
from curveline.system.portable import ignore_interrupts, interrupts_held_back

T = TypeVar("T")
R = TypeVar("R")

CHUNK_S = 0.1
"""How long a worker is to be busy with the tasks it gets at once: much longer than handing them over takes, and short
enough for a lively progress bar."""

LARGEST_CHUNK = 64
"""Tasks that a worker gets at once, at most."""

CHUNKS_PER_WORKER = 4
"""Chunks that each worker gets at the least, so that all of them end at about the same time."""

AHEAD = 4
"""Chunks per worker that may be under way while the answers wait for the slowest."""

PATIENCE_S = 5.0
"""How long a worker may take to end before it is killed."""

MOST_LOST = 8
"""Tasks that may be lost before the machine is to blame, not the tasks."""


class WorkerDied(CurvelineError):
    """Two workers in a row ended in the midst of this task."""


class _Failure:
    """An exception on its way from a worker to the parent; its notes say where it was raised."""

    def __init__(self, error: Exception) -> None:
        error.add_note("".join(traceback.format_exception(error)))
        self.error = error


class _Worker(Generic[T]):
    """A process, the parent's end of its pipe, and the tasks it has at present."""

    def __init__(self, function: Callable[[T], Any]) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, far_end = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(far_end, function), daemon=True)
        self.tasks: list[tuple[int, T]] = []
        self.given = 0.0
        self.is_ready = False
        with far_end, interrupts_held_back():
            self.process.start()

    def give(self, tasks: list[tuple[int, T]]) -> None:
        """Hand over tasks; a worker that has died meanwhile is met when its answer is read."""
        self.tasks = tasks
        self.given = time.monotonic()
        with contextlib.suppress(OSError):
            self.pipe.send([task for _, task in tasks])

    def stop(self) -> None:
        """End the process, whatever it is at."""
        self.pipe.close()
        self.process.terminate()
        self.process.join(PATIENCE_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


class Workers(Generic[T, R]):
    """`count` processes that call `function`, which they import by its name, on one task after another.

    A context manager: when it is left, also by an exception, all processes are gone.
    """

    def __init__(self, function: Callable[[T], R], count: int) -> None:
        self._function = function
        self._count = count
        self._workers: list[_Worker[T]] = []
        self._feed: Iterator[tuple[int, T]] = iter(())
        self._chunk = self._largest = 1
        self._queue: deque[list[tuple[int, T]]] = deque()
        self._under_way: dict[int, T] = {}
        self._deaths: dict[int, int] = {}
        self._answers: dict[int, R | WorkerDied] = {}

    def __enter__(self) -> Workers[T, R]:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for worker in self._workers:
            # All are told before any is waited for.
            worker.process.terminate()
        for worker in self._workers:
            worker.stop()

    def map(self, tasks: Iterable[T], total: int) -> Iterator[tuple[T, R | WorkerDied]]:
        """Every task and its answer, in order; `total` is how many there will be, as far as is known.

        The tasks are drawn only a little ahead of the answers. What `function` raises is raised here. A task whose
        worker died is given to another; if that dies, too, its answer is WorkerDied.
        """
        self._feed = enumerate(tasks)
        self._largest = max(1, min(LARGEST_CHUNK, total // (CHUNKS_PER_WORKER * self._count)))
        # The first answers also tell how long a task takes.
        self._chunk = 1
        following = 0
        while True:
            while (self._queue or self._draw()) and (worker := self._idle()):
                worker.give(self._queue.popleft())
            if not self._under_way:
                return
            self._listen()
            while following in self._answers:
                yield self._under_way.pop(following), self._answers.pop(following)
                following += 1

    def _draw(self) -> bool:
        """Queue the next chunk of tasks; False if there are no more, or the slowest answer is to be waited for."""
        if len(self._under_way) >= AHEAD * self._chunk * self._count:
            return False
        drawn = list(islice(self._feed, self._chunk))
        self._under_way.update(drawn)
        self._queue.extend([drawn] if drawn else [])
        return bool(drawn)

    def _idle(self) -> _Worker[T] | None:
        """A worker with nothing to do; a new one while there are too few."""
        for worker in self._workers:
            if not worker.tasks:
                return worker
        if len(self._workers) < self._count:
            self._workers.append(_Worker(self._function))
            return self._workers[-1]
        return None

    def _listen(self) -> None:
        """Wait for word from any worker."""
        by_pipe = {worker.pipe: worker for worker in self._workers}
        for pipe in wait(list(by_pipe)):
            worker = by_pipe[pipe]  # type: ignore[index]
            try:
                answers = worker.pipe.recv()
            except (EOFError, OSError):
                self._bury(worker)
                continue
            if not worker.is_ready:
                worker.is_ready = True
                continue
            for (index, _), answer in zip(worker.tasks, answers, strict=True):
                if isinstance(answer, _Failure):
                    raise answer.error
                self._answers[index] = answer
            pace = max(time.monotonic() - worker.given, 1e-6) / max(len(worker.tasks), 1)
            self._chunk = max(1, min(self._largest, int(CHUNK_S / pace)))
            worker.tasks = []

    def _bury(self, worker: _Worker[T]) -> None:
        """A worker is dead: its tasks go to others one by one, so that the one that kills is found."""
        self._workers.remove(worker)
        worker.pipe.close()
        worker.process.join(PATIENCE_S)
        how = _ending(worker.process.exitcode)
        hint = "memory may be short: choose fewer --jobs"
        if not worker.is_ready:
            raise CurvelineError(f"a worker process did not start: it {how}", hint)
        if len(worker.tasks) == 1:
            index = worker.tasks[0][0]
            self._deaths[index] = self._deaths.get(index, 0) + 1
            if self._deaths[index] > 1:
                self._answers[index] = WorkerDied(f"the process that computed it {how}, twice", hint)
                worker.tasks = []
        if sum(deaths > 1 for deaths in self._deaths.values()) > MOST_LOST:
            raise CurvelineError(f"worker processes keep dying: the last one {how}", hint)
        self._queue.extendleft([item] for item in reversed(worker.tasks))


def _ending(exit_code: int | None) -> str:
    """How a process ended, in words."""
    if exit_code is not None and exit_code < 0:
        return f"was killed by {signal.Signals(-exit_code).name}"
    return f"ended with exit code {exit_code}"


def _serve(pipe: Connection, function: Callable[[Any], Any]) -> None:
    """The worker's side: say that it is there, then answer until the parent is gone."""
    ignore_interrupts()
    with contextlib.suppress(EOFError, OSError):
        pipe.send(None)
        while True:
            pipe.send([_attempt(function, task) for task in pipe.recv()])


def _attempt(function: Callable[[Any], Any], task: Any) -> Any:
    try:
        return function(task)
    except Exception as error:
        return _Failure(error)
