"""Intel HEX files: checked line by line, and the flash sectors of the settings replaced.

Errors name the line and never quote it: a file for one node holds the site's key.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from curveline.errors import Diagnostic, InvalidInput
from curveline.radio.protocol.node_settings import NO_SETTINGS, SETTINGS_MAGIC, NodeSettings

DATA, END, SEGMENT, SEGMENT_START, LINEAR, LINEAR_START = range(6)
LENGTHS = {END: 0, SEGMENT: 2, SEGMENT_START: 4, LINEAR: 2, LINEAR_START: 4}
LINE_BYTES = 16
FLASH_BYTES = 0x10000
SPARE_SECTOR = range(0xF000, 0xF400)
SETTINGS_SECTOR = range(0xF400, 0xF800)
"""Where a node's program looks for its settings: two sectors of 1 kB, of which a cable fills the second."""
OLD_MAGIC = b"CLN1"
"""In the program of a node before firmware 4, which finds no settings where the magic is another."""


@dataclass(frozen=True)
class _Line:
    """One record; `address` is absolute, of use only where there is data."""

    kind: int
    address: int
    data: bytes


def with_settings(text: str, path: str, settings: NodeSettings) -> str:
    """The image in `text` with `settings` in their sector and all else as it was; InvalidInput for a bad image.

    The other sector for settings is made to hold none. `path` names the image in the Diagnostics.
    """
    lines = list(_parse(text, path))
    _check(lines, path)
    _refuse_old(lines, path)
    sectors = range(SPARE_SECTOR.start, SETTINGS_SECTOR.stop)
    kept = [part for line in lines if line.kind != END for part in _outside(line, sectors)]
    parts = [line for line in kept if line.kind == DATA]
    starts = [line for line in kept if line.kind in (SEGMENT_START, LINEAR_START)]
    parts.append(_Line(DATA, SPARE_SECTOR.start, NO_SETTINGS))
    cells = settings.sector()
    for offset in range(0, len(cells), LINE_BYTES):
        piece = cells[offset : offset + LINE_BYTES]
        parts.append(_Line(DATA, SETTINGS_SECTOR.start + offset, piece))
    # The whole image lies in the first 64 kB, so that no address needs more than its own record.
    return "".join(map(_encode, [*sorted(parts, key=lambda line: line.address), *starts, _Line(END, 0, b"")]))


def flash_of(text: str, path: str) -> bytes:
    """All 64 kB of a node's flash, blank where the image says nothing; InvalidInput for a bad image."""
    lines = list(_parse(text, path))
    _check(lines, path)
    return _flash(lines)


def _flash(lines: list[_Line]) -> bytes:
    flash = bytearray(b"\xff" * FLASH_BYTES)
    for line in lines:
        if line.kind == DATA:
            flash[line.address : _end(line)] = line.data
    return bytes(flash)


def _parse(text: str, path: str) -> Iterator[_Line]:
    base = 0
    rows = text.rstrip("\n").split("\n")
    for number, row in enumerate(rows, start=1):
        fields = _fields(row.strip(), path, number)
        count, kind, data = fields[0], fields[3], fields[4:-1]
        if count != len(data) or kind > LINEAR_START or len(data) != LENGTHS.get(kind, len(data)):
            raise _bad(path, number, "a record of unknown kind or wrong length")
        if (kind == END) != (number == len(rows)):
            raise _bad(path, number, "records after the end" if kind == END else "the end is missing: the file is cut")
        address = base + int.from_bytes(fields[1:3], "big")
        if kind in (SEGMENT, LINEAR):
            base = int.from_bytes(data, "big") << (4 if kind == SEGMENT else 16)
        else:
            yield _Line(kind, address, data)


def _fields(row: str, path: str, number: int) -> bytes:
    try:
        fields = bytes.fromhex(row[1:]) if row[:1] == ":" and row.isascii() and " " not in row else b""
    except ValueError:
        fields = b""
    if len(fields) < 5:
        raise _bad(path, number, "this is no record of an Intel HEX file")
    if sum(fields) & 0xFF:
        raise _bad(path, number, "the checksum is wrong: the file is damaged")
    return fields


def _check(lines: list[_Line], path: str) -> None:
    """Refuse what is whole, but no image of a node."""
    cells = [address for line in lines if line.kind == DATA for address in range(line.address, _end(line))]
    if len(set(cells)) < len(cells):
        raise _bad(path, 1, "it says what stands at an address more than once")
    if max(cells, default=0) >= FLASH_BYTES:
        raise _bad(path, 1, f"it reaches beyond the {FLASH_BYTES // 1024} kB of a node's flash")
    if not {*range(8)} <= set(cells):
        raise _bad(path, 1, "it does not begin with the vectors of a program: this is no image of a node")


def _refuse_old(lines: list[_Line], path: str) -> None:
    """Refuse the program of an older release: it would find no settings, and stay off the air."""
    flash = _flash(lines)
    if OLD_MAGIC in flash and SETTINGS_MAGIC not in flash:
        message = "it is a program of firmware 3 or before, which does not know the settings of this release"
        hint = "build the program anew: `make -C firmware`"
        raise InvalidInput(f"{path}: {message}", hint, [Diagnostic(path, 1, 1, "bad-image", message, hint)])


def _outside(line: _Line, sector: range) -> Iterator[_Line]:
    """What is left of a record when a sector is taken out."""
    if line.kind != DATA:
        yield line
        return
    if line.address < sector.start:
        yield _Line(DATA, line.address, line.data[: sector.start - line.address])
    if _end(line) > sector.stop:
        cut = max(0, sector.stop - line.address)
        yield _Line(DATA, line.address + cut, line.data[cut:])


def _end(line: _Line) -> int:
    return line.address + len(line.data)


def _encode(line: _Line) -> str:
    address = line.address if line.kind == DATA else 0
    fields = bytes([len(line.data), address >> 8, address & 0xFF, line.kind]) + line.data
    return f":{fields.hex().upper()}{-sum(fields) & 0xFF:02X}\n"


def _bad(path: str, line: int, message: str) -> InvalidInput:
    hint = "name the node.hex that the firmware's build wrote"
    return InvalidInput(f"{path}: {message}", hint, [Diagnostic(path, line, 1, "bad-image", message, hint)])
