"""`curveline node clear`: make a node forget its fault."""

from __future__ import annotations

import typer

from curveline.cli.commands.node.common import NumberArgument, session_of, show_report
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.errors import EXIT_DONE, EXIT_LINK


def clear(
    number: NumberArgument,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Make a node forget its fault, once the reason is gone. Nothing moves.

    A run that was broken off by a stall or a driver fault can go on then; after any other fault send the shape again.
    A fault that cost the position ends with homing only: `curveline node home`.
    """
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        raise typer.Exit(EXIT_DONE if show_report(node, node.clear(), as_json=json).can_move else EXIT_LINK)
