"""`curveline radio range`: how well a node is heard."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from curveline.cli.commands.node.common import NumberArgument, looking_elsewhere
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


class LevelOption(Enum):
    """A power of the radio, as an option names it."""

    MIN = "min"
    LOW = "low"
    HIGH = "high"
    MAX = "max"


def range(
    number: NumberArgument,
    seconds: Annotated[float, typer.Option("--seconds", metavar="S", help="For how long, all powers together.")] = 60.0,
    level: Annotated[
        list[LevelOption] | None,
        typer.Option(
            "--level",
            metavar="POWER",
            show_default="all",
            help="Only with this power: max, high, low or min, 0, -6, -12 or -18 dBm.",
        ),
    ] = None,
    output: OutputOption = None,
    force: ForceOption = False,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Say how many polls of a node are lost, with each power that the radio can send with in turn.

    Nothing moves, and no key is needed. Runs are sent with full power; how it is with less tells what is to spare.

    Exit code 1 says that it is not good enough for runs.
    """
    from curveline.cli.printing.reports.radio_text import describe_range
    from curveline.driving.air import check_seconds
    from curveline.driving.session import connect
    from curveline.outputs import RANGE, check_output, write_output

    check_seconds(seconds)
    if output is not None:
        check_output(RANGE, output, force=force)
    with (
        connect(require_radio(radio), display, runs=runs_folder(runs), listener=TERMINAL) as session,
        looking_elsewhere(session),
    ):
        session.drive.check_node(number)
        screen.note(f"polling node {number} for {seconds:g} s; nothing moves; Ctrl-C ends it")
        found = session.range(number, seconds, tuple(each.value for each in level or ()))
    if output is not None:
        write_output(RANGE, output, [found], force=force)
    screen.emit(found.document()) if json else screen.result("\n".join(describe_range(found)))
    if output is not None:
        screen.note(f"wrote {output}")
    raise typer.Exit(EXIT_DONE if found.is_well else EXIT_NO)
