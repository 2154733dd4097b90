"""`curveline stop`: bring every node of a display to a hold, whoever drives it."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.printing import node_table, screen
from curveline.cli.printing.node_table import DisplayOption, RadioOption, RunsOption
from curveline.errors import EXIT_DONE, EXIT_LINK

if TYPE_CHECKING:
    from curveline.radio.host.stopping import Stopped


def stop(
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: Annotated[bool, typer.Option("--json", help="JSON on stdout, one document.")] = False,
    runs: RunsOption = None,
) -> None:
    """Stop every node of a display, whoever drives it.

    Nodes slow down and hold until a host sends them again. A run that this computer sends is paused by the process that
    sends it, and can go on later. This is no safety circuit: a radio can be jammed or unplugged, so fit a switch to the
    supply of the motors.
    """
    from curveline import __version__
    from curveline.driving.halting import stop_display
    from curveline.driving.interrupted import resuming
    from curveline.plan_file import drive_settings
    from curveline.radio.site.key_file import lenient
    from curveline.shapes.files import read_display

    spec = node_table.require_radio(radio)
    drive = drive_settings(read_display(display))
    with lenient():
        halting = stop_display(spec, drive, node_table.runs_folder(runs))
    stopped, sender = halting.nodes, halting.sender
    if json:
        found = [{**asdict(each), "state": _state(each), "is_sure": each.is_sure} for each in stopped]
        by = None if sender is None else {"process": sender.live.process, "run": str(sender.run)}
        screen.emit({"curveline": __version__, "display": drive.display, "radio": spec, "nodes": found, "sender": by})
    else:
        screen.result("\n".join(_line(each) for each in stopped))
    if sender is not None:
        screen.note(f"paused by {sender.name}; to go on: {resuming(sender.run)}")
    raise typer.Exit(EXIT_DONE if all(each.is_sure for each in stopped) else EXIT_LINK)


def _state(stopped: Stopped) -> str | None:
    from curveline.radio.protocol.codes import plain_name

    return plain_name(stopped.state) if stopped.state is not None else None


def _line(stopped: Stopped) -> str:
    where = f"node {stopped.node}"
    if stopped.is_sure:
        return f"{where}: stands ({_state(stopped)})"
    if stopped.state is not None:
        return f"{where}: NOT STOPPED, it says that it is {_state(stopped)}: switch off its power"
    if stopped.link.answered:
        return f"{where}: NOT SURE, {stopped.address} acknowledges, but not under the key of this site"
    return f"{where}: NOT SURE, no answer from {stopped.address}; a node that hears no host holds by itself within 7 s"
