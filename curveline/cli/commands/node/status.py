"""`curveline node status`: all that one node says of itself."""

from __future__ import annotations

import typer

from curveline.cli.commands.node.common import NumberArgument, session_of, show_report
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.errors import EXIT_DONE, EXIT_LINK


def status(
    number: NumberArgument,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Say how a node is: why it started last, each axis, its last run, its fault and since when, and what helps.

    Asking disturbs no run.
    """
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        raise typer.Exit(EXIT_DONE if show_report(node, node.report(), as_json=json).can_move else EXIT_LINK)
