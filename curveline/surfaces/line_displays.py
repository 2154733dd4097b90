"""The displays of lines: that of one line, with a name and radio addresses of its own for each."""

from __future__ import annotations

import os
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from curveline.scene import Display
from curveline.shapes.changed_display import changed_text, text_of
from curveline.shapes.file_keys import LONGEST_NAME
from curveline.shapes.files import MAX_BYTES, read_display
from curveline.shapes.toml_location import KeyPath
from curveline.system.files import read_file

PROFILE = ("rod", "natural_curvature_file")
NEXT_LINE = 0x100
"""Between addresses of the same node in neighbouring lines: their last byte tells nodes apart, the one before lines."""
ADDRESSES = 1 << 40


@dataclass(frozen=True)
class LineDisplay:
    """The display of a line, in a file of its own."""

    display: Display  # what was read of the file
    text: str  # of the file
    beside: tuple[str, bytes] | None = None  # name and bytes of a file that it needs beside it

    @property
    def files(self) -> Iterator[tuple[str, bytes]]:
        """What else must be in its folder, by name."""
        if self.beside is not None:
            yield self.beside


def line_displays(display: Display, count: int) -> tuple[LineDisplay, ...]:
    """A display for each of several lines, comments kept; they differ in their names and in all of their addresses.

    They follow from the display alone, so that nodes keep their addresses from surface to surface. InvalidInput for a
    display that is in no file, or whose file cannot be changed so.
    """
    text = text_of(display)
    beside = _beside(display, text)
    used: set[int] = set()
    found = []
    for number in range(1, count + 1):
        addresses = [_free(int(each, 16) + (number - 1) * NEXT_LINE, used) for each in display.radio.addresses]
        told = [f"{each:010X}" for each in addresses]
        changed = _changed(text, display, number, told, beside[0] if beside else "")
        found.append(LineDisplay(_read(changed, beside), changed, beside))
    return tuple(found)


def _free(address: int, used: set[int]) -> int:
    """The first address from one on that is not used, and is now."""
    while address % ADDRESSES in used:
        address += NEXT_LINE
    used.add(address % ADDRESSES)
    return address % ADDRESSES


def _beside(display: Display, text: str) -> tuple[str, bytes] | None:
    """The file that a display file names, by its name without a folder."""
    named = tomllib.loads(text)["rod"].get(PROFILE[1])
    if named is None:
        return None
    path = os.path.join(os.path.dirname(display.path), named)
    return os.path.basename(path), read_file(path, MAX_BYTES)


def _changed(text: str, display: Display, number: int, addresses: Sequence[str], beside: str) -> str:
    """A display file with another name and other addresses, and a file `beside` it if it has one."""
    values: dict[KeyPath, str] = {("name",): f"{display.name[: LONGEST_NAME - 3]}-{number}"}
    values.update({("radio", "addresses", index): each for index, each in enumerate(addresses)})
    if beside:
        values[PROFILE] = beside
    return changed_text(text, values, display.path or display.name)


def _read(text: str, beside: tuple[str, bytes] | None) -> Display:
    """What is read of the file of a line's display."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "display.toml")
        if beside is not None:
            with open(os.path.join(folder, beside[0]), "wb") as stream:
                stream.write(beside[1])
        with open(path, "w", encoding="utf-8", newline="") as stream:
            stream.write(text)
        return replace(read_display(path), path="")
