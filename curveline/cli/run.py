"""One run over the radio: signals, progress, the record, and on a mock display the curve that the rod took."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from curveline import __version__
from curveline.cli.printing import node_table, screen
from curveline.cli.printing.phrases import alike, spans
from curveline.cli.printing.run_progress import watch
from curveline.driving.interrupted import PLAN_NAME, InterruptedRun, resuming, steps_on_record
from curveline.driving.live import published
from curveline.errors import EXIT_INTERRUPTED, InvalidInput, LinkError
from curveline.plan_file import Plan, write_plan
from curveline.radio.host.journal import FILE_NAME, Journal, ReopenedJournal, new_run, read_journal
from curveline.radio.host.link import (
    Control,
    Halted,
    Observer,
    OperatorRequest,
    Progress,
    RunReport,
    resume_plan,
    send_plan,
)
from curveline.radio.host.resume import can_resume, resume_point
from curveline.radio.interface import Radio
from curveline.radio.protocol.codes import Counts
from curveline.system.portable import STOP_SIGNALS

if TYPE_CHECKING:
    from curveline.driving.promises import Promise
    from curveline.replay.playback import Playback, Snap
    from curveline.replay.tour_checks import ShapeCheck
    from curveline.scene import Display

BEFORE = -1.0
"""When [s] anything happened that a process did which was killed: before this one began."""
BEGINS = ("start", "resume")


@dataclass(frozen=True)
class RunResult:
    """How a run ended; `playback` and `stops`, the shapes on the way, are known of mock displays only."""

    plan: Plan
    report: RunReport
    request: OperatorRequest
    playback: Playback | None
    stops: tuple[ShapeCheck, ...]
    folder: Path
    promise: Promise

    @property
    def is_interrupted(self) -> bool:
        """True if somebody asked to stop."""
        return self.request is not OperatorRequest.NONE

    @property
    def is_wanted(self) -> bool:
        """True if all steps were done and, where that is known, the rod is and was in the wanted curves."""
        arrived = self.playback is None or self.playback.states == self.plan.wanted
        return self.report.outcome == "done" and arrived and all(stop.states == stop.wanted for stop in self.stops)

    def document(self, spec: str) -> dict[str, Any]:
        """The ending as plain data."""
        record = asdict(self.report)
        record["nodes"] = [node_table.document(status, self.plan.drive) for status in self.report.nodes]
        rod = None if self.playback is None else self._rod(self.playback)
        shapes = None if self.playback is None else [asdict(stop) for stop in self.stops]
        head = {"curveline": __version__, "plan": self.plan.name, "display": self.plan.drive.display, "radio": spec}
        promised = {"step": self.promise.step, "states": self.promise.states}
        rest = {"promised": promised, "rod": rod, "shapes": shapes, "run": str(self.folder)}
        return {**head, **record, "wanted": self.plan.wanted, **rest}

    def _rod(self, playback: Playback) -> dict[str, Any]:
        record = asdict(playback)
        for snap in record["snaps"]:
            snap["seconds"] = snap["seconds"] if snap["seconds"] >= 0.0 else None
        return record

    def lines(self) -> list[str]:
        """The ending as text."""
        report = self.report
        done = f"{report.outcome}: {report.steps_done} of {report.steps} steps in {report.seconds:.1f} s"
        passed = [stop.line() for stop in self.stops if stop.step < report.steps]
        return [
            done,
            *node_table.table(report.nodes, self.plan.drive),
            *passed,
            *_rod_lines(self.playback, self.promise),
        ]


def conduct(plan: Plan, radio: Radio, control: Control, place: Place) -> RunResult:
    """Send `plan` and keep its record in a new folder; LinkError once everything that can be held is held."""
    folder = new_run(place.runs, plan.name)
    write_plan(plan, folder / PLAN_NAME)
    mock = node_table.mock_of(radio)
    with closing(Journal(folder, mock.disk if mock is not None else None)) as journal:
        return _conduct(_Job(plan, radio, folder, place.spec), partial(send_plan, plan, radio, journal), control)


def go_on(broken: InterruptedRun, radio: Radio, journal: ReopenedJournal, control: Control, place: Place) -> RunResult:
    """Go on with a run; as `conduct`, and InvalidInput if its record forbids it."""
    plan, mock, way = broken.plan, node_table.mock_of(radio), []
    if mock is not None:
        journal.disk = mock.disk
        way = broken.way_here(mock.positions())
    seen = broken.unseen[0] if broken.unseen else broken.point.barrier
    job = _Job(plan, radio, broken.folder, place.spec, way, seen + 1, len(journal.records))
    return _conduct(job, partial(resume_plan, plan, radio, journal), control)


@dataclass(frozen=True)
class Place:
    """Through which radio is sent, and where the records are."""

    spec: str
    runs: Path


@dataclass(frozen=True)
class _Job:
    """What is sent, through what, where its record is kept, and how the nodes came here if no one has told yet.

    `first` is the first step (from 1) that is done on that way, or else in this run. `known` is how many records there
    are already.
    """

    plan: Plan
    radio: Radio
    folder: Path
    spec: str
    way: Sequence[tuple[Counts, ...]] = ()
    first: int = 1
    known: int = 0

    @property
    def has_begun(self) -> bool:
        """Whether the nodes were taken over: a run that was refused has moved nothing."""
        with suppress(InvalidInput):
            return any(each.get("type") in BEGINS for each in read_journal(self.folder / FILE_NAME)[self.known :])
        return True

    @property
    def promise(self) -> Promise:
        """What the plan says of the rod where the run has come to by its record."""
        from curveline.driving.promises import promise

        return promise(self.plan, *steps_on_record(self.folder, self.plan))


def _conduct(job: _Job, sender: Callable[[Observer, Control], RunReport], control: Control) -> RunResult:
    screen.note(f"record: {job.folder}")
    screen.note(f"if this is cut short: {resuming(job.folder)}")
    begin = job.radio.now_us() / 1e6
    try:
        report = _send(job, sender, control)
    except LinkError as error:
        if job.has_begun:
            screen.note("\n".join(_rod_lines(_play_back(job, begin)[0], job.promise)))
        if not isinstance(error, Halted) or can_resume(error.halt):
            advise_resuming(job.plan, job.folder)
        if control.request is OperatorRequest.NONE:
            raise
        # An emergency stop ends the run as a fault of all nodes, but it is what somebody asked for.
        screen.complain(error)
        raise typer.Exit(EXIT_INTERRUPTED) from None
    return RunResult(job.plan, report, control.request, *_play_back(job, begin), job.folder, job.promise)


def _send(job: _Job, sender: Callable[[Observer, Control], RunReport], control: Control) -> RunReport:
    """Send, show how it goes, and publish it."""
    with (
        published(job.folder, job.plan, job.spec, control) as publisher,
        _signals(control),
        watch(job.plan, control) as shown,
    ):

        def observe(news: Progress) -> None:
            publisher(news)
            shown(news)

        report = None
        try:
            report = sender(observe, control)
        finally:
            publisher.end(report)
        return report


def advise_resuming(plan: Plan, run: Path) -> None:
    """Say how a run that was broken off goes on, if its record allows that."""
    with suppress(InvalidInput):
        resume_point(plan, read_journal(run / FILE_NAME))
        screen.note(f"to go on with this run: {resuming(run)}")


def _rod_lines(playback: Playback | None, promised: Promise) -> list[str]:
    """What the rod did, as text, where it is known."""
    if playback is None:
        return []
    from curveline.replay.tour_checks import posture

    said = [(state, promised.verdict(segment, state)) for segment, state in enumerate(playback.states)]
    lines = [_snap_line(snap) for snap in playback.snaps]
    for segments, (state, verdict) in alike(said):
        which = f"segment{'s' if len(segments) > 1 else ''} {spans(segments)}"
        lines.append(f"{which}: the rod is {posture(state)}{verdict}")
    return lines


def _snap_line(snap: Snap) -> str:
    when = "before this went on" if snap.seconds < 0.0 else f"{snap.seconds:.1f} s"
    return f"{when}: segment {snap.segment} snapped from {snap.before} to {snap.after}"


def _play_back(job: _Job, begin: float) -> tuple[Playback | None, tuple[ShapeCheck, ...]]:
    """What the motion of a mock's nodes since `begin` [s] did to its rod, which it then remembers.

    None for other radios, and if the display file is gone.
    """
    mock = node_table.mock_of(job.radio)
    if mock is None:
        return None, ()
    try:
        display = display_of(job.plan)
    except InvalidInput as error:
        screen.note(f"which curve the rod took is not known: {error.message}")
        mock.rod = []
        return None, ()
    from curveline.replay.tour_checks import CarriedOut, play_back

    screen.announce_compilation()
    motion = [(seconds - begin, counts) for seconds, counts in mock.motion()]
    before = [(BEFORE, counts) for counts in job.way]
    playback, stops = play_back(CarriedOut(job.plan, display, job.first), [*before, *motion], mock.rod)
    mock.rod = list(playback.states)
    return playback, stops


def display_of(plan: Plan) -> Display:
    """The display that a plan was made for, as its file says now; InvalidInput if it says nothing of use."""
    from curveline.shapes.files import read_display

    display = read_display(str(plan.provenance.get("display", plan.drive.display)))
    if display.digest != plan.drive.digest:
        screen.note(f"note: the file of display {plan.drive.display} has changed since this plan was made")
    return display


@contextmanager
def _signals(control: Control) -> Iterator[None]:
    """Ctrl-C and its like ask the run to pause; again, to hold now; again, to stop for good."""

    def escalate(number: int, frame: object) -> None:
        control.escalate()

    before = [(number, signal.signal(number, escalate)) for number in STOP_SIGNALS]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
