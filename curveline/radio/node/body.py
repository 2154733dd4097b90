"""What a node does without frames: time passes, axes move and rest, zeros are sought, faults and silence stop it.

Half of the executable specification of a node; what frames bring is the other half, in `machine.py`.
"""

from __future__ import annotations

from curveline.radio.node.plant import Plant, PlantFault
from curveline.radio.node.state import LOST_POSITION, Identity, Memory, NodeSession, NodeTally, with_reason
from curveline.radio.protocol.codes import NOT_HOMED, Counts, ErrandOutcome, Fault, NodeState
from curveline.radio.protocol.motion import Axes, NodeMove, plan_move, rest_ms
from curveline.radio.protocol.settings_frames import TRIAL_MS


class NodeBody:
    """Memory, motors and sessions of one node, and what time brings; `_reload` is told whenever anything changed."""

    def __init__(self, identity: Identity, axes: Axes, plant: Plant, memory: Memory) -> None:
        self.identity = identity
        self.memory = memory
        self.plant = plant
        self.tally = NodeTally()
        self.move: NodeMove | None = None
        self.move_start_ms = 0
        self.jogging = self.turning = False
        self.outcome = ErrandOutcome.NONE
        self.blink_until_ms = 0
        self.on_trial = plant.settings.standing().on_trial
        self.leaves = False
        """Whether the node is about to start anew: it does nothing and hears nothing until then."""
        self.seeks_loader = False
        """Whether it is its loader that is to start."""
        self.trial_ends_ms = 0
        self._axes = axes
        self._session: NodeSession | None = None
        self._pending: NodeSession | None = None
        self._booted = False
        self._silent = memory.started > memory.finished
        self._stopped = False
        self._lift_above = 0
        self._next_ms: int | None = None

    @property
    def state(self) -> NodeState:
        """The most severe of the things that are true."""
        memory = self.memory
        if not self._booted:
            return NodeState.BOOT
        if memory.estop:
            return NodeState.ESTOP
        if memory.homing:
            return NodeState.HOMING
        if memory.fault is not Fault.NONE:
            return NodeState.POSITION_LOST if memory.fault in LOST_POSITION else NodeState.FAULT
        if not memory.homed:
            return NodeState.UNHOMED
        if self._moves():
            return NodeState.MOVING
        if self._stopped or (self._session is not None and self._session.hold_gen & 1):
            return NodeState.HOLD
        return NodeState.HOLD_LINK if self._silent else NodeState.READY

    @property
    def is_turning(self) -> bool:
        """Whether a motor may turn, for whatever reason."""
        return self._moves() or self.memory.homing != 0

    def setpoint(self, now_ms: int) -> Counts:
        """Where the axes should be now [counts]."""
        return self.plant.positions(now_ms) if self.move is None else self.move.at(now_ms - self.move_start_ms)

    def advance(self, now_ms: int) -> None:
        """Let time pass up to `now_ms`: arrivals, faults of the plant and the dead-man happen at their own moment."""
        if not self._booted:
            self._booted = True
            self.trial_ends_ms = self.trial_ends_ms or now_ms + TRIAL_MS
            self._reload(now_ms)
        while self._next_ms is not None and self._next_ms <= now_ms:
            self._wake(self._next_ms)

    def notice(self, now_ms: int) -> None:
        """The plant has news, an arrival or a fault that it could not foretell."""
        self._schedule()
        self.advance(now_ms)

    def start_homing(self, now_ms: int, axes: int) -> None:
        """A person or a host asks the idle node to find the zeros of `axes` (bit 0 for the first).

        Their positions are void from now on, and with them what the node has done of its run.
        """
        memory = self.memory
        if not self._moves() and not memory.homing and not memory.estop and not self.on_trial:
            memory.unhomed = with_reason(memory.unhomed, axes, NOT_HOMED)
            memory.homing = axes
            memory.forget_run()
            self.plant.seek(now_ms, axes)
            self._reload(now_ms)

    def stop_homing(self, now_ms: int) -> None:
        """A person wants the homing to end; what has not found its zero stays without."""
        if self.memory.homing:
            self._abandon_homing(now_ms)
            self._reload(now_ms)

    # What time brings

    def _schedule(self) -> None:
        moments = [self.trial_ends_ms] if self.on_trial else []
        session = self._session
        if session is not None and not session.closed and not self._silent:
            moments.append(session.expires_ms)
        if self.memory.homing and (sought := self.plant.sought()) is not None:
            moments.append(sought.at_ms)
        if self.turning and (turned := self.plant.turned_ms()) is not None:
            moments.append(turned)
        if self.move is not None:
            if (settles := self.plant.settles_ms()) is not None:
                moments.append(settles)
            if (fault := self._coming_fault()) is not None:
                moments.append(fault.at_ms)
        self._next_ms = None if self.leaves else min(moments, default=None)

    def _coming_fault(self) -> PlantFault | None:
        return self.plant.fault() if self.memory.fault is Fault.NONE else None

    def _wake(self, now_ms: int) -> None:
        session, fault = self._session, self._coming_fault()
        if self.on_trial and self.trial_ends_ms <= now_ms:
            self.leaves = True
        if self.move is not None and fault is not None and fault.at_ms <= now_ms:
            self._fail(now_ms, fault.fault, fault.axis)
        settles = self.plant.settles_ms()
        if self.move is not None and settles is not None and settles <= now_ms:
            self._arrive(now_ms, self.move)
        turned = self.plant.turned_ms()
        if self.turning and turned is not None and turned <= now_ms:
            self.turning = False
            self._end_errand(ErrandOutcome.DONE)
        sought = self.plant.sought()
        if self.memory.homing and sought is not None and sought.at_ms <= now_ms:
            self._finish_homing(sought.reasons)
        if session is not None and not session.closed and now_ms >= session.expires_ms:
            self._fall_silent(now_ms)
        self._reload(now_ms)

    def _arrive(self, now_ms: int, move: NodeMove) -> None:
        memory = self.memory
        self.move = None
        if self.jogging:
            self.jogging = False
            is_there = self.plant.positions(now_ms) == move.target
            self._end_errand(ErrandOutcome.DONE if is_there else ErrandOutcome.ENDED)
        elif self.plant.positions(now_ms) == memory.target:
            memory.finished = memory.started
        else:
            memory.move_ms = rest_ms(move)
            self._go_on(now_ms)

    def _finish_homing(self, reasons: tuple[int, int, int]) -> None:
        """The plant is through with the axes it sought; if all are homed now, no fault puts the position in doubt."""
        memory = self.memory
        x, y, z = (
            new if memory.homing >> index & 1 else old
            for index, (new, old) in enumerate(zip(reasons, memory.unhomed, strict=True))
        )
        memory.unhomed, memory.homing = (x, y, z), 0
        if memory.homed and memory.fault in LOST_POSITION:
            memory.forget_fault()

    def _abandon_homing(self, now_ms: int) -> None:
        if self.memory.homing:
            self.memory.homing = 0
            self.plant.give_up(now_ms)

    def _fall_silent(self, now_ms: int) -> None:
        if not self._silent and self._session is not None:
            self._silent = True
            self._lift_above = self._session.hold_gen
            self._halt(now_ms)

    def _fail(self, now_ms: int, fault: Fault, axis: int) -> None:
        memory = self.memory
        if memory.fault is Fault.NONE:
            memory.fault, memory.fault_axis, memory.fault_ms = fault, axis, now_ms
            if fault in LOST_POSITION:
                memory.lose(fault, axis)
        self._end_errand(ErrandOutcome.FAILED)
        self._brake(now_ms)

    # Motion

    def _may_move(self) -> bool:
        memory, session = self.memory, self._session
        able = memory.homed and not (memory.homing or memory.estop or memory.fault or self.on_trial)
        if not able or session is None or session.closed or not session.owns_run:
            return False
        return not (self._silent or self._stopped or session.hold_gen & 1)

    def _go_on(self, now_ms: int) -> None:
        """Set off for the target of the started step, if there is one and nothing forbids it."""
        memory = self.memory
        if not self._moves() and memory.finished < memory.started and self._may_move():
            self.move = plan_move(self.plant.positions(now_ms), memory.target, self._axes, memory.move_ms)
            self.move_start_ms = now_ms
            self.plant.follow(now_ms, now_ms, self.move)

    def _brake(self, now_ms: int) -> None:
        if self.move is not None and self.move.brake_ms is None:
            self.move = self.move.braked(now_ms - self.move_start_ms)
            self.plant.follow(now_ms, self.move_start_ms, self.move)
        if self.turning:
            self.turning = False
            self._end_errand(ErrandOutcome.ENDED)
            self.plant.give_up(now_ms)

    def _end_errand(self, outcome: ErrandOutcome) -> None:
        """What became of the order that is under way, if there is one: the first that is said of it stays."""
        if self.outcome is ErrandOutcome.BUSY:
            self.outcome = outcome

    def _moves(self) -> bool:
        """Whether axes are on their way, in a step or for an errand."""
        return self.move is not None or self.turning

    def _halt(self, now_ms: int) -> None:
        """Whatever turns comes to rest."""
        self._brake(now_ms)
        self._abandon_homing(now_ms)

    def _reload(self, now_ms: int) -> None:
        """Something has changed: find out when time alone will change something next."""
        self._schedule()
