"""The nrf24 back end: what it refuses, and everything that needs a chip, which runs in a process of its own.

pyrf24 is a compiled library that talks to the kernel. It runs unmodified in a second pytest with a library preloaded
that stands for SPI, GPIO and the clock (`spi_shim.c`), with the chip model behind it. Each test function that ran there
is a test here, too, so that none is left out or skipped unseen.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

from curveline.errors import InvalidInput, LinkError, MissingExtra
from curveline.radio.interface import open_radio
from curveline.radio.ports import nrf24
from curveline.radio.ports.gpio_chip import library_chip
from curveline.system import portable

from . import inner_nrf24, test_contract
from .bench import drive_table
from .dongle_host import write_keys
from .spi_rig import environment, is_preloaded
from .worlds import HERE

HERE_FOLDER = Path(__file__).parent
INNER_LIMIT_S = 300
DRIVE = drive_table()


def functions_of(module: ModuleType) -> list[str]:
    return [name for name in vars(module) if name.startswith("test_")]


INNER = [
    (module.__name__.rpartition(".")[2], name)
    for module in (test_contract, inner_nrf24)
    for name in functions_of(module)
]


@dataclass(frozen=True)
class Outcome:
    """How one test item ended in the other process: "" if it passed."""

    module: str
    name: str
    trouble: str


@pytest.fixture(scope="module")
def inner(tmp_path_factory: pytest.TempPathFactory) -> list[Outcome]:
    """The outcomes of the other process."""
    folder = tmp_path_factory.mktemp("inner")
    report = folder / "report.xml"
    files = [str(HERE_FOLDER / f"{module}.py") for module in dict(INNER)]
    options = ["-q", "-p", "no:cacheprovider", f"--junitxml={report}", f"--basetemp={folder / 'tmp'}"]
    command = [sys.executable, "-m", "pytest", *options, *files]
    root = HERE_FOLDER.parents[1]
    done = subprocess.run(
        command, env=environment(), cwd=root, capture_output=True, text=True, timeout=INNER_LIMIT_S, check=False
    )
    print(done.stdout, done.stderr)
    assert report.exists(), done.stdout + done.stderr
    return [_outcome(case) for case in ElementTree.parse(report).iter("testcase")]


def _outcome(case: ElementTree.Element) -> Outcome:
    troubles = [f"{each.tag}: {each.get('message')}\n{each.text}" for each in case if each.tag in TROUBLES]
    return Outcome(case.attrib["classname"].rpartition(".")[2], case.attrib["name"], "\n".join(troubles))


TROUBLES = ("failure", "error", "skipped")


# In the other process


@pytest.mark.parametrize(("module", "name"), INNER)
def test_on_modelled_hardware(inner: list[Outcome], module: str, name: str) -> None:
    items = [each for each in inner if each.module == module and each.name.partition("[")[0] == name]
    assert items, "it did not run"
    assert [f"{each.name}\n{each.trouble}" for each in items if each.trouble] == []


def test_the_contract_ran_as_often_as_for_any_other_radio(inner: list[Outcome], request: pytest.FixtureRequest) -> None:
    contract = [each.name for each in inner if each.module == "test_contract"]
    on_chips = [name for name in contract if "nrf24" in name]
    assert len(on_chips) == CONTRACT_ITEMS
    assert len(contract) == CONTRACT_ITEMS + 1
    assert not is_preloaded()
    assert "nrf24" not in HERE


CONTRACT_ITEMS = 49
"""How many items the contract has for one back end; a test less is a promise less."""


# What it refuses


@pytest.fixture
def keys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "site.json"
    monkeypatch.setenv("CURVELINE_KEYS", str(path))
    write_keys(path, DRIVE)
    return path


@pytest.mark.parametrize(
    "settings",
    [
        *("", "22", "22,", ",0", "22,0,1", "22;0", "CE,CSN", "-1,0", "22,0x0", "1e2,0", "2222,0", "22,-0"),
        *("\u0662\u0662,0", "22,0,spi_MHz", "22,0,spi_MHz=", "22,0,spi_MHz=1e1", "22,0,spi_MHz=-1", "22,0,MHz=2"),
        "spi_MHz=2,22,0",
    ],
)
def test_settings_that_are_none(settings: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="two numbers, CE and CSN") as caught:
        open_radio(f"nrf24:{settings}", DRIVE, tmp_path)
    assert "nrf24:22,0" in caught.value.hint


@pytest.mark.parametrize("mhz", ["0", "0.09", "10.1", "80", "9" * 400])
def test_a_bus_that_is_too_slow_or_too_fast(mhz: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"can run at 0\.1 to 10 MHz") as caught:
        open_radio(f"nrf24:22,0,spi_MHz={mhz}", DRIVE, tmp_path)
    assert "nrf24:22,0,spi_MHz=2" in caught.value.hint


def test_the_library_says_which_gpio_chip_it_was_built_for() -> None:
    assert library_chip() == "/dev/gpiochip0"


def test_an_unknown_data_rate(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="data rate"):
        open_radio("nrf24:22,0", replace(DRIVE, data_rate="9Mbps"), tmp_path)


def test_without_keys_it_says_how_to_make_some(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "none.json"))
    with pytest.raises(InvalidInput) as caught:
        open_radio("nrf24:22,0", DRIVE, tmp_path)
    assert "curveline keys new" in caught.value.hint


@pytest.mark.parametrize("settings", ["22,99", " 22 , 99 "])
def test_a_machine_without_the_spi_device(keys: Path, tmp_path: Path, settings: str) -> None:
    with pytest.raises(LinkError, match=r"^there is no SPI device /dev/spidev9\.9 on this machine\n") as caught:
        open_radio(f"nrf24:{settings}", DRIVE, tmp_path)
    assert caught.value.exit_code == 3
    assert caught.value.hint


@pytest.mark.parametrize("pins", [(0, 22), (1, 25), (10, 8), (11, 24)])
def test_numbers_that_look_swapped_are_called_so(keys: Path, tmp_path: Path, pins: tuple[int, int]) -> None:
    with pytest.raises(LinkError, match=f"CE {pins[0]} and CSN {pins[1]} look swapped") as caught:
        open_radio(f"nrf24:{pins[0]},{pins[1]}", DRIVE, tmp_path)
    assert f"nrf24:{pins[1]},{pins[0]}" in caught.value.hint


@pytest.mark.parametrize("pins", [(22, 0), (22, 10), (25, 1), (22, 99), (0, 1), (1, 0)])
def test_numbers_that_do_not_look_swapped_are_not(
    keys: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pins: tuple[int, int]
) -> None:
    monkeypatch.setattr(nrf24, "_device", lambda csn: tmp_path / f"spidev-{csn}")
    with pytest.raises(LinkError, match="there is no SPI device") as caught:
        open_radio(f"nrf24:{pins[0]},{pins[1]}", DRIVE, tmp_path)
    assert "swapped" not in caught.value.message
    assert "SPI on" in caught.value.hint


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (PermissionError(13, "Permission denied"), "may not open"),
        (OSError(16, "Device or resource busy"), "resource busy"),
    ],
)
def test_a_device_that_cannot_be_opened(
    keys: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError, says: str
) -> None:
    really_open = os.open

    def refuse(path: str | Path, flags: int, *rest: int) -> int:
        if "spidev" in str(path):
            raise error
        return really_open(path, flags, *rest)

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(LinkError, match=says) as caught:
        open_radio("nrf24:22,0", DRIVE, tmp_path)
    assert caught.value.hint


def test_another_system_than_linux(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(portable, "HAS_SPI", False)
    with pytest.raises(InvalidInput, match="Linux") as caught:
        open_radio("nrf24:22,0", DRIVE, tmp_path)
    assert "serial:PORT" in caught.value.hint


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyrf24", None)
    with pytest.raises(MissingExtra, match="pyrf24") as caught:
        open_radio("nrf24:22,0", DRIVE, tmp_path)
    assert "pip install" in caught.value.hint


def test_the_library_is_loaded_only_when_a_chip_is_asked_for() -> None:
    code = "import sys, curveline.radio.ports.nrf24; sys.exit('pyrf24' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
