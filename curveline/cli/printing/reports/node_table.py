"""Nodes of a display as a table for terminals of 80 columns."""

from __future__ import annotations

from collections.abc import Sequence

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import Heading, fitting
from curveline.drive_settings import DriveSettings
from curveline.driving.status import position
from curveline.phrases import wrapped
from curveline.radio.host.node_status import SILENT, NodeStatus

HEAD = ("node", "state", "step", "mm", "deg", "mm", "boot", "polls", "lost", "retries")
GROUPS = (Heading("feed", 3, 3), Heading("angle", 4, 4), Heading("height", 5, 5), Heading("radio", 7, 9))


def table(nodes: Sequence[NodeStatus], drive: DriveSettings) -> list[str]:
    """Lines of text on all nodes; faults, and what else keeps a node from moving, follow, one per line."""
    rows = [_cells(status, drive) for status in nodes]
    if MANNER.is_brief:
        lines = [f"node {status.node}: {_briefly(status, drive)}" for status in nodes]
    else:
        lines = list(screen.headed(fitting([HEAD, *rows], frozenset({1}), GROUPS), HEAD, rows))
    faults = [f"node {status.node}: fault {status.fault}" for status in nodes if status.fault]
    unfit = [status for status in nodes if status.obstacle and not status.fault]
    stuck = [line for status in unfit for line in wrapped(f"{status.obstacle}; {status.advice}")]
    unheard = [status for status in nodes if status.state == SILENT]
    silent = [line for status in unheard for line in wrapped(f"node {status.node}: {_silence(status)}")]
    return [*lines, *faults, *stuck, *silent]


def _cells(status: NodeStatus, drive: DriveSettings) -> tuple[str, ...]:
    link = tuple(map(str, (status.link.polls, status.link.lost, status.link.retries)))
    if status.counts is None:
        return (str(status.node), status.state, "-", "-", "-", "-", "-", *link)
    places = map(screen.decimal, position(status, drive).values())
    return (str(status.node), status.state, _step(status), *places, str(status.boot), *link)


def _step(status: NodeStatus) -> str:
    """The last step that is done, and the one that is under way, if any is."""
    return str(status.finished) if status.started == status.finished else f"{status.finished} > {status.started}"


def _briefly(status: NodeStatus, drive: DriveSettings) -> str:
    """How a node is, and where."""
    if status.counts is None:
        return status.state
    feed, angle, height = map(screen.decimal, position(status, drive).values())
    return f"{status.state}, step {_step(status)}, feed {feed} mm, angle {angle} deg, height {height} mm"


def _silence(status: NodeStatus) -> str:
    """What came from a node that has said nothing under its key."""
    if status.link.answered:
        return f"{status.address} answers, but not to the key of this site: another device, or other firmware?"
    return f"no answer from {status.address}"
