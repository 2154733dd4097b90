"""Two sectors of settings in flash: power fails everywhere, and a node runs under old ones or new ones, whole."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from random import Random
from zlib import crc32

import pytest

from curveline.radio.node.settings_flash import KEPT, REQUESTED, TRIED, USED_BYTES, ModelFlash, SettingsFlash
from curveline.radio.protocol.codes import ErrandOutcome
from curveline.radio.protocol.node_settings import NO_SETTINGS, NodeSettings, node_settings, settings_in

from . import test_store
from .fleet import drive_table
from .test_store import BLANK, SECTOR_WORDS, Chip

RECORD_WORDS = 21
GARBLED = (0, 1, 2)
"""What an operation that was cut leaves: nothing, a part, a part that reads as something else each time."""


class Settings:
    """The two sectors, and the store that keeps settings in them."""

    def __init__(self, seed: int = 1, garbled: int = 0) -> None:
        self._c = test_store.library()
        self._c.flash_settings.restype = ctypes.c_bool
        for name in ("put", "request", "keep"):
            getattr(self._c, f"flash_{name}").restype = ctypes.c_uint8
        self._c.flash_under.restype = ctypes.c_uint32
        self._self = self._c.flash_new(seed)
        self.chip.garbled = garbled

    def __del__(self) -> None:
        self._c.flash_free(self._self)

    @property
    def chip(self) -> Chip:
        return self._self.contents  # type: ignore[no-any-return]

    def flash(self, settings: NodeSettings) -> None:
        """What `keys node` has a programmer write."""
        self.fill(0, settings.sector())
        self.fill(4 * SECTOR_WORDS, NO_SETTINGS)

    def fill(self, at: int, cells: bytes) -> None:
        self._c.flash_fill(self._self, at, cells, len(cells))

    def open(self, *, restarted: bool = False) -> bool:
        """A boot; a cut that was set remains."""
        return bool(self._c.flash_settings(self._self, ctypes.c_bool(restarted)))

    def write(self, record: bytes) -> ErrandOutcome:
        """What comes of an order to store it."""
        return ErrandOutcome(self._c.flash_put(self._self, record))

    def put(self, settings: NodeSettings) -> bool:
        return self.write(settings.record()) is ErrandOutcome.DONE

    def request(self) -> bool:
        return ErrandOutcome(self._c.flash_request(self._self)) is ErrandOutcome.DONE

    def keep(self) -> bool:
        return ErrandOutcome(self._c.flash_keep(self._self)) is ErrandOutcome.DONE

    def forget(self) -> None:
        self._c.flash_forget(self._self)

    @property
    def under(self) -> tuple[int, int, bool]:
        """Generation and key (a number here) that the node runs under, and whether they are on trial."""
        key = ctypes.create_string_buffer(16)
        facts = self._c.flash_under(self._self, key)
        return facts & 0xFFFF, int.from_bytes(key.raw, "little"), bool(facts >> 16)

    def cut(self, after: int) -> None:
        self.chip.cut_after = self.chip.operations + after

    def mend(self) -> None:
        self.chip.cut_after, self.chip.off = -1, 0

    def words(self, sector: int) -> list[int]:
        return list(self.chip.words[SECTOR_WORDS * sector : SECTOR_WORDS * (sector + 1)])

    def snapshot(self) -> bytes:
        return ctypes.string_at(self._self, self._c.flash_size())

    def restore(self, state: bytes) -> None:
        ctypes.memmove(self._self, state, len(state))


def settings_of(generation: int, key: int) -> NodeSettings:
    return node_settings(key.to_bytes(16, "little"), drive_table(1), 1, generation)


@pytest.fixture
def kept() -> Iterator[Settings]:
    """A node that was flashed with key 1."""
    made = Settings()
    made.flash(settings_of(0, 1))
    assert made.open()
    yield made
    assert made.chip.misuse == 0, "a word was programmed twice"


def test_flashed_settings_are_in_force_whatever_stood_in_the_other_sector() -> None:
    for generation in (0, 1, 0x7FFF, 0x8000, 0xFFFF):
        settings = Settings()
        settings.flash(settings_of(generation, 3))
        assert settings.open()
        assert settings.under == (generation, 3, False)
        assert settings.put(settings_of(generation + 1 & 0xFFFF, 4))
        assert settings.request()
        assert settings.open(restarted=True)
        assert settings.keep()
        settings.flash(settings_of(0, 5))
        assert settings.open()
        assert settings.under == (0, 5, False), "nothing older outlives a flashing"


def test_without_whole_settings_there_are_none() -> None:
    settings = Settings()
    assert not settings.open()
    whole = settings_of(7, 1)
    for at in range(4 * RECORD_WORDS):
        settings.flash(whole)
        settings.fill(at, bytes([whole.record()[at] ^ 1 << at % 8]))
        assert not settings.open(), at
    settings.flash(whole)
    assert settings.open()


def test_what_was_written_is_tried_once_and_stays_only_if_it_is_kept(kept: Settings) -> None:
    for generation in range(1, 6):
        assert kept.put(settings_of(generation, 10 + generation))
        assert kept.under == (generation - 1, generation + 8 if generation > 1 else 1, False)
        assert kept.request()
        assert kept.open(restarted=True)
        assert kept.under == (generation, 10 + generation, True)
        assert kept.open(restarted=True), "nobody has kept it"
        assert kept.under[0] == generation - 1
        assert kept.put(settings_of(generation, 9 + generation))
        assert kept.request()
        assert kept.open(restarted=True)
        assert kept.keep()
        assert kept.under == (generation, 9 + generation, False)
        for restarted in (False, True):
            assert kept.open(restarted=restarted)
            assert kept.under == (generation, 9 + generation, False)


def test_no_power_on_begins_a_trial(kept: Settings) -> None:
    assert kept.put(settings_of(1, 2))
    assert kept.request()
    assert kept.open()
    assert kept.under == (0, 1, False)
    assert kept.open(restarted=True), "nor is it tried later"
    assert kept.under == (0, 1, False)


def test_only_what_was_written_since_the_boot_is_tried(kept: Settings) -> None:
    assert not kept.request()
    assert kept.put(settings_of(1, 2))
    assert kept.open()
    assert not kept.request()
    assert kept.put(settings_of(1, 2))
    kept.forget()
    assert not kept.request()
    assert kept.open(restarted=True)
    assert kept.under == (0, 1, False)


def test_on_trial_nothing_else_is_written(kept: Settings) -> None:
    assert kept.put(settings_of(1, 2))
    assert kept.request()
    assert kept.open(restarted=True)
    assert not kept.put(settings_of(2, 3))
    assert not kept.request()
    assert kept.under == (1, 2, True)


def test_settings_that_would_not_last_are_no_reason_to_erase_the_others(kept: Settings) -> None:
    assert kept.put(settings_of(1, 2))
    assert kept.request()
    assert kept.open(restarted=True)
    assert kept.keep()
    kept.chip.words[SECTOR_WORDS + 5] ^= 1
    assert not kept.put(settings_of(2, 3))
    assert kept.open()
    assert kept.under == (0, 1, False)


def test_only_a_good_record_of_the_next_generation_is_written(kept: Settings) -> None:
    """As the Python node has it: every bit counts, and so does what the record says once it is sealed again."""
    good = settings_of(1, 2).record()
    assert kept.write(good) is ErrandOutcome.DONE
    for bit in range(8 * len(good)):
        damaged = bytearray(good)
        damaged[bit // 8] ^= 1 << bit % 8
        assert kept.write(bytes(damaged)) is ErrandOutcome.BEYOND, bit
    random = Random(3)
    taken = 0
    for _ in range(3000):
        body = bytearray(good[:-4])
        at = random.choice((0, 4, *range(6, 10), 14, 15, *range(32, 80)))
        body[at] = random.choice((0, 1, 2, 3, 84, 125, 126, 254, 255, random.randrange(256)))
        sealed = bytes(body) + crc32(body).to_bytes(4, "little")
        found = settings_in(sealed)
        wanted = found is not None and found.generation == 1
        assert kept.write(sealed) is (ErrandOutcome.DONE if wanted else ErrandOutcome.BEYOND)
        taken += wanted
    assert 500 < taken < 2500


@pytest.mark.parametrize("word", range(RECORD_WORDS))
def test_a_sector_that_decays_leaves_the_other_one(kept: Settings, word: int) -> None:
    assert kept.put(settings_of(1, 2))
    assert kept.request()
    assert kept.open(restarted=True)
    assert kept.keep()
    for sector, left in ((1, (0, 1, False)), (0, (1, 2, False))):
        state = kept.snapshot()
        kept.chip.words[SECTOR_WORDS * sector + word] ^= 1 << word
        assert kept.open()
        assert kept.under == left
        kept.restore(state)


def test_a_mark_between_set_and_blank_counts_and_is_set_again() -> None:
    for mark, sector, restarted, then in (
        (KEPT, 0, False, (0, 1, False)),
        (REQUESTED, 1, True, (1, 2, True)),
        (TRIED, 1, True, (0, 1, False)),
    ):
        settings = Settings()
        settings.flash(settings_of(0, 1))
        assert settings.open()
        assert settings.put(settings_of(1, 2))
        at = SECTOR_WORDS * sector + mark // 4
        if mark == TRIED:
            assert settings.request()
        settings.chip.words[at], settings.chip.unsure[at] = 0xFFFEFFFF, 0xFFFEFFFF
        assert settings.open(restarted=restarted)
        assert settings.under == then
        assert settings.chip.words[at] == 0
        assert settings.chip.misuse == 0


class Told:
    """What a host does to a node, and what the node may run under: `may` are keys, `now` the one of this boot.

    Every method raises PowerCut when the power fails in it.
    """

    class PowerCut(Exception):
        pass

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.may = {1}
        self.now, self.generation, self.on_trial = 1, 0, False
        self.wanted, self.requested = 0, False
        self.keys = 1
        self.settings.flash(settings_of(0, 1))
        self.boot()

    def _check(self, done: bool) -> None:
        if self.settings.chip.off:
            raise self.PowerCut
        assert done

    def boot(self, *, restarted: bool = False) -> None:
        """Whatever has happened, there are whole settings, and they are old ones or those that were kept."""
        requested, self.requested = self.requested and restarted, False
        found = self.settings.open(restarted=restarted)
        assert found or self.settings.chip.off, f"no settings at all, of {self.may}"
        if found:
            self.generation, self.now, self.on_trial = self.settings.under
            allowed = {self.wanted} if self.on_trial else self.may
            assert self.now in allowed, f"under {self.now}, not {allowed}"
            assert requested or not self.on_trial, "a trial that nobody has asked for"
        self._check(found)
        assert self.on_trial or not requested, "what was asked for was not tried"

    def put(self) -> None:
        """Others are written, over what was there besides those of now."""
        self.keys += 1
        done = self.settings.put(settings_of(self.generation + 1 & 0xFFFF, self.keys))
        if self.settings.chip.off:
            raise self.PowerCut
        assert done
        self.may, self.wanted = {self.now}, self.keys

    def attempt(self) -> None:
        """They are requested, and the program restarts itself."""
        self._check(self.settings.request())
        self.requested = True
        self.boot(restarted=True)

    def keep(self) -> None:
        """What is on trial is kept; from the first moment on it may be what stays."""
        self.may = {*self.may, self.now}
        self._check(self.settings.keep())
        self.may = {self.now}
        self.on_trial = False

    def change(self) -> None:
        """All of it."""
        self.put()
        self.attempt()
        self.keep()

    def change_in_vain(self) -> None:
        """Nobody is heard under the new ones."""
        self.put()
        self.attempt()
        self.boot(restarted=True)
        assert not self.on_trial


def story(told: Told) -> Iterator[Callable[[], None]]:
    """Changes that are kept, and ones that are not."""
    for turn in range(6):
        yield told.change if turn % 3 != 1 else told.change_in_vain
        yield told.boot


@pytest.mark.parametrize("garbled", GARBLED)
def test_power_may_fail_at_every_word_and_in_every_erase(garbled: int) -> None:
    """Each cut is made in a life of its own up to there; then the node boots, is changed, and boots again."""
    cuts = old = new = 0
    for mess in range(8):
        told = Told(Settings(mess, garbled))
        settings = told.settings
        for act in story(told):
            state, facts = settings.snapshot(), dict(vars(told))
            for cut in range(1000):
                settings.cut(cut)
                settings.chip.random += 1 + mess
                before = told.now
                try:
                    act()
                except Told.PowerCut:
                    cuts += 1
                else:
                    break
                settings.mend()
                for _ in range(3):
                    told.boot()
                old, new = old + (told.now == before), new + (told.now != before)
                told.change()
                told.boot()
                settings.restore(state)
                vars(told).update(facts)
            settings.mend()
    print(f"{cuts} cuts, {old} left the old settings, {new} the new ones")
    assert cuts > 1000
    assert (new > 0) == (garbled > 0), "the word that keeps them may be half there"
    assert old > 0.9 * cuts


def live(seed: int, turns: int) -> int:
    """One long life whose power fails at any time, also in the boot after a failure; how often it did."""
    random = Random(seed)
    told = Told(Settings(seed, seed % 3))
    settings, failures, is_on = told.settings, 0, True
    for _ in range(turns):
        if settings.chip.off:
            settings.mend()
        if random.random() < 0.6:
            settings.cut(random.randint(0, 30))
        try:
            if is_on:
                random.choice((told.change, told.change, told.change_in_vain, told.boot, told.put))()
            else:
                told.boot()
            is_on = True
            if told.on_trial:
                told.boot()
        except Told.PowerCut:
            failures += 1
            is_on = False
    assert settings.chip.misuse == 0
    return failures


@pytest.mark.parametrize("seed", range(6))
def test_a_long_life_with_power_that_fails_at_any_time(seed: int) -> None:
    assert live(seed, 1500) > 300


@pytest.mark.campaign
def test_many_long_lives() -> None:
    failures = sum(live(seed, 1500) for seed in range(50_000, 50_300))
    print(f"{failures} failures of the power")
    assert failures > 100_000


def test_the_python_node_does_the_same_to_its_flash() -> None:
    """Random orders, restarts and power-ons: the same outcomes, the same words in both sectors, the same settings."""
    done: set[str] = set()
    for seed in range(60):
        random, settings, flash = Random(seed), Settings(seed), ModelFlash()
        first = settings_of(random.choice((0, 0, 0x7FFF, 0xFFFF)), 1)
        settings.flash(first)
        flash.sectors[0][:] = first.sector()
        flash.sectors[1][:4] = NO_SETTINGS
        assert settings.open()
        keeper = SettingsFlash(flash)
        assert keeper.start() is not None
        for key in range(2, 80):
            what = random.choice((*("store", "try", "restart") * 2, "keep", "drop", "power"))
            record = settings_of(settings.under[0] + random.choice((1, 1, 1, 1, 0, 2)) & 0xFFFF, key).record()
            if what == "store":
                assert settings.write(record) is keeper.store(record)
            elif what == "try":
                assert settings.request() is (keeper.request() is ErrandOutcome.DONE)
            elif what == "keep":
                assert settings.keep() is (keeper.keep() is ErrandOutcome.DONE)
            elif what == "drop":
                settings.forget()
                keeper.drop()
            elif what in ("restart", "power"):
                assert settings.open(restarted=what == "restart")
                assert keeper.start(restarted=what == "restart") is not None
            generation, number, on_trial = settings.under
            standing, under = keeper.standing(), keeper._settings
            assert under is not None
            assert (standing.on_trial, standing.generation) == (on_trial, generation)
            assert int.from_bytes(under.master, "little") == number
            for sector, cells in enumerate(flash.sectors):
                words = settings.words(sector)[: USED_BYTES // 4]
                assert b"".join(word.to_bytes(4, "little") for word in words) == bytes(cells), (seed, key, what)
            done.add(f"{what} {on_trial}")
    assert {"restart True", "keep False", "store True", "power False"} <= done


@pytest.mark.parametrize("worn", [67, 37, 11])
def test_worn_words_are_noticed(worn: int) -> None:
    """Some words keep no 0 in one bit: what cannot be written is not tried, and the old settings stay."""
    settings = Settings(worn)
    settings.flash(settings_of(0, 1))
    assert settings.open()
    settings.chip.worn = worn
    for key in range(2, 60):
        generation, _, _ = settings.under
        if settings.put(settings_of(generation + 1, key)) and settings.request():
            assert settings.open(restarted=True)
            assert settings.under[0] in (generation, generation + 1)
            settings.keep()
        assert settings.open()
        assert settings.under[2] is False
    assert BLANK not in settings.words(0)[:RECORD_WORDS]


@pytest.mark.parametrize("word", range(RECORD_WORDS))
def test_a_word_that_does_not_hold_is_noticed_at_once(kept: Settings, word: int) -> None:
    kept.chip.worn = SECTOR_WORDS + word - 3
    wanted = settings_of(1, 2).record()
    held = int.from_bytes(wanted[4 * word : 4 * word + 4], "little") & 0x00010000
    assert kept.write(wanted) is (ErrandOutcome.DONE if held else ErrandOutcome.FAILED)


def test_a_sector_that_is_not_blank_after_its_erase_is_not_used(kept: Settings) -> None:
    assert kept.put(settings_of(1, 2))
    assert kept.request()
    kept.chip.stuck = SECTOR_WORDS + REQUESTED // 4 + 1
    assert kept.write(settings_of(1, 3).record()) is ErrandOutcome.FAILED


def test_a_mark_that_cannot_be_made_whole_is_no_reason_to_erase_the_others(kept: Settings) -> None:
    at = KEPT // 4
    kept.chip.words[at], kept.chip.unsure[at], kept.chip.worn = 0x00010000, 0xFFFFFFFF, at - 3
    assert kept.open()
    assert kept.write(settings_of(1, 2).record()) is ErrandOutcome.FAILED
    assert list(kept.chip.erases) == [0, 0]
    kept.chip.misuse = 0  # it tries again each time, in vain


def test_noise_is_no_settings() -> None:
    random = Random(8)
    settings = Settings()
    for _ in range(500):
        for index in range(2 * SECTOR_WORDS):
            settings.chip.words[index] = random.getrandbits(32) if random.random() < 0.9 else BLANK
        assert not settings.open()
