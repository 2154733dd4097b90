"""`curveline camera pose`: where the camera stood that took a photograph of a display."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import CameraOption, JsonOption
from curveline.cli.printing import screen
from curveline.drive_settings import DEFAULT_DISPLAY
from curveline.errors import EXIT_NO, InvalidInput


def pose(
    picture: Annotated[
        str, typer.Argument(metavar="PICTURE", help="A photograph of the display, .jpg, .png or .heic.")
    ],
    camera: CameraOption = None,
    display: Annotated[
        str,
        typer.Option(
            "-d",
            "--display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            help="The display that is photographed.",
        ),
    ] = DEFAULT_DISPLAY,
    json: JsonOption = False,
) -> None:
    """Say where the camera stood that took a photograph, and how far each tag is from where the camera file has it.

    It is what to try first with a new camera file: tags that were measured wrongly show. Exit code 1 says that the
    photograph does not tell; why stands there.
    """
    from curveline.cameras.camera_file import read_camera
    from curveline.cameras.photographs import read_photograph
    from curveline.cameras.pose import ViewFailure, view_document, view_of
    from curveline.cli.printing.reports.camera_report import pose_lines
    from curveline.shapes.files import given_display

    if camera is None:
        raise InvalidInput(
            "no camera file was named", "add --camera camera.toml; `curveline camera calibrate` makes it"
        )
    setup = read_camera(camera, given_display(display))
    photograph = read_photograph(picture)
    found = view_of(photograph, setup)
    if json:
        screen.emit({"picture": picture, "camera": camera, **view_document(found, setup.frame)})
    else:
        screen.result("\n".join(pose_lines(found, setup.frame)))
    if isinstance(found, ViewFailure):
        raise typer.Exit(EXIT_NO)
