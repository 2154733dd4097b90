"""Nodes of a display as a table for terminals of 80 columns."""

from __future__ import annotations

from collections.abc import Sequence

from curveline.cli.printing import screen
from curveline.drive_settings import DriveSettings
from curveline.driving.status import position
from curveline.phrases import wrapped
from curveline.radio.host.node_status import NodeStatus

HEAD = ("node", "state", "step", "extrude mm", "bias deg", "height mm", "boot", "polls", "lost", "retries")


def table(nodes: Sequence[NodeStatus], drive: DriveSettings) -> list[str]:
    """Lines of text on all nodes; faults, and what else keeps a node from moving, follow, one per line."""
    lines = screen.table([HEAD, *(_cells(status, drive) for status in nodes)], frozenset({1}))
    faults = [f"node {status.node}: fault {status.fault}" for status in nodes if status.fault]
    unfit = [status for status in nodes if status.obstacle and not status.fault]
    stuck = [line for status in unfit for line in wrapped(f"{status.obstacle}; {status.advice}")]
    silent = [f"node {status.node}: no answer from {status.address}" for status in nodes if status.counts is None]
    return [*lines, *faults, *stuck, *silent]


def _cells(status: NodeStatus, drive: DriveSettings) -> tuple[str, ...]:
    link = tuple(map(str, (status.link.polls, status.link.lost, status.link.retries)))
    if status.counts is None:
        return (str(status.node), status.state, "-", "-", "-", "-", "-", *link)
    step = str(status.finished) if status.started == status.finished else f"{status.finished} > {status.started}"
    places = map(screen.decimal, position(status, drive).values())
    return (str(status.node), status.state, step, *places, str(status.boot), *link)
