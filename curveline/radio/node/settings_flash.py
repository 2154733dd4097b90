"""Where a node keeps its settings: two sectors of flash, of which a power cut at any word leaves the old or the new.

The specification of firmware/core/settings_store.c, docs/radio-protocol.md. A sector holds one record and three marks;
a mark is set when its word is no longer blank, so that one whose programming was broken off counts, and is programmed
again.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from curveline.radio.protocol.codes import ErrandOutcome
from curveline.radio.protocol.node_settings import (
    GENERATIONS,
    NO_SETTINGS,
    SETTINGS_BYTES,
    NodeSettings,
    is_newer,
    settings_in,
)

SECTORS = 2
WORD = 4
REQUESTED, TRIED, KEPT = SETTINGS_BYTES, SETTINGS_BYTES + WORD, SETTINGS_BYTES + 2 * WORD
"""Where the marks are in a sector."""
USED_BYTES = KEPT + WORD
BLANK = b"\xff" * WORD
SET = bytes(WORD)


class Flash(Protocol):
    """Two sectors, from 0, of which words are read, and made blank together or programmed one by one."""

    def word(self, sector: int, at: int) -> bytes:
        """The four bytes at `at` of a sector."""
        ...

    def erase(self, sector: int) -> None:
        """Make a sector blank."""
        ...

    def program(self, sector: int, at: int, word: bytes) -> None:
        """Clear the bits of a word that are zero in `word`."""
        ...


@dataclass
class ModelFlash:
    """Flash in memory; the power is cut in the midst of operation number `cut_at`, counted from 1 and by `done`.

    What that operation leaves is the first `part` of four parts: of an erasure its words, of a word its bytes.
    """

    sectors: list[bytearray] = field(
        default_factory=lambda: [bytearray(b"\xff" * USED_BYTES) for _ in range(SECTORS)], repr=False
    )
    cut_at: int = 0
    part: int = WORD // 2
    done: int = 0
    half: set[tuple[int, int]] = field(default_factory=set, repr=False)
    """Words whose programming was broken off: the only ones that may be programmed again before an erasure."""

    def word(self, sector: int, at: int) -> bytes:
        """See Flash."""
        return bytes(self.sectors[sector][at : at + WORD])

    def erase(self, sector: int) -> None:
        """See Flash."""
        cells = self.sectors[sector]
        last = USED_BYTES * self.part // WORD if self._is_cut() else USED_BYTES
        cells[:last] = b"\xff" * last
        self.half -= {(sector, at) for at in range(0, last, WORD)}
        self._count()

    def program(self, sector: int, at: int, word: bytes) -> None:
        """See Flash."""
        cells = self.sectors[sector]
        assert self.word(sector, at) == BLANK or (sector, at) in self.half, "a word is programmed twice"
        self.half = self.half | {(sector, at)} if self._is_cut() else self.half - {(sector, at)}
        wanted = word[: self.part] + BLANK[self.part :] if self._is_cut() else word
        cells[at : at + WORD] = bytes(old & new for old, new in zip(cells[at : at + WORD], wanted, strict=True))
        self._count()

    def _is_cut(self) -> bool:
        return self.done + 1 == self.cut_at

    def _count(self) -> None:
        self.done += 1
        if self.done == self.cut_at:
            raise PowerCut


class PowerCut(Exception):
    """The power of a modelled node went away."""


@dataclass(frozen=True)
class SettingsStanding:
    """What a node runs under: whether on trial, its generation, and that which is stored and was not tried, or own."""

    on_trial: bool = False
    generation: int = 0
    stored: int = 0


class SettingsKeeper(Protocol):
    """What a node needs of whatever keeps its settings; a node restarts by itself after a try, or a drop on trial."""

    def standing(self) -> SettingsStanding:
        """What the node runs under."""
        ...

    def store(self, record: bytes) -> ErrandOutcome:
        """Put a record aside: DONE, BEYOND if it is not the next one and a good one, FAILED if it did not hold."""
        ...

    def request(self) -> ErrandOutcome:
        """Let the next start be under what is stored: DONE, BEYOND if there is nothing, FAILED if it did not hold."""
        ...

    def keep(self) -> ErrandOutcome:
        """The settings on trial are those of the node from now on: DONE, or FAILED if that did not hold."""
        ...

    def drop(self) -> None:
        """Forget what is stored and was not tried."""
        ...


class FixedSettings:
    """The settings of a node that has nowhere to put others."""

    def standing(self) -> SettingsStanding:
        """See SettingsKeeper."""
        return SettingsStanding()

    def store(self, record: bytes) -> ErrandOutcome:
        """See SettingsKeeper."""
        return ErrandOutcome.FAILED

    def request(self) -> ErrandOutcome:
        """See SettingsKeeper."""
        return ErrandOutcome.BEYOND

    def keep(self) -> ErrandOutcome:
        """See SettingsKeeper."""
        return ErrandOutcome.FAILED

    def drop(self) -> None:
        """See SettingsKeeper."""


class SettingsFlash:
    """The settings of a node in its flash; `start` comes first, whenever the node starts."""

    def __init__(self, flash: Flash) -> None:
        self.flash = flash
        self._current = self._running = 0
        self._settings: NodeSettings | None = None
        self._is_stored = False

    def start(self, *, restarted: bool = False) -> NodeSettings | None:
        """What the node is to run under now, None if it has no settings; it is on trial at most once with any.

        A trial begins only if the node has `restarted` itself: what a power cut has half done never begins one later.
        """
        found = [self._record(sector) for sector in range(SECTORS)]
        kept = [sector for sector in range(SECTORS) if found[sector] is not None and self._is_marked(sector, KEPT)]
        self._is_stored = False
        if not kept:
            self._settings = None
            return None
        self._current = self._running = self._newest(kept)
        if self._is_due() and restarted:
            self._running = self._spare
        self._settings = found[self._running]
        return self._settings

    def standing(self) -> SettingsStanding:
        """See SettingsKeeper."""
        assert self._settings is not None
        generation = self._settings.generation
        return SettingsStanding(self._on_trial, generation, (generation + self._is_stored) % GENERATIONS)

    def store(self, record: bytes) -> ErrandOutcome:
        """See SettingsKeeper; without settings in force that are sure to last nothing is erased."""
        wanted = settings_in(record)
        assert self._settings is not None
        if wanted is None or wanted.generation != (self._settings.generation + 1) % GENERATIONS or self._on_trial:
            return ErrandOutcome.BEYOND
        self._is_stored = False
        if self._record(self._current) is None or not self._set(self._current, KEPT):
            return ErrandOutcome.FAILED
        self.flash.erase(self._spare)
        if any(self.flash.word(self._spare, at) != BLANK for at in range(0, USED_BYTES, WORD)):
            return ErrandOutcome.FAILED
        for at in range(0, SETTINGS_BYTES, WORD):
            self.flash.program(self._spare, at, record[at : at + WORD])
        self._is_stored = self._record(self._spare) == wanted
        return ErrandOutcome.DONE if self._is_stored else ErrandOutcome.FAILED

    def request(self) -> ErrandOutcome:
        """See SettingsKeeper; what was stored before the last start may not last, and is not tried."""
        if not self._is_stored:
            return ErrandOutcome.BEYOND
        if not self._set(self._spare, REQUESTED):
            return ErrandOutcome.FAILED
        self._is_stored = False
        return ErrandOutcome.DONE

    def keep(self) -> ErrandOutcome:
        """See SettingsKeeper."""
        if not self._on_trial:
            return ErrandOutcome.BEYOND
        if not self._set(self._running, KEPT):
            return ErrandOutcome.FAILED
        self._current = self._running
        return ErrandOutcome.DONE

    def drop(self) -> None:
        """See SettingsKeeper."""
        self._is_stored = False

    @property
    def _on_trial(self) -> bool:
        return self._running != self._current

    @property
    def _spare(self) -> int:
        return 1 - self._current

    def _is_due(self) -> bool:
        """Whether what is in the spare sector is to be tried now; from here on it was."""
        spare, current = self._record(self._spare), self._record(self._current)
        assert current is not None
        if spare is None or not is_newer(spare.generation, current.generation):
            return False
        is_asked = self._is_marked(self._spare, REQUESTED) and not self._is_marked(self._spare, TRIED)
        return is_asked and self._set(self._spare, TRIED)

    def _newest(self, sectors: list[int]) -> int:
        """Of records that were kept; of two of the same generation the first."""
        if len(sectors) == 1:
            return sectors[0]
        first, second = (self._record(sector) for sector in sectors)
        assert first is not None
        assert second is not None
        return sectors[is_newer(second.generation, first.generation)]

    def _record(self, sector: int) -> NodeSettings | None:
        return settings_in(b"".join(self.flash.word(sector, at) for at in range(0, SETTINGS_BYTES, WORD)))

    def _is_marked(self, sector: int, mark: int) -> bool:
        """Whether a mark is not blank; one that is set by half counts, and is set again."""
        if self.flash.word(sector, mark) == BLANK:
            return False
        self._set(sector, mark)
        return True

    def _set(self, sector: int, mark: int) -> bool:
        """Set a mark; whether it is."""
        if self.flash.word(sector, mark) != SET:
            self.flash.program(sector, mark, SET)
        return self.flash.word(sector, mark) == SET


def flashed(settings: NodeSettings) -> SettingsFlash:
    """The flash of a node that has just got its program and these settings by a cable."""
    flash = ModelFlash()
    flash.sectors[0][:] = settings.sector()
    flash.sectors[1][: len(NO_SETTINGS)] = NO_SETTINGS
    keeper = SettingsFlash(flash)
    keeper.start()
    return keeper
