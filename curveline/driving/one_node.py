"""One node: what it says of itself, and what brings it back to work outside of any run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.calibrating.step_response import Tuning
from curveline.drive_settings import AXES, DriveSettings
from curveline.driving.live import sender_of
from curveline.driving.node_calibration import (
    REPEATS,
    Calibration,
    Ruler,
    calibrate,
    counts_per_turn,
    in_turns,
    mock_ruler,
)
from curveline.driving.node_check import NodeCheck, check
from curveline.driving.node_errands import Jogged, NodeInfo, NodePlace, Watched, blink, info, jog, watch, zero
from curveline.driving.node_switch import SwitchCheck, check_switch
from curveline.driving.node_tuning import tune
from curveline.driving.site_keys import read_program
from curveline.driving.status import node_document
from curveline.errors import InvalidInput
from curveline.radio.host.link import Halted
from curveline.radio.host.node_status import NodeStatus, status_of_report
from curveline.radio.host.service import clear_fault, home_axes, report_of
from curveline.radio.host.stop_causes import display_option
from curveline.radio.host.updating import ProgramUpdate, Updated, update_node
from curveline.radio.interface import InUse, Radio
from curveline.radio.protocol.frames import ReportFrame, StatusFrame
from curveline.radio.protocol.service_frames import MotorFacts
from curveline.system.files import AnyPath


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

    def info(self) -> NodeInfo:
        """Who the node is, and what it holds."""
        with self._named():
            return info(self._place)

    def blink(self, seconds: float = 10.0) -> None:
        """Let the node's lamp flicker for so long."""
        with self._named():
            blink(self._place, seconds)

    def jog(
        self,
        axis: str,
        by: float,
        *,
        unhomed: bool = False,
        viewer: Callable[[MotorFacts], None] = lambda facts: None,
    ) -> Jogged:
        """Move one axis by `by` [mm or degrees], slowly, and only as long as this runs.

        `unhomed` allows it for an axis that is not homed, 20 mm or degrees at most. InvalidInput beyond its limits.
        """
        with self._named():
            return jog(self._place, axis, by, unhomed=unhomed, viewer=viewer)

    def zero(self) -> ReportFrame:
        """Let extrude count from where it stands; nothing moves. What the node says then."""
        with self._named():
            return zero(self._place)

    def watch(self) -> Iterator[Watched]:
        """What the node says of its motors, ten times a second, for ever."""
        with self._named():
            yield from watch(self._place)

    def check(self, axes: Sequence[str] = AXES, told: Callable[[str], None] = lambda name: None) -> NodeCheck:
        """Turn the motors of some axes a little, one after the other, and say what is wired wrongly."""
        with self._named():
            return check(self._place, axes, told)

    def check_switch(self, seconds: float = 30.0, told: Callable[[str], None] = lambda word: None) -> SwitchCheck:
        """Wait until the lower end's switch was pressed and let go, `seconds` at most, and say whether it works.

        `told` hears a word for each state that it is seen in.
        """
        with self._named():
            return check_switch(self._place, seconds, told)

    def calibrate(self, axis: str, ruler: Ruler, *, way: float | None = None, repeats: int = REPEATS) -> Calibration:
        """Move an axis several times, and ask `ruler` how far it went; what a turn of its gear makes by that."""
        with self._named():
            found = calibrate(self._place, axis, ruler, way=way, repeats=repeats)
        per_unit = self.drive.axes[AXES.index(axis)].counts_per_unit
        return in_turns(found, counts_per_turn(self.display) / per_unit)

    def tune(self, axis: str, told: Callable[[float], None] = lambda duty: None) -> Tuning:
        """Give a motor its duty at once, and say which gains suit it."""
        with self._named():
            return tune(self._place, axis, told)

    def update(
        self, program: AnyPath, *, older: bool = False, seen: Callable[[float], None] = lambda part: None
    ) -> Updated:
        """Replace the node's program over the air by the one in a file of `make updatable`; broken off, it goes on.

        `older` allows one of an older firmware. `seen` is told which part of it the node has. InvalidInput for what is
        no program behind a loader, LinkError for a node without one.
        """
        update = ProgramUpdate(read_program(program), older, seen)
        with self._named():
            return update_node(self.radio, self.drive, self.number, update)

    @property
    def mock_ruler(self) -> Callable[[Jogged], float] | None:
        """A ruler laid to a mock display; None for a real one."""
        return mock_ruler(self._place)

    def told(self, key: str, content: object) -> dict[str, Any]:
        """Something that was found out about the node, under its key, as plain data."""
        head = {"curveline": __version__, "display": self.drive.display, "radio": self.spec, "node": self.number}
        return {**head, key: content}

    @property
    def _place(self) -> NodePlace:
        return NodePlace(self.radio, self.drive, self.number)

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
