"""The executable specification of a node: frames and milliseconds go in, one loaded answer comes out.

The mock display runs this class, and the firmware's C core must agree with it. A node knows the time only from its
callers; where its axes are it knows from a `Plant`. The rules are those of the link protocol,
docs/radio-protocol.md, in the order given there.
"""

from __future__ import annotations

from curveline.radio.node.errands import NodeErrands
from curveline.radio.node.plant import Plant
from curveline.radio.node.state import LIFT, LOST_POSITION, Identity, Memory, NodeSession
from curveline.radio.protocol.codes import (
    CLOCK_SHIFT,
    COUNTER_END,
    EVERY_NODE,
    FLAG_CLEAR,
    FLAG_QUERY,
    FLAG_RESUME,
    HOLD_END,
    OFFERS_END,
    VERSION,
    Fault,
    FrameKind,
    ReadingPage,
    Reject,
    clock_of,
)
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.frames import (
    DriveFrame,
    HelloFrame,
    HomeFrame,
    IdentFrame,
    ReportFrame,
    StatusFrame,
    decode_drive,
    decode_estop,
    decode_hello,
    decode_home,
    decode_stop,
    encode_ident,
    encode_report,
    encode_status,
)
from curveline.radio.protocol.keys import session_key
from curveline.radio.protocol.motion import Axes, config_hash, outside
from curveline.radio.protocol.page_frames import WHO, PageFrame, decode_ask, encode_page
from curveline.radio.protocol.service_frames import ServiceFrame, decode_service, encode_reading
from curveline.radio.protocol.settings_frames import SettingsFrame, decode_settings

Fresh = DriveFrame | HomeFrame | ServiceFrame | SettingsFrame
"""Frames that say when their host last heard of the node."""


class NodeMachine(NodeErrands):
    """State machine of one node; `ack` is the one answer loaded into its radio."""

    def __init__(self, identity: Identity, axes: Axes, plant: Plant, memory: Memory) -> None:
        super().__init__(identity, axes, plant, memory)
        self.ack = b""
        self._hash = config_hash(axes)
        self._handlers = {
            FrameKind.DRIVE: self._on_drive,
            FrameKind.ESTOP: self._on_estop,
            FrameKind.HOME: self._on_home,
            FrameKind.HELLO: self._on_hello,
            FrameKind.PAGE: self._on_ask,
            FrameKind.STOP: self._on_stop,
            FrameKind.SERVICE: self._on_service,
            FrameKind.SETTINGS: self._on_settings,
        }

    def receive(self, now_ms: int, payload: bytes) -> None:
        """Take a payload from the radio; anything but a good frame changes nothing."""
        self.advance(now_ms)
        kind = kind_of(payload)
        if self.leaves or isinstance(kind, Reject):
            return
        if kind in self._handlers and not self.tally.is_flooded(now_ms):
            self._handlers[kind](now_ms, payload)

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

    def _obey(self, now_ms: int, session: NodeSession, frame: DriveFrame) -> None:
        if session.hold_gen & 1:
            self._halt(now_ms)
        elif session.hold_gen > self._lift_above:
            self._silent = self._stopped = False
        self._stage(now_ms, session, frame)
        session.release = max(session.release, frame.release)
        self._start(session)
        self._go_on(now_ms)

    def _session_of(self, payload: bytes) -> NodeSession | None:
        """The live or offered session that a frame names; the tag decides whether it is telling the truth."""
        number = payload[2] | payload[3] << 8
        for session in (self._session, self._pending):
            if session is not None and session.number == number and not session.closed:
                return session
        return None

    def _accept(self, now_ms: int, session: NodeSession, frame: Fresh) -> bool:
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

    def _doubt(self, now_ms: int, session: NodeSession, reject: Reject) -> None:
        """A frame is not under the key of the session that it names, or so old that its clock is taken for another."""
        self.tally.refuse(now_ms, reject)
        self._tell_time(now_ms, session)

    def _tell_time(self, now_ms: int, session: NodeSession) -> None:
        """Load the answer that the session's host looks for, with the time as it is now, and do no more."""
        if session is self._pending:
            self._identify(now_ms, session.hello)
        else:
            self._reload(now_ms)

    def _admit(self, now_ms: int, session: NodeSession, counter: int) -> bool:
        """Whether a frame is newer than all before; if it is, a pending session takes over."""
        if counter <= session.counter or counter >= COUNTER_END:
            self.tally.old_frames += 1
            return False
        if session is self._pending:
            if self.is_turning and not self._owner_gone(now_ms):
                return False
            self._take_over(now_ms, session)
        session.counter = counter
        return True

    def _owner_gone(self, now_ms: int) -> bool:
        owner = self._session
        return owner is None or owner.closed or now_ms >= owner.expires_ms

    def _take_over(self, now_ms: int, session: NodeSession) -> None:
        """The offered session becomes the live one. What was done stays known until the new host stages a step."""
        flags = session.hello.flags
        session.owns_run = bool(flags & FLAG_RESUME) and session.hello.run_tag == self.memory.run_tag
        self._brake(now_ms)
        self._session, self._pending = session, None
        session.heard_ms = now_ms - session.hello.deadman_ms  # an ESTOP may be as old as the offer
        self._lift_above = LIFT if session.stopped else 0
        if not session.owns_run:
            self._silent, self._stopped = False, session.stopped
        if flags & FLAG_CLEAR and self.memory.fault not in LOST_POSITION:
            self.memory.forget_fault()

    def _begin_run(self, session: NodeSession) -> None:
        """The first step that a host stages is of a run of its own: the one before cannot go on any more."""
        self.memory.forget_run()
        self.memory.run_tag = session.hello.run_tag
        session.owns_run = True

    def _stage(self, now_ms: int, session: NodeSession, frame: DriveFrame) -> None:
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

    def _start(self, session: NodeSession) -> None:
        memory = self.memory
        idle = memory.finished == memory.started and not self._moves()
        if idle and memory.staged == memory.started + 1 and session.release >= memory.staged and self._may_move():
            memory.started = memory.staged
            memory.target, memory.move_ms = memory.next_target, memory.next_ms

    def _close(self, now_ms: int, session: NodeSession) -> None:
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

    def _may_home(self, session: NodeSession) -> bool:
        """Whether a host may order it: never in a run of its own, nor while the node is to hold or does anything."""
        memory = self.memory
        held = self._silent or self._stopped or session.hold_gen & 1
        return not (held or session.owns_run or self.is_turning or memory.estop or self.on_trial)

    def _on_service(self, now_ms: int, payload: bytes) -> None:
        session = self._session_of(payload)
        if session is None:
            return
        frame = decode_service(payload, session.key, clock_of(now_ms))
        if isinstance(frame, Reject):
            self._doubt(now_ms, session, frame)
        elif self._accept(now_ms, session, frame):
            self._serve(now_ms, session, frame)
            self._tell(now_ms, session, frame)

    def _on_settings(self, now_ms: int, payload: bytes) -> None:
        session = self._session_of(payload)
        if session is None:
            return
        frame = decode_settings(payload, session.key, clock_of(now_ms))
        if isinstance(frame, Reject):
            self._doubt(now_ms, session, frame)
        elif self._accept(now_ms, session, frame):
            self._change(session, frame)
            look = ServiceFrame(frame.clock, frame.session, frame.counter, page=ReadingPage.SETTINGS)
            self._tell(now_ms, session, look)

    def _tell(self, now_ms: int, session: NodeSession, wanted: ServiceFrame) -> None:
        """Load the page that is wanted."""
        self._schedule()
        self.ack = encode_reading(self._reading(now_ms, session, wanted), session.key)

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
        if self._session is not None:  # nor does the end of a hold that its host has begun, or is about to, lift it
            self._lift_above = max(self._lift_above, min(0xFF, self._session.hold_gen + 2 & ~1))
        if self._pending is not None:
            self._pending.stopped = True
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

    def _offer(self, now_ms: int, hello: HelloFrame) -> None:
        """Answer a HELLO; repeated attempts of one handshake get the same session offered."""
        memory = self.memory
        if self._pending is None or self._pending.hello.handshake != hello.handshake:
            if memory.offers == OFFERS_END - 1:
                return
            memory.offers += 1
            fresh = session_key(self.identity.node_key, hello.handshake, memory.nonce, hello.run_tag)
            self._pending = NodeSession(memory.nonce.session, fresh, hello)
        self._identify(now_ms, hello)

    def _identify(self, now_ms: int, hello: HelloFrame) -> None:
        """Say who the node is, what it offers, and what time it is."""
        ident = IdentFrame(
            node=self.identity.number,
            nonce=self.memory.nonce,
            clock=clock_of(now_ms),
            config_hash=self._hash,
            version=VERSION,
            state=self.state,
            same_run=self.memory.run_tag == hello.run_tag,
            busy=not self._owner_gone(now_ms),
            stopped=self._stopped,
            on_trial=self.on_trial,
        )
        self.ack = encode_ident(ident, self.identity.node_key, hello.handshake)

    def _on_ask(self, now_ms: int, payload: bytes) -> None:
        ask = decode_ask(payload)
        if isinstance(ask, Reject):
            self.tally.refuse(now_ms, ask)
        elif ask.node in (self.identity.number, EVERY_NODE) and ask.page == WHO:
            page = PageFrame(
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
        super()._reload(now_ms)
        session = self._session
        if session is not None:
            self.ack = encode_status(self._status(now_ms, session), session.key)

    def _status(self, now_ms: int, session: NodeSession) -> StatusFrame:
        """What the owner is told; of a run that is not its own it learns nothing here."""
        memory = self.memory
        steps = (memory.finished, memory.started, memory.staged) if session.owns_run else (0, 0, session.order)
        return StatusFrame(
            *(self.identity.number, session.number, session.counter, clock_of(now_ms), *steps),
            *(self.state, session.hold_gen & 0xF, memory.fault, memory.fault_axis, self.plant.positions(now_ms)),
        )

    def _report(self, now_ms: int) -> ReportFrame:
        memory = self.memory
        hold = 0 if self._session is None else self._session.hold_gen & 0xF
        fault_s = (now_ms - memory.fault_ms) // 1000 if memory.fault is not Fault.NONE else 0
        return ReportFrame(
            *(self.identity.number, memory.boot, memory.cause, memory.finished, memory.started, memory.staged),
            *(self.state, hold, memory.fault, memory.fault_axis, self.plant.positions(now_ms)),
            *(memory.unhomed, fault_s, self._stopped, self.is_turning, self.on_trial),
        )
