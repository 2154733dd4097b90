"""One node: what it says of itself, and what brings it back to work outside of any run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import AXES, DriveSettings
from curveline.driving.live import sender_of
from curveline.driving.status import node_document
from curveline.errors import InvalidInput
from curveline.radio.host.link import Halted
from curveline.radio.host.node_status import NodeStatus, status_of_report
from curveline.radio.host.service import clear_fault, home_axes, report_of
from curveline.radio.host.stop_causes import display_option
from curveline.radio.interface import InUse, Radio
from curveline.radio.protocol.frames import ReportFrame, StatusFrame


def refuse_while_sending(drive: DriveSettings, named: str, spec: str, runs: Path) -> None:
    """InUse while a process of this computer sends to a display over this radio."""
    if (sender := sender_of(drive, spec, runs)) is not None:
        option = display_option(named)
        hint = f"`curveline status{option}` shows what it says of its nodes, `curveline stop{option}` pauses it"
        raise InUse(f"the radio is in use by {sender.name}", hint)


@dataclass(frozen=True)
class OneNode:
    """A node of a display that a radio reaches; a fault of the link names the display in what it advises."""

    number: int  # in the row, from 1
    display: str  # as advice names it
    spec: str  # of the radio
    drive: DriveSettings  # the display as nodes see it
    radio: Radio  # open

    def report(self) -> ReportFrame:
        """All that the node says of itself; asking disturbs no run."""
        with self._named():
            return report_of(self.radio, self.drive, self.number)

    def clear(self) -> ReportFrame:
        """Make the node forget its fault; nothing moves. What it says then."""
        with self._named():
            return clear_fault(self.radio, self.drive, self.number)

    def home(
        self, axes: Iterable[str] = AXES, watcher: Callable[[StatusFrame], None] = lambda status: None
    ) -> ReportFrame:
        """Let the node find the zeros of some axes and go there, with the rod out of its clamp; what it says then.

        `watcher` is told every status on the way. InvalidInput for an axis that there is not.
        """
        wanted = set(axes)
        if unknown := wanted - set(AXES):
            raise InvalidInput(f"no axis of a node: {', '.join(sorted(unknown))}", f"there are {', '.join(AXES)}")
        with self._named():
            return home_axes(
                self.radio, self.drive, self.number, sum(1 << AXES.index(name) for name in wanted), watcher
            )

    def status(self, report: ReportFrame | None = None) -> NodeStatus:
        """What the node said in a report, in words; what it says now if there is none."""
        told = self.report() if report is None else report
        return status_of_report(told, self.drive.addresses[self.number - 1], self.display)

    def document(self, report: ReportFrame | None = None) -> dict[str, Any]:
        """What the node said in a report as plain data; what it says now if there is none."""
        head = {"curveline": __version__, "display": self.drive.display, "radio": self.spec}
        told = node_document(self.status(report), self.drive)
        return {**head, "node": {key: each for key, each in told.items() if key != "link"}}

    @contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except Halted as error:
            raise Halted(replace(error.halt, display=self.display)) from None
