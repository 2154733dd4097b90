"""`curveline atlas`: which states a segment of a display has over a grid of two numbers, folds, forces."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import RESULTS, BriefOption, ForceOption, JsonOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.units import mm

GRID = "The grid"
WORK = "Who computes"
MOST_JOBS = 256


def atlas(
    display: Annotated[
        str,
        typer.Argument(
            metavar="DISPLAY", autocompletion=completion.displays, help="A built-in display, or a display file (.toml)."
        ),
    ],
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY[=START:STOP:COUNT]",
            rich_help_panel=GRID,
            help="What runs: two of angle_deg (both nodes, mirrored), left_deg, right_deg, rise_mm (the right node "
            "over the left one) and length_mm. Without a range, all that the display allows in 41 values.  "
            "[default: angle_deg and length_mm]",
        ),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            rich_help_panel=GRID,
            help="At what another of these stands; else rise and angles are 0, the length is between its limits.",
        ),
    ] = None,
    tolerance_mm: Annotated[
        float,
        typer.Option(
            "-t",
            "--tolerance-mm",
            min=1e-6,
            max=10.0,
            metavar="MM",
            rich_help_panel=GRID,
            help="Largest error of a curve.",
        ),
    ] = 0.1,
    jobs: Annotated[
        int | None,
        typer.Option(
            "-j",
            "--jobs",
            min=0,
            max=MOST_JOBS,
            metavar="N",
            rich_help_panel=WORK,
            help="Processes to take; 0 is one per core, the default for many thousand points.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            rich_help_panel=WORK,
            help="Have the workers of a Dask scheduler compute it, such as tcp://host:8786; of one that you trust.",
        ),
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write .npz, .json, .svg, .png or .pdf; - is JSON on stdout.",
        ),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    brief: BriefOption = False,
) -> None:
    """Map the stable states of one segment of a display over two numbers, the folds between them, and forces.

    At every point of a grid all stable planar states are found. Where neighbouring points have unlike many of them, one
    is followed to its end: a fold, or a bifurcation, which is located to 0.01 mm or degrees; what comes and goes
    between two points is not seen. The table counts the points at which each combination of states is stable, and tells
    of each state its lowest eigenvalue in EI/L^2, the largest force and moment that it asks of a motor of its two
    nodes, and at which part of its points it asks for more than rod and motors can give.

    The figure is a map of the states with the lines on which they end, and contours of the motors' force.

    Processes and clusters compute the same, to the byte.
    """
    from curveline.atlases import atlas as atlases
    from curveline.atlases.grid import AtlasRequest, parsed_at, parsed_over
    from curveline.atlases.results import to_json
    from curveline.cli.printing.reports.atlas_text import describe
    from curveline.outputs import ATLAS, PICTURES, check_output, write_output

    files = [path for path in output or () if path != "-"]
    for path in files:
        check_output(ATLAS, path, force=force)
    asked = {"over": parsed_over(over)} if over else {}
    request = AtlasRequest(at=parsed_at(at or ()), tolerance=mm(tolerance_mm), **asked)
    found = atlases.atlas(display, request, jobs, scheduler or "", TERMINAL)
    argv = tuple(sys.argv[1:])
    for path in files:
        content = (found,) if ATLAS.suffix_of(path) in PICTURES else (found, argv)
        write_output(ATLAS, path, content, force=force)
        screen.note(f"wrote {path}")
    if json or len(files) < len(output or ()):
        screen.result(to_json(found, argv).decode().rstrip("\n"))
    else:
        screen.result("\n".join(describe(found)))
