"""The nrf24 back end on modelled hardware that misbehaves; test_nrf24.py runs this with the shim preloaded."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from curveline.drive_settings import DriveSettings
from curveline.errors import LinkError
from curveline.radio.host.link import read_status
from curveline.radio.interface import BATCH, Answer, Radio, RadioGone, open_radio
from curveline.radio.mock.air import Weather
from curveline.radio.protocol.air_time import RETRIES
from curveline.radio.protocol.codes import FLAG_QUERY
from curveline.radio.protocol.frames import HelloFrame, ReportFrame, decode_report, encode_hello
from curveline.radio.site.key_file import read_site

from .bench import drive_table
from .chip_setup import read
from .chipbank import (
    CONFIG,
    DYNPD,
    EN_AA,
    EN_RXADDR,
    FEATURE,
    FIFO_STATUS,
    RF_CH,
    RF_DR_LOW,
    RF_SETUP,
    RX_ADDR_P0,
    SETUP_AW,
    SETUP_RETR,
    TX_ADDR,
    WRITABLE,
)
from .dongle_host import write_keys
from .spi_rig import SPEC, SpiRig

NOBODY = "0102030405"
BLANK = bytes(32)
NONCE = 0x1234567800


@dataclass
class Lab:
    """The machine and how to open its radio."""

    rig: SpiRig
    drive: DriveSettings
    folder: Path

    def open(self, spec: str = SPEC) -> Radio:
        return open_radio(spec, self.drive, self.folder)

    def ask(self, radio: Radio, number: int = 1, attempt: int = 0) -> Answer:
        return radio.exchange([self.query(number, attempt)])[0]

    def query(self, number: int = 1, attempt: int = 0) -> tuple[str, bytes]:
        hello = HelloFrame(number, NONCE | attempt, 0, 0, 0, FLAG_QUERY)
        return self.drive.addresses[number - 1], encode_hello(hello, self.rig.site.node_key(number))

    def is_status(self, answer: Answer, number: int = 1) -> bool:
        status = decode_report(answer.payload or b"", self.rig.site.node_key(number), NONCE)
        return isinstance(status, ReportFrame) and status.node == number


def build(folder: Path, drive: DriveSettings) -> Lab:
    keys = folder / "site.json"
    site = read_site(keys).site(drive) if keys.exists() else write_keys(keys, drive)
    return Lab(SpiRig(folder, drive, site, Weather()), drive, folder)


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "site.json"))
    return build(tmp_path, drive_table())


@pytest.fixture
def radio(lab: Lab) -> Iterator[Radio]:
    with closing(lab.open()) as radio:
        yield radio


@contextmanager
def at_most(radio: Radio, limit_ms: int) -> Iterator[None]:
    """By the model's clock, so that the machine's speed does not matter."""
    begin_us = radio.now_us()
    yield
    took_us = radio.now_us() - begin_us
    assert took_us <= limit_ms * 1000, took_us


# What the chip is told


@pytest.mark.parametrize(
    ("rate", "setup", "retries"), [("250kbps", 0x26, 0x53), ("1Mbps", 0x06, 0x13), ("2Mbps", 0x0E, 0x13)]
)
def test_the_chip_has_the_settings_of_the_display(lab: Lab, rate: str, setup: int, retries: int) -> None:
    lab = build(lab.folder, replace(lab.drive, data_rate=rate, channel=101))
    with closing(lab.open()) as radio:
        chip = lab.rig.chip
        assert {register: read(chip, register) for register in (RF_CH, RF_SETUP, SETUP_RETR, SETUP_AW)} == {
            RF_CH: 101,
            RF_SETUP: setup,
            SETUP_RETR: retries,
            SETUP_AW: 3,
        }
        assert read(chip, CONFIG) == 0x0E
        assert read(chip, EN_AA) & 1
        assert read(chip, EN_RXADDR) & 1
        assert read(chip, DYNPD) & 1
        assert read(chip, FEATURE) == 0x06
        assert [each.state for each in read_status(radio, lab.drive)] == ["ready", "ready"]


def test_an_address_goes_out_in_the_order_of_its_digits(lab: Lab, radio: Radio) -> None:
    radio.exchange([(NOBODY, BLANK)])
    for register in (TX_ADDR, RX_ADDR_P0):
        assert lab.rig.chip.command(bytes([register]) + bytes(5))[1:] == bytes.fromhex(NOBODY)


def test_a_poll_costs_what_the_budget_says(lab: Lab, radio: Radio) -> None:
    lab.ask(radio)
    begin_us, transfers = radio.now_us(), lab.rig.transfers
    for attempt in range(100):
        assert lab.ask(radio, 1 + attempt % 2, attempt).payload is not None
    took_us, per_poll = radio.now_us() - begin_us, (lab.rig.transfers - transfers) / 100
    print(f"{took_us / 100:.0f} us and {per_poll:.0f} transfers a poll, alone")
    assert took_us / 100 <= 1450
    assert per_poll <= 80


def test_a_batch_costs_less_than_its_polls(lab: Lab, radio: Radio) -> None:
    lab.ask(radio)
    with at_most(radio, 16 * 15 // 10):
        radio.exchange([lab.query(1 + index % 2, index) for index in range(BATCH)])


def test_a_dead_node_costs_its_retries(radio: Radio) -> None:
    with at_most(radio, 5):
        assert radio.exchange([(NOBODY, BLANK)]) == [Answer(None, RETRIES)]


def test_closing_switches_the_chip_off(lab: Lab) -> None:
    lab.open().close()
    assert read(lab.rig.chip, CONFIG) & 2 == 0


# Queues


def test_a_packet_that_failed_is_not_sent_later(lab: Lab, radio: Radio) -> None:
    radio.exchange([(NOBODY, BLANK)])
    assert read(lab.rig.chip, FIFO_STATUS) & 0x10
    assert lab.ask(radio).payload is not None


def test_what_a_broken_exchange_left_is_nobodys_answer(lab: Lab, radio: Radio) -> None:
    lab.rig.chip.bank.rx.extend([(0, b"old" + bytes(29))] * 3)
    lab.rig.chip.bank.push(b"unsent" + bytes(26))
    lab.rig.chip.bank.flags = 0x70
    assert radio.exchange([(NOBODY, BLANK)]) == [Answer(None, RETRIES)]
    lab.ask(radio)
    lab.rig.chip.bank.push(b"unsent" + bytes(26))
    assert lab.ask(radio, attempt=1).payload is not None
    assert lab.rig.chip.bank.tx == [], "the old packet went out, and the new one did not"


def test_of_several_answers_the_newest_frame_counts(lab: Lab, radio: Radio) -> None:
    def answer_thrice() -> None:
        lab.rig.chip.bank.rx.extend([(0, b"1" * 32), (0, b"2" * 32), (0, b"3" * 31)])

    lab.rig.ether.at(lab.rig.ether.now_us + 1200, answer_thrice)
    assert radio.exchange([(NOBODY, BLANK)])[0].payload == b"2" * 32


def test_answers_that_are_no_frames_are_none(lab: Lab, radio: Radio) -> None:
    node = lab.rig.nodes[0]
    for size in (1, 31):
        node.listener.reload(b"x" * size)
        assert radio.exchange([(lab.drive.addresses[0], BLANK)])[0].payload == b""


@pytest.mark.parametrize("size", [0, 33, 255])
def test_an_impossible_size_empties_the_queue(lab: Lab, radio: Radio, size: int) -> None:
    lab.rig.ether.at(lab.rig.ether.now_us + 1200, lambda: lab.rig.chip.bank.rx.extend([(0, b"x" * size)] * 3))
    assert radio.exchange([(NOBODY, BLANK)])[0].payload is None
    assert lab.rig.chip.bank.rx == []


# A chip that goes, and may come back


@pytest.mark.parametrize("bus", [0x00, 0xFF])
def test_a_chip_that_is_not_there_cannot_be_opened(lab: Lab, bus: int) -> None:
    lab.rig.chip.unplugged = bus
    with pytest.raises(LinkError, match="CE 22, CSN 0: it does not answer") as caught:
        lab.open()
    assert "supply" in caught.value.hint
    lab.rig.chip.unplugged = None
    with closing(lab.open()) as radio:
        assert lab.ask(radio).payload is not None


@pytest.mark.parametrize("bus", [0x00, 0xFF])
def test_a_chip_that_goes_away_is_noticed_and_taken_back(lab: Lab, radio: Radio, bus: int) -> None:
    lab.ask(radio)
    lab.rig.chip.unplugged = bus
    for limit_ms in (60, 200, 200):
        with at_most(radio, limit_ms), pytest.raises(RadioGone) as caught:
            radio.exchange([lab.query()] * BATCH)
        assert caught.value.may_return
    lab.rig.chip.unplugged = None
    lab.rig.chip.reset()
    assert lab.ask(radio).payload is not None
    with at_most(radio, 10):
        assert lab.ask(radio).payload is not None


def test_a_chip_that_stays_away_is_given_up(lab: Lab, radio: Radio) -> None:
    lab.rig.chip.unplugged = 0
    with pytest.raises(RadioGone):
        lab.ask(radio)
    radio.sleep_until(radio.now_us() + 30_000_000)
    with pytest.raises(RadioGone) as caught:
        lab.ask(radio)
    assert not caught.value.may_return


@pytest.mark.parametrize("bus", [0x00, 0xFF])
def test_a_chip_that_goes_during_a_packet_is_noticed(lab: Lab, radio: Radio, bus: int) -> None:
    for wait_us in range(0, 2000, 170):
        lab.rig.ether.at(lab.rig.ether.now_us + wait_us, lambda: setattr(lab.rig.chip, "unplugged", bus))
        with at_most(radio, 400), pytest.raises(RadioGone):
            radio.exchange([lab.query()] * 5)
        lab.rig.chip.unplugged = None
        assert lab.ask(radio).payload is not None


def test_a_dip_between_two_exchanges_costs_no_answer(lab: Lab, radio: Radio) -> None:
    lab.ask(radio)
    lab.rig.chip.reset()
    with at_most(radio, 150):
        assert lab.is_status(lab.ask(radio, attempt=1))


@pytest.mark.parametrize("wait_us", range(0, 3000, 210))
def test_a_dip_during_a_batch_costs_a_few_answers(lab: Lab, radio: Radio, wait_us: int) -> None:
    lab.ask(radio)
    lab.rig.ether.at(lab.rig.ether.now_us + wait_us, lab.rig.chip.reset)
    with at_most(radio, 250):
        answers = radio.exchange([lab.query(1 + index % 2, index) for index in range(BATCH)])
    assert sum(answer.payload is not None for answer in answers) >= BATCH - 2
    assert lab.ask(radio).payload is not None
    assert read(lab.rig.chip, RF_CH) == lab.drive.channel


def test_a_dip_is_seen_though_the_display_has_the_factory_channel(lab: Lab) -> None:
    lab = build(lab.folder, replace(lab.drive, channel=2, data_rate="2Mbps"))
    with closing(lab.open()) as radio:
        lab.rig.chip.reset()
        lab.ask(radio)
        assert lab.ask(radio).payload is not None


def test_a_channel_that_changed_by_itself_is_set_again(lab: Lab, radio: Radio) -> None:
    lab.rig.chip.bank.write(RF_CH, b"\x05")
    assert lab.ask(radio).payload is None
    assert lab.ask(radio).payload is not None


def test_settings_are_read_back_every_second_without_a_failure(lab: Lab, radio: Radio) -> None:
    lab.ask(radio)
    lab.rig.chip.bank.write(RF_SETUP, b"\x0e")
    radio.sleep_until(radio.now_us() + 1_000_000)
    radio.exchange([])
    assert read(lab.rig.chip, RF_SETUP) == 0x06


def test_a_chip_without_its_ce_wire_says_so(lab: Lab, radio: Radio) -> None:
    lab.rig.ce_connected = False
    with at_most(radio, 100), pytest.raises(RadioGone, match="CE pin"):
        radio.exchange([lab.query()] * BATCH)
    lab.rig.ce_connected = True
    assert lab.ask(radio).payload is not None


def test_nothing_is_printed_whatever_happens(lab: Lab, radio: Radio, capfd: pytest.CaptureFixture[str]) -> None:
    for wait_us in (0, 300, 900):
        lab.rig.ether.at(lab.rig.ether.now_us + wait_us, lab.rig.chip.reset)
        radio.exchange([lab.query()] * 3)
    lab.rig.ether.at(lab.rig.ether.now_us + 500, lambda: setattr(lab.rig.chip, "unplugged", 0))
    with pytest.raises(RadioGone):
        radio.exchange([lab.query()] * 3)
    assert capfd.readouterr() == ("", "")


# Listening for others


def test_a_scan_sends_nothing_and_would_answer_nobody(lab: Lab, radio: Radio) -> None:
    """A chip acknowledges by itself what comes for an address that it listens to, unless that is switched off."""
    settings = []
    lab.ask(radio)

    def noise(channel: int, now_us: int) -> bool:
        settings.append((channel, lab.rig.chip.bank[EN_AA]))
        return False

    lab.rig.ether.noise = noise
    sent = lab.rig.ether.sent
    assert radio.carriers() == []
    assert set(settings) == {(channel, 0) for channel in range(126)}
    assert lab.rig.ether.sent == sent
    assert lab.ask(radio).payload is not None


def test_a_dip_while_it_listens_is_no_quiet_band(lab: Lab, radio: Radio) -> None:
    lab.rig.ether.at(lab.rig.ether.now_us + 20_000, lab.rig.chip.reset)
    with pytest.raises(RadioGone, match="lost its settings while it listened"):
        radio.carriers()
    assert lab.ask(radio).payload is not None


@pytest.mark.parametrize("bus", [0x00, 0xFF])
def test_a_chip_that_goes_while_it_listens_is_noticed(lab: Lab, radio: Radio, bus: int) -> None:
    lab.rig.ether.at(lab.rig.ether.now_us + 20_000, lambda: setattr(lab.rig.chip, "unplugged", bus))
    with pytest.raises(RadioGone):
        radio.carriers()


def test_a_power_is_kept_through_a_dip(lab: Lab, radio: Radio) -> None:
    radio.set_power("low")
    assert read(lab.rig.chip, RF_SETUP) & 0x06 == 0x02
    lab.rig.chip.reset()
    lab.ask(radio)
    lab.ask(radio, attempt=1)
    assert read(lab.rig.chip, RF_SETUP) & 0x06 == 0x02
    radio.set_power("max")
    assert read(lab.rig.chip, RF_SETUP) & 0x06 == 0x06


# Opening


def test_a_chip_without_the_plus_is_refused_at_250_kbps(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(WRITABLE, RF_SETUP, WRITABLE[RF_SETUP] & ~RF_DR_LOW)
    lab = build(lab.folder, replace(lab.drive, data_rate="250kbps"))
    with pytest.raises(LinkError, match="does not take its settings") as caught:
        lab.open()
    assert "nRF24L01+" in caught.value.hint


def test_a_machine_without_spi(lab: Lab) -> None:
    lab.rig.devices(spi=False)
    with pytest.raises(LinkError, match=r"there is no SPI device /dev/spidev0\.0") as caught:
        lab.open()
    assert "raspi-config" in caught.value.hint


def test_a_machine_without_gpio(lab: Lab) -> None:
    lab.rig.devices(gpio=False)
    with pytest.raises(LinkError, match="GPIO line 23 cannot be used"):
        lab.open("nrf24:23,0")


def test_a_line_that_the_board_does_not_have(lab: Lab) -> None:
    with pytest.raises(LinkError, match="GPIO line 99 cannot be used"):
        lab.open("nrf24:99,0")
    lab.open().close()  # and the lock was given back


@pytest.mark.parametrize(("option", "hz"), [("", 10_000_000), (",spi_MHz=2", 2_000_000), (" , spi_MHz = 0.5", 500_000)])
def test_the_bus_runs_as_fast_as_it_is_told(lab: Lab, option: str, hz: int) -> None:
    radio = lab.open(SPEC + option)
    assert lab.rig.spi_hz == hz
    (answer,) = radio.exchange([lab.query()])
    assert answer.payload is not None
    assert lab.rig.spi_hz == hz


@pytest.mark.parametrize("number", [0, 4])
def test_the_header_is_found_by_its_name(lab: Lab, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    lab.rig.header_is(number)
    if number == 0:
        lab.open().close()
        return
    with pytest.raises(LinkError, match=r"header of this board is /dev/gpiochip4 \(pinctrl-rp1\)") as caught:
        lab.open()
    assert "built for /dev/gpiochip0" in caught.value.message
    assert "CMAKE_ARGS=-DRF24_LINUX_GPIO_CHIP=/dev/gpiochip4 pip install" in caught.value.hint
    monkeypatch.setattr("curveline.radio.ports.nrf24.library_chip", lambda: "/dev/gpiochip4")
    lab.open().close()  # as it was told to be built


def test_another_process_with_the_chip_is_respected(lab: Lab) -> None:
    with (lab.folder / "spidev").open() as device:
        fcntl.flock(device, fcntl.LOCK_EX)
        with pytest.raises(LinkError, match="in use by another program"):
            lab.open()
    lab.open().close()


def test_a_bus_that_fails_is_a_radio_that_is_gone(lab: Lab, radio: Radio) -> None:
    lab.rig.fail_transfers(1)
    with pytest.raises(RadioGone, match="spi message"):
        lab.ask(radio)
    assert lab.ask(radio).payload is not None


def test_a_bus_that_fails_while_closing_does_not_matter(lab: Lab) -> None:
    radio = lab.open()
    lab.rig.fail_transfers(1)
    radio.close()
    lab.open().close()
