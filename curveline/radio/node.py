"""The executable specification of a node: frames and milliseconds go in, one loaded answer comes out.

The mock display runs this class, and the firmware's C core must agree with it. A node knows the time only from its
callers; where its axes are it knows from a `Plant`. The rules are those of the link protocol,
docs/radio-protocol.md, in the order given there.
"""

from __future__ import annotations

from curveline.radio.frames import (
    CLOCK_SHIFT,
    COUNTER_END,
    EVERY_NODE,
    FLAG_CLEAR,
    FLAG_QUERY,
    FLAG_RESUME,
    HOLD_END,
    NOT_HOMED,
    OFFERS_END,
    VERSION,
    Counts,
    Drive,
    Fault,
    Hello,
    Home,
    Ident,
    Kind,
    Reject,
    Report,
    State,
    Status,
    clock_of,
    decode_drive,
    decode_estop,
    decode_hello,
    decode_home,
    decode_stop,
    encode_ident,
    encode_report,
    encode_status,
    kind_of,
)
from curveline.radio.keys import session_key
from curveline.radio.motion import Axes, Move, config_hash, outside, plan_move, rest_ms
from curveline.radio.nodestate import LOST_POSITION, Identity, Memory, Session, Tally, with_reason
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
            Kind.HOME: self._on_home,
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
        if memory.homing:
            return State.HOMING
        if memory.fault is not Fault.NONE:
            return State.POSITION_LOST if memory.fault in LOST_POSITION else State.FAULT
        if not memory.homed:
            return State.UNHOMED
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

    def start_homing(self, now_ms: int, axes: int) -> None:
        """A person or a host asks the idle node to find the zeros of `axes` (bit 0 for the first).

        Their positions are void from now on, and with them what the node has done of its run.
        """
        memory = self.memory
        if self.move is None and not memory.homing and not memory.estop:
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
        moments = []
        session = self._session
        if session is not None and not session.closed and not self._silent:
            moments.append(session.expires_ms)
        if self.memory.homing and (sought := self.plant.sought()) is not None:
            moments.append(sought.at_ms)
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
        sought = self.plant.sought()
        if self.memory.homing and sought is not None and sought.at_ms <= now_ms:
            self._finish_homing(sought.reasons)
        if session is not None and not session.closed and now_ms >= session.expires_ms:
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
        self._brake(now_ms)

    # Motion

    def _may_move(self) -> bool:
        memory, session = self.memory, self._session
        able = memory.homed and not memory.homing and not memory.estop and memory.fault is Fault.NONE
        if not able or session is None or session.closed or not session.owns_run:
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

    def _halt(self, now_ms: int) -> None:
        """Whatever turns comes to rest."""
        self._brake(now_ms)
        self._abandon_homing(now_ms)

    # What frames bring

    def _on_drive(self, now_ms: int, payload: bytes) -> None:
        session = self._session_of(payload)
        if session is None:
            return
        frame = decode_drive(payload, session.key, clock_of(now_ms))
        if isinstance(frame, Reject):
            self._doubt(now_ms, session, frame)
            return
        if not self._accept(now_ms, session, frame):
            return
        session.hold_gen = max(session.hold_gen, frame.hold_gen)
        if session.hold_gen >= HOLD_END or session.counter == COUNTER_END - 1:
            self._close(now_ms, session)
        else:
            self._obey(now_ms, session, frame)
        self._reload(now_ms)

    def _obey(self, now_ms: int, session: Session, frame: Drive) -> None:
        if session.hold_gen & 1:
            self._halt(now_ms)
        elif session.hold_gen > self._lift_above:
            self._silent = self._stopped = False
        self._stage(now_ms, session, frame)
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

    def _accept(self, now_ms: int, session: Session, frame: Drive | Home) -> bool:
        """Whether a frame with a good tag counts; if it does, the dead-man is fed.

        Its host must have heard of the node lately when it sent it, else somebody may have kept it back.
        """
        said_ms = frame.clock << CLOCK_SHIFT
        if now_ms >= said_ms + session.hello.deadman_ms:
            self.tally.old_frames += 1
            self._tell_time(now_ms, session)
            return False
        if not self._admit(now_ms, session, frame.counter):
            return False
        session.heard_ms = max(session.heard_ms, said_ms)
        return True

    def _doubt(self, now_ms: int, session: Session, reject: Reject) -> None:
        """A frame is not under the key of the session that it names, or so old that its clock is taken for another."""
        self.tally.refuse(now_ms, reject)
        self._tell_time(now_ms, session)

    def _tell_time(self, now_ms: int, session: Session) -> None:
        """Load the answer that the session's host looks for, with the time as it is now, and do no more."""
        if session is self._pending:
            self._identify(now_ms, session.hello)
        else:
            self._reload(now_ms)

    def _admit(self, now_ms: int, session: Session, counter: int) -> bool:
        """Whether a frame is newer than all before; if it is, a pending session takes over."""
        if counter <= session.counter or counter >= COUNTER_END:
            self.tally.old_frames += 1
            return False
        if session is self._pending:
            if (self.move is not None or self.memory.homing) and not self._owner_gone(now_ms):
                return False
            self._take_over(now_ms, session)
        session.counter = counter
        return True

    def _owner_gone(self, now_ms: int) -> bool:
        owner = self._session
        return owner is None or owner.closed or now_ms >= owner.expires_ms

    def _take_over(self, now_ms: int, session: Session) -> None:
        """The offered session becomes the live one. What was done stays known until the new host stages a step."""
        flags = session.hello.flags
        session.owns_run = bool(flags & FLAG_RESUME) and session.hello.run_tag == self.memory.run_tag
        self._brake(now_ms)
        self._session, self._pending = session, None
        session.heard_ms = now_ms - session.hello.deadman_ms  # an ESTOP may be as old as the offer
        self._lift_above = 0
        if not session.owns_run:
            self._silent = self._stopped = False
        if flags & FLAG_CLEAR and self.memory.fault not in LOST_POSITION:
            self.memory.forget_fault()

    def _begin_run(self, session: Session) -> None:
        """The first step that a host stages is of a run of its own: the one before cannot go on any more."""
        self.memory.forget_run()
        self.memory.run_tag = session.hello.run_tag
        session.owns_run = True

    def _stage(self, now_ms: int, session: Session, frame: Drive) -> None:
        memory = self.memory
        if frame.load_step == 0:
            return
        if not session.owns_run:
            self._begin_run(session)
        if frame.load_step <= memory.started:
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
        self._halt(now_ms)

    def _on_home(self, now_ms: int, payload: bytes) -> None:
        session = self._session_of(payload)
        if session is None:
            return
        frame = decode_home(payload, session.key, clock_of(now_ms))
        if isinstance(frame, Reject):
            self._doubt(now_ms, session, frame)
        elif self._accept(now_ms, session, frame):
            if frame.order > session.order and self._may_home(session):
                session.order = frame.order
                self.start_homing(now_ms, frame.axes)
            self._reload(now_ms)

    def _may_home(self, session: Session) -> bool:
        """Whether a host may order it: never in a run of its own, nor while the node is to hold or does anything."""
        memory = self.memory
        held = self._silent or self._stopped or session.hold_gen & 1
        return not (held or session.owns_run or self.move is not None or memory.homing or memory.estop)

    def _on_estop(self, now_ms: int, payload: bytes) -> None:
        session = self._session_of(payload)
        if session is None:
            return
        frame = decode_estop(payload, session.key)
        if isinstance(frame, Reject):
            self.tally.refuse(now_ms, frame)
        elif frame.node == self.identity.number and self._admit(now_ms, session, frame.counter):
            self.memory.estop = True
            self._halt(now_ms)
            self._reload(now_ms)

    def _on_stop(self, now_ms: int, payload: bytes) -> None:
        frame = decode_stop(payload, self.identity.site.stop_key)
        if isinstance(frame, Reject):
            self.tally.refuse(now_ms, frame)
            return
        self._stopped = True
        self._lift_above = max(self._lift_above, self._session.hold_gen if self._session else 0)
        self._halt(now_ms)
        self._reload(now_ms)

    def _on_hello(self, now_ms: int, payload: bytes) -> None:
        key = self.identity.node_key
        hello = decode_hello(payload, key)
        if isinstance(hello, Reject):
            self.tally.refuse(now_ms, hello)
        elif hello.node == self.identity.number and hello.flags & FLAG_QUERY:
            self.ack = encode_report(self._report(now_ms), key, hello.handshake)
        elif hello.node == self.identity.number:
            self._offer(now_ms, hello)

    def _offer(self, now_ms: int, hello: Hello) -> None:
        """Answer a HELLO; repeated attempts of one handshake get the same session offered."""
        memory = self.memory
        if self._pending is None or self._pending.hello.handshake != hello.handshake:
            if memory.offers == OFFERS_END - 1:
                return
            memory.offers += 1
            fresh = session_key(self.identity.node_key, hello.handshake, memory.nonce, hello.run_tag)
            self._pending = Session(memory.nonce.session, fresh, hello)
        self._identify(now_ms, hello)

    def _identify(self, now_ms: int, hello: Hello) -> None:
        """Say who the node is, what it offers, and what time it is."""
        ident = Ident(
            node=self.identity.number,
            nonce=self.memory.nonce,
            clock=clock_of(now_ms),
            config_hash=self._hash,
            version=VERSION,
            state=self.state,
            same_run=self.memory.run_tag == hello.run_tag,
            busy=not self._owner_gone(now_ms),
        )
        self.ack = encode_ident(ident, self.identity.node_key, hello.handshake)

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
                old_frames=self.tally.old_frames,
            )
            self.ack = encode_page(page, ask.handshake)

    # What is answered

    def _reload(self, now_ms: int) -> None:
        """Load a fresh answer after a change of state, and find out when the next one is due."""
        self._schedule()
        session = self._session
        if session is not None:
            self.ack = encode_status(self._status(now_ms, session), session.key)

    def _status(self, now_ms: int, session: Session) -> Status:
        """What the owner is told; of a run that is not its own it learns nothing here."""
        memory = self.memory
        steps = (memory.finished, memory.started, memory.staged) if session.owns_run else (0, 0, 0)
        return Status(
            *(self.identity.number, session.number, session.counter, clock_of(now_ms), *steps),
            *(self.state, session.hold_gen & 0xF, memory.fault, memory.fault_axis, self.plant.positions(now_ms)),
        )

    def _report(self, now_ms: int) -> Report:
        memory = self.memory
        hold = 0 if self._session is None else self._session.hold_gen & 0xF
        fault_s = (now_ms - memory.fault_ms) // 1000 if memory.fault is not Fault.NONE else 0
        return Report(
            *(self.identity.number, memory.boot, memory.cause, memory.finished, memory.started, memory.staged),
            *(self.state, hold, memory.fault, memory.fault_axis, self.plant.positions(now_ms)),
            *(memory.unhomed, fault_s),
        )
