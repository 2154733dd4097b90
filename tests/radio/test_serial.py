"""The serial radio: its talk with a dongle, and what it does when that talks rubbish, falls silent, or is unplugged."""

from __future__ import annotations

import errno
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from random import Random
from types import SimpleNamespace

import pytest
import serial
from serial.tools import list_ports

from curveline.drive_settings import DriveSettings
from curveline.errors import InvalidInput, LinkError
from curveline.radio.host.link import read_status
from curveline.radio.interface import BATCH, Answer, RadioGone, open_radio
from curveline.radio.ports import serial as serial_radio
from curveline.radio.ports.dongle import Dongle, LineLost, LineSilent, PacketKind, SendOutcome, encode_packet, frame_s
from curveline.radio.ports.serial import SerialLine, SerialRadio
from curveline.radio.protocol.air_time import RATES_KBPS
from curveline.radio.site.key_file import default_path
from firmware.dongle_core import UNIQUE, Core

from .bench import drive_table
from .dongle_host import DongleHost, Room, dongle_host, write_keys

DRIVE = drive_table()
A, B = DRIVE.addresses
FRAME = bytes(32)
DETECTED_S = 0.2
SCHEDULING_S = 1.0
"""What a busy machine may add to any time that is measured by the clock on the wall. The requirement itself is tested
on a clock of our own, in which only our time-outs pass."""


@pytest.fixture
def host(tmp_path: Path) -> Iterator[DongleHost]:
    with dongle_host(tmp_path / "dongle", Room(DRIVE)) as host:
        yield host


@contextmanager
def radio_of(host: DongleHost, drive: DriveSettings = DRIVE) -> Iterator[SerialRadio]:
    with closing(SerialRadio(str(host.path), drive, host.room.site)) as radio:
        yield radio


def wait_for(radio: SerialRadio) -> None:
    """Ask until the dongle is back; RadioGone if it is given up before."""
    while True:
        try:
            radio.exchange(())
        except RadioGone as gone:
            if not gone.may_return:
                raise
        else:
            return


# A line of its own clock


class WireLine:
    """A line straight to a core, on which time passes only while somebody waits."""

    def __init__(self, core: Core) -> None:
        self.core = core
        self.time_s = 0.0
        self.dead = ""
        self.silent = False
        self.closed = False

    def write(self, data: bytes) -> None:
        if self.dead:
            raise LineLost(self.dead)
        if not self.silent:
            self.core.feed(data)

    def read(self) -> bytes:
        if self.dead:
            raise LineLost(self.dead)
        while self.core.step() and not self.core.said:
            pass
        said = self.core.take()
        if not said or self.silent:
            self.time_s += serial_radio.READ_S
            return b""
        return said

    def now_s(self) -> float:
        return self.time_s

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def line() -> WireLine:
    return WireLine(Core())


@pytest.fixture
def dongle(line: WireLine) -> Dongle:
    dongle = Dongle(line, "here")
    dongle.introduce()
    dongle.configure(76, "1Mbps")
    return dongle


# The talk


def test_the_handshake_tells_who_is_there_and_sets_the_radio_up(line: WireLine) -> None:
    dongle = Dongle(line, "here")
    ident = dongle.introduce()
    assert (ident.version, ident.firmware, ident.capabilities, ident.bad_packets) == (1, 0x10100, 3, 0)
    assert ident.unique == UNIQUE
    for number, rate in enumerate(RATES_KBPS):
        dongle.configure(90 + number, rate)
        assert line.core.configured[-1] == (90 + number, number, 5, 3, 500 if number else 1500)


def test_addresses_and_payloads_go_out_as_they_are(dongle: Dongle, line: WireLine) -> None:
    line.core.transmit = lambda address, payload: (SendOutcome.ACKED, payload[::-1], payload[0])
    frames = [(f"{number:010X}", bytes([number]) * 31 + b"z") for number in range(BATCH)]
    answers = dongle.exchange(frames)
    assert answers == [Answer(payload[::-1], payload[0]) for _, payload in frames]
    assert line.core.sent == frames


@pytest.mark.parametrize(
    ("outcome", "payload", "answer"),
    [
        (SendOutcome.NOTHING, b"", Answer(None, 3)),
        (SendOutcome.ACKED, b"", Answer(b"", 3)),
        (SendOutcome.ACKED, b"short", Answer(b"short", 3)),
        (SendOutcome.ACKED, FRAME, Answer(FRAME, 3)),
    ],
)
def test_outcomes_mean_what_a_radio_says(
    dongle: Dongle, line: WireLine, outcome: SendOutcome, payload: bytes, answer: Answer
) -> None:
    line.core.transmit = lambda *frame: (outcome, payload, 3)
    assert dongle.exchange([(A, FRAME)]) == [answer]


def test_an_answer_to_an_older_request_counts_for_nothing(dongle: Dongle, line: WireLine) -> None:
    line.core.transmit = lambda *frame: (SendOutcome.ACKED, b"old", 0)
    line.core.feed(encode_packet(bytes([PacketKind.SCHEDULE, 99, 1]) + bytes(37)))
    line.core.step()
    line.core.transmit = lambda *frame: (SendOutcome.ACKED, b"new", 0)
    assert dongle.exchange([(A, FRAME)]) == [Answer(b"new")]


def test_answers_may_come_in_any_pieces_between_any_rubbish(line: WireLine) -> None:
    random = Random(3)
    whole = line.read
    waiting = bytearray()

    def read() -> bytes:
        if not waiting:
            said = whole()
            waiting.extend(random.randbytes(random.randrange(20)) + b"\0" + said if said else b"")
        piece = bytes(waiting[:3])
        del waiting[:3]
        return piece

    line.read = read  # type: ignore[method-assign]
    dongle = Dongle(line, "here")
    assert dongle.introduce().unique == UNIQUE
    dongle.configure(76, "1Mbps")
    for number in range(200):
        line.core.transmit = lambda *frame, number=number: (SendOutcome.ACKED, bytes([number]) * 32, 0)
        assert dongle.exchange([(A, FRAME)] * 2) == [Answer(bytes([number]) * 32)] * 2


def test_a_result_that_was_lost_on_the_way_is_not_mistaken_for_another(dongle: Dongle, line: WireLine) -> None:
    whole = line.read
    line.core.transmit = lambda address, payload: (SendOutcome.ACKED, payload, 0)

    def read() -> bytes:
        said = whole()
        return b"" if address_was(A) else said

    def address_was(address: str) -> bool:
        return line.core.sent[-1][0] == address

    line.read = read  # type: ignore[method-assign]
    with pytest.raises(LineLost, match="lost on the way"):
        dongle.exchange([(A, FRAME), (B, FRAME)])


@pytest.mark.parametrize("version", [0, 2, 255])
def test_another_version_is_refused_with_both_and_the_cure(line: WireLine, version: int) -> None:
    def read() -> bytes:
        return encode_packet(bytes([PacketKind.IDENT, 1, version, 0, 0, 0, 0, 0, 0]))

    line.read = read  # type: ignore[method-assign]
    with pytest.raises(LinkError, match=f"speaks version {version}, this host 1") as caught:
        Dongle(line, "here").introduce()
    assert "flash" in caught.value.hint
    assert not isinstance(caught.value, RadioGone)


def test_an_introduction_of_our_version_that_says_too_little_is_none(line: WireLine) -> None:
    line.read = lambda: encode_packet(bytes([PacketKind.IDENT, 1, 1, 0]))  # type: ignore[method-assign]
    with pytest.raises(LineSilent):
        Dongle(line, "here").introduce(tries=1)


def test_a_device_that_never_stops_talking_is_given_up(line: WireLine) -> None:
    random = Random(8)

    def read() -> bytes:
        line.time_s += 0.001
        return random.randbytes(64)

    line.read = read  # type: ignore[method-assign]
    with pytest.raises(LineSilent):
        Dongle(line, "here").introduce()
    assert line.time_s < 2


def test_a_radio_chip_that_is_not_there_is_told_with_what_to_check(line: WireLine) -> None:
    dongle = Dongle(line, "here")
    line.core.has_chip = False
    for attempt in (lambda: dongle.configure(76, "1Mbps"), lambda: dongle.exchange([(A, FRAME)])):
        with pytest.raises(LineLost, match="its radio chip does not answer") as caught:
            attempt()
        assert "wiring" in caught.value.hint
        line.core.has_chip = True
        dongle.configure(76, "1Mbps")
        line.core.has_chip = False


def test_a_dongle_that_restarted_is_set_up_again(dongle: Dongle, line: WireLine) -> None:
    line.core.start()
    with pytest.raises(LineLost, match="restarted"):
        dongle.exchange([(A, FRAME)])


def test_a_refusal_that_should_not_be_is_a_plain_error(dongle: Dongle) -> None:
    with pytest.raises(LinkError, match="refused a request of kind 02"):
        dongle.configure(200, "1Mbps")


def test_the_scan_names_channels(dongle: Dongle, line: WireLine) -> None:
    line.core.carriers = {0, 3, 76, 125}
    assert dongle.scan() == [0, 3, 76, 125]


# How long anything may take, on a clock in which only our own time-outs pass


@pytest.mark.parametrize("rate", RATES_KBPS)
def test_a_dongle_that_falls_silent_is_noticed_in_time(line: WireLine, rate: str) -> None:
    dongle = Dongle(line, "here")
    dongle.configure(76, rate)
    line.silent = True
    begin = line.time_s
    with pytest.raises(LineSilent):
        dongle.exchange([(A, FRAME)] * BATCH)
    assert line.time_s - begin + serial_radio.WRITE_S <= DETECTED_S


@pytest.mark.parametrize("rate", RATES_KBPS)
def test_one_that_falls_silent_after_some_answers_too(line: WireLine, rate: str) -> None:
    dongle = Dongle(line, "here")
    dongle.configure(76, rate)
    heard_s = 0.0

    def transmit(address: str, payload: bytes) -> tuple[SendOutcome, bytes, int]:
        nonlocal heard_s
        line.time_s += frame_s(rate)  # nobody answers, at every address
        heard_s, line.silent = line.time_s, len(line.core.sent) > 9
        return SendOutcome.NOTHING, b"", 3

    line.core.transmit = transmit
    with pytest.raises(LineSilent):
        dongle.exchange([(A, FRAME)] * BATCH)
    assert line.time_s - heard_s + frame_s(rate) <= DETECTED_S


@pytest.mark.parametrize("rate", RATES_KBPS)
def test_a_row_of_silent_nodes_is_no_silence_of_the_dongle(line: WireLine, rate: str) -> None:
    dongle = Dongle(line, "here")
    dongle.configure(76, rate)

    def transmit(address: str, payload: bytes) -> tuple[SendOutcome, bytes, int]:
        line.time_s += frame_s(rate)
        return SendOutcome.NOTHING, b"", 3

    line.core.transmit = transmit
    assert dongle.exchange([(A, FRAME)] * BATCH) == [Answer(None, 3)] * BATCH


@pytest.mark.parametrize("rate", RATES_KBPS)
def test_a_dongle_that_takes_its_time_is_waited_for(line: WireLine, rate: str) -> None:
    dongle = Dongle(line, "here")
    dongle.configure(76, rate)
    whole, late = line.read, 0

    def read() -> bytes:
        nonlocal late
        late = (late + 1) % 5
        if late:
            line.time_s += serial_radio.READ_S
            return b""
        return whole()

    line.read = read  # type: ignore[method-assign]
    assert dongle.exchange([(A, FRAME)] * 3) == [Answer(b"")] * 3


def test_a_host_that_was_kept_from_running_blames_nobody(dongle: Dongle, line: WireLine) -> None:
    whole = line.read

    def late() -> bytes:
        said = whole()
        line.time_s += 5.0
        return said

    line.read = late  # type: ignore[method-assign]
    line.core.transmit = lambda *frame: (SendOutcome.ACKED, b"", 0)
    assert dongle.exchange([(A, FRAME)]) == [Answer(b"")]


def test_a_device_that_never_answers_is_given_up_within_a_second(line: WireLine) -> None:
    line.silent = True
    with pytest.raises(LineSilent):
        Dongle(line, "here").introduce()
    assert line.time_s <= 1.1


# Opening


@pytest.fixture
def keys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "site.json"
    monkeypatch.setenv("CURVELINE_KEYS", str(path))
    assert default_path() == path
    return path


def open_serial(settings: str, tmp_path: Path) -> SerialRadio:
    radio = open_radio(f"serial:{settings}", DRIVE, tmp_path)
    assert isinstance(radio, SerialRadio)
    return radio


def test_without_keys_nothing_is_opened(keys: Path, host: DongleHost, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as caught:
        open_serial(str(host.path), tmp_path)
    assert "curveline keys new" in caught.value.hint
    assert host.core.configured == []


def test_with_keys_it_is(keys: Path, host: DongleHost, tmp_path: Path) -> None:
    site = write_keys(keys, DRIVE)
    with closing(open_serial(str(host.path), tmp_path)) as radio:
        assert radio.site == site
        assert host.core.configured == [(76, 1, 5, 3, 500)]


def port(device: str, vid: int | None = 0x16C0, number: str | None = "123") -> SimpleNamespace:
    return SimpleNamespace(device=device, vid=vid, description="USB Serial", serial_number=number)


@pytest.mark.parametrize(
    ("ports", "said"),
    [
        ([], "plug the dongle in"),
        ([port("/dev/ttyS0", None)], "plug the dongle in"),
        ([port("/dev/ttyACM3", 0x2341)], "serial:/dev/ttyACM3 (USB Serial)"),
        ([port("/dev/ttyACM1"), port("/dev/ttyACM0"), port("/dev/ttyUSB0", 0x0403)], "ttyACM0 (USB Serial), serial:"),
    ],
)
def test_without_a_port_it_tells_which_there_are(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, ports: list[SimpleNamespace], said: str
) -> None:
    monkeypatch.setattr(list_ports, "comports", lambda: ports)
    with pytest.raises(InvalidInput, match="needs a port") as caught:
        open_radio("serial:", DRIVE, tmp_path)
    assert said in caught.value.hint
    assert "ttyUSB0" not in caught.value.hint


def test_a_rate_that_no_radio_has_is_refused(tmp_path: Path) -> None:
    table = DriveSettings("test", "digest", DRIVE.axes, 76, "9Mbps", DRIVE.addresses)
    with pytest.raises(InvalidInput, match="9Mbps"):
        open_radio("serial:/dev/ttyACM0", table, tmp_path)


def test_a_port_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match="there is no port") as caught:
        SerialRadio(str(tmp_path / "nothing"), DRIVE, Room(DRIVE).site)
    assert caught.value.hint


def test_something_that_is_no_serial_port(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"x")
    with pytest.raises(LinkError, match="cannot be used as a serial port"):
        SerialRadio(str(tmp_path / "file"), DRIVE, Room(DRIVE).site)


@pytest.mark.parametrize(
    ("error", "message", "hint"),
    [
        (PermissionError(errno.EACCES, "could not open"), "may not open", "udev"),
        (OSError(errno.EAGAIN, "Could not exclusively lock port"), "in use by another program", "only one"),
        (OSError(errno.EIO, "what"), "cannot be used", ""),
        (RuntimeError("no terminal"), "cannot be used", ""),
    ],
)
def test_why_a_port_does_not_open_is_told(
    monkeypatch: pytest.MonkeyPatch, error: Exception, message: str, hint: str
) -> None:
    def refuse(*args: object, **kwargs: object) -> None:
        raise error

    monkeypatch.setattr("serial.Serial", refuse)
    with pytest.raises(LinkError, match=message) as caught:
        SerialRadio("/dev/ttyACM0", DRIVE, Room(DRIVE).site)
    assert hint in caught.value.hint


def test_a_dongle_can_be_opened_once(host: DongleHost) -> None:
    with radio_of(host) as radio:
        with pytest.raises(LinkError, match="in use by another program"):
            SerialRadio(str(host.path), DRIVE, host.room.site)
        assert radio.exchange([(A, FRAME)]) == [Answer(b"")]
    with radio_of(host) as radio:
        assert radio.exchange([(A, FRAME)])[0].payload is not None


def test_a_mute_device_is_told_in_bounded_time(host: DongleHost) -> None:
    host.mute = True
    begin = time.monotonic()
    with pytest.raises(LinkError, match=r"no dongle can be used at .*: it does not answer as a dongle would") as caught:
        SerialRadio(str(host.path), DRIVE, host.room.site)
    assert time.monotonic() - begin < 1.1 + SCHEDULING_S
    assert "firmware" in caught.value.hint


def test_what_stood_in_the_line_before_is_no_matter(host: DongleHost) -> None:
    host.before = b"ATZ\r\nOK\xff\x00\x01\x02 rubbish \x00"
    host.core.feed(b"AT\r\nrubbish of a modem manager")
    with radio_of(host) as radio:
        assert radio.exchange([(A, FRAME), (B, FRAME)]) == [Answer(b"")] * 2


@pytest.mark.parametrize("piece", [1, 3, 64])
def test_bytes_come_and_go_in_pieces(host: DongleHost, piece: int) -> None:
    host.piece = piece
    with radio_of(host) as radio:
        for number in range(10):
            frames = [((A, B)[number & 1], bytes([number]) * 32)] * BATCH
            assert len(radio.exchange(frames)) == BATCH
    assert len(host.core.sent) == 10 * BATCH


# A dongle that goes away, and comes back


def test_pulling_the_plug_is_told_at_once_and_it_is_taken_back(host: DongleHost) -> None:
    with radio_of(host) as radio:
        assert radio.gone_since_us is None
        host.unplug()
        begin = time.monotonic()
        with pytest.raises(RadioGone, match="it was unplugged") as caught:
            radio.exchange([(A, FRAME)])
        assert time.monotonic() - begin < DETECTED_S + SCHEDULING_S
        assert caught.value.may_return
        assert "--resume" in caught.value.hint
        assert radio.gone_since_us is not None
        for frames in ([], [(A, FRAME)]):
            with pytest.raises(RadioGone, match="there is no port"):
                radio.exchange(frames)
        host.plug()
        wait_for(radio)
        assert radio.gone_since_us is None
        assert radio.exchange([(A, FRAME)]) == [Answer(b"")]
    assert len(host.core.configured) == 2
    assert len(host.core.sent) == 1


def test_one_that_only_hangs_is_taken_back_too(host: DongleHost) -> None:
    with radio_of(host) as radio:
        host.mute = True
        with pytest.raises(RadioGone, match="does not answer any more"):
            radio.exchange([(A, FRAME)])
        with pytest.raises(RadioGone, match="does not answer as a dongle would"):
            radio.exchange(())
        host.mute = False
        wait_for(radio)
        assert radio.exchange([(A, FRAME)]) == [Answer(b"")]


def test_one_that_restarted_by_itself_is_set_up_again(host: DongleHost) -> None:
    with radio_of(host) as radio:
        host.core.start()
        with pytest.raises(RadioGone, match="it has restarted"):
            radio.exchange([(A, FRAME)])
        assert radio.exchange([(A, FRAME)]) == [Answer(b"")]


def test_a_radio_chip_that_fails_for_a_while_is_set_up_again(host: DongleHost) -> None:
    with radio_of(host) as radio:
        host.core.has_chip = False
        for _ in range(2):
            with pytest.raises(RadioGone, match="its radio chip does not answer") as caught:
                radio.exchange([(A, FRAME)])
            assert "wiring" in caught.value.hint
        host.core.has_chip = True
        assert radio.exchange([(A, FRAME)]) == [Answer(b"")]


def test_another_dongle_at_its_place_is_not_taken_for_it(host: DongleHost, monkeypatch: pytest.MonkeyPatch) -> None:
    with radio_of(host) as radio:
        host.unplug()
        with pytest.raises(RadioGone):
            radio.exchange([(A, FRAME)])
        monkeypatch.setattr("firmware.dongle_core.UNIQUE", b"z" * 16)
        host.plug()
        with pytest.raises(RadioGone, match="there is another dongle at"):
            radio.exchange([(A, FRAME)])
        assert host.core.sent == []
        host.unplug()
        monkeypatch.setattr("firmware.dongle_core.UNIQUE", UNIQUE)
        host.plug()
        wait_for(radio)


def test_it_is_found_again_at_another_port(host: DongleHost, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ports = [port(str(host.path)), port("/dev/ttyS9", number="another")]
    monkeypatch.setattr(list_ports, "comports", lambda: list(ports))
    with radio_of(host) as radio:
        host.unplug()
        with pytest.raises(RadioGone):
            radio.exchange([(A, FRAME)])
        ports[0] = port(str(tmp_path / "elsewhere"))
        host.path = tmp_path / "elsewhere"
        host.plug()
        wait_for(radio)
        assert radio.path == str(tmp_path / "elsewhere")
        assert radio.exchange([(A, FRAME)]) == [Answer(b"")]


def test_after_a_while_it_is_gone_for_good(host: DongleHost, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial_radio, "RETURN_S", 0.15)
    with radio_of(host) as radio:
        host.unplug()
        told = []
        for _ in range(8):
            with pytest.raises(RadioGone) as caught:
                radio.exchange([(A, FRAME)])
            told.append(caught.value.may_return)
        assert told == sorted(told, reverse=True)
        assert told[0]
        assert not told[-1]
        assert "for 0 s" in caught.value.message


def test_the_scan_of_one_that_is_gone_is_an_error(host: DongleHost) -> None:
    host.core.carriers = {5}
    with radio_of(host) as radio:
        assert radio.carriers() == [5]
        host.unplug()
        with pytest.raises(LinkError, match="out of action: it was unplugged"):
            radio.carriers()


def test_a_dongle_of_an_older_release_has_one_power_and_says_how_to_get_more(host: DongleHost) -> None:
    with radio_of(host) as radio:
        radio._capabilities = 1
        radio.set_power("max")
        with pytest.raises(LinkError, match="too old to send with less power") as caught:
            radio.set_power("low")
        assert "flash the dongle with the firmware of this release" in caught.value.hint
        assert "`--level max`" in caught.value.hint
        assert set(host.core.powers) == {3}


def test_a_dongle_that_was_away_is_given_its_power_again(host: DongleHost) -> None:
    with radio_of(host) as radio:
        radio.set_power("low")
        host.unplug()
        with pytest.raises(RadioGone):
            radio.exchange([(A, FRAME)])
        host.plug()
        while radio.gone_since_us is not None:
            with suppress(RadioGone):
                radio.exchange([])
        assert host.core.powers[-1] == 1


def test_asking_for_the_status_of_nodes_ends_with_the_dongle(host: DongleHost) -> None:
    with radio_of(host) as radio:
        assert [each.state for each in read_status(radio, DRIVE)] == ["ready", "ready"]
        host.unplug()
        with pytest.raises(RadioGone):
            read_status(radio, DRIVE)


@pytest.mark.parametrize(
    ("reason", "says"),
    [
        (
            "FileNotFoundError(2, 'Das System kann die angegebene Datei nicht finden.', None, 2)",
            "there is no port COM9",
        ),
        ("PermissionError(13, 'Zugriff verweigert', None, 5)", "the port COM9 is in use by another program"),
        ("OSError(22, 'Parameter', None, 87)", "COM9 cannot be used as a serial port"),
    ],
)
def test_what_windows_says_of_a_port(monkeypatch: pytest.MonkeyPatch, reason: str, says: str) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise serial.SerialException(f"could not open port 'COM9': {reason}")

    monkeypatch.setattr(serial, "Serial", refuse)
    with pytest.raises(LinkError, match=says) as caught:
        SerialLine("COM9")
    assert caught.value.hint
