"""The host's state machine: time and frames come in, frames and journal records go out. No I/O, no clock.

The caller does what `next` says, one thing at a time: send a frame and report the answer with `heard`, write a record
and report it with `written`, sleep, or stop. A step is released only after its record is on disk; see the link
protocol, docs/radio-protocol.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from curveline.errors import InvalidInput
from curveline.plan import AXES, Plan
from curveline.radio import BATCH
from curveline.radio.actions import Action, Finished, Phase, Policy, Poll, Record, Send, Sleep, Write
from curveline.radio.frames import FLAG_CLEAR, FLAG_TAKEOVER, HOLD_END, Counts, Hello, Ident, State, Status
from curveline.radio.halts import Cause, Halt
from curveline.radio.keys import Site
from curveline.radio.motion import axes_of, config_hash
from curveline.radio.peer import Peer
from curveline.radio.preflight import (
    check_fit,
    check_ident,
    check_start,
    check_targets,
    loads_of,
    node_facts,
    run_tag,
    start_record,
)

NO_LOAD: tuple[int, Counts, int] = (0, (0, 0, 0), 0)
ENDED = frozenset({Phase.DONE, Phase.HALTED})
STOPPING = frozenset({Phase.PAUSING, Phase.HALTING})
UNCLAIMED = frozenset({Phase.DISCOVER, Phase.PREFLIGHT})
WATCHED = frozenset({Phase.STAGING, Phase.RELEASED, Phase.PAUSING, Phase.PAUSED})
UNREACHABLE = frozenset({Cause.SILENT, Cause.REBOOT, Cause.TAKEN})
"""Causes after which the node at fault will not answer under its session any more."""
DEADMAN_LIMIT_MS = 5000
CYCLES = 10
"""Poll cycles without a word after which a node counts as lost."""
STRANGE = 3
"""Answers in a row that are no status, after which a node is asked who it is."""


class Conductor:
    """Takes a plan from barrier to barrier; `phase`, `step`, `released`, `barrier`, `halt` and `peers` tell how far."""

    def __init__(self, plan: Plan, site: Site, nonce: int, policy: Policy | None = None) -> None:
        count = plan.drive.node_count
        if len(site.chips) != count:
            raise InvalidInput(f"the plan is for {count} nodes, but the radio reaches {len(site.chips)}")
        axes = axes_of(plan.drive)
        check_targets(plan, axes)
        self.plan = plan
        self.policy = policy or Policy()
        self.phase = Phase.DISCOVER
        self.step = 1
        self.released = 0
        self.barrier = 0
        self.halt: Halt | None = None
        self.run_tag = run_tag(plan)
        self.peers = tuple(
            Peer(number, address, site.node_key(number), nonce)
            for number, address in enumerate(plan.drive.addresses, start=1)
        )
        self._chips = site.chips
        self._loads = loads_of(plan)
        cycle_ms = max(self.policy.poll_ms, 2 * count)
        self._silence_ms = min(DEADMAN_LIMIT_MS, max(self.policy.silence_ms, CYCLES * cycle_ms))
        flags = FLAG_TAKEOVER * self.policy.takeover | FLAG_CLEAR * self.policy.clear_faults
        self._hello = Hello(0, 0, self.run_tag, config_hash(axes), self._silence_ms, flags)
        self._hold_gen = 0
        self._estop = False
        self._claimed = False
        self._pause_wanted = False
        self._entered_ms: int | None = None
        self._moving_ms = 0
        self._resume_to = Phase.STAGING
        self._writing: tuple[Record, Callable[[int], None]] | None = None

    # Requests of the operator

    def pause(self) -> None:
        """Hold at the next barrier."""
        self._pause_wanted = True

    def hold(self, now_ms: int) -> None:
        """Hold now, wherever the nodes are; before the first step is staged that is a pause at the barrier."""
        self._pause_wanted = True
        if self.phase in (Phase.STAGING, Phase.RELEASED):
            self._hold_all(now_ms)

    def resume(self, now_ms: int) -> None:
        """Go on after a pause, or forget the wish for one."""
        self._pause_wanted = False
        if self.phase is Phase.PAUSED and self._hold_gen + 1 >= HOLD_END:
            self.fail(now_ms, Halt(Cause.WORN, step=self.step))
        elif self.phase is Phase.PAUSED:
            self._hold_gen += 1
            self._enter(self._resume_to, now_ms)

    def estop(self, now_ms: int) -> None:
        """Stop every node until its power is cycled."""
        if self.phase not in ENDED and not self._estop:
            self._estop = True
            self.fail(now_ms, Halt(Cause.ESTOP, step=self.step))
            self._enter(Phase.HALTING, now_ms)  # again, if nodes were only being held

    def fail(self, now_ms: int, halt: Halt) -> None:
        """Hold all nodes and end the run with this reason, unless it is ending for another one already."""
        if self.halt is None and self.phase not in ENDED:
            self.halt = halt
            if halt.cause in UNREACHABLE:
                self.peers[halt.node - 1].gone = True
            self._writing = None
            self._hold_gen = HOLD_END if self.phase in UNCLAIMED else self._hold_gen | 1
            self._enter(Phase.HALTING, now_ms)

    # What the caller does and reports

    def next(self, now_ms: int) -> Action:
        """The one thing to do now."""
        if self._entered_ms is None:
            self._enter(Phase.DISCOVER, now_ms)
        if self._writing is None:
            self._proceed(now_ms)
        if self._writing is not None:
            return Write(self._writing[0])
        if self.phase in ENDED:
            return Finished()
        waiting = sorted(self._audience(), key=_due)
        due = [peer for peer in waiting[:BATCH] if peer.due_ms <= now_ms]
        if not due:
            return Sleep(waiting[0].due_ms)
        return Poll(tuple(Send(peer.number, peer.address, self._frame(peer, now_ms)) for peer in due))

    def written(self, now_ms: int) -> None:
        """The record of the last Write is on disk."""
        if self._writing is not None:
            commit = self._writing[1]
            self._writing = None
            commit(now_ms)

    def unwritten(self, now_ms: int, why: str) -> None:
        """The record of the last Write could not be stored: nothing further is released, all nodes hold."""
        if self.phase is Phase.HALTING:
            self.written(now_ms)
        else:
            self.fail(now_ms, Halt(Cause.JOURNAL, step=self.step, detail=why))

    def heard(self, now_ms: int, node: int, payload: bytes | None, retries: int = 0) -> Status | None:
        """What came back for a frame of the last Poll, None if nothing; returns the node's status if it proves one."""
        peer = self.peers[node - 1]
        peer.tally.polls += 1
        peer.tally.retries += retries
        peer.unheard += 1
        if payload is None:
            peer.tally.lost += 1
            peer.due_ms = now_ms + (self.policy.lost_poll_ms if self.is_lost(peer, now_ms) else self.policy.retry_ms)
            return None
        peer.tally.answered += 1
        peer.due_ms = now_ms + self.policy.poll_ms
        fact = peer.take(payload)
        if isinstance(fact, Status):
            peer.strange, peer.unheard, peer.heard_ms = 0, 0, now_ms
            self._judge(now_ms, peer)
            return fact
        peer.strange += 1
        if peer.strange <= STRANGE or self.phase in UNCLAIMED:
            peer.due_ms = now_ms + self.policy.retry_ms
        if isinstance(fact, Ident):
            self._identify(now_ms, peer, fact)
        return None

    def is_lost(self, peer: Peer, now_ms: int) -> bool:
        """Whether a node has been polled long enough without a word from it."""
        return peer.unheard >= CYCLES and now_ms - peer.heard_ms > self._silence_ms

    # What an answer means

    def _identify(self, now_ms: int, peer: Peer, ident: Ident) -> None:
        peer.ident_ms = now_ms
        if self.phase is Phase.DISCOVER:
            peer.busy = ident.busy and not self.policy.takeover
            halt = check_ident(ident, peer, self._chips[peer.number - 1], self._hello.config_hash)
            if halt is not None:
                self.fail(now_ms, halt)
            elif not peer.busy:
                peer.accept(ident, self.run_tag)
        elif ident.boot != peer.boot:
            detail = f"boot number {ident.boot} instead of {peer.boot}"
            self.fail(now_ms, Halt(Cause.REBOOT, peer.number, self.step, detail))

    def _judge(self, now_ms: int, peer: Peer) -> None:
        """Halt on anything in a node's newest status that a running plan does not allow."""
        status = peer.status
        if status is None or self.phase not in WATCHED:
            return
        halt = check_fit(status, self.step)
        if status.boot != peer.boot:
            halt = Halt(Cause.REBOOT, peer.number, self.step, f"boot number {status.boot} instead of {peer.boot}")
        elif peer.started > self.released:
            halt = Halt(Cause.AHEAD, peer.number, self.step, str(peer.started))
        elif status.state is State.HOLD_LINK:
            halt = Halt(Cause.HELD, peer.number, self.step)
        elif status.state is State.HOLD and not status.hold_low & 1:
            halt = Halt(Cause.STOPPED, peer.number, self.step)
        if halt is not None:
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
        elif self._since(now_ms) > self.policy.budget_ms:
            self.fail(now_ms, _why_missing(missing))

    def _preflight(self, now_ms: int) -> None:
        answered = [peer for peer in self.peers if peer.status is not None and peer.status.state is not State.MOVING]
        if len(answered) == len(self.peers):
            if (halt := check_start(self.plan, self.peers)) is not None:
                self.fail(now_ms, halt)
            else:
                self._write(start_record(self.plan, self.peers, self.run_tag), self._begin_staging)
        elif self._since(now_ms) > self.policy.budget_ms:
            self.fail(now_ms, _why_missing([peer for peer in self.peers if peer not in answered]))

    def _begin_staging(self, now_ms: int) -> None:
        self._enter(Phase.STAGING, now_ms)

    def _stage(self, now_ms: int) -> None:
        if self._pause_wanted:
            self._hold_all(now_ms)
        elif self.step > len(self.plan.steps):
            self._write({"type": "end", **node_facts(self.peers)}, self._close)
        elif all(peer.staged >= self.step for peer in self.peers):
            self._write({"type": "release", "step": self.step}, self._release)
        elif self._since(now_ms) > self._silence_ms + self.policy.budget_ms:
            late = next(peer for peer in self.peers if peer.staged < self.step)
            self.fail(now_ms, Halt(Cause.DEADLINE, late.number, self.step, "it has not taken its target"))

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
            known = [peer for peer in late if not self.is_lost(peer, now_ms)]
            if known:
                self.fail(now_ms, Halt(Cause.DEADLINE, known[0].number, self.step, self._behind(known[0])))

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
            self._write(record, self._paused)
        elif self.phase is Phase.HALTING and (resting or self._since(now_ms) > self.policy.settle_ms):
            why = self.halt or Halt(Cause.ESTOP, step=self.step)
            record = {"type": "halt", "cause": why.cause.name.lower(), "node": why.node, "step": why.step}
            self._write({**record, "message": why.message, **node_facts(self.peers)}, self._halted)

    def _rests(self, peer: Peer) -> bool:
        """Whether a node has answered this phase's frames and stands still, or cannot be asked any more."""
        status = peer.status
        if peer.gone:
            return True
        if status is None or status.echo < peer.mark:
            return False
        return status.state is State.ESTOP if self._estop else status.state is not State.MOVING

    def _paused(self, now_ms: int) -> None:
        self._enter(Phase.PAUSED, now_ms)

    def _halted(self, now_ms: int) -> None:
        self._enter(Phase.HALTED, now_ms)

    def _close(self, now_ms: int) -> None:
        self._hold_gen = HOLD_END
        self._enter(Phase.CLOSING, now_ms)

    def _watch(self, now_ms: int) -> None:
        for peer in self.peers:
            silent_ms = now_ms - peer.heard_ms
            if silent_ms > self._silence_ms + self.policy.budget_ms and self.is_lost(peer, now_ms):
                taken = now_ms - peer.ident_ms < self._silence_ms
                detail = f" any more, for {silent_ms / 1000:.1f} s"
                cause = Cause.TAKEN if taken else Cause.SILENT
                self.fail(now_ms, Halt(cause, peer.number, self.step, detail))

    # Frames

    def _audience(self) -> Sequence[Peer]:
        if self.phase is Phase.DISCOVER:
            return [peer for peer in self.peers if peer.ident is None]
        if self.phase is Phase.CLOSING:
            return [peer for peer in self.peers if peer.status is None or peer.status.echo < peer.mark]
        return self.peers

    def _frame(self, peer: Peer, now_ms: int) -> bytes:
        if self.phase is Phase.DISCOVER:
            return peer.hello(self._hello)
        strange = peer.strange >= STRANGE or now_ms - peer.heard_ms > self.policy.probe_ms
        if strange and self.phase in WATCHED and peer.tally.polls & 1:
            return peer.hello(self._hello)
        if self._estop:
            return peer.estop()
        return peer.drive(self.released, self._hold_gen, self._load(peer))

    def _load(self, peer: Peer) -> tuple[int, Counts, int]:
        """The step after the one that the node has started: it may be staged while that one is still being done."""
        if self.phase not in WATCHED or peer.started >= len(self._loads):
            return NO_LOAD
        return self._loads[peer.started][peer.number - 1]

    def _write(self, record: Record, commit: Callable[[int], None]) -> None:
        self._writing = (record, commit)

    def _behind(self, peer: Peer) -> str:
        """Which axis of a late node is how far from its target."""
        if peer.status is None or peer.started < self.step:
            return "it has not set off"
        goal = self.plan.steps[self.step - 1].targets[peer.number - 1].counts
        gaps = (want - found for want, found in zip(goal, peer.status.position, strict=True))
        left = [drive.value(gap) for drive, gap in zip(self.plan.drive.axes, gaps, strict=True)]
        far = max(range(len(AXES)), key=lambda axis: abs(left[axis]))
        return f"its {AXES[far]} has {abs(left[far]):.1f} {'deg' if AXES[far] == 'bias' else 'mm'} to go"


def _due(peer: Peer) -> int:
    return peer.due_ms


def _why_missing(missing: Sequence[Peer]) -> Halt:
    """The best explanation of why nodes could not be taken over, for the first of them."""
    peer = missing[0]
    if peer.busy or peer.status is not None:
        return Halt(Cause.BUSY, peer.number)
    if not peer.tally.answered:
        return Halt(Cause.SILENT, peer.number)
    return Halt(Cause.UNTRUSTED if peer.ident is None else Cause.TAKEN, peer.number)
