"""Who is on the air: every address of a display asked many times, without keys, and what the answers give away.

Nothing in a PAGE is evidence; it is good for learning chip ids, finding two devices on one address, and for faults that
keep a node from answering under its key.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from curveline.drive_settings import DriveSettings
from curveline.radio.host.peer import LinkTally, Peer
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.interface import BATCH, Answer, Radio, RadioGone
from curveline.radio.protocol.codes import (
    ATTEMPT_MASK,
    BODY_BYTES,
    EVERY_NODE,
    FLAG_QUERY,
    FRAME_BYTES,
    VERSION,
    FrameKind,
    Reject,
)
from curveline.radio.protocol.envelope import head
from curveline.radio.protocol.frames import HelloFrame, ReportFrame, decode_report
from curveline.radio.protocol.keys import FROM_HOST, OPEN_KEY, tag
from curveline.radio.protocol.motion import axes_of, config_hash
from curveline.radio.protocol.page_frames import AskFrame, PageFrame, decode_page, encode_ask
from curveline.radio.site.key_file import UNKNOWN_CHIP

PROBES = 20
FILTER_ROUNDS = 12
TRIED_OUT_FROM = 3
"""Firmware from which on a node can be tried out."""
SETTINGS_FROM = 4
"""Firmware from which on a node takes other settings over the air."""
_OTHER_FILE = "`curveline node settings` with --old-display, or a cable, sets it up anew"
PACKET_IDS = 4
"""After so many packets the sending chip uses the same packet id again."""


@dataclass
class ScannedNode:
    """What one address answered: the newest page of every device there, and how well it is heard.

    `cut` counts answers that were neither empty nor a whole frame; `filters` is whether the chip drops repeats, None
    if that was not asked or could not be told.
    """

    node: int  # from 1
    address: str  # 5 bytes, hexadecimal
    pages: dict[int, PageFrame] = field(default_factory=dict)  # by chip
    link: LinkTally = field(default_factory=LinkTally)  # polls and losses
    whole: int = 0  # answers that were whole
    cut: int = 0
    filters: bool | None = None

    @property
    def chip(self) -> int:
        """The chip id, if exactly one device answers, else UNKNOWN_CHIP."""
        return next(iter(self.pages)) if len(self.pages) == 1 else UNKNOWN_CHIP


def scan(radio: Radio, drive: DriveSettings, probes: int = PROBES, numbers: Sequence[int] = ()) -> list[ScannedNode]:
    """Ask addresses of a display `probes` times who is there; it disturbs no run and needs no keys.

    They are those of the nodes with some `numbers` (from 1), all without any.
    """
    wanted = numbers or range(1, drive.node_count + 1)
    found = [ScannedNode(number, drive.addresses[number - 1]) for number in wanted]
    for group in _groups(found):
        _ask(radio, group, probes)
    return found


def scan_one(radio: Radio, found: ScannedNode, probes: int = PROBES) -> None:
    """Ask one address who is there."""
    _ask(radio, [found], probes)


def problems(found: ScannedNode, known: int, drive: DriveSettings, *, checks_limits: bool = True) -> list[str]:
    """What is wrong with one address, in sentences; `known` is the chip id that the site has on record, if any.

    The limits that a node holds do not matter unless `checks_limits`.
    """
    where = f"node {found.node}"
    if not found.link.answered:
        return [f"{where}: no answer from {found.address}"]
    if not found.pages:
        cut = "; if it is in its loader, `curveline status` says so"
        if found.cut:
            cut = "; they come cut short, as from a bad copy of the radio chip"
        return [f"{where}: {found.address} acknowledges, but no whole answer came{cut}"]
    if len(found.pages) > 1:
        chips = " and ".join(f"{chip:08x}" for chip in sorted(found.pages))
        return [f"{where}: {len(found.pages)} devices answer on {found.address}: chips {chips}; switch one off"]
    (page,) = found.pages.values()
    wanted = config_hash(axes_of(drive))
    checks = [
        (
            page.node != found.node,
            f"it takes itself for node {page.node}, as another display file has it: {_OTHER_FILE}",
        ),
        (
            page.version != VERSION,
            f"it speaks version {page.version} of the protocol, this release {VERSION}: flash it",
        ),
        (
            page.version == VERSION and page.firmware < TRIED_OUT_FROM,
            f"it has firmware {page.firmware}: it drives plans, but `curveline node` needs {TRIED_OUT_FROM}: flash it",
        ),
        (
            checks_limits and page.config_hash != wanted,
            f"it holds other limits than this display ({page.config_hash:04x}): `curveline node settings {found.node}`",
        ),
        (
            known not in (UNKNOWN_CHIP, page.chip),
            f"chip {page.chip:08x} answers instead of {known:08x}, which the site knows",
        ),
    ]
    return [f"{where}: {text}" for is_so, text in checks if is_so]


def explain(radio: Radio, drive: DriveSettings, halt: Halt) -> Halt:
    """A halt because a node does not answer to its key, with the reason why it does not, if that can be found."""
    if halt.cause is not Cause.UNTRUSTED:
        return halt
    found = ScannedNode(halt.node, drive.addresses[halt.node - 1])
    with suppress(RadioGone):
        _ask(radio, [found], PROBES)
    if not found.pages and (version := _older_version(radio, found)):
        return Halt(Cause.VERSION, halt.node, halt.step, f"it has {version}, this release needs {VERSION}")
    known = radio.site.chips[halt.node - 1]
    chips = " and ".join(f"{chip:08x}" for chip in sorted(found.pages))
    if len(found.pages) > 1:
        return Halt(Cause.TWIN, halt.node, halt.step, f"chips {chips}")
    if found.pages and found.chip != known:
        return Halt(Cause.CHIP, halt.node, halt.step, f"chip {chips} instead of {known:08x}")
    if found.pages and _answers_queries(radio, drive, halt.node):
        return Halt(Cause.SPENT, halt.node, halt.step)
    return Halt(Cause.CLONE, halt.node, halt.step) if found.cut and not found.pages else halt


def radio_test(radio: Radio, drive: DriveSettings, probes: int = PROBES) -> list[ScannedNode]:
    """What can be told of the radio chips from here: whether 32 bytes come back whole, and whether repeats are dropped.

    A node that drops a repeat counts one forged frame where it got the same one twice under one packet id.
    """
    found = scan(radio, drive, probes)
    for each in found:
        other = drive.addresses[each.node % drive.node_count]
        for _ in range(FILTER_ROUNDS):
            told = _is_filtered(radio, each, other, probes)
            each.filters = each.filters if told is None else told
            # One repeat that was dropped is proof; one that came through may have had another packet id after all.
            if told:
                break
    return found


def _groups(found: Sequence[ScannedNode]) -> Iterator[Sequence[ScannedNode]]:
    for begin in range(0, len(found), BATCH):
        yield found[begin : begin + BATCH]


def _ask(radio: Radio, group: Sequence[ScannedNode], probes: int) -> None:
    """One more round than probes: an answer comes with the question after."""
    nonce = secrets.randbits(64) & ~ATTEMPT_MASK
    for attempt in range(probes + 1):
        frame = encode_ask(AskFrame(EVERY_NODE, nonce | (attempt & ATTEMPT_MASK)))
        answers = radio.exchange([(each.address, frame) for each in group])
        for each, answer in zip(group, answers, strict=True):
            _note(each, answer, nonce)


def _answers_queries(radio: Radio, drive: DriveSettings, number: int) -> bool:
    """Whether a node answers to its key, although it offers no session."""
    peer = Peer(number, drive.addresses[number - 1], radio.site.node_key(number), secrets.randbits(64) & ~ATTEMPT_MASK)
    nonce = peer.nonce
    with suppress(RadioGone):
        for _ in range(PROBES):
            (answer,) = radio.exchange([(peer.address, peer.hello(HelloFrame(number, nonce, 0, 0, 0, FLAG_QUERY)))])
            if isinstance(decode_report(answer.payload or b"", peer.node_key, nonce), ReportFrame):
                return True
    return False


def _older_version(radio: Radio, found: ScannedNode) -> int:
    """The version of the protocol that a node with older firmware speaks, 0 if there is none.

    The question for a page has been the same in all of them, but for its first byte.
    """
    for version in range(VERSION - 1, 0, -1):
        for attempt in range(PROBES):
            asked = encode_ask(AskFrame(EVERY_NODE, secrets.randbits(64) & ~ATTEMPT_MASK | attempt))
            body = bytes([version << 4 | FrameKind.PAGE]) + asked[1:BODY_BYTES]
            (answer,) = radio.exchange([(found.address, body + tag(OPEN_KEY, body, FROM_HOST))])
            if answer.payload and answer.payload[0] == version << 4 | FrameKind.PAGE:
                return version
    return 0


def _note(found: ScannedNode, answer: Answer, nonce: int) -> None:
    found.link.count(answer.payload, answer.retries)
    if answer.payload is None:
        return
    found.cut += 0 < len(answer.payload) < FRAME_BYTES
    page = decode_page(answer.payload, nonce)
    if isinstance(page, Reject):
        return
    found.whole += 1
    found.pages[page.chip] = page


def _is_filtered(radio: Radio, found: ScannedNode, other: str, probes: int) -> bool | None:
    """Send one frame twice under the same packet id; None if the node's count does not tell."""
    before = _bad_tags(radio, found, probes)
    probe = bytes([head(FrameKind.HELLO), found.node]) + secrets.token_bytes(FRAME_BYTES - 2)
    filler = encode_ask(AskFrame(EVERY_NODE, secrets.randbits(64)))
    packets = [(found.address, probe), *[(other, filler)] * (PACKET_IDS - 1), (found.address, probe)]
    answers = radio.exchange(packets)
    after = _bad_tags(radio, found, probes)
    if before is None or after is None or answers[0].payload is None or answers[-1].payload is None:
        return None
    return {1: True, 2: False}.get(after - before)


def _bad_tags(radio: Radio, found: ScannedNode, probes: int) -> int | None:
    """The node's count of forged frames now."""
    nonce = secrets.randbits(64) & ~ATTEMPT_MASK
    for attempt in range(probes):
        (answer,) = radio.exchange([(found.address, encode_ask(AskFrame(EVERY_NODE, nonce | attempt)))])
        page = decode_page(answer.payload or b"", nonce)
        if not isinstance(page, Reject) and page.chip == found.chip:
            return page.bad_tags
    return None
