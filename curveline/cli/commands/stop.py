"""`curveline stop`: bring every node of a display to a hold, whoever drives it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption, require_radio, runs_folder
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_DONE, EXIT_LINK

if TYPE_CHECKING:
    from curveline.radio.host.stopping import Stopped


def stop(
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Stop every node of a display, whoever drives it.

    Nodes slow down and hold until a host sends them again. A run that this computer sends is paused by the process that
    sends it, and can go on later. This is no safety circuit: a radio can be jammed or unplugged, so fit a switch to the
    supply of the motors.
    """
    from curveline._version import __version__
    from curveline.driving.interrupted import resuming
    from curveline.driving.session import connect

    with connect(require_radio(radio), display, runs=runs_folder(runs), listener=TERMINAL) as session:
        halting = session.stop()
        head = {"curveline": __version__, "display": session.drive.display, "radio": session.spec}
    if json:
        screen.emit({**head, **halting.document()})
    else:
        screen.result("\n".join(map(_line, halting.nodes)))
    if halting.sender is not None:
        screen.note(f"paused by {halting.sender.name}; to go on: {resuming(halting.sender.run)}")
    raise typer.Exit(EXIT_DONE if halting.is_sure else EXIT_LINK)


def _line(stopped: Stopped) -> str:
    where = f"node {stopped.node}"
    if stopped.is_sure:
        return f"{where}: stands ({stopped.state_name})"
    if stopped.state is not None:
        return f"{where}: NOT STOPPED, it says that it is {stopped.state_name}: switch off its power"
    if stopped.link.answered:
        return f"{where}: NOT SURE, {stopped.address} acknowledges, but not under the key of this site"
    return f"{where}: NOT SURE, no answer from {stopped.address}; a node that hears no host holds by itself within 7 s"
