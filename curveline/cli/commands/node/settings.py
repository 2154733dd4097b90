"""`curveline node settings`: other settings for nodes, over the air."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Annotated

import typer

from curveline.cli import completion, consent
from curveline.cli.commands.node.common import looking_elsewhere, session_of
from curveline.cli.options import AgreeOption, DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_DONE, EXIT_NO

NOW = "Where they listen now"


def settings(
    numbers: Annotated[
        list[int] | None, typer.Argument(metavar="N", show_default="all", help="Numbers in the display file.")
    ] = None,
    old_display: Annotated[
        str | None,
        typer.Option(
            "--old-display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            rich_help_panel=NOW,
            show_default="where the display file says",
            help="The display file by which they were set up: channel, data rate, addresses.",
        ),
    ] = None,
    old_channel: Annotated[
        int | None,
        typer.Option("--old-channel", metavar="CHANNEL", rich_help_panel=NOW, help="If only the channel differs."),
    ] = None,
    old_number: Annotated[
        int | None,
        typer.Option("--old-number", metavar="N", rich_help_panel=NOW, help="Which number a single node had."),
    ] = None,
    old_keys: Annotated[
        str | None,
        typer.Option("--old-keys", metavar="FILE", rich_help_panel=NOW, help="The key file that they were set up for."),
    ] = None,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: AgreeOption = False,
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Give nodes what the display file and the key file say: number, address, channel, data rate, key, limits, speeds.

    Over the air, one node after the other, in two phases: a node keeps its old settings until it has been heard under
    the new ones, and returns to them by itself within half a minute. Broken off anywhere, the same command goes on.
    Nothing moves; where number or limits change, a node has to be homed anew.
    """
    from curveline.cli.printing.reports.settings_text import describe_change, describe_done
    from curveline.driving.new_settings import Formerly, told_settings

    if not yes:
        consent.require_terminal("settings change, and ", "add --yes to agree")
    was = Formerly(old_display, old_channel, old_number, old_keys)
    with session_of(radio, display, runs) as session, ExitStack() as stack:
        if old_display is None and old_channel is None:
            stack.enter_context(looking_elsewhere(session))
        change = stack.enter_context(session.new_settings(numbers or (), was))
        if not json:
            screen.result("\n".join(describe_change(change)))
        elif change.is_due and not yes:
            screen.note("\n".join(describe_change(change)))
        if change.is_due and not yes and not consent.agrees("Change these settings?"):
            screen.note("nothing was changed")
            raise typer.Exit(EXIT_NO)
        done = change.carry_out(TERMINAL)
        if json:
            screen.emit(told_settings(session.drive, session.spec, done, change))
        else:
            screen.result("\n".join(describe_done(done)) or "nothing to change")
    raise typer.Exit(EXIT_DONE)
