"""Programs for nodes as `make updatable` writes them, made up without a compiler."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

from curveline.radio.protocol.update_frames import ProgramFacts, describe

PROGRAM_AT, DESCRIPTION_AT, LINE_BYTES = 0x2800, 0xEC00, 16


def updatable_hex(number: int = 5, *, length: int = 2900, settings: int = 1, seed: int = 1) -> str:
    """The text of a file with a loader, noise for a program, and what the loader is told of it."""
    program = Random(seed).randbytes(length)
    description = describe(ProgramFacts(length, number, settings, bytes(16)))
    parts = ((0, bytes(range(16))), (PROGRAM_AT, program), (DESCRIPTION_AT, description))
    return "".join(line for start, data in parts for line in _lines(start, data)) + ":00000001FF\n"


def _lines(start: int, data: bytes) -> Iterator[str]:
    for at in range(0, len(data), LINE_BYTES):
        part = data[at : at + LINE_BYTES]
        fields = bytes([len(part), *(start + at).to_bytes(2, "big"), 0]) + part
        yield f":{fields.hex().upper()}{-sum(fields) & 0xFF:02X}\n"
