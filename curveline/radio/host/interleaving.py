"""Several lines driven at once: those behind one radio are polled in turn, and each radio has a thread of its own.

Each line has its own conductor and its own barrier. When one is halted, the others do what they are at to its end and
hold at their next barriers; an operator's wish is every line's.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Protocol

from curveline.errors import LinkError
from curveline.phrases import lines_in_words
from curveline.radio.host.actions import Phase, Sleep
from curveline.radio.host.link import LISTEN_MS, Control, LinkRun, OperatorRequest, RunReport
from curveline.radio.host.phases import ENDED, UNCLAIMED
from curveline.radio.host.rota import Rota
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.interface import Radio, RadioGone

JOIN_S = 0.05
"""How often the main thread looks whether it was interrupted while others drive."""


class Onlooker(Protocol):
    """Who looks on how a line goes, and for requests of others, and is told how it ended."""

    def look(self) -> None:
        """Look for requests; to be called often."""
        ...

    def end(self, report: RunReport | None) -> None:
        """The line holds or is over; None if it was halted."""
        ...


@dataclass
class DrivenLine:
    """A line on its way; `number` (from 0) is its place in the rota.

    `error` is what ended it, if that was not its conductor.
    """

    number: int
    name: str
    run: LinkRun
    onlooker: Onlooker
    applied: OperatorRequest = OperatorRequest.NONE
    resumed: int = 0
    error: LinkError | None = None
    is_told: bool = False
    seconds: float = 0.0
    """How long it has been on its way, by its radio's clock, until it came to rest."""

    @property
    def phase(self) -> Phase:
        """Where it stands."""
        return self.run.conductor.phase

    @property
    def is_over(self) -> bool:
        """Whether nothing is to be done any more."""
        return self.error is not None or self.phase in ENDED

    @property
    def is_resting(self) -> bool:
        """Whether it is over, or holds for somebody to go on."""
        return self.is_over or self.phase is Phase.PAUSED

    @property
    def has_failed(self) -> bool:
        """Whether it ends, or has ended, otherwise than it should."""
        return self.error is not None or self.run.conductor.halt is not None

    def stand_by(self) -> None:
        """Another line has failed: hold at the next barrier; a line that has not begun never does."""
        if self.is_told or self.is_over:
            return
        self.is_told = True
        if self.phase in UNCLAIMED:
            self.run.conductor.fail(self.run.now_ms(), Halt(Cause.OTHERS))
        else:
            self.run.conductor.pause()

    def report(self) -> RunReport:
        """How far it came."""
        return replace(self.run.report(), seconds=self.seconds)

    def tell_end(self) -> None:
        """Tell how it ended, or that it holds."""
        self.onlooker.end(None if self.has_failed else self.report())

    def end(self) -> RunReport:
        """How it ended; LinkError if it was halted, or its radio is gone."""
        if self.error is not None:
            raise self.error
        return replace(self.run.end(), seconds=self.seconds)


@dataclass
class Convoy:
    """All lines of a run, and the operator's hand on them."""

    lines: Sequence[DrivenLine]
    rota: Rota
    control: Control
    resumed: int = 0
    failed: list[int] = field(default_factory=list)
    """Numbers of the lines that failed, the first one first; not those that did not begin for their sake."""
    crash: BaseException | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def is_over(self) -> bool:
        """Whether nothing goes on unless somebody asks for it who does not."""
        if self.crash is not None:
            return True
        waits = self.control.waits and self.control.request < OperatorRequest.HOLD and not self.has_failed
        return all(line.is_over if waits else line.is_resting for line in self.lines)

    @property
    def has_failed(self) -> bool:
        """Whether a line has failed."""
        return any(line.has_failed for line in self.lines)

    def attend(self, line: DrivenLine) -> None:
        """Do with a line what the operator asks for, and what the others make necessary."""
        line.onlooker.look()
        with self._lock:
            # Whoever asks for a stop of a display whose line is over asks for one of all.
            for other in self.lines:
                if other.is_over:
                    other.onlooker.look()
            if self.control.resumes:
                self.control.resumes = False
                self.resumed += 1
        if line.resumed < self.resumed:
            line.resumed, line.applied = self.resumed, OperatorRequest.NONE
            if not self.has_failed:
                line.run.conductor.resume(line.run.now_ms())
        line.run.by = self.control.by
        line.applied = line.run.obey(self.control, line.applied)
        if self.has_failed:
            line.stand_by()

    def note(self, line: DrivenLine) -> None:
        """Tell the rota where a line stands, and put down if it has failed."""
        conductor = line.run.conductor
        phase = Phase.HALTED if line.error is not None else line.phase
        self.rota.note(line.number, phase, is_midway=conductor.released > conductor.barrier)
        is_at_fault = line.has_failed and not (conductor.halt is not None and conductor.halt.cause is Cause.OTHERS)
        with self._lock:
            if is_at_fault and line.number not in self.failed:
                self.failed.append(line.number)


class RadioLoop:
    """The lines behind one radio, one of which does one thing at a time."""

    def __init__(self, lines: Sequence[DrivenLine], convoy: Convoy) -> None:
        self._lines = lines
        self._convoy = convoy
        self._next = 0
        self._gone_ms: int | None = None

    @property
    def radio(self) -> Radio:
        """The radio as its first line has it."""
        return self._lines[0].run.radio

    @property
    def is_over(self) -> bool:
        """Whether nothing is left to do here."""
        return self._convoy.is_over or all(line.is_over for line in self._lines)

    @property
    def _who(self) -> str:
        """Its lines, in words."""
        return lines_in_words([line.name for line in self._lines])

    @property
    def now_us(self) -> int:
        """Time by the radio's clock."""
        return self.radio.now_us()

    def turn(self) -> None:
        """Let the next line that has something to do do one thing, or sleep until one has."""
        try:
            if self._gone_ms is not None:
                self._look_for_radio()
            else:
                self._do_one_thing()
        except KeyboardInterrupt:
            self._convoy.control.ask(OperatorRequest.HOLD)
        except RadioGone as gone:
            self._outlive(gone)
        except LinkError as error:
            self._give_up(error)

    def _do_one_thing(self) -> None:
        wake_ms = self.now_us // 1000 + LISTEN_MS
        for _ in self._lines:
            line = self._lines[self._next]
            self._next = (self._next + 1) % len(self._lines)
            if line.is_over:
                continue
            self._convoy.attend(line)
            was_resting = line.is_resting
            action = line.run.step()
            self._convoy.note(line)
            line.seconds = line.seconds if was_resting else line.run.seconds
            if line.is_resting and not was_resting:
                line.tell_end()
            if not isinstance(action, Sleep):
                return
            wake_ms = min(wake_ms, action.until_ms)
        self.radio.sleep_until(wake_ms * 1000)

    # The radio goes away, and comes back

    def _outlive(self, gone: RadioGone) -> None:
        """Wait for the radio, unless it is gone for good or the operator wants out."""
        control = self._convoy.control
        if not gone.may_return or control.request >= OperatorRequest.HOLD:
            self._give_up(gone)
        elif self._gone_ms is None:
            self._gone_ms = self.now_us // 1000
            control.tell(f"{self._who}: {gone.message}; waiting for it to come back")
            for line in self._lines:
                self._convoy.rota.pass_over(line.number)

    def _look_for_radio(self) -> None:
        for line in self._lines:
            line.onlooker.look()
        for line in self._lines:
            line.run.radio.exchange(())
        away_ms, self._gone_ms = self.now_us // 1000 - (self._gone_ms or 0), None
        self._convoy.control.tell(f"{self._who}: the radio is back")
        for line in self._lines:
            if not line.is_over and line.run.return_after(away_ms):
                line.applied, line.is_told = OperatorRequest.NONE, False

    def _give_up(self, error: LinkError) -> None:
        """The radio has ended what was going on behind it; nodes that hear nothing hold by themselves."""
        for line in self._lines:
            if not line.is_over:
                line.run.fail(error)
                line.error = error
                self._convoy.note(line)
                line.tell_end()


def conduct(groups: Sequence[Sequence[DrivenLine]], convoy: Convoy) -> None:
    """Drive all lines, those behind one radio in a group, until each has ended or holds.

    Radios with clocks of their own, which models have, are driven by one thread, the one whose clock is behind first:
    so that what happens at the same time happens together. Each other radio has a thread.
    """
    loops = [RadioLoop(group, convoy) for group in groups]
    modelled = [loop for loop in loops if getattr(loop.radio, "is_virtual", False)]
    teams = [[loop] for loop in loops if loop not in modelled] + ([modelled] if modelled else [])
    if len(teams) == 1:
        _drive(teams[0])
        return
    threads = [threading.Thread(target=_drive_aside, args=(team, convoy), daemon=True) for team in teams]
    for thread in threads:
        thread.start()
    for thread in threads:
        while thread.is_alive():
            with suppress(KeyboardInterrupt):
                thread.join(JOIN_S)
                continue
            convoy.control.ask(OperatorRequest.HOLD)
    if convoy.crash is not None:
        raise convoy.crash


def _drive(loops: Sequence[RadioLoop]) -> None:
    while left := [loop for loop in loops if not loop.is_over]:
        min(left, key=lambda loop: loop.now_us).turn()


def _drive_aside(loops: Sequence[RadioLoop], convoy: Convoy) -> None:
    """As `_drive`, in a thread; what no line foresees ends them all, whose nodes then hold by themselves."""
    try:
        _drive(loops)
    except BaseException as error:
        convoy.crash = error
