"""Puts the loader and the program behind it into one Intel HEX file, with what the loader is to know of the program."""

from __future__ import annotations

import re
import struct
import sys
from collections.abc import Iterator
from pathlib import Path

PROGRAM, DESCRIPTION = 0x2800, 0xEC00
"""As in layout.h."""
SECTOR_BYTES, MARKS = 1024, 64
LAST_MARKS = (60, 61, 62)
"""Whole, tried, kept."""
SETTINGS_LAYOUT = 1
LINE_BYTES = 16
LOADED = 1


def loaded(elf: bytes, room: range) -> bytes:
    """What a 32-bit little-endian ELF file puts into a part of the flash, from its beginning, and blanks between."""
    (table,) = struct.unpack_from("<I", elf, 28)
    entry, count = struct.unpack_from("<2H", elf, 42)
    flash = bytearray(b"\xff" * len(room))
    end = 0
    for index in range(count):
        kind, offset, _, address, size = struct.unpack_from("<5I", elf, table + entry * index)
        if kind == LOADED and size and address in room:
            at = address - room.start
            flash[at : at + size] = elf[offset : offset + size]
            end = max(end, at + size)
    return bytes(flash[: end + -end % 4])


def description(program: bytes, number: int) -> bytes:
    """What the loader knows of a program that came by USB: all but its digest, for which it has no key yet."""
    words = [0, 0, 0, 0, len(program), number, SETTINGS_LAYOUT]
    total = 2166136261
    for word in words:
        total = (total ^ word) * 16777619 & 0xFFFFFFFF
    return struct.pack("<8I", total, *words)


def sector(program: bytes, number: int) -> bytes:
    """The description and its marks: all sectors are there, the program is whole and kept."""
    found = bytearray(b"\xff" * (MARKS + 4 * (LAST_MARKS[-1] + 1)))
    found[:32] = description(program, number)
    for mark in (*range(-(-len(program) // SECTOR_BYTES)), *LAST_MARKS):
        found[MARKS + 4 * mark : MARKS + 4 * mark + 4] = bytes(4)
    return bytes(found)


def lines(start: int, data: bytes) -> Iterator[str]:
    """Intel HEX lines."""
    for at in range(0, len(data), LINE_BYTES):
        part = data[at : at + LINE_BYTES]
        fields = bytes([len(part), *(start + at).to_bytes(2, "big"), 0]) + part
        yield f":{fields.hex().upper()}{-sum(fields) & 0xFF:02X}\n"


def main(loader: str, program: str, header: str, to: str) -> int:
    """Write the file."""
    found = re.search(r"#define FIRMWARE (\d+)u", Path(header).read_text())
    if found is None:
        print(f"{header} does not say which firmware this is", file=sys.stderr)
        return 1
    behind = loaded(Path(program).read_bytes(), range(PROGRAM, DESCRIPTION))
    parts = {
        0: loaded(Path(loader).read_bytes(), range(PROGRAM)),
        PROGRAM: behind,
        DESCRIPTION: sector(behind, int(found[1])),
    }
    text = "".join(line for start, data in parts.items() for line in lines(start, data))
    Path(to).write_text(text + ":00000001FF\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
