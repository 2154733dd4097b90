"""One node: the options that name it, a radio open to it, and what it says as text and as data."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from curveline.cli import nodes, show
from curveline.plan import AXES

if TYPE_CHECKING:
    from curveline.plan import DriveTable
    from curveline.radio import Radio
    from curveline.radio.frames import Report

NumberArgument = Annotated[int, typer.Argument(metavar="N", help="Number of the node in the row, from 1.")]
UNITS = ("mm", "deg", "mm")
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
    drive: DriveTable
    radio: Radio

    @property
    def named(self) -> str:
        """The node as further commands name it."""
        from curveline.radio.halts import display_option

        return f"{self.number}{display_option(self.display)}"

    def document(self, report: Report) -> dict[str, Any]:
        """What the node said as plain data."""
        from curveline import __version__
        from curveline.radio.link import status_of_report

        status = status_of_report(report, self.drive.addresses[self.number - 1])
        head = {"curveline": __version__, "display": self.drive.display, "radio": self.spec}
        return {**head, "node": nodes.document(status, self.drive)}

    def lines(self, report: Report) -> list[str]:
        """What the node said as text, and what to do about it."""
        return [*_facts(self, report), *_advice(self, report)]


@contextmanager
def one_node(number: int, radio: str | None, display: str, runs: str | None) -> Iterator[OneNode]:
    """The node, with its radio open; a fault of the link names the display in what it advises."""
    from curveline.plan import drive_table
    from curveline.radio import open_radio
    from curveline.radio.link import Halted
    from curveline.shapefile import read_display

    spec = nodes.require_radio(radio)
    drive = drive_table(read_display(display))
    with closing(open_radio(spec, drive, nodes.runs_folder(runs))) as opened:
        try:
            yield OneNode(number, display, spec, drive, opened)
        except Halted as error:
            raise Halted(replace(error.halt, display=display)) from None


def show_report(node: OneNode, report: Report, *, as_json: bool) -> None:
    """Print what a node said."""
    if as_json:
        show.emit(node.document(report))
    else:
        show.result("\n".join(node.lines(report)))


def _facts(node: OneNode, report: Report) -> Iterator[str]:
    from curveline.radio.link import NodeStatus, status_of_report

    status: NodeStatus = status_of_report(report, node.drive.addresses[node.number - 1])
    yield f"node {node.number} of display {node.drive.display} over {node.spec}: {status.state}"
    cause = CAUSES.get(status.boot_cause, "why it started is not known")
    yield f"  boot {status.boot}: {cause}"
    counts = status.counts or (0, 0, 0)
    for name, unit, axis, at in zip(AXES, UNITS, node.drive.axes, counts, strict=True):
        place = f"{show.decimal(axis.value(at))} {unit}"
        reason = status.unhomed.get(name)
        yield f"  {name}: {place}" if reason is None else f"  {name}: {_why(reason)}"
    yield f"  steps of its last run: {status.started} begun, {status.finished} done"
    if status.fault:
        yield f"  fault: {status.fault}, for {_duration(status.fault_seconds or 0)}"


def _why(reason: str) -> str:
    """Why an axis is not homed, as part of a sentence."""
    if reason == "not homed":
        return reason
    if reason == "encoder":
        return "not homed: no counts came from it; is its motor connected, and its encoder?"
    return f"not homed: {reason} while it looked for its zero"


def _advice(node: OneNode, report: Report) -> Iterator[str]:
    from curveline.radio.codes import Fault, State
    from curveline.radio.nodestate import LOST_POSITION

    if report.state is State.ESTOP:
        yield "switch it off and on (the mock: `curveline status --radio mock:repower`), then ask again"
    elif report.fault is not Fault.NONE and report.fault not in LOST_POSITION:
        yield f"once its reason is gone: `curveline node clear {node.named}`"
    elif any(report.axes) and report.state is not State.HOMING:
        yield f"to find its zeros: `curveline node home {node.named}`"


def _duration(seconds: int) -> str:
    if seconds == 0xFFFF:
        return "more than 18 h"
    if seconds >= 3600:
        return f"{seconds // 3600} h {seconds % 3600 // 60} min"
    return f"{seconds // 60} min {seconds % 60} s" if seconds >= 60 else f"{seconds} s"
