"""`curveline calibrate set`: the set that a rod takes, from strips that were bent around a drum."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.options import RESULTS, JsonOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL


def set(
    file: Annotated[str, typer.Argument(metavar="FILE", help="The readings, a .csv file; - is standard input.")],
    output: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DISPLAY",
            rich_help_panel=RESULTS,
            help="Write what was found into [rod] of this display file, and leave the rest of it as it is.",
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Find what set a rod takes from strips of it that were bent around a drum and let go.

    Columns of the file: drum_radius_mm, to the middle of the strip; held, how long it was on the drum (8h, 7d); after,
    how long after that it was read (1min, 30min); and its curvature then, positive as on the drum: curvature_per_m, or
    radius_mm, or arc_height_mm and chord_mm. temperature_C may be there, 23 is meant without. Rows with 0s in held are
    those of the strip before, and subtracted. Read it several times, from a minute on to as long as it was held.
    """
    from curveline.api import calibrate_set
    from curveline.cli.printing.reports.set_text import describe

    TERMINAL.computing()
    fit = calibrate_set(file, output)
    if json:
        screen.emit(fit.document())
    else:
        screen.result("\n".join(describe(fit)))
    if output is not None:
        screen.note(f"wrote {', '.join(fit.keys)} into {output}")
