"""`curveline node jog`: move one axis a little."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.commands.node.common import AxisArgument, NumberArgument, session_of
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.cli.printing import screen
from curveline.cli.printing.help.help_pages import signed


def jog(
    number: NumberArgument,
    axis: AxisArgument,
    by: Annotated[
        float, typer.Argument(metavar="BY", parser=signed, help="How far: mm, or degrees of bias; -5 is back.")
    ],
    unhomed: Annotated[
        bool, typer.Option("--unhomed", help="Also an axis that is not homed, by 20 mm or degrees at most.")
    ] = False,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Move one axis of a node, slowly, and only as long as this command runs; Ctrl-C stops it.

    It stays within the limits of the axis; extrude has none but the length of the rod, so mind what is in the clamp.
    When this computer falls silent, the node stops within a quarter of a second and the time that braking takes. What
    the node had done of its run is void then.
    """
    from curveline.cli.printing.reports.node_trials import describe_jog

    with session_of(radio, display, runs) as session:
        node = session.node(number)
        gone = node.jog(axis.value, by, unhomed=unhomed)
        if json:
            screen.emit(node.told("jog", gone.document()))
        else:
            screen.result("\n".join(describe_jog(number, gone)))
