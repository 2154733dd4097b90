"""What the commands about one node share: its number, and what it said, printed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import consent
from curveline.cli.options import require_radio, runs_folder
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_NO

if TYPE_CHECKING:
    from curveline.driving.one_node import OneNode
    from curveline.driving.session import Session
    from curveline.radio.host.node_status import NodeStatus
    from curveline.radio.protocol.frames import ReportFrame

NumberArgument = Annotated[int, typer.Argument(metavar="N", help="Number of the node in the row, from 1.")]


class AxisOption(Enum):
    """An axis of a node, as an option names it."""

    EXTRUDE = "extrude"
    BIAS = "bias"
    TRANSLATE = "translate"


AxisArgument = Annotated[
    AxisOption, typer.Argument(metavar="AXIS", help="extrude (mm), bias (degrees) or translate (mm).")
]


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


def require_consent(question: str, *, agreed: bool) -> None:
    """Ask before a motor turns, unless that is agreed to already; leave if the answer is no."""
    if agreed:
        return
    consent.require_terminal("motors turn, and ", "add --yes to agree")
    if not consent.agrees(question):
        screen.note("nothing was moved")
        raise typer.Exit(EXIT_NO)


@contextmanager
def looking_elsewhere(session: Session) -> Iterator[None]:
    """Look on the other channels for a node that does not answer, and say where it is."""
    from curveline.radio.host.link import Halted
    from curveline.radio.host.stop_causes import Cause, Halt

    try:
        yield
    except Halted as error:
        if error.halt.cause not in (Cause.SILENT, Cause.STRAYED):
            raise
        own, number = session.drive.channel, error.halt.node
        screen.note(f"node {number} does not answer on channel {own}; looking on the others")
        channel = session.stray_channel(number)
        if channel is None:
            raise
        detail = f"{own}, which the display file names, but on {channel}"
        halt = Halt(Cause.CHANNEL, number, detail=detail, display=error.halt.display, channel=channel)
        raise Halted(halt) from None
