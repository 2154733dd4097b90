"""`curveline node check`: whether motors, encoders and switches are wired as they should be."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.commands.node.common import (
    AxisOption,
    NumberArgument,
    looking_elsewhere,
    require_consent,
    session_of,
)
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption, YesOption
from curveline.cli.printing import screen
from curveline.errors import EXIT_DONE, EXIT_NO

SEEN = (
    "seen from the front, extrude should first feed to the right, bias turn counter-clockwise, and translate rise; "
    "swap the two wires of a motor that went the other way first, and its encoder's A and B as well"
)


def check(
    number: NumberArgument,
    axis: Annotated[
        AxisOption | None, typer.Argument(metavar="[AXIS]", show_default="all", help="Turn this motor only.")
    ] = None,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: YesOption = False,
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Turn the motors of a node a little, one by one, and say what is wired wrongly, and what to swap.

    Each turns with a third of its force at most, some millimetres or degrees there and back; with one motor plugged in,
    name its axis: it needs no other. Take the rod out of the clamp first. Exit code 1 if anything is wrong.
    """
    from curveline.cli.printing.reports.node_trials import describe_check
    from curveline.drive_settings import AXES

    names = AXES if axis is None else (axis.value,)
    require_consent(f"Is the rod out of node {number}'s clamp? Turn its {', '.join(names)} a little?", agreed=yes)
    with session_of(radio, display, runs) as session, looking_elsewhere(session):
        node = session.node(number)
        found = node.check(names, lambda name: screen.note(f"turning {name}; Ctrl-C stops it"))
        if json:
            screen.emit(node.told("check", found.document()))
        else:
            screen.result("\n".join(describe_check(node, found)))
            if found.is_well:
                screen.note(SEEN)
    raise typer.Exit(EXIT_DONE if found.is_well else EXIT_NO)
