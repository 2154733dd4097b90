"""Who does many like tasks: this process, several of this machine, or a cluster; the answers are the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from curveline.atlases.entries import ENTRY, Array, Entries, PoseTask
from curveline.atlases.tasks import Doer, SharedTask, perform
from curveline.errors import CurvelineError
from curveline.kernels import cache, readiness
from curveline.listening import Heard
from curveline.rod.clamped_rod import ClampedRod
from curveline.system.portable import cores

AT_ONCE = 128
"""Poses of a task: some 40 ms of work."""
PER_PROCESS = 8000
"""Poses below which a further process does not pay: it takes two seconds to start."""


class Crew(NamedTuple):
    """Who shares the work: so many processes of this machine, 0 being one per core and None as many as are fastest; or
    the workers of the Dask scheduler at an address."""

    jobs: int | None = None
    scheduler: str = ""


@contextmanager
def at_work(crew: Crew, poses: int) -> Iterator[Doer]:
    """What does tasks, of about so many poses in all; processes and connections end with the context."""
    if crew.scheduler:
        from curveline.atlases.cluster import connected

        with connected(crew.scheduler) as doer:
            yield doer
        return
    jobs = _jobs(crew.jobs, poses)
    if jobs == 1:
        yield _here
        return
    from curveline.system.workers import Workers

    with cache.shared(), Workers(perform, jobs) as workers:

        def shared(tasks: Sequence[SharedTask]) -> Iterator[Any]:
            if readiness.is_first_run() and tasks:
                # Kernels are compiled once, here, and all processes load what the cache then holds.
                tasks[0].perform()
            for _, answer in workers.map(tasks, len(tasks)):
                if isinstance(answer, CurvelineError):
                    raise answer
                yield answer

        yield shared


def found_at(doer: Doer, rod: ClampedRod, poses: Array, tolerance: float, heard: Heard) -> Entries:
    """The states (s,) at `poses (m, 6)`, in their order; `heard` is told how many poses are done."""
    tasks = [PoseTask(rod, poses[begin : begin + AT_ONCE], tolerance, begin) for begin in range(0, len(poses), AT_ONCE)]
    found, done = [np.empty(0, dtype=ENTRY)], 0
    for task, entries in zip(tasks, doer(tasks), strict=True):
        found.append(entries)
        done += len(task.poses)
        heard(done)
    return np.concatenate(found)


def _jobs(wanted: int | None, poses: int) -> int:
    """How many processes to take for so many poses."""
    if wanted is None:
        return min(cores(), max(1, math.floor(poses / PER_PROCESS)))
    return max(1, min(wanted or cores(), math.ceil(poses / AT_ONCE)))


def _here(tasks: Sequence[SharedTask]) -> Iterator[Any]:
    return map(perform, tasks)
