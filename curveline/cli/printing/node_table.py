"""Nodes of a display as people and scripts see them, and the options that name a radio."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from curveline.cli.printing import screen
from curveline.cli.printing.phrases import wrapped
from curveline.errors import InvalidInput

if TYPE_CHECKING:
    from curveline.plan_file import DriveSettings
    from curveline.radio.host.node_status import NodeStatus
    from curveline.radio.interface import Radio
    from curveline.radio.mock.display import MockRadio

RadioOption = Annotated[
    str | None,
    typer.Option("--radio", envvar="CURVELINE_RADIO", metavar="SPEC", help="How to reach the nodes, such as mock."),
]
RunsOption = Annotated[
    str | None,
    typer.Option(
        "--runs", metavar="DIR", help="Folder of the records of runs, instead of the user's or CURVELINE_RUNS."
    ),
]
DisplayOption = Annotated[
    str, typer.Option("--display", metavar="NAME|FILE", help="A built-in display, or a display file.")
]
HEAD = ("node", "state", "step", "extrude mm", "bias deg", "height mm", "boot", "polls", "lost", "retries")


def require_radio(spec: str | None) -> str:
    """The radio that was named; InvalidInput if none was."""
    if spec:
        return spec
    raise InvalidInput(
        "no radio was named", hint="add --radio mock, a model of the display, or set CURVELINE_RADIO to your radio"
    )


def runs_folder(chosen: str | None) -> Path:
    """The folder of the records of runs."""
    from curveline.radio.host import journal

    return Path(chosen) if chosen else journal.runs_folder()


def mock_of(radio: Radio) -> MockRadio | None:
    """The radio, if it is the model of a display, which knows more than its nodes tell."""
    from curveline.radio.mock.display import MockRadio

    return radio if isinstance(radio, MockRadio) else None


def document(status: NodeStatus, drive: DriveSettings) -> dict[str, Any]:
    """A node's status as plain data; what a silent node did not say is null."""
    record = asdict(status)
    record["fault"] = status.fault or None
    record["obstacle"] = status.obstacle or None
    record["advice"] = status.advice or None
    record["boot_cause"] = status.boot_cause or None
    record["unhomed"] = status.unhomed if status.boot_cause else None
    record["position"] = None
    if status.counts is not None:
        keys = ("extrude_mm", "bias_deg", "translate_mm")
        record["position"] = dict(zip(keys, _position(status, drive), strict=True))
    else:
        record.update(dict.fromkeys(("boot", "started", "finished", "staged", "fault")))
    return record


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
    position = map(screen.decimal, _position(status, drive))
    return (str(status.node), status.state, step, *position, str(status.boot), *link)


def _position(status: NodeStatus, drive: DriveSettings) -> list[float]:
    """Position in mm and degrees, in the order of the axes."""
    return [axis.value(count) for axis, count in zip(drive.axes, status.counts or (), strict=True)]
