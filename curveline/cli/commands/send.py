"""`curveline send`: take the nodes of a display through a plan, or into a shape from where they stand."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import (
    BriefOption,
    CameraOption,
    JsonOption,
    RadioOption,
    RunsOption,
    YesOption,
    require_radio,
    runs_folder,
)

WHAT = "What to send"
LOOKING = "Looking at the display"


def send(
    context: typer.Context,
    what: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="PLAN|SHAPE|FOLDER",
            help="Plan (.json), shapes (.toml) to plan and send in a row, or a folder of lines.",
        ),
    ] = None,
    home: Annotated[
        bool,
        typer.Option(
            "--home",
            rich_help_panel=WHAT,
            help="Bring the display home, after the shapes if any, or all of a folder: level, upright, rods straight.",
        ),
    ] = False,
    display: Annotated[
        str | None,
        typer.Option(
            "-d",
            "--display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            rich_help_panel=WHAT,
            help="The display to bring home, single if not given; or whose last run is meant.",
        ),
    ] = None,
    resume: Annotated[
        str | None,
        typer.Option(
            "--resume",
            metavar="RUN",
            autocompletion=completion.runs,
            rich_help_panel=WHAT,
            help="Go on with a run: its folder, its name, or `last`, the newest that can.",
        ),
    ] = None,
    touched: Annotated[
        bool,
        typer.Option(
            "--touched", rich_help_panel=WHAT, help="Somebody touched the rod: which curve it is in is not known."
        ),
    ] = False,
    verify: Annotated[
        str | None,
        typer.Option(
            metavar="COMMAND|FOLDER",
            rich_help_panel=LOOKING,
            help="Look at the display after each shape: a command in which {} stands for the picture, a folder into "
            "which a camera puts one, or `mock`, the camera of a mock display.",
        ),
    ] = None,
    camera: CameraOption = None,
    recover: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=20,
            metavar="N",
            rich_help_panel=LOOKING,
            show_default="ask",
            help="Lead a wrong state back through the funnel, at most N times a shape.",
        ),
    ] = None,
    pictures: Annotated[
        str | None,
        typer.Option(
            metavar="DIR",
            rich_help_panel=LOOKING,
            show_default="that of the run",
            help="Folder of the pictures, named for `curveline compare`.",
        ),
    ] = None,
    radio: RadioOption = None,
    yes: YesOption = False,
    takeover: Annotated[
        bool, typer.Option("--takeover", help="Take nodes over from another host, if all stand still.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("-n", "--dry-run", help="Print what would be sent, decoded; nothing moves.")
    ] = False,
    json: JsonOption = False,
    brief: BriefOption = False,
    runs: RunsOption = None,
) -> None:
    """Take a display through a plan, to a shape or several in a row, or home, or go on with a run that was broken off.

    Shapes are planned from where the display stands and what it shows. A folder with a lines.toml is several displays
    in one run. With --verify each shape is a run of its own, and the next is sent when a picture shows it; a wrong
    state is what the way back is planned from, and exit code 1. Ctrl-C pauses once all nodes have done their step;
    again, it holds at once; again, it is an emergency stop.
    """
    from curveline.cli.run import Means, Named, rehearse, send_wish, wish_of_named, with_run
    from curveline.cli.verify import Verifying

    means = Means(radio or "", runs_folder(runs), touched=touched, takeover=takeover, asks=not yes)
    named = with_run(Named(tuple(what or ()), resume, display, home).checked(), means.runs)
    verifying = Verifying(verify, camera, recover, pictures).checked(named, is_dry=dry_run)
    if named.folder or named.resume is not None:
        from curveline.cli import lines

        is_typed = getattr(context.get_parameter_source("radio"), "name", "") == "COMMANDLINE"
        several = lines.named_lines(named, means, is_typed=is_typed, is_dry=dry_run)
        if several is not None:
            raise typer.Exit((lines.rehearse if dry_run else lines.send)(several, means, as_json=json))
    wish = wish_of_named(named, means.runs, touched=touched)
    if dry_run:
        rehearse(wish, means, as_json=json)
        return
    require_radio(radio)
    if verifying is not None:
        from curveline.cli.verify import send_verified_wish

        raise typer.Exit(send_verified_wish(wish, verifying, means, as_json=json))
    raise typer.Exit(send_wish(wish, means, as_json=json))
