"""What is measured on this machine, on which shapes, in which order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

from curveline.bench import trade
from curveline.bench.machine import Watch, conditions
from curveline.bench.measurement import Measurement
from curveline.bench.methods import cases
from curveline.bench.methods.own import OWN
from curveline.bench.methods.peers import PEERS
from curveline.bench.quick import FigureGroup, radio_link
from curveline.bench.quick import quick as goals
from curveline.bench.report import BenchReport
from curveline.bench.trade import TradeJob, TradePoint
from curveline.listening import SILENT, Listener
from curveline.shapes.library import builtin_shapes
from curveline.system.arguments import expect_several
from curveline.system.files import AnyPath, printable

FIGURES = "measuring, figures done:"


def own_shapes() -> list[str]:
    """The paper's shapes, which are built in: of one segment, named condition and state."""
    return [str(file) for name, file in builtin_shapes().items() if "-" in name]


def trade_jobs(shapes: Sequence[str]) -> list[TradeJob]:
    """What the trade is measured on: sets of scenes, each with the methods of a model."""
    return trade.jobs([cases.shapes(shapes), cases.clamps(), cases.random()], [*OWN, *PEERS])


def measure(
    shapes: Sequence[AnyPath] | None = None, *, quick: bool = False, listener: Listener = SILENT
) -> BenchReport:
    """Measure speed and accuracy on this machine: about two minutes, one if `quick`.

    `shapes` are shape files, those of the paper if it is None. What comes back has `rows`, the figures that are held
    against goals, `missed`, the names of those that miss them, `points`, vertices and true error [mm] against time [s],
    none of them if `quick`, and `conditions`: machine, load and versions. Nothing passes or fails; timings vary from
    run to run. `keep_bench` keeps it, `compare_bench` holds it against an older one.
    """
    expect_several(shapes, "shapes")
    files = own_shapes() if shapes is None else [str(path) for path in shapes]
    listener.computing()
    begun, watch = conditions(), Watch()
    rows = _measured(goals(files), listener)
    jobs = [] if quick else trade_jobs(files)
    points = [point for job in jobs for point in _traded(job, listener)]
    return BenchReport(rows, points, replace(begun, load=watch.load()), shapes=names_of(files))


def names_of(files: Sequence[str]) -> tuple[str, ...]:
    """What shape files are called, fit to be shown."""
    return tuple(printable(Path(file).stem) for file in files)


def measure_link(listener: Listener = SILENT) -> list[Measurement]:
    """Measure the radio link on a model of the radios: how often nodes are polled, what loss costs, when steps start.

    The times of SPI and of a dongle are assumed; nothing is sent.
    """
    return _measured(radio_link(), listener)


def _measured(groups: Sequence[FigureGroup], listener: Listener) -> list[Measurement]:
    done: list[Measurement] = []
    with listener.progress(FIGURES, None) as heard:
        for group in groups:
            for figure in group.rows():
                done.append(figure)
                heard(len(done))
    return done


def _traded(job: TradeJob, listener: Listener) -> list[TradePoint]:
    with listener.progress(f"measuring {job.scenes.name}, {job.model}", job.steps) as heard:
        return trade.measure(job, _counting(heard))


def _counting(heard: Callable[[int], object]) -> Callable[[str], None]:
    """What is told of every step before it begins, and passes on how many are done."""
    begun = count()

    def told(step: str) -> None:
        heard(next(begun))

    return told
