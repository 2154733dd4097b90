"""How the nodes of a display are, and who is on the air, as text for terminals of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from curveline.cli.printing import screen
from curveline.cli.printing.reports import node_table
from curveline.driving.live import Sender
from curveline.driving.scanning import ScanResult
from curveline.driving.status import DisplayStatus
from curveline.phrases import in_words, wrapped
from curveline.radio.host.scan import ScannedNode
from curveline.radio.protocol.codes import plain_name

SCAN_HEAD = ("node", "address", "chip", "fw", "boot", "state", "bad tags", "polls", "lost", "retries")
TEST_HEAD = ("node", "address", "32-byte answers", "cut short", "repeats")
REPEATS = {True: "dropped", False: "let through", None: "not known"}
UNTESTED = (
    "Not tested: packets without acknowledgement, which some copies of the chip get wrong; curveline sends none. "
    "Repeats let through are harmless, because every frame is numbered, but tell that the chip is no original."
)


def describe(status: DisplayStatus) -> Iterator[str]:
    """What every node said, and what is known of the rod."""
    yield f"display {status.drive.display} over {status.spec}"
    if status.sender is not None:
        yield from wrapped(_told_by(status.sender))
    yield from node_table.table(status.nodes, status.drive)
    if status.rod is not None:
        yield from wrapped(f"rod: {in_words(status.rod) or 'not known'}")


def _told_by(sender: Sender) -> str:
    live = sender.live
    return f"told {live.age:.1f} s ago by {sender.name}: step {live.step} of {live.steps}, {live.phase}"


def describe_scan(scan: ScanResult) -> Iterator[str]:
    """Who answered, what is wrong, and who else sends."""
    yield from _headed(scan, [SCAN_HEAD, *(row for each in scan.found for row in _rows(each))], frozenset({1, 2, 5}))
    if scan.busy is not None:
        channel = scan.drive.channel
        yield f"others send on {_spans(scan.busy) or 'no channel'}; the display is on {channel}"


def describe_radio_test(scan: ScanResult) -> Iterator[str]:
    """What was found out of the radio chips."""
    rows = [
        (str(each.node), each.address, str(each.whole), str(each.cut), REPEATS[each.filters]) for each in scan.found
    ]
    yield from _headed(scan, [TEST_HEAD, *rows], frozenset({1, 4}))


def _headed(scan: ScanResult, rows: Sequence[tuple[str, ...]], left: frozenset[int]) -> Iterator[str]:
    yield f"display {scan.drive.display} over {scan.spec}"
    yield from screen.table(rows, left)
    yield from (text for texts in scan.wrong.values() for text in texts)


def _spans(channels: Sequence[int]) -> str:
    """Channels as 3, 10-25."""
    firsts = [channel for channel in channels if channel - 1 not in channels]
    lasts = [channel for channel in channels if channel + 1 not in channels]
    spans = zip(firsts, lasts, strict=True)
    return ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in spans)


def _rows(found: ScannedNode) -> list[tuple[str, ...]]:
    """One row per device on an address, one with dashes if there is none."""
    link = (str(found.link.polls), str(found.link.lost), str(found.link.retries))
    head = (str(found.node), found.address)
    return [
        (
            *head,
            *(f"{page.chip:08x}", str(page.firmware), str(page.boot)),
            *(plain_name(page.state), str(page.bad_tags), *link),
        )
        for page in found.pages.values()
    ] or [(*head, "-", "-", "-", "silent", "-", *link)]
