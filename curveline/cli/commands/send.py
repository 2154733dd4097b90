"""`curveline send`: take the nodes of a display through a plan, or into a shape from where they stand."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import (
    BriefOption,
    JsonOption,
    RadioOption,
    RunsOption,
    YesOption,
    require_radio,
    runs_folder,
)

WHAT = "What to send"


def send(
    what: Annotated[
        list[str] | None,
        typer.Argument(metavar="PLAN|SHAPE", help="Plan (.json), or shapes (.toml) to plan and send in a row."),
    ] = None,
    home: Annotated[
        bool,
        typer.Option(
            "--home",
            rich_help_panel=WHAT,
            help="Bring the display home, after the shapes if any: level, upright, the rod straight.",
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

    Shapes are planned from where the display stands and what it shows. Ctrl-C pauses once all nodes have done their
    step; again, it holds at once; again, it is an emergency stop.
    """
    from curveline.cli.run import Means, Named, rehearse, send_wish, wish_of_named

    folder = runs_folder(runs)
    wish = wish_of_named(Named(tuple(what or ()), resume, display, home), folder, touched=touched)
    if dry_run:
        rehearse(wish, Means(radio or "", folder, touched=touched), as_json=json)
        return
    means = Means(require_radio(radio), folder, touched=touched, takeover=takeover, asks=not yes)
    raise typer.Exit(send_wish(wish, means, as_json=json))
