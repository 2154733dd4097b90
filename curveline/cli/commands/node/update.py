"""`curveline node update`: another program for a node, over the air."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from curveline.cli import consent
from curveline.cli.commands.node.common import NumberArgument, session_of
from curveline.cli.options import AgreeOption, DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.cli.printing import screen
from curveline.errors import EXIT_DONE, EXIT_NO

STEP = 0.25
"""How often it is told how far it is."""


def update(
    number: NumberArgument,
    hex: Annotated[
        str,
        typer.Option("--hex", metavar="FILE", help="The updatable.hex that `make -C firmware updatable` wrote."),
    ],
    older: Annotated[bool, typer.Option("--older", help="Also if its firmware is older than the node's.")] = False,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: AgreeOption = False,
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Replace the program of a node that has a loader. Its motors sleep meanwhile; settings and position stay.

    It takes some ten seconds. Whatever breaks it off, the node waits in its loader, and the same command goes on.
    """
    if not yes:
        consent.require_terminal("a program is replaced, and ", "add --yes to agree")
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        if not yes and not consent.agrees(f"Replace the program of node {number}?"):
            screen.note("nothing was changed")
            raise typer.Exit(EXIT_NO)
        try:
            done = node.update(hex, older=older, seen=_teller())
        except KeyboardInterrupt:
            screen.note(f"node {number} may wait in its loader: the same command goes on from there")
            raise
        if json:
            screen.emit(node.told("update", done.document()))
        else:
            before = "its loader" if done.was is None else f"firmware {done.was}"
            screen.result(f"node {number}: {before} before, firmware {done.firmware} now, {done.frames} frames")
    raise typer.Exit(EXIT_DONE)


def _teller() -> Callable[[float], None]:
    told = 0.0

    def tell(part: float) -> None:
        nonlocal told
        if part >= told + STEP:
            told = part // STEP * STEP
            screen.note(f"{part:.0%} of the program is there")

    return tell
