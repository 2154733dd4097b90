"""`curveline compare`: trials of a real display beside the model."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import RESULTS, BriefOption, ForceOption, JsonOption, TrialsCameraOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_NO, InvalidInput
from curveline.units import mm

WHAT = "What is compared"


def compare(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="SHAPE TRIAL|FOLDER",
            help="A shape and its trials, points (.csv) or photographs, or folders of trials.",
        ),
    ],
    camera: TrialsCameraOption = None,
    display: Annotated[
        str | None,
        typer.Option(
            "-d",
            "--display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            rich_help_panel=WHAT,
            show_default="that of the shapes",
            help="Hold them against this display, such as one that was calibrated since.",
        ),
    ] = None,
    ddof: Annotated[
        int,
        typer.Option(
            min=0,
            max=1,
            metavar="0|1",
            rich_help_panel=WHAT,
            help="1: deviation of all trials there could be; 0: of these.",
        ),
    ] = 1,
    range_mm: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            rich_help_panel=WHAT,
            show_default="the way of a node",
            help="Vertical range that percentages are of.",
        ),
    ] = None,
    max_rmse_mm: Annotated[
        float | None, typer.Option(metavar="MM", rich_help_panel=WHAT, help="Exit with 1 if a shape is farther off.")
    ] = None,
    overlays: Annotated[
        str | None,
        typer.Option(
            metavar="DIR", rich_help_panel=RESULTS, help="Draw into each photograph what was seen, in a folder."
        ),
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write all numbers (.json), mean curves (.csv), or the panel figure (.svg, .png, .pdf); - is JSON.",
        ),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    brief: BriefOption = False,
) -> None:
    """Hold trials of shapes that a display showed against the model.

    Of every trial it says which stable state it is in, or why that cannot be told; of every shape how alike its trials
    are (MSD), and how far they are from the model (RMSE), of heights and across the curve, in mm and in percent of the
    vertical range. Tables have columns x_mm and y_mm: x from the first node's rail, y from the home height.

    A folder has files such as level-up-peak-1.csv, or a folder level-up-peak with the trials of that shape; the shape
    is level-up-peak.toml beside them, or the built-in one. Photographs need a camera file: see `curveline camera`.

    Exit code 1 says that a display was in a wrong state, that no trial of a shape could be used, or that a shape is
    farther off than --max-rmse-mm.
    """
    from curveline.cli.printing.reports.comparison_text import describe
    from curveline.comparing.agreement import CompareRequest
    from curveline.comparing.compare import compare as compare_trials
    from curveline.comparing.reading import Photographed, read_trials
    from curveline.comparing.results import to_json
    from curveline.outputs import COMPARISON, check_output, write_output

    files = [path for path in output or () if path != "-"]
    for path in files:
        check_output(COMPARISON, path, force=force)
    request = CompareRequest(ddof, _metres(range_mm, "--range-mm"), _metres(max_rmse_mm, "--max-rmse-mm"))
    trials = read_trials(what, Photographed(camera, overlays), display, TERMINAL)
    found = compare_trials(trials, request, TERMINAL)
    argv = tuple(sys.argv[1:])
    for path in files:
        write_output(COMPARISON, path, (found, argv), force=force)
        screen.note(f"wrote {path}")
    if json or len(files) < len(output or ()):
        screen.result(to_json(found, argv).decode().rstrip("\n"))
    else:
        screen.result("\n".join(describe(found)))
    if not found.is_good:
        raise typer.Exit(EXIT_NO)


def _metres(value: float | None, option: str) -> float | None:
    """A length that was given in mm; InvalidInput unless it is one."""
    if value is None:
        return None
    if not 0.0 < value < 1e6:
        raise InvalidInput(f"{option} {value:g} is no length", "choose a number of mm above 0")
    return mm(value)
