"""Many scenes, one after another or on several processes; the answers come in order and are the same either way.

What becomes of a scene's report is up to makers: functions that are called where the report was made, so that what
travels between processes and stays in memory is no more than what somebody asked for.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from curveline.errors import CurvelineError
from curveline.kernels import cache, readiness
from curveline.listening import SILENT, Listener
from curveline.material.history import Dwell
from curveline.rod.models.choice import SearchRequest
from curveline.scene import Scene
from curveline.shapes import files
from curveline.shapes.radians import tell_of_radians
from curveline.simulation.advice import advice_on, advice_to_wait
from curveline.simulation.dwelling import scene_after
from curveline.simulation.results import Document, Settings, ShapeReport, document
from curveline.simulation.simulate import simulate
from curveline.system.files import AnyPath
from curveline.system.portable import cores

MANY = 400
"""Scenes from which on several processes are faster than one: a worker takes a second to start, a scene some 10 ms."""

SCENES_PER_WORKER = 100
"""Below that a further worker does not pay off."""


class Task(NamedTuple):
    """A scene, or why there is none, under the name that it goes by; of a sweep, its number from 1 and swept values."""

    label: str
    scene: Scene | CurvelineError
    number: int = 1
    swept: tuple[tuple[str, float], ...] = ()


Maker = Callable[[Task, ShapeReport], Any]
"""Makes of a report what is wanted of it; a module's function, so that other processes can import it."""


@dataclass(frozen=True)
class Order:
    """How scenes are to be simulated and what is to be made of each report."""

    settings: Settings
    makers: tuple[Maker, ...]


class Simulated(NamedTuple):
    """What came of a scene: shortfalls and remarks of the report, and what the makers made of it, in their order.

    `advice` says with which numbers there would be fewer shortfalls; a sweep, which tries numbers itself, has none.
    """

    shortfalls: tuple[str, ...]
    remarks: tuple[str, ...]
    products: tuple[Any, ...]
    advice: tuple[str, ...] = ()


Answers = Generator[tuple[Task, Simulated | CurvelineError], None, None]


def run(tasks: Iterable[Task], order: Order, jobs: int, total: int) -> Answers:
    """Every task and its answer, in order, computed by `jobs` processes; there are `total` tasks.

    Close the iterator if it is not drawn to its end: that ends the processes.
    """
    pending = iter(tasks)
    # Kernels are compiled once, here, and all workers load what the cache then holds.
    while jobs == 1 or readiness.is_first_run():
        task = next(pending, None)
        if task is None:
            return
        yield task, perform(order, task)
        total -= 1
        if jobs > 1 and isinstance(task.scene, Scene):
            break
    from curveline.system.workers import Workers

    work: partial[Simulated | CurvelineError] = partial(perform, order)
    with cache.shared(), Workers(work, min(jobs, max(1, total))) as workers:
        yield from workers.map(pending, total)


def tasks_of(shapes: Iterable[AnyPath | Scene], listener: Listener = SILENT) -> Iterator[Task]:
    """Every shape under the path or name that it goes by: its scene, read if it is in a file, or what is wrong."""
    for shape in shapes:
        label = shape.path or shape.name if isinstance(shape, Scene) else os.fspath(shape)
        try:
            scene = shape if isinstance(shape, Scene) else files.read_shape(shape)
        except CurvelineError as error:
            yield Task(label, error)
            continue
        tell_of_radians([scene], listener)
        listener.computing()
        yield Task(label, scene)


def after_history(tasks: Iterable[Task], history: Sequence[Dwell]) -> Iterator[Task]:
    """The same tasks with rods that have been through a history; what is wrong with that is an answer, too."""
    for task in tasks:
        if isinstance(task.scene, CurvelineError):
            yield task
            continue
        try:
            yield task._replace(scene=scene_after(task.scene, history, files.read_shape))
        except CurvelineError as error:
            yield task._replace(scene=error)


def perform(order: Order, task: Task) -> Simulated | CurvelineError:
    """What comes of one task; errors of the scene are an answer, too."""
    if isinstance(task.scene, CurvelineError):
        return task.scene
    try:
        report = report_on(task.scene, order.settings)
        ask = SearchRequest(order.settings.tolerance, order.settings.windings, order.settings.model)
        found = report.segments
        advice = () if task.swept else advice_to_wait(task.scene, found, ask) or advice_on(task.scene, found, ask)
        return Simulated(report.shortfalls, report.remarks, tuple(make(task, report) for make in order.makers), advice)
    except CurvelineError as error:
        return error


def line_of(task: Task, report: ShapeReport) -> str:
    """A maker: the JSON document of a report on one line; that of a point of a sweep says which, after its shape."""
    whole = document(report)
    return json.dumps(at_point(whole, task.number, task.swept) if task.swept else whole, allow_nan=False)


def at_point(whole: Document, number: int, swept: Iterable[tuple[str, float]]) -> Document:
    """The document of a report as that of a point of a sweep, with the keys and values that were swept."""
    head = {key: whole[key] for key in ("curveline", "shape")}
    return {**head, "point": number, "swept": dict(swept), **{key: whole[key] for key in whole if key not in head}}


def report_of(task: Task, report: ShapeReport) -> ShapeReport:
    """A maker: the report itself."""
    return report


_loaded: set[str] = set()
"""Models that this process has simulated with."""


def report_on(scene: Scene, settings: Settings) -> ShapeReport:
    """Every stable state of a scene, and how long it took to find them."""
    while True:
        begin = time.perf_counter()
        segments = simulate(scene, settings.tolerance, settings.windings, settings.model)
        seconds = time.perf_counter() - begin
        models = {segment.model for segment in segments}
        if models <= _loaded:
            return ShapeReport(scene, tuple(segments), settings, seconds)
        # Loading a model's kernels takes far longer than the answer; the time that is reported is the answer's.
        _loaded.update(models)


def jobs_for(wanted: int | None, scenes: int) -> int:
    """How many processes to use for so many scenes: as many as wanted, all cores for 0, what is fastest for None."""
    if wanted is None:
        wanted = 1 if scenes < MANY else min(cores(), math.ceil(scenes / SCENES_PER_WORKER))
    return max(1, min(wanted or cores(), scenes))
