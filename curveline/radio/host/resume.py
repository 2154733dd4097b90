"""Going on with a run that was broken off: what its record says of it, and whether the nodes agree.

A record is believed only as far as it tells one possible story: start, then release 1, barrier 1, release 2..., with
pauses, halts and resumes between them. What the nodes did is asked of the nodes themselves; the record says what they
may have done at most.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from curveline.drive_settings import AXES
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.actions import Record
from curveline.radio.host.journal import LOOK
from curveline.radio.host.peer import Peer
from curveline.radio.host.preflight import START_TOLERANCE, check_fit, node_facts, run_tag
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.protocol.codes import BOOT_END, FLAG_CLEAR, FLAG_RESUME, Counts
from curveline.radio.protocol.frames import IdentFrame, StatusFrame
from curveline.units import told_apart

RADIO = "radio"
"""What a record gives as the cause when the radio itself failed."""
CLEARED = frozenset({Cause.STALL, Cause.DRIVER})
"""Faults that leave the position known: resuming after one says that its reason is gone, and clears it."""
FINAL = frozenset(
    {Cause.REBOOT, Cause.LOST, Cause.BROWN_OUT, Cause.NOT_HOMED, Cause.ESTOP, Cause.LATCHED, Cause.AHEAD, Cause.BEHIND}
    | {Cause.RUNAWAY, Cause.CONFLICT, Cause.LIMIT, Cause.OTHER_RUN}
)
"""Causes after which a run cannot go on: its steps no longer begin where the nodes are, or know that they are."""
SEND_AGAIN = "send the shape again: that plans from where the display stands"


@dataclass(frozen=True)
class ResumePoint:
    """How far a run may have come by its record: last step released, last barrier passed, and in which boots.

    `clears` is the node that halted the run with a fault which its resumption ends, 0 for none.
    """

    released: int
    barrier: int
    boots: tuple[int, ...]
    clears: int = 0

    def flags(self, node: int) -> int:
        """What the HELLO to a node says of the resumption."""
        return FLAG_RESUME | FLAG_CLEAR * (node == self.clears)


def can_resume(halt: Halt) -> bool:
    """Whether a run halted for this reason can go on once the reason is gone."""
    return halt.cause not in FINAL


def resume_point(plan: Plan, records: Sequence[Mapping[str, Any]]) -> ResumePoint:
    """Where to go on with `plan`; InvalidInput if its record does not allow it or cannot be believed."""
    if not records or records[0].get("type") != "start":
        raise InvalidInput("there is nothing to resume: the run was ended before any node was told to move", SEND_AGAIN)
    story = _Story(plan, records[0])
    for number, record in enumerate(records[1:], start=2):
        story.take(number, record)
    return story.point()


class _Story:
    """A run as its record tells it, one record after the other."""

    def __init__(self, plan: Plan, start: Record) -> None:
        self._run = f"{run_tag(plan):016x}"
        if start.get("run") != self._run:
            raise InvalidInput("the record of the run is not of the plan that is kept beside it", SEND_AGAIN)
        boots = start.get("boots")
        if not isinstance(boots, list) or not all(type(boot) is int and 0 <= boot < BOOT_END for boot in boots):
            raise _nonsense(1)
        if len(boots) != plan.drive.node_count:
            raise _nonsense(1)
        self._steps = len(plan.steps)
        self._boots = tuple(boots)
        self._released = 0
        self._barrier = 0
        self._ended = False
        self._halt: Record | None = None

    def take(self, number: int, record: Record) -> None:
        """The record `number` (from 1)."""
        kind = record.get("type")
        if kind == LOOK:
            return
        if kind == "halt":
            self._halt = record
        elif kind == "resume" and not self._ended:
            self._halt = None
        elif self._halt is not None or not self._follows(kind, record):
            raise _nonsense(number)

    def _follows(self, kind: object, record: Record) -> bool:
        """Whether a record fits the story so far; one whose writing was interrupted may stand there twice."""
        step = record.get("step")
        if kind == "release" and type(step) is int and step == self._barrier + 1 <= self._steps:
            self._released = step
        elif kind == "barrier" and type(step) is int and step == self._released > 0:
            self._barrier = step
            return record.get("boots") == list(self._boots)
        elif kind == "end":
            self._ended = self._barrier == self._steps
            return self._ended
        elif kind == "start":
            return self._released == 0 and record.get("run") == self._run
        else:
            return kind == "pause"
        return True

    @property
    def _hurt(self) -> int:
        """The node that the last halt names, 0 if it names none."""
        node = None if self._halt is None else self._halt.get("node")
        return node if type(node) is int else 0

    def point(self) -> ResumePoint:
        """Where the run can go on; InvalidInput if it cannot."""
        if self._ended:
            raise InvalidInput("there is nothing to resume: the run has been done to its end")
        cause = _cause_of(self._halt)
        if cause in FINAL:
            message = self._halt.get("message") if self._halt is not None else None
            is_fit = isinstance(message, str) and message.isprintable() and message
            why = message if is_fit else f"the cause was {cause.name.lower()}"
            raise InvalidInput(f"this run cannot be resumed after its halt: {why}", SEND_AGAIN)
        return ResumePoint(self._released, self._barrier, self._boots, self._hurt if cause in CLEARED else 0)


def _cause_of(halt: Record | None) -> Cause | None:
    """The cause that a record names; None for the radio's own failure, and for one that this release does not know."""
    name = None if halt is None else halt.get("cause")
    return Cause.__members__.get(name.upper()) if isinstance(name, str) else None


def _nonsense(number: int) -> InvalidInput:
    return InvalidInput(f"the record of the run cannot be believed: entry {number} does not follow from the others")


def check_identity(point: ResumePoint, ident: IdentFrame) -> Halt | None:
    """Whether a node kept its power and its run since the record was written; nothing has been changed in it yet."""
    boot = point.boots[ident.node - 1]
    if ident.boot != boot:
        return Halt(Cause.REBOOT, ident.node, detail=f"boot number {ident.boot} instead of {boot}")
    if point.released and not ident.same_run:
        return Halt(Cause.OTHER_RUN, ident.node)
    return None


def check_progress(plan: Plan, point: ResumePoint, peers: Sequence[Peer]) -> Halt | None:
    """Whether all nodes are where the record allows them to be; call it once all have a status at rest."""
    for peer in peers:
        status = peer.status
        assert status is not None
        if (halt := check_fit(status, 0)) is not None:
            return halt
        if (furthest := max(status.started, status.finished)) > point.released:
            return Halt(Cause.AHEAD, peer.number, detail=str(furthest))
        if status.finished < point.barrier:
            detail = f"it has finished step {status.finished}, the record says {point.barrier}"
            return Halt(Cause.BEHIND, peer.number, detail=detail)
        if (halt := _check_place(plan, status)) is not None:
            return halt
    return None


def _check_place(plan: Plan, status: StatusFrame) -> Halt | None:
    """Whether a node stands where its last step ended, or on its way through the one that it has begun."""
    origin, goal = (_place(plan, step, status.node) for step in (status.finished, status.started))
    for axis, (begin, end, found) in enumerate(zip(origin, goal, status.position, strict=True)):
        if not min(begin, end) - START_TOLERANCE <= found <= max(begin, end) + START_TOLERANCE:
            drive = plan.drive.axes[axis]
            wanted = begin if abs(found - begin) < abs(found - end) else end
            here, there = told_apart(drive.value(found), drive.value(wanted), 2, "f")
            detail = f"its {AXES[axis]} stands at {here} instead of {there}"
            return Halt(Cause.BEHIND, status.node, detail=detail)
    return None


def _place(plan: Plan, step: int, node: int) -> Counts:
    """Where a node is to be after a step, 0 for the start."""
    return (plan.steps[step - 1].targets if step else plan.start)[node - 1].counts


def resume_record(point: ResumePoint, peers: Sequence[Peer]) -> Record:
    """What the record of a run says when another process goes on with it."""
    return {
        "type": "resume",
        "step": point.barrier + 1,
        "sessions": [peer.session for peer in peers],
        **node_facts(peers),
    }
