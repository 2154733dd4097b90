"""`curveline status --scan` and `--radio-test`: who is on the air, and what can be told of the radio chips."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict
from typing import Any

from curveline import __version__
from curveline.cli.asked import Asked
from curveline.cli.printing import screen
from curveline.errors import EXIT_DONE, EXIT_LINK
from curveline.radio.host.scan import ScannedNode, problems, radio_test, scan
from curveline.radio.interface import Radio, open_radio
from curveline.radio.protocol.codes import plain_name
from curveline.radio.site.key_file import lenient

SCAN_HEAD = ("node", "address", "chip", "fw", "boot", "state", "bad tags", "polls", "lost", "retries")
TEST_HEAD = ("node", "address", "32-byte answers", "cut short", "repeats")
REPEATS = {True: "dropped", False: "let through", None: "not known"}
SWEEPS = 5
"""Looks at every channel: somebody who sends now and then is not met at the first."""
UNTESTED = (
    "Not tested: packets without acknowledgement, which some copies of the chip get wrong; curveline sends none. "
    "Repeats let through are harmless, because every frame is numbered, but tell that the chip is no original."
)


def survey(asked: Asked, *, tests: bool, as_json: bool) -> int:
    """Ask every address, show the answers, and return the exit code."""
    with lenient(without_file=True), closing(open_radio(asked.spec, asked.drive, asked.runs)) as radio:
        found = (radio_test if tests else scan)(radio, asked.drive)
        busy = None if tests else _busy(radio)
        chips = radio.site.chips
    wrong = {each.node: problems(each, chips[each.node - 1], asked.drive) for each in found}
    if tests:
        for each in found:
            wrong[each.node] += _doubts(each)
    if as_json:
        screen.emit({**_document(asked, found, wrong), "busy_channels": busy})
    else:
        screen.result("\n".join([f"display {asked.drive.display} over {asked.spec}", *_lines(found, tests=tests)]))
        for text in (text for texts in wrong.values() for text in texts):
            screen.result(text)
        if busy is not None:
            screen.result(f"others send on {_spans(busy) or 'no channel'}; the display is on {asked.drive.channel}")
        if tests:
            screen.note(UNTESTED)
    return EXIT_LINK if any(wrong.values()) else EXIT_DONE


def _busy(radio: Radio) -> list[int] | None:
    """Channels on which somebody sends while the display is not asked anything; None if this radio cannot listen."""
    carriers: Callable[[], Sequence[int]] | None = getattr(radio, "carriers", None)
    if carriers is None:
        return None
    return sorted({channel for _ in range(SWEEPS) for channel in carriers()})


def _spans(channels: Sequence[int]) -> str:
    """Channels as 3, 10-25."""
    firsts = [channel for channel in channels if channel - 1 not in channels]
    lasts = [channel for channel in channels if channel + 1 not in channels]
    spans = zip(firsts, lasts, strict=True)
    return ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in spans)


def _doubts(found: ScannedNode) -> list[str]:
    """What speaks against a node's radio chip, beyond what a scan says."""
    doubts = []
    if found.pages and found.cut:
        doubts.append(f"node {found.node}: {found.cut} answers came cut short: its radio chip may be a bad copy")
    if found.filters is False:
        doubts.append(f"node {found.node}: its radio chip lets repeats through: it is no original")
    return doubts


def _lines(found: Sequence[ScannedNode], *, tests: bool) -> list[str]:
    if tests:
        rows = [(str(each.node), each.address, str(each.whole), str(each.cut), REPEATS[each.filters]) for each in found]
        return screen.table([TEST_HEAD, *rows], frozenset({1, 4}))
    return screen.table([SCAN_HEAD, *(row for each in found for row in _rows(each))], frozenset({1, 2, 5}))


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


def _document(asked: Asked, found: Sequence[ScannedNode], wrong: Mapping[int, list[str]]) -> dict[str, Any]:
    return {
        "curveline": __version__,
        "display": asked.drive.display,
        "radio": asked.spec,
        "nodes": [
            {
                "node": each.node,
                "address": each.address,
                "devices": [
                    {**asdict(page), "chip": f"{page.chip:08x}", "state": plain_name(page.state)}
                    for page in each.pages.values()
                ],
                "link": asdict(each.link),
                "whole_answers": each.whole,
                "cut_answers": each.cut,
                "drops_repeats": each.filters,
                "problems": wrong[each.node],
            }
            for each in found
        ],
    }
