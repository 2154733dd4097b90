"""A node's program as `make updatable` writes it: behind a loader, with what the loader is told of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import blake2s

from curveline.errors import Diagnostic, InvalidInput
from curveline.radio.protocol.update_frames import (
    DESCRIPTION_BYTES,
    DIGEST_BYTES,
    SECTOR_BYTES,
    ProgramFacts,
    describe,
    described,
)
from curveline.radio.site.intel_hex import flash_of

PROGRAM_AT, DESCRIPTION_AT, MARKS_AT = 0x2800, 0xEC00, 0xEC40
"""As in firmware/loader/layout.h."""
LAST_MARKS = (60, 61, 62)
"""Whole, tried, kept."""
RAM = range(0x1FFFF800, 0x20001801)


@dataclass(frozen=True)
class NodeProgram:
    """What is sent to a loader."""

    data: bytes = field(repr=False)  # from PROGRAM_AT on
    number: int  # firmware
    settings: int  # layout of the settings that it reads

    @property
    def sectors(self) -> list[bytes]:
        """The program by sectors, the last one filled up as blank flash is."""
        parts = range(0, len(self.data), SECTOR_BYTES)
        return [self.data[at : at + SECTOR_BYTES].ljust(SECTOR_BYTES, b"\xff") for at in parts]

    def description(self, node_key: bytes) -> bytes:
        """What a loader is told before the program comes; the digest is under the key of its node."""
        digest = blake2s(self.data, key=node_key, digest_size=DIGEST_BYTES).digest()
        return describe(ProgramFacts(len(self.data), self.number, self.settings, digest))


def program_in(text: str, path: str) -> NodeProgram:
    """The program in an Intel HEX file; InvalidInput for a damaged one, and for one without a loader."""
    flash = flash_of(text, path)
    found = described(flash[DESCRIPTION_AT : DESCRIPTION_AT + DESCRIPTION_BYTES])
    if found is None or not 0 < found.length <= DESCRIPTION_AT - PROGRAM_AT:
        message = "it is no program behind a loader, which is all that can be sent over the air"
        hint = "build one: `make -C firmware updatable`; then name firmware/build/updatable.hex"
        raise InvalidInput(f"{path}: {message}", hint, [Diagnostic(path, 1, 1, "bad-image", message, hint)])
    return NodeProgram(flash[PROGRAM_AT : PROGRAM_AT + found.length], found.number, found.settings)


def check_loader(text: str, path: str) -> bool:
    """Whether an image has a loader; InvalidInput for half of one: its program would not start."""
    flash = flash_of(text, path)
    is_behind = _has_vectors(flash, PROGRAM_AT)
    if not is_behind and flash[DESCRIPTION_AT : DESCRIPTION_AT + SECTOR_BYTES].count(0xFF) == SECTOR_BYTES:
        return False
    found = described(flash[DESCRIPTION_AT : DESCRIPTION_AT + DESCRIPTION_BYTES])
    problem = ""
    if not _has_vectors(flash, 0) or _word(flash, 4) >= PROGRAM_AT:
        problem = "there is no loader in front of its program"
    elif not is_behind:
        problem = "there is no program behind its loader"
    elif found is None or not _is_marked(flash, found):
        problem = "its loader is not told that there is a program"
    if problem:
        hint = "build it anew: `make -C firmware updatable`; then name firmware/build/updatable.hex"
        raise InvalidInput(f"{path}: {problem}", hint, [Diagnostic(path, 1, 1, "bad-image", problem, hint)])
    return True


def _word(flash: bytes, at: int) -> int:
    return int.from_bytes(flash[at : at + 4], "little")


def _has_vectors(flash: bytes, at: int) -> bool:
    """Whether a program begins there: a stack in RAM, and an entry in flash."""
    entry = _word(flash, at + 4)
    return _word(flash, at) in RAM and entry % 2 == 1 and at < entry < DESCRIPTION_AT


def _is_marked(flash: bytes, facts: ProgramFacts) -> bool:
    """Whether all that a program has is marked as being there; nothing but blanks lies behind it."""
    end = PROGRAM_AT + facts.length
    sectors = range(-(-facts.length // SECTOR_BYTES))
    marked = all(_word(flash, MARKS_AT + 4 * mark) == 0 for mark in (*sectors, *LAST_MARKS))
    return marked and flash[end:DESCRIPTION_AT].count(0xFF) == DESCRIPTION_AT - end
