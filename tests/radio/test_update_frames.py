"""UPDATE and PROGRESS: layouts byte by byte, tags, descriptions; the loader's C reads and writes the same."""

from __future__ import annotations

from dataclasses import replace

import pytest

from curveline.radio.protocol.codes import Reject
from curveline.radio.protocol.update_frames import (
    ProgramFacts,
    ProgressFrame,
    UpdateFrame,
    UpdateOutcome,
    UpdatePlace,
    decode_progress,
    decode_update,
    describe,
    described,
    encode_progress,
    encode_update,
)

KEY = bytes(range(16))
UPDATE = UpdateFrame(0x1234, 0x030201, 7, 63, bytes(range(16)))
PROGRESS = ProgressFrame(2, 0x1234, 0x00030201, 1 << 63 | 5, 7, UpdateOutcome.DONE, 3, UpdatePlace.BEGIN, 0xAABBCCDD)
FACTS = ProgramFacts(45056, 4, 1, bytes(range(16, 32)))


def test_an_update_byte_by_byte() -> None:
    whole = encode_update(UPDATE, KEY)
    assert whole[:24].hex(" ") == "2d 07 34 12 01 02 03 3f " + bytes(range(16)).hex(" ")
    assert decode_update(whole, KEY) == UPDATE


def test_a_progress_byte_by_byte() -> None:
    whole = encode_progress(PROGRESS, KEY)
    assert whole[:24].hex(" ") == "2e 02 34 12 01 02 03 00 05 00 00 00 00 00 00 80 07 01 03 f1 dd cc bb aa"
    assert decode_progress(whole, KEY) == PROGRESS


@pytest.mark.parametrize("bit", range(256))
def test_a_bit_that_is_wrong_is_noticed(bit: int) -> None:
    for whole, decode in (
        (encode_update(UPDATE, KEY), decode_update),
        (encode_progress(PROGRESS, KEY), decode_progress),
    ):
        spoilt = bytearray(whole)
        spoilt[bit >> 3] ^= 1 << (bit & 7)
        assert isinstance(decode(bytes(spoilt), KEY), Reject)


def test_what_is_no_frame_of_this_key_says_why() -> None:
    assert decode_update(encode_update(UPDATE, KEY), bytes(16)) is Reject.TAG
    assert decode_progress(encode_update(UPDATE, KEY), KEY) is Reject.KIND
    assert decode_progress(b"", KEY) is Reject.LENGTH
    strange = encode_progress(replace(PROGRESS, outcome=9), KEY)  # type: ignore[arg-type]
    assert decode_progress(strange, KEY) is Reject.FIELD


def test_a_description_says_what_it_was_made_of_or_nothing() -> None:
    data = describe(FACTS)
    assert described(data) == FACTS
    assert data[20:].hex(" ") == "00 b0 00 00 04 00 00 00 01 00 00 00"
    assert described(data[:-1]) is None
    for bit in range(256):
        spoilt = bytearray(data)
        spoilt[bit >> 3] ^= 1 << (bit & 7)
        assert described(bytes(spoilt)) is None
