"""Whether a node's answers are its own: their tags, checked beside a host from the handshakes that pass by.

It holds the keys that the host has anyway, in its process, and gives none away.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from curveline.radio.protocol.codes import ATTEMPT_MASK, CLOCK_SHIFT, FrameKind, Reject
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.frames import decode_ident, decode_report, decode_status
from curveline.radio.protocol.keys import session_key
from curveline.radio.protocol.page_frames import decode_page
from curveline.radio.protocol.service_frames import decode_reading
from curveline.radio.protocol.update_frames import decode_progress

Value = TypeVar("Value")

RECENT = 3
"""Handshakes of one node that are remembered: an answer belongs to the question before, at the latest."""
GOOD, WRONG, UNKNOWN = "good", "wrong", "unknown"
"""A tag under the right key; under none that it should have; not to be told, as the handshake was before."""


@dataclass
class WitnessedNode:
    """What has passed to and from one node."""

    key: bytes = field(repr=False)
    greetings: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=RECENT))
    """Nonce without attempts, and run tag, of the last HELLOs."""
    questions: deque[int] = field(default_factory=lambda: deque(maxlen=RECENT))
    """Nonces without attempts of the last questions for a page."""
    offers: deque[tuple[int, bytes, int]] = field(default_factory=lambda: deque(maxlen=RECENT), repr=False)
    """Number and key of the last radio sessions, and when their clocks began [us]."""


class TagWitness:
    """`keys` are node keys by address; `now_us` is the radio's clock."""

    def __init__(self, keys: Mapping[str, bytes], now_us: Callable[[], int]) -> None:
        self._nodes = {address: WitnessedNode(key) for address, key in keys.items()}
        self._now_us = now_us

    def see(self, address: str, sent: bytes, answer: bytes | None) -> None:
        """A frame went to a node, and this came back: remember what handshakes say, which is all that it costs."""
        kind = sent[0] & 0xF
        if kind in (FrameKind.HELLO, FrameKind.PAGE) and (node := self._nodes.get(address)) is not None:
            nonce = int.from_bytes(sent[4:12], "little") & ~ATTEMPT_MASK
            if kind == FrameKind.PAGE:
                _remember(node.questions, nonce)
            else:
                _remember(node.greetings, (nonce, int.from_bytes(sent[12:20], "little")))
        if answer and answer[0] & 0xF == FrameKind.IDENT and (node := self._nodes.get(address)) is not None:
            self._take_offer(node, answer)

    def judge(self, address: str, answer: bytes) -> str:
        """Whether an answer has the tag that it must have: GOOD, WRONG or UNKNOWN."""
        node, kind = self._nodes.get(address), kind_of(answer)
        if node is None or isinstance(kind, Reject):
            return UNKNOWN
        greetings = [nonce for nonce, _ in node.greetings]
        if kind is FrameKind.PAGE:
            return _verdict([decode_page(answer, nonce) for nonce in node.questions])
        if kind is FrameKind.REPORT:
            return _verdict([decode_report(answer, node.key, nonce) for nonce in greetings])
        if kind is FrameKind.IDENT:
            return _verdict([decode_ident(answer, node.key, nonce) for nonce in greetings])
        session = int.from_bytes(answer[2:4], "little")
        keys = [(key, self._ticks_since(begin)) for number, key, begin in node.offers if number == session]
        if kind is FrameKind.STATUS:
            return _verdict([decode_status(answer, key, clock) for key, clock in keys])
        if kind is FrameKind.READING:
            return _verdict([decode_reading(answer, key, clock) for key, clock in keys])
        return _verdict([decode_progress(answer, key) for key, _ in keys] if kind is FrameKind.PROGRESS else [])

    def _take_offer(self, node: WitnessedNode, answer: bytes) -> None:
        for nonce, run_tag in node.greetings:
            ident = decode_ident(answer, node.key, nonce)
            if not isinstance(ident, Reject):
                begin_us = self._now_us() - (ident.clock << CLOCK_SHIFT) * 1000
                key = session_key(node.key, nonce, ident.nonce, run_tag)
                if all(key != known for _, known, _ in node.offers):
                    node.offers.append((ident.session, key, begin_us))

    def _ticks_since(self, begin_us: int) -> int:
        return max(0, (self._now_us() - begin_us) // 1000 >> CLOCK_SHIFT)


def _remember(recent: deque[Value], each: Value) -> None:
    if each not in recent:
        recent.append(each)


def _verdict(found: Sequence[object]) -> str:
    if not found:
        return UNKNOWN
    return GOOD if any(not isinstance(each, Reject) for each in found) else WRONG
