"""A node that is given other settings over the air: what it takes, refuses, tries, and falls back from."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import pytest

from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.settings_flash import ModelFlash, SettingsFlash, flashed
from curveline.radio.node.state import NOWHERE, Identity, Memory
from curveline.radio.protocol import frames
from curveline.radio.protocol.codes import (
    FLAG_RESUME,
    ErrandOutcome,
    NodeState,
    Reject,
    ServiceOperation,
    SettingsOperation,
    clock_of,
)
from curveline.radio.protocol.frames import StopFrame
from curveline.radio.protocol.keys import Site, session_key
from curveline.radio.protocol.node_settings import NodeSettings, node_settings
from curveline.radio.protocol.service_frames import ReadingFrame, ServiceFrame, decode_reading, encode_service
from curveline.radio.protocol.settings_frames import (
    TRIAL_MS,
    SettingsFacts,
    SettingsFrame,
    encode_settings,
    pieces_of,
    settings_facts_in,
)

from .bench import drive_table
from .single import AXES, DEADMAN, SITE, Host, keep_alive

PIECE, STORE, TRY, KEEP, DROP, LOADER = SettingsOperation
OLD = node_settings(SITE.master, drive_table(), 1)
NEW = replace(OLD, channel=90, master=bytes(range(1, 17)), generation=1)


class Setter(Host):
    """A host that gives other settings; every answer is read as one of its session."""

    def __init__(self, node: NodeMachine, **fields: object) -> None:
        super().__init__(node, **fields)  # type: ignore[arg-type]
        self.order = 0
        self.sent: list[bytes] = []

    def reading(self) -> ReadingFrame:
        reading = decode_reading(self.node.ack, self.key, self.seen)
        assert isinstance(reading, ReadingFrame), reading
        return reading

    def send(self, now: int, operation: SettingsOperation, index: int, piece: bytes = bytes(14)) -> None:
        self.counter += 1
        frame = SettingsFrame(clock_of(now), self.session, self.counter, operation, index, piece)
        self.sent.append(encode_settings(frame, self.key))
        self.node.receive(now, self.sent[-1])
        self.seen = clock_of(now)

    def pieces(self, now: int, settings: NodeSettings = NEW) -> SettingsFacts:
        for number, piece in enumerate(pieces_of(settings.record())):
            self.send(now, PIECE, number, piece)
        return settings_facts_in(self.reading().facts)

    def ask(self, now: int, operation: SettingsOperation) -> ErrandOutcome:
        """An order; what became of it."""
        self.order += 1
        self.send(now, operation, self.order)
        return self.reading().outcome

    def serve(self, now: int, **fields: object) -> ReadingFrame:
        self.counter += 1
        frame = ServiceFrame(clock_of(now), self.session, self.counter, **fields)  # type: ignore[arg-type]
        self.node.receive(now, encode_service(frame, self.key))
        self.seen = clock_of(now)
        return self.reading()


def made(keeper: SettingsFlash | None = None, memory: Memory | None = None) -> NodeMachine:
    """A node that starts under what its flash says."""
    keeper = keeper or flashed(OLD)
    settings = keeper.start(restarted=True)
    assert settings is not None
    plant = MotorPlant((0, 0, 0))
    plant.settings = keeper
    site = Site(settings.master, SITE.chips)
    return NodeMachine(Identity(settings.number, site), settings.axes, plant, memory or Memory())


def taken(node: NodeMachine, now: int = 0, nonce: int = 0x5500) -> Setter:
    """A host that has the node."""
    host = Setter(node, nonce=nonce)
    host.offer(now)
    host.drive(now)
    return host


def keeper_of(node: NodeMachine) -> SettingsFlash:
    assert isinstance(node.plant.settings, SettingsFlash)
    return node.plant.settings


def flash_of(node: NodeMachine) -> ModelFlash:
    flash = keeper_of(node).flash
    assert isinstance(flash, ModelFlash)
    return flash


def restarted(node: NodeMachine) -> NodeMachine:
    return made(SettingsFlash(flash_of(node)), node.memory.restarted(rested=True))


def on_trial(settings: NodeSettings = NEW) -> NodeMachine:
    node = made()
    host = taken(node)
    host.pieces(10, settings)
    assert host.ask(20, STORE) is ErrandOutcome.DONE
    assert host.ask(30, TRY) is ErrandOutcome.DONE
    assert node.leaves
    return restarted(node)


class NewKey(Setter):
    """A host that has the new key."""

    def offer(self, now: int) -> frames.IdentFrame:
        self.hello = replace(self.hello, nonce=self.hello.nonce + 1)
        key = self.node.identity.node_key
        self.node.receive(now, frames.encode_hello(self.hello, key))
        ident = frames.decode_ident(self.node.ack, key, self.hello.handshake)
        assert isinstance(ident, frames.IdentFrame)
        self.session = ident.session
        self.key = session_key(key, self.hello.handshake, ident.nonce, self.hello.run_tag)
        self.counter = 0
        return ident


def under_new(node: NodeMachine, now: int) -> NewKey:
    host = NewKey(node)
    host.offer(now)
    host.drive(now)
    return host


def test_pieces_are_held_stored_and_tried() -> None:
    node = made()
    host = taken(node)
    host.send(5, PIECE, 3, bytes(14))
    assert settings_facts_in(host.reading().facts) == SettingsFacts(0b001000, False, 0, 0, 0)
    assert host.pieces(10).pieces == 0b111111
    assert host.ask(20, STORE) is ErrandOutcome.DONE
    assert settings_facts_in(host.reading().facts) == SettingsFacts(0, False, 0, 0, 1)
    assert host.serve(25, page=4).facts == host.reading().facts
    assert host.ask(30, TRY) is ErrandOutcome.DONE
    assert node.leaves
    before = node.ack
    host.counter += 1
    late = frames.DriveFrame(clock_of(40), host.session, host.counter)
    node.receive(40, frames.encode_drive(late, host.key))
    assert node.ack == before, "a node that is about to start anew hears nothing"


def test_on_trial_a_node_says_so_moves_nothing_and_is_kept() -> None:
    node = on_trial()
    host = NewKey(node)
    assert host.offer(100).on_trial
    host.drive(100)
    host.serve(800, page=4)
    facts = settings_facts_in(host.serve(1500, page=4).facts)
    assert facts == SettingsFacts(0, True, 1, 29, 1)
    assert host.home(1600).state is not NodeState.HOMING
    for operation in (ServiceOperation.JOG, ServiceOperation.TURN, ServiceOperation.PLACE):
        host.order += 1
        reading = host.serve(1700, operation=operation, order=host.order, axis=1, amount=100, rate=500, span=100)
        assert reading.outcome is ErrandOutcome.OCCUPIED
    node.start_homing(1750, 7)
    assert not node.is_turning
    host.pieces(1800)
    assert settings_facts_in(host.reading().facts).pieces == 0, "on trial it takes no pieces"
    for operation in (STORE, TRY):
        assert host.ask(1900, operation) is ErrandOutcome.OCCUPIED
    assert host.ask(2000, KEEP) is ErrandOutcome.DONE
    assert settings_facts_in(host.reading().facts) == SettingsFacts(0, False, 1, 0, 1)
    assert host.ask(2100, KEEP) is ErrandOutcome.BEYOND
    node.advance(200_000)
    assert not node.leaves
    again = restarted(node)
    assert (again.on_trial, keeper_of(again).start()) == (False, NEW)
    assert under_new(again, 100).home(200).state is NodeState.HOMING


def test_no_step_starts_on_trial() -> None:
    node = on_trial()
    host = under_new(node, 100)
    assert host.start(200).started == 0
    assert not node.is_turning
    assert host.ask(300, KEEP) is ErrandOutcome.OCCUPIED, "a run is owned"


@pytest.mark.parametrize("last", [0, TRIAL_MS - 1])
def test_a_trial_without_a_host_ends_after_thirty_seconds(last: int) -> None:
    node = on_trial()
    node.advance(0)
    node.advance(last)
    assert not node.leaves
    node.advance(TRIAL_MS)
    assert node.leaves
    back = restarted(node)
    assert (back.on_trial, keeper_of(back).start()) == (False, OLD)


def test_a_trial_ends_although_its_host_is_heard() -> None:
    node = on_trial()
    host = under_new(node, 100)
    for now in range(200, TRIAL_MS + 200, 100):
        if not node.leaves:
            host.counter += 1
            frame = frames.DriveFrame(clock_of(now), host.session, host.counter)
            node.receive(now, frames.encode_drive(frame, host.key))
    assert node.leaves


def test_a_keep_that_comes_with_the_end_of_the_trial_is_too_late() -> None:
    node = on_trial()
    node.advance(0)
    host = under_new(node, TRIAL_MS - 50)
    host.order += 1
    host.send(TRIAL_MS, KEEP, host.order)
    assert node.leaves
    assert keeper_of(restarted(node)).start() == OLD


def test_a_trial_can_be_ended_at_once() -> None:
    node = on_trial()
    host = under_new(node, 100)
    assert host.ask(200, DROP) is ErrandOutcome.DONE
    assert node.leaves
    assert keeper_of(restarted(node)).start() == OLD


def test_what_is_stored_is_dropped() -> None:
    node = made()
    host = taken(node)
    host.pieces(10)
    assert host.ask(20, STORE) is ErrandOutcome.DONE
    host.send(25, PIECE, 0, bytes(14))
    assert host.ask(30, DROP) is ErrandOutcome.DONE
    assert settings_facts_in(host.reading().facts) == SettingsFacts(0, False, 0, 0, 0)
    assert host.ask(40, TRY) is ErrandOutcome.BEYOND
    assert not node.leaves


@pytest.mark.parametrize(
    "settings", [replace(NEW, generation=0), replace(NEW, generation=2), replace(NEW, number=255), None]
)
def test_only_a_whole_record_of_the_next_generation_is_stored(settings: NodeSettings | None) -> None:
    node = made()
    host = taken(node)
    for number, piece in enumerate(pieces_of((settings or NEW).record())):
        if settings or number != 4:
            host.send(10, PIECE, number, piece)
    assert host.ask(20, STORE) is ErrandOutcome.BEYOND
    assert settings_facts_in(host.reading().facts).stored == 0


def test_pieces_of_another_session_do_not_count() -> None:
    node = made()
    first = taken(node)
    pieces = pieces_of(NEW.record())
    for number in range(5):
        first.send(10, PIECE, number, pieces[number])
    first.drive(20, hold_gen=254)
    second = taken(node, 100, nonce=0x7700)
    second.send(110, PIECE, 5, pieces[5])
    assert settings_facts_in(second.reading().facts).pieces == 0b100000
    assert second.ask(120, STORE) is ErrandOutcome.BEYOND


def test_an_order_is_taken_once_and_a_refused_one_counts() -> None:
    node = made()
    host = taken(node)
    assert host.ask(10, STORE) is ErrandOutcome.BEYOND
    host.pieces(20)
    host.send(30, STORE, 1)
    assert host.reading().outcome is ErrandOutcome.BEYOND, "the same order again"
    assert settings_facts_in(host.reading().facts).stored == 0
    assert host.ask(40, STORE) is ErrandOutcome.DONE


@pytest.mark.parametrize("operation", [STORE, TRY, DROP, LOADER])
def test_what_forbids_orders_forbids_these(operation: SettingsOperation) -> None:
    def ready(memory: Memory | None = None) -> Setter:
        host = taken(made(memory=memory))
        host.pieces(10)
        assert host.ask(20, STORE) is ErrandOutcome.DONE or memory
        host.pieces(25, replace(NEW, generation=1))
        return host

    host = ready()
    host.drive(30, hold_gen=1)
    assert host.ask(40, operation) is ErrandOutcome.HELD
    host = ready()
    host.node.receive(30, frames.encode_stop(StopFrame(0), SITE.stop_key))
    assert host.ask(40, operation) is ErrandOutcome.HELD
    host = ready(Memory(estop=True))
    assert host.ask(40, operation) is ErrandOutcome.HELD
    host = ready(Memory(unhomed=NOWHERE))
    host.order += 1
    assert host.home(30, order=host.order).state is NodeState.HOMING
    assert host.ask(40, operation) is ErrandOutcome.OCCUPIED
    host = ready()
    host.start(30)
    assert host.ask(40, operation) is ErrandOutcome.OCCUPIED
    host.drive(100)
    keep_alive(host, 100, 8000)
    assert host.ask(8100, operation) is ErrandOutcome.OCCUPIED, "it owns a run"


def test_the_dead_man_time_does_not_matter_but_old_frames_do_nothing() -> None:
    node = made()
    host = taken(node)
    host.pieces(10)
    host.counter += 1
    frame = SettingsFrame(clock_of(0), host.session, host.counter, STORE, 1)
    node.receive(DEADMAN + 200, encode_settings(frame, host.key))
    assert node.tally.old_frames == 1
    assert keeper_of(node).standing().stored == 0


def test_recorded_frames_are_worth_nothing() -> None:
    """Neither in the same session, nor in another, nor on trial, nor after the change."""
    node = made()
    host = taken(node)
    host.pieces(10)
    host.ask(20, STORE)
    host.ask(30, DROP)
    for payload in host.sent:
        node.receive(40, payload)
    assert keeper_of(node).standing().stored == 0
    host.pieces(50)
    host.ask(60, STORE)
    host.ask(70, TRY)
    trial = restarted(node)
    for payload in host.sent:
        trial.receive(100, payload)
    assert trial.on_trial
    late = under_new(trial, 200)
    late.ask(300, KEEP)
    again = restarted(trial)
    for payload in host.sent + late.sent:
        again.receive(400, payload)
    assert keeper_of(again).standing() == keeper_of(trial).standing()
    assert keeper_of(again).start() == NEW


def test_a_node_without_a_place_for_settings_says_so() -> None:
    node = NodeMachine(Identity(1, SITE), AXES, MotorPlant((0, 0, 0)), Memory())
    host = taken(node)
    host.pieces(10)
    assert host.ask(20, STORE) is ErrandOutcome.FAILED
    assert host.ask(30, TRY) is ErrandOutcome.BEYOND


def test_a_changed_bit_anywhere_is_noticed() -> None:
    node = made()
    host = taken(node)
    random = Random(5)
    for number, piece in enumerate(pieces_of(NEW.record())):
        host.counter += 1
        frame = SettingsFrame(clock_of(10), host.session, host.counter, PIECE, number, piece)
        payload = bytearray(encode_settings(frame, host.key))
        bit = random.randrange(256)
        payload[bit >> 3] ^= 1 << (bit & 7)
        node.receive(10, bytes(payload))
    assert host.serve(20, page=4).facts[0] == 0


def test_a_report_and_an_ident_say_that_a_node_is_on_trial() -> None:
    node = on_trial()
    key = node.identity.node_key
    question = frames.HelloFrame(1, 0xABCDEF00, 0, 0, 0, 4)
    node.receive(50, frames.encode_hello(question, key))
    report = frames.decode_report(node.ack, key, question.handshake)
    assert not isinstance(report, Reject)
    assert report.on_trial
    host = under_new(node, 100)
    host.ask(200, KEEP)
    node.receive(250, frames.encode_hello(question, key))
    report = frames.decode_report(node.ack, key, question.handshake)
    assert not isinstance(report, Reject)
    assert not report.on_trial


def test_a_run_cannot_be_resumed_over_a_change() -> None:
    node = made()
    runner = Setter(node)
    runner.offer(0)
    runner.start(10)
    keep_alive(runner, 100, 8000)
    runner.drive(8100, hold_gen=254)
    setter = taken(node, 9000, nonce=0x7700)
    setter.pieces(9010)
    assert setter.ask(9020, STORE) is ErrandOutcome.DONE
    assert setter.node.memory.started == 1, "storing alone voids nothing"
    assert setter.ask(9030, TRY) is ErrandOutcome.DONE
    back = restarted(node)
    host = NewKey(back, nonce=0x9900, flags=FLAG_RESUME)
    assert not host.offer(100).same_run
