"""What a host has one node do that is being tried out: blink, jog an axis, turn a motor without a loop, take a place.

The session's dead-man time is short, and every frame says again what is under way: when this host falls silent, however
that comes, the node stops.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from typing import TypeVar

from curveline.drive_settings import DriveSettings
from curveline.radio.host.link import Halted
from curveline.radio.host.peer import NO_LOAD
from curveline.radio.host.scan import TRIED_OUT_FROM, ScannedNode, scan_one
from curveline.radio.host.service import SILENCE_US, Claim
from curveline.radio.host.stop_causes import Cause, Halt, fault_halt
from curveline.radio.interface import Radio, RadioGone
from curveline.radio.protocol.codes import (
    READING_SAMPLES,
    TRACE_SAMPLES,
    ErrandOutcome,
    Fault,
    NodeState,
    ReadingPage,
    ServiceOperation,
)
from curveline.radio.protocol.frames import StatusFrame
from curveline.radio.protocol.service_frames import (
    AxisFacts,
    LimitFacts,
    MotorFacts,
    ReadingFrame,
    ServiceFrame,
    axis_in,
    limits_in,
    motors_in,
    samples_in,
)

DEADMAN_MS = 250
STEP_US = 10_000
"""Between two frames: a quarter of a second of silence then takes two dozen lost ones."""
DEAF_ANSWERS = 40
"""Answers that are no READING, after which a node is taken for one that knows none."""

WHY = {
    ErrandOutcome.HELD: "it is held or stopped",
    ErrandOutcome.UNHOMED: "that axis is not homed",
    ErrandOutcome.BEYOND: "that is beyond what it is allowed",
    ErrandOutcome.FAULTY: "it is in fault",
    ErrandOutcome.OCCUPIED: "it has something else to do",
    ErrandOutcome.DEADMAN: "its dead-man time is too long for that",
}
"""Outcome -> why an order was refused."""

Viewer = Callable[[MotorFacts], None]


@dataclass(frozen=True)
class TurnResult:
    """What a turn without a loop came to."""

    gone: tuple[int, int, int]  # counts that each encoder gave
    facts: AxisFacts  # of the turned axis, afterwards
    least_mv: int  # lowest supply that was seen, 0 if the chip cannot tell
    driver_fault: bool  # the drivers reported a fault meanwhile
    samples: tuple[int, ...]  # counts of the turned axis, 4 ms apart


class Errand(Claim):
    """The session of one node that is being tried out."""

    deadman_ms = DEADMAN_MS
    needs = TRIED_OUT_FROM
    """Firmware from which on a node knows what it is asked here."""

    def __init__(self, radio: Radio, drive: DriveSettings, number: int) -> None:
        super().__init__(radio, drive, number)
        self._order = 0
        self._strange = 0

    def motors(self) -> MotorFacts:
        """Encoder counts, switches, supply."""
        return motors_in(self._look(ServiceFrame(0, 0, 0)).facts)

    def axis(self, axis: int) -> AxisFacts:
        """What there is to say of an axis (from 1)."""
        return axis_in(self._look(ServiceFrame(0, 0, 0, axis=axis, page=ReadingPage.AXIS)).facts)

    def limits(self, axis: int) -> LimitFacts:
        """The limits that the node holds of an axis (from 1)."""
        return limits_in(self._look(ServiceFrame(0, 0, 0, axis=axis, page=ReadingPage.LIMITS)).facts)

    def samples(self, count: int) -> tuple[int, ...]:
        """The first counts of the last turn, 4 ms apart."""
        found: list[int] = []
        for first in range(0, min(count, TRACE_SAMPLES), READING_SAMPLES):
            found += samples_in(self._look(ServiceFrame(0, 0, 0, page=ReadingPage.TRACE, rate=first)).facts)
        return tuple(found[:count])

    def blink(self, seconds: float) -> None:
        """Let the node's lamp flicker for so long."""
        end_us = self._radio.now_us() + round(1e6 * seconds)
        while self._radio.now_us() < end_us:
            self._look(ServiceFrame(0, 0, 0, ServiceOperation.BLINK))
            self._wait()

    def rest(self, seconds: float) -> None:
        """Stay with the node for so long, and let it do nothing."""
        end_us = self._radio.now_us() + round(1e6 * seconds)
        while self._radio.now_us() < end_us:
            self._look(ServiceFrame(0, 0, 0))
            self._wait()

    def jog(self, wanted: ServiceFrame, viewer: Viewer) -> tuple[int, AxisFacts]:
        """Move an axis by `wanted.amount`; the counts that it has gone, and what is to be said of it.

        LinkError if it is refused, or does not come to its end.
        """
        index = wanted.axis - 1
        begin = self.motors().counts[index]
        outcome = self._do(replace(wanted, operation=ServiceOperation.JOG), viewer)
        gone = self.motors().counts[index] - begin
        if outcome is not ErrandOutcome.DONE:
            raise self._halted(self._why_short(outcome, gone))
        return gone, self.axis(wanted.axis)

    def turn(self, wanted: ServiceFrame) -> TurnResult:
        """Turn a motor without a loop; LinkError if it is refused or broken off."""
        begin, supplies, lines = self.motors().counts, [], 0

        def view(facts: MotorFacts) -> None:
            nonlocal lines
            lines |= facts.lines
            supplies.append(facts.supply_mv)

        outcome = self._do(replace(wanted, operation=ServiceOperation.TURN), view)
        if outcome is not ErrandOutcome.DONE:
            raise self._halted(self._why_short(outcome, 0))
        end, facts = self.motors().counts, self.axis(wanted.axis)
        x, y, z = (now - then for now, then in zip(end, begin, strict=True))
        samples = self.samples(facts.samples)
        return TurnResult((x, y, z), facts, min(supplies, default=0), bool(lines & 8), samples)

    def place(self, axis: int, counts: int) -> None:
        """Let the node take the place where an axis (from 1) stands for `counts`."""
        self._do(ServiceFrame(0, 0, 0, ServiceOperation.PLACE, axis=axis, amount=counts), lambda facts: None)

    def _do(self, wanted: ServiceFrame, viewer: Viewer) -> ErrandOutcome:
        """Give an order and say it again until it has come to an end; LinkError if it is refused."""
        self._order += 1
        frame = replace(wanted, order=self._order, page=ReadingPage.MOTORS)
        while True:
            reading = self._look(frame)
            viewer(motors_in(reading.facts))
            if reading.index == self._order and reading.outcome in WHY:
                raise self._halted(self._why_refused(reading.outcome))
            if reading.index == self._order and reading.outcome is not ErrandOutcome.BUSY:
                return reading.outcome
            self._wait()

    def _look(self, wanted: ServiceFrame) -> ReadingFrame:
        """Ask until the page that is wanted is the answer to one of these questions."""
        peer = self._peer
        mark, self._heard_us = peer.counter + 1, self._radio.now_us()
        while True:
            reading = self._ask(wanted)
            if reading is not None and reading.echo >= mark and _is_wanted(reading, wanted):
                return reading
            if self._strange > DEAF_ANSWERS:
                raise self._halted(self._older())
            if self._radio.now_us() - self._heard_us > SILENCE_US:
                raise self._halted(Halt(Cause.SILENT, peer.number, detail=" any more"))

    def _ask(self, wanted: ServiceFrame) -> ReadingFrame | None:
        return self._reading_for(self._peer.service(wanted))

    def _reading_for(self, sent: bytes) -> ReadingFrame | None:
        """Send a frame; the READING that came with its acknowledgement, if one did."""
        peer = self._peer
        (answer,) = self._radio.exchange([(peer.address, sent)])
        peer.tally.count(answer.payload, answer.retries)
        payload = answer.payload or b""
        reading = peer.reading(payload)
        if reading is not None:
            self._heard_us, self._strange = self._radio.now_us(), 0
            return reading
        status = self._heard(payload)
        if status is not None:
            self._strange += 1
        return None

    def _wait(self) -> None:
        self._radio.sleep_until(self._radio.now_us() + STEP_US)

    def _why_refused(self, outcome: ErrandOutcome) -> Halt:
        number = self._peer.number
        if outcome is ErrandOutcome.HELD and self._status().state is NodeState.ESTOP:
            return Halt(Cause.LATCHED, number)
        return Halt(Cause.REFUSED, number, detail=WHY[outcome])

    def _status(self) -> StatusFrame:
        return self._until(lambda status: True, lambda: self._peer.drive(0, 0, NO_LOAD))

    def _why_short(self, outcome: ErrandOutcome, gone: int) -> Halt:
        """Why an order did not come to its end."""
        number = self._peer.number
        if outcome is ErrandOutcome.FAILED:
            status = self._status()
            if status.fault is not Fault.NONE:
                return fault_halt(status.fault, status.fault_axis, number, 0)
        return Halt(Cause.CUT_SHORT, number, detail=f"it was held, or heard nothing for a moment, after {gone} counts")

    def _older(self) -> Halt:
        """A node that answers, but not to what it is asked: most likely its firmware is older."""
        number = self._peer.number
        found = ScannedNode(number, self._peer.address)
        with suppress(RadioGone):
            scan_one(self._radio, found)
        firmware = [page.firmware for page in found.pages.values() if page.firmware < self.needs]
        if firmware:
            return Halt(Cause.OLDER, number, detail=f"{firmware[0]}, this release needs {self.needs}")
        return Halt(Cause.TAKEN, number)


def _is_wanted(reading: ReadingFrame, wanted: ServiceFrame) -> bool:
    """Whether it is the page that was asked for, and of a trace the part."""
    is_part = wanted.page is not ReadingPage.TRACE or reading.index == wanted.rate
    return reading.page is wanted.page and is_part


class Inquiry(Errand):
    """The session of one node that is asked what it holds, whatever that is; nothing moves by it."""

    checks_limits = False


SomeErrand = TypeVar("SomeErrand", bound=Errand)


def tried(radio: Radio, drive: DriveSettings, number: int) -> AbstractContextManager[Errand]:
    """A node that is tried out for as long as this lasts."""
    return begun(Errand(radio, drive, number))


@contextmanager
def begun(errand: SomeErrand) -> Iterator[SomeErrand]:
    """A node's session for as long as this lasts; it is given back and stands still afterwards, however it ends."""
    errand.begin(0)
    try:
        yield errand
    finally:
        with suppress(Halted):
            errand.give_back()
