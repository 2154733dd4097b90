"""The dongle's program: it compiles for its processor, survives fuzzing, and drives a modelled radio chip."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from curveline.radio.ports.dongle import PacketKind, SendOutcome
from radio.chip import Chip
from radio.chip_setup import Host, Listener, write
from radio.chipbank import CONFIG, DYNPD, EN_AA, EN_RXADDR, FEATURE, RF_CH, RF_SETUP, SETUP_AW, SETUP_RETR, TX_ADDR
from radio.ether import Ether

from .build import CORE, FIRMWARE, HERE, CompilerError, compiler, executable, gcc, run_compiler, zig
from .dongle_core import Core, Sender, schedule_bytes

DONGLE = FIRMWARE / "dongle"
CORTEX = ("-target", "thumb-freestanding-eabi", "-mcpu=cortex_m0plus", "-Os")
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Werror", f"-I{CORE}", f"-I{DONGLE}", f"-I{HERE / 'standins'}")
ROUNDS = 40_000
A, B = "C1C1C1C101", "C1C1C1C102"
PAYLOAD = bytes(range(32))


# Compilers


@pytest.mark.parametrize("source", [CORE / "dongle.c", DONGLE / "sender.c"], ids=lambda path: path.name)
@pytest.mark.parametrize("target", ["processor of the board", "this machine"])
def test_the_portable_parts_compile(source: Path, target: str, tmp_path: Path) -> None:
    command = [*zig(), *CORTEX] if target == "processor of the board" else [*compiler(), "-O2"]
    run_compiler([*command, "-std=c11", *STRICT, "-c", str(source), "-o", str(tmp_path / "out.o")])


@pytest.mark.parametrize("source", ["dongle.ino", "expects.cpp"])
@pytest.mark.parametrize("flags", [CORTEX, ("-O2",)], ids=["processor of the board", "this machine"])
def test_the_sketch_compiles_against_the_names_it_expects(flags: tuple[str, ...], source: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "ziglang", "c++", *flags, "-std=gnu++17", "-fno-exceptions", "-fno-rtti", *STRICT]
    run_compiler([*command, "-x", "c++", "-c", str(DONGLE / source), "-o", str(tmp_path / "out.o")])


def test_a_stand_in_that_lies_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "standins"
    shutil.copytree(HERE / "standins", folder)
    header = folder / "Arduino.h"
    header.write_text(header.read_text().replace("uint32_t micros(void)", "uint64_t micros(void)"))
    command = [sys.executable, "-m", "ziglang", "c++", "-std=gnu++17", f"-I{folder}"]
    with pytest.raises(CompilerError, match="micros"):
        run_compiler([*command, "-c", str(DONGLE / "expects.cpp"), "-o", str(tmp_path / "out.o")])


def test_all_that_the_sketch_takes_from_the_vendor_is_checked() -> None:
    """Or a name that the sketch has begun to use would be whatever the stand-ins make of it."""
    sketch, expects = ((DONGLE / name).read_text() for name in ("dongle.ino", "expects.cpp"))
    names = r"(?:SPI|Serial)\.\w+|\b(?:pinMode|digital\w+|analog\w+|delay\w*|micros|millis|SPISettings)\b"
    registers = r"\b(?:SIM_UID\w+|HW_OCOTP_\w+|LOW|HIGH|OUTPUT|INPUT\w*|MSBFIRST|SPI_MODE\d)\b"
    for pattern in (names, registers):
        used = set(re.findall(pattern, sketch))
        assert used
        assert used <= set(re.findall(pattern, expects))


# Building it with the vendor's core


def make_dongle(home: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """`make -C firmware dongle` for somebody whose programs are in `home`/bin."""
    tools = home / "bin"
    tools.mkdir(parents=True, exist_ok=True)
    environment = {"HOME": str(home), "PATH": f"{tools}:/usr/bin:/bin"}
    command = ["make", "-C", str(FIRMWARE), "dongle", f"BUILD={folder}", f"PYTHON={sys.executable}", *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def put(path: Path, text: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


FAKE_COMPILER = """#!/bin/sh
case "$*" in
*-print-file-name=*) echo "/opt/${*##*=}"; exit 0;;
*{refuses}*) echo "{refuses} is not to my liking" >&2; exit 1;;
esac
while [ $# -gt 1 ]; do [ "$1" = -o ] && echo made > "$2"; shift; done
"""


def with_compiler(home: Path, refuses: str = "nothing") -> None:
    for name in ("gcc", "g++"):
        put(home / f"bin/arm-none-eabi-{name}", FAKE_COMPILER.replace("{refuses}", refuses))
    put(home / "bin/arm-none-eabi-objcopy", '#!/bin/sh\nfor last; do :; done; echo hex > "$last"\n')


def test_what_is_missing_for_the_dongle_is_said(tmp_path: Path) -> None:
    home, folder = tmp_path / "home", tmp_path / "build"
    done = make_dongle(home, folder)
    assert done.returncode != 0
    assert "cannot be built here; missing:" in done.stderr
    if shutil.which("arm-none-eabi-g++", path="/usr/bin:/bin") is None:
        assert "apt install gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib" in done.stderr
    assert "cores/teensy3/Arduino.h" in done.stderr
    assert "libraries/SPI/SPI.h" in done.stderr
    with_compiler(home)
    put(tmp_path / "teensy/cores/teensy3/Arduino.h")
    done = make_dongle(home, folder, f"TEENSY={tmp_path / 'teensy'}")
    assert "compiler" not in done.stderr
    assert "Arduino.h" not in done.stderr
    assert "libraries/SPI/SPI.h" in done.stderr
    done = make_dongle(home, folder, f"TEENSY={tmp_path / 'teensy'}", "BOARD=teensy40")
    assert "cores/teensy4/Arduino.h" in done.stderr


def test_with_everything_there_the_dongle_is_built_or_the_compiler_quoted(tmp_path: Path) -> None:
    home, folder = tmp_path / "home", tmp_path / "build"
    with_compiler(home)
    installed = home / ".arduino15/packages/teensy/hardware/avr/1.59.0"
    for name in ("cores/teensy3/Arduino.h", "cores/teensy3/main.cpp", "libraries/SPI/SPI.h", "libraries/SPI/SPI.cpp"):
        put(installed / name)
    done = make_dongle(home, folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"wrote {folder / 'dongle/dongle-teensylc.hex'}" in done.stdout
    assert (folder / "dongle/dongle-teensylc.hex").read_text() == "hex\n"
    with_compiler(home, refuses="sender.c")
    done = make_dongle(home, folder)
    assert done.returncode != 0
    assert "sender.c is not to my liking" in done.stderr


def test_the_folder_for_the_arduino_ide_has_all_that_the_sketch_includes() -> None:
    (listed,) = (line for line in (DONGLE / "Makefile").read_text().splitlines() if line.startswith("SOURCES := "))
    sources = [DONGLE / name for name in listed.removeprefix("SOURCES := ").split()]
    assert all(source.is_file() for source in sources)
    names = {source.name for source in sources}
    for source in sources:
        for line in source.read_text().splitlines():
            if line.startswith('#include "'):
                assert line.split('"')[1] in names, (source.name, line)


def test_the_dongle_fits_a_teensy_lc(tmp_path: Path) -> None:
    assert len(Core()._memory) < 2048


# Fuzzing


@pytest.mark.parametrize("seed", [1, 2])
def test_rubbish_neither_stops_nor_confuses_it(seed: int) -> None:
    flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"] if gcc() else []
    command = [gcc() or ""] if gcc() else None
    program = executable("dongle_fuzz", [CORE / "dongle.c", HERE / "dongle_fuzz.c"], flags, command)
    done = subprocess.run([program, str(seed), str(ROUNDS)], capture_output=True, text=True, check=False)
    print(f"seed {seed}: {done.stdout}{done.stderr}")
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[4]) > ROUNDS / 20, "hardly anything was transmitted"


# The radio chip


class Bench:
    """The dongle's chip with its driver, and two receivers."""

    def __init__(self, loss: float = 0.0, seed: int = 0) -> None:
        self.ether = Ether(loss=loss, seed=seed)
        self.chip = Chip(self.ether, "dongle")
        self.sender = Sender(self.chip, self.ether)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def address_of(text: str) -> bytes:
    return bytes.fromhex(text)


def test_every_register_takes_its_value(bench: Bench) -> None:
    for rate, bits in enumerate((0x26, 0x06, 0x0E)):
        assert bench.sender.configure(40 + rate, rate, 4, 5, 1500)
        bank = bench.chip.bank
        assert (bank[RF_CH], bank[RF_SETUP], bank[SETUP_AW], bank[SETUP_RETR]) == (40 + rate, bits, 2, 0x55)
        assert (bank[CONFIG] & 0x0F, bank[EN_AA], bank[EN_RXADDR]) == (0x0E, 1, 1)
        assert (bank[FEATURE], bank[DYNPD]) == (6, 1)


@pytest.mark.parametrize(("power", "bits"), [*enumerate((0x00, 0x02, 0x04, 0x06))])
def test_a_power_reaches_the_chip_and_stays_after_a_dip(bench: Bench, power: int, bits: int) -> None:
    assert bench.sender.configure(40, 1, 5, 3, 500, power)
    assert bench.chip.bank[RF_SETUP] == bits
    bench.chip.reset()
    assert bench.sender.transmit(A, PAYLOAD)[0] is SendOutcome.NOTHING
    assert bench.chip.bank[RF_SETUP] == bits


def test_wlan_shows_on_its_channels_for_the_time_it_takes(bench: Bench) -> None:
    assert bench.sender.configure()
    bench.ether.noise = lambda channel, now_us: 62 <= channel <= 82 and now_us // 10_000 % 4 == 0
    found = [[bench.sender.carrier(channel) for channel in (61, 62, 76, 82, 83)] for _ in range(100)]
    assert [round(sum(each) / 100, 1) for each in zip(*found, strict=True)] == pytest.approx(
        [0, 0.25, 0.25, 0.25, 0], abs=0.1
    )


@pytest.mark.parametrize(("rate", "name", "delay_us"), [(0, "250kbps", 1500), (1, "1Mbps", 500), (2, "2Mbps", 500)])
def test_a_frame_arrives_and_the_loaded_answer_comes_back(bench: Bench, rate: int, name: str, delay_us: int) -> None:
    node = Listener(bench.ether, address_of(A), name)
    assert bench.sender.configure(76, rate, 5, 3, delay_us)
    node.reload(b"y" * 32)
    assert bench.sender.transmit(A, PAYLOAD) == (SendOutcome.ACKED, b"y" * 32, 0)
    assert node.heard() == [PAYLOAD]
    node.reload(b"z")
    assert bench.sender.transmit(A, bytes(32)) == (SendOutcome.ACKED, b"z", 0)
    node.chip.command(b"\xe1")
    assert bench.sender.transmit(A, PAYLOAD) == (SendOutcome.ACKED, b"", 0)


def test_nobody_there_costs_no_more_than_the_repeats(bench: Bench) -> None:
    assert bench.sender.configure()
    begin = bench.ether.now_us
    assert bench.sender.transmit(A, PAYLOAD) == (SendOutcome.NOTHING, b"", 3)
    assert 3500 < bench.ether.now_us - begin < 4500
    assert bench.ether.sent == 4


def test_what_could_not_be_delivered_is_not_sent_next_time(bench: Bench) -> None:
    assert bench.sender.configure()
    bench.sender.transmit(A, PAYLOAD)
    node = Listener(bench.ether, address_of(B))
    assert bench.sender.transmit(B, b"b" * 32)[0] is SendOutcome.ACKED
    assert node.heard() == [b"b" * 32]


def test_frames_go_to_the_node_they_are_for(bench: Bench) -> None:
    nodes = {address: Listener(bench.ether, address_of(address)) for address in (A, B)}
    assert bench.sender.configure()
    for number in range(20):
        address = (A, B, B)[number % 3]
        nodes[address].reload(address_of(address))
        assert bench.sender.transmit(address, bytes([number] * 32)) == (SendOutcome.ACKED, address_of(address), 0)
        assert nodes[address].heard() == [bytes([number] * 32)]
    assert nodes[A].heard() == nodes[B].heard() == []


def test_repeats_are_counted_and_an_answer_is_that_to_this_frame(bench: Bench) -> None:
    """Acknowledgements that are lost leave nothing behind that the next frame would be given."""
    node = Listener(bench.ether, address_of(A))
    assert bench.sender.configure()
    lost = 0

    def jam(sender: Chip, receiver: Chip, packet: object) -> bool:
        nonlocal lost
        lost += 1
        return lost in (1, 3)

    bench.ether.jams = jam
    node.reload(b"first")
    assert bench.sender.transmit(A, PAYLOAD) == (SendOutcome.ACKED, b"first", 2)
    node.reload(b"second")
    assert bench.sender.transmit(A, bytes(32)) == (SendOutcome.ACKED, b"second", 0)


def test_an_answer_left_over_is_not_taken_for_one_to_the_next_frame(bench: Bench) -> None:
    node = Listener(bench.ether, address_of(A))
    assert bench.sender.configure()
    node.reload(b"old")
    host = Host.__new__(Host)  # the same chip, driven past its driver: what a frame leaves that nobody read
    host.ether, host.chip = bench.ether, bench.chip
    host.send(address_of(A), PAYLOAD)
    node.reload(b"new")
    assert bench.sender.transmit(A, bytes(32))[:2] == (SendOutcome.ACKED, b"new")


def test_a_chip_that_lost_its_settings_gets_them_again(bench: Bench) -> None:
    node = Listener(bench.ether, address_of(A))
    assert bench.sender.configure()
    bench.chip.reset()
    assert bench.sender.transmit(A, PAYLOAD)[0] is SendOutcome.NOTHING
    assert bench.sender.transmit(A, PAYLOAD)[0] is SendOutcome.ACKED
    assert node.heard() == [PAYLOAD]


def test_settings_are_looked_at_once_a_second_even_if_all_goes_well(bench: Bench) -> None:
    node = Listener(bench.ether, address_of(A))
    assert bench.sender.configure()
    bench.chip.command(bytes([0x20 | SETUP_RETR, 0x10]))  # no repeats: frames still arrive
    assert bench.sender.transmit(A, PAYLOAD)[0] is SendOutcome.ACKED
    assert bench.chip.bank[SETUP_RETR] == 0x10
    bench.ether.advance(bench.ether.now_us + 1_000_000)
    assert bench.sender.transmit(A, bytes(32))[0] is SendOutcome.ACKED
    assert bench.chip.bank[SETUP_RETR] == 0x13
    assert len(node.heard()) == 2


@pytest.mark.parametrize("level", [0x00, 0xFF])
def test_a_chip_that_is_not_there_is_noticed_in_bounded_time(bench: Bench, level: int) -> None:
    bench.chip.unplugged = level
    assert not bench.sender.configure()
    bench.chip.unplugged = None
    assert bench.sender.configure()
    bench.chip.unplugged = level
    begin = bench.ether.now_us
    assert bench.sender.transmit(A, PAYLOAD)[0] is SendOutcome.BROKEN
    assert bench.ether.now_us - begin < 15_000
    bench.chip.unplugged = None
    bench.chip.reset()
    Listener(bench.ether, address_of(A))
    bench.sender.transmit(A, PAYLOAD)
    assert bench.sender.transmit(A, bytes(32))[0] is SendOutcome.ACKED


def test_the_scan_finds_who_is_sending_and_nobody_else(bench: Bench) -> None:
    assert bench.sender.configure()
    other = Host(bench.ether, "2Mbps", channel=30)
    found = []
    for channel in (29, 30, 31):
        other.chip.command(bytes([0x27, 0x70]))  # give up the frame before
        other.chip.command(b"\xe1")
        other.chip.command(bytes([0xA0]) + PAYLOAD)
        other.chip.ce = 1
        bench.ether.advance(bench.ether.now_us + 150)
        found.append(bench.sender.carrier(channel))
        other.chip.ce = 0
        bench.ether.advance(bench.ether.now_us + 10_000)
    assert found == [False, True, False]
    Listener(bench.ether, address_of(A))
    assert bench.sender.configure()
    assert bench.sender.transmit(A, PAYLOAD)[0] is SendOutcome.ACKED


def test_a_scan_acknowledges_nothing_that_it_overhears(bench: Bench) -> None:
    """Another host sends to the node that this one sent to last, while this one listens on that channel."""
    node = Listener(bench.ether, address_of(A))
    assert bench.sender.configure()
    assert bench.sender.transmit(A, PAYLOAD)[0] is SendOutcome.ACKED
    node.chip.ce = 0
    other = Host(bench.ether)
    write(other.chip, TX_ADDR, *address_of(A))
    other.chip.command(bytes([0xA0]) + PAYLOAD)
    other.chip.ce = 1
    bench.ether.advance(bench.ether.now_us + 500)
    sent = bench.ether.sent
    assert bench.sender.carrier(76)
    assert bench.ether.sent - sent == 1, "its repeat, and nothing that answers it"
    assert bench.chip.bank.rx == []


@pytest.mark.parametrize("loss", [0.0, 0.3, 0.6])
def test_whatever_is_lost_no_answer_is_made_up(loss: float) -> None:
    seed = 5
    print(f"seed {seed}")
    bench = Bench(loss, seed)
    nodes = {address: Listener(bench.ether, address_of(address)) for address in (A, B)}
    assert bench.sender.configure()
    acked = 0
    for number in range(300):
        address = (A, B)[number & 1]
        mark = bytes([number & 0xFF, number >> 8])
        nodes[address].reload(mark)
        outcome, answer, retries = bench.sender.transmit(address, mark * 16)
        heard = nodes[address].heard()
        assert retries <= 3
        assert outcome in (SendOutcome.ACKED, SendOutcome.NOTHING)
        assert heard in ([], [mark * 16])
        if outcome is SendOutcome.ACKED:
            acked += 1
            assert heard
            assert answer == mark
    assert acked == 300 if loss == 0 else 100 < acked < 300


def test_core_and_driver_together(bench: Bench) -> None:
    """Packet in, frame through the air, answer out."""
    node = Listener(bench.ether, address_of(A))
    node.reload(b"n" * 32)
    bench.sender.configure()
    core = Core(bench.sender.transmit)
    core.set_up()
    results = core.ask(PacketKind.SCHEDULE, schedule_bytes([(A, PAYLOAD), (B, PAYLOAD)]))
    assert results == [
        bytes([PacketKind.RESULT, 7, 0, 1, 0, 32]) + b"n" * 32,
        bytes([PacketKind.RESULT, 7, 1, 0, 3, 0]),
    ]
    assert node.heard() == [PAYLOAD]
