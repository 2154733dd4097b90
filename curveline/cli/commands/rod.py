"""`curveline rod`: what the rod of a display went through, and what set that left in it."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.options import (
    BriefOption,
    DisplayOption,
    JsonOption,
    RadioOption,
    RunsOption,
    require_radio,
    runs_folder,
)
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL


def rod(
    radio: RadioOption = None,
    display: DisplayOption = "single",
    new: Annotated[bool, typer.Option("--new", help="Put down that a new rod is in the display from now on.")] = False,
    json: JsonOption = False,
    brief: BriefOption = False,
    runs: RunsOption = None,
) -> None:
    """Say which shapes the rod of a display was held in, by the runs on record, and what is left of them in it.

    A plastic rod keeps part of a curve that it was held in: its set. Where the display file says how much that is
    (set_strength and others of its [rod]), `send` plans with the rod as it is; where it says nothing, this is what
    acetal would keep, an estimate. Nothing moves for this, and no node is asked. What a hand did to the rod is not on
    record.
    """
    from curveline.cli.printing.reports.rod_text import describe
    from curveline.driving.session import connect

    TERMINAL.computing()
    with connect(require_radio(radio), display, runs=runs_folder(runs), listener=TERMINAL) as session:
        if new:
            session.new_rod()
        found = session.rod()
    if json:
        screen.emit(found.document())
    else:
        screen.result("\n".join(describe(found)))
