"""`curveline keys adopt`: learn which devices are the nodes of a display."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import consent
from curveline.cli.options import DisplayOption, RadioOption, RunsOption, require_radio, runs_folder
from curveline.cli.printing import screen
from curveline.errors import EXIT_NO, InvalidInput, LinkError

if TYPE_CHECKING:
    from curveline.drive_settings import DriveSettings
    from curveline.radio.host.scan import ScannedNode
    from curveline.radio.site.key_file import SiteFile


def adopt(
    radio: RadioOption = None,
    display: DisplayOption = "single",
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before recording.")] = False,
    runs: RunsOption = None,
) -> None:
    """Ask every node of a display which chip it is, and record that.

    From then on only these devices are obeyed and believed. Do it once, with nobody else's display switched on.
    """
    from curveline.drive_settings import drive_settings
    from curveline.radio.host.scan import scan
    from curveline.radio.interface import open_radio
    from curveline.radio.site import key_file
    from curveline.shapes.files import read_display

    spec = require_radio(radio)
    drive = drive_settings(read_display(display))
    site = key_file.read_site(key_file.default_path())
    if not yes:
        consent.require_terminal("", "add --yes to record whoever answers")
    with key_file.lenient(), closing(open_radio(spec, drive, runs_folder(runs))) as opened:
        if opened.site.master != site.master:
            raise InvalidInput(
                "the nodes of this radio hold no key of a site", hint="for a trial, use --radio mock:keys"
            )
        found = scan(opened, drive)
    _refuse_misfits(found, drive)
    screen.result("\n".join(_table(found, site)))
    if not yes and not consent.agrees(f"Record them in {site.path}?"):
        screen.note("nothing was recorded")
        raise typer.Exit(EXIT_NO)
    key_file.adopt(site, {each.address: each.chip for each in found})
    screen.note(f"recorded in {site.path}")


def _refuse_misfits(found: list[ScannedNode], drive: DriveSettings) -> None:
    """LinkError unless exactly one fitting device answers on every address."""
    from curveline.radio.host.scan import problems
    from curveline.radio.site.key_file import UNKNOWN_CHIP

    wrong = [text for each in found for text in problems(each, UNKNOWN_CHIP, drive)]
    if wrong:
        raise LinkError("; ".join(wrong), hint="nothing was recorded; put that right, then adopt again")
    if len({each.chip for each in found}) < len(found):
        raise LinkError("one device answers on two addresses", hint="see which node was flashed with a wrong address")


def _table(found: list[ScannedNode], site: SiteFile) -> list[str]:
    rows = []
    for each in found:
        known = site.chips.get(each.address.upper())
        before = "new" if known is None else "as before" if known == each.chip else f"was {known:08x}"
        rows.append((str(each.node), each.address, f"{each.chip:08x}", before))
    return screen.table([("node", "address", "chip", ""), *rows], frozenset({1, 2, 3}))
