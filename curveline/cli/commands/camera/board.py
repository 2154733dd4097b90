"""`curveline camera board`: what is printed for a camera, to scale."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cameras.paper import Paper
from curveline.cli import completion
from curveline.cli.options import RESULTS, ForceOption
from curveline.cli.printing import screen
from curveline.drive_settings import DEFAULT_DISPLAY
from curveline.errors import InvalidInput
from curveline.units import mm


def board(
    display: Annotated[
        str,
        typer.Option(
            "-d",
            "--display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            help="The display that the tags are for.",
        ),
    ] = DEFAULT_DISPLAY,
    paper: Annotated[Paper, typer.Option(help="The size of the paper.")] = Paper.A4,
    tag_mm: Annotated[float, typer.Option(metavar="MM", help="The side of a tag's black square.")] = 70.0,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write all pages (.pdf), each page (.svg), or a camera file that has the tags (.toml).",
        ),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Print, to scale, a board for calibrating the lens, and tags for the frame of a display.

    The board is a ChArUco chessboard, the tags are AprilTags of the family 36h11, each with its number and marks of its
    middle. Each page has a ruler that tells whether the printer kept the scale. The places that are told for the tags
    are above and below all that the rod can reach; they may be anywhere else around it that the camera sees, at least
    four of them, in one plane: measure where they are, and correct the camera file.
    """
    from curveline.cameras.board_files import write_board
    from curveline.cameras.boards import camera_board
    from curveline.cli.printing.reports.camera_report import board_lines
    from curveline.shapes.files import given_display

    if not output:
        raise InvalidInput("nothing says where to print", "add -o board.pdf, and -o camera.toml for the camera file")
    given = given_display(display)
    made = camera_board(given, paper, mm(tag_mm))
    files = write_board(made, given, output, force=force)
    screen.result("\n".join(board_lines(made)))
    screen.note("\n".join(f"wrote {name}" for name in files))
