"""`curveline node home`: let a node find the zeros of its axes."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import consent
from curveline.cli.commands.node.common import AxisOption, NumberArgument, session_of, show_report
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption, YesOption
from curveline.cli.printing import screen
from curveline.errors import EXIT_DONE, EXIT_LINK, EXIT_NO, LinkError

if TYPE_CHECKING:
    from curveline.driving.one_node import OneNode
    from curveline.radio.protocol.frames import ReportFrame, StatusFrame


def home(
    number: NumberArgument,
    axis: Annotated[
        list[AxisOption] | None,
        typer.Option("--axis", metavar="AXIS", show_default="all", help="Only this axis."),
    ] = None,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: YesOption = False,
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Let a node find the zeros of its axes and go there; Ctrl-C stops it where it is.

    Take the rod out of the node's clamp first. An axis whose motor does not answer, or that meets an obstacle, says so,
    and the others are homed. What the node had done of its run is void then.
    """
    from curveline.drive_settings import AXES

    wanted = {each.value for each in axis or AxisOption}
    if not yes:
        _ask(number, [name for name in AXES if name in wanted])
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        status = show_report(node, _home(node, wanted), as_json=json)
    is_hurt = status.fault or any(name in wanted for name in status.unhomed)
    raise typer.Exit(EXIT_LINK if is_hurt else EXIT_DONE)


def _ask(number: int, axes: list[str]) -> None:
    """Ask before anything moves, and leave if the answer is no."""
    consent.require_terminal("homing moves the node, and ", "add --yes to agree")
    if not consent.agrees(f"Is the rod out of node {number}'s clamp? Move its {', '.join(axes)}?"):
        screen.note("nothing was moved")
        raise typer.Exit(EXIT_NO)


def _home(node: OneNode, axes: Iterable[str]) -> ReportFrame:
    """Home, with a line once the node has begun, and another one about how it stands if that is cut short."""
    from curveline.cli.printing.reports.one_node_text import describe
    from curveline.radio.protocol.codes import NodeState

    told: list[NodeState] = []

    def watch(status: StatusFrame) -> None:
        if status.state is NodeState.HOMING and not told:
            told.append(status.state)
            screen.note(f"node {node.number} is homing; Ctrl-C stops it")

    try:
        return node.home(axes, watch)
    except KeyboardInterrupt:
        screen.note("stopped")
        with suppress(LinkError):
            screen.note("\n".join(describe(node, node.report())))
        raise
