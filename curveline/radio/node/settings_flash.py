"""Where a node keeps its settings: two sectors of flash, of which a power cut at any word leaves the old or the new.

The specification of firmware/node/settings.c, docs/radio-protocol.md. A sector holds one record and three marks; a mark
is set when its word is no longer blank, so that one whose programming was broken off counts, and is programmed again.
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

    def word(self, sector: int, at: int) -> bytes:
        """See Flash."""
        return bytes(self.sectors[sector][at : at + WORD])

    def erase(self, sector: int) -> None:
        """See Flash."""
        cells = self.sectors[sector]
        last = USED_BYTES * self.part // WORD if self._is_cut() else USED_BYTES
        cells[:last] = b"\xff" * last
        self._count()

    def program(self, sector: int, at: int, word: bytes) -> None:
        """See Flash."""
        cells = self.sectors[sector]
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

    def start(self) -> NodeSettings | None:
        """What the node is to run under now, None if it has no settings; it is on trial at most once with any."""
        for sector in range(SECTORS):
            self._mend(sector)
        found = [self._record(sector) for sector in range(SECTORS)]
        kept = [sector for sector in range(SECTORS) if found[sector] is not None and self._is_set(sector, KEPT)]
        if not kept:
            self._settings = None
            return None
        self._current = self._running = self._newest(kept)
        if self._stored() is not None and self._is_set(self._spare, REQUESTED):
            self.flash.program(self._spare, TRIED, SET)
            self._running = self._spare
        self._settings = self._record(self._running)
        return self._settings

    def standing(self) -> SettingsStanding:
        """See SettingsKeeper."""
        assert self._settings is not None
        generation, stored = self._settings.generation, self._stored()
        return SettingsStanding(self._on_trial, generation, generation if stored is None else stored.generation)

    def store(self, record: bytes) -> ErrandOutcome:
        """See SettingsKeeper."""
        wanted = settings_in(record)
        assert self._settings is not None
        if wanted is None or wanted.generation != (self._settings.generation + 1) % GENERATIONS or self._on_trial:
            return ErrandOutcome.BEYOND
        self.flash.erase(self._spare)
        for at in range(0, SETTINGS_BYTES, WORD):
            self.flash.program(self._spare, at, record[at : at + WORD])
        return ErrandOutcome.DONE if self._stored() == wanted else ErrandOutcome.FAILED

    def request(self) -> ErrandOutcome:
        """See SettingsKeeper."""
        if self._on_trial or self._stored() is None:
            return ErrandOutcome.BEYOND
        self.flash.program(self._spare, REQUESTED, SET)
        return ErrandOutcome.DONE if self._is_set(self._spare, REQUESTED) else ErrandOutcome.FAILED

    def keep(self) -> ErrandOutcome:
        """See SettingsKeeper."""
        self.flash.program(self._running, KEPT, SET)
        if not self._is_set(self._running, KEPT):
            return ErrandOutcome.FAILED
        self._current = self._running
        return ErrandOutcome.DONE

    def drop(self) -> None:
        """See SettingsKeeper."""
        if not self._on_trial and self._stored() is not None:
            self._spoil(self._spare)

    @property
    def _on_trial(self) -> bool:
        return self._running != self._current

    @property
    def _spare(self) -> int:
        return 1 - self._current

    def _mend(self, sector: int) -> None:
        """Make sure that no mark is half programmed, and that what was tried in vain is not found again."""
        for mark in (REQUESTED, TRIED, KEPT):
            if self.flash.word(sector, mark) not in (BLANK, SET):
                self.flash.program(sector, mark, SET)
        failed = self._is_set(sector, TRIED) and not self._is_set(sector, KEPT)
        if failed and self._record(sector) is not None:
            self._spoil(sector)

    def _spoil(self, sector: int) -> None:
        """A record whose magic is gone is none."""
        self.flash.program(sector, 0, SET)

    def _newest(self, sectors: list[int]) -> int:
        """Of records that were kept; of two of the same generation the first."""
        if len(sectors) == 1:
            return sectors[0]
        first, second = (self._record(sector) for sector in sectors)
        assert first is not None
        assert second is not None
        return sectors[is_newer(second.generation, first.generation)]

    def _stored(self) -> NodeSettings | None:
        """What is in the spare sector, if it is whole, newer and was never tried."""
        stored, current = self._record(self._spare), self._record(self._current)
        assert current is not None
        is_fresh = not self._is_set(self._spare, TRIED) and not self._is_set(self._spare, KEPT)
        return stored if stored is not None and is_fresh and is_newer(stored.generation, current.generation) else None

    def _record(self, sector: int) -> NodeSettings | None:
        return settings_in(b"".join(self.flash.word(sector, at) for at in range(0, SETTINGS_BYTES, WORD)))

    def _is_set(self, sector: int, mark: int) -> bool:
        return self.flash.word(sector, mark) != BLANK


def flashed(settings: NodeSettings) -> SettingsFlash:
    """The flash of a node that has just got its program and these settings by a cable."""
    flash = ModelFlash()
    flash.sectors[0][:] = settings.sector()
    flash.sectors[1][: len(NO_SETTINGS)] = NO_SETTINGS
    keeper = SettingsFlash(flash)
    keeper.start()
    return keeper
