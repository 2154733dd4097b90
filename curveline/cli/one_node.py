"""One node: the options that name it, a radio open to it, and what it says as text and as data."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from curveline.cli.printing import node_table, screen
from curveline.cli.printing.phrases import wrapped

if TYPE_CHECKING:
    from curveline.plan_file import DriveSettings
    from curveline.radio.host.node_status import NodeStatus
    from curveline.radio.interface import Radio
    from curveline.radio.protocol.frames import ReportFrame

NumberArgument = Annotated[int, typer.Argument(metavar="N", help="Number of the node in the row, from 1.")]
CAUSES = {
    "power-on": "the power came on",
    "pin": "somebody pressed reset, or a programmer did",
    "low-voltage": "the supply had sagged",
    "watchdog": "the program hung",
    "hang": "the processor hung",
    "software": "the program asked for it",
}


@dataclass(frozen=True)
class OneNode:
    """A node of a display that a radio reaches."""

    number: int
    display: str
    spec: str
    drive: DriveSettings
    radio: Radio

    def status(self, report: ReportFrame) -> NodeStatus:
        """What the node said, in words."""
        from curveline.radio.host.node_status import status_of_report

        return status_of_report(report, self.drive.addresses[self.number - 1], self.display)

    def document(self, report: ReportFrame) -> dict[str, Any]:
        """What the node said as plain data."""
        from curveline import __version__

        head = {"curveline": __version__, "display": self.drive.display, "radio": self.spec}
        told = node_table.document(self.status(report), self.drive)
        return {**head, "node": {key: each for key, each in told.items() if key != "link"}}

    def lines(self, report: ReportFrame) -> list[str]:
        """What the node said as text, and what to do about it."""
        return list(_facts(self, report))


@contextmanager
def one_node(number: int, radio: str | None, display: str, runs: str | None) -> Iterator[OneNode]:
    """The node, with its radio open; a fault of the link names the display in what it advises."""
    from curveline.driving.live import sender_of
    from curveline.plan_file import drive_settings
    from curveline.radio.host.link import Halted
    from curveline.radio.host.stop_causes import display_option
    from curveline.radio.interface import InUse, open_radio
    from curveline.shapes.files import read_display

    spec, folder = node_table.require_radio(radio), node_table.runs_folder(runs)
    drive = drive_settings(read_display(display))
    if (sender := sender_of(drive, spec, folder)) is not None:
        named = display_option(display)
        hint = f"`curveline status{named}` shows what it says of its nodes, `curveline stop{named}` pauses it"
        raise InUse(f"the radio is in use by {sender.name}", hint)
    with closing(open_radio(spec, drive, folder)) as opened:
        try:
            yield OneNode(number, display, spec, drive, opened)
        except Halted as error:
            raise Halted(replace(error.halt, display=display)) from None


def show_report(node: OneNode, report: ReportFrame, *, as_json: bool) -> NodeStatus:
    """Print what a node said, and give it back in words."""
    if as_json:
        screen.emit(node.document(report))
    else:
        screen.result("\n".join(node.lines(report)))
    return node.status(report)


def _facts(node: OneNode, report: ReportFrame) -> Iterator[str]:
    from curveline.plan_file import AXES, UNITS

    status = node.status(report)
    yield f"node {node.number} of display {node.drive.display} over {node.spec}: {status.state}"
    cause = CAUSES.get(status.boot_cause, "why it started is not known")
    yield f"  boot {status.boot}: {cause}"
    counts = status.counts or (0, 0, 0)
    for name, unit, axis, at in zip(AXES, UNITS, node.drive.axes, counts, strict=True):
        place = f"{screen.decimal(axis.value(at))} {unit}"
        reason = status.unhomed.get(name)
        yield f"  {name}: {place}" if reason is None else f"  {name}: {_why(reason)}"
    yield f"  steps of its last run: {status.started} begun, {status.finished} done"
    if status.fault:
        yield f"  fault: {status.fault}, for {_duration(status.fault_seconds or 0)}"
    if status.advice and status.state != "homing":
        yield from wrapped(f"what to do: {status.advice}")


def _why(reason: str) -> str:
    """Why an axis is not homed, as part of a sentence."""
    if reason == "not homed":
        return reason
    if reason == "encoder":
        return "not homed: no counts came from it; is its motor connected, and its encoder?"
    return f"not homed: {reason} while it looked for its zero"


def _duration(seconds: int) -> str:
    if seconds == 0xFFFF:
        return "more than 18 h"
    if seconds >= 3600:
        return f"{seconds // 3600} h {seconds % 3600 // 60} min"
    return f"{seconds // 60} min {seconds % 60} s" if seconds >= 60 else f"{seconds} s"
