"""`curveline simulate`: every stable state of every segment of shape files."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import show
from curveline.errors import EXIT_DONE, EXIT_NO, EXIT_USAGE, CurvelineError, InvalidInput

if TYPE_CHECKING:
    from curveline.results import Report, Settings
    from curveline.scene import Scene

SMALLEST_TOLERANCE_MM = 1e-6
LARGEST_TOLERANCE_MM = 10.0


def simulate(
    shapes: Annotated[list[str], typer.Argument(metavar="SHAPE...", help="Shape files (.toml).")],
    tolerance_mm: Annotated[
        float,
        typer.Option(
            min=SMALLEST_TOLERANCE_MM, max=LARGEST_TOLERANCE_MM, metavar="MM", help="Largest error of a curve."
        ),
    ] = 0.1,
    points: Annotated[
        int, typer.Option(min=2, max=100_001, metavar="N", help="Points of a curve in the output.")
    ] = 201,
    turns: Annotated[int, typer.Option(min=0, max=3, metavar="N", help="Look for loops of up to N further turns.")] = 0,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write .json, .npz, .csv, .svg or .png; - is JSON on stdout. May be repeated.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")] = False,
    json: Annotated[bool, typer.Option("--json", help="JSON on stdout, one document per shape and line.")] = False,
    no_drawing: Annotated[bool, typer.Option("--no-drawing", help="Tables only.")] = False,
) -> None:
    """Find every stable state of every segment.

    Each comes with an error bar, and what the model leaves out with a bound in mm. The table gives the height of the
    curve over its chord, on average and in the middle, energy, error, lowest eigenvalue of the second variation in
    EI/L^2, and force and moment at the left and the right clamp; * marks what the shape asks for.
    """
    from curveline import results
    from curveline.units import mm

    files = [path for path in output or () if path != "-"]
    as_json = json or len(files) < len(output or ())
    for path in files:
        results.check_output(path, force=force)
    windings = (0, *(sign * turn for turn in range(1, turns + 1) for sign in (1, -1)))
    settings = results.Settings(mm(tolerance_mm), points, windings, tuple(sys.argv[1:]))
    batch = _Batch(settings, len(shapes))
    for path in shapes:
        report = batch.run(path)
        if report is not None and as_json:
            show.emit(results.document(report))
        elif report is not None:
            _show(report, drawn=not no_drawing)
    if batch.reports:
        for path in files:
            results.write(batch.reports, path, force=force)
            show.note(f"wrote {path}")
    batch.sum_up()
    raise typer.Exit(batch.exit_code)


def _show(report: Report, *, drawn: bool) -> None:
    from curveline.cli.states import describe, sketch

    show.result("\n".join(describe(report)))
    if drawn:
        show.result("\n".join(sketch(report)))
    show.result()


class _Batch:
    """Simulates one shape after another and remembers what became of each."""

    def __init__(self, settings: Settings, total: int) -> None:
        self.settings = settings
        self.total = total
        self.reports: list[Report] = []
        self.invalid: list[str] = []
        self.short: list[str] = []

    def run(self, path: str) -> Report | None:
        """The report on one file; None if the file is of no use, which is then said."""
        from curveline.shapefile import read_shape

        try:
            scene = read_shape(path)
            show.announce_compilation()
            report = self._simulate(scene)
        except CurvelineError as error:
            show.complain(error)
            (self.invalid if isinstance(error, InvalidInput) else self.short).append(path)
            return None
        self.reports.append(report)
        for shortfall in report.shortfalls:
            show.note(f"{path}: {shortfall}")
        if report.shortfalls:
            self.short.append(path)
        return report

    def _simulate(self, scene: Scene) -> Report:
        from curveline.results import Report
        from curveline.simulation import simulate as find_states

        if not self.reports:
            # Loading the kernels takes far longer than the answer; the time that is reported is the answer's.
            find_states(scene, self.settings.tolerance, self.settings.windings)
        begin = time.perf_counter()
        segments = find_states(scene, self.settings.tolerance, self.settings.windings)
        return Report(scene, tuple(segments), self.settings, time.perf_counter() - begin)

    def sum_up(self) -> None:
        """How the batch went, if it was one."""
        if self.total == 1:
            return
        good = self.total - len(self.invalid) - len(self.short)
        show.note(f"{good} of {self.total} shapes as asked for")
        for label, paths in (("could not be used", self.invalid), ("not as asked for", self.short)):
            if paths:
                show.note(f"  {label}: {', '.join(paths)}")

    @property
    def exit_code(self) -> int:
        """A single file answers for itself; a batch says only that some shape of it failed."""
        if self.invalid and self.total == 1:
            return EXIT_USAGE
        return EXIT_NO if self.invalid or self.short else EXIT_DONE
