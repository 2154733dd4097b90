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

PROGRAM_AT, DESCRIPTION_AT = 0x2800, 0xEC00
"""As in firmware/loader/layout.h."""


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
