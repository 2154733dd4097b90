"""A board of the mock display as it lies on the bench: its chip, its settings and its program, also between commands.

What is written of it never has a key, only the short name of one: whoever opens the display brings the keys along.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from curveline.radio.mock.programs import flashed_program, program_of, told_program
from curveline.radio.node.loader import ProgramStore
from curveline.radio.node.settings_flash import (
    BLANK,
    KEPT,
    REQUESTED,
    SECTORS,
    SET,
    TRIED,
    USED_BYTES,
    ModelFlash,
)
from curveline.radio.protocol.codes import AXIS_COUNT
from curveline.radio.protocol.keys import ZERO_MASTER, derive
from curveline.radio.protocol.motion import AxisLimits
from curveline.radio.protocol.node_settings import SETTINGS_BYTES, NodeSettings, settings_in
from curveline.radio.protocol.settings_frames import TRIAL_MS
from curveline.radio.site.key_file import fingerprint_of

MARKS = (REQUESTED, TRIED, KEPT)
NAME_BYTES = 4


@dataclass
class Board:
    """Chip id and flash; `trial_ms` is what was left of a trial when the display was closed, 0 if there was none.

    `names` has, by sector, a key that only stands for one that is not used here, and the short name of that one.
    """

    chip: int
    flash: ModelFlash
    trial_ms: int = 0
    program: ProgramStore = field(default_factory=flashed_program)
    in_loader: bool = False
    names: dict[int, tuple[bytes, str]] = field(default_factory=dict, repr=False)
    _told: dict[int, list[dict[str, Any] | None]] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def flashed(cls, chip: int, settings: NodeSettings) -> Board:
        """A board that has just got its program by a cable."""
        flash = ModelFlash()
        flash.sectors[0][:] = settings.sector()
        return cls(chip, flash)

    def repowered(self) -> Board:
        """The board once its power has gone and come: a trial that it was on is over."""
        in_loader = not self.program.start()
        if not self.trial_ms:
            return replace(self, in_loader=in_loader)
        for cells in self.flash.sectors:
            if bytes(cells[REQUESTED:TRIED]) == SET:
                cells[TRIED:KEPT] = SET
        return replace(self, trial_ms=0, in_loader=in_loader)

    def document(self) -> dict[str, Any]:
        """The board as plain data; what its flash holds is read again only after it has changed."""
        if self.flash.done not in self._told:
            self._told = {self.flash.done: [self._sector(sector) for sector in range(SECTORS)]}
        facts = {"chip": self.chip, "trial_ms": self.trial_ms, "in_loader": self.in_loader}
        return {**facts, "settings": self._told[self.flash.done], "program": told_program(self.program)}

    def _sector(self, sector: int) -> dict[str, Any] | None:
        """What a sector holds, None if it is no whole record."""
        settings = settings_in(bytes(self.flash.sectors[sector][:SETTINGS_BYTES]))
        if settings is None:
            return None
        stands_in, name = self.names.get(sector, (b"", ""))
        axes = [[axis.low, axis.high, axis.speed, axis.acceleration] for axis in settings.axes]
        return {
            **{name: getattr(settings, name) for name in _PLAIN},
            "key": name if settings.master == stands_in else fingerprint_of(settings.master),
            "axes": axes,
            "marks": [self.flash.word(sector, mark) != BLANK for mark in MARKS],
        }


@dataclass(frozen=True)
class KeyRing:
    """The keys with which a mock display is opened: boards without one of their own hold `own`.

    If that is the mock's open key, all boards are taken to hold it.
    """

    own: bytes = field(repr=False)
    others: tuple[bytes, ...] = field(default=(), repr=False)

    def key(self, name: str) -> tuple[bytes, bool]:
        """The key with a short name, and whether it only stands for one that is not used here."""
        if self.own == ZERO_MASTER:
            return ZERO_MASTER, name != fingerprint_of(ZERO_MASTER)
        known = {fingerprint_of(master): master for master in (self.own, *self.others)}
        known[fingerprint_of(ZERO_MASTER)] = self.own
        if name in known:
            return known[name], False
        return derive(ZERO_MASTER, b"unknown", bytes.fromhex(name)[:NAME_BYTES]), True


OLDER = {"chip", "trial_ms", "settings"}
"""Entries of older releases, whose boards forgot their program."""
ENTRIES = OLDER | {"program", "in_loader"}
_PLAIN = {"number": int, "data_rate": str, "channel": int, "address": str, "generation": int}


def board_of(content: Any, ring: KeyRing) -> Board:
    """A board out of plain data, with its keys; ValueError, TypeError or KeyError say what is wrong."""
    chip, trial_ms, sectors = content["chip"], content["trial_ms"], content["settings"]
    older = content.keys() == OLDER
    if not (older or content.keys() == ENTRIES) or not isinstance(sectors, list) or len(sectors) != SECTORS:
        raise ValueError("a board has missing or unknown entries")
    if type(chip) is not int or not 0 <= chip < 2**32 or type(trial_ms) is not int or not 0 <= trial_ms <= TRIAL_MS:
        raise ValueError("a board's chip or trial is not a whole number in its range")
    board = Board(chip, ModelFlash(), trial_ms)
    if not older:
        board.program, board.in_loader = program_of(content["program"]), content["in_loader"]
        if type(board.in_loader) is not bool or not (board.in_loader or board.program.whole):
            raise ValueError("a board's loader makes no sense")
    for sector, (cells, told) in enumerate(zip(board.flash.sectors, sectors, strict=True)):
        if told is not None:
            master, stands_in = ring.key(told["key"])
            _fill(cells, told, master)
            if stands_in:
                board.names[sector] = master, told["key"]
    if not any(told is not None and told["marks"][MARKS.index(KEPT)] for told in sectors):
        raise ValueError("a board has no settings to run under")
    return board


def _fill(cells: bytearray, content: Any, master: bytes) -> None:
    if content.keys() != {*_PLAIN, "key", "axes", "marks"}:
        raise ValueError("a board's settings have missing or unknown entries")
    if any(type(content[name]) is not kind for name, kind in _PLAIN.items()):
        raise ValueError("a board's settings have an entry of another kind")
    axes, marks = content["axes"], content["marks"]
    if len(axes) != AXIS_COUNT or len(marks) != len(MARKS) or any(type(mark) is not bool for mark in marks):
        raise ValueError("a board's limits or marks are not three")
    x, y, z = (AxisLimits(*_numbers(axis)) for axis in axes)
    plain = (content["number"], content["data_rate"], content["channel"], content["address"])
    settings = NodeSettings(*plain, master, (x, y, z), content["generation"])
    record = _packed(settings)
    if settings_in(record) != settings:
        raise ValueError("a board's settings make no sense")
    cells[:SETTINGS_BYTES] = record
    cells[SETTINGS_BYTES:USED_BYTES] = b"".join(SET if mark else BLANK for mark in marks)


def _packed(settings: NodeSettings) -> bytes:
    try:
        return settings.record()
    except Exception as error:  # struct.error is no ValueError
        raise ValueError(f"a board's settings do not fit: {error}") from None


def _numbers(axis: Any) -> tuple[int, int, int, int]:
    low, high, speed, acceleration = axis
    if any(type(each) is not int for each in axis):
        raise ValueError("a board's limits are not whole numbers")
    return low, high, speed, acceleration
