"""Which channel is quiet: what is counted, what follows, and that it helps to follow it."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.radio.interface import Radio
from curveline.radio.measuring import channels
from curveline.radio.measuring.carriers import count_carriers, share_between
from curveline.radio.measuring.channels import ChannelScan, measure_channels
from curveline.radio.mock.display import open_radio
from curveline.radio.protocol.band import ALLOWED, CHANNELS, USUAL_WLANS, wlan_at, wlan_span

from .bench import drive_table

DRIVE = drive_table(1)
LOOKS = 1000


def scan_of(share: Callable[[int], float], channel: int = 76, rate: str = "1Mbps") -> ChannelScan:
    """A scan in which others send on each channel for such a part of the time."""
    hits = tuple(round(LOOKS * share(each)) for each in range(CHANNELS))
    return ChannelScan("mock", replace(DRIVE, channel=channel, data_rate=rate), 120.0, LOOKS, hits)


def wlan(number: int, share: float = 0.3) -> Callable[[int], float]:
    return lambda channel: share if channel in wlan_span(number) else 0.0


@pytest.mark.parametrize(
    ("hits", "looks", "low", "high"),
    [(0, 950, 0.0, 0.004028), (10, 100, 0.055229, 0.174367), (50, 50, 0.928649, 1.0), (0, 0, 0.0, 1.0)],
)
def test_the_interval_of_a_share_is_wilsons(hits: int, looks: int, low: float, high: float) -> None:
    assert share_between(hits, looks) == pytest.approx((low, high), abs=1e-6)


def test_every_look_counts_and_the_time_is_kept(tmp_path: Path) -> None:
    radio = open_radio("noise=6@0.5,seed=3", DRIVE, tmp_path)
    begin_us = radio.now_us()
    looks, hits = count_carriers(radio, 30.0)
    assert 30.0 <= (radio.now_us() - begin_us) / 1e6 <= 30.2
    assert looks > 200
    for channel in range(CHANNELS):
        assert hits[channel] / looks == pytest.approx(0.5 if channel in wlan_span(6) else 0.0, abs=0.1)
    assert count_carriers(radio, 1e-9)[0] == 1
    radio.close()


def test_nothing_is_sent_meanwhile(tmp_path: Path) -> None:
    radio = open_radio("noise=6,seed=3", DRIVE, tmp_path)
    before = [(replace(node.memory), node.ack) for node in radio.nodes]
    count_carriers(radio, 5.0)
    assert [(node.memory, node.ack) for node in radio.nodes] == before
    assert radio._chip.air._packet_id == 0
    radio.close()


def test_a_quiet_channel_is_kept() -> None:
    for found in (scan_of(lambda channel: 0.0), scan_of(wlan(6)), scan_of(lambda channel: 0.015)):
        assert (found.is_well, found.advised) == (True, 76)
        assert list(found.advice()) == ["the display can stay on channel 76: it is quiet"]


def test_a_few_looks_do_not_call_a_channel_quiet() -> None:
    few = replace(scan_of(lambda channel: 0.0), looks=4)
    (advice,) = few.advice()
    assert "4 looks show only that others send for at most 49% of the time; listen for longer" in advice
    enough = replace(few, looks=80)
    assert list(enough.advice()) == ["the display can stay on channel 76: it is quiet"]


@pytest.mark.parametrize("number", range(10, 14))
def test_a_noisy_one_is_left_for_one_that_common_wlans_leave_free(number: int) -> None:
    found = scan_of(wlan(number), channel=65)
    assert not found.is_well
    assert found.advised in ALLOWED
    assert not set(wlan_at(found.advised)) & {*USUAL_WLANS, number}
    assert found.noise(found.advised).share == 0.0
    assert found.wlans == ((number, 0.3),)
    text = " ".join(found.advice())
    assert f"as WLAN does on its channel {number}" in text
    assert f"take channel {found.advised}" in text
    assert "`curveline node settings --display FILE --old-channel 65`" in text


def test_where_all_is_noisy_it_says_so_and_does_not_send_people_around() -> None:
    found = scan_of(lambda channel: 0.3 if channel == 76 else 0.2)
    assert (found.is_well, found.advised) == (True, 76)
    assert "no other channel is much better" in " ".join(found.advice())


def test_neighbours_that_a_receiver_hears_count() -> None:
    spike = scan_of(lambda channel: 0.4 if channel == 78 else 0.0)
    assert spike.present.share == 0.0
    assert scan_of(lambda channel: 0.4 if channel == 78 else 0.0, rate="2Mbps").present.share == 0.4
    assert spike.noise(77).share == spike.noise(79).share == 0.4
    assert [scan_of(lambda channel: 0.4 * (channel in (0, 125))).noise(each).share for each in (0, 125)] == [0.4, 0.4]


def test_a_channel_beyond_the_free_band_is_named_and_never_advised() -> None:
    found = scan_of(lambda channel: 0.0, channel=110)
    assert "2510 MHz, is outside of 2402 to 2481 MHz" in " ".join(found.advice())
    packed = scan_of(lambda channel: 0.5 if channel <= 83 else 0.0)
    assert packed.advised == 76
    assert all(each.channel in ALLOWED for each in packed.best)


def test_several_wlans_are_told_apart() -> None:
    found = scan_of(lambda channel: max(wlan(1, 0.2)(channel), wlan(6, 0.6)(channel), wlan(13, 0.1)(channel)))
    assert found.wlans == ((6, 0.6), (1, 0.2), (13, 0.1))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_who_follows_the_advice_loses_less(tmp_path: Path, seed: int) -> None:
    """On the mock, whose noise costs packets where it is."""
    noise = f"fresh,noise=13@0.4+1@0.2,seed={seed}"

    def failed(radio: Radio) -> int:
        answers = [each for _ in range(100) for each in radio.exchange([(DRIVE.addresses[0], bytes(32))])]
        return sum(each.retries + (each.payload is None) for each in answers)

    radio = open_radio(noise, DRIVE, tmp_path)
    found = measure_channels(radio, "mock", DRIVE, 20.0)
    before = failed(radio)
    radio.close()
    assert not found.is_well
    radio = open_radio(noise, replace(DRIVE, channel=found.advised), tmp_path)
    assert (before > 80, failed(radio)) == (True, 0)
    radio.close()


def test_what_is_kept_says_the_same_in_all_forms() -> None:
    found = scan_of(wlan(13))
    document = json.loads(channels.to_json(found))
    assert document == json.loads(json.dumps(found.document()))
    assert (document["advised"], document["present"]["in_use"], document["looks"]) == (found.advised, 0.3, LOOKS)
    rows = list(csv.DictReader(io.StringIO(channels.to_csv(found).decode())))
    assert [int(row["in_use"]) for row in rows] == list(found.hits)
    assert [float(row["share"]) for row in rows] == [each["in_use"] for each in document["channels"]]
    assert [int(row["mhz"]) for row in rows] == [2400 + channel for channel in range(CHANNELS)]
