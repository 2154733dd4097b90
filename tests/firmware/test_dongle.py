"""The dongle's core: what it answers, what it refuses, and that nothing confuses it for longer than a packet."""

from __future__ import annotations

from random import Random
from zlib import crc32

import pytest

from curveline.radio.ports.dongle import PacketKind, Refusal, SendOutcome, decode_packet, encode_packet

from .dongle_core import UNIQUE, Core, library, refused, schedule_bytes, settings_bytes

HELLO = encode_packet(bytes([PacketKind.HELLO, 9, 1, 1]))
FRAMES = [(f"C1C1C1C1{number:02X}", bytes([number]) * 32) for number in range(1, 17)]
SCHEDULE = encode_packet(bytes([PacketKind.SCHEDULE, 1]) + schedule_bytes(FRAMES))


def ident(*, configured: bool = False, bad: int = 0, number: int = 9) -> bytes:
    head = bytes([PacketKind.IDENT, number, 1, configured, 3, 0, 0, 1, 1, 0, 16])
    return head + bad.to_bytes(2, "little") + UNIQUE


@pytest.fixture
def core() -> Core:
    return Core()


def test_it_says_who_it_is(core: Core) -> None:
    core.feed(HELLO)
    assert core.bodies() == [ident()]
    core.set_up()
    core.feed(HELLO)
    assert core.bodies() == [ident(configured=True)]


def test_a_host_of_another_version_learns_ours(core: Core) -> None:
    assert core.ask(PacketKind.HELLO, bytes([2, 9, 1, 2, 3]), 9) == [ident()]


@pytest.mark.parametrize("length", [0, 1, 5, 100, 700])
def test_its_checksum_is_that_of_zlib(length: int) -> None:
    data = Random(length).randbytes(length)
    assert library().cl_dongle_crc(data, length) == crc32(data)


@pytest.mark.parametrize("size", [1, 2, 3, 7, 64])
def test_packets_come_in_pieces_of_any_size(core: Core, size: int) -> None:
    core.set_up()
    for at in range(0, len(SCHEDULE), size):
        core.feed(SCHEDULE[at : at + size])
    while core.step():
        pass
    assert core.sent == FRAMES


def test_a_schedule_is_run_in_order_and_told_frame_by_frame(core: Core) -> None:
    core.set_up()
    answers = [bytes(range(length)) for length in (0, 1, 31, 32)]
    core.transmit = lambda address, payload: (SendOutcome.ACKED, answers[payload[0] - 1], payload[0])
    core.feed(encode_packet(bytes([PacketKind.SCHEDULE, 200]) + schedule_bytes(FRAMES[:4])))
    for index, answer in enumerate(answers):
        assert core.step() == (index < 3)
        head = bytes([PacketKind.RESULT, 200, index, SendOutcome.ACKED, index + 1, len(answer)])
        assert core.bodies() == [head + answer]
    assert core.sent == FRAMES[:4]
    assert not core.step()
    assert not core.said


def test_what_nobody_acknowledged_is_told_as_that_and_not_tried_again(core: Core) -> None:
    core.set_up()
    core.transmit = lambda address, payload: (SendOutcome.NOTHING, b"", 3)
    assert core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:1])) == [bytes([PacketKind.RESULT, 7, 0, 0, 3, 0])]
    assert len(core.sent) == 1


def test_the_same_frame_again_is_sent_again_and_its_answer_is_the_new_one(core: Core) -> None:
    core.set_up()
    count = iter(range(9))
    core.transmit = lambda address, payload: (SendOutcome.ACKED, bytes([next(count)]), 0)
    for number in range(3):
        (result,) = core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:1]))
        assert result[-1] == number
    assert core.sent == FRAMES[:1] * 3


def test_settings_reach_the_radio(core: Core) -> None:
    values = (125, 2, 3, 15, 4000)
    assert core.ask(PacketKind.CONFIGURE, settings_bytes(*values)) == [bytes([PacketKind.CONFIGURED, 7])]
    assert core.configured == [values]


@pytest.mark.parametrize("power", range(4))
def test_a_host_may_name_a_power_and_one_that_does_not_gets_all(core: Core, power: int) -> None:
    assert core.ask(PacketKind.CONFIGURE, settings_bytes() + bytes([power])) == [bytes([PacketKind.CONFIGURED, 7])]
    core.ask(PacketKind.SCAN)
    core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:1]))
    core.ask(PacketKind.CONFIGURE, settings_bytes())
    assert core.powers == [power, power, 3], "as it was after a scan, and in full if nothing is said"


@pytest.mark.parametrize(
    "values",
    [
        (126, 1, 5, 3, 500),
        (76, 3, 5, 3, 500),
        (76, 1, 2, 3, 500),
        (76, 1, 6, 3, 500),
        (76, 1, 5, 16, 500),
        (76, 1, 5, 3, 249),
        (76, 1, 5, 3, 4001),
    ],
)
def test_settings_out_of_range_do_not(core: Core, values: tuple[int, ...]) -> None:
    assert core.ask(PacketKind.CONFIGURE, settings_bytes(*values)) == refused(PacketKind.CONFIGURE, Refusal.MALFORMED)
    assert core.configured == []


@pytest.mark.parametrize(
    ("kind", "rest"),
    [
        (PacketKind.CONFIGURE, settings_bytes()[:-1]),
        (PacketKind.CONFIGURE, settings_bytes() + b"\4"),
        (PacketKind.CONFIGURE, settings_bytes() + b"\3\0"),
        (PacketKind.SCHEDULE, b""),
        (PacketKind.SCHEDULE, b"\0"),
        (PacketKind.SCHEDULE, schedule_bytes(FRAMES[:2])[:-1]),
        (PacketKind.SCHEDULE, schedule_bytes(FRAMES[:2]) + b"\0"),
        (PacketKind.SCHEDULE, b"\x11" + schedule_bytes(FRAMES)[1:]),
        (PacketKind.SCHEDULE, b"\xff"),
        (PacketKind.SCAN, b"\0"),
    ],
)
def test_malformed_requests_are_refused_and_change_nothing(core: Core, kind: PacketKind, rest: bytes) -> None:
    core.set_up()
    assert core.ask(kind, rest) == refused(kind, Refusal.MALFORMED)
    assert (len(core.configured), core.sent) == (1, [])


@pytest.mark.parametrize("kind", [0, 5, 0x7F, PacketKind.IDENT, PacketKind.RESULT, 0xFE])
def test_unknown_requests_are_refused(core: Core, kind: int) -> None:
    assert core.ask(kind, b"abc") == refused(kind, Refusal.UNKNOWN)


def test_nothing_is_sent_with_settings_that_were_never_made_or_were_lost(core: Core) -> None:
    wanted = refused(PacketKind.SCHEDULE, Refusal.UNCONFIGURED)
    assert core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES)) == wanted
    core.set_up()
    core.start()
    assert core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES)) == wanted
    assert core.sent == []


def test_a_chip_that_is_not_there_is_told_as_that(core: Core) -> None:
    core.has_chip = False
    assert core.ask(PacketKind.CONFIGURE, settings_bytes()) == refused(PacketKind.CONFIGURE, Refusal.CHIP)
    assert core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:1])) == refused(
        PacketKind.SCHEDULE, Refusal.UNCONFIGURED
    )
    core.has_chip = True
    core.set_up()
    core.has_chip = False
    assert core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:1])) == [
        bytes([PacketKind.RESULT, 7, 0, SendOutcome.BROKEN, 0, 0])
    ]


def test_a_length_that_no_payload_has_is_not_believed(core: Core) -> None:
    core.set_up()
    core.lied_length = 200
    assert core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:1])) == [
        bytes([PacketKind.RESULT, 7, 0, SendOutcome.ACKED, 0, 0])
    ]


# Ends of a schedule


def begin(core: Core) -> None:
    """Let it send the first two of sixteen frames."""
    core.set_up()
    core.feed(SCHEDULE)
    core.step(5)
    core.step(6)
    assert len(core.sent) == 2


def test_a_new_request_ends_the_one_before(core: Core) -> None:
    begin(core)
    core.take()
    core.feed(encode_packet(bytes([PacketKind.SCHEDULE, 2]) + schedule_bytes(FRAMES[:1])))
    while core.step():
        pass
    (result,) = core.bodies()
    assert result[1:3] == bytes([2, 0])
    assert len(core.sent) == 3


def test_so_does_an_introduction(core: Core) -> None:
    begin(core)
    core.feed(HELLO)
    assert not core.step()
    assert len(core.sent) == 2


def test_half_a_request_does_not(core: Core) -> None:
    begin(core)
    core.feed(HELLO[:-1])
    assert core.step(7)
    assert len(core.sent) == 3


def test_a_host_that_takes_nothing_more_ends_it(core: Core) -> None:
    begin(core)
    core.line_takes = False
    assert not core.step(7)
    assert not core.step(8)
    assert len(core.sent) == 3


def test_a_host_that_has_gone_ends_it(core: Core) -> None:
    begin(core)
    core.feed(HELLO[:4])
    core.abandon()
    assert not core.step(7)
    core.take()
    core.feed(HELLO)  # the beginning of another host's packet is not taken for part of this one
    assert core.bodies() == [ident(configured=True)]
    assert len(core.sent) == 2


@pytest.mark.parametrize("began_ms", [5, 2**32 - 300])
def test_so_does_time_also_when_the_clock_wraps(core: Core, began_ms: int) -> None:
    core.set_up()
    core.feed(SCHEDULE)
    for after_ms in (0, 400, 1000):
        assert core.step(began_ms + after_ms & 0xFFFFFFFF)
    assert not core.step(began_ms + 1001 & 0xFFFFFFFF)
    assert len(core.sent) == 3


# The scan


def test_a_scan_looks_at_every_channel_once_and_comes_back(core: Core) -> None:
    core.set_up()
    core.carriers = {0, 7, 8, 76, 125}
    (answer,) = core.ask(PacketKind.SCAN)
    bits = int.from_bytes(answer[2:], "little")
    assert {channel for channel in range(128) if bits >> channel & 1} == core.carriers
    core.carriers = {3}
    (answer,) = core.ask(PacketKind.SCAN)
    assert int.from_bytes(answer[2:], "little") == 1 << 3
    core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:2]))
    assert len(core.configured) == 2
    core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:2]))
    assert len(core.configured) == 2


def test_a_scan_that_was_broken_off_leaves_no_frame_on_a_strange_channel(core: Core) -> None:
    core.set_up()
    core.feed(encode_packet(bytes([PacketKind.SCAN, 1])))
    for _ in range(3):
        core.step()
    core.transmit = lambda address, payload: (SendOutcome.ACKED, bytes([len(core.configured)]), 0)
    (result,) = core.ask(PacketKind.SCHEDULE, schedule_bytes(FRAMES[:1]))
    assert result[-1] == 2


def test_a_scan_needs_no_settings(core: Core) -> None:
    core.carriers = {1}
    (answer,) = core.ask(PacketKind.SCAN)
    assert answer[0] == PacketKind.SCANNED
    assert core.configured == []


# Rubbish


def test_every_single_flipped_bit_is_noticed(core: Core) -> None:
    core.set_up()
    for at in range(8 * len(SCHEDULE)):
        spoilt = bytearray(SCHEDULE)
        spoilt[at >> 3] ^= 1 << (at & 7)
        core.feed(bytes(spoilt))
        while core.step():
            pass
        if at >> 3 not in (0, len(SCHEDULE) - 1):
            assert core.sent == [], at
        core.feed(b"\0")
        core.sent.clear()
        core.take()
    core.feed(HELLO)
    assert core.bodies()[0][:4] == bytes([PacketKind.IDENT, 9, 1, 1])


@pytest.mark.parametrize("seed", range(20))
def test_after_any_rubbish_the_next_packet_is_understood(core: Core, seed: int) -> None:
    random = Random(seed)
    for _ in range(50):
        core.feed(random.randbytes(random.randrange(2000)))
        core.take()
        core.feed(HELLO)
        assert core.bodies()[-1][:4] == bytes([PacketKind.IDENT, 9, 1, 0])


def test_damaged_packets_are_counted_up_to_a_limit_and_empty_ones_are_not(core: Core) -> None:
    core.feed(b"\0" * 100)
    core.feed(HELLO)
    assert core.bodies() == [ident()]
    core.feed(b"\x05abc\0" * 3 + HELLO[:-4] + b"\0")
    core.feed(HELLO)
    assert core.bodies() == [ident(bad=4)]
    core.feed(b"x\0" * 70_000)
    core.feed(HELLO)
    assert core.bodies() == [ident(bad=0xFFFF)]


def test_a_packet_without_end_is_dropped(core: Core) -> None:
    core.feed(b"\xfe" * 100_000)
    core.feed(HELLO)
    assert core.bodies() == [ident(bad=1)]


def test_a_packet_too_long_is_dropped_even_if_its_beginning_is_a_good_one(core: Core) -> None:
    core.set_up()
    body = bytes([PacketKind.SCHEDULE, 1]) + schedule_bytes([("FFFFFFFFFF", b"\xff" * 32)] * 16)
    core.feed(encode_packet(body)[:-1])
    core.feed(b"\x05more\0")
    assert not core.step()
    core.feed(encode_packet(body))
    assert core.step()


@pytest.mark.parametrize("body", [b"", b"\x01"])
def test_a_packet_too_short_for_a_request_is_dropped(core: Core, body: bytes) -> None:
    core.feed(encode_packet(body))
    assert core.bodies() == []


# The other side's coding, which is Python's


@pytest.mark.parametrize("length", [2, 5, 249, 250, 251, 252, 504, 505, 595])
@pytest.mark.parametrize("filler", [0, 1, 0xFF])
def test_packets_of_python_come_back_as_they_were(length: int, filler: int) -> None:
    body = bytes([filler]) * length
    packet = encode_packet(body)
    assert packet[0] == packet[-1] == 0
    assert 0 not in packet[1:-1]
    assert decode_packet(packet[1:-1]) == body


def test_stuffed_runs_of_254_mean_the_same_to_both_sides(core: Core) -> None:
    core.set_up()
    frames = [("FFFFFFFFFF", b"\xff" * 32)] * 16
    core.ask(PacketKind.SCHEDULE, schedule_bytes(frames))
    assert core.sent == frames
    assert b"\xff" + b"\xff" * 254 in encode_packet(schedule_bytes(frames))
