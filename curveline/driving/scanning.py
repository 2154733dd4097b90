"""Who is on the air, and what can be told of the radio chips: a scan of all addresses of a display, without keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import DriveSettings
from curveline.notebook import html_of
from curveline.radio.host.scan import ScannedNode, problems, radio_test, scan
from curveline.radio.interface import Radio, open_radio
from curveline.radio.protocol.codes import plain_name
from curveline.radio.site.key_file import lenient

SWEEPS = 5
"""Looks at every channel: somebody who sends now and then is not met at the first."""


@dataclass(frozen=True)
class ScanResult:
    """What answered on every address, what is wrong with it by the number of its node, and who else sends.

    `busy` are channels on which somebody sends while the display is not asked anything, None if that was not asked.
    """

    spec: str  # of the radio
    drive: DriveSettings  # the display as nodes see it
    found: Sequence[ScannedNode]  # left to right
    wrong: Mapping[int, list[str]]  # sentences, by number of the node
    busy: Sequence[int] | None

    @property
    def is_well(self) -> bool:
        """True if there is nothing to find fault with."""
        return not any(self.wrong.values())

    def _repr_html_(self) -> str:
        rows = [
            (each.node, each.address, ", ".join(f"{page.chip:08x}" for page in each.pages.values()) or "-", wrong)
            for each in self.found
            for wrong in ["; ".join(self.wrong[each.node]) or "none"]
        ]
        title = f"on the air: display {self.drive.display} over {self.spec}"
        return html_of(title, [("node", "address", "devices", "problems"), *rows])

    def document(self) -> dict[str, Any]:
        """The result as plain data."""
        return {
            "curveline": __version__,
            "display": self.drive.display,
            "radio": self.spec,
            "nodes": [self._node(each) for each in self.found],
            "busy_channels": None if self.busy is None else list(self.busy),
        }

    def _node(self, found: ScannedNode) -> dict[str, Any]:
        return {
            "node": found.node,
            "address": found.address,
            "devices": [
                {**asdict(page), "chip": f"{page.chip:08x}", "state": plain_name(page.state)}
                for page in found.pages.values()
            ],
            "link": asdict(found.link),
            "whole_answers": found.whole,
            "cut_answers": found.cut,
            "drops_repeats": found.filters,
            "problems": self.wrong[found.node],
        }


def scan_display(spec: str, drive: DriveSettings, runs: Path, *, tests_chips: bool = False) -> ScanResult:
    """Ask every address; `tests_chips` finds out what the radio chips do, in place of who sends on which channel."""
    with lenient(without_file=True), closing(open_radio(spec, drive, runs)) as radio:
        found = (radio_test if tests_chips else scan)(radio, drive)
        busy = None if tests_chips else _busy(radio)
        chips = radio.site.chips
    wrong = {each.node: problems(each, chips[each.node - 1], drive) for each in found}
    if tests_chips:
        for each in found:
            wrong[each.node] += _doubts(each)
    return ScanResult(spec, drive, found, wrong, busy)


def _busy(radio: Radio) -> list[int]:
    """Channels on which somebody sends while the display is not asked anything."""
    return sorted({channel for _ in range(SWEEPS) for channel in radio.carriers()})


def _doubts(found: ScannedNode) -> list[str]:
    """What speaks against a node's radio chip, beyond what a scan says."""
    doubts = []
    if found.pages and found.cut:
        doubts.append(f"node {found.node}: {found.cut} answers came cut short: its radio chip may be a bad copy")
    if found.filters is False:
        doubts.append(f"node {found.node}: its radio chip lets repeats through: it is no original")
    return doubts
