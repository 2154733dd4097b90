"""The firmware's journal in flash: power fails everywhere, and it is never wrong about the position or the boot."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from functools import lru_cache
from random import Random

import pytest

from . import build
from .rig import Triple, compiled

NEAR = 8
RECORD_WORDS, SECTOR_WORDS, WORDS = 8, 256, 512
MARK, CHECK = 6, 7
BLANK = 0xFFFFFFFF
SOURCES = tuple(build.CORE / f"{name}.c" for name in ("store", "crc32", "settings_record", "settings_store"))

Counts = tuple[int, int, int]


class Chip(ctypes.Structure):
    """The flash of flash.c."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("operations", "cut_after")),
        ("erases", ctypes.c_int32 * 2),
        *((name, ctypes.c_int32) for name in ("misuse", "off", "garbled")),
        ("random", ctypes.c_uint32),
        *((name, ctypes.c_int32) for name in ("worn", "stuck")),
        ("words", ctypes.c_uint32 * WORDS),
        ("unsure", ctypes.c_uint32 * WORDS),
    )


@lru_cache
def library() -> ctypes.CDLL:
    loaded = compiled("flash", [*SOURCES, build.HERE / "flash.c"])
    loaded.flash_new.restype = ctypes.POINTER(Chip)
    loaded.flash_size.restype = ctypes.c_size_t
    loaded.flash_last.restype = loaded.flash_newest.restype = ctypes.c_uint32
    for name in ("boot", "save", "moving", "prepare"):
        getattr(loaded, f"flash_{name}").restype = ctypes.c_bool
    loaded.flash_save.argtypes = [ctypes.c_void_p, Triple, ctypes.c_bool, ctypes.c_uint8]
    return loaded


class Flash:
    """A node's two sectors and the store that keeps them."""

    def __init__(self, seed: int = 1) -> None:
        self._c = library()
        self._self = self._c.flash_new(seed)
        self.open()

    def __del__(self) -> None:
        self._c.flash_free(self._self)

    @property
    def chip(self) -> Chip:
        return self._self.contents

    def open(self) -> None:
        """Power comes back, and the store looks at what is there."""
        self._c.flash_open(self._self)

    def tie(self, under: int) -> None:
        self._c.flash_tie(self._self, ctypes.c_uint16(under))

    def boot(self) -> bool:
        return bool(self._c.flash_boot(self._self))

    def save(self, at: Counts, *, known: bool = True, flags: int = 0) -> bool:
        return bool(self._c.flash_save(self._self, Triple(*at), known, flags))

    def moving(self) -> bool:
        return bool(self._c.flash_moving(self._self))

    def prepare(self) -> bool:
        return bool(self._c.flash_prepare(self._self))

    def last(self) -> tuple[int, Counts | None, int]:
        """Boot number, position if it is known, flags."""
        at, known, flags = Triple(), ctypes.c_bool(), ctypes.c_uint8()
        boot = self._c.flash_last(self._self, at, ctypes.byref(known), ctypes.byref(flags))
        return int(boot), (at[0], at[1], at[2]) if known.value else None, flags.value

    def snapshot(self) -> bytes:
        """All there is, to go back to with `restore`."""
        return ctypes.string_at(self._self, self._c.flash_size())

    def restore(self, state: bytes) -> None:
        ctypes.memmove(self._self, state, len(state))

    @property
    def newest(self) -> int:
        """Index of the first word of the newest record."""
        return int(self._c.flash_newest(self._self))


@pytest.fixture
def flash() -> Iterator[Flash]:
    made = Flash()
    yield made
    assert made.chip.misuse == 0, "a word was programmed twice"


def random_counts(random: Random) -> Counts:
    x, y, z = (random.randint(-260_000, 260_000) for _ in range(3))
    return x, y, z


class Life:
    """A node that moves, saves and loses power, and what its store may say: `truth` is where its axes really are.

    Every method raises PowerCut when the power fails in it.
    """

    class PowerCut(Exception):
        pass

    def __init__(self, flash: Flash, random: Random) -> None:
        self.flash, self.random = flash, random
        self.truth: Counts = (0, 0, 0)
        self.boots: list[int] = []

    def check(self, done: bool) -> None:
        if self.flash.chip.off:
            raise self.PowerCut
        assert done

    def begin(self) -> None:
        """Power on: what the store says must be true, and the boot number new. A cut that was set remains."""
        cut = self.flash.chip.cut_after
        self.flash.open()
        self.flash.chip.cut_after = cut
        _, position, _ = self.flash.last()
        assert position is None or self.near(position), f"{position} claimed, {self.truth} true"
        self.check(self.flash.boot())
        number, after, _ = self.flash.last()
        assert after == position
        assert number > max(self.boots, default=0), "a boot number came twice"
        self.boots.append(number)

    def near(self, position: Counts) -> bool:
        return max(abs(one - other) for one, other in zip(position, self.truth, strict=True)) <= NEAR

    def move(self) -> None:
        """The mark first; then the axes are nowhere in particular, then at rest, then that is saved."""
        self.check(self.flash.moving())
        self.truth = random_counts(self.random)
        self.check(self.flash.save(self.truth))
        assert self.flash.last()[1] == self.truth

    def home(self) -> None:
        self.check(self.flash.moving())
        self.truth = random_counts(self.random)
        self.check(self.flash.save(self.truth, known=False))
        self.check(self.flash.save(self.truth))


def test_a_new_chip_knows_nothing_and_counts_from_one(flash: Flash) -> None:
    assert flash.last() == (0, None, 0)
    assert flash.boot()
    assert flash.last() == (1, None, 0)


def test_a_position_saved_at_rest_is_found_again(flash: Flash) -> None:
    flash.boot()
    assert flash.save((1, -2, 300_000), flags=5)
    for boot in range(2, 6):
        flash.open()
        assert flash.last() == (boot - 1, (1, -2, 300_000), 5)
        assert flash.boot()
        assert flash.last() == (boot, (1, -2, 300_000), 5)


def test_after_power_was_lost_during_a_move_the_position_is_unknown_for_good(flash: Flash) -> None:
    flash.boot()
    flash.save((1, 2, 3))
    assert flash.moving()
    for _ in range(3):
        flash.open()
        assert flash.last()[1] is None
        assert flash.boot()
        assert flash.last()[1] is None
    flash.save((7, 8, 9))
    flash.open()
    assert flash.last()[1] == (7, 8, 9)


def test_marking_twice_and_saving_the_same_cost_nothing(flash: Flash) -> None:
    flash.boot()
    flash.save((10, 20, 30))
    before = flash.chip.operations
    for at in ((10, 20, 30), (10 + NEAR, 20 - NEAR, 30)):
        assert flash.save(at)
    assert flash.chip.operations == before
    assert flash.save((10 + NEAR + 1, 20, 30))
    assert flash.chip.operations > before
    flash.moving()
    before = flash.chip.operations
    assert flash.moving()
    assert flash.chip.operations == before


def test_a_position_that_is_lost_at_rest_is_lost_also_if_the_save_is_cut() -> None:
    """Saving marks the old record first."""
    for cut in range(9):
        flash = Flash(cut)
        flash.boot()
        flash.save((10, 20, 30))
        flash.chip.cut_after = flash.chip.operations + cut
        flash.save((10, 20, 30), known=False)
        flash.open()
        assert flash.last()[1] == ((10, 20, 30) if cut == 0 else None), cut


def test_power_that_bounces_while_it_is_switched_on_costs_no_position(flash: Flash) -> None:
    """A boot's own record that was cut short before its checksum says nothing against the one before."""
    flash.boot()
    flash.save((10, 20, 30))
    for cut in range(7):
        flash.chip.cut_after = flash.chip.operations + cut
        assert not flash.boot()
        flash.open()
        assert flash.last()[1] == (10, 20, 30)


def test_wear_is_two_erases_for_sixty_records_or_more(flash: Flash) -> None:
    flash.boot()
    random = Random(4)
    for _ in range(1000):
        flash.moving()
        assert flash.save(random_counts(random))
    erases = list(flash.chip.erases)
    assert abs(erases[0] - erases[1]) <= 1
    records_per_two = 1001 / sum(erases) * 2
    print(f"{records_per_two:.1f} records per two erases")
    assert records_per_two >= 60


def test_erasing_ahead_costs_no_more_and_spares_the_save_its_wait(flash: Flash) -> None:
    flash.boot()
    random = Random(4)
    for _ in range(1000):
        flash.moving()
        before = sum(flash.chip.erases)
        assert flash.save(random_counts(random))
        assert sum(flash.chip.erases) == before
        assert flash.prepare()
    assert 1001 / sum(flash.chip.erases) * 2 >= 60


def story(life: Life) -> Iterator[Callable[[], None]]:
    """What the node does, one thing after the other: enough for each sector to be erased three times."""
    for turn in range(200):
        if turn % 10 == 0:
            yield life.begin
        yield life.home if turn % 17 == 0 else life.move
        if turn % 3 == 0:
            yield lambda: life.check(life.flash.prepare())


@pytest.mark.parametrize("garbled", [0, 1])
def test_power_may_fail_after_every_operation_of_the_flash(garbled: int) -> None:
    """Each cut is made in a life of its own up to there; afterwards the node boots, moves and saves on."""
    flash = Flash(garbled)
    life = Life(flash, Random(garbled))
    cuts = unknown = 0
    for act in story(life):
        state, truth, boots = flash.snapshot(), life.truth, list(life.boots)
        cut = 0
        while True:
            flash.chip.cut_after, flash.chip.garbled = flash.chip.operations + cut, garbled
            flash.chip.random += 1  # another mess each time
            try:
                act()
            except Life.PowerCut:
                cuts += 1
            else:
                break
            flash.chip.cut_after = -1
            life.begin()
            unknown += flash.last()[1] is None
            life.move()
            life.begin()
            assert flash.last()[1] == life.truth
            flash.restore(state)
            life.truth, life.boots = truth, list(boots)
            cut += 1
        flash.chip.cut_after = -1
    print(f"{cuts} cuts, position unknown after {unknown}")
    assert cuts > 1300
    assert 0 < unknown < cuts
    assert flash.chip.misuse == 0
    assert min(flash.chip.erases) >= 2


@pytest.mark.parametrize("seed", range(4))
def test_a_long_life_with_power_that_fails_at_any_time(seed: int) -> None:
    """One history, hundreds of failures, also during the boot after a failure."""
    flash, random = Flash(seed), Random(seed)
    life = Life(flash, random)
    flash.chip.garbled = 1
    failures = 0
    on = False
    for _ in range(4000):
        try:
            if flash.chip.off:
                flash.chip.cut_after = -1
            if random.random() < 0.3:
                flash.chip.cut_after = flash.chip.operations + random.randint(0, 12)
            random.choice((life.move, life.move, life.home))() if on else life.begin()
            on = random.random() > 0.05
        except Life.PowerCut:
            failures += 1
            on = False
    assert failures > 300, f"seed {seed}: only {failures} failures"
    assert len(life.boots) > 300
    assert flash.chip.misuse == 0


def test_a_flipped_bit_in_the_newest_record_never_makes_a_wrong_position_or_an_old_boot_number() -> None:
    for bit in range(32 * RECORD_WORDS):
        flash = Flash()
        flash.boot()
        flash.save((111, 222, 333))
        flash.open()
        flash.boot()
        flash.save((444, 555, 666))
        flash.open()
        flash.boot()
        flash.chip.words[flash.newest + bit // 32] ^= 1 << bit % 32
        flash.open()
        assert flash.last()[1] is None, bit
        assert flash.boot()
        assert flash.last()[0] > 3, bit


def test_a_decayed_first_record_of_a_fresh_sector_is_missed_too() -> None:
    flash = Flash()
    for _ in range(33):
        flash.open()
        flash.boot()
    assert flash.newest == SECTOR_WORDS
    flash.chip.words[flash.newest + 1] ^= 4
    flash.open()
    assert flash.last()[0] == 32
    flash.boot()
    assert flash.last()[0] > 33


@pytest.mark.parametrize("worn", [67, 37])
def test_worn_words_are_stepped_over_or_refused_never_trusted(worn: int) -> None:
    """Some words keep no 0 in one bit; the store reads back what it writes and tries another slot."""
    flash, random = Flash(), Random(worn)
    flash.chip.worn = worn
    flash.boot()
    saved = known = 0
    for _ in range(200):
        if not flash.moving():
            continue
        truth = random_counts(random)
        done = flash.save(truth)
        saved += done
        flash.open()
        assert flash.last()[1] in (None, truth)
        known += done and flash.last()[1] == truth
        flash.boot()
    assert saved > 100
    assert known > 0.9 * saved


def test_a_mark_that_does_not_stick_forbids_the_move() -> None:
    flash = Flash()
    flash.boot()
    flash.save((1, 2, 3))
    flash.chip.off = 1
    assert not flash.moving()


def test_noise_is_no_record() -> None:
    random = Random(8)
    for _ in range(200):
        flash = Flash()
        for index in range(WORDS):
            flash.chip.words[index] = random.getrandbits(32) if random.random() < 0.9 else BLANK
        flash.open()
        assert flash.last() == (0, None, 0)
        assert flash.boot()
        assert flash.last()[0] == 1


# Settings


def test_a_position_belongs_to_the_settings_that_it_was_counted_under(flash: Flash) -> None:
    flash.tie(0x1234)
    assert flash.boot()
    assert flash.save((1, 2, 3), flags=5)
    for under, position in ((0x1234, (1, 2, 3)), (0x1235, None), (0x1234, None)):
        flash.open()
        flash.tie(under)
        assert flash.last()[1:] == (position, 5)
        assert flash.boot()
    assert flash.last()[0] == 4


def test_the_same_position_under_other_settings_is_written_again(flash: Flash) -> None:
    flash.tie(1)
    assert flash.boot()
    assert flash.save((1, 2, 3))
    flash.tie(2)
    before = flash.newest
    assert flash.last()[1] is None
    assert flash.save((1, 2, 3))
    assert flash.newest != before
    flash.open()
    flash.tie(2)
    assert flash.last()[1] == (1, 2, 3)


def test_records_of_the_firmware_before_count_boots_but_tell_no_position(flash: Flash) -> None:
    flash.tie(0x3150)  # of which they consist: "P1"
    assert flash.boot()
    assert flash.save((1, 2, 3))
    assert flash.chip.words[flash.newest] == int.from_bytes(b"CLP1", "little")
    flash.open()
    flash.tie(0x0815)
    assert flash.last() == (1, None, 0)
