"""The settings of a node: their record, and two sectors of flash in which a power cut leaves the old or the new."""

from __future__ import annotations

import copy
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from random import Random
from zlib import crc32

import pytest

from curveline.errors import InvalidInput
from curveline.radio.node.settings_flash import (
    BLANK,
    KEPT,
    REQUESTED,
    TRIED,
    USED_BYTES,
    FixedSettings,
    ModelFlash,
    PowerCut,
    SettingsFlash,
    flashed,
)
from curveline.radio.protocol.codes import ErrandOutcome
from curveline.radio.protocol.motion import axes_of
from curveline.radio.protocol.node_settings import (
    SETTINGS_BYTES,
    NodeSettings,
    is_newer,
    node_settings,
    settings_in,
)

from .bench import drive_table

MASTER = bytes(range(1, 17))
OLD = node_settings(MASTER, drive_table(), 1)
NEW = replace(node_settings(bytes(range(3, 19)), drive_table(), 2, 1), channel=90)


# The record


def test_settings_are_laid_out_as_the_node_reads_them() -> None:
    drive = drive_table()
    record = node_settings(MASTER, drive, 2, 0x1234).record()
    assert len(record) == 84
    assert record[:16] == b"CLN2" + bytes([84, 0, 2, 1, 76, 0xC1, 0xC1, 0xC1, 0xC1, 0x02, 0x34, 0x12])
    assert record[16:32] == MASTER
    for index, axis in enumerate(axes_of(drive)):
        words = [record[32 + 16 * index + 4 * word :][:4] for word in range(4)]
        low, high = (int.from_bytes(word, "little", signed=True) for word in words[:2])
        speed, acceleration = (int.from_bytes(word, "little") for word in words[2:])
        assert (low, high, speed, acceleration) == (axis.low, axis.high, axis.speed, axis.acceleration)
    assert int.from_bytes(record[80:], "little") == crc32(record[:80])
    assert settings_in(record) == node_settings(MASTER, drive, 2, 0x1234)
    for number in (0, 3):
        with pytest.raises(InvalidInput, match=f"no node {number}"):
            node_settings(MASTER, drive, number)
    many = drive_table(255)
    assert node_settings(MASTER, many, 254).record()[6] == 254
    with pytest.raises(InvalidInput, match="no node 255"):
        node_settings(MASTER, many, 255)


def test_a_record_that_is_damaged_or_makes_no_sense_is_none() -> None:
    record = OLD.record()
    for position in range(SETTINGS_BYTES):
        for bit in range(8):
            spoilt = bytearray(record)
            spoilt[position] ^= 1 << bit
            assert settings_in(bytes(spoilt)) is None
    assert settings_in(record[:-1]) is None
    assert settings_in(record + b"\0") is None

    def sealed(at: int, value: bytes) -> bytes:
        body = record[:at] + value + record[at + len(value) : -4]
        return body + crc32(body).to_bytes(4, "little")

    assert settings_in(sealed(6, b"\x01")) == OLD
    for at, value in ((0, b"CLN1"), (4, b"\x55"), (6, b"\0"), (6, b"\xff"), (7, b"\x03"), (8, b"\x7e")):
        assert settings_in(sealed(at, value)) is None
    for axis in range(3):
        low_above_high = (2**31 - 1).to_bytes(4, "little")
        assert settings_in(sealed(32 + 16 * axis, low_above_high)) is None
        for at in (40, 44):
            for rate in (99, 1_000_001, 2**32 - 1):
                assert settings_in(sealed(at + 16 * axis, rate.to_bytes(4, "little"))) is None
            for rate in (100, 1_000_000):
                assert settings_in(sealed(at + 16 * axis, rate.to_bytes(4, "little"))) is not None


def test_no_repr_shows_the_key() -> None:
    for shown in (repr(NEW), str(NEW), repr(ModelFlash()), repr(flashed(NEW).flash)):
        assert NEW.master.hex() not in shown
        assert str(NEW.master)[2:-1] not in shown


@pytest.mark.parametrize(("one", "other", "newer"), [(1, 0, True), (0, 0, False), (0, 1, False), (0, 65535, True)])
def test_generations_wrap(one: int, other: int, *, newer: bool) -> None:
    assert is_newer(one, other) is newer
    assert not is_newer(32768, 0)
    assert is_newer(32767, 0)


# The flash


def restarted(flash: ModelFlash, *, by_itself: bool = True) -> tuple[SettingsFlash, NodeSettings | None]:
    """A node that starts with this flash, by itself or because the power comes back; then it stays on."""
    flash.cut_at = 0
    keeper = SettingsFlash(flash)
    return keeper, keeper.start(restarted=by_itself)


def changed(keeper: SettingsFlash, new: NodeSettings = NEW) -> SettingsFlash:
    """The whole way to new settings; what runs then."""
    assert keeper.store(new.record()) is ErrandOutcome.DONE
    assert keeper.request() is ErrandOutcome.DONE
    keeper = SettingsFlash(keeper.flash)
    assert keeper.start(restarted=True) == new
    assert keeper.standing().on_trial
    assert keeper.keep() is ErrandOutcome.DONE
    return keeper


def test_settings_are_stored_tried_and_kept() -> None:
    keeper = flashed(OLD)
    assert (keeper.standing().on_trial, keeper.standing().generation, keeper.standing().stored) == (False, 0, 0)
    assert keeper.request() is ErrandOutcome.BEYOND
    assert keeper.store(NEW.record()) is ErrandOutcome.DONE
    assert keeper.standing().stored == 1
    assert restarted(keeper.flash)[1] == OLD, "nobody has asked for a trial"
    keeper = changed(flashed(OLD))
    assert not keeper.standing().on_trial
    again, found = restarted(keeper.flash)
    assert found == NEW
    for generation in range(2, 6):
        again = changed(again, replace(OLD, generation=generation))
        assert restarted(again.flash)[1] == replace(OLD, generation=generation)


def test_a_trial_that_nobody_ends_is_over_with_the_next_start() -> None:
    keeper = flashed(OLD)
    keeper.store(NEW.record())
    keeper.request()
    keeper, found = restarted(keeper.flash)
    assert found == NEW
    assert keeper.store(replace(NEW, generation=2).record()) is ErrandOutcome.BEYOND
    assert keeper.request() is ErrandOutcome.BEYOND
    for _ in range(3):
        keeper, found = restarted(keeper.flash)
        assert found == OLD
        assert keeper.standing() == replace(keeper.standing(), on_trial=False, generation=0, stored=0)
    assert changed(keeper).start() == NEW, "and the next change is like the first"


def test_what_is_stored_can_be_forgotten() -> None:
    keeper = flashed(OLD)
    keeper.store(NEW.record())
    keeper.drop()
    assert keeper.standing().stored == 0
    assert keeper.request() is ErrandOutcome.BEYOND
    assert restarted(keeper.flash)[1] == OLD
    keeper = changed(flashed(OLD))
    keeper.drop()
    assert restarted(keeper.flash)[1] == NEW


@pytest.mark.parametrize("generation", [0, 2, 65535])
def test_only_the_next_generation_is_stored(generation: int) -> None:
    keeper = flashed(OLD)
    assert keeper.store(replace(NEW, generation=generation).record()) is ErrandOutcome.BEYOND
    assert keeper.store(NEW.record()[:-1] + b"\0") is ErrandOutcome.BEYOND
    assert keeper.standing().stored == 0
    last = flashed(replace(OLD, generation=65535))
    assert last.store(replace(NEW, generation=0).record()) is ErrandOutcome.DONE
    assert last.request() is ErrandOutcome.DONE
    assert restarted(last.flash)[1] == replace(NEW, generation=0)


def test_a_cable_leaves_nothing_older_behind() -> None:
    keeper = changed(changed(flashed(OLD)), replace(OLD, generation=2))
    flash = keeper.flash
    assert isinstance(flash, ModelFlash)
    by_cable = replace(NEW, generation=0)
    flash.sectors[0][:] = by_cable.sector()
    flash.sectors[1][:4] = bytes(4)
    assert restarted(flash)[1] == by_cable


def test_flash_that_does_not_hold_is_noticed() -> None:
    class Worn(ModelFlash):
        def program(self, sector: int, at: int, word: bytes) -> None:
            if sector == 1 and at in self.worn:
                return
            super().program(sector, at, word)

        worn: tuple[int, ...] = (40,)

    keeper = flashed(OLD)
    assert isinstance(keeper.flash, ModelFlash)
    worn = Worn(keeper.flash.sectors)
    keeper = SettingsFlash(worn)
    keeper.start()
    assert keeper.store(NEW.record()) is ErrandOutcome.FAILED
    worn.worn = (REQUESTED,)
    assert keeper.store(NEW.record()) is ErrandOutcome.DONE
    assert keeper.request() is ErrandOutcome.FAILED
    worn.worn = (KEPT,)
    assert keeper.request() is ErrandOutcome.DONE
    keeper = SettingsFlash(worn)
    keeper.start(restarted=True)
    assert keeper.keep() is ErrandOutcome.FAILED
    assert keeper.standing().on_trial


def test_blank_or_senseless_flash_has_no_settings() -> None:
    assert SettingsFlash(ModelFlash()).start() is None
    random = Random(7)
    for _ in range(50):
        flash = ModelFlash([bytearray(random.randbytes(USED_BYTES)) for _ in range(2)])
        assert SettingsFlash(flash).start() is None


# Power cuts


def store(keeper: SettingsFlash) -> None:
    keeper.store(NEW.record())


def attempt(keeper: SettingsFlash) -> None:
    keeper.store(NEW.record())
    keeper.request()
    SettingsFlash(keeper.flash).start(restarted=True)


def whole_change(keeper: SettingsFlash) -> None:
    keeper.store(NEW.record())
    keeper.request()
    fresh = SettingsFlash(keeper.flash)
    fresh.start(restarted=True)
    fresh.keep()


def given_up(keeper: SettingsFlash) -> None:
    attempt(keeper)
    SettingsFlash(keeper.flash).start(restarted=True)


def dropped(keeper: SettingsFlash) -> None:
    store(keeper)
    keeper.drop()


def operations(work: Callable[[SettingsFlash], None], before: SettingsFlash) -> int:
    keeper = SettingsFlash(copy.deepcopy(before.flash))
    keeper.start()
    assert isinstance(keeper.flash, ModelFlash)
    keeper.flash.done = 0
    work(keeper)
    return keeper.flash.done


def histories() -> list[tuple[str, SettingsFlash, NodeSettings]]:
    """Nodes that generation 1 is next for, with all that may be in the other sector, and what they run under."""
    fresh = flashed(OLD)
    failed = flashed(OLD)
    given_up(failed)
    stored = flashed(OLD)
    store(stored)
    last = replace(OLD, generation=0, channel=3)
    wrapped = changed(flashed(replace(NEW, generation=65535)), last)
    return [("cable", fresh, OLD), ("tried", failed, OLD), ("stored", stored, OLD), ("changed", wrapped, last)]


@pytest.mark.parametrize("work", [store, attempt, whole_change, given_up, dropped])
@pytest.mark.parametrize("part", range(5))
def test_a_power_cut_at_every_word_leaves_the_old_or_the_new(work: Callable[[SettingsFlash], None], part: int) -> None:
    """Also if the power is cut once more while the node starts after that; and it can be changed afterwards."""
    for name, before, old in histories():
        for cut_at in range(1, operations(work, before) + 1):
            for second in range(4):
                flash = copy.deepcopy(before.flash)
                assert isinstance(flash, ModelFlash)
                keeper = SettingsFlash(flash)
                keeper.start()
                flash.done, flash.cut_at, flash.part = 0, cut_at, part
                with pytest.raises(PowerCut):
                    work(keeper)
                flash.done, flash.cut_at = 0, second
                with suppress(PowerCut):
                    SettingsFlash(flash).start()
                keeper, found = restarted(flash, by_itself=False)
                assert found in (old, NEW), (name, cut_at, second)
                assert not keeper.standing().on_trial, "no power-on begins a trial"
                assert restarted(flash, by_itself=False)[1] == found, "and it stays so"
                generation = keeper.standing().generation + 1
                third = replace(OLD, generation=generation, channel=7)
                assert changed(restarted(flash, by_itself=False)[0], third).start() == third


def test_new_settings_are_never_kept_before_the_node_was_told_to() -> None:
    for part in range(5):
        for cut_at in range(1, operations(attempt, flashed(OLD)) + 1):
            keeper = flashed(OLD)
            flash = keeper.flash
            assert isinstance(flash, ModelFlash)
            flash.done, flash.cut_at, flash.part = 0, cut_at, part
            with pytest.raises(PowerCut):
                attempt(keeper)
            assert [restarted(flash, by_itself=False)[1] for _ in range(4)] == [OLD] * 4


def test_marks_are_where_the_page_says() -> None:
    assert (REQUESTED, TRIED, KEPT, USED_BYTES) == (84, 88, 92, 96)
    keeper = flashed(OLD)
    attempt(keeper)
    flash = keeper.flash
    assert flash.word(1, REQUESTED) == flash.word(1, TRIED) == bytes(4)
    assert flash.word(1, KEPT) == BLANK


def test_what_cannot_be_done_is_refused_at_each_step() -> None:
    """Nothing to keep, a sector that does not become blank, settings in force that would not last: no erasure then."""

    class Sticky(ModelFlash):
        def erase(self, sector: int) -> None:
            super().erase(sector)
            self.sectors[sector][60] = 0x7F

    keeper = flashed(OLD)
    assert keeper.keep() is ErrandOutcome.BEYOND
    assert isinstance(keeper.flash, ModelFlash)
    sticky = SettingsFlash(Sticky(keeper.flash.sectors))
    assert sticky.start() == OLD
    assert sticky.store(NEW.record()) is ErrandOutcome.FAILED
    assert sticky.request() is ErrandOutcome.BEYOND
    weak = flashed(OLD)
    assert isinstance(weak.flash, ModelFlash)
    before = bytes(weak.flash.sectors[1])
    weak.flash.sectors[0][20] ^= 1
    assert weak.store(NEW.record()) is ErrandOutcome.FAILED
    assert bytes(weak.flash.sectors[1]) == before
    fixed = FixedSettings()
    fixed.drop()
    assert (fixed.standing().on_trial, fixed.keep()) == (False, ErrandOutcome.FAILED)
