"""Giving a node other settings in two phases, so that it can be broken off anywhere and begun again.

It is looked for where it is to be first, then where it was. On trial it is told to keep its settings by whoever reaches
it under them; nobody else can. Whatever happens, it is under the old or the new ones half a minute later.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

from curveline.drive_settings import DriveSettings
from curveline.radio.host.errands import begun
from curveline.radio.host.link import Halted
from curveline.radio.host.peer import Peer
from curveline.radio.host.queries import fresh_nonce, insist
from curveline.radio.host.scan import ScannedNode, explain, scan_one
from curveline.radio.host.settings_errand import SettingsErrand
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.interface import Radio
from curveline.radio.protocol.codes import FLAG_QUERY
from curveline.radio.protocol.frames import HelloFrame, ReportFrame, decode_report
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import Axes
from curveline.radio.protocol.node_settings import GENERATIONS, NodeSettings, node_settings
from curveline.radio.protocol.settings_frames import TRIAL_MS, SettingsFacts

TRIES = 3
"""How often a node is told to try its settings, if it does not hear that."""
ROUNDS = 12
"""How often a session is begun anew that broke off."""
LOOKS = 2
START_US = 1_000_000
"""A node that starts anew is not heard for half a second: it is looked for once more after this."""
BACK_S = TRIAL_MS / 1000.0 + 5.0
"""After this a node whose trial nobody ended is back where it was."""
PASSING = frozenset({Cause.SILENT, Cause.UNTRUSTED, Cause.TAKEN, Cause.BUSY, Cause.REFUSED})
"""What may be over when a node is looked for once more."""


@dataclass(frozen=True)
class NodeSeat:
    """Where a node listens, and with whose key: number `number` (from 1) of a display, keys and chips of a site."""

    drive: DriveSettings
    site: Site
    number: int

    @property
    def address(self) -> str:
        """On which it listens, in capitals."""
        return self.drive.addresses[self.number - 1].upper()

    def listens_as(self, other: NodeSeat) -> bool:
        """Whether both are one place on the air."""
        return self._ear == other._ear

    def is_reached_as(self, other: NodeSeat) -> bool:
        """Whether a host finds both in the same way."""
        return self._ear == other._ear and self._name == other._name

    @property
    def settings(self) -> NodeSettings:
        """What a node there is to hold."""
        return node_settings(self.site.master, self.drive, self.number)

    @property
    def _ear(self) -> tuple[int, str, str]:
        return self.drive.channel, self.drive.data_rate, self.address

    @property
    def _name(self) -> tuple[int, bytes]:
        return self.number, self.site.node_key(self.number)


class Tuner(Protocol):
    """Whoever has the radio, and can have it send elsewhere."""

    def radio(self, seat: NodeSeat) -> Radio:
        """The radio, sending to a node where it listens."""
        ...

    def now_s(self) -> float:
        """Time that only grows, whatever the radio does."""
        ...


@dataclass(frozen=True)
class NodeFound:
    """A node that was looked for: where it was, what it runs under, its limits, and what it says of itself."""

    seat: NodeSeat
    standing: SettingsFacts
    axes: Axes
    report: ReportFrame


class Resettling:
    """One node on its way from an old seat to a new one; `told` hears what is done."""

    def __init__(self, tuner: Tuner, new: NodeSeat, old: NodeSeat, told: Callable[[str], None]) -> None:
        self.new = new
        self.old = old
        self.may_be_on_trial = False
        """Whether the node may be under its new settings without having been told to keep them."""
        self._tuner = tuner
        self._told = told
        self._tried_s: float | None = None
        self._tries = 0
        self._last: Halt | None = None

    def find(self) -> NodeFound:
        """The node, where it is to be or where it was; LinkError, with the best reason that there is, if in neither."""
        seats = [self.new] if self.new.is_reached_as(self.old) else [self.new, self.old]
        for look in range(LOOKS):
            if look:
                radio = self._tuner.radio(seats[0])
                radio.sleep_until(radio.now_us() + START_US)
            for seat in seats:
                if (found := self._look(seat)) is not None:
                    return found
        raise Halted(self._why_nowhere())

    def check_places(self, found: NodeFound) -> None:
        """LinkError if somebody else answers where the node is, or is to be."""
        own = self.new.site.chips[self.new.number - 1]
        for seat in {id(each): each for each in (found.seat, self.new)}.values():
            others = [f"{chip:08x}" for chip in sorted(self._pages(seat)) if chip != own]
            if others and seat.listens_as(found.seat):
                raise Halted(Halt(Cause.TWIN, self.new.number, detail=f"chips {own:08x} and {' and '.join(others)}"))
            if others:
                raise Halted(Halt(Cause.TAKEN_PLACE, self.new.number, detail=f"chip {' and '.join(others)}"))

    def carry_out(self) -> NodeFound:
        """Bring the node to its new settings, however far somebody has come with that before; the node then."""
        self._tries = 0
        for _ in range(ROUNDS):
            found = self._found_again()
            try:
                if self.is_settled(found):
                    self.may_be_on_trial = False
                    return found
                if found.standing.on_trial:
                    self._end_trial(found)
                elif self._tries == TRIES or self._has_come_back(found):
                    self.may_be_on_trial = False
                    raise Halted(Halt(Cause.UNHEARD, self.new.number))
                else:
                    self._try(found)
            except Halted as error:
                if error.halt.cause not in PASSING:
                    raise
                self._last = error.halt
        raise Halted(self._last or Halt(Cause.UNHEARD, self.new.number))

    def is_settled(self, found: NodeFound) -> bool:
        """Whether the node runs under the new settings for good."""
        return self.is_as_wanted(found) and not found.standing.on_trial

    def is_as_wanted(self, found: NodeFound) -> bool:
        """Whether it runs under the new settings, if only on trial."""
        return found.seat is self.new and found.axes == self.new.settings.axes

    def _has_come_back(self, found: NodeFound) -> bool:
        """Whether it has tried its new settings in vain; what is stored and not tried was never begun."""
        return self._tried_s is not None and found.standing.stored == found.standing.generation

    def _end_trial(self, found: NodeFound) -> None:
        """Settings on trial are kept if they are the wanted ones, else dropped."""
        with self._claimed(found.seat) as errand:
            if self.is_as_wanted(found):
                self._told("it answers under its new settings, and is told to keep them")
                errand.keep()
            else:
                self._told("it tries other settings than these, and is told to drop them")
                errand.drop()

    def _try(self, found: NodeFound) -> None:
        """Store and try: from here on the node may be on trial."""
        with self._claimed(found.seat) as errand:
            generation = (found.standing.generation + 1) % GENERATIONS
            errand.store(replace(self.new.settings, generation=generation))
            self._told("it has stored its new settings, and tries them")
            self.may_be_on_trial = True
            self._tries += 1
            self._tried_s = self._tuner.now_s()
            errand.attempt()

    def _claimed(self, seat: NodeSeat) -> AbstractContextManager[SettingsErrand]:
        return begun(SettingsErrand(self._tuner.radio(seat), seat.drive, seat.number))

    def _found_again(self) -> NodeFound:
        """As `find`, as long as a trial may last; on a trial it is best looked for where it is to be."""
        while True:
            try:
                return self.find()
            except Halted as error:
                tried_s = self._tried_s
                if tried_s is None or self._tuner.now_s() - tried_s > BACK_S or error.halt.cause is not Cause.STRAYED:
                    raise

    def _look(self, seat: NodeSeat) -> NodeFound | None:
        radio = self._tuner.radio(seat)
        report = asked(radio, seat)
        if report is None:
            return None
        if report.turning:  # a session that ends would end its homing
            raise Halted(Halt(Cause.REFUSED, self.new.number, detail="its motors turn"))
        try:
            with self._claimed(seat) as errand:
                return NodeFound(seat, errand.standing(), errand.axes(), report)
        except Halted as error:
            if error.halt.cause not in PASSING or self._tried_s is None:
                raise
            self._last = error.halt
            return None

    def _pages(self, seat: NodeSeat) -> set[int]:
        found = ScannedNode(seat.number, seat.address)
        scan_one(self._tuner.radio(seat), found)
        return set(found.pages)

    def _why_nowhere(self) -> Halt:
        """The best reason why a node is not found: what is wrong where it was, if anybody answers there."""
        radio, old = self._tuner.radio(self.old), self.old
        scanned = ScannedNode(old.number, old.address)
        scan_one(radio, scanned)
        if scanned.link.answered:
            told = explain(radio, old.drive, Halt(Cause.UNTRUSTED, old.number))
            if self._tried_s is None:
                return replace(told, node=self.new.number)
        where = [f"{each.address} on channel {each.drive.channel}, {each.drive.data_rate}" for each in (self.new, old)]
        return Halt(Cause.STRAYED, self.new.number, detail=" or ".join(dict.fromkeys(where)))


def asked(radio: Radio, seat: NodeSeat) -> ReportFrame | None:
    """What a node says of itself to its key, None if nobody answers to that; it disturbs no run."""
    nonce = fresh_nonce()
    peer = Peer(seat.number, seat.address, seat.site.node_key(seat.number), nonce)
    read = partial(decode_report, key=peer.node_key, nonce=nonce)
    return insist(radio, peer, HelloFrame(seat.number, nonce, 0, 0, 0, FLAG_QUERY), read)
