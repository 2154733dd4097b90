"""`curveline node home`: let a node find the zeros of its axes."""

from __future__ import annotations

import sys
from contextlib import suppress
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import show
from curveline.cli.node.one import NumberArgument, OneNode, one_node, show_report
from curveline.cli.nodes import DisplayOption, RadioOption, RunsOption
from curveline.errors import EXIT_DONE, EXIT_INTERRUPTED, EXIT_LINK, InvalidInput, LinkError
from curveline.plan import AXES

if TYPE_CHECKING:
    from curveline.radio.frames import Report, Status


class Axis(Enum):
    """An axis of a node, as an option names it."""

    EXTRUDE = "extrude"
    BIAS = "bias"
    TRANSLATE = "translate"


def home(
    number: NumberArgument,
    axis: Annotated[
        list[Axis] | None, typer.Option("--axis", help="Only this axis; may be given several times. All by default.")
    ] = None,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before moving.")] = False,
    json: Annotated[bool, typer.Option("--json", help="JSON on stdout, one document.")] = False,
    runs: RunsOption = None,
) -> None:
    """Let a node find the zeros of its axes and go there; Ctrl-C stops it where it is.

    Take the rod out of the node's clamp first. An axis whose motor does not answer, or that meets an obstacle, says so,
    and the others are homed. What the node had done of its run is void then.
    """
    wanted = [each.value for each in axis or ()] or list(AXES)
    _agree(number, wanted, yes=yes)
    with one_node(number, radio, display, runs) as node:
        report = _home(node, sum(1 << AXES.index(name) for name in set(wanted)))
        status = show_report(node, report, as_json=json)
    is_hurt = status.fault or any(name in wanted for name in status.unhomed)
    raise typer.Exit(EXIT_LINK if is_hurt else EXIT_DONE)


def _agree(number: int, axes: list[str], *, yes: bool) -> None:
    """Ask before anything moves; a no is an interrupt, since nothing has been done."""
    if yes:
        return
    if not (sys.stdin and sys.stdin.isatty() and sys.stderr.isatty()):
        raise InvalidInput("homing moves the node, and there is no terminal to ask on", hint="add --yes to agree")
    try:
        agreed = typer.confirm(f"Is the rod out of node {number}'s clamp? Move its {', '.join(axes)}?", err=True)
    except typer.Abort:
        raise KeyboardInterrupt from None
    if not agreed:
        show.note("nothing was moved")
        raise typer.Exit(EXIT_INTERRUPTED)


def _home(node: OneNode, axes: int) -> Report:
    """Home, with a line whenever the node says something new."""
    from curveline.radio.codes import State
    from curveline.radio.service import home_axes, report_of

    told: list[State] = []

    def watch(status: Status) -> None:
        if status.state is State.HOMING and not told:
            told.append(status.state)
            show.note(f"node {node.number} is homing; Ctrl-C stops it")

    try:
        return home_axes(node.radio, node.drive, node.number, axes, watch)
    except KeyboardInterrupt:
        show.note("stopped")
        with suppress(LinkError):
            show.note("\n".join(node.lines(report_of(node.radio, node.drive, node.number))))
        raise
