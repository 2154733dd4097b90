"""`curveline node watch`: what a node says of its motors, ten times a second."""

from __future__ import annotations

import time
from itertools import count
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.commands.node.common import NumberArgument, session_of
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.cli.printing import screen
from curveline.cli.printing.progress.watching import watching
from curveline.errors import EXIT_DONE, EXIT_NO

if TYPE_CHECKING:
    from curveline.driving.one_node import OneNode

PERIOD_S = 0.1
PRESS_S = 30.0
"""So long somebody may take to press a switch."""


def watch(
    number: NumberArgument,
    seconds: Annotated[
        float | None, typer.Option("--seconds", metavar="S", show_default="until Ctrl-C", help="For how long.")
    ] = None,
    press: Annotated[
        bool,
        typer.Option("--press", help="End once the lower end's switch was pressed and let go; say whether it works."),
    ] = False,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Show what a node sees of its motors, ten times a second: counts, missed edges, switches, duty, step, supply.

    Turn an axis by hand, or press a switch, and see what changes. The node is held by this command meanwhile, and its
    motors are let alone. Exit code 1 if --press finds something wrong.
    """
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        if press:
            raise typer.Exit(_press(node, PRESS_S if seconds is None else seconds, as_json=json))
        _watch(node, None if seconds is None else max(1, round(seconds / PERIOD_S)), as_json=json)


def _press(node: OneNode, seconds: float, *, as_json: bool) -> int:
    """Wait for somebody who presses the switch, say what it did, and return the exit code."""
    from curveline.cli.printing.reports.node_trials import describe_switch

    screen.note(f"press the switch of translate's lower end now, and let it go; this waits {seconds:g} s")
    found = node.check_switch(seconds, screen.note)
    if as_json:
        screen.emit(node.told("switch", found.document()))
    else:
        screen.result("\n".join(describe_switch(node, found)))
    return EXIT_DONE if found.is_well else EXIT_NO


def _watch(node: OneNode, times: int | None, *, as_json: bool) -> None:
    """So many readings, or for ever; a model's time costs nothing, so it is waited for."""
    from curveline.cli.printing.reports.node_trials import describe_watched

    is_model = getattr(node.radio, "is_virtual", False)
    with watching() as show:
        for number, seen in zip(count(1), node.watch(), strict=False):
            screen.emit(node.told("motors", seen.document())) if as_json else show(list(describe_watched(seen)))
            if number == times:
                break
            if is_model:
                time.sleep(PERIOD_S)
