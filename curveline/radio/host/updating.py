"""Replacing a node's program: to the loader, piece by piece, and to the new program, with what the node says each time.

Whatever breaks it off, power or air or this host, it is taken up where it was: the loader knows which sectors it has.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

from curveline.drive_settings import DriveSettings
from curveline.errors import InvalidInput
from curveline.radio.host.errands import WHY, Errand, begun
from curveline.radio.host.link import Halted, ignore
from curveline.radio.host.peer import Peer
from curveline.radio.host.queries import fresh_nonce, insist
from curveline.radio.host.scan import ScannedNode, scan_one
from curveline.radio.host.service import SILENCE_US, halted, peer_of, why_silent
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.interface import Radio, RadioGone
from curveline.radio.protocol.codes import (
    ATTEMPT_MASK,
    ErrandOutcome,
    NodeState,
    Reject,
    SettingsOperation,
)
from curveline.radio.protocol.frames import HelloFrame, IdentFrame, decode_ident
from curveline.radio.protocol.keys import session_key
from curveline.radio.protocol.service_frames import ReadingFrame
from curveline.radio.protocol.settings_frames import SettingsFrame, encode_settings
from curveline.radio.protocol.update_frames import (
    DESCRIPTION_PIECES,
    PIECE_BYTES,
    PIECES,
    SECTOR_ALL,
    SECTOR_NONE,
    UPDATE_TAG,
    ProgressFrame,
    UpdateFrame,
    UpdateOutcome,
    UpdatePlace,
    decode_progress,
    encode_update,
)
from curveline.radio.site.program_file import NodeProgram

TRIES = 20
UPDATED_FROM = 4
"""Firmware from which on a node may have a loader."""
RESTART_US = 8_000_000
"""So long a node may take to go to its loader or back: first it writes down its position."""
LOOK_US = 100_000
DEADMAN_MS = 1000
"""Of an offer that a program makes meanwhile, and that nobody takes up; a loader moves nothing."""
BEGINNINGS = 3
"""So often a program that the node finds to be another than was described is sent again from the beginning."""

Seen = Callable[[float], None]
"""Is told which part of the program the node has."""


@dataclass(frozen=True)
class ProgramUpdate:
    """A program for a node, and who is told how it goes."""

    program: NodeProgram
    older: bool = False  # whether it may be of an older firmware than the node has
    seen: Seen = ignore  # told which part of it the node has


@dataclass(frozen=True)
class Updated:
    """What became of an update."""

    was: int | None  # firmware before, None if the node waited in its loader
    firmware: int | None  # that answers now, None if it does not say
    frames: int  # that the program took

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return asdict(self)


class LoaderLink:
    """The session with the loader of one node."""

    def __init__(self, radio: Radio, drive: DriveSettings, number: int, seen: Seen = ignore) -> None:
        self.radio, self.drive = radio, drive
        self._peer = peer_of(radio, drive, number)
        self._seen = seen
        self._key, self._session, self._counter = b"", 0, 0
        self._progress: ProgressFrame | None = None
        self._heard_us = radio.now_us()
        self.frames = 0

    def greet(self) -> IdentFrame | None:
        """Ask the node who it is, and begin a session if that is its loader; None if it says nothing."""
        self._peer.nonce = fresh_nonce()
        ident = hello(self.radio, self._peer)
        if ident is not None and ident.state is NodeState.BOOT:
            handshake = self._peer.nonce & ~ATTEMPT_MASK
            self._key = session_key(self._peer.node_key, handshake, ident.nonce, UPDATE_TAG)
            self._session, self._counter, self._progress = ident.nonce.session, 0, None
            self._heard_us = self.radio.now_us()
        return ident

    @property
    def why_silent(self) -> Cause:
        """Why a greeting came to nothing."""
        return why_silent(self._peer)

    def send(self, program: NodeProgram) -> None:
        """Bring the program to the node, whatever it has of it already; LinkError if that does not succeed."""
        for _ in range(BEGINNINGS):
            self._describe(program.description(self._peer.node_key))
            while (sector := self._now().sector) < len(program.sectors):
                self._fill(sector, program.sectors[sector])
                self._seen((sector + 1) / len(program.sectors))
            if self._now().sector != SECTOR_ALL:
                continue
            outcome = self._order(UpdatePlace.FINISH).outcome
            if outcome is UpdateOutcome.DONE:
                return
        raise self._halted(Cause.UNFLASHED, "its flash does not hold the program")

    def leave(self) -> None:
        """Let the node start its program."""
        for _ in range(3):
            self._exchange(UpdateFrame(0, 0, UpdatePlace.LEAVE))

    def _describe(self, description: bytes) -> None:
        """Say what is to come; what the loader has of that already counts."""
        for _ in range(BEGINNINGS):
            while True:
                for piece in range(DESCRIPTION_PIECES):
                    data = description[PIECE_BYTES * piece : PIECE_BYTES * (piece + 1)]
                    self._exchange(UpdateFrame(0, 0, UpdatePlace.DESCRIPTION, piece, data))
                progress = self._order(UpdatePlace.ASK)
                if progress.sector == SECTOR_NONE and progress.held == (1 << DESCRIPTION_PIECES) - 1:
                    break
            progress = self._order(UpdatePlace.BEGIN)
            if progress.outcome is UpdateOutcome.DONE and progress.sector != SECTOR_NONE:
                return
            if progress.outcome is UpdateOutcome.REFUSED:
                raise self._halted(Cause.UNFLASHED, "its settings are not of the kind that this program reads")
        raise self._halted(Cause.UNFLASHED, "its flash does not take the description of the program")

    def _fill(self, sector: int, data: bytes) -> None:
        """One round: every piece of the sector that the node is not known to have, then a question."""
        for piece in range(PIECES):
            now = self._progress
            if now is not None and now.sector != sector:
                return
            if now is None or not now.held >> piece & 1:
                part = data[PIECE_BYTES * piece : PIECE_BYTES * (piece + 1)]
                self._exchange(UpdateFrame(0, 0, sector, piece, part))
        if self._order(UpdatePlace.ASK).outcome is UpdateOutcome.FLASH:
            raise self._halted(Cause.UNFLASHED, f"its flash does not hold sector {sector + 1} of the program")

    def _now(self) -> ProgressFrame:
        return self._progress or self._order(UpdatePlace.ASK)

    def _order(self, place: UpdatePlace) -> ProgressFrame:
        """Give an order, or only ask, until an answer says that it was carried out; LinkError if none comes."""
        first, self._heard_us = self._counter + 1, self.radio.now_us()
        while True:
            self._exchange(UpdateFrame(0, 0, place))
            self._exchange(UpdateFrame(0, 0, UpdatePlace.ASK))
            progress = self._progress
            if progress is not None and progress.echo >= first and place in (UpdatePlace.ASK, progress.last):
                return progress
            if self.radio.now_us() - self._heard_us > SILENCE_US:
                raise self._halted(Cause.SILENT, " any more")

    def _exchange(self, frame: UpdateFrame) -> None:
        peer = self._peer
        self._counter += 1
        self.frames += 1
        payload = encode_update(replace(frame, session=self._session, counter=self._counter), self._key)
        (answer,) = self.radio.exchange([(peer.address, payload)])
        peer.tally.count(answer.payload, answer.retries)
        progress = decode_progress(answer.payload or b"", self._key)
        if isinstance(progress, Reject) or progress.node != peer.number or progress.session != self._session:
            return
        self._heard_us = self.radio.now_us()
        if self._progress is None or progress.echo >= self._progress.echo:
            self._progress = progress

    def _halted(self, cause: Cause, detail: str) -> Halted:
        return halted(self.radio, self.drive, Halt(cause, self._peer.number, detail=detail))


class Departure(Errand):
    """The session in which a node is told to go to its loader."""

    checks_limits = False

    def go(self) -> None:
        """Order it; LinkError if the node refuses, or has no loader. It may be gone before it has said so."""
        self._order += 1
        for _ in range(TRIES):
            reading = self._told()
            if reading is None or reading.index != self._order:
                continue
            if reading.outcome is ErrandOutcome.BEYOND:
                raise self._halted(Halt(Cause.NO_LOADER, self._peer.number))
            if reading.outcome in WHY:
                raise self._halted(self._why_refused(reading.outcome))
            return

    def firmware(self) -> int | None:
        """Number of the program that answers now, None if it does not say."""
        found = ScannedNode(self._peer.number, self._peer.address)
        with suppress(RadioGone):
            scan_one(self._radio, found)
        return max((page.firmware for page in found.pages.values()), default=None)

    def _told(self) -> ReadingFrame | None:
        peer = self._peer
        peer.counter += 1
        frame = SettingsFrame(peer.clock, peer.session, peer.counter, SettingsOperation.LOADER, self._order)
        (answer,) = self._radio.exchange([(peer.address, encode_settings(frame, peer.key))])
        peer.tally.count(answer.payload, answer.retries)
        return peer.reading(answer.payload or b"")


def hello(radio: Radio, peer: Peer) -> IdentFrame | None:
    """Who a node is now, program or loader; None if it says nothing. It makes an offer that nobody need take up."""

    def read(payload: bytes) -> IdentFrame | Reject:
        return decode_ident(payload, peer.node_key, peer.nonce & ~ATTEMPT_MASK)

    return insist(radio, peer, HelloFrame(peer.number, peer.nonce, UPDATE_TAG, 0, DEADMAN_MS), read)


def update_node(radio: Radio, drive: DriveSettings, number: int, update: ProgramUpdate) -> Updated:
    """Replace the program of node `number`; LinkError if it cannot be, and then it can be tried again."""
    link = LoaderLink(radio, drive, number, update.seen)
    ident = link.greet()
    if ident is None:
        raise halted(radio, drive, Halt(link.why_silent, number))
    was = None
    if ident.state is not NodeState.BOOT:
        was = _depart(radio, drive, number, update)
        _await(link, Halt(Cause.NO_LOADER, number), loader=True)
    try:
        link.send(update.program)
    finally:
        link.leave()  # to the new program, or to the old one as long as nothing of it was erased
    _await(link, Halt(Cause.MUTE, number), loader=False)
    with begun(Departure(radio, drive, number)) as errand:  # a program that was never heard would not be started again
        firmware = errand.firmware()
    return Updated(was, firmware, link.frames)


def _depart(radio: Radio, drive: DriveSettings, number: int, update: ProgramUpdate) -> int | None:
    """Let a program go; its number. InvalidInput if that is above the number of the one that is to come."""
    with begun(Departure(radio, drive, number)) as errand:
        was = errand.firmware()
        if was is not None and was < UPDATED_FROM:
            raise halted(radio, drive, Halt(Cause.OLDER, number, detail=f"{was}, this needs {UPDATED_FROM}"))
        if was is not None and was > update.program.number and not update.older:
            message = f"node {number} has firmware {was}, and this program is an older one: {update.program.number}"
            raise InvalidInput(message, "add --older if it is to go back")
        errand.go()
    return was


def _await(link: LoaderLink, late: Halt, *, loader: bool) -> None:
    """Greet the node until its loader answers, or its program does."""
    end_us = link.radio.now_us() + RESTART_US
    while (ident := link.greet()) is None or (ident.state is NodeState.BOOT) is not loader:
        if link.radio.now_us() > end_us:
            raise halted(link.radio, link.drive, late)
        link.radio.sleep_until(link.radio.now_us() + LOOK_US)
