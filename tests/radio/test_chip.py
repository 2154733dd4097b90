"""The chip model against what the product specification of the nRF24L01+ promises, and against its known traps."""

from __future__ import annotations

import pytest

from .chip import Mode, Packet
from .chip_setup import RATES, Host, Listener, drain, read, set_up, write
from .chipbank import (
    CONFIG,
    DEFAULTS,
    EN_AA,
    EN_RXADDR,
    FEATURE,
    FIFO_STATUS,
    FLUSH_RX,
    MAX_RT,
    NOP,
    OBSERVE_TX,
    R_RX_PAYLOAD,
    R_RX_PL_WID,
    REUSE_TX_PL,
    RF_CH,
    RF_SETUP,
    RPD,
    RX_ADDR_P0,
    RX_ADDR_P1,
    RX_DR,
    RX_PW_P0,
    SETUP_AW,
    SETUP_RETR,
    STATUS,
    TX_ADDR,
    TX_DS,
    W_TX_PAYLOAD,
    W_TX_PAYLOAD_NOACK,
)
from .ether import Chip, Ether

A, B = b"\x01\xc1\xc1\xc1\xc1", b"\x02\xc1\xc1\xc1\xc1"
BLANK = bytes(32)


@pytest.fixture
def ether() -> Ether:
    return Ether()


@pytest.fixture
def host(ether: Ether) -> Host:
    return Host(ether)


def frame(number: int) -> bytes:
    return bytes([number]) + bytes(31)


# Registers


def test_registers_begin_as_specified(ether: Ether) -> None:
    chip = Chip(ether)
    for register, value in DEFAULTS.items():
        assert read(chip, register) == value, hex(register)
    assert (read(chip, STATUS), read(chip, FIFO_STATUS), read(chip, OBSERVE_TX)) == (0x0E, 0x11, 0)
    assert chip.command(bytes([RX_ADDR_P0]) + bytes(5)) == b"\x0e" + b"\xe7" * 5
    assert chip.command(bytes([RX_ADDR_P1]) + bytes(5))[1:] == b"\xc2" * 5
    assert [read(chip, RX_ADDR_P1 + pipe) for pipe in range(1, 5)] == [0xC3, 0xC4, 0xC5, 0xC6]


@pytest.mark.parametrize(
    ("register", "kept"), [(CONFIG, 0x7F), (EN_AA, 0x3F), (SETUP_AW, 3), (RF_CH, 0x7F), (RF_SETUP, 0xBE), (FEATURE, 7)]
)
def test_only_bits_that_exist_are_kept(ether: Ether, register: int, kept: int) -> None:
    chip = Chip(ether)
    write(chip, register, 0xFF)
    assert read(chip, register) == kept


def test_what_cannot_be_written_stays(ether: Ether) -> None:
    chip = Chip(ether)
    for register in (OBSERVE_TX, RPD, FIFO_STATUS, 0x18, 0x1E):
        before = read(chip, register)
        write(chip, register, 0xFF)
        assert read(chip, register) == before


def test_every_command_begins_with_the_status(ether: Ether) -> None:
    assert Chip(ether).command(bytes([NOP])) == b"\x0e"


def test_an_address_is_written_from_its_least_significant_byte_on(ether: Ether) -> None:
    chip = Chip(ether)
    write(chip, TX_ADDR, 1, 2, 3)
    assert chip.command(bytes([TX_ADDR]) + bytes(5))[1:] == b"\x01\x02\x03\xe7\xe7"


def test_a_dip_of_the_supply_forgets_everything(host: Host) -> None:
    host.chip.command(bytes([W_TX_PAYLOAD, 1]))
    host.chip.reset()
    assert read(host.chip, CONFIG) == DEFAULTS[CONFIG]
    assert read(host.chip, FIFO_STATUS) == 0x11
    assert host.chip.mode is Mode.DOWN


@pytest.mark.parametrize("level", [0x00, 0xFF])
def test_a_chip_that_is_gone_reads_as_the_idle_bus(host: Host, level: int) -> None:
    host.chip.unplugged = level
    write(host.chip, RF_CH, 5)
    assert host.chip.command(bytes([RF_CH, NOP])) == bytes([level, level])
    host.chip.unplugged = None
    assert read(host.chip, RF_CH) == 76


def test_bytes_without_select_go_nowhere(host: Host) -> None:
    assert host.chip.transfer(NOP) == 0


# One exchange


def test_writing_a_flag_takes_down_that_flag_only(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    node.load(frame(9))
    host.send(A, frame(1))
    node.chip.bank.flags |= MAX_RT
    write(node.chip, STATUS, MAX_RT)
    assert read(node.chip, STATUS) & 0x70 == RX_DR
    write(node.chip, STATUS, RX_DR)
    assert read(node.chip, STATUS) & 0x70 == 0


def test_a_payload_arrives_and_is_acknowledged(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    assert host.send(A, frame(1)) == TX_DS
    assert node.chip.irq == 0
    assert node.heard() == [frame(1)]
    assert node.chip.irq == 1
    assert (host.answers(), host.retries) == ([], 0)


@pytest.mark.parametrize(("rate", "air_us"), [("2Mbps", 165), ("1Mbps", 329), ("250kbps", 1316)])
def test_an_exchange_takes_the_time_of_the_specification(ether: Ether, rate: str, air_us: int) -> None:
    assert Packet(0, {"250kbps": 250, "1Mbps": 1000, "2Mbps": 2000}[rate], 2, True, A, BLANK).air_us == air_us
    host, node = Host(ether, rate), Listener(ether, A, rate)
    node.load(BLANK)
    begin_us = ether.now_us
    assert host.send(A, BLANK) == TX_DS | RX_DR
    assert 0 <= ether.now_us - begin_us - (130 + air_us + 130 + air_us) <= 10


def test_the_answer_was_loaded_before_the_question(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    node.load(frame(100))
    for number in range(1, 5):
        assert host.send(A, frame(number)) == TX_DS | RX_DR
        assert host.answers() == [frame(99 + number)]
        assert node.heard() == [frame(number)]
        node.reload(frame(100 + number))


def test_answers_queue_up_and_the_fourth_is_lost(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    for number in range(4):
        node.load(frame(number))
    assert read(node.chip, FIFO_STATUS) & 0x20
    heard = []
    for number in range(5):
        host.send(A, frame(number))
        node.heard()
        heard += host.answers()
    assert heard == [frame(0), frame(1), frame(2)]


def test_an_answer_leaves_the_queue_with_the_next_new_packet(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    node.load(frame(9))
    host.send(A, frame(1))
    assert not read(node.chip, FIFO_STATUS) & 0x10
    node.heard()
    host.send(A, frame(2))
    assert read(node.chip, FIFO_STATUS) & 0x10
    assert read(node.chip, STATUS) & TX_DS


def test_short_and_long_payloads_keep_their_size(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    for size in (1, 7, 32):
        host.send(A, bytes([size]) * size)
        assert node.chip.command(bytes([R_RX_PL_WID, NOP]))[1] == size
        assert node.heard() == [bytes([size]) * size]


def test_a_pipe_of_fixed_size_takes_no_other(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    write(node.chip, FEATURE, 0)
    write(node.chip, RX_PW_P0 + 1, 8)
    assert host.send(A, bytes(7)) == MAX_RT
    host.flush()
    assert host.send(A, bytes(8)) == TX_DS


# Who hears whom


@pytest.mark.parametrize("other", [{"channel": 77}, {"rate": "2Mbps"}, {"address": B}])
def test_other_channels_rates_and_addresses_are_not_heard(ether: Ether, host: Host, other: dict[str, object]) -> None:
    Listener(ether, **{"address": A, **other})  # type: ignore[arg-type]
    assert host.send(A, frame(1)) == MAX_RT


def test_another_crc_or_address_width_is_not_heard(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    write(node.chip, CONFIG, 0x0B)
    assert host.send(A, frame(1)) == MAX_RT
    host.flush()
    write(node.chip, CONFIG, 0x0F)
    write(node.chip, SETUP_AW, 2)
    assert host.send(A, frame(1)) == MAX_RT


def test_pipes_above_1_share_all_but_a_byte(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    write(node.chip, RX_ADDR_P1 + 2, 0x33)
    write(node.chip, EN_RXADDR, 0x08)
    write(node.chip, 0x1C, 0x08)
    assert host.send(b"\x33" + A[1:], frame(1)) == TX_DS
    assert read(node.chip, STATUS) >> 1 & 7 == 3


def test_the_sender_must_listen_on_its_own_target(ether: Ether, host: Host) -> None:
    Listener(ether, A)
    write(host.chip, EN_RXADDR, 0)
    assert host.send(A, frame(1)) == MAX_RT


def test_two_senders_at_once_spoil_each_other(ether: Ether, host: Host) -> None:
    node, second = Listener(ether, A), Host(ether)
    write(second.chip, TX_ADDR, *A)
    second.chip.command(bytes([W_TX_PAYLOAD]) + frame(7))
    second.chip.ce = 1
    host.send(A, frame(8))
    ether.advance(ether.now_us + 20_000)
    assert node.heard() == []


def test_a_signal_on_the_channel_shows_in_rpd(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    assert read(node.chip, RPD) == 0
    host.send(B, frame(1))
    assert read(node.chip, RPD) == 1


# Loss


def test_silence_ends_in_max_rt_and_the_payload_stays(ether: Ether, host: Host) -> None:
    begin_us = ether.now_us
    assert host.send(A, frame(1)) == MAX_RT
    assert host.retries == 3
    assert 0 <= ether.now_us - begin_us - 4 * (130 + 329 + 500) <= 10
    assert not read(host.chip, FIFO_STATUS) & 0x10
    assert read(host.chip, OBSERVE_TX) >> 4 == 1
    host.flush()
    assert read(host.chip, FIFO_STATUS) & 0x10


def test_an_unflushed_payload_goes_out_before_the_next(ether: Ether, host: Host) -> None:
    host.send(A, frame(1))
    node = Listener(ether, A)
    host.send(A, frame(2))
    assert node.heard()[0] == frame(1)


def test_nothing_is_sent_while_max_rt_is_up(ether: Ether, host: Host) -> None:
    host.chip.command(bytes([W_TX_PAYLOAD]) + frame(1))
    host.chip.ce = 1
    ether.advance(ether.now_us + 50_000)
    assert ether.sent == 4
    write(host.chip, STATUS, MAX_RT)
    ether.advance(ether.now_us + 50_000)
    assert ether.sent == 8


def test_lost_packets_saturate_until_the_channel_is_written(host: Host) -> None:
    for _ in range(17):
        host.send(A, frame(1))
        host.flush()
    assert read(host.chip, OBSERVE_TX) >> 4 == 15
    write(host.chip, RF_CH, 76)
    assert read(host.chip, OBSERVE_TX) >> 4 == 0


def test_a_lost_acknowledgement_does_not_deliver_twice(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    node.load(frame(50))
    lost = iter([True, True])
    ether.jams = lambda sender, _receiver, _packet: sender is node.chip and next(lost, False)
    assert host.send(A, frame(1)) == TX_DS | RX_DR
    assert host.retries == 2
    assert node.heard() == [frame(1)]
    assert host.answers() == [frame(50)]


def test_a_failed_write_may_have_been_delivered(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    ether.jams = lambda sender, _receiver, _packet: sender is node.chip
    assert host.send(A, frame(1)) == MAX_RT
    assert node.heard() == [frame(1)]


def test_the_answer_has_to_fit_into_the_retry_delay(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    node.load(BLANK)
    write(host.chip, SETUP_RETR, 0x03)
    assert host.send(A, frame(1)) == MAX_RT


def test_loss_is_seeded_and_costs_retries() -> None:
    def run(seed: int) -> list[tuple[int, int]]:
        ether = Ether(loss=0.3, seed=seed)
        host, node = Host(ether), Listener(ether, A)
        results = []
        for number in range(50):
            results.append((host.send(A, frame(number)), host.retries))
            host.flush()
            node.heard()
        return results

    assert run(1) == run(1) != run(2)
    assert sum(retries for _, retries in run(1)) > 20


def test_corruption_is_delivered_with_one_bit_wrong() -> None:
    ether = Ether(corrupt=1.0, seed=4)
    host, node = Host(ether), Listener(ether, A)
    host.send(A, BLANK)
    (heard,) = node.heard()
    assert sum(byte.bit_count() for byte in heard) == 1


# The repeat filter


@pytest.mark.parametrize(("count", "shown"), [(1, 8), (2, 8), (3, 8), (4, 1), (5, 8), (8, 1)])
def test_constant_polls_of_4_nodes_in_turn_are_filtered(ether: Ether, host: Host, count: int, shown: int) -> None:
    nodes = [Listener(ether, bytes([number]) + A[1:]) for number in range(count)]
    heard = 0
    for _ in range(8):
        for node in nodes:
            assert host.send(node.address, BLANK) == TX_DS, "the hardware acknowledges all the same"
        heard += len(nodes[0].heard())
        for node in nodes[1:]:
            node.heard()
    assert heard == shown


def test_polls_that_differ_pass_the_filter(ether: Ether, host: Host) -> None:
    nodes = [Listener(ether, bytes([number]) + A[1:]) for number in range(4)]
    for counter in range(8):
        for node in nodes:
            host.send(node.address, frame(counter))
            assert node.heard() == [frame(counter)]


def test_the_filter_survives_power_down_but_not_a_dip(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)

    def send_round() -> int:
        for _ in range(3):
            host.send(B, BLANK)
            host.flush()
        host.send(A, BLANK)
        return len(node.heard())

    assert send_round() == 1
    write(node.chip, CONFIG, 0x0D)
    write(node.chip, CONFIG, 0x0F)
    ether.advance(ether.now_us + 5000)
    assert send_round() == 0
    node.chip.reset()
    set_up(node.chip, 0x0F)
    write(node.chip, RX_ADDR_P1, *A)
    ether.advance(ether.now_us + 5000)
    assert send_round() == 1


# FIFOs


def test_a_full_rx_fifo_is_deaf(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    for number in range(3):
        assert host.send(A, frame(number)) == TX_DS
    assert read(node.chip, FIFO_STATUS) & 2
    assert host.send(A, frame(3)) == MAX_RT
    assert drain(node.chip) == [frame(0), frame(1), frame(2)]


def test_answers_that_are_not_read_block_the_sender(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    for number in range(4):
        node.reload(frame(number))
        flags = host.send(A, frame(number))
        node.heard()
    assert flags == MAX_RT
    host.flush()
    host.chip.command(bytes([FLUSH_RX]))
    node.reload(frame(5))
    assert host.send(A, frame(5)) == TX_DS | RX_DR


def test_a_fourth_payload_to_send_is_lost(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    write(host.chip, TX_ADDR, *A)
    write(host.chip, RX_ADDR_P0, *A)
    for number in range(4):
        host.chip.command(bytes([W_TX_PAYLOAD]) + frame(number))
    assert host.chip.command(bytes([NOP]))[0] & 1
    host.chip.ce = 1
    ether.advance(ether.now_us + 20_000)
    assert node.heard() == [frame(0), frame(1), frame(2)]


def test_reading_the_payload_takes_it_out(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    host.send(A, frame(1))
    assert node.chip.command(bytes([R_RX_PAYLOAD]) + bytes(32))[1:] == frame(1)
    assert read(node.chip, FIFO_STATUS) & 1


def test_reused_payloads_go_out_again_and_are_repeats(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    write(host.chip, TX_ADDR, *A)
    write(host.chip, RX_ADDR_P0, *A)
    host.chip.command(bytes([W_TX_PAYLOAD]) + frame(1))
    host.chip.command(bytes([REUSE_TX_PL]))
    host.chip.ce = 1
    ether.advance(ether.now_us + 10_000)
    assert ether.sent > 4
    assert node.heard() == [frame(1)]


def test_a_packet_without_acknowledgement(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    write(host.chip, TX_ADDR, *A)
    write(host.chip, FEATURE, 0x07)
    host.chip.command(bytes([W_TX_PAYLOAD_NOACK]) + frame(1))
    host.chip.ce = 1
    assert host.wait() == TX_DS
    assert node.heard() == [frame(1)]
    assert ether.sent == 1


# Modes and times


def test_it_takes_time_to_wake_up(ether: Ether) -> None:
    chip = Chip(ether)
    set_up(chip, 0x0E)
    assert chip.mode is Mode.STARTING
    ether.advance(1499)
    assert chip.mode is Mode.STARTING
    ether.advance(1500)
    assert chip.mode is Mode.STANDBY


def test_a_dip_while_it_wakes_up_begins_anew(ether: Ether) -> None:
    chip = Chip(ether)
    set_up(chip, 0x0E)
    ether.advance(1000)
    chip.reset()
    set_up(chip, 0x0E)
    ether.advance(1500)
    assert chip.mode is Mode.STARTING
    ether.advance(2500)
    assert chip.mode is Mode.STANDBY


def test_a_pulse_on_ce_sends_if_it_is_long_enough(ether: Ether, host: Host) -> None:
    for width_us, packets in ((9, 0), (10, 4)):
        host.chip.command(bytes([W_TX_PAYLOAD]) + frame(1))
        host.chip.ce = 1
        ether.advance(ether.now_us + width_us)
        host.chip.ce = 0
        ether.advance(ether.now_us + 10_000)
        assert ether.sent == packets


def test_a_receiver_needs_time_to_settle(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    node.chip.ce = 0
    assert node.chip.mode is Mode.STANDBY
    node.chip.ce = 1
    assert not node.chip.hears(Packet(76, 1000, 2, True, A, BLANK), ether.now_us + 129)
    assert node.chip.hears(Packet(76, 1000, 2, True, A, BLANK), ether.now_us + 130)


def test_powered_down_it_is_silent_and_deaf(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    write(node.chip, CONFIG, 0x0D)
    assert host.send(A, frame(1)) == MAX_RT
    assert node.chip.mode is Mode.DOWN


def test_masked_flags_do_not_interrupt(ether: Ether, host: Host) -> None:
    node, levels = Listener(ether, A), []
    node.chip.on_irq = levels.append
    host.send(A, frame(1))
    node.heard()
    ether.advance(ether.now_us)
    assert levels == [0, 1]
    write(node.chip, CONFIG, 0x4F)
    host.send(A, frame(2))
    assert (node.heard(), levels) == ([frame(2)], [0, 1])


def test_a_receiver_that_dips_acknowledges_no_more(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    write(host.chip, TX_ADDR, *A)
    host.chip.command(bytes([W_TX_PAYLOAD]) + frame(1))
    host.chip.ce = 1
    ether.advance(ether.now_us + 130 + 329 + 60)
    assert node.chip.mode is Mode.ACKING
    node.chip.reset()
    ether.advance(ether.now_us + 200)
    assert ether.sent == 1


def test_a_dip_during_a_packet_is_survived(ether: Ether, host: Host) -> None:
    node = Listener(ether, A)
    for wait_us in range(0, 1200, 50):
        write(host.chip, TX_ADDR, *A)
        host.chip.command(bytes([W_TX_PAYLOAD]) + frame(1))
        host.chip.ce = 1
        ether.advance(ether.now_us + wait_us)
        (host.chip if wait_us % 100 else node.chip).reset()
        ether.advance(ether.now_us + 20_000)
        host.chip.ce = 0
        set_up(host.chip, 0x0E)
        set_up(node.chip, 0x0F)
        write(node.chip, RX_ADDR_P1, *A)
        ether.advance(ether.now_us + 5000)
        host.flush()
        write(host.chip, STATUS, 0x70)
        node.heard()
        assert host.send(A, frame(wait_us % 251)) == TX_DS
        host.answers()
        node.heard()


def test_the_ether_tells_when_the_next_thing_is_due(ether: Ether) -> None:
    assert ether.next_us() is None
    happened: list[int] = []
    ether.at(50, lambda: happened.append(2))
    ether.at(20, lambda: happened.append(1))
    ether.at(50, lambda: happened.append(3))
    assert ether.next_us() == 20
    ether.advance(49)
    assert (happened, ether.now_us) == ([1], 49)
    ether.advance(100)
    assert happened == [1, 2, 3]


def test_every_rate_is_read_from_its_bits(ether: Ether) -> None:
    chip = Chip(ether)
    for rate, kbps in (("250kbps", 250), ("1Mbps", 1000), ("2Mbps", 2000)):
        write(chip, RF_SETUP, RATES[rate])
        assert chip.bank.kbps == kbps
