"""Who is polled when: lost nodes cost little, a stop waits for no long batch, and other hosts are left in peace."""

from __future__ import annotations

import pytest

from curveline.radio.host.actions import Phase, Policy, Send
from curveline.radio.host.peer import Peer
from curveline.radio.host.polling import ANSWER_MS, CYCLES, DOUBTFUL, LOSS_MS, Pace
from curveline.radio.mock.air import Air, Weather
from curveline.radio.protocol.air_time import RATES_KBPS

from .bench import Bench, make_plan


def peers(count: int) -> list[Peer]:
    return [Peer(number, f"{number:010X}", bytes(16), 0) for number in range(1, count + 1)]


@pytest.mark.parametrize("rate", RATES_KBPS)
def test_the_costs_are_those_of_the_air(rate: str) -> None:
    air = Air(Weather(), rate, None)  # type: ignore[arg-type]
    unheard_ms = air.unheard().took_us / 1000
    assert unheard_ms <= LOSS_MS[rate] < unheard_ms + 2
    assert ANSWER_MS[rate] >= (2 * air._way_us + 600) / 1000
    in_a_batch = DOUBTFUL * unheard_ms + (Pace(Policy(), 2, rate)._batch - DOUBTFUL) * ANSWER_MS[rate]
    assert in_a_batch < 75, "a hold asked for now is on the air within 0.1 s"


@pytest.mark.parametrize(("count", "silence_ms"), [(2, 1000), (50, 1000), (100, 2000), (250, 5000), (300, 5000)])
def test_the_dead_man_allows_for_ten_cycles_within_reason(count: int, silence_ms: int) -> None:
    assert Pace(Policy(), count, "2Mbps").silence_ms == silence_ms


def test_a_slow_rate_makes_a_long_cycle() -> None:
    assert Pace(Policy(), 50, "250kbps").silence_ms == 2000


def test_a_batch_takes_the_longest_due_and_no_more_than_fit() -> None:
    pace, row = Pace(Policy(), 20, "2Mbps"), peers(20)
    for peer in row:
        peer.due_ms, peer.heard_ms = 1000 - peer.number, 990
    row[19].due_ms = 1001
    batch = pace.batch(row, 1000)
    assert [peer.number for peer in batch] == list(range(19, 3, -1))
    for peer in row[5:15]:
        peer.heard_ms = 0
    batch = pace.batch(row, 1000)
    assert [peer.number for peer in batch if peer.heard_ms == 0] == [15, 14, 13, 12]
    assert len(batch) == 13
    assert pace.batch(row, 900) == []


def test_a_lost_node_is_asked_less_often_the_more_there_are() -> None:
    pace, row = Pace(Policy(), 8, "2Mbps"), peers(8)
    pace.after_loss(row, row[0], 5000)
    assert row[0].due_ms == 5004
    for count in (1, 2, 4, 8):
        for peer in row[:count]:
            peer.unheard = CYCLES
        pace.after_loss(row, row[0], 5000)
        wait_ms = row[0].due_ms - 5000
        assert count * LOSS_MS["2Mbps"] <= wait_ms / 10
        assert wait_ms >= 100


@pytest.mark.parametrize("dead", [1, 3])
def test_lost_nodes_take_a_tenth_of_the_air(dead: int) -> None:
    """Nodes that went silent for good, in the seconds before the run is halted for it."""
    bench = Bench(make_plan(4, seconds=9.0))
    bench.run_to(Phase.RELEASED, 1)
    bench.run_for(100)

    def jam(send: Send) -> None:
        bench.air.weather = Weather(float(send.node <= dead))

    bench.hooks.append(jam)
    bench.run_for(2000)
    begin_us, lost_us = bench.now_us, 0
    send = bench.send

    def timed(action: Send) -> object:
        nonlocal lost_us
        before = bench.now_us
        heard = send(action)
        lost_us += (bench.now_us - before) * (action.node <= dead)
        return heard

    bench.send = timed  # type: ignore[method-assign, assignment]
    bench.run_for(3000)
    assert bench.conductor.phase is Phase.RELEASED
    assert 0 < lost_us <= 0.1 * (bench.now_us - begin_us)
    alive = bench.conductor.peers[3]
    assert alive.tally.polls > 100, "those that answer are polled as before"
