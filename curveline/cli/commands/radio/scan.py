"""`curveline radio scan`: which channel is quiet."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.commands.radio.common import OutputOption
from curveline.cli.options import (
    DisplayOption,
    ForceOption,
    JsonOption,
    RadioOption,
    RunsOption,
    require_radio,
    runs_folder,
)
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_DONE, EXIT_NO


def scan(
    seconds: Annotated[float, typer.Option("--seconds", metavar="S", help="For how long.")] = 120.0,
    output: OutputOption = None,
    force: ForceOption = False,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Say for what part of the time others send on each of the radio's 126 channels, and which one to take.

    Nothing is sent, so nodes are silent, too; no key is needed. The radio tells what arrives at it with more than
    -64 dBm: what disturbs a node far from it may not show here.

    Exit code 1 says that another channel is better than the display's.
    """
    from curveline.cli.printing.reports.radio_text import describe_channels
    from curveline.driving.air import check_seconds
    from curveline.driving.session import connect
    from curveline.outputs import CHANNELS, check_output, write_output

    check_seconds(seconds)
    if output is not None:
        check_output(CHANNELS, output, force=force)
    with connect(require_radio(radio), display, runs=runs_folder(runs), listener=TERMINAL) as session:
        screen.note(f"listening on 126 channels for {seconds:g} s; nothing is sent; Ctrl-C ends it")
        found = session.channels(seconds)
    if output is not None:
        write_output(CHANNELS, output, [found], force=force)
    screen.emit(found.document()) if json else screen.result("\n".join(describe_channels(found)))
    if output is not None:
        screen.note(f"wrote {output}")
    raise typer.Exit(EXIT_DONE if found.is_well else EXIT_NO)
