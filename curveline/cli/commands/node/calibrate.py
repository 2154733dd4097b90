"""`curveline node calibrate`: how far an axis goes per turn of its gear, by a ruler."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import consent
from curveline.cli.commands.node.common import AxisArgument, NumberArgument, require_consent, session_of
from curveline.cli.options import RESULTS, DisplayOption, JsonOption, RadioOption, RunsOption, YesOption
from curveline.cli.printing import screen
from curveline.errors import EXIT_DONE, EXIT_NO, InvalidInput

if TYPE_CHECKING:
    from curveline.driving.node_errands import Jogged
    from curveline.driving.one_node import OneNode


def calibrate(
    number: NumberArgument,
    axis: AxisArgument,
    way: Annotated[
        float | None,
        typer.Option("--way", metavar="WAY", show_default="50 mm, or 30 degrees", help="How far it goes each time."),
    ] = None,
    times: Annotated[int, typer.Option("--times", metavar="TIMES", help="How often it is measured.")] = 3,
    measured: Annotated[
        list[float] | None,
        typer.Option("--measured", metavar="WAY", show_default="ask", help="What a ruler says; once for each time."),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DISPLAY",
            rich_help_panel=RESULTS,
            help="Write what was found into [drive] of this display file, and leave the rest of it as it is.",
        ),
    ] = None,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: YesOption = False,
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Move an axis there and back, ask each time how far it went by a ruler, and say what a turn of its gear makes.

    Several times tell how exact that is; what is no matter of tolerances of parts is said, and not written. An axis
    that is not homed goes 20 mm or degrees at most: `curveline node zero` lets the extruder go further. After the
    display file has changed, its nodes need their settings anew: `curveline node settings`.
    """
    from curveline.cli.printing.reports.node_trials import describe_calibration
    from curveline.driving.node_calibration import write_calibration

    if measured and len(measured) != times:
        raise InvalidInput(f"{len(measured)} ways are measured, of {times}", f"say --times {len(measured)}")
    path = None if output is None else _changeable(output)
    require_consent(f"Move node {number}'s {axis.value} there and back, {times} times?", agreed=yes)
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        found = node.calibrate(axis.value, _ruler(node, measured), way=way, repeats=times)
        is_written = path is not None and not found.findings
        if path is not None and is_written:
            write_calibration(found, path)
        if json:
            screen.emit(node.told("calibration", found.document()))
        else:
            screen.result("\n".join(describe_calibration(node, found)))
    if is_written:
        screen.note(f"wrote {found.key} into {output}; now its nodes need that: `curveline node settings -d {output}`")
    else:
        why = "nothing was written: " if path is not None else ""
        screen.note(f"{why}{found.key} = {found.new:g} is for [drive] of the file; then `curveline node settings`")
    raise typer.Exit(EXIT_NO if found.findings else EXIT_DONE)


def _changeable(output: str) -> str:
    """A display file that can be written before anything moves; InvalidInput for a built-in one."""
    from curveline.shapes.files import given_display

    given = given_display(output)
    if not given.path:
        hint = "`curveline new display` makes a file to be changed; measure with that"
        raise InvalidInput(f"{output} is a built-in display, and stays as it is", hint)
    return given.path


def _ruler(node: OneNode, measured: Sequence[float] | None) -> Callable[[int, Jogged], float]:
    """Who says how far an axis went: the command line, a model of a ruler, or whoever sits at the terminal."""
    if measured:
        return lambda attempt, gone: measured[attempt - 1]
    if (lay := node.mock_ruler) is not None:
        return lambda attempt, gone: lay(gone)
    consent.require_terminal("the way has to be measured, and ", "add --measured for each time, or --times 1")
    return lambda attempt, gone: consent.number(f"{attempt}: by its counts {gone.way:.2f} {gone.unit}. By the ruler")
