"""`curveline camera calibrate`: the lens of a camera, from photographs of the printed board."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import RESULTS, JsonOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.drive_settings import DEFAULT_DISPLAY
from curveline.errors import EXIT_NO


def calibrate(
    pictures: Annotated[
        list[str], typer.Argument(metavar="PICTURES...", help="Photographs of the board, .jpg, .png or .heic.")
    ],
    display: Annotated[
        str,
        typer.Option(
            "-d",
            "--display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            help="The display before which the camera stands, for a new camera file.",
        ),
    ] = DEFAULT_DISPLAY,
    output: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write the lens into this camera file (.toml), and leave the rest of it as it is; or make one.",
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Calibrate the lens of a camera from photographs of the board that `curveline camera board` prints.

    Take twelve or more, with the zoom and the focus of the photographs of the display: from near, the board tilted to
    the left, the right, up and down, and in each corner of the picture. It says which pictures were used, by how many
    pixels they miss, by how much positions are off on a display that is a metre away, and what to photograph besides.

    Exit code 1 says that the pictures do not tell the lens; nothing is written then.
    """
    from curveline.cameras.board_files import check_camera, write_lens
    from curveline.cameras.lens_calibration import calibrate_lens
    from curveline.cli.printing.reports.camera_report import calibration_lines
    from curveline.shapes.files import given_display

    given = given_display(display)
    if output is not None:
        check_camera(output)
    found = calibrate_lens(pictures, TERMINAL)
    if json:
        screen.emit(found.document())
    else:
        screen.result("\n".join(calibration_lines(found)))
    if found.lens is None:
        raise typer.Exit(EXIT_NO)
    if output is not None:
        write_lens(found, output, given)
        screen.note(f"wrote [lens] into {output}")
    else:
        screen.note("keep the lens with -o camera.toml")
