"""`curveline node clear`: make a node forget its fault."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.one_node import NumberArgument, one_node, show_report
from curveline.cli.printing.node_table import DisplayOption, RadioOption, RunsOption
from curveline.errors import EXIT_DONE, EXIT_LINK


def clear(
    number: NumberArgument,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: Annotated[bool, typer.Option("--json", help="JSON on stdout, one document.")] = False,
    runs: RunsOption = None,
) -> None:
    """Make a node forget its fault, once the reason is gone. Nothing moves.

    A run that was broken off by a stall or a driver fault can go on then; after any other fault send the shape again.
    A fault that cost the position ends with homing only: `curveline node home`.
    """
    from curveline.radio.host.service import clear_fault

    with one_node(number, radio, display, runs) as node:
        report = clear_fault(node.radio, node.drive, number)
        raise typer.Exit(EXIT_DONE if show_report(node, report, as_json=json).can_move else EXIT_LINK)
