"""What one node says of itself, as text for terminals of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator

from curveline.cli.printing import screen
from curveline.drive_settings import AXES, UNITS
from curveline.driving.one_node import OneNode
from curveline.phrases import wrapped
from curveline.radio.host.node_status import NodeStatus
from curveline.radio.protocol.codes import Counts
from curveline.radio.protocol.frames import ReportFrame

CAUSES = {
    "power-on": "the power came on",
    "pin": "somebody pressed reset, or a programmer did",
    "low-voltage": "the supply had sagged",
    "watchdog": "the program hung",
    "hang": "the processor hung",
    "software": "the program asked for it",
}


def describe(node: OneNode, report: ReportFrame) -> Iterator[str]:
    """What the node said, and what to do about it."""
    status = node.status(report)
    yield f"node {node.number} of display {node.drive.display} over {node.spec}: {status.state}"
    cause = CAUSES.get(status.boot_cause, "why it started is not known")
    yield f"  boot {status.boot}: {cause}"
    if status.counts is not None:
        yield from _program_facts(node, status, status.counts)
    if status.fault:
        yield f"  fault: {status.fault}, for {_duration(status.fault_seconds or 0)}"
    if status.advice and status.state != "homing":
        yield from wrapped(f"what to do: {status.advice}")


def _program_facts(node: OneNode, status: NodeStatus, counts: Counts) -> Iterator[str]:
    """Where its axes are, and what became of its last run; its loader knows nothing of that."""
    for name, unit, axis, at in zip(AXES, UNITS, node.drive.axes, counts, strict=True):
        place = f"{screen.decimal(axis.value(at))} {unit}"
        reason = status.unhomed.get(name)
        yield f"  {name}: {place}" if reason is None else f"  {name}: {_why(reason)}"
    yield f"  steps of its last run: {status.started} begun, {status.finished} done"


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
