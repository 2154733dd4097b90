"""Sending: a plan that the nodes can carry out, and the run that it becomes, with its record."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from curveline.driving.interrupted import PLAN_NAME, InterruptedRun, resuming, steps_on_record
from curveline.driving.live import published
from curveline.driving.modelled import modelled
from curveline.driving.promises import Promise, promise
from curveline.driving.rod_record import RodRecord
from curveline.driving.rod_report import PlayedPlan, play_back_run, rod_lines
from curveline.driving.run_listener import RunListener
from curveline.driving.run_result import RunResult
from curveline.errors import InvalidInput, LinkError
from curveline.plan_file import Plan, write_plan
from curveline.radio.host.journal import FILE_NAME, Journal, ReopenedJournal, new_run, read_journal
from curveline.radio.host.link import Control, Halted, Observer, Progress, RunReport, resume_plan, send_plan
from curveline.radio.host.resume import can_resume, resume_point
from curveline.radio.interface import Radio

if TYPE_CHECKING:
    from curveline.driving.rod_report import PlayedBack

BEGINS = ("start", "resume")
Sends = Callable[[Observer, Control], RunReport]


@dataclass(frozen=True)
class Outlet:
    """Through what is sent: a radio that is open, the spec it was named by, the folder of runs, who hears of it."""

    radio: Radio
    spec: str
    runs: Path
    listener: RunListener
    since: float = 0.0
    """When the display behind the radio was new [s since 1970], if it was made then."""

    @property
    def record(self) -> RodRecord:
        """Where the runs of its rod are on record."""
        return RodRecord(self.spec, self.runs, self.since)


@dataclass(frozen=True)
class PreparedRun:
    """A plan that the nodes can carry out; nothing has moved yet. `broken` is the run that it goes on with, if any."""

    plan: Plan  # what will be sent
    outlet: Outlet  # through what
    broken: InterruptedRun | None = None
    journal: ReopenedJournal | None = None  # of the run that goes on, locked

    def send(self, control: Control | None = None) -> RunResult:
        """Take the nodes through the plan and keep the record; LinkError once all that can be held are held."""
        control = control or Control()
        if self.broken is None or self.journal is None:
            return _send_anew(self.plan, self.outlet, control)
        return _go_on(self.broken, self.journal, self.outlet, control)


def _send_anew(plan: Plan, outlet: Outlet, control: Control) -> RunResult:
    """Send with a record in a new folder."""
    folder = new_run(outlet.runs, plan.name)
    write_plan(plan, folder / PLAN_NAME)
    display = modelled(outlet.radio)
    with closing(Journal(folder, display.disk if display is not None else None)) as journal:
        run = _Run(PlayedPlan(plan, run=folder.name, record=outlet.record), folder, outlet)
        return run.conduct(partial(send_plan, plan, outlet.radio, journal), control)


def _go_on(broken: InterruptedRun, journal: ReopenedJournal, outlet: Outlet, control: Control) -> RunResult:
    """Go on with a run; InvalidInput if its record forbids it."""
    display, way = modelled(outlet.radio), []
    if display is not None:
        journal.disk = display.disk
        way = broken.way_here(display.positions())
    seen = broken.unseen[0] if broken.unseen else broken.point.barrier
    played = PlayedPlan(broken.plan, seen + 1, way, broken.folder.name, outlet.record)
    run = _Run(played, broken.folder, outlet, len(journal.records))
    return run.conduct(partial(resume_plan, broken.plan, outlet.radio, journal), control)


@dataclass(frozen=True)
class _Run:
    """A run on its way: what is played back of it, where its record is, how many records there are already."""

    played: PlayedPlan
    folder: Path
    outlet: Outlet
    known: int = 0

    def conduct(self, sends: Sends, control: Control) -> RunResult:
        """Send, and find out what became of the rod."""
        listener, plan = self.outlet.listener, self.played.plan
        listener.note(f"record: {self.folder}")
        listener.note(f"if this is cut short: {resuming(self.folder)}")
        begin = self.outlet.radio.now_us() / 1e6
        try:
            report = self._publish(sends, control)
        except LinkError as error:
            if self.has_begun and (lines := list(rod_lines(self._play_back(begin)[0], self.promise))):
                listener.note("\n".join(lines))
            if not isinstance(error, Halted) or can_resume(error.halt):
                advise_resuming(plan, self.folder, listener)
            raise
        playback, checks = self._play_back(begin)
        return RunResult(plan, self.outlet.spec, report, control.request, playback, checks, self.folder, self.promise)

    def _publish(self, sends: Sends, control: Control) -> RunReport:
        """Send, tell how it goes, and publish it."""
        plan, outlet = self.played.plan, self.outlet
        with (
            published(self.folder, plan, outlet.spec, control) as publisher,
            outlet.listener.sending(plan, control) as shown,
        ):

            def observe(news: Progress) -> None:
                publisher(news)
                shown(news)

            report = None
            try:
                report = sends(observe, control)
            finally:
                publisher.end(report)
            return report

    def _play_back(self, begin: float) -> PlayedBack:
        outlet = self.outlet
        return play_back_run(self.played, modelled(outlet.radio), begin, outlet.listener)

    @property
    def has_begun(self) -> bool:
        """Whether the nodes were taken over: a run that was refused has moved nothing."""
        with suppress(InvalidInput):
            return any(each.get("type") in BEGINS for each in read_journal(self.folder / FILE_NAME)[self.known :])
        return True

    @property
    def promise(self) -> Promise:
        """What the plan says of the rod where the run has come to by its record."""
        return promise(self.played.plan, *steps_on_record(self.folder, self.played.plan))


def advise_resuming(plan: Plan, run: Path, listener: RunListener) -> None:
    """Say how a run that was broken off goes on, if its record allows that."""
    with suppress(InvalidInput):
        resume_point(plan, read_journal(run / FILE_NAME))
        listener.note(f"to go on with this run: {resuming(run)}")
