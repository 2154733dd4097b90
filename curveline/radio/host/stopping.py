"""Stopping a display whoever drives it: STOP to every node until each has said under its key that it stands.

A radio is no safety circuit: what must stop for certain needs a switch in the motors' supply.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field

from curveline.drive_settings import DriveSettings
from curveline.radio.host.peer import LinkTally, Peer
from curveline.radio.interface import BATCH, Answer, Radio
from curveline.radio.protocol.codes import ATTEMPT_MASK, FLAG_QUERY, NodeState, plain_name
from curveline.radio.protocol.frames import HelloFrame, ReportFrame, StopFrame, decode_report, encode_stop
from curveline.radio.site.key_file import UNKNOWN_CHIP

LIMIT_US = 10_000_000
"""Longer than any brake takes: a node that still moves then does not obey."""
SILENT_POLLS = 40
PAUSE_US = 2000
PURPOSE = 1


@dataclass
class Stopped:
    """What is known of one node; `state` is None if it never said anything that can be trusted.

    `is_sure` is whether it has said under its key that a STOP holds it and that no motor turns.
    """

    node: int  # number from 1
    address: str  # 5 bytes, hexadecimal
    state: NodeState | None = None
    link: LinkTally = field(default_factory=LinkTally)  # polls and losses

    is_sure: bool = False

    @property
    def state_name(self) -> str | None:
        """The state in words."""
        return plain_name(self.state) if self.state is not None else None


def stop_all(radio: Radio, drive: DriveSettings) -> list[Stopped]:
    """Send STOP to every node until each has confirmed it, or is silent, or 10 s have passed."""
    stop = encode_stop(StopFrame(PURPOSE), radio.site.stop_key)
    asked = [_StopTalk(radio, number, address) for number, address in enumerate(drive.addresses, start=1)]
    for begin in range(0, len(asked), BATCH):  # all are told before the first is asked
        radio.exchange([(each.found.address, stop) for each in asked[begin : begin + BATCH]])
    end_us = radio.now_us() + LIMIT_US
    while (left := [each for each in asked if not each.is_done]) and radio.now_us() < end_us:
        for each in left:
            each.turn(radio, stop)
        radio.sleep_until(radio.now_us() + PAUSE_US)
    return [each.found for each in asked]


class _StopTalk:
    """The conversation with one node."""

    def __init__(self, radio: Radio, number: int, address: str) -> None:
        self.found = Stopped(number, address)
        self._is_known = radio.site.chips[number - 1] != UNKNOWN_CHIP
        self._nonce = secrets.randbits(64) & ~ATTEMPT_MASK
        self._peer = Peer(number, address, radio.site.node_key(number), self._nonce, tally=self.found.link)

    @property
    def is_done(self) -> bool:
        """Whether nothing more is to be expected: it stands, it is silent, or nobody knows its key."""
        is_mute = not self.found.link.answered or not self._is_known
        return self.found.is_sure or (is_mute and self.found.link.polls >= SILENT_POLLS)

    def turn(self, radio: Radio, stop: bytes) -> None:
        """STOP once more, and two questions: the first is answered with the second."""
        question = HelloFrame(self.found.node, self._nonce, 0, 0, 0, FLAG_QUERY)
        frames = [stop, self._peer.hello(question), self._peer.hello(question)]
        answers = radio.exchange([(self.found.address, frame) for frame in frames])
        for answer in answers:
            self._note(answer)

    def _note(self, answer: Answer) -> None:
        self.found.link.count(answer.payload, answer.retries)
        report = decode_report(answer.payload or b"", self._peer.node_key, self._nonce)
        if isinstance(report, ReportFrame):
            self.found.state = report.state
            rests = report.stopped or report.state is NodeState.BOOT  # a loader turns no motor
            self.found.is_sure = rests and not report.turning
