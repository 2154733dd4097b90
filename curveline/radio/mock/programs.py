"""The program of a mock board between commands: what its loader has of it, as plain data.

Of a program that is whole only the description counts: nobody executes it here.
"""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from binascii import Error
from typing import Any

from curveline.radio.node.loader import SECTORS, ProgramStore
from curveline.radio.node.state import FIRMWARE
from curveline.radio.protocol.update_frames import DESCRIPTION_BYTES, SECTOR_BYTES

MARKS = ("whole", "tried", "kept")
KEYS = {"description", "sectors", *MARKS}


def flashed_program() -> ProgramStore:
    """What a board of this release has got by a cable."""
    return ProgramStore.flashed(FIRMWARE)


def told_program(store: ProgramStore) -> dict[str, Any]:
    """What is written of it: sectors only as long as more are to come."""
    sectors = {} if store.whole else {str(at): _written(data) for at, data in sorted(store.sectors.items())}
    marks = {name: getattr(store, name) for name in MARKS}
    return {"description": store.description.hex(), **marks, "sectors": sectors}


def program_of(content: Any) -> ProgramStore:
    """The same again; ValueError, TypeError or KeyError say what is wrong."""
    if not isinstance(content, dict) or content.keys() != KEYS or not isinstance(content["sectors"], dict):
        raise ValueError("a board's program has missing or unknown entries")
    description = bytes.fromhex(content["description"])
    marks = [content[name] for name in MARKS]
    if len(description) != DESCRIPTION_BYTES or any(type(mark) is not bool for mark in marks):
        raise ValueError("a board's program has an entry of another kind")
    store = ProgramStore(description, {}, *marks)
    count = 0 if store.facts is None else -(-store.facts.length // SECTOR_BYTES)
    if store.whole:
        if store.facts is None or content["sectors"]:
            raise ValueError("a board's program is whole, but nobody says of which kind")
        store.sectors = dict.fromkeys(range(count), bytes(SECTOR_BYTES))
        return store
    for at, text in content["sectors"].items():
        if at not in map(str, range(SECTORS)) or int(at) >= count:
            raise ValueError("a board's program has a sector too many")
        store.sectors[int(at)] = _read(text)
    return store


def _written(data: bytes) -> str:
    return b64encode(zlib.compress(data)).decode("ascii")


def _read(text: Any) -> bytes:
    """A sector; ValueError if it is none."""
    try:
        unpacker = zlib.decompressobj()
        data = unpacker.decompress(b64decode(text, validate=True), SECTOR_BYTES + 1)
    except (Error, zlib.error) as error:
        raise ValueError(f"a sector of a board's program cannot be read: {error}") from None
    if len(data) != SECTOR_BYTES:
        raise ValueError("a sector of a board's program has another length")
    return data
