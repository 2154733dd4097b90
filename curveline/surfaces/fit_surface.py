"""From a surface to the shapes of all lines of a display that show it: each line fitted by itself."""

from __future__ import annotations

import os
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

from curveline.drawings.drawing import Drawing
from curveline.errors import CurvelineError, Infeasible, InvalidInput
from curveline.fitting.fit import THOROUGH, Fit, FitRequest, fit_drawing
from curveline.kernels import cache, readiness
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.scene import Display
from curveline.shapes.files import given_display
from curveline.surfaces.budget import STALL_A, SurfaceBudget, budget_of
from curveline.surfaces.height_field import HeightField
from curveline.surfaces.laying import LaidSurface, Laying, laid
from curveline.surfaces.line_displays import LineDisplay, line_displays
from curveline.surfaces.neighbours import Neighbours, compared
from curveline.surfaces.reading import read_surface
from curveline.system.arguments import expect
from curveline.system.files import AnyPath
from curveline.system.portable import cores
from curveline.system.workers import WorkerDied, Workers
from curveline.units import to_mm


@dataclass(frozen=True)
class SurfaceRequest:
    """How to fit lines to a surface; InvalidInput for what makes no sense."""

    laying: Laying = field(default_factory=Laying)  # where the lines are
    fit: FitRequest = field(default_factory=FitRequest)  # how each of them is fitted
    jobs: int = 1  # processes; 0 for one on each core
    current_per_motor: float = STALL_A  # [A], of the worst case

    def __post_init__(self) -> None:
        if not 0.0 < self.current_per_motor <= 1e3:
            raise InvalidInput(f"no motor draws {self.current_per_motor:g} A", "choose amperes above 0, such as 0.6")
        if self.jobs < 0:
            raise InvalidInput(f"there are no {self.jobs} processes", "choose 1 or more, or 0 for all cores")


@dataclass(frozen=True, eq=False)
class FittedLine:
    """A line of a surface."""

    number: int  # from 1, front to back
    y: float  # [m], in the surface's own coordinates
    fit: Fit  # the shape that is nearest to the surface's section there, and its plan
    own: LineDisplay  # its display


@dataclass(frozen=True, eq=False)
class FittedSurface:
    """Shapes and plans of all lines of a surface."""

    name: str  # of its file, or the formula
    understood: str  # how it was read and laid
    display: Display  # of which every line has one
    request: SurfaceRequest  # how it was fitted
    lines: tuple[FittedLine, ...]  # front to back
    across: tuple[Neighbours, ...]  # each line with the one behind it
    budget: SurfaceBudget  # what it takes
    seconds: float  # that the fit took

    @property
    def off(self) -> float:
        """The largest of the lines' distances that were to be small [m]."""
        return max(line.fit.off for line in self.lines)

    @property
    def unplanned(self) -> tuple[FittedLine, ...]:
        """Lines for which a plan was sought and not found."""
        return tuple(line for line in self.lines if line.fit.refusal)

    def _repr_html_(self) -> str:
        head = ("line", "y mm", "RMS mm", "max mm", "plan")
        rows = [
            (line.number, to_mm(line.y), to_mm(line.fit.rms), to_mm(line.fit.max), _plan_in_words(line.fit))
            for line in self.lines
        ]
        return html_of(f"{self.name}: up to {to_mm(self.off):.3g} mm off in {len(self.lines)} lines", [head, *rows])


def _plan_in_words(fit: Fit) -> str:
    return f"{len(fit.plan.steps)} steps" if fit.plan else "none"


class _LineTask(NamedTuple):
    """What a process needs to fit a line."""

    number: int
    drawing: Drawing
    display: Display
    request: FitRequest


def surface(
    target: AnyPath | HeightField,
    display: AnyPath | Display = "single",
    request: SurfaceRequest | None = None,
    listener: Listener = SILENT,
) -> FittedSurface:
    """Shapes and plans of lines of a display, in parallel, that show a surface together.

    `target` is what `read_surface` or `surface_of_formula` gives, or a file that says its scale itself. `request` says
    how many lines, where, and how to fit. What comes back has a `Fit` for each of its `lines`; `write_surface` puts it
    all into a folder for `send`. Raises InvalidInput for a surface that cannot be read, is too small, or has a hole
    under a line; Infeasible where a line has no stable curve near it; MissingExtra for files of a kind whose library is
    not installed.
    """
    begin, request = time.monotonic(), request or SurfaceRequest()
    given = given_display(display) if isinstance(display, str | os.PathLike) else display
    expect(given, Display, "a display, by name, path or Display,")
    source = read_surface(target) if isinstance(target, str | os.PathLike) else target
    where = laid(source, given, request.laying)
    displays = line_displays(given, request.laying.lines)
    fits = _fitted(where, displays, request, listener)
    lines = tuple(
        FittedLine(number, y, fit, own)
        for number, (y, fit, own) in enumerate(zip(where.depths, fits, displays, strict=True), start=1)
    )
    return FittedSurface(
        name=where.name,
        understood=where.understood,
        display=given,
        request=request,
        lines=lines,
        across=tuple(compared(one.number, one.fit, other.fit) for one, other in pairwise(lines)),
        budget=budget_of(given, fits, request.current_per_motor),
        seconds=time.monotonic() - begin,
    )


def _fitted(
    where: LaidSurface, displays: Sequence[LineDisplay], request: SurfaceRequest, listener: Listener
) -> list[Fit]:
    """The fits of all lines, by as many processes as were asked for; the same whatever their number."""
    tasks = [
        _LineTask(number, section, own.display, replace(request.fit, name=f"line-{number}"))
        for number, (section, own) in enumerate(zip(where.sections, displays, strict=True), start=1)
    ]
    listener.computing()
    fits: list[Fit] = []
    with listener.progress("fitting lines", len(tasks)) as heard, closing(_answers(tasks, request.jobs)) as answers:
        for task, answer in answers:
            if isinstance(answer, CurvelineError):
                raise _about(task, answer)
            fits.append(answer)
            heard(len(fits))
    return fits


def _answers(tasks: list[_LineTask], jobs: int) -> Generator[tuple[_LineTask, Fit | CurvelineError], None, None]:
    jobs = min(jobs or cores(), len(tasks))
    pending: Iterator[_LineTask] = iter(tasks)
    # Kernels are compiled once, here, and all workers load what the cache then holds.
    while jobs == 1 or readiness.is_first_run():
        task = next(pending, None)
        if task is None:
            return
        yield task, fit_line(task)
        if jobs > 1:
            break
    with cache.shared(), Workers(fit_line, jobs) as workers:
        yield from workers.map(pending, len(tasks))


def fit_line(task: _LineTask) -> Fit | CurvelineError:
    """The fit of a line, or why there is none; a line that a quick search leaves without one is searched thoroughly.

    One line without a shape would leave all others without their surface.
    """
    for effort in dict.fromkeys((task.request.effort, THOROUGH)):
        try:
            return fit_drawing(task.drawing, task.display, replace(task.request, effort=effort))
        except InvalidInput as error:
            return error
        except Infeasible as error:
            why = error
    return why


def _about(task: _LineTask, error: CurvelineError) -> CurvelineError:
    """What is wrong with a line, with its number; the section's name has it, unless a process died."""
    if isinstance(error, WorkerDied):
        return CurvelineError(f"line {task.number}: {error.message}", error.hint)
    return error
