"""Files of what is printed for a camera, and of what a calibration found."""

from __future__ import annotations

import os
from collections.abc import Sequence

from curveline.cameras.boards import CameraBoard
from curveline.cameras.camera_text import lens_keys, new_text, with_lens
from curveline.cameras.lens_calibration import LensCalibration
from curveline.cameras.printed_page import to_pdf, to_svg
from curveline.cameras.tag_layout import frame_for
from curveline.errors import InvalidInput
from curveline.scene import Display
from curveline.shapes.files import MAX_BYTES
from curveline.system.file_kinds import CAMERA, refuse_other_kind
from curveline.system.files import AnyPath, check_writable, decode_text, read_file, write_file

PDF, SVG, TOML = ".pdf", ".svg", ".toml"


def board_files(board: CameraBoard, display: Display, path: AnyPath) -> dict[str, bytes]:
    """What goes into which file: a .pdf of all pages, an .svg of each, or a camera file (.toml) that has the tags.

    InvalidInput for another suffix.
    """
    name = os.fspath(path)
    stem, suffix = os.path.splitext(name)
    match suffix.lower():
        case ".pdf":
            return {name: to_pdf(board.pages)}
        case ".svg":
            return {f"{stem}-{page.name}{suffix}": to_svg(page) for page in board.pages}
        case ".toml":
            return {name: new_text(display, board.frame).encode()}
    hint = f"pages to print are {PDF} or {SVG}, a camera file is {TOML}"
    raise InvalidInput(f"{name}: cannot tell the format from the suffix {suffix!r}", hint)


def write_board(
    board: CameraBoard, display: Display, paths: Sequence[AnyPath], *, force: bool = False
) -> tuple[str, ...]:
    """Write pages to print, and the camera file for the tags on them, by the suffixes of `paths`; the files' names.

    An .svg holds one page, and its name gets that of the page. InvalidInput if one exists and `force` is not given.
    """
    files: dict[str, bytes] = {}
    for path in paths:
        files.update(board_files(board, display, path))
    for name in files:
        check_writable(name, force=force)
    for name, data in files.items():
        write_file(name, data, force=force)
    return tuple(files)


def check_camera(path: AnyPath) -> None:
    """Refuse, before anything is computed, a file that `write_lens` could not write."""
    if not os.fspath(path).endswith(TOML):
        raise InvalidInput(f"{os.fspath(path)}: a camera file ends in {TOML}", "name it so")
    _text_of(path)
    check_writable(path, force=True)


def write_lens(calibration: LensCalibration, path: AnyPath, display: Display) -> None:
    """Write the lens that was found into a camera file; all else in it, and comments, stay as they are.

    A file that does not exist is made, with tags where `frame_for` has them around the display. InvalidInput if no lens
    was found, or for a file that is something else.
    """
    if calibration.lens is None:
        raise InvalidInput(
            "these pictures do not tell the lens", f"photograph besides {'; '.join(calibration.missing)}"
        )
    keys = lens_keys(calibration.lens, calibration.camera)
    text = _text_of(path)
    new = new_text(display, frame_for(display), keys) if text is None else with_lens(text, keys, os.fspath(path))
    write_file(path, new.encode(), force=True)


def _text_of(path: AnyPath) -> str | None:
    """The text of a camera file; None if there is none."""
    if not os.path.lexists(path):
        return None
    name = os.fspath(path)
    text = decode_text(read_file(path, MAX_BYTES), name)
    refuse_other_kind(text, name, CAMERA)
    return text
