"""`curveline calibrate rod`: rod, bearings and nodes of a display from trials of its shapes."""

from __future__ import annotations

import sys
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import RESULTS, BriefOption, ForceOption, JsonOption, TrialsCameraOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import InvalidInput
from curveline.units import mm

if TYPE_CHECKING:
    from curveline.calibrating.droop import Droop

FITTING = "The fit"
WITHOUT_ERROR, WITH_ERROR = 2, 3


class AsymmetryOption(StrEnum):
    """What `--asymmetry` takes."""

    AUTO = "auto"
    FIT = "fit"
    NONE = "none"


def rod(
    trials: Annotated[
        list[str],
        typer.Argument(
            metavar="FOLDER", help="Folders of trials of at least two shapes, points (.csv) or photographs."
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
            rich_help_panel=FITTING,
            show_default="that of the shapes",
            help="Begin with this display, such as one that was calibrated before.",
        ),
    ] = None,
    droop: Annotated[
        str | None,
        typer.Option(
            metavar="L,SAG[,ERROR]",
            rich_help_panel=FITTING,
            help="Length of rod in mm that was hung over an edge, how far its tip sagged, and how sure that is.",
        ),
    ] = None,
    asymmetry: Annotated[
        AsymmetryOption,
        typer.Option(
            rich_help_panel=FITTING, help="Whether the rod may bend harder to one side: auto if the trials tell."
        ),
    ] = AsymmetryOption.AUTO,
    candidates: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SHAPE", rich_help_panel=FITTING, help="A shape that might be measured next; may be repeated."
        ),
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write the display with what was found (.toml), all numbers (.json), a figure (.svg, .png, .pdf).",
        ),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    brief: BriefOption = False,
) -> None:
    """Find what a display is really like from trials of its shapes, and write it into a display file.

    Found are the gravity length (EI/w)^(1/3) of the rod, how much its bearings give, as a length of rod that gives as
    much, by how much nodes and rod are off what they are told, and the camera's frame; each with an interval at 95 %
    from how much shapes disagree. What these shapes cannot tell is said, and which shape to measure next.

    Peaks and valleys of the same nodes tell most; eight shapes, three trials each, are plenty. Trials are laid out as
    for `curveline compare`. EI alone and a bend of the free rod that is alike all along have no effect that a shape
    shows: weigh the rod, and look at it.
    """
    from curveline.api import calibrate_rod
    from curveline.calibrating.request import CalibrationRequest
    from curveline.cli.printing.reports.calibration_text import describe
    from curveline.comparing.reading import Photographed, read_trials
    from curveline.outputs import CALIBRATION, check_output, write_output
    from curveline.shapes.files import read_shape

    files = list(output or ())
    for path in files:
        check_output(CALIBRATION, path, force=force)
    shapes = tuple(read_shape(each) for each in candidates or ())
    request = CalibrationRequest(asymmetry.value, _droop_of(droop), shapes)
    found = calibrate_rod(read_trials(trials, Photographed(camera), display, TERMINAL), request, TERMINAL)
    argv = tuple(sys.argv[1:])
    for path in files:
        write_output(CALIBRATION, path, (found, path, argv), force=force)
    if json:
        screen.emit(found.document(argv))
    else:
        screen.result("\n".join(describe(found)))
    for path in files:
        screen.note(f"wrote {path}")
    if not any(path.endswith(".toml") for path in files):
        screen.note("keep what was found with -o DISPLAY.toml")


def _droop_of(text: str | None) -> Droop | None:
    """The droop test that was given; InvalidInput for what is none."""
    from curveline.calibrating.droop import Droop

    if text is None:
        return None
    try:
        numbers = [mm(float(part)) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (WITHOUT_ERROR, WITH_ERROR):
        hint = "write --droop 300,60 for 300 mm of rod whose tip sags by 60 mm, or 300,60,2 for one of 58 to 62 mm"
        raise InvalidInput(f"--droop {text} is no length and sag", hint)
    return Droop(*numbers)
