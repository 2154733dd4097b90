"""`curveline radio log`: frames as they pass."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.options import RESULTS, RadioOption, RunsOption, runs_folder
from curveline.cli.printing import screen
from curveline.errors import EXIT_INTERRUPTED


def log(
    node: Annotated[
        list[int] | None, typer.Option("--node", metavar="N", show_default="all", help="Only of this node.")
    ] = None,
    kind: Annotated[
        list[str] | None,
        typer.Option(
            "--type", metavar="TYPE", show_default="all", help="Only frames of this type, such as drive or status."
        ),
    ] = None,
    display: Annotated[
        str,
        typer.Option("-d", "--display", metavar="NAME", show_default="all", help="Only of the display of this name."),
    ] = "",
    seconds: Annotated[
        float | None, typer.Option("--seconds", metavar="S", show_default="until Ctrl-C", help="For how long.")
    ] = None,
    radio: RadioOption = None,
    json: Annotated[
        bool, typer.Option("--json", rich_help_panel=RESULTS, help="JSON on stdout, one document per frame and line.")
    ] = False,
    runs: RunsOption = None,
) -> None:
    """Show the frames that other commands of this computer send and hear, as they pass: in a second terminal.

    The command that has the radio tells them, without waiting for who listens: it is not slowed, and what this one does
    not keep up with is left out, and counted. Frames have no keys in them. Of a status, the steps are those finished,
    started and staged.
    """
    from curveline.cli.printing.reports.frame_lines import describe_frame
    from curveline.driving.air import check_seconds
    from curveline.driving.frame_log import FrameWish, overhear

    if seconds is not None:
        check_seconds(seconds)
    wish = FrameWish(tuple(node or ()), tuple(kind or ()), display, radio or "")
    screen.note("listening to the commands that use this runs folder; Ctrl-C ends it")
    try:
        for heard in overhear(seconds, wish, runs_folder(runs)):
            screen.emit(heard.document()) if json else screen.result("\n".join(describe_frame(heard)))
    except KeyboardInterrupt:
        # That is how one ends listening: nothing has failed.
        raise typer.Exit(EXIT_INTERRUPTED) from None
