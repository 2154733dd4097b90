"""`curveline node info`: who a node is, and what it holds."""

from __future__ import annotations

import typer

from curveline.cli.commands.node.common import NumberArgument, looking_elsewhere, session_of
from curveline.cli.options import DisplayOption, JsonOption, RadioOption, RunsOption
from curveline.cli.printing import screen
from curveline.errors import EXIT_DONE, EXIT_LINK


def info(
    number: NumberArgument,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    json: JsonOption = False,
    runs: RunsOption = None,
) -> None:
    """Say who a node is: address, channel, device, firmware, protocol, boots, and the limits that it holds.

    A node that does not answer is looked for on the other channels.
    """
    from curveline.cli.printing.reports.node_trials import describe_info

    with session_of(radio, display, runs) as session, looking_elsewhere(session):
        node = session.node(number)
        found = node.info()
        if json:
            screen.emit(node.told("info", found.document()))
        else:
            screen.result("\n".join(describe_info(node, found)))
    raise typer.Exit(EXIT_DONE if found.limits_fit and len(found.chips) == 1 else EXIT_LINK)
