"""How well a node is heard: polls that move nothing, at each power of the radio in turn, and what their losses mean."""

from __future__ import annotations

import csv
import io
import json
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import DriveSettings
from curveline.errors import InvalidInput
from curveline.notebook import html_of, svg_of
from curveline.radio.host.actions import Policy
from curveline.radio.host.link import Halted
from curveline.radio.host.polling import CYCLES
from curveline.radio.host.scan import ScannedNode, problems, scan_one
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.interface import Answer, Radio
from curveline.radio.measuring.carriers import share_between
from curveline.radio.protocol.band import FULL_POWER, POWERS_DBM
from curveline.radio.protocol.codes import ATTEMPT_MASK, EVERY_NODE
from curveline.radio.protocol.page_frames import AskFrame, encode_ask

SLOT_US = 1_000_000
"""How long a node is polled at one power before it is the next one's turn."""
POLL_US = 10_000
"""Between two polls; those of a run come half as often."""
MOST_LOSS = 0.1
"""Polls that may be lost: ten in a row, after which a node may count as lost, then come once in 10^10 polls, if losses
know nothing of each other; at 50 polls a second that is once in six years."""
MOST_SILENCE_S = Policy().probe_ms / 1000.0
"""After which a run doubts a node."""
POWERS = tuple(reversed(POWERS_DBM))
"""The strongest first."""


@dataclass(frozen=True)
class LevelSlot:
    """What became of the polls of a second or so at one power."""

    at: float  # when its middle was [s]
    polls: int  # sent
    lost: int  # without an answer
    retries: int  # packets sent again


@dataclass(frozen=True)
class LevelResult:
    """How well a node was heard while the radio sent with one power."""

    level: str  # min, low, high or max
    slots: tuple[LevelSlot, ...]  # in order of time
    misses: dict[int, int]  # polls lost in a row -> how often that happened
    silence: float  # the longest time without an answer [s]

    @property
    def dbm(self) -> int:
        """The power [dBm]."""
        return POWERS_DBM[self.level]

    @property
    def polls(self) -> int:
        """Polls sent."""
        return sum(each.polls for each in self.slots)

    @property
    def lost(self) -> int:
        """Polls that were not answered, with all that the chip repeats by itself."""
        return sum(each.lost for each in self.slots)

    @property
    def retries(self) -> int:
        """Packets that the chip sent again."""
        return sum(each.retries for each in self.slots)

    @property
    def loss(self) -> float:
        """The part of the polls that was lost."""
        return self.lost / self.polls

    @property
    def between(self) -> tuple[float, float]:
        """The ends of the interval of 95 % for the loss."""
        return share_between(self.lost, self.polls)

    @property
    def failed_between(self) -> tuple[float, float]:
        """The same for packets, there and back, each attempt of the chip for itself."""
        return share_between(self.lost + self.retries, self.polls + self.retries)

    @property
    def longest(self) -> int:
        """Most polls that were lost in a row."""
        return max(self.misses, default=0)

    @property
    def is_good(self) -> bool:
        """Whether runs can be sent: few losses, as far as these polls can tell, and none for long."""
        return self.between[1] <= MOST_LOSS and self.longest < CYCLES and self.silence < MOST_SILENCE_S

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        low, high = self.between
        numbers = {"polls": self.polls, "lost": self.lost, "retries": self.retries}
        return {
            "level": self.level,
            "dbm": self.dbm,
            **numbers,
            "loss": self.loss,
            "low": low,
            "high": high,
            "good": self.is_good,
            "longest_run": self.longest,
            "longest_silence": self.silence,
            "runs": {str(length): count for length, count in sorted(self.misses.items())},
            "slots": [asdict(each) for each in self.slots],
        }


@dataclass(frozen=True)
class RangeTest:
    """How well one node was heard, power by power."""

    spec: str  # of the radio
    drive: DriveSettings  # the display as nodes see it
    node: int  # in the row, from 1
    seconds: float  # for how long [s]
    levels: tuple[LevelResult, ...]  # the strongest first
    wrong: tuple[str, ...]  # what is wrong with who answers, in sentences

    @property
    def is_well(self) -> bool:
        """Whether runs can be sent with the strongest power that was tried; they are sent with the most there is."""
        return self.levels[0].is_good and not self.wrong

    @property
    def spare_db(self) -> int:
        """By how much weaker the radio may send, as far as that was tried [dB]."""
        spare = 0
        for each in self.levels:
            if not each.is_good:
                break
            spare = self.levels[0].dbm - each.dbm
        return spare

    @property
    def depends_on_power(self) -> bool:
        """Whether more is lost with the least power than with the most, beyond chance; of one power, taken for so."""
        first, last = self.levels[0].failed_between, self.levels[-1].failed_between
        return len(self.levels) == 1 or last[0] > first[1]

    def advice(self) -> Iterator[str]:
        """What it means, and what to do about it, in sentences."""
        yield from self.wrong
        first = self.levels[0]
        if first.is_good:
            yield f"good enough for runs at {first.dbm} dBm: at most {first.between[1]:.1%} of the polls are lost"
            yield from self._spare()
            if first.failed_between[0] > MOST_LOSS and not self.depends_on_power:
                share = (first.lost + first.retries) / (first.polls + first.retries)
                yield f"but {share:.0%} of all packets are lost, whatever the power: see `curveline radio scan`"
            return
        yield f"not good enough for runs at {first.dbm} dBm: {self._why(first)}"
        if not first.lost and first.silence < MOST_SILENCE_S:
            return  # all that was asked was answered: there is nothing to look for
        yield (
            "look at the supply of both radios first: 10 uF or more right at the pins of each; then at the antennas, "
            "and at what stands between them"
        )
        if not self.depends_on_power:
            yield "less power made no difference, so it is noise or a supply rather than the distance"
        yield (
            "`curveline radio scan` says whether the channel is noisy; 250kbps as `data_rate` reaches farthest; the "
            "node answers with the power of its firmware, which is full"
        )

    def _why(self, level: LevelResult) -> str:
        if level.longest >= CYCLES:
            return f"{level.longest} polls in a row were lost, and after {CYCLES} a node may count as lost"
        if level.silence >= MOST_SILENCE_S:
            return f"nothing was heard for {level.silence:.1f} s, and a run doubts a node after {MOST_SILENCE_S:g} s"
        if level.between[0] <= MOST_LOSS:
            return f"{level.between[1]:.0%} of the polls may be lost, {MOST_LOSS:.0%} are enough: measure for longer"
        return f"{level.loss:.0%} of the polls are lost, {MOST_LOSS:.0%} are the most"

    def _spare(self) -> Iterator[str]:
        if len(self.levels) == 1:
            return
        least = self.levels[-1]
        if self.spare_db == self.levels[0].dbm - least.dbm:
            yield f"so it is with {self.spare_db} dB less: there is much to spare from the host to the node"
        elif self.spare_db:
            yield f"with {self.spare_db} dB less it still is, with more than that not"
        else:
            yield "with less power it is not: little is to spare; a node that stands a little farther may be lost"

    def _repr_html_(self) -> str:
        rows = [
            (each.level, each.dbm, each.polls, f"{each.loss:.1%}", f"{each.between[1]:.1%}", each.retries, each.longest)
            for each in self.levels
        ]
        head = ("power", "dBm", "polls", "lost", "at most", "repeats", "in a row")
        title = f"node {self.node} of display {self.drive.display} over {self.spec}"
        svg = svg_of("curveline.figures.reach:draw", self)
        return html_of(title, [head, *rows], svg, remarks=tuple(self.advice()))

    def document(self) -> dict[str, Any]:
        """The result as plain data."""
        return {
            "curveline": __version__,
            "display": self.drive.display,
            "radio": self.spec,
            "node": self.node,
            "seconds": self.seconds,
            "well": self.is_well,
            "spare_db": self.spare_db,
            "levels": [each.document() for each in self.levels],
            "problems": list(self.wrong),
        }


@dataclass
class _Tally:
    """What is counted at one power while it is measured."""

    level: str
    slots: list[LevelSlot] = field(default_factory=list)
    misses: dict[int, int] = field(default_factory=dict)
    silence_us: int = 0

    def missed(self, count: int) -> None:
        """A row of losses has ended."""
        if count:
            self.misses[count] = self.misses.get(count, 0) + 1

    def result(self) -> LevelResult:
        """What was found."""
        return LevelResult(self.level, tuple(self.slots), self.misses, self.silence_us / 1e6)


def checked_levels(levels: Sequence[str]) -> tuple[str, ...]:
    """The powers to try, the strongest first, all of them if none is named; InvalidInput for one that there is not."""
    if unknown := [each for each in levels if each not in POWERS_DBM]:
        raise InvalidInput(f"there is no power {unknown[0]!r}", f"there are {', '.join(POWERS_DBM)}")
    return tuple(each for each in POWERS if not levels or each in levels)


def measure_reach(radio: Radio, spec: str, drive: DriveSettings, number: int, wish: RangeWish) -> RangeTest:
    """Poll node `number` of a display (from 1) as `wish` says; the radio sends with full power again in any case.

    LinkError if the node does not answer at all, or the radio cannot send with less power.
    """
    drive.check_node(number)
    found = ScannedNode(number, drive.addresses[number - 1])
    scan_one(radio, found)
    if not found.link.answered:
        raise Halted(Halt(Cause.SILENT, number))
    wrong = problems(found, radio.site.chips[number - 1], drive)
    tallies = [_Tally(level) for level in checked_levels(wish.levels)]
    with _restored(radio, tallies):
        _measure(radio, found.address, tallies, wish.seconds)
    return RangeTest(spec, drive, number, wish.seconds, tuple(each.result() for each in tallies), tuple(wrong))


@dataclass(frozen=True)
class RangeWish:
    """How a node is to be polled."""

    seconds: float = 60.0  # for how long, all powers together [s]
    levels: tuple[str, ...] = ()  # powers, all of them if empty


@contextmanager
def _restored(radio: Radio, tallies: Sequence[_Tally]) -> Iterator[None]:
    """Full power again at the end; a radio that is never told another one need not be able to."""
    try:
        yield
    finally:
        if any(each.level != FULL_POWER for each in tallies):
            radio.set_power(FULL_POWER)


def _measure(radio: Radio, address: str, tallies: Sequence[_Tally], seconds: float) -> None:
    """All powers in turn, for a second each, until time is up; at the end each has had as many turns."""
    begin_us = radio.now_us()
    rounds = max(1, round(1e6 * seconds / (len(tallies) * SLOT_US)))
    slot_us = round(1e6 * seconds / (len(tallies) * rounds))
    for turn in range(rounds * len(tallies)):
        tally = tallies[turn % len(tallies)]
        if len(tallies) > 1 or tally.level != FULL_POWER:
            radio.set_power(tally.level)
        _poll(radio, address, tally, (begin_us, begin_us + (turn + 1) * slot_us))


def _poll(radio: Radio, address: str, tally: _Tally, ends_us: tuple[int, int]) -> None:
    """One turn of one power, which ends at a moment but has a poll at least."""
    nonce, attempt = secrets.randbits(64) & ~ATTEMPT_MASK, 0
    first_us = heard_us = due_us = radio.now_us()
    lost = retries = row = 0
    while not attempt or radio.now_us() < ends_us[1]:
        answer = _ask(radio, address, nonce | attempt & ATTEMPT_MASK)
        attempt += 1
        retries += answer.retries
        if answer.payload is None:
            lost, row = lost + 1, row + 1
        else:
            tally.missed(row)
            row, heard_us = 0, _heard(radio, tally, heard_us)
        due_us = max(due_us + POLL_US, radio.now_us())
        radio.sleep_until(due_us)
    tally.missed(row)
    _heard(radio, tally, heard_us)
    middle = ((first_us + radio.now_us()) / 2 - ends_us[0]) / 1e6
    tally.slots.append(LevelSlot(middle, attempt, lost, retries))


def _ask(radio: Radio, address: str, nonce: int) -> Answer:
    (answer,) = radio.exchange([(address, encode_ask(AskFrame(EVERY_NODE, nonce)))])
    return answer


def _heard(radio: Radio, tally: _Tally, since_us: int) -> int:
    """The node is heard now, after a silence; the moment."""
    now_us = radio.now_us()
    tally.silence_us = max(tally.silence_us, now_us - since_us)
    return now_us


def to_json(found: RangeTest) -> bytes:
    """All of it, as a file."""
    return (json.dumps(found.document(), indent=2) + "\n").encode()


def to_csv(found: RangeTest) -> bytes:
    """A row for each turn of each power."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("level", "dbm", "at_s", "polls", "lost", "retries"))
    for level in found.levels:
        writer.writerows(
            (level.level, level.dbm, f"{each.at:.3f}", each.polls, each.lost, each.retries) for each in level.slots
        )
    return stream.getvalue().encode()
