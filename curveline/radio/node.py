"""The executable specification of a node: frames and milliseconds go in, one loaded answer comes out.

The mock display runs this class, and the firmware's C core must agree with it. A node knows the time only from its
callers; where its axes are it knows from a `Plant`. The rules are those of the link protocol,
docs/radio-protocol.md, in the order given there.
"""

from __future__ import annotations

from curveline.radio.frames import (
    COUNTER_END,
    EVERY_NODE,
    FLAG_CLEAR,
    FLAG_QUERY,
    FLAG_RESUME,
    HOLD_END,
    VERSION,
    Counts,
    Drive,
    Fault,
    Hello,
    Ident,
    Kind,
    Reject,
    State,
    Status,
    decode_drive,
    decode_estop,
    decode_hello,
    decode_stop,
    encode_ident,
    encode_status,
    kind_of,
)
from curveline.radio.keys import session_key
from curveline.radio.motion import Axes, Move, config_hash, outside, plan_move, rest_ms
from curveline.radio.nodestate import LOST_POSITION, Identity, Memory, Session, Tally
from curveline.radio.pages import WHO, Page, decode_ask, encode_page
from curveline.radio.plant import Plant, PlantFault


class Node:
    """State machine of one node; `ack` is the one answer loaded into its radio."""

    def __init__(self, identity: Identity, axes: Axes, plant: Plant, memory: Memory) -> None:
        self.identity = identity
        self.memory = memory
        self.plant = plant
        self.tally = Tally()
        self.ack = b""
        self.move: Move | None = None
        self.move_start_ms = 0
        self._axes = axes
        self._hash = config_hash(axes)
        self._session: Session | None = None
        self._pending: Session | None = None
        self._booted = False
        self._silent = memory.started > memory.finished
        self._stopped = False
        self._lift_above = 0
        self._next_ms: int | None = None
        self._handlers = {
            Kind.DRIVE: self._on_drive,
            Kind.ESTOP: self._on_estop,
            Kind.HELLO: self._on_hello,
            Kind.PAGE: self._on_ask,
            Kind.STOP: self._on_stop,
        }

    @property
    def state(self) -> State:
        """The most severe of the things that are true."""
        memory = self.memory
        if not self._booted:
            return State.BOOT
        if memory.estop:
            return State.ESTOP
        if memory.fault is not Fault.NONE:
            return State.POSITION_LOST if memory.fault in LOST_POSITION else State.FAULT
        if not memory.homed:
            return State.HOMING if memory.homing else State.UNHOMED
        if self.move is not None:
            return State.MOVING
        if self._stopped or (self._session is not None and self._session.hold_gen & 1):
            return State.HOLD
        return State.HOLD_LINK if self._silent else State.READY

    def setpoint(self, now_ms: int) -> Counts:
        """Where the axes should be now [counts]."""
        return self.plant.positions(now_ms) if self.move is None else self.move.at(now_ms - self.move_start_ms)

    def advance(self, now_ms: int) -> None:
        """Let time pass up to `now_ms`: arrivals, faults of the plant and the dead-man happen at their own moment."""
        if not self._booted:
            self._booted = True
            self._reload(now_ms)
        while self._next_ms is not None and self._next_ms <= now_ms:
            self._wake(self._next_ms)

    def receive(self, now_ms: int, payload: bytes) -> None:
        """Take a payload from the radio; anything but a good frame changes nothing."""
        self.advance(now_ms)
        kind = kind_of(payload)
        if not isinstance(kind, Reject) and kind in self._handlers and not self.tally.is_flooded(now_ms):
            self._handlers[kind](now_ms, payload)

    def notice(self, now_ms: int) -> None:
        """The plant has news, an arrival or a fault that it could not foretell."""
        self._schedule()
        self.advance(now_ms)

    def start_homing(self, now_ms: int) -> None:
        """A person asks the idle node to find its zero; the position is void until `finish_homing`."""
        if self.move is None and not self.memory.estop:
            self.memory.homed, self.memory.homing = False, True
            self._reload(now_ms)

    def finish_homing(self, now_ms: int) -> None:
        """The zero is found: the position is known again, which also ends a fault that had put it in doubt."""
        if not self.memory.homing:
            return
        self.memory.homed, self.memory.homing = True, False
        if self.memory.fault in LOST_POSITION:
            self.memory.fault, self.memory.fault_axis = Fault.NONE, 0
        self._abandon_run()
        self._reload(now_ms)

    # What time brings

    def _schedule(self) -> None:
        moments = []
        session = self._session
        if session is not None and not session.closed and not self._silent:
            moments.append(session.heard_ms + session.hello.deadman_ms)
        if self.move is not None:
            if (settles := self.plant.settles_ms()) is not None:
                moments.append(settles)
            if (fault := self._coming_fault()) is not None:
                moments.append(fault.at_ms)
        self._next_ms = min(moments, default=None)

    def _coming_fault(self) -> PlantFault | None:
        return self.plant.fault() if self.memory.fault is Fault.NONE else None

    def _wake(self, now_ms: int) -> None:
        session, fault = self._session, self._coming_fault()
        if self.move is not None and fault is not None and fault.at_ms <= now_ms:
            self._fail(now_ms, fault.fault, fault.axis)
        settles = self.plant.settles_ms()
        if self.move is not None and settles is not None and settles <= now_ms:
            self._arrive(now_ms, self.move)
        if session is not None and not session.closed and now_ms >= session.heard_ms + session.hello.deadman_ms:
            self._fall_silent(now_ms)
        self._reload(now_ms)

    def _arrive(self, now_ms: int, move: Move) -> None:
        memory = self.memory
        self.move = None
        if self.plant.positions(now_ms) == memory.target:
            memory.finished = memory.started
        else:
            memory.move_ms = rest_ms(move)
            self._go_on(now_ms)

    def _fall_silent(self, now_ms: int) -> None:
        if not self._silent and self._session is not None:
            self._silent = True
            self._lift_above = self._session.hold_gen
            self._brake(now_ms)

    def _fail(self, now_ms: int, fault: Fault, axis: int) -> None:
        if self.memory.fault is Fault.NONE:
            self.memory.fault, self.memory.fault_axis = fault, axis
            self.memory.homed = self.memory.homed and fault not in LOST_POSITION
        self._brake(now_ms)

    # Motion

    def _may_move(self) -> bool:
        memory, session = self.memory, self._session
        able = memory.homed and not memory.estop and memory.fault is Fault.NONE
        if not able or session is None or session.closed:
            return False
        return not (self._silent or self._stopped or session.hold_gen & 1)

    def _go_on(self, now_ms: int) -> None:
        """Set off for the target of the started step, if there is one and nothing forbids it."""
        memory = self.memory
        if self.move is None and memory.finished < memory.started and self._may_move():
            self.move = plan_move(self.plant.positions(now_ms), memory.target, self._axes, memory.move_ms)
            self.move_start_ms = now_ms
            self.plant.follow(now_ms, now_ms, self.move)

    def _brake(self, now_ms: int) -> None:
        if self.move is not None and self.move.brake_ms is None:
            self.move = self.move.braked(now_ms - self.move_start_ms)
            self.plant.follow(now_ms, self.move_start_ms, self.move)

    # What frames bring

    def _on_drive(self, now_ms: int, payload: bytes) -> None:
        session = self._session_of(payload)
        if session is None:
            return
        frame = decode_drive(payload, session.key)
        if isinstance(frame, Reject):
            self.tally.refuse(now_ms, frame)
            return
        if not self._admit(now_ms, session, frame.node, frame.counter):
            return
        session.hold_gen = max(session.hold_gen, frame.hold_gen)
        if session.hold_gen >= HOLD_END or session.counter == COUNTER_END - 1:
            self._close(now_ms, session)
        else:
            self._obey(now_ms, session, frame)
        self._reload(now_ms)

    def _obey(self, now_ms: int, session: Session, frame: Drive) -> None:
        if session.hold_gen & 1:
            self._brake(now_ms)
        elif session.hold_gen > self._lift_above:
            self._silent = self._stopped = False
        self._stage(now_ms, frame)
        session.release = max(session.release, frame.release)
        self._start(session)
        self._go_on(now_ms)

    def _session_of(self, payload: bytes) -> Session | None:
        """The live or offered session that a frame names; the tag decides whether it is telling the truth."""
        number = payload[2] | payload[3] << 8
        for session in (self._session, self._pending):
            if session is not None and session.number == number and not session.closed:
                return session
        return None

    def _admit(self, now_ms: int, session: Session, number: int, counter: int) -> bool:
        """Whether a frame with a good tag counts; if it does, the dead-man is fed and a pending session takes over."""
        if number != self.identity.number:
            return False
        if counter <= session.counter or counter >= COUNTER_END:
            self.tally.old_counters += 1
            return False
        if session is self._pending:
            if self.move is not None and not self._owner_gone(now_ms):
                return False
            self._take_over(now_ms, session)
        session.counter = counter
        session.heard_ms = now_ms
        return True

    def _owner_gone(self, now_ms: int) -> bool:
        owner = self._session
        return owner is None or owner.closed or now_ms - owner.heard_ms >= owner.hello.deadman_ms

    def _take_over(self, now_ms: int, session: Session) -> None:
        """The offered session becomes the live one; what was done stays known only if the same run is resumed."""
        resumed = bool(session.hello.flags & FLAG_RESUME) and session.hello.run_tag == self.memory.run_tag
        self._brake(now_ms)
        self._session, self._pending = session, None
        self._lift_above = 0
        if not resumed:
            self._abandon_run()
            self._silent = self._stopped = False
            self.memory.run_tag = session.hello.run_tag
        if session.hello.flags & FLAG_CLEAR and self.memory.fault not in LOST_POSITION:
            self.memory.fault, self.memory.fault_axis = Fault.NONE, 0

    def _abandon_run(self) -> None:
        memory = self.memory
        memory.finished = memory.started = memory.staged = 0
        memory.move_ms = 0

    def _stage(self, now_ms: int, frame: Drive) -> None:
        memory = self.memory
        if frame.load_step == 0 or frame.load_step <= memory.started:
            return
        wanted = (frame.load_step, frame.target, frame.move_ms)
        if memory.staged > memory.started:
            if wanted != (memory.staged, memory.next_target, memory.next_ms):
                self._fail(now_ms, Fault.CONFLICT, 0)
        elif frame.load_step != memory.started + 1:
            self._fail(now_ms, Fault.CONFLICT, 0)
        elif axis := outside(self._axes, frame.target):
            self._fail(now_ms, Fault.LIMIT, axis)
        else:
            memory.staged = frame.load_step
            memory.next_target, memory.next_ms = frame.target, frame.move_ms

    def _start(self, session: Session) -> None:
        memory = self.memory
        idle = memory.finished == memory.started and self.move is None
        if idle and memory.staged == memory.started + 1 and session.release >= memory.staged and self._may_move():
            memory.started = memory.staged
            memory.target, memory.move_ms = memory.next_target, memory.next_ms

    def _close(self, now_ms: int, session: Session) -> None:
        """The host gives the node back; its last answer stays loaded."""
        session.closed = True
        self._silent = self.memory.started > self.memory.finished
        self._brake(now_ms)

    def _on_estop(self, now_ms: int, payload: bytes) -> None:
        session = self._session_of(payload)
        if session is None:
            return
        frame = decode_estop(payload, session.key)
        if isinstance(frame, Reject):
            self.tally.refuse(now_ms, frame)
        elif self._admit(now_ms, session, frame.node, frame.counter):
            self.memory.estop = True
            self._brake(now_ms)
            self._reload(now_ms)

    def _on_stop(self, now_ms: int, payload: bytes) -> None:
        frame = decode_stop(payload, self.identity.site.stop_key)
        if isinstance(frame, Reject):
            self.tally.refuse(now_ms, frame)
            return
        self._stopped = True
        self._lift_above = max(self._lift_above, self._session.hold_gen if self._session else 0)
        self._brake(now_ms)
        self._reload(now_ms)

    def _on_hello(self, now_ms: int, payload: bytes) -> None:
        key = self.identity.node_key
        hello = decode_hello(payload, key)
        if isinstance(hello, Reject):
            self.tally.refuse(now_ms, hello)
        elif hello.node == self.identity.number and hello.flags & FLAG_QUERY:
            status = self._status(now_ms, 0, hello.nonce & 0xFFFFFFFF)
            self.ack = encode_status(status, key, hello.handshake)
        elif hello.node == self.identity.number:
            self._offer(now_ms, hello)

    def _offer(self, now_ms: int, hello: Hello) -> None:
        """Answer a HELLO; repeated attempts of one handshake get the same session offered."""
        memory, key = self.memory, self.identity.node_key
        pending = self._pending
        if pending is None or pending.hello.handshake != hello.handshake:
            memory.offers = memory.offers % 0xFFFF + 1
            fresh = session_key(key, hello.handshake, self._nonce(), hello.run_tag)
            self._pending = Session(memory.offers, fresh, hello)
        ident = Ident(
            node=self.identity.number,
            session=memory.offers,
            nonce=self._nonce(),
            chip=self.identity.chip,
            firmware=self.identity.firmware,
            config_hash=self._hash,
            version=VERSION,
            state=self.state,
            same_run=memory.run_tag == hello.run_tag,
            busy=not self._owner_gone(now_ms),
        )
        self.ack = encode_ident(ident, key, hello.handshake)

    def _on_ask(self, now_ms: int, payload: bytes) -> None:
        ask = decode_ask(payload)
        if isinstance(ask, Reject):
            self.tally.refuse(now_ms, ask)
        elif ask.node in (self.identity.number, EVERY_NODE) and ask.page == WHO:
            page = Page(
                *(self.identity.number, self.identity.chip, self.identity.firmware),
                *(self.memory.boot, self._hash),
                state=self.state,
                bad_tags=self.tally.bad_tags,
                old_counters=self.tally.old_counters,
            )
            self.ack = encode_page(page, ask.handshake)

    def _nonce(self) -> int:
        """Boot number, offers made since, and noise taken at boot: never the same twice for one chip."""
        return self.memory.boot << 48 | self.memory.offers << 32 | self.memory.noise

    # What is answered

    def _reload(self, now_ms: int) -> None:
        """Load a fresh answer after a change of state, and find out when the next one is due."""
        self._schedule()
        if self._session is not None:
            status = self._status(now_ms, self._session.number, self._session.counter)
            self.ack = encode_status(status, self._session.key)

    def _status(self, now_ms: int, session: int, echo: int) -> Status:
        memory = self.memory
        facts = (memory.boot, memory.finished, memory.started, memory.staged)
        hold = 0 if self._session is None else self._session.hold_gen & 0xF
        position = self.plant.positions(now_ms)
        return Status(
            *(self.identity.number, session, echo, *facts),
            *(self.state, hold, memory.fault, memory.fault_axis, position),
        )
