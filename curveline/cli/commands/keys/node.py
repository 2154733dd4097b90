"""`curveline keys node`: put a node's settings and the site's key into its program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curveline.cli.options import DisplayOption
from curveline.cli.printing import screen
from curveline.cli.printing.key_note import warn_of_commits
from curveline.errors import InvalidInput


def node(
    number: Annotated[int, typer.Argument(metavar="N", min=1, help="Number of the node in its display, from 1.")],
    hex: Annotated[str, typer.Option("--hex", metavar="FILE", help="The node.hex that the firmware's build wrote.")],
    output: Annotated[str, typer.Option("-o", "--output", metavar="FILE", help="Where to write the node's own image.")],
    display: DisplayOption = "single",
) -> None:
    """Write the image of one node: program, number, address, limits, key.

    The file holds the site's key: only you may read it. Delete it once the node is flashed.
    """
    from curveline.drive_settings import drive_settings
    from curveline.radio.site.intel_hex import with_settings
    from curveline.radio.site.key_file import default_path, read_site, settings_record, write_private
    from curveline.shapes.files import given_display
    from curveline.system.file_kinds import IMAGE, refuse_other_kind
    from curveline.system.files import decode_text
    from curveline.system.given_files import read_given

    drive = drive_settings(given_display(display))
    site = read_site(default_path())
    if site.remark:
        screen.note(site.remark)
    settings = settings_record(site.master, drive, number)
    program = read_given(hex, 1_000_000)
    text = decode_text(program.data, program.name)
    refuse_other_kind(text, program.name, IMAGE)
    merged = with_settings(text, program.name, settings)
    try:
        write_private(Path(output), merged.encode())
    except FileExistsError:
        raise InvalidInput(f"{output} exists already", hint="delete it first: it may hold a key") from None
    except OSError as error:
        hint = "check that the folder exists, may be written and has room"
        raise InvalidInput(f"{output} cannot be written: {error.strerror or error}", hint) from None
    screen.result(f"{output}: node {number} of display {drive.display}, address {drive.addresses[number - 1]}")
    screen.note(f"flash it with: teensy_loader_cli --mcu=TEENSYLC -w {output}; then delete it, it holds the site's key")
    warn_of_commits(Path(output))
