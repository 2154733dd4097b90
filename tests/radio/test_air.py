"""The modelled radio chips: repeats, retries, answers that lag, and how long it all takes."""

from __future__ import annotations

from random import Random

import pytest

from curveline.radio.mock.air import HOST_US, Air, Antenna, Heard, Weather
from curveline.radio.protocol.air_time import RETRIES


class Echo:
    """A node that notes what reached it and answers with how much that was."""

    def __init__(self) -> None:
        self.got: list[bytes] = []
        self.times: list[int] = []

    @property
    def ack(self) -> bytes:
        return bytes([len(self.got) & 0xFF]) * 32

    def advance(self, now_ms: int) -> None:
        self.times.append(now_ms)

    def receive(self, now_ms: int, payload: bytes) -> None:
        self.got.append(payload)


def exchanges(weather: Weather, count: int, seed: int = 1) -> tuple[Echo, list[Heard], list[bytes]]:
    node, air = Echo(), Air(weather, "1Mbps", Random(seed))
    antenna, now, heard, sent = Antenna(node), 0, [], []
    for number in range(count):
        sent.append(number.to_bytes(32, "little"))
        heard.append(air.exchange(antenna, sent[-1], now))
        now += heard[-1].took_us
    return node, heard, sent


def test_an_answer_was_loaded_before_the_question_came() -> None:
    node, heard, sent = exchanges(Weather(), 5)
    assert [each.payload for each in heard] == [bytes([number]) * 32 for number in range(5)]
    assert node.got == sent
    assert {each.retries for each in heard} == {0}


@pytest.mark.parametrize(("rate", "least", "most"), [("2Mbps", 580, 610), ("1Mbps", 900, 960), ("250kbps", 2800, 3000)])
def test_air_times_are_those_of_the_chip(rate: str, least: int, most: int) -> None:
    heard = Air(Weather(), rate, Random(1)).exchange(Antenna(Echo()), bytes(32), 0)
    assert least <= heard.took_us - HOST_US <= most


def test_every_packet_of_a_dead_node_is_tried_four_times() -> None:
    node, heard, _ = exchanges(Weather(loss=1.0), 3)
    assert [each.payload for each in heard] == [None] * 3
    assert [each.retries for each in heard] == [RETRIES] * 3
    assert node.got == []
    assert 3000 < heard[0].took_us - HOST_US < 5000


@pytest.mark.parametrize(("loss", "answered"), [(0.1, 0.999), (0.3, 0.93), (0.5, 0.684)])
def test_loss_counts_in_each_direction(loss: float, answered: float) -> None:
    node, heard, sent = exchanges(Weather(loss), 4000)
    share = sum(each.payload is not None for each in heard) / len(sent)
    assert share == pytest.approx(answered, abs=0.02)
    reached = len(node.got) / len(sent)
    assert reached == pytest.approx(1 - loss ** (1 + RETRIES), abs=0.02)


def test_a_retry_whose_answer_was_lost_reaches_the_node_once_and_gets_the_same_answer() -> None:
    node, heard, sent = exchanges(Weather(0.5), 500)
    assert len(node.got) == len(set(node.got)) <= len(sent)
    positions = [sent.index(each) for each in node.got]
    assert positions == sorted(positions)
    for number, each in enumerate(heard):
        if each.payload is not None:
            assert each.payload == bytes([node.got.index(sent[number]) & 0xFF]) * 32


def test_equal_polls_to_four_nodes_starve_them_and_to_three_do_not() -> None:
    for count, starves in ((3, False), (4, True), (5, False), (8, True)):
        air, antennas = Air(Weather(), "1Mbps", Random(1)), [Antenna(Echo()) for _ in range(count)]
        for _ in range(10):
            for antenna in antennas:
                assert air.exchange(antenna, bytes(32), 0).payload is not None
        got = {len(antenna.node.got) for antenna in antennas}  # type: ignore[attr-defined]
        assert got == ({1} if starves else {10})


def test_a_duplicate_comes_as_a_new_packet() -> None:
    node, heard, sent = exchanges(Weather(duplicate=0.999), 10)
    assert len(node.got) == 20
    assert set(node.got) == set(sent)
    assert heard[0].took_us > 2 * HOST_US


def test_stale_answers_come_from_the_last_three() -> None:
    _, heard, _ = exchanges(Weather(stale=0.9), 200)
    fresh = [each.payload == bytes([number]) * 32 for number, each in enumerate(heard)]
    assert 5 < sum(fresh) < 60


def test_corruption_flips_one_bit_either_way() -> None:
    node, heard, sent = exchanges(Weather(corrupt=0.5), 400)

    def flips(a: bytes, b: bytes) -> int:
        return bin(int.from_bytes(a, "little") ^ int.from_bytes(b, "little")).count("1")

    inward = [flips(got, want) for got, want in zip(node.got, sent, strict=True)]
    outward = [flips(each.payload or b"", bytes([number & 0xFF]) * 32) for number, each in enumerate(heard[:256])]
    for flipped in (inward, outward):
        assert set(flipped) == {0, 1}
        assert 0.35 < sum(flipped) / len(flipped) < 0.65


def test_the_same_seed_gives_the_same_air() -> None:
    weather = Weather(0.3, 0.1, 0.1, 0.1)
    assert exchanges(weather, 200, 7)[1] == exchanges(weather, 200, 7)[1]
    assert exchanges(weather, 200, 7)[1] != exchanges(weather, 200, 8)[1]


def test_the_node_s_time_is_when_the_packet_arrives() -> None:
    node, _, _ = exchanges(Weather(), 3)
    assert node.times == sorted(node.times)
    assert node.times[-1] >= 3


def test_a_chip_that_restarts_numbers_its_packets_anew() -> None:
    node, air = Echo(), Air(Weather(), "1Mbps", Random(1))
    antenna = Antenna(node)
    air.exchange(antenna, bytes(32), 0)
    air.exchange(antenna, bytes(32), 0)
    assert len(node.got) == 2
    air.reset()
    air.exchange(Antenna(Echo()), bytes(32), 0)
    air.exchange(antenna, bytes(32), 0)
    assert len(node.got) == 2, "same packet id and content as the one before: dropped"
