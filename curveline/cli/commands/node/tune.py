"""`curveline node tune`: how a motor answers, and which gains suit it."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.commands.node.common import AxisArgument, NumberArgument, require_consent, session_of
from curveline.cli.options import RESULTS, DisplayOption, ForceOption, JsonOption, RadioOption, RunsOption, YesOption
from curveline.cli.printing import screen


def tune(
    number: NumberArgument,
    axis: AxisArgument,
    output: Annotated[
        str | None,
        typer.Option(
            "-o", "--output", metavar="FILE", rich_help_panel=RESULTS, help="Figure: .svg, .png or .pdf; .json."
        ),
    ] = None,
    force: ForceOption = False,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: YesOption = False,
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Give a motor some of its duty at once, four times, and say what it is like and which gains suit it.

    The gains are those of firmware/core/servo.c, suggested within half and one and a half of what is shipped. Take the
    rod out of the clamp first.
    """
    from curveline.cli.printing.reports.node_trials import describe_tuning
    from curveline.outputs import TUNING, check_output, write_output

    if output is not None:
        check_output(TUNING, output, force=force)
    require_consent(f"Is the rod out of node {number}'s clamp? Turn its {axis.value} a little?", agreed=yes)
    with session_of(radio, display, runs) as session:
        node = session.node(number)
        found = node.tune(
            axis.value, lambda duty: screen.note(f"turning {axis.value} with {100 * duty:+.0f} % of its duty")
        )
        if output is not None:
            write_output(TUNING, output, [found], force=force)
        if json:
            screen.emit(node.told("tuning", found.document()))
        else:
            screen.result("\n".join(describe_tuning(found)))
    if output is not None:
        screen.note(f"wrote {output}")
