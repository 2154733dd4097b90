"""The keys of a site: made once, put into the programs of nodes, read without ever being shown."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from curveline.drive_settings import drive_settings
from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.radio.protocol.node_settings import node_settings
from curveline.radio.site import key_file
from curveline.radio.site.intel_hex import with_settings
from curveline.radio.site.key_file import SiteFile, default_path, write_private
from curveline.radio.site.program_file import NodeProgram, check_loader, program_in
from curveline.scene import Display
from curveline.system.file_kinds import IMAGE, refuse_other_kind
from curveline.system.files import AnyPath, decode_text
from curveline.system.given_files import read_given
from curveline.system.work_tree import would_be_committed

MOST_BYTES = 1_000_000
"""Of a program; those of a node have a tenth of it."""


class NodeImage(NamedTuple):
    """What the file that a node is flashed with is for."""

    path: Path  # of the file, which holds the site's key
    node: int  # in the row, from 1
    display: str  # by name
    address: str  # ten hexadecimal digits


def new_keys(file: AnyPath | None = None, listener: Listener = SILENT) -> SiteFile:
    """Make a site's key file, once; nobody but its owner may read it.

    `file` is where to, CURVELINE_KEYS or the usual place if it is None. `listener` is told if the next commit would
    take the file along. Keep a copy in a safe place: whoever has it can move the display, and without it every node
    must be given another. Raises InvalidInput for a file that exists.
    """
    site = key_file.new_site(default_path() if file is None else Path(file))
    _warn(site.path, listener)
    return site


def read_keys(file: AnyPath | None = None, listener: Listener = SILENT) -> SiteFile:
    """What a key file knows: `fingerprint` of the key and `chips`, the devices by address; `file` as for `new_keys`.

    `listener` is told what to do about a file of an older release. Raises InvalidInput for a file that is not there, is
    damaged, or can be read by others.
    """
    site = key_file.read_site(default_path() if file is None else Path(file))
    if site.remark:
        listener.note(site.remark)
    return site


def node_image(
    number: int,
    program: AnyPath,
    path: AnyPath,
    display: AnyPath | Display = "single",
    listener: Listener = SILENT,
) -> NodeImage:
    """Write what one node is flashed with: its program with number, address, limits and the site's key in it.

    `number` is that of the node in the row, from 1; `program` the node.hex that the firmware's build wrote; `path`
    where to, a file that only its owner may read: delete it once the node is flashed. The key is that of `read_keys()`.
    Raises InvalidInput for a program that is none or lacks half of its loader, a node that the display has not, or a
    file that exists.
    """
    drive = drive_settings(display if isinstance(display, Display) else _given(display))
    settings = node_settings(read_keys(listener=listener).master, drive, number)
    given = read_given(program, MOST_BYTES)
    text = decode_text(given.data, given.name)
    refuse_other_kind(text, given.name, IMAGE)
    check_loader(text, given.name)
    image = NodeImage(Path(path), number, drive.display, drive.addresses[number - 1])
    _keep(image.path, with_settings(text, given.name, settings).encode())
    _warn(image.path, listener)
    return image


def read_program(program: AnyPath) -> NodeProgram:
    """The program that `make updatable` put behind a loader; InvalidInput for a file that is something else."""
    given = read_given(program, MOST_BYTES)
    text = decode_text(given.data, given.name)
    refuse_other_kind(text, given.name, IMAGE)
    return program_in(text, given.name)


def _given(display: AnyPath) -> Display:
    from curveline.shapes.files import given_display

    return given_display(display)


def _keep(path: Path, data: bytes) -> None:
    """A new file for its owner alone."""
    try:
        write_private(path, data)
    except FileExistsError:
        raise InvalidInput(f"{path} exists already", hint="delete it first: it may hold a key") from None
    except (OSError, ValueError) as error:  # ValueError: a zero character in its name
        hint = "check that the folder exists, may be written and has room"
        raise InvalidInput(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}", hint) from None


def _warn(path: Path, listener: Listener) -> None:
    """Tell if a file that holds the site's key lies in a git work tree that does not ignore it."""
    if would_be_committed(path):
        pattern = f"*{path.suffix}" if path.suffix == ".hex" else path.name
        listener.note(
            f"warning: {path} holds the site's key, and the git work tree that it lies in does not ignore it: "
            f"add a line {pattern} to its .gitignore, or keep it elsewhere"
        )
