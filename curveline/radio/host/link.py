"""Runs the conductor over a radio: sends plans, reads what the nodes say."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import partial
from typing import Protocol

from curveline.drive_settings import AXES, DriveSettings
from curveline.errors import LinkError
from curveline.plan_file import Plan
from curveline.radio.host.actions import Action, Finished, Phase, Policy, Poll, Record, Sleep, Write
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.journal import Journal, ReopenedJournal
from curveline.radio.host.node_status import SILENT, NodeStatus, status_of_peer, status_of_report
from curveline.radio.host.peer import Peer
from curveline.radio.host.preflight import journal_bytes
from curveline.radio.host.queries import fresh_nonce, insist
from curveline.radio.host.resume import RADIO, resume_point
from curveline.radio.host.scan import explain
from curveline.radio.host.stop_causes import Halt, named_display
from curveline.radio.interface import Radio, RadioGone
from curveline.radio.protocol.codes import FLAG_QUERY
from curveline.radio.protocol.frames import HelloFrame, decode_report

LISTEN_MS = 100
"""A longer sleep is cut into such, so that whoever asks for a stop is heard between them."""


class OperatorRequest(IntEnum):
    """What an operator can ask of a running send, in order of urgency."""

    NONE = 0
    PAUSE = 1
    HOLD = 2
    ESTOP = 3


def ignore(news: object) -> None:
    """Whoever looks away."""


def _nothing() -> None:
    pass


class Control:
    """The operator's hand on a run; safe to use from a signal handler.

    With `waits` a paused run goes on polling until `resume`, `hold` or an emergency stop; without, it ends there.
    `tell` is given a line when the radio goes away, when it is back, and when somebody else asks for something. `by` is
    who that was.
    """

    def __init__(
        self, policy: Policy | None = None, *, waits: bool = False, tell: Callable[[str], None] = ignore
    ) -> None:
        self.policy = policy or Policy()
        self.waits = waits
        self.tell = tell
        self.request = OperatorRequest.NONE
        self.resumes = False
        self.by = ""
        self._inbox: Callable[[], None] = _nothing

    def ask(self, request: OperatorRequest, by: str = "") -> None:
        """Pause at the barrier, hold now, or emergency stop; a lesser wish than the present one is ignored.

        `by` names who asks, if it is not the operator of this process.
        """
        self.request = max(self.request, request)
        if by:
            self.by = by
            self.tell(f"asked to {request.name.lower()} by {by}")

    def attend(self, inbox: Callable[[], None]) -> None:
        """Have `inbox` called between any two frames, and at least every 0.1 s, to look for what others ask."""
        self._inbox = inbox

    def listen(self) -> None:
        """Look for what others ask."""
        self._inbox()

    def escalate(self) -> OperatorRequest:
        """The next more urgent request, as on every further Ctrl-C; returns it."""
        self.ask(OperatorRequest(min(self.request + 1, OperatorRequest.ESTOP)))
        return self.request

    def resume(self) -> None:
        """Go on after a pause."""
        self.request, self.resumes, self.by = OperatorRequest.NONE, True, ""


@dataclass(frozen=True)
class Progress:
    """News of one node during a send; `fraction` is how much of its present step it has done."""

    seconds: float
    phase: Phase
    step: int
    steps: int
    status: NodeStatus
    fraction: float


@dataclass(frozen=True)
class RunReport:
    """How a send went; `outcome` is "done", "paused" or "halted", `steps_done` counts barriers passed by all nodes."""

    outcome: str
    steps_done: int
    steps: int
    seconds: float  # [s]
    nodes: tuple[NodeStatus, ...]  # left to right, those that were heard under this run


Observer = Callable[[Progress], None]


class Keeper(Protocol):
    """The record of a run, as its run needs it."""

    def reserve(self, size: int) -> None:
        """See Journal."""
        ...

    def append(self, record: Record) -> None:
        """See Journal."""
        ...


class Halted(LinkError):
    """A run that its conductor halted, once all that can be held are held; `halt` says why."""

    code = "halted"

    def __init__(self, halt: Halt) -> None:
        super().__init__(halt.message, halt.hint, halt.node)
        self.halt = halt
        self.cause = halt.cause.name.lower().replace("_", "-")


def send_plan(
    plan: Plan, radio: Radio, journal: Journal, observer: Observer = ignore, control: Control | None = None
) -> RunReport:
    """Take the nodes through `plan`; LinkError, with node and hint, once all that can be held are held."""
    control = control or Control()
    conductor = Conductor(plan, radio.site, fresh_nonce(), control.policy)
    return LinkRun(conductor, radio, journal, observer).conduct(control)


def resume_plan(
    plan: Plan, radio: Radio, journal: ReopenedJournal, observer: Observer = ignore, control: Control | None = None
) -> RunReport:
    """Go on with `plan` where its record leaves it; InvalidInput if the record forbids it, else as `send_plan`."""
    control = control or Control()
    point = resume_point(plan, journal.records)
    conductor = Conductor(plan, radio.site, fresh_nonce(), control.policy, point)
    return LinkRun(conductor, radio, journal, observer).conduct(control)


def read_status(radio: Radio, drive: DriveSettings, display: str = "") -> list[NodeStatus]:
    """What every node says now; read-only, so that it disturbs no run. A silent node is in the list, too.

    `display` is how advice names the display, by its own name if empty.
    """
    named = display or drive.display
    return [_query(radio, number, address, named) for number, address in enumerate(drive.addresses, start=1)]


class LinkRun:
    """One run in progress: asks its conductor what to do and does it, one thing at a time."""

    def __init__(self, conductor: Conductor, radio: Radio, journal: Keeper, observer: Observer) -> None:
        self.conductor = conductor
        self.radio = radio
        self.journal = journal
        self.by = ""
        """Who asked for what is recorded next, if it was not the operator of this process."""
        self._report = _Reporter(conductor, radio, observer)

    def conduct(self, control: Control) -> RunReport:
        """Go on until the run has ended, or is paused with nobody to wait for."""
        self.journal.reserve(journal_bytes(self.conductor.plan))
        try:
            self._go(control)
        except LinkError as error:
            self.fail(error)
            raise
        return self.end()

    def step(self) -> Action:
        """Do one thing, whatever is to be done but sleep; what it was."""
        action = self.conductor.next(self.now_ms())
        if isinstance(action, Poll):
            self._poll(action)
        elif isinstance(action, Write):
            self._store(action)
        return action

    def obey(self, control: Control, applied: OperatorRequest) -> OperatorRequest:
        """Do what the operator asks for beyond what was `applied` already; what is applied now."""
        now_ms, request = self.now_ms(), control.request
        if request > applied:
            if request is OperatorRequest.PAUSE:
                self.conductor.pause()
            elif request is OperatorRequest.HOLD:
                self.conductor.hold(now_ms)
            else:
                self.conductor.estop(now_ms)
        return request

    def return_after(self, away_ms: int) -> bool:
        """The radio is back; whether the run begins anew, since the nodes have held by themselves meanwhile.

        They are taken over again, as by `resume_plan`.
        """
        successor = self.conductor.successor(away_ms, fresh_nonce())
        if successor is None:
            return False
        successor.turns = self.conductor.turns
        self.conductor = self._report.conductor = successor
        return True

    def fail(self, error: LinkError) -> None:
        """Put down that the radio itself has ended the run."""
        with suppress(LinkError):  # the record may be what failed
            halt = {"type": "halt", "cause": RADIO, "node": error.node, "message": error.message}
            self.journal.append({**halt, **self._circumstances()})

    def end(self) -> RunReport:
        """How the run has ended; Halted if its conductor halted it."""
        if self.conductor.halt is not None:
            found = explain(self.radio, self.conductor.plan.drive, self.conductor.halt)
            raise Halted(replace(found, display=named_display(self.conductor.plan)))
        return self.report()

    @property
    def seconds(self) -> float:
        """Time since the run began."""
        return self._report.seconds

    def report(self) -> RunReport:
        """How far the run has come."""
        conductor, outcomes = self.conductor, {Phase.DONE: "done", Phase.PAUSED: "paused"}
        return RunReport(
            outcome=outcomes.get(conductor.phase, "halted"),
            steps_done=conductor.barrier,
            steps=len(conductor.plan.steps),
            seconds=self.seconds,
            nodes=tuple(status_of_peer(peer) for peer in conductor.peers if peer.status is not None),
        )

    def _go(self, control: Control) -> None:
        applied = OperatorRequest.NONE
        while True:
            try:
                applied = self._attend(control, applied)
                action = self.step()
                if isinstance(action, Sleep):
                    self.radio.sleep_until(min(action.until_ms, self.now_ms() + LISTEN_MS) * 1000)
                if isinstance(action, Finished):
                    return
                if self.conductor.phase is Phase.PAUSED and not (
                    control.waits and control.request < OperatorRequest.HOLD
                ):
                    return
            except KeyboardInterrupt:
                control.ask(OperatorRequest.HOLD)
            except RadioGone as gone:
                if self._outlive(gone, control):
                    applied = OperatorRequest.NONE

    def _outlive(self, gone: RadioGone, control: Control) -> bool:
        """Wait for the radio, unless it is gone for good or the operator wants out; whether the run then began anew."""
        begin_ms = self.now_ms()
        if gone.may_return:
            control.tell(f"{gone.message}; waiting for it to come back")
        while control.request < OperatorRequest.HOLD and gone.may_return:
            self._listen(control)
            try:
                self.radio.exchange(())
            except RadioGone as still:
                gone = still
            else:
                control.tell("the radio is back")
                return self.return_after(self.now_ms() - begin_ms)
        raise gone

    def _attend(self, control: Control, applied: OperatorRequest) -> OperatorRequest:
        self._listen(control)
        if control.resumes:
            control.resumes = False
            self.conductor.resume(self.now_ms())
            return OperatorRequest.NONE
        return self.obey(control, applied)

    def _listen(self, control: Control) -> None:
        control.listen()
        self.by = control.by

    def _poll(self, action: Poll) -> None:
        answers = self.radio.exchange([(send.address, send.payload) for send in action.sends])
        now_ms = self.now_ms()
        for send, answer in zip(action.sends, answers, strict=True):
            if self.conductor.heard(now_ms, send.node, answer.payload, answer.retries) is not None:
                self._report.tell(send.node)

    def _store(self, action: Write) -> None:
        try:
            self.journal.append({**action.record, **self._circumstances()})
        except LinkError as error:
            self.conductor.unwritten(self.now_ms(), error.message)
        else:
            self.conductor.written(self.now_ms())

    def _circumstances(self) -> Record:
        """What a record says of its writing: when and by which process, and who else asked for what it says."""
        by = {"by": self.by} if self.by else {}
        return {"at": time.time(), "process": os.getpid(), **by}

    def now_ms(self) -> int:
        """Time by the radio's clock."""
        return self.radio.now_us() // 1000


class _Reporter:
    """Turns what the conductor knows of a node into news for an observer."""

    def __init__(self, conductor: Conductor, radio: Radio, observer: Observer) -> None:
        self.conductor = conductor
        self._radio = radio
        self._observer = observer
        self._begin_us = radio.now_us()

    @property
    def seconds(self) -> float:
        """Time since the run began."""
        return (self._radio.now_us() - self._begin_us) / 1e6

    def tell(self, node: int) -> None:
        """News of `node`."""
        conductor = self.conductor
        peer, steps = conductor.peers[node - 1], len(conductor.plan.steps)
        step = min(conductor.step, steps)
        status, fraction = status_of_peer(peer), self._fraction(peer, step)
        self._observer(Progress(self.seconds, conductor.phase, step, steps, status, fraction))

    def _fraction(self, peer: Peer, step: int) -> float:
        """How much of the way of `step` the axis with the longest one has behind it."""
        if peer.finished >= step:
            return 1.0
        if peer.started < step or peer.status is None:
            return 0.0
        plan = self.conductor.plan
        goal = plan.steps[step - 1].targets[peer.number - 1].counts
        origin = (plan.steps[step - 2].targets if step > 1 else plan.start)[peer.number - 1].counts
        axis = max(range(len(AXES)), key=lambda each: abs(goal[each] - origin[each]))
        way = goal[axis] - origin[axis]
        return min(1.0, max(0.0, (peer.status.position[axis] - origin[axis]) / way)) if way else 0.0


def _query(radio: Radio, number: int, address: str, display: str) -> NodeStatus:
    """Ask one node how it is."""
    nonce = fresh_nonce()
    peer = Peer(number, address, radio.site.node_key(number), nonce)
    question = HelloFrame(number, nonce, 0, 0, 0, FLAG_QUERY)
    report = insist(radio, peer, question, partial(decode_report, key=peer.node_key, nonce=nonce))
    if report is None:
        return NodeStatus(number, address, SILENT, link=peer.tally)
    return replace(status_of_report(report, address, display), link=peer.tally)
