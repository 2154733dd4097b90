"""The host's state machine: time and frames come in, frames and journal records go out. No I/O, no clock.

The caller does what `next` says, one thing at a time: send a frame and report the answer with `heard`, write a record
and report it with `written`, sleep, or stop. A step is released only after its record is on disk; see the link
protocol, docs/radio-protocol.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.actions import Action, Finished, Phase, Policy, Poll, Record, Send, Sleep, Write
from curveline.radio.host.peer import NO_LOAD, STRANGE, Peer
from curveline.radio.host.phases import ENDED, GOING, STOPPING, UNCLAIMED, WATCHED
from curveline.radio.host.polling import Pace
from curveline.radio.host.preflight import (
    check_ident,
    check_running,
    check_start,
    check_targets,
    halt_record,
    loads_of,
    node_facts,
    run_tag,
    start_record,
    why_late,
    why_missing,
    why_silent,
)
from curveline.radio.host.resume import ResumePoint, check_identity, check_progress, resume_record
from curveline.radio.host.stop_causes import UNREACHABLE, Cause, Halt
from curveline.radio.host.turns import AtOnce, Turns
from curveline.radio.protocol.codes import HOLD_END, TURNING, Counts, NodeState
from curveline.radio.protocol.frames import HelloFrame, IdentFrame, StatusFrame, StopFrame, encode_stop
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import axes_of, config_hash


class Conductor:
    """Takes a plan from barrier to barrier; `phase`, `step`, `released`, `barrier`, `halt` and `peers` tell how far.

    `turns` says when it may begin and move, where other runs go on beside it.
    """

    turns: Turns = AtOnce()

    def __init__(
        self, plan: Plan, site: Site, nonce: int, policy: Policy | None = None, resume: ResumePoint | None = None
    ) -> None:
        """`resume` is where to go on with a run that was broken off; without it a new one begins."""
        count = plan.drive.node_count
        if len(site.chips) != count:
            raise InvalidInput(f"the plan is for {count} nodes, but the radio reaches {len(site.chips)}")
        axes = axes_of(plan.drive)
        check_targets(plan)
        self.plan = plan
        self.policy = policy or Policy()
        self.phase = Phase.DISCOVER
        self.step = 1 if resume is None else resume.barrier + 1
        self.released = self.barrier = 0
        self.halt: Halt | None = None
        self.run_tag = run_tag(plan)
        self.peers = tuple(
            Peer(number, address, site.node_key(number), nonce)
            for number, address in enumerate(plan.drive.addresses, start=1)
        )
        self._site = site
        self._stop = encode_stop(StopFrame(0), site.stop_key)
        self._loads = loads_of(plan)
        self._pace = Pace(self.policy, count, plan.drive.data_rate)
        self._hello = HelloFrame(0, 0, self.run_tag, config_hash(axes), self._pace.deadman_ms, self.policy.flags)
        self._point = self._resumed = resume
        self._hold_gen = 0 if resume is None else 1
        self._estop = False
        self._claimed = False
        self._pause_wanted = self._hold_wanted = False
        self._entered_ms: int | None = None
        self._awake_ms = self._moving_ms = 0
        self._resume_to = Phase.STAGING
        self._writing: tuple[Record, Callable[[int], None]] | None = None

    # Requests of the operator

    def pause(self) -> None:
        """Hold at the next barrier."""
        self._pause_wanted = True

    def hold(self, now_ms: int) -> None:
        """Hold now, wherever the nodes are; before the first step is staged that is a pause at the barrier."""
        self._pause_wanted = self._hold_wanted = True
        if self.phase in GOING:
            self._hold_all(now_ms)

    def resume(self, now_ms: int) -> None:
        """Go on after a pause, or forget the wish for one."""
        self._pause_wanted = self._hold_wanted = False
        if self.phase is Phase.PAUSED and self._hold_gen + 1 >= HOLD_END:
            self.fail(now_ms, Halt(Cause.WORN, step=self.step))
        elif self.phase is Phase.PAUSED:
            self._hold_gen += 1
            self._enter(self._resume_to, now_ms)

    def estop(self, now_ms: int) -> None:
        """Stop every node until its power is cycled."""
        if self.phase not in ENDED and not self._estop:
            self._estop = True
            self.fail(now_ms, Halt(Cause.UNTAKEN if self.phase is Phase.DISCOVER else Cause.ESTOP, step=self.step))
            self._enter(Phase.HALTING, now_ms)  # again, if nodes were only being held

    def fail(self, now_ms: int, halt: Halt) -> None:
        """Hold all nodes and end the run with this reason, unless it is ending for another one already."""
        if self.halt is None and self.phase not in ENDED:
            self.halt = halt
            for peer in self.peers if halt.cause in UNREACHABLE else ():
                peer.gone = peer.gone or halt.node in (0, peer.number)
            self._writing = None
            self._hold_gen = HOLD_END if self.phase in UNCLAIMED else self._hold_gen | 1
            self._enter(Phase.HALTING, now_ms)

    def successor(self, away_ms: int, nonce: int) -> Conductor | None:
        """Who goes on if the radio was away for so long that the nodes hold by themselves; None if this one can."""
        if away_ms <= self._pace.silence_ms or self.phase not in GOING | UNCLAIMED:
            return None
        here = ResumePoint(self.released, self.barrier, tuple(peer.boot for peer in self.peers))
        point = here if self.phase in GOING else self._point
        return Conductor(self.plan, self._site, nonce, self.policy, point)

    # What the caller does and reports

    def next(self, now_ms: int) -> Action:
        """The one thing to do now."""
        if self._entered_ms is None:
            self._enter(Phase.DISCOVER, now_ms)
        self._notice(now_ms, "as if suspended")
        if self._writing is None:
            self._proceed(now_ms)
        if self._writing is not None:
            return Write(self._writing[0])
        if self.phase in ENDED:
            return Finished()
        audience = self._audience()
        due = self._pace.batch(audience, now_ms)
        if not due:
            self._awake_ms = min(peer.due_ms for peer in audience)
            return Sleep(self._awake_ms)
        return Poll(tuple(Send(peer.number, peer.address, self._frame(peer, now_ms)) for peer in due))

    def written(self, now_ms: int) -> None:
        """The record of the last Write is on disk."""
        if self._writing is not None:
            commit = self._writing[1]
            self._writing = None
            commit(now_ms)
        self._notice(now_ms, "while a record was being stored")

    def unwritten(self, now_ms: int, why: str) -> None:
        """The record of the last Write could not be stored: nothing further is released, all nodes hold."""
        if self.phase is Phase.HALTING:
            self.written(now_ms)
        else:
            self.fail(now_ms, Halt(Cause.JOURNAL, step=self.step, detail=why))

    def heard(self, now_ms: int, node: int, payload: bytes | None, retries: int = 0) -> StatusFrame | None:
        """What came back for a frame of the last Poll, None if nothing; returns the node's status if it proves one."""
        self._notice(now_ms, "as if suspended")
        peer = self.peers[node - 1]
        peer.tally.count(payload, retries)
        peer.unheard += 1
        if payload is None:
            self._pace.after_loss(self.peers, peer, now_ms)
            return None
        self._pace.after_answer(peer, now_ms)
        newest = peer.newest
        fact = peer.take(payload)
        if isinstance(fact, StatusFrame):
            if peer.newest > newest:
                peer.strange, peer.unheard, peer.heard_ms = 0, 0, now_ms
            self._judge(now_ms, peer)
            return fact
        peer.strange, peer.ident_ms = peer.strange + 1, now_ms
        if peer.strange <= STRANGE or self.phase in UNCLAIMED:
            peer.due_ms = now_ms + self.policy.retry_ms
        if isinstance(fact, IdentFrame):
            self._identify(now_ms, peer, fact)
        return None

    # What an answer means

    def _identify(self, now_ms: int, peer: Peer, ident: IdentFrame) -> None:
        if self.phase is Phase.DISCOVER:
            peer.unheard, peer.heard_ms = 0, now_ms
            peer.busy = ident.busy and not (self.policy.takeover and ident.state not in TURNING)
            halt = check_ident(ident, peer, self._hello.config_hash)
            if halt is None and self._point is not None:
                halt = check_identity(self._point, ident)
            if halt is not None:
                self.fail(now_ms, halt)
            elif peer.busy:
                peer.due_ms = now_ms + self.policy.lost_poll_ms  # every question costs its owner an answer
            else:
                peer.accept(ident, self.run_tag)
        elif ident.boot != peer.boot:
            detail = f"boot number {ident.boot} instead of {peer.boot}"
            self.fail(now_ms, Halt(Cause.REBOOT, peer.number, self.step, detail))
        elif self.phase is Phase.PREFLIGHT and peer.is_replaced_by(ident):
            if ident.stopped and not peer.was_stopped:
                self.fail(now_ms, Halt(Cause.STOPPED, peer.number))
            peer.accept(ident, self.run_tag)

    def _judge(self, now_ms: int, peer: Peer) -> None:
        """Halt on anything in a node's newest status that a running plan does not allow."""
        if self.phase in WATCHED and (halt := check_running(peer, self.step, self.released)) is not None:
            self.fail(now_ms, halt)

    # Phases

    def _enter(self, phase: Phase, now_ms: int) -> None:
        """Begin a phase: every node is polled at once, and what it echoes tells if it has heard of the new one."""
        if phase is Phase.DISCOVER:
            for peer in self.peers:
                peer.heard_ms = now_ms
        self.phase = phase
        self._entered_ms = now_ms
        for peer in self.peers:
            peer.due_ms = now_ms
            peer.mark = peer.counter + 1

    def _since(self, now_ms: int) -> int:
        return now_ms - (self._entered_ms or 0)

    def _proceed(self, now_ms: int) -> None:
        if self.phase in WATCHED:
            self._watch(now_ms)
        if self.phase is Phase.DISCOVER:
            self._discover(now_ms)
        elif self.phase is Phase.PREFLIGHT:
            self._preflight(now_ms)
        elif self.phase is Phase.STAGING:
            self._stage(now_ms)
        elif self.phase is Phase.RELEASED:
            self._await_barrier(now_ms)
        elif self.phase in STOPPING:
            self._await_rest(now_ms)
        elif self.phase is Phase.CLOSING and (not self._audience() or self._since(now_ms) > self.policy.settle_ms):
            self._enter(Phase.DONE, now_ms)

    def _discover(self, now_ms: int) -> None:
        missing = [peer for peer in self.peers if peer.ident is None]
        if not missing:
            self._claimed = True
            self._enter(Phase.PREFLIGHT, now_ms)
        elif self._since(now_ms) > self._pace.patience_ms(missing):
            self.fail(now_ms, why_missing(missing, len(self.peers)))

    def _preflight(self, now_ms: int) -> None:
        answered = [peer for peer in self.peers if peer.status and peer.status.state is not NodeState.MOVING]
        if len(answered) == len(self.peers):
            self._check_in(now_ms)
        elif self._since(now_ms) > self.policy.budget_ms:
            self.fail(now_ms, why_missing([peer for peer in self.peers if peer not in answered], len(self.peers)))

    def _check_in(self, now_ms: int) -> None:
        point = self._point
        halt = check_start(self.plan, self.peers) if point is None else check_progress(self.plan, point, self.peers)
        if halt is not None:
            self.fail(now_ms, halt)
        elif not self.turns.may_begin():
            return
        elif point is None:
            self._write(start_record(self.plan, self.peers, self.run_tag), partial(self._enter, Phase.STAGING))
        else:
            self._write(resume_record(point, self.peers), self._go_on)

    def _go_on(self, now_ms: int) -> None:
        """Lift the hold under which the nodes were taken over, and take up the run where its record leaves it."""
        assert self._point is not None
        self.released, self.barrier = self._point.released, self._point.barrier
        self._point = None
        self._hold_gen += 1
        self._enter(Phase.RELEASED if self.released > self.barrier else Phase.STAGING, now_ms)
        if self._hold_wanted:
            self._hold_all(now_ms)

    def _stage(self, now_ms: int) -> None:
        if self._pause_wanted:
            self._hold_all(now_ms)
        elif self.step > len(self.plan.steps):
            self._write({"type": "end", **node_facts(self.peers)}, self._close)
        elif not (late := [peer for peer in self.peers if peer.staged < self.step]):
            if self.turns.may_move():
                self._write({"type": "release", "step": self.step}, self._release)
        elif self._since(now_ms) > self._pace.silence_ms + self.policy.budget_ms:
            self.fail(now_ms, Halt(Cause.DEADLINE, late[0].number, self.step, "it has not taken its target"))

    def _release(self, now_ms: int) -> None:
        self.released = self.step
        self._moving_ms = 0
        self._enter(Phase.RELEASED, now_ms)

    def _await_barrier(self, now_ms: int) -> None:
        late = [peer for peer in self.peers if peer.finished < self.step]
        allowed_ms = 1500.0 * self.plan.steps[self.step - 1].seconds + self.policy.slack_ms
        if not late:
            self._write({"type": "barrier", "step": self.step, **node_facts(self.peers)}, self._pass_barrier)
        elif self._moving_ms + self._since(now_ms) > allowed_ms:
            for peer in late:
                if not self._pace.is_lost(peer, now_ms):
                    self.fail(now_ms, why_late(self.plan, self.step, peer))

    def _pass_barrier(self, now_ms: int) -> None:
        self.barrier = self.step
        self.step += 1
        self._enter(Phase.STAGING, now_ms)

    def _hold_all(self, now_ms: int) -> None:
        self._resume_to = self.phase
        if self.phase is Phase.RELEASED:
            self._moving_ms += self._since(now_ms)
        self._hold_gen |= 1
        self._writing = None
        self._enter(Phase.PAUSING, now_ms)

    def _await_rest(self, now_ms: int) -> None:
        resting = not self._claimed or all(self._rests(peer) for peer in self.peers)
        if self.phase is Phase.PAUSING and resting:
            record = {"type": "pause", "step": self.step, "hold": self._hold_gen, **node_facts(self.peers)}
            self._write(record, partial(self._enter, Phase.PAUSED))
        elif self.phase is Phase.HALTING and (resting or self._since(now_ms) > self.policy.settle_ms):
            assert self.halt is not None
            if self._point is None:
                self._write(halt_record(self.halt, self.peers), partial(self._enter, Phase.HALTED))
            else:
                self._enter(Phase.HALTED, now_ms)  # what was not gone on with keeps its record as it was

    def _rests(self, peer: Peer) -> bool:
        """Whether a node has answered this phase's frames and stands still, or cannot be asked any more."""
        status = peer.status
        if peer.gone:
            return True
        if status is None or status.echo < peer.mark:
            return False
        return status.state is NodeState.ESTOP if self._estop else status.state is not NodeState.MOVING

    def _close(self, now_ms: int) -> None:
        self._hold_gen = HOLD_END
        self._enter(Phase.CLOSING, now_ms)

    def _watch(self, now_ms: int) -> None:
        """Halt for a node that has not been heard for too long, or that answers but no longer under this session."""
        lost = [peer for peer in self.peers if self._pace.is_lost(peer, now_ms)]
        for peer in lost:
            is_another = now_ms - peer.ident_ms < self._pace.silence_ms
            is_over = now_ms - peer.heard_ms > self._pace.silence_ms + self.policy.budget_ms
            if is_another and peer.strange > 2 * STRANGE:
                self.fail(now_ms, Halt(Cause.TAKEN, peer.number, self.step))
            elif is_over:
                self.fail(now_ms, why_silent(peer, now_ms, self.step, are_all=len(lost) == len(self.peers)))

    def _notice(self, now_ms: int, excuse: str) -> None:
        """Halt if the host itself was away for so long that the nodes have held by themselves."""
        away_ms, self._awake_ms = now_ms - self._awake_ms, now_ms
        if away_ms > self._pace.silence_ms and self.phase in GOING:
            self.fail(now_ms, Halt(Cause.SUSPENDED, step=self.step, detail=f"for {away_ms / 1000:.1f} s, {excuse}"))

    # Frames

    def _audience(self) -> Sequence[Peer]:
        if self.phase is Phase.DISCOVER:
            return [peer for peer in self.peers if peer.ident is None]
        if self.phase is Phase.CLOSING:
            return [peer for peer in self.peers if peer.status is None or peer.status.echo < peer.mark]
        return self.peers

    def _frame(self, peer: Peer, now_ms: int) -> bytes:
        if self.phase is Phase.DISCOVER:
            return self._greeting(peer)
        strange = peer.strange >= STRANGE or now_ms - peer.heard_ms > self.policy.probe_ms
        if strange and self.phase in WATCHED | {Phase.PREFLIGHT} and peer.tally.polls & 1:
            return self._greeting(peer)
        if self._estop:
            return self._stop if strange and peer.tally.polls & 1 else peer.estop()
        return peer.drive(self.released, self._hold_gen, self._load(peer))

    def _greeting(self, peer: Peer) -> bytes:
        resumed = self._resumed.flags(peer.number) if self._resumed else 0
        return peer.hello(replace(self._hello, flags=self._hello.flags | resumed))

    def _load(self, peer: Peer) -> tuple[int, Counts, int]:
        """The step after the one that the node has started: it may be staged while that one is still being done."""
        if self.phase not in WATCHED or peer.started >= len(self._loads):
            return NO_LOAD
        return self._loads[peer.started][peer.number - 1]

    def _write(self, record: Record, commit: Callable[[int], None]) -> None:
        self._writing = (record, commit)
