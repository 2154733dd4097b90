"""One host that talks to one node without any air between them, and plants that can be told what to do."""

from __future__ import annotations

from dataclasses import replace

from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant, PlantFault
from curveline.radio.node.state import Identity, Memory
from curveline.radio.protocol import codes, frames
from curveline.radio.protocol.codes import Counts, clock_of
from curveline.radio.protocol.frames import DriveFrame, HelloFrame, HomeFrame, IdentFrame, ReportFrame, StatusFrame
from curveline.radio.protocol.keys import ZERO_MASTER, Site, session_key
from curveline.radio.protocol.motion import axes_of, config_hash

from .bench import drive_table

AXES = axes_of(drive_table())
SITE = Site(ZERO_MASTER, (0xC0FFEE, 0xBADCAB1E))
NODE_KEY = SITE.node_key(1)
DEADMAN = 1000
TARGET = (2000, 500, 100)
FAR = (20000, 0, 0)
RUN = 77


class FaultyPlant(MotorPlant):
    """A plant that can be told to fail."""

    coming: PlantFault | None = None

    def fault(self) -> PlantFault | None:
        return self.coming


class NewsPlant(MotorPlant):
    """A plant that does not know in advance when it will arrive, as real motors."""

    arrived_ms: int | None = None

    def settles_ms(self) -> int | None:
        return self.arrived_ms


class Host:
    """One host talking to one node, without any air between them."""

    def __init__(self, node: NodeMachine, nonce: int = 0x5500, run: int = RUN, flags: int = 0) -> None:
        self.node = node
        self.hello = HelloFrame(1, nonce, run, config_hash(AXES), DEADMAN, flags)
        self.counter = 0
        self.session = 0
        self.seen = 0
        self.key = b""

    def offer(self, now: int) -> IdentFrame:
        self.hello = replace(self.hello, nonce=self.hello.nonce + 1)
        self.node.receive(now, frames.encode_hello(self.hello, NODE_KEY))
        ident = frames.decode_ident(self.node.ack, NODE_KEY, self.hello.handshake)
        assert isinstance(ident, IdentFrame)
        self.session = ident.session
        self.key = session_key(NODE_KEY, self.hello.handshake, ident.nonce, self.hello.run_tag)
        self.counter = 0
        return ident

    def drive(self, now: int, **fields: object) -> StatusFrame:
        """A DRIVE of a host that has just heard of the node, unless `clock` says when it has."""
        self.counter += 1
        clock = fields.pop("clock", clock_of(now))
        frame = DriveFrame(clock, self.session, self.counter, **fields)  # type: ignore[arg-type]
        self.node.receive(now, frames.encode_drive(frame, self.key))
        self.seen = clock_of(now)
        return self.status()

    def home(self, now: int, axes: int = codes.ALL_AXES, order: int = 1) -> StatusFrame:
        self.counter += 1
        frame = HomeFrame(clock_of(now), self.session, self.counter, axes, order)
        self.node.receive(now, frames.encode_home(frame, self.key))
        self.seen = clock_of(now)
        return self.status()

    def status(self) -> StatusFrame:
        status = frames.decode_status(self.node.ack, self.key, self.seen)
        assert isinstance(status, StatusFrame), status
        return status

    def report(self, now: int) -> ReportFrame:
        """What the node answers to a query."""
        question = HelloFrame(1, 0xABCDEF00, 0, 0, 0, codes.FLAG_QUERY)
        self.node.receive(now, frames.encode_hello(question, NODE_KEY))
        report = frames.decode_report(self.node.ack, NODE_KEY, question.handshake)
        assert isinstance(report, ReportFrame), report
        return report

    def start(self, now: int, step: int = 1, target: Counts = TARGET, hold_gen: int = 0) -> StatusFrame:
        self.drive(now, release=step - 1, load_step=step, target=target, hold_gen=hold_gen)
        return self.drive(now, release=step, hold_gen=hold_gen)


def make_node(memory: Memory | None = None, counts: Counts = (0, 0, 0)) -> NodeMachine:
    return NodeMachine(Identity(1, SITE), AXES, FaultyPlant(counts), memory or Memory())


def keep_alive(host: Host, start: int, end: int, **fields: object) -> StatusFrame:
    """Poll often enough for the dead-man from `start` to `end`."""
    status = host.status()
    for now in range(start, end + 1, 100):
        status = host.drive(now, **fields)
    return status
