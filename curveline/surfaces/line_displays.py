"""The displays of lines: that of one line, with a name and radio addresses of its own for each."""

from __future__ import annotations

import json
import os
import re
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from curveline.errors import InvalidInput
from curveline.scene import Display
from curveline.shapes.file_keys import LONGEST_NAME
from curveline.shapes.files import MAX_BYTES, builtin_displays, builtin_text, read_display
from curveline.shapes.toml_location import TomlMap
from curveline.system.files import decode_text, read_file, refuse_file

TEXT = re.compile(r'"(?!"")(?:[^"\\\n]|\\.)*"|' + r"'(?!'')[^'\n]*'")
"""A TOML string on one line."""
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
    text = _text_of(display)
    beside = _beside(display, text)
    used: set[int] = set()
    found = []
    for number in range(1, count + 1):
        addresses = [_free(int(each, 16) + (number - 1) * NEXT_LINE, used) for each in display.radio.addresses]
        changed = _changed(text, display, number, [f"{each:010X}" for each in addresses], beside)
        found.append(LineDisplay(_read(changed, beside), changed, beside))
    return tuple(found)


def _free(address: int, used: set[int]) -> int:
    """The first address from one on that is not used, and is now."""
    while address % ADDRESSES in used:
        address += NEXT_LINE
    used.add(address % ADDRESSES)
    return address % ADDRESSES


def _text_of(display: Display) -> str:
    if display.path:
        return decode_text(read_file(display.path, MAX_BYTES), display.path)
    if display.name not in builtin_displays():
        hint = "write it into a file, and read that with read_display"
        raise InvalidInput(f"{display.name}: this display is in no file, and each line needs one", hint)
    return builtin_text(display.name)


def _beside(display: Display, text: str) -> tuple[str, bytes] | None:
    """The file that a display file names, by its name without a folder."""
    named = tomllib.loads(text)["rod"].get(PROFILE[1])
    if named is None:
        return None
    path = os.path.join(os.path.dirname(display.path), named)
    return os.path.basename(path), read_file(path, MAX_BYTES)


def _changed(
    text: str, display: Display, number: int, addresses: Sequence[str], beside: tuple[str, bytes] | None
) -> str:
    """A display file with another name and other addresses; InvalidInput if that would change anything else."""
    name = f"{display.name[: LONGEST_NAME - 3]}-{number}"
    values: dict[tuple[str | int, ...], str] = {("name",): name}
    values.update({("radio", "addresses", index): each for index, each in enumerate(addresses)})
    if beside is not None:
        values[PROFILE] = beside[0]
    found, changed = TomlMap(text), text
    for path, value in sorted(values.items(), key=lambda item: -found.values.get(item[0], 0)):
        begin = found.values.get(path, -1)
        if begin >= 0 and (old := TEXT.match(changed, begin)):
            changed = changed[:begin] + json.dumps(value, ensure_ascii=False) + changed[old.end() :]
    wanted = tomllib.loads(text)
    wanted["name"], wanted["radio"]["addresses"] = name, list(addresses)
    if beside is not None:
        wanted["rod"][PROFILE[1]] = beside[0]
    try:
        is_right = tomllib.loads(changed) == wanted
    except tomllib.TOMLDecodeError:
        is_right = False
    if not is_right:
        hint = 'write name = "..." and addresses = ["...", ...] with each text on one line'
        refuse_file(display.path or display.name, "not-written", "its name and addresses cannot be changed", hint)
    return changed


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
