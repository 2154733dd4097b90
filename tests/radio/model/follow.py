"""Runs the real host and nodes and holds every step of theirs against the model: what it does not allow is an error.

The state of a real node or host is reduced to the model's variables before and after each event. What only the
checker knows is carried along, so that the model's own invariants are checked on real runs, too.
"""

from __future__ import annotations

from random import Random

from curveline.radio.host.actions import Action, Phase, Policy, Poll, Write
from curveline.radio.host.stop_causes import Cause
from curveline.radio.mock.air import Heard, Weather
from curveline.radio.node.state import NodeSession
from curveline.radio.protocol.codes import CLOCK_SHIFT, FLAG_QUERY, FLAG_RESUME, FrameKind, clock_of
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.frames import (
    DriveFrame,
    HelloFrame,
    StatusFrame,
    StopFrame,
    decode_drive,
    decode_hello,
    decode_status,
    encode_stop,
)

from ..bench import Bench, short_plan
from . import hosts, nodes
from .hosts import Host, HostRules, Limits, Peer
from .nodes import Answer, Frame, Node, Rules, handshake_code

UNLIMITED = 1 << 30
LOW_BITS = {nodes.HOLD_END & 0xF: nodes.HOLD_END}
PHASES = {
    Phase.DISCOVER: hosts.DISCOVER,
    Phase.PREFLIGHT: hosts.PREFLIGHT,
    Phase.STAGING: hosts.STAGING,
    Phase.RELEASED: hosts.RELEASED,
    Phase.PAUSING: hosts.PAUSING,
    Phase.PAUSED: hosts.PAUSED,
    Phase.CLOSING: hosts.CLOSING,
    Phase.DONE: hosts.DONE,
    Phase.HALTING: hosts.HALTED,
    Phase.HALTED: hosts.HALTED,
}
TIMED = {Cause.SILENT, Cause.DEAF, Cause.TAKEN, Cause.BUSY, Cause.DEADLINE, Cause.SUSPENDED, Cause.ELSEWHERE}
"""Halts that depend on time or place, which the model leaves out."""
NODE_FIELDS = (
    *("boot", "homed", "fault", "session", "closed", "pending", "release", "hold", "started", "finished", "staged"),
    *("silent", "quiet", "lift", "stopped", "motion", "run", "owns"),
)


class Followed(Bench):
    """A bench with a model node beside every node and a model host beside the host; `checked` counts comparisons."""

    def __init__(self, count: int, steps: int, seed: int, weather: Weather) -> None:
        random = Random(seed)
        paces = lambda: tuple(random.randrange(700, 1001) for _ in range(3))  # noqa: E731
        plan = short_plan(count, steps)
        super().__init__(plan, weather, random=random, policy=Policy(poll_ms=3, retry_ms=1), paces=paces)
        self.random = random
        self.checked = 0
        self.rules = Rules(frozenset(), places=(0, 0, 0), offers=UNLIMITED)
        self.host_rules = HostRules(frozenset(), Limits(steps, lives=UNLIMITED, holds=UNLIMITED))
        self.models = [Node(restarts=UNLIMITED) for _ in self.nodes]
        self.host = self._begun(Host(1, tuple(Peer() for _ in self.nodes)))
        self._offers: list[dict[tuple[int, int], int]] = [{} for _ in self.nodes]
        self._keys: list[dict[int, NodeSession]] = [{} for _ in self.nodes]
        self._handshakes = {self.conductor.peers[0].nonce >> 8: self.host.code}
        for antenna in self.antennas:
            antenna.node = _Watch(self, self.antennas.index(antenna))

    # Nodes

    def reboot(self, index: int, **memory: object) -> None:
        self._advance(index)
        super().reboot(index, **memory)
        self.antennas[index].node = _Watch(self, index)
        model = self.rules._reboot(self.models[index])  # it has no frame to arrive with
        self.models[index] = model._replace(homed=self.nodes[index].memory.homed)
        self._keys[index].clear()
        self._compare(index, [self.models[index]], "restarts")

    def broadcast_stop(self) -> None:
        """Somebody stops the display."""
        for antenna in self.antennas:
            antenna.node.receive(self.now_ms, encode_stop(StopFrame(0), self.site.stop_key))

    def receive(self, index: int, now_ms: int, payload: bytes) -> None:
        """A payload for a node: first what time brought, then what the frame does."""
        self._advance(index, now_ms)
        frame, fresh = self._frame(index, payload, now_ms)
        model = self.models[index]
        self.nodes[index].receive(now_ms, payload)
        self._compare(index, [self.rules.receive(model, frame)] if fresh else [model], str(frame), now_ms)

    def _advance(self, index: int, now_ms: int | None = None) -> None:
        """Arrivals and silence, as many as have happened by now."""
        self.nodes[index].advance(self.now_ms if now_ms is None else now_ms)
        allowed = [self.models[index]]
        for model in allowed:
            if len(allowed) < 50:
                found = (after for words, after in self.rules.happenings(model) if words != nodes.RESTART)
                allowed.extend(after for after in found if after not in allowed)
        self._compare(index, allowed, "time passes", now_ms)

    def _frame(self, index: int, payload: bytes, now_ms: int) -> tuple[Frame, bool]:
        """What a payload is to the model, and whether it is to have an effect: counters, clocks, tags decide."""
        node, kind = self.nodes[index], kind_of(payload)
        if kind is FrameKind.HELLO:
            hello = decode_hello(payload, node.identity.node_key)
            good = isinstance(hello, HelloFrame) and hello.node == index + 1 and not hello.flags & FLAG_QUERY
            return (Frame("hello", self._handshake(hello)), True) if good else (Frame("hello"), False)
        if kind is FrameKind.STOP:
            return Frame("stop"), payload == encode_stop(StopFrame(payload[2]), self.site.stop_key)
        if kind is FrameKind.DRIVE:
            for code, session in self._keys[index].items():
                drive = decode_drive(payload, session.key, clock_of(now_ms))
                if isinstance(drive, DriveFrame):
                    fresh = drive.session == session.number and drive.counter > session.counter
                    young = now_ms < (drive.clock << CLOCK_SHIFT) + session.hello.deadman_ms
                    loads = (drive.release, drive.load_step, drive.hold_gen)
                    return Frame("drive", code, *loads), fresh and young
        return Frame("nothing"), False

    def _handshake(self, hello: HelloFrame) -> int:
        code = self._handshakes.setdefault(hello.nonce >> 8, handshake_code(3, len(self._handshakes), False))
        assert bool(hello.flags & FLAG_RESUME) == bool(code & 1)
        return code

    def _code(self, index: int, session: NodeSession | None) -> int:
        """The model's number of a session: boot, how many offers of its handshake there were, and the handshake."""
        if session is None:
            return 0
        memory = self.nodes[index].memory
        known = self._offers[index]
        key = (memory.boot, session.number)
        if key not in known:
            code = self._handshakes[session.hello.nonce >> 8]
            count = sum(each[0] == memory.boot and other & 63 == code for each, other in known.items())
            known[key] = (memory.boot * 8 + count + 1) * 64 + code
        self._keys[index][known[key]] = session
        return known[key]

    def _reduced(self, index: int, now_ms: int) -> tuple[object, ...]:
        """The variables of a real node, as the model has them."""
        node, memory, session = self.nodes[index], self.nodes[index].memory, self.nodes[index]._session
        motion = nodes.IDLE if node.move is None else nodes.RUNNING if node.move.brake_ms is None else nodes.BRAKING
        closed = session is not None and session.closed
        quiet = session is not None and not closed and now_ms >= session.expires_ms
        return (
            *(memory.boot, memory.homed, bool(memory.fault), self._code(index, session), closed),
            self._code(index, node._pending),
            *((session.release, session.hold_gen) if session else (0, 0)),
            *(memory.started, memory.finished, memory.staged),
            *(node._silent, quiet, node._lift_above, node._stopped, motion),
            int(memory.run_tag == self.conductor.run_tag),
            session is not None and session.owns_run,
        )

    def _compare(self, index: int, allowed: list[Node], event: str, now_ms: int | None = None) -> None:
        self.checked += 1
        found = self._reduced(index, self.now_ms if now_ms is None else now_ms)
        for model in allowed:
            if tuple(getattr(model, name) for name in NODE_FIELDS) == found:
                self.rules.check(model)
                self.models[index] = model
                return
        expected = [{name: getattr(model, name) for name in NODE_FIELDS} for model in allowed]
        real = dict(zip(NODE_FIELDS, found, strict=True))
        gaps = [{name: (real[name], each[name]) for name in real if real[name] != each[name]} for each in expected]
        raise AssertionError(f"node {index + 1}, {event}: real and model differ in {gaps}")

    # Host

    def _begun(self, host: Host) -> Host:
        return self.host_rules.steps(host)[0][1]

    def new_host(self, nonce: int = 0x66554433221100, policy: Policy | None = None) -> None:
        super().new_host(nonce, policy or self.conductor.policy)
        self.host = self._begun(self.host_rules._forget(self.host))
        self._handshakes[nonce >> 8] = self.host.code
        self._settle_host("the run is resumed")

    def hold(self) -> None:
        """The operator holds."""
        self.conductor.hold(self.now_ms)
        self._match([self.host, *self._held(self.host)], "is asked to hold")

    def _held(self, host: Host) -> list[Host]:
        return [after for words, after in self.host_rules.troubles(host) if words == "is asked to hold"]

    def go_on(self) -> None:
        """The operator ends a pause."""
        self.conductor.resume(self.now_ms)
        self._settle_host("is asked to go on")

    def act(self, action: Action) -> bool:
        self._settle_host("decides")
        done = super().act(action)
        if isinstance(action, Write):
            self._settle_host(f"has written {action.record['type']}")
        assert self.host.book.release == self.journalled("release"), "the model's journal"
        return done

    def journalled(self, kind: str) -> int:
        """The last step that the journal has a record of this kind for."""
        return max((record["step"] for record in self.records if record["type"] == kind), default=0)

    def poll(self, action: Poll) -> None:
        answers = [self.send(each) for each in action.sends]
        for each, heard in zip(action.sends, answers, strict=True):
            self._hear(each.node - 1, heard)

    def _hear(self, index: int, heard: Heard) -> None:
        answer, stale = self._answer(index, heard.payload)
        allowed = [self.host]
        if answer is not None:
            allowed = [self.host_rules.hear(self.host, index, answer)]
            if stale and allowed[0].phase == hosts.HALTED:  # it tells facts, but the newest state is what counts
                peer = self.host_rules._merge(self.host, self.host.peers[index], answer)
                allowed.append(self.host_rules._with_peer(self.host, index, peer))
        self.conductor.heard(self.now_ms, index + 1, heard.payload, heard.retries)
        self._match(allowed, f"hears {answer}")

    def _answer(self, index: int, payload: bytes | None) -> tuple[Answer | None, bool]:
        """What an answer is to the model, and whether the host knows a newer one."""
        peer = self.conductor.peers[index]
        if not payload:
            return None, False
        if (ident := peer._take_ident(payload)) is not None:
            code = self._offers[index].get((ident.boot, ident.session), 0)
            same_run = ident.same_run and bool(code)
            return Answer("ident", code, ident.boot, busy=ident.busy, same_run=same_run, stopped=ident.stopped), False
        status = decode_status(payload, peer.key, peer.clock) if peer.key else None
        if not isinstance(status, StatusFrame) or status.session != peer.session or status.echo > peer.counter:
            return None, False
        code = self._offers[index][peer.boot, status.session]
        hold = LOW_BITS.get(status.hold_low, status.hold_low)
        facts = (peer.boot, status.finished, status.started, status.staged, int(status.state), hold)
        return Answer("status", code, *facts, at_start=True), peer.status is not None and status.echo < peer.status.echo

    def _settle_host(self, event: str) -> None:
        """One decision of the host by itself: nothing, up to three small steps of the model, or a halt for time."""
        allowed = [self.host]
        for model in allowed:
            if len(allowed) < 4 and model.phase != hosts.HALTED:
                allowed.extend(after for _, after in self.host_rules.steps(model))
        if self.conductor._pause_wanted:
            allowed.extend(after for model in tuple(allowed) for after in self._held(model))
        halt = self.conductor.halt
        if halt is not None and halt.cause in TIMED:
            allowed.append(self.host_rules.halt(self.host, "time"))
        self._match(allowed, event)

    def _match(self, allowed: list[Host], event: str) -> None:
        self.checked += 1
        conductor = self.conductor
        peers = tuple(
            (
                self._offers[index].get((peer.boot, peer.session), 0),
                peer.boot,
                *(peer.finished, peer.started, peer.staged),
            )
            for index, peer in enumerate(conductor.peers)
        )
        found = (PHASES[conductor.phase], conductor.step, conductor.released, conductor._hold_gen, peers)
        seen = []
        for model in allowed:
            known = model.peers
            if found[0] == hosts.HALTED == model.phase:  # what it was told by nodes it gave up is of no interest
                self.host = model
                return
            seen.append((model.phase, model.step, model.released, model.hold, tuple(peer[:5] for peer in known)))
            if seen[-1] == found:
                self.host = model
                return
        raise AssertionError(f"host {event}: is {found}, the model allows {seen}")


class _Watch:
    """A node as the air sees it, with the model beside it."""

    def __init__(self, bench: Followed, index: int) -> None:
        self._bench = bench
        self._index = index

    @property
    def ack(self) -> bytes:
        """The loaded answer."""
        return self._bench.nodes[self._index].ack

    def advance(self, now_ms: int) -> None:
        """See Receiver."""
        self._bench._advance(self._index, now_ms)

    def receive(self, now_ms: int, payload: bytes) -> None:
        """See Receiver."""
        self._bench.receive(self._index, now_ms, payload)
