"""`curveline keys adopt`: learn which devices are the nodes of a display."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import consent
from curveline.cli.options import DisplayOption, RadioOption, RunsOption, require_radio, runs_folder
from curveline.cli.printing import screen
from curveline.errors import EXIT_NO

if TYPE_CHECKING:
    from curveline.driving.adoption import Adoption


def adopt(
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: Annotated[bool, typer.Option("-y", "--yes", help="Do not ask before recording.")] = False,
    runs: RunsOption = None,
) -> None:
    """Ask every node of a display which chip it is, and record that.

    From then on only these devices are obeyed and believed. Do it once, with nobody else's display switched on.
    """
    from curveline.drive_settings import drive_settings
    from curveline.driving.adoption import check_adoptable, find_devices
    from curveline.radio.site.key_file import default_path, read_site
    from curveline.shapes.files import given_display

    spec = require_radio(radio)
    check_adoptable(spec)
    drive = drive_settings(given_display(display))
    site = read_site(default_path())
    if not yes:
        consent.require_terminal("", "add --yes to record whoever answers")
    adoption = find_devices(spec, drive, runs_folder(runs), site)
    screen.result("\n".join(_table(adoption)))
    if not yes and not consent.agrees(f"Record them in {site.path}?"):
        screen.note("nothing was recorded")
        raise typer.Exit(EXIT_NO)
    adoption.record()
    screen.note(f"recorded in {site.path}")


def _table(adoption: Adoption) -> list[str]:
    rows = []
    for each in adoption.found:
        known = adoption.site.chips.get(each.address.upper())
        before = "new" if known is None else "as before" if known == each.chip else f"was {known:08x}"
        rows.append((str(each.node), each.address, f"{each.chip:08x}", before))
    return screen.table([("node", "address", "chip", ""), *rows], frozenset({1, 2, 3}))
