"""Sending to several displays at once, and the one record that this becomes."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from curveline.driving.interrupted import PLAN_NAME, InterruptedRun, resuming, steps_on_record
from curveline.driving.lines.interrupted_lines import InterruptedLines, header_of
from curveline.driving.lines.lines_result import LineResult, LinesHalted, LinesResult
from curveline.driving.lines.lines_wish import LinesWish, LineWish
from curveline.driving.live import Publisher, forget
from curveline.driving.modelled import modelled
from curveline.driving.promises import promise
from curveline.driving.rod_report import PlayedPlan, play_back_run
from curveline.driving.run_listener import LineObserver, RunListener
from curveline.driving.run_result import RunResult
from curveline.driving.sending import Outlet
from curveline.errors import CurvelineError, LinkError
from curveline.plan_file import Plan, write_plan
from curveline.radio.host.actions import Policy
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.interleaving import Convoy, DrivenLine, conduct
from curveline.radio.host.journal import Disk, Journal, ReopenedJournal, lock_run, new_run
from curveline.radio.host.line_records import LineJournal, line_folder, run_of
from curveline.radio.host.link import Control, LinkRun, Observer, Progress, RunReport
from curveline.radio.host.polling import shared_policy
from curveline.radio.host.preflight import journal_bytes
from curveline.radio.host.queries import fresh_nonce
from curveline.radio.host.rota import Rota

HEADER_BYTES = 65536
"""More than the first record of a run takes."""


@dataclass(frozen=True)
class ReadyLine:
    """A line that is to be driven: its number from 1, its plan, through what, and where it goes on, if it has begun.

    `group` says which of the radios it is behind, `begin` [s] when that was opened, by its clock.
    """

    number: int
    line: LineWish
    plan: Plan
    outlet: Outlet
    group: int
    begin: float
    broken: InterruptedRun | None = None

    @property
    def is_midway(self) -> bool:
        """Whether it goes on in the midst of a step."""
        return self.broken is not None and self.broken.point.released > self.broken.point.barrier

    def played(self, run: str) -> PlayedPlan:
        """What is to be played back of it, in the run of that name, after it was driven."""
        broken, display = self.broken, modelled(self.outlet.radio)
        if broken is None:
            return PlayedPlan(self.plan, run=run, record=self.outlet.record)
        way = broken.way_here(display.motion()[0][1]) if display is not None else []
        seen = broken.unseen[0] if broken.unseen else broken.point.barrier
        return PlayedPlan(self.plan, seen + 1, way, run, self.outlet.record)


@dataclass(frozen=True)
class PreparedLines:
    """Lines whose nodes can carry out their plans; nothing has moved yet. `broken` is the run that goes on, if any."""

    wish: LinesWish  # with the plans that will be sent
    lines: tuple[ReadyLine, ...]  # those that are to be driven
    runs: Path
    listener: RunListener
    broken: InterruptedLines | None = None
    journal: ReopenedJournal | None = None  # of the run that goes on, locked
    refused: Mapping[int, CurvelineError] = field(default_factory=dict)
    """Why lines cannot go on, by their numbers."""

    def send(self, control: Control | None = None) -> LinesResult:
        """Take all lines through their plans and keep the record; LinesHalted once all that can be held are held."""
        control = control or Control()
        if self.broken is not None and self.journal is not None:
            self.journal.disk = self._disk or self.journal.disk
            self.journal.reserve(self._journal_bytes)
            return self._keep(self.broken.folder, self.journal, control)
        folder = _new_folder(self.wish, self.runs)
        head = {**header_of(self.wish, [line.plan for line in self.lines]), "at": time.time(), "process": os.getpid()}
        with closing(Journal(folder, self._disk)) as journal:
            journal.reserve(HEADER_BYTES + self._journal_bytes)
            journal.append(head)
            return self._keep(folder, journal, control)

    @property
    def _disk(self) -> Disk | None:
        """The disk under the record, if it is a model's, too: that of the first line."""
        display = modelled(self.lines[0].outlet.radio)
        return None if display is None else display.disk

    @property
    def _journal_bytes(self) -> int:
        return sum(journal_bytes(line.plan) for line in self.lines)

    def _keep(self, folder: Path, journal: Journal, control: Control) -> LinesResult:
        """Drive all lines, with a record in a folder, and find out how it ended."""
        self.listener.note(f"record: {folder}")
        self.listener.note(f"if this is cut short: {resuming(folder)}")
        convoy = self._driven(folder, journal, control)
        ended = dict(zip((line.number for line in self.lines), convoy.lines, strict=True))
        results = []
        for number, line in enumerate(self.wish.lines, start=1):
            part = line_folder(folder, number)
            ready = next((each for each in self.lines if each.number == number), None)
            if ready is None:
                results.append(_left_alone(line, part, control, self.refused.get(number)))
            else:
                results.append(_ended(ready, ended[number], part, control))
        found = LinesResult(self.wish.name, tuple(results), self.wish.current_limit, folder, control.request)
        if convoy.failed:
            raise LinesHalted(results[self.lines[convoy.failed[0]].number - 1], found)
        return found

    def _driven(self, folder: Path, journal: Journal, control: Control) -> Convoy:
        """Drive all lines until each has ended or holds, and publish how they go."""
        midway = [place for place, line in enumerate(self.lines) if line.is_midway]
        rota = Rota([line.line.current or 0.0 for line in self.lines], self.wish.current_limit, midway)
        plans = {line.line.name: line.plan for line in self.lines}
        with ExitStack() as opened:
            published = [
                opened.enter_context(_published(line, line_folder(folder, line.number), control)) for line in self.lines
            ]
            shown = opened.enter_context(self.listener.sending_lines(plans, control))
            lock = threading.Lock()
            driven = []
            for place, (line, publisher) in enumerate(zip(self.lines, published, strict=True)):
                conductor = _conductor(line, self._policy(line, control))
                conductor.turns = rota.of(place)
                keeper = LineJournal(journal, line.number, lock)
                run = LinkRun(conductor, line.outlet.radio, keeper, _observer(line, publisher, shown))
                driven.append(DrivenLine(place, line.line.name, run, publisher))
            groups = [[driven[place] for place in group] for group in self._groups]
            conduct(groups, convoy := Convoy(driven, rota, control))
        return convoy

    @property
    def _groups(self) -> list[list[int]]:
        """The places of the lines behind each radio."""
        places = range(len(self.lines))
        radios = dict.fromkeys(line.group for line in self.lines)
        return [[place for place in places if self.lines[place].group == radio] for radio in radios]

    def _policy(self, line: ReadyLine, control: Control) -> Policy:
        """How often the nodes of a line are asked, whose radio has others to ask, too."""
        nodes = sum(each.plan.drive.node_count for each in self.lines if each.group == line.group)
        return shared_policy(control.policy, nodes, line.plan.drive.data_rate)


def _new_folder(wish: LinesWish, runs: Path) -> Path:
    """The folder of a new run, with the plans of its lines."""
    folder = new_run(runs, wish.name)
    for number, line in enumerate(wish.lines, start=1):
        assert isinstance(line.wish, Plan)
        part = line_folder(folder, number)
        part.mkdir(parents=True)
        write_plan(line.wish, part / PLAN_NAME)
    return folder


def _conductor(line: ReadyLine, policy: Policy) -> Conductor:
    """Who takes a line through its plan, or goes on with that."""
    point = None if line.broken is None else line.broken.point
    return Conductor(line.plan, line.outlet.radio.site, fresh_nonce(), policy, point)


def _observer(line: ReadyLine, publisher: Publisher, shown: LineObserver) -> Observer:
    """Who is told of the nodes of a line: what publishes it, and whoever looks on."""

    def observe(news: Progress) -> None:
        publisher(news)
        shown(line.line.name, news)

    return observe


@contextmanager
def _published(line: ReadyLine, part: Path, control: Control) -> Iterator[Publisher]:
    """Publish how a line goes in its folder, which nobody else can have meanwhile."""
    lock = lock_run(part)
    try:
        forget(part)
        publisher = Publisher(part, line.plan, line.outlet.spec, control)
        try:
            yield publisher
        finally:
            publisher.close()
    finally:
        os.close(lock)


def _ended(line: ReadyLine, driven: DrivenLine, part: Path, control: Control) -> LineResult:
    """How a line that was driven ended, and what halted it, if anything did."""
    error: LinkError | None = None
    try:
        report = driven.end()
    except LinkError as halted:
        report, error = driven.report(), halted
    outlet = line.outlet
    playback, checks = play_back_run(
        line.played(run_of(part).name), modelled(outlet.radio), line.begin, outlet.listener
    )
    promised = promise(line.plan, *steps_on_record(part, line.plan))
    result = RunResult(line.plan, outlet.spec, report, control.request, playback, checks, part, promised)
    return LineResult(line.line.name, result, error)


def _left_alone(line: LineWish, part: Path, control: Control, refusal: CurvelineError | None) -> LineResult:
    """A line that was not driven, because it is done or cannot go on."""
    assert isinstance(line.wish, Plan)
    plan = line.wish
    done, released = steps_on_record(part, plan)
    report = RunReport("done" if refusal is None else "halted", done, len(plan.steps), 0.0, ())
    promised = promise(plan, done, released)
    result = RunResult(plan, line.radio, report, control.request, None, (), part, promised)
    return LineResult(line.name, result, refusal)
