"""Asking who is there: chips, doubles, misfits, and what can be told of radio chips."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import Halted, read_status, send_plan
from curveline.radio.host.scan import PROBES, problems, radio_test, scan
from curveline.radio.mock.display import MockRadio, open_radio
from curveline.radio.protocol.codes import OFFERS_END

from .bench import drive_table, make_plan


@pytest.fixture
def opened(tmp_path: Path):
    radios: list[MockRadio] = []

    def opener(settings: str = "", count: int = 2) -> MockRadio:
        radios.append(open_radio(settings, drive_table(count), tmp_path))
        return radios[-1]

    yield opener
    for radio in radios:
        radio.close()


def said(radio: MockRadio, count: int = 2) -> list[str]:
    drive = drive_table(count)
    return [text for each in scan(radio, drive) for text in problems(each, radio.site.chips[each.node - 1], drive)]


def test_every_node_says_which_chip_it_is(opened) -> None:
    radio = opened("seed=1", 20)
    found = scan(radio, drive_table(20))
    assert [each.chip for each in found] == list(radio.site.chips)
    for each in found:
        assert (each.link.polls, each.link.answered, each.link.lost) == (PROBES + 1, PROBES + 1, 0)
        assert (each.whole, each.cut) == (PROBES, 0)
    assert said(radio, 20) == []


def test_asking_needs_no_keys_and_disturbs_nothing(opened) -> None:
    radio = opened()
    before = [replace(node.memory) for node in radio.nodes]
    radio.site = replace(radio.site, master=bytes(range(16)), chips=(0, 0))
    assert said(radio) == []
    assert [node.memory for node in radio.nodes] == before
    assert all(node.tally.bad_tags == 0 for node in radio.nodes)


def test_half_of_all_packets_may_be_lost(opened) -> None:
    radio = opened("loss=0.5,seed=3")
    found = scan(radio, drive_table())
    assert [each.chip for each in found] == list(radio.site.chips)
    assert all(each.link.lost > 0 and each.link.retries > 0 for each in found)


@pytest.mark.parametrize("seed", range(5))
def test_two_devices_on_one_address_are_found(opened, seed: int) -> None:
    radio = opened(f"twin=2,seed={seed}")
    (text,) = said(radio)
    assert text.startswith("node 2: 2 devices answer on C1C1C1C102: chips ")
    assert f"{radio.site.chips[1]:08x}" in text
    assert f"{radio.site.chips[1] ^ 2:08x}" in text


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ("version=2", "node 2: it speaks version 3 of the protocol, this release 2: flash it"),
        ("config=2", "node 2: it holds other limits than this display"),
        ("chip=2", "instead of {chip:08x}, which the site knows"),
        ("clone=2", "node 2: C1C1C1C102 acknowledges, but no whole answer came; they come cut short"),
    ],
)
def test_a_misfit_is_named(opened, settings: str, says: str) -> None:
    radio = opened(settings)
    (text,) = said(radio)
    assert says.format(chip=radio.site.chips[1]) in text


def test_a_node_in_the_wrong_place_is_named(opened) -> None:
    radio = opened()
    drive = drive_table()
    swapped = replace(drive, addresses=drive.addresses[::-1])
    found = scan(radio, swapped)
    assert "it takes itself for node 2" in problems(found[0], 0, swapped)[0]


def test_nobody_there_is_said(opened) -> None:
    radio = opened("loss=0.999")
    assert said(radio) == ["node 1: no answer from C1C1C1C101", "node 2: no answer from C1C1C1C102"]


def test_forgeries_are_counted(opened) -> None:
    radio = opened("stranger=0.5,seed=2")
    scan(radio, drive_table())
    found = scan(radio, drive_table())
    assert [page.bad_tags > 0 for each in found for page in each.pages.values()] == [True, True]
    assert said(radio) == []


@pytest.mark.parametrize("settings", ["", "loss=0.3,seed=1", "dup=0.1,seed=2"])
def test_good_chips_pass_the_radio_test(opened, settings: str) -> None:
    for each in radio_test(opened(settings), drive_table()):
        assert (each.filters, each.cut) == (True, 0)
        assert each.whole > 10


def test_bad_copies_fail_the_radio_test(opened) -> None:
    good, bad = radio_test(opened("clone=2"), drive_table())
    assert (good.filters, good.cut, good.whole) == (True, 0, PROBES)
    assert (bad.filters, bad.whole) == (None, 0)
    assert bad.cut == PROBES


def test_a_chip_that_lets_repeats_through_is_told(opened) -> None:
    radio = opened()
    station = radio._stations[0]
    exchange = station.exchange

    def forgetful(air, payload, now_us):
        station.antenna.last = (-1, -1)
        return exchange(air, payload, now_us)

    station.exchange = forgetful
    assert [each.filters for each in radio_test(radio, drive_table())] == [False, True]
    assert [each.state for each in read_status(radio, drive_table())] == ["ready"] * 2


class OldFirmware:
    """A node of the release before: of all frames it knows only those of its own version."""

    def __init__(self) -> None:
        self.ack = b""

    def advance(self, now_ms: int) -> None:
        """See Receiver."""

    def receive(self, now_ms: int, payload: bytes) -> None:
        """See Receiver; a PAGE of version 1 begins as the one of today."""
        if payload[0] == 0x15:
            self.ack = bytes([0x15, 1]) + bytes(30)


def test_a_node_with_the_firmware_of_the_release_before_is_told_to_be_flashed(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    radio._stations[0].antenna.node = OldFirmware()
    with pytest.raises(Halted, match="node 1 speaks another version of the protocol: it has 1, this release needs 2"):
        send_plan(make_plan(), radio, Journal(new_run(tmp_path, "test")))
    radio.close()


def test_a_node_that_has_run_out_of_offers_is_to_be_switched_off_and_on(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    radio.nodes[1].memory.offers = OFFERS_END - 1
    with pytest.raises(Halted, match="node 2 takes no more hosts") as caught:
        send_plan(make_plan(), radio, Journal(new_run(tmp_path, "test")))
    assert "mock:repower" in caught.value.hint
    radio.close()
    mended = open_radio("repower", drive_table(), tmp_path)
    assert send_plan(make_plan(), mended, Journal(new_run(tmp_path, "test"))).outcome == "done"
    mended.close()
