"""`curveline node zero`: let a node's extruder count from where the rod is now."""

from __future__ import annotations

import typer

from curveline.cli.commands.node.common import NumberArgument, session_of, show_report
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.errors import EXIT_DONE, EXIT_LINK


def zero(
    number: NumberArgument,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Let a node's extruder count from where it stands, after the rod was threaded. Nothing moves.

    What the node had done of its run is void then. A node whose rod ends in a switch finds this zero by itself: see
    `curveline node home`.
    """
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        status = show_report(node, node.zero(), as_json=json)
    raise typer.Exit(EXIT_LINK if "extrude" in status.unhomed else EXIT_DONE)
