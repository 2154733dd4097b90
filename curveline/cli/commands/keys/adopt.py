"""`curveline keys adopt`: learn which devices are the nodes of a display."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli import consent
from curveline.cli.options import DisplayOption, RadioOption, RunsOption, require_radio, runs_folder
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_NO


def adopt(
    numbers: Annotated[
        list[int] | None, typer.Argument(metavar="[N...]", show_default="all", help="These nodes only, from 1.")
    ] = None,
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: Annotated[bool, typer.Option("-y", "--yes", help="Do not ask before recording.")] = False,
    runs: RunsOption = None,
) -> None:
    """Ask the nodes of a display which chip they are, and record that.

    From then on only these devices are obeyed and believed. Do it once, with nobody else's display switched on.
    """
    from curveline.drive_settings import drive_settings
    from curveline.driving.adoption import HEAD, AdoptionPlace, check_adoptable, find_devices
    from curveline.driving.site_keys import read_keys
    from curveline.shapes.files import given_display

    spec = require_radio(radio)
    check_adoptable(spec)
    drive = drive_settings(given_display(display))
    site = read_keys()
    if not yes:
        consent.require_terminal("", "add --yes to record whoever answers")
    adoption = find_devices(AdoptionPlace(spec, drive, runs_folder(runs), TERMINAL), site, numbers or ())
    screen.result("\n".join(screen.table([HEAD, *adoption.rows()], frozenset({1, 2, 3}))))
    if not yes and not consent.agrees(f"Record them in {site.path}?"):
        screen.note("nothing was recorded")
        raise typer.Exit(EXIT_NO)
    adoption.record()
    screen.note(f"recorded in {site.path}")
