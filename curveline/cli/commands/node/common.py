"""What the commands about one node share: its number, and what it said, printed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.options import require_radio, runs_folder
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL

if TYPE_CHECKING:
    from curveline.driving.one_node import OneNode
    from curveline.driving.session import Session
    from curveline.radio.host.node_status import NodeStatus
    from curveline.radio.protocol.frames import ReportFrame

NumberArgument = Annotated[int, typer.Argument(metavar="N", help="Number of the node in the row, from 1.")]


def session_of(radio: str | None, display: str, runs: str | None) -> Session:
    """A session with the display that the options name."""
    from curveline.driving.session import connect

    return connect(require_radio(radio), display, runs=runs_folder(runs), listener=TERMINAL)


def show_report(node: OneNode, report: ReportFrame, *, as_json: bool) -> NodeStatus:
    """Print what a node said, and give it back in words."""
    from curveline.cli.printing.reports.one_node_text import describe

    if as_json:
        screen.emit(node.document(report))
    else:
        screen.result("\n".join(describe(node, report)))
    return node.status(report)
