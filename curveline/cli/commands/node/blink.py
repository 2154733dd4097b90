"""`curveline node blink`: let a node's lamp flicker."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.commands.node.common import NumberArgument, session_of
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.cli.printing import screen


def blink(
    number: NumberArgument,
    seconds: Annotated[float, typer.Option("--seconds", metavar="S", help="For how long.")] = 10.0,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Let a node's lamp flicker, to see which one it is. Nothing moves."""
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        screen.note(f"node {number}'s lamp flickers for {seconds:g} s")
        node.blink(seconds)
        if json:
            screen.emit(node.told("blinked_seconds", seconds))
