"""The end of the firmware's boot numbers: no key comes twice, so a node that has used them all stays off the air."""

from __future__ import annotations

from zlib import crc32

from curveline.radio.protocol.codes import BOOT_END

from .test_store import CHECK, MARK, Flash

LAST_BOOT = BOOT_END - 1


def saved_with_boot(flash: Flash, boot: int) -> None:
    """Have the newest record say another boot number, as if the node had been switched on that often."""
    words = flash.chip.words
    at = flash.newest
    words[at + 5] = words[at + 5] & ~0xFFFFFF | boot
    words[at + CHECK] = crc32(b"".join(words[at + index].to_bytes(4, "little") for index in range(MARK))) >> 1
    flash.open()
    assert flash.last()[0] == boot


def test_after_the_last_boot_number_there_is_none_any_more() -> None:
    flash = Flash()
    flash.boot()
    flash.save((1, 2, 3))
    saved_with_boot(flash, LAST_BOOT - 1)
    assert flash.boot()
    assert flash.last() == (LAST_BOOT, (1, 2, 3), 0)
    for _ in range(3):
        flash.open()
        assert not flash.boot()
        assert flash.last()[0] == LAST_BOOT


def test_a_boot_number_that_may_have_been_lost_counts_at_the_end_too() -> None:
    flash = Flash()
    flash.boot()
    saved_with_boot(flash, LAST_BOOT - 1)
    flash.save((1, 2, 3))
    flash.chip.words[flash.newest + 1] ^= 4
    flash.open()
    assert flash.last()[0] == LAST_BOOT - 1
    assert not flash.boot()
