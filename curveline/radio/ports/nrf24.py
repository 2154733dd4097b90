"""The radio chip on the SPI bus of a Raspberry Pi, through pyrf24.

pyrf24 is the driver; this module decides what the chip is told, and does not believe that it stays told: supplies dip,
cables come off, and the library notices neither.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curveline.drive_settings import DriveSettings
from curveline.errors import InvalidInput, LinkError, MissingExtra
from curveline.radio.clock import steady_us
from curveline.radio.frame_tap import Tap, untapped
from curveline.radio.interface import Answer, InUse, RadioGone, check_frames
from curveline.radio.ports.gpio_chip import header_chip, library_chip
from curveline.radio.protocol.air_time import RATES_KBPS, RETRIES
from curveline.radio.protocol.band import CHANNELS, FULL_POWER
from curveline.radio.protocol.codes import FRAME_BYTES
from curveline.radio.protocol.keys import Site
from curveline.radio.site.key_file import hardware_site
from curveline.system import portable

if TYPE_CHECKING:
    from pyrf24 import RF24

SETTINGS = re.compile(r"\s*([0-9]{1,3})\s*,\s*([0-9]{1,3})\s*(?:,\s*spi_MHz\s*=\s*([0-9]+(?:\.[0-9]+)?)\s*)?")
EXAMPLE = "`--radio nrf24:22,0`: GPIO line 22 at the chip's CE, and /dev/spidev0.0; 10 * bus + select for another"
SPEED_EXAMPLE = "`--radio nrf24:22,0,spi_MHz=2` for wires longer than a hand"
SPI_MHZ = (0.1, 10.0)
"""Clock of the SPI bus: the slowest that is worth while, and the fastest that the chip takes, which is what it gets."""
SELECTS = frozenset({0, 1, 2, 10, 11, 12})
"""Chip selects that boards have by themselves."""

ADDRESS_BYTES = 5
DELAY_STEP_US = 250
DELAYS_US = {"250kbps": 1500, "1Mbps": 500, "2Mbps": 500}
"""Between two attempts of the chip: an answer of 32 bytes has to fit in."""
QUEUE = 3
"""Answers that the chip's queue holds at most."""
LOOK_US = 300
"""How long a channel is listened to for others: 170 us until the chip can tell, and as much again."""
CHECK_US = 1_000_000
"""How often the settings are read back while all is well."""
STUCK_US = 50_000
"""No packet takes the chip a third as long, with all its attempts at the slowest rate."""
RETURN_US = 30_000_000
"""How long a chip that has gone may take to come back."""

WIRING_HINT = (
    "look at the chip's supply (10 uF or more at its pins) and wires; if these are long, try a slower bus, such as "
    "`--radio nrf24:22,0,spi_MHz=2`; `curveline status` tries it again"
)
NO_SPI_HINT = (
    "switch SPI on (on a Raspberry Pi: raspi-config, Interface Options), or use a dongle: `--radio serial:PORT`"
)

GROUPS_HINT = "membership of the groups spi and gpio permits it"


def open_radio(settings: str, drive: DriveSettings, runs: Path) -> Nrf24Radio:
    """The chip that `settings` name as CE,CSN and perhaps spi_MHz=N, locked for this process and ready to send."""
    pins, spi_hz = _read_settings(settings)
    if drive.data_rate not in RATES_KBPS:
        raise InvalidInput(f"data rate {drive.data_rate!r} is unknown; there are {', '.join(RATES_KBPS)}")
    if not portable.HAS_SPI:
        hint = "use a dongle: `--radio serial:PORT`"
        raise InvalidInput("the nrf24 radio needs the SPI bus of a Linux board, such as a Raspberry Pi", hint)
    _check_library()
    site = hardware_site(drive)
    lock = _lock(pins)
    try:
        _check_gpio_chip()
        return Nrf24Radio((*pins, spi_hz), drive, site, lock)
    except BaseException:
        os.close(lock)
        raise


def _read_settings(settings: str) -> tuple[tuple[int, int], int]:
    """CE and CSN, and the clock of the bus [Hz]."""
    match = SETTINGS.fullmatch(settings)
    if match is None:
        message = f"the nrf24 radio needs two numbers, CE and CSN, and may have spi_MHz, not {settings[:40]!r}"
        raise InvalidInput(message, hint=f"{EXAMPLE}; {SPEED_EXAMPLE}")
    slowest, fastest = SPI_MHZ
    mhz = float(match[3] or fastest)
    if not slowest <= mhz <= fastest:
        message = f"the SPI bus of an nrf24 radio can run at {slowest:g} to {fastest:g} MHz, not at {match[3][:20]}"
        raise InvalidInput(message, hint=SPEED_EXAMPLE)
    return (int(match[1]), int(match[2])), round(mhz * 1e6)


class Nrf24Radio:
    """A `Radio` on the SPI bus; `lock` is the open SPI device, which is locked as long as the radio is open.

    `wiring` is CE, CSN and the clock of the bus [Hz].
    """

    def __init__(self, wiring: tuple[int, int, int], drive: DriveSettings, site: Site, lock: int) -> None:
        from pyrf24 import RF24, RF24_1MBPS, RF24_2MBPS, RF24_250KBPS

        self.site = site
        self.tap: Tap = untapped
        self._pins = wiring[:2]
        self._drive = drive
        self._rate = {"250kbps": RF24_250KBPS, "1Mbps": RF24_1MBPS, "2Mbps": RF24_2MBPS}[drive.data_rate]
        self._lock: int | None = lock
        self._chip: RF24 | None = RF24(*wiring)
        self._target = ""
        self._power = FULL_POWER
        self._gone_since_us: int | None = None
        self._checked_us = 0
        self._set_up(self._chip)

    # Radio

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        """See Radio; RadioGone if the chip does not answer, and again at every call until it does."""
        check_frames(frames)
        chip = self._opened()
        try:
            if self._dipped(chip) or self.now_us() - self._checked_us >= CHECK_US:
                self._check(chip)
            self._tidy(chip)
            answers = [self._exchange(chip, address, payload) for address, payload in frames]
        except RuntimeError as error:
            raise self._gone(_reason(str(error))) from error
        self.tap(frames, answers)
        return answers

    def carriers(self) -> Sequence[int]:
        """See Radio; RadioGone as for exchange. The chip acknowledges nothing that it overhears."""
        chip = self._opened()
        found = []
        try:
            chip.set_auto_ack(False)
            chip.start_listening()
            for channel in range(CHANNELS):
                chip.ce_pin(False)
                chip.channel = channel
                chip.ce_pin(True)
                self.sleep_until(self.now_us() + LOOK_US)
                if chip.rpd:
                    found.append(channel)
            chip.ce_pin(False)
            dipped = self._dipped(chip)
        except RuntimeError as error:
            raise self._gone(_reason(str(error))) from error
        self._set_up(chip)
        if dipped:
            raise self._gone("it lost its settings while it listened")
        return found

    def set_power(self, power: str) -> None:
        """See Radio; RadioGone as for exchange."""
        self._power = power
        self._set_up(self._opened())

    def close(self) -> None:
        """See Radio; the chip is switched off."""
        chip, self._chip = self._chip, None
        lock, self._lock = self._lock, None
        try:
            if chip is not None and self._gone_since_us is None:
                chip.power = False
        except RuntimeError:
            pass  # a chip that is gone is off
        finally:
            if lock is not None:
                os.close(lock)

    def now_us(self) -> int:
        """See Radio."""
        return steady_us()

    def sleep_until(self, moment_us: int) -> None:
        """See Radio."""
        time.sleep(max(0, moment_us - self.now_us()) / 1e6)

    def _opened(self) -> RF24:
        """The chip, which is there as far as is known."""
        chip = self._chip
        if chip is None:
            raise LinkError("the nrf24 radio is closed")
        if self._gone_since_us is not None:
            self._set_up(chip)
        return chip

    # One packet

    def _tidy(self, chip: RF24) -> None:
        """Clear what an exchange that was broken off has left: its answers would be taken for another node's."""
        chip.flush_rx()
        chip.clear_status_flags()
        self._target = ""  # pointing the chip at a node empties the queue of what it is to send

    def _exchange(self, chip: RF24, address: str, payload: bytes) -> Answer:
        if address != self._target:
            chip.stop_listening(bytes.fromhex(address))
            self._target = address
        delivered = self._send(chip, payload)
        retries = chip.get_arc()
        answer = self._newest(chip)
        if not delivered:
            chip.flush_tx()
            self._check(chip)  # a chip that forgot its channel hears nobody either
        if answer is None and delivered:
            answer = b""
        return Answer(answer, retries)

    def _send(self, chip: RF24, payload: bytes) -> bool:
        """Send one packet; whether it was acknowledged.

        The library's `write` does this, too, but sends a second time and prints if the chip falls silent.
        """
        from pyrf24 import RF24_TX_DF, RF24_TX_DS

        sent, failed = RF24_TX_DS.value, RF24_TX_DF.value
        deadline_us = self.now_us() + STUCK_US
        chip.start_fast_write(payload)
        while not (flags := chip.update()) & (sent | failed):
            if self.now_us() > deadline_us:
                if self._check(chip):
                    raise self._gone("it ends no transmission; is its CE pin connected?")
                return False
        chip.ce_pin(False)
        chip.clear_status_flags()
        return bool(flags & sent) and not flags & failed

    def _newest(self, chip: RF24) -> bytes | None:
        """The newest payload in the chip's queue that is a frame, which is emptied; None if there is none."""
        newest = None
        for _ in range(QUEUE):
            if not chip.available():
                break
            size = chip.get_dynamic_payload_size()
            if not 0 < size <= FRAME_BYTES:
                chip.flush_rx()
                break
            payload = bytes(chip.read(size))
            if size == FRAME_BYTES:
                newest = payload
        return newest

    # The chip and its settings

    def _set_up(self, chip: RF24) -> None:
        """Tell the chip everything; LinkError if it is not there or takes it differently."""
        self._target = ""
        try:
            there = chip.begin() and chip.is_chip_connected
            if there:
                self._configure(chip)
                self._checked_us = self.now_us()
            fits = there and self._fits(chip)
        except (RuntimeError, OSError) as error:
            raise self._cannot_use(str(error)) from error
        if not there:
            raise self._gone("it does not answer")
        if not fits:
            chip.power = False
            hint = "250 kbps takes an nRF24L01+ (with the plus); check the wires and the supply"
            raise LinkError(f"the radio chip at {self._name} does not take its settings ({self._wanted})", hint)
        self._gone_since_us = None

    def _configure(self, chip: RF24) -> None:
        from pyrf24 import RF24_CRC_16, rf24_pa_dbm_e

        delay_us = DELAYS_US[self._drive.data_rate]
        chip.address_width = ADDRESS_BYTES
        chip.channel = self._drive.channel
        chip.data_rate = self._rate
        chip.crc_length = RF24_CRC_16
        chip.dynamic_payloads = True
        chip.ack_payloads = True
        chip.set_retries(delay_us // DELAY_STEP_US - 1, RETRIES)
        chip.set_pa_level(getattr(rf24_pa_dbm_e, f"RF24_PA_{self._power.upper()}"))
        chip.tx_delay = 0  # it waits for the end of outgoing answers, and this end sends none
        chip.flush_tx()
        chip.flush_rx()

    def _fits(self, chip: RF24) -> bool:
        """Whether the chip still has the settings."""
        rate: Any = chip.data_rate  # an enum, whatever the stubs say
        return chip.channel == self._drive.channel and rate == self._rate and not self._dipped(chip)

    def _dipped(self, chip: RF24) -> bool:
        """The shortest look at whether the supply failed: the CRC of the factory's settings is shorter than ours."""
        from pyrf24 import RF24_CRC_16

        return chip.crc_length != RF24_CRC_16

    def _check(self, chip: RF24) -> bool:
        """Whether the chip still has its settings; if not, it gets them again. RadioGone if there is no chip."""
        if not chip.is_chip_connected:
            raise self._gone("it does not answer any more")
        kept = self._fits(chip)
        if kept:
            self._checked_us = self.now_us()
        else:
            self._set_up(chip)
        return kept

    @property
    def _name(self) -> str:
        return f"CE {self._pins[0]}, CSN {self._pins[1]}"

    @property
    def _wanted(self) -> str:
        return f"channel {self._drive.channel}, {self._drive.data_rate}"

    def _gone(self, why: str) -> RadioGone:
        if self._gone_since_us is None:
            self._gone_since_us = self.now_us()
        may_return = self.now_us() - self._gone_since_us < RETURN_US
        return RadioGone(f"no radio chip can be used at {self._name}: {why}", WIRING_HINT, may_return=may_return)

    def _cannot_use(self, why: str) -> LinkError:
        """Why the library could not even begin, in a sentence of ours."""
        if "GPIO" in why or "gpio" in why:
            hint = f"is it a line that this board has, and free? {GROUPS_HINT}"
            return LinkError(f"GPIO line {self._pins[0]} cannot be used: {_reason(why)}", hint)
        return self._gone(_reason(why))


def _check_library() -> None:
    try:
        import pyrf24  # noqa: F401
    except ImportError as error:
        hint = "`pip install pyrf24`; it comes with curveline on Linux"
        raise MissingExtra(f"the nrf24 radio needs the package pyrf24: {error}", hint) from None


def _check_gpio_chip() -> None:
    """LinkError if the library would look for the CE line on another chip than that of this board's header."""
    header, built = header_chip(), library_chip()
    if header is None or built is None or os.path.realpath(header[0]) == os.path.realpath(built):
        return
    path, label = header
    hint = (
        f"build the library for this board: `CMAKE_ARGS=-DRF24_LINUX_GPIO_CHIP={path} pip install --force-reinstall "
        f"--no-deps --no-binary pyrf24 pyrf24`; or update the system, as newer kernels call the header "
        f"/dev/gpiochip0; or use a dongle: `--radio serial:PORT`"
    )
    raise LinkError(f"the pin header of this board is {path} ({label}), but pyrf24 was built for {built}", hint)


def _device(csn: int) -> Path:
    return Path(f"/dev/spidev{csn // 10}.{csn % 10}")


def _absent(pins: tuple[int, int]) -> LinkError:
    """Why there is no SPI device for these numbers: they may be each other's."""
    ce, csn = pins
    device = _device(csn)
    if csn not in SELECTS and (ce in SELECTS or _device(ce).exists()):
        hint = f"CE, the GPIO line, comes first, then CSN, the chip select: `--radio nrf24:{csn},{ce}`"
        return LinkError(f"there is no SPI device {device}: CE {ce} and CSN {csn} look swapped", hint)
    return LinkError(f"there is no SPI device {device} on this machine", NO_SPI_HINT)


def _lock(pins: tuple[int, int]) -> int:
    """Open the SPI device and lock it, so that no other process uses this chip; LinkError if that cannot be."""
    device = _device(pins[1])
    try:
        descriptor = os.open(device, os.O_RDWR)
    except FileNotFoundError:
        raise _absent(pins) from None
    except PermissionError:
        raise LinkError(f"this user may not open {device}", GROUPS_HINT) from None
    except OSError as error:
        raise LinkError(f"{device} cannot be opened: {error.strerror}", NO_SPI_HINT) from None
    with suppress(OSError):
        if portable.lock(descriptor):
            return descriptor
    os.close(descriptor)
    hint = "only one program can use a radio chip at a time"
    raise InUse(f"the radio chip at {device} is in use by another program", hint)


def _reason(message: str) -> str:
    """What is behind the library's own name for the place it happened in."""
    return re.sub(r"^\[[^]]*\]\s*", "", message).strip()
