"""What a stranger can do with frames that were overheard or kept back: nothing moves, and nobody is kept alive."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from curveline.radio.node.state import Memory
from curveline.radio.protocol import codes, envelope, frames
from curveline.radio.protocol.codes import OFFERS_END, NodeState
from curveline.radio.protocol.frames import DriveFrame, HelloFrame, IdentFrame, StatusFrame
from curveline.radio.protocol.keys import session_key

from .single import AXES, DEADMAN, FAR, NODE_KEY, RUN, Host, config_hash, keep_alive, make_node

WRAPPED = 65_536
"""Offers after which session numbers come again."""


class Recorder:
    """Everything that a node was sent."""

    def __init__(self, host: Host) -> None:
        self.payloads: list[bytes] = []
        self._receive = host.node.receive
        host.node.receive = self._note  # type: ignore[method-assign]

    def _note(self, now: int, payload: bytes) -> None:
        self.payloads.append(payload)
        self._receive(now, payload)

    def of(self, kind: codes.FrameKind) -> list[bytes]:
        return [each for each in self.payloads if envelope.kind_of(each) is kind]


def recorded_run(memory: Memory | None = None) -> tuple[Host, list[bytes], list[bytes]]:
    """A host, the HELLOs of a run that it took a node through and gave back, and the DRIVEs that set the node off.

    No more of those: a flood of wrong tags makes a node deaf, and it would not even look at the others.
    """
    host = Host(make_node(memory))
    recorder = Recorder(host)
    host.offer(0)
    host.start(0, target=FAR)
    keep_alive(host, 100, 8000, release=1)
    host.drive(8100, release=1, hold_gen=codes.HOLD_END)
    return host, recorder.of(codes.FrameKind.HELLO), recorder.of(codes.FrameKind.DRIVE)[:2]


def two_hellos(old: bytes) -> Iterator[bytes]:
    """A recorded HELLO and another one by turns: each replaces the offer that the other has brought about."""
    other = frames.encode_hello(HelloFrame(1, 0xEE00, RUN + 5, config_hash(AXES), DEADMAN), NODE_KEY)
    while True:
        yield old
        yield other


@pytest.mark.parametrize("count", [WRAPPED - 1, WRAPPED, 2 * WRAPPED - 2, 2 * WRAPPED + 3])
def test_recorded_frames_move_nothing_when_session_numbers_come_again(count: int) -> None:
    host, hellos, drives = recorded_run()
    node, now = host.node, 9000
    stands, seen = node.plant.positions(now), {host.key}
    for number, payload in enumerate(two_hellos(hellos[0]), start=1):
        node.receive(now, payload)
        assert node._pending is not None
        seen.add(node._pending.key)
        assert len(seen) == number + 1, "a session key came a second time"
        if number >= count or node._pending.number == host.session:
            for drive in drives:
                node.receive(now, drive)
        if number == count:
            break
    node.advance(now + 20_000)
    assert node.plant.positions(now + 20_000) == stands
    assert node._session is not None
    assert node._session.closed, "nobody owns it"
    assert node.tally.floods == 0, "it listened all the time"


def test_nor_is_a_node_taken_from_its_living_host() -> None:
    host, hellos, drives = recorded_run()
    owner = Host(host.node, nonce=0x7700, run=RUN + 1)
    owner.offer(9000)
    owner.drive(9000)
    for number, payload in zip(range(2 * WRAPPED), two_hellos(hellos[0]), strict=False):
        host.node.receive(9001, payload)
        if host.node._pending.number == host.session:
            for drive in drives:
                host.node.receive(9001, drive)
        if number % 10_000 == 0:
            owner.drive(9001)
    assert owner.drive(9002).echo == owner.counter
    assert owner.start(9003).state is NodeState.MOVING


def test_a_node_that_has_made_all_its_offers_makes_none_until_it_is_switched_on_again() -> None:
    host = Host(make_node(Memory(offers=OFFERS_END - 2)))
    ident = host.offer(0)
    assert (ident.nonce.offers, ident.session) == (OFFERS_END - 1, (OFFERS_END - 2) % 0xFFFF + 1)
    host.drive(0)
    before = host.node.ack
    other = HelloFrame(1, 0x9900, RUN, config_hash(AXES), DEADMAN)
    host.node.receive(10, frames.encode_hello(other, NODE_KEY))
    assert host.node.ack == before
    assert host.drive(20).echo == host.counter, "who owns it goes on"
    assert host.report(30).state is NodeState.READY, "and it says how it is"


def test_session_numbers_come_again_but_never_as_none() -> None:
    host = Host(make_node(Memory(offers=0xFFFE)))
    assert host.offer(0).session == 0xFFFF
    assert Host(host.node, nonce=0x9900).offer(0).session == 1


def test_a_key_hangs_on_every_part_of_the_nodes_nonce() -> None:
    nonce = frames.NodeNonce(3, 7, 11)
    keys = {session_key(NODE_KEY, 0x100, each, RUN) for each in (nonce, (4, 7, 11), (3, 8, 11), (3, 7, 12))}
    assert len(keys) == 4


# Frames that were kept back


def test_frames_kept_back_do_not_keep_a_silent_hosts_node_moving() -> None:
    """The host speaks for 2 s and falls silent; an eavesdropper delivers each of its frames later, one by one."""
    host = Host(make_node())
    host.offer(0)
    host.start(0, target=(150_000, 0, 0))
    kept = []
    for _ in range(50, 2000, 50):
        host.counter += 1
        frame = DriveFrame(codes.clock_of(0), host.session, host.counter, release=1)
        kept.append(frames.encode_drive(frame, host.key))
    for now, payload in zip(range(900, 60_000, 900), kept, strict=False):
        host.node.receive(now, payload)
        if now > DEADMAN:
            assert host.node.state is not NodeState.READY
    assert host.node.state is NodeState.HOLD_LINK
    assert host.node.plant.settles_ms() < DEADMAN + 500


def test_the_dead_man_counts_from_what_the_host_heard_not_from_when_the_frame_came() -> None:
    host = Host(make_node())
    host.offer(0)
    host.start(0, target=FAR)
    host.drive(900, clock=0, release=1)
    host.node.advance(DEADMAN - 1)
    assert host.node.move.brake_ms is None
    host.node.advance(DEADMAN)
    assert host.node.move.brake_ms == DEADMAN


@pytest.mark.parametrize("late", [0, 1, 500, 14_000])
def test_an_old_frame_changes_nothing_but_the_answer_which_tells_the_time(late: int) -> None:
    host = Host(make_node())
    host.offer(0)
    host.drive(0)
    now = DEADMAN + late
    host.node.advance(now)
    status = host.drive(now, clock=0, release=1, load_step=1, target=FAR, hold_gen=2)
    assert (status.clock, status.echo) == (codes.clock_of(now), 1)
    assert (status.staged, status.state) == (0, NodeState.HOLD_LINK)
    assert host.node.tally.old_frames == 1
    assert host.drive(now + 1, clock=status.clock, hold_gen=2).state is NodeState.READY


def test_an_old_frame_for_an_offered_session_is_answered_with_the_offer_and_the_time() -> None:
    host = Host(make_node())
    host.offer(0)
    host.counter += 1
    host.node.receive(3000, frames.encode_drive(DriveFrame(0, host.session, 1), host.key))
    ident = frames.decode_ident(host.node.ack, NODE_KEY, host.hello.handshake)
    assert isinstance(ident, IdentFrame)
    assert (ident.session, ident.clock) == (host.session, codes.clock_of(3000))
    assert host.node._session is None
    assert host.drive(3010, clock=ident.clock).echo == host.counter


def test_a_time_that_has_not_come_yet_is_a_wrong_tag() -> None:
    host = Host(make_node())
    host.offer(0)
    host.drive(0)
    frame = DriveFrame(codes.clock_of(5000), host.session, 2)
    host.node.receive(100, frames.encode_drive(frame, host.key))
    assert (host.node.tally.bad_tags, host.node.memory.staged) == (1, 0)


def test_what_is_older_than_the_clocks_low_bits_tell_is_a_wrong_tag() -> None:
    host = Host(make_node())
    host.offer(0)
    host.drive(0)
    host.counter += 1
    host.node.receive(20_000, frames.encode_drive(DriveFrame(1, host.session, host.counter), host.key))
    assert host.node.tally.bad_tags == 1


def test_an_emergency_stop_is_never_too_old() -> None:
    host = Host(make_node())
    host.offer(0)
    host.start(0, target=FAR)
    host.node.advance(50_000)
    host.node.receive(50_000, frames.encode_estop(frames.EstopFrame(1, host.session, 99), host.key))
    assert host.node.state is NodeState.ESTOP


def test_old_homing_orders_start_nothing() -> None:
    host = Host(make_node())
    host.offer(0)
    host.drive(0)
    frame = frames.HomeFrame(0, host.session, 2, codes.ALL_AXES, 1)
    host.node.receive(DEADMAN, frames.encode_home(frame, host.key))
    assert host.node.memory.homing == 0
    assert host.node.memory.homed


# What is done stays known until another run begins


def test_a_host_that_moves_nothing_leaves_the_run_before_it_as_it_was() -> None:
    host = Host(make_node())
    host.offer(0)
    host.start(0, target=FAR)
    host.node.advance(5000)
    other = Host(host.node, nonce=0x9900, run=RUN + 1)
    other.offer(5000)
    status = other.drive(5001)
    assert (status.started, status.finished, status.staged, status.state) == (0, 0, 0, NodeState.READY)
    assert other.drive(5100, release=9).state is NodeState.READY, "and what was under way does not go on for it"
    other.drive(5200, hold_gen=codes.HOLD_END)
    assert other.report(5300).started == 1
    again = Host(host.node, nonce=0xAA00, run=RUN, flags=codes.FLAG_RESUME)
    assert again.offer(5400).same_run
    again.drive(5500, release=1)
    again.drive(5600, release=1, hold_gen=2)
    done = keep_alive(again, 5700, 12_000, release=1, hold_gen=2)
    assert isinstance(done, StatusFrame)
    assert (done.finished, host.node.plant.positions(12_000)) == (1, FAR)


def test_the_first_staged_step_begins_a_run_and_ends_the_one_before() -> None:
    host = Host(make_node())
    host.offer(0)
    host.start(0, target=FAR)
    host.node.advance(5000)
    other = Host(host.node, nonce=0x9900, run=RUN + 1)
    other.offer(5000)
    assert other.start(5001).started == 1
    assert not Host(host.node, nonce=0xBB00, run=RUN).offer(5100).same_run
