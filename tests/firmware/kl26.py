"""The parts of the MKL26Z64 that the node program touches, register by register, as far as it touches them.

Anything else is an error, so that a program that strays is noticed: an unknown register, a block whose clock is off, a
flash command run from flash, a word programmed twice. Times are in core cycles at 48 MHz.

Where the facts are from: addresses and bits of the registers, among them those of reset causes (RCM_SRS0, RCM_SRS1)
and of the flash cache (MCM_PLACR), from the vendor's public headers; that the cache must be cleared by the program
after a flash command from the Teensy's core and the vendor's flash driver, which do so. From memory of the reference
manual: that the reset register tells of the last reset only, that power-on shows as POR and LVD together, and that
RAM keeps what it holds over every reset as long as there is power. Worse than any chip the cache keeps all that is
flash until it is cleared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random

from .power import PMC_LVDSC1, PMC_LVDSC2, PMC_REGSC, Power

PORT_A, PORT_B, PORT_C, PORT_D, PORT_E = range(5)
CYCLES_PER_US = 48
IRQ_PORT_CD = 31
FLASH_BYTES = 0x10000
SECTOR_BYTES = 1024

GATE_OF_PAGE = {
    0x76: (0x48034, 22),
    0x3B: (0x4803C, 27),
    **{0x49 + index: (0x48038, 9 + index) for index in range(5)},
    **{0x38 + index: (0x4803C, 24 + index) for index in range(3)},
}
"""Page of SPI0, the converter, a port or a timer -> register and bit of its clock funnel."""

MCG_C1, MCG_C2, MCG_C5, MCG_C6, MCG_S, OSC0_CR = 0x64000, 0x64001, 0x64004, 0x64005, 0x64006, 0x65000
SIM_SOPT2, SIM_CLKDIV1, SIM_UID, SIM_COPC, SIM_SRVCOP = 0x48004, 0x48044, 0x48058, 0x48100, 0x48104
RCM_SRS0, RCM_SRS1 = 0x7F000, 0x7F001
SPI0_S, SPI0_BR, SPI0_C2, SPI0_C1, SPI0_DL = 0x76000, 0x76001, 0x76002, 0x76003, 0x76006
FTFA_FSTAT, FTFA_FCCOB = 0x20000, 0x20004
ADC0_SC1A, ADC0_CFG1, ADC0_RA, ADC0_SC3 = 0x3B000, 0x3B008, 0x3B010, 0x3B024
ADC_DONE, ADC_BANDGAP, BANDGAP_MV = 0x80, 27, 1000
SCB_VTOR, SCB_AIRCR, AIRCR_RESET = 0xED08, 0xED0C, 0x05FA0004
SYST_CSR, SYST_RVR, SYST_CVR = 0xE010, 0xE014, 0xE018
NVIC_ISER, NVIC_IPR, SCB_SHPR3 = 0xE100, 0xE400, 0xED20
FTFA_FPROT, REGION_BYTES, PROTECTED = 0x20010, 2048, 0x10
MCM_PLACR, PLACR_CLEAR_CACHE = 0xC, 0x400
"""Within the block at 0xF0003000."""

RESET_POWER_ON, RESET_WATCHDOG, RESET_LOW_VOLTAGE, RESET_PIN = 0x82, 0x20, 0x02, 0x40
RESET_LOCKUP, RESET_SOFTWARE = 0x200, 0x400
"""Causes of a reset: bits of RCM_SRS0, and of RCM_SRS1 from bit 8 on."""

COP_CYCLES = {0x04: 32, 0x08: 256, 0x0C: 1024}
"""Watchdog setting -> time-out in ms of its own clock."""
PROGRAM_CYCLES = 65 * CYCLES_PER_US
ERASE_CYCLES = 14_000 * CYCLES_PER_US


class Strayed(AssertionError):
    """The program did something that the chip would not let it get away with."""


class PowerCut(Exception):
    """The power went away in the middle of a flash command, as a test wanted it; a power cycle must follow."""


class SpiDevice:
    """What hangs on the SPI bus: nothing. The radio model has the same three methods."""

    def select(self) -> None:
        """Chip select goes low."""

    def transfer(self, byte: int) -> int:
        """One byte each way; an open line reads as ones."""
        return 0xFF

    def deselect(self) -> None:
        """Chip select goes high."""


@dataclass
class Port:
    """One port: what the program drives, what the world drives, and who asks for interrupts."""

    out: int = 0
    direction: int = 0
    level: int = 0xFFFFFFFF
    pcr: list[int] = field(default_factory=lambda: [0] * 32)
    flags: int = 0

    @property
    def pins(self) -> int:
        """What PDIR reads."""
        return (self.out & self.direction) | (self.level & ~self.direction & 0xFFFFFFFF)


class Kl26:
    """Registers and their effects; the processor is elsewhere."""

    def __init__(self, flash: bytearray, uid: tuple[int, int, int]) -> None:
        self.flash = flash
        self.uid = uid
        self.now = 0
        self.spi: SpiDevice = SpiDevice()
        self.on_pin: Callable[[int, int, int], None] = lambda port, pin, level: None
        self.on_flash: Callable[[int, int], None] = lambda address, length: None
        self.on_fresh: Callable[[int, int], None] = lambda address, length: None
        self.on_reset: Callable[[int], None] = lambda cause: None
        self.pc: Callable[[], int] = lambda: 0
        self.levels: dict[tuple[int, int], int] = {}
        self.stall = 0
        self.erases = 0
        self.words_programmed = 0
        self.flash_commands = 0
        self.cut_at = 0
        """In which command, from 1, the power is cut, 0 for none; `chance` says what is left of its work."""
        self.chance = Random(0)
        self._half: set[int] = set()
        self.power = Power()
        self._readers = {
            MCG_S: self._clock_status,
            SPI0_S: self._read_spi_status,
            SPI0_DL: self._read_spi_data,
            PMC_LVDSC1: lambda: self.power.read(PMC_LVDSC1),
            PMC_LVDSC2: lambda: self.power.read(PMC_LVDSC2),
        }
        self._writers = {
            SIM_COPC: self._write_cop,
            SIM_SRVCOP: self._feed_cop,
            SPI0_DL: self._write_spi_data,
            FTFA_FSTAT: self._write_flash_status,
            ADC0_SC1A: self._convert,
            PMC_LVDSC1: lambda value: self._write_power(PMC_LVDSC1, value),
            PMC_LVDSC2: lambda value: self._write_power(PMC_LVDSC2, value),
        }
        self.reset(RESET_POWER_ON)

    def reset(self, cause: int) -> None:
        """All registers as after a reset for `cause`; what the world holds the pins at stays."""
        self.store: dict[int, int] = {RCM_SRS0: cause & 0xFF, RCM_SRS1: cause >> 8}
        self.store |= {MCG_C1: 0x04, SIM_CLKDIV1: 0x00010000, FTFA_FSTAT: 0x80}
        self.ports = [Port() for _ in range(5)]
        for (port, pin), level in self.levels.items():
            self._drive(self.ports[port], pin, level)
        self.cop_written = False
        self.cop_half = False
        self.cop_fed = self.now
        self.cop_ms = 1024
        self.systick_next: int | None = None
        self.systick_pending = False
        self.vectors = 0
        self.protection = [0xFF] * 4
        self.nvic_enabled = 0
        self._spi_full = False
        self._spi_data = 0
        self._stale: list[tuple[int, int]] = []
        self.power.reset(power_on=bool(cause & 0x80))

    # The world's side

    @property
    def core_hz(self) -> int:
        """Frequency of the core, as clock generator and dividers are set."""
        divider = (self.store.get(SIM_CLKDIV1, 0) >> 28) + 1
        if self.store.get(MCG_C6, 0) & 0x40 and not self.store.get(MCG_C1, 0) & 0xC0:
            reference = 16_000_000 // ((self.store.get(MCG_C5, 0) & 0x1F) + 1)
            return reference * ((self.store[MCG_C6] & 0x1F) + 24) // divider
        return (16_000_000 if self.store[MCG_C1] >> 6 == 2 else 20_971_520) // divider

    def set_pin(self, port: int, pin: int, level: int) -> None:
        """The world drives a pin; an edge may ask for an interrupt."""
        self.levels[port, pin] = level
        bank = self.ports[port]
        before = bank.level >> pin & 1
        self._drive(bank, pin, level)
        condition = bank.pcr[pin] >> 16 & 0xF
        if level != before and (condition == 0xB or condition == (0x9 if level else 0xA)):
            bank.flags |= 1 << pin

    @staticmethod
    def _drive(bank: Port, pin: int, level: int) -> None:
        bank.level = bank.level & ~(1 << pin) | level << pin

    def output(self, port: int, pin: int) -> int:
        """Level of a pin that the program drives, 0 if it does not."""
        bank = self.ports[port]
        is_gpio = bank.pcr[pin] >> 8 & 7 == 1
        return bank.out >> pin & bank.direction >> pin & 1 if is_gpio else 0

    def duty(self, output: tuple[int, int, int, int, int]) -> float:
        """Share of the time that a PWM pin (port, pin, mux, timer, channel) is high."""
        port, pin, mux, timer, channel = output
        base = 0x38000 + 0x1000 * timer
        running = self.store.get(base, 0) & 0x18 == 0x08 and self.store.get(base + 0x0C + 8 * channel, 0) == 0x28
        if not running or self.ports[port].pcr[pin] >> 8 & 7 != mux:
            return 0.0
        period = self.store.get(base + 8, 0) + 1
        return min(1.0, self.store.get(base + 0x10 + 8 * channel, 0) / period)

    def pwm_hz(self, timer: int) -> float:
        """Frequency of a timer's PWM; 0 without a clock."""
        if self.store.get(SIM_SOPT2, 0) & 0x03010000 != 0x01010000:
            return 0.0
        return 48e6 / (self.store.get(0x38008 + 0x1000 * timer, 0xFFFF) + 1)

    @property
    def spi_hz(self) -> int:
        """Clock of SPI0, whose bus has half the core's."""
        rate = self.store.get(SPI0_BR, 0)
        return 24_000_000 // (((rate >> 4 & 7) + 1) * (2 << (rate & 0xF)))

    @property
    def cop_deadline(self) -> int | None:
        """When the watchdog bites."""
        return self.cop_fed + self.cop_ms * 1000 * CYCLES_PER_US if self.cop_ms else None

    @property
    def pin_interrupt(self) -> bool:
        """Whether ports C or D ask for their interrupt, and it is enabled."""
        return bool((self.ports[PORT_C].flags | self.ports[PORT_D].flags) and self.nvic_enabled >> IRQ_PORT_CD & 1)

    # The program's side

    def read(self, offset: int, size: int) -> int:
        """A load from 0x40000000 + offset."""
        self._check_gate(offset)
        if 0x49000 <= offset < 0x4E000:
            return self._read_port(offset)
        if offset in self._readers:
            return self._readers[offset]()
        if SIM_UID <= offset < SIM_UID + 12:
            return self.uid[(offset - SIM_UID) // 4]
        if offset in self.store or offset in self._KNOWN:
            return self.store.get(offset, 0)
        raise Strayed(f"load of {size} bytes from 0x{0x40000000 + offset:08x}, pc 0x{self.pc():x}")

    def write(self, offset: int, size: int, value: int) -> None:
        """A store to 0x40000000 + offset."""
        self._check_gate(offset)
        if 0x49000 <= offset < 0x4E000:
            self._write_port(offset, value)
        elif offset in self._writers:
            self._writers[offset](value)
        elif FTFA_FPROT <= offset < FTFA_FPROT + 4:
            self._protect(offset - FTFA_FPROT, value)
        elif offset in self._KNOWN:
            self.store[offset] = value
        else:
            raise Strayed(f"store of {size} bytes to 0x{0x40000000 + offset:08x}, pc 0x{self.pc():x}")

    def read_gpio(self, offset: int) -> int:
        """A load from the fast GPIO block."""
        port, register = self.ports[offset // 0x40], offset % 0x40
        return {0x00: port.out, 0x10: port.pins, 0x14: port.direction}[register]

    def write_gpio(self, offset: int, value: int) -> None:
        """A store to the fast GPIO block."""
        index, register = offset // 0x40, offset % 0x40
        port = self.ports[index]
        before = port.out & port.direction
        if register == 0x04:
            port.out |= value
        elif register == 0x08:
            port.out &= ~value
        elif register == 0x0C:
            port.out ^= value
        elif register == 0x14:
            port.direction = value
        else:
            raise Strayed(f"store to GPIO register 0x{offset:x}")
        changed = before ^ (port.out & port.direction)
        while changed:
            pin = (changed & -changed).bit_length() - 1
            changed &= changed - 1
            self.on_pin(index, pin, port.out >> pin & 1)

    def read_system(self, offset: int) -> int:
        """A load from 0xE0000000 + offset."""
        if offset == SYST_CVR:
            return max(0, (self.systick_next or self.now) - self.now - 1)
        return {NVIC_ISER: self.nvic_enabled}.get(offset, self.store.get(0xE0000 + offset, 0))

    def write_system(self, offset: int, value: int) -> None:
        """A store to 0xE0000000 + offset."""
        if offset == NVIC_ISER:
            self.nvic_enabled |= value
        elif offset == SCB_AIRCR and value == AIRCR_RESET:
            self.on_reset(RESET_SOFTWARE)
        elif offset == SYST_CSR:
            self.systick_next = self.now + self.systick_period if value & 1 else None
        elif offset == SCB_VTOR and value % 256 == 0:
            self.vectors = value
        elif offset not in (SYST_RVR, SYST_CVR, SCB_SHPR3, *range(NVIC_IPR, NVIC_IPR + 32, 4)):
            raise Strayed(f"store to 0x{0xE0000000 + offset:08x}")
        self.store[0xE0000 + offset] = value

    def read_platform(self, offset: int) -> int:
        """A load from 0xF0003000 + offset."""
        if offset != MCM_PLACR:
            raise Strayed(f"load from 0x{0xF0003000 + offset:08x}")
        return self.store.get(0xF3000 + offset, 0)

    def write_platform(self, offset: int, value: int) -> None:
        """A store to 0xF0003000 + offset."""
        if offset != MCM_PLACR:
            raise Strayed(f"store to 0x{0xF0003000 + offset:08x}")
        self.store[0xF3000 + offset] = value & ~PLACR_CLEAR_CACHE
        if value & PLACR_CLEAR_CACHE:
            stale, self._stale = self._stale, []
            for address, length in stale:
                self.on_fresh(address, length)

    @property
    def systick_period(self) -> int:
        """Cycles from tick to tick."""
        return (self.store.get(0xE0000 + SYST_RVR, 0) & 0xFFFFFF) + 1

    def priority(self, irq: int) -> int:
        """Of an interrupt, or of the tick if -1; small goes first."""
        if irq < 0:
            return self.store.get(0xE0000 + SCB_SHPR3, 0) >> 30
        return self.store.get(0xE0000 + NVIC_IPR + irq // 4 * 4, 0) >> (8 * (irq % 4) + 6) & 3

    # Blocks

    def _check_gate(self, offset: int) -> None:
        funnel = GATE_OF_PAGE.get(offset >> 12)
        if funnel is not None and not self.store.get(funnel[0], 0) >> funnel[1] & 1:
            raise Strayed(f"0x{0x40000000 + offset:08x} is touched while its clock is off, pc 0x{self.pc():x}")

    def _read_port(self, offset: int) -> int:
        port, register = self.ports[(offset >> 12) - 0x49], offset & 0xFFF
        if register == 0xA0:
            return port.flags
        if register < 0x80:
            pin = register // 4
            return port.pcr[pin] | (port.flags >> pin & 1) << 24
        raise Strayed(f"load from port register 0x{register:x}")

    def _write_port(self, offset: int, value: int) -> None:
        port, register = self.ports[(offset >> 12) - 0x49], offset & 0xFFF
        if register == 0xA0:
            port.flags &= ~value
        elif register < 0x80:
            port.pcr[register // 4] = value & 0x000F0757
        else:
            raise Strayed(f"store to port register 0x{register:x}")

    def _clock_status(self) -> int:
        c1, c6 = self.store.get(MCG_C1, 0), self.store.get(MCG_C6, 0)
        crystal = self.store.get(MCG_C2, 0) & 4 and self.store.get(OSC0_CR, 0) & 0x80
        locked = c6 & 0x40 and crystal and self.store.get(MCG_C5, 0) & 0x1F == 3
        source = {0: 3 if locked else 0, 1: 1, 2: 2 if crystal else 0}[c1 >> 6]
        return (0x02 if crystal else 0) | source << 2 | (c1 & 4) << 2 | (0x60 if locked else 0)

    def _write_cop(self, value: int) -> None:
        if not self.cop_written:
            self.cop_written = True
            self.cop_ms = COP_CYCLES.get(value & 0x0C, 0)
            self.cop_fed = self.now

    def _feed_cop(self, value: int) -> None:
        if value == 0x55:
            self.cop_half = True
        elif value == 0xAA:
            if self.cop_half:
                self.cop_fed = self.now
            self.cop_half = False
        else:
            self.on_reset(RESET_WATCHDOG)

    def _read_spi_status(self) -> int:
        return 0x20 | (0x80 if self._spi_full else 0)

    def _write_spi_data(self, value: int) -> None:
        muxes = [self.ports[PORT_C].pcr[pin] >> 8 & 7 for pin in (5, 6, 7)]
        if self.store.get(SPI0_C1, 0) != 0x50 or muxes != [2, 2, 2]:
            raise Strayed("SPI0 is used before it is set up")
        self._spi_data = self.spi.transfer(value & 0xFF)
        self._spi_full = True
        self.stall += 8 * CYCLES_PER_US * 1_000_000 // self.spi_hz

    def _read_spi_data(self) -> int:
        self._spi_full = False
        return self._spi_data

    def _write_flash_status(self, value: int) -> None:
        status = self.store[FTFA_FSTAT] & ~(value & 0x70)
        self.store[FTFA_FSTAT] = status
        if not value & 0x80:
            return
        if status & 0x70:
            raise Strayed("a flash command is launched with an error flag up")
        if self.pc() < FLASH_BYTES:
            raise Strayed(f"a flash command is launched from flash, pc 0x{self.pc():x}")
        self._flash_command([self.store.get(FTFA_FCCOB + index, 0) for index in (3, 2, 1, 0, 7, 6, 5, 4)])

    def _protect(self, index: int, value: int) -> None:
        """Regions may be added to the protected ones, whose bits are 0, and none be taken back."""
        if value & ~self.protection[index]:
            raise Strayed("protection of the flash is taken back")
        self.protection[index] = value

    def _flash_command(self, bytes_: list[int]) -> None:
        command, address = bytes_[0], bytes_[1] << 16 | bytes_[2] << 8 | bytes_[3]
        region = min(address // REGION_BYTES, 31)
        if not self.protection[3 - region // 8] >> region % 8 & 1:
            self.store[FTFA_FSTAT] |= PROTECTED
            return
        self.flash_commands += 1
        is_cut = self.flash_commands == self.cut_at
        if command == 0x09 and address % SECTOR_BYTES == 0 and address < FLASH_BYTES:
            self._half -= {*range(address, address + SECTOR_BYTES, 4)}
            if is_cut:
                self._erase_half(address)
            self.flash[address : address + SECTOR_BYTES] = b"\xff" * SECTOR_BYTES
            self._change_flash(address, SECTOR_BYTES)
            self.erases += 1
            self.stall += ERASE_CYCLES
        elif command == 0x06 and address % 4 == 0 and address < FLASH_BYTES:
            word = bytes(reversed(bytes_[4:8]))
            if self.flash[address : address + 4] != b"\xff" * 4 and address not in self._half:
                raise Strayed(f"the flash word at 0x{address:x} is programmed twice without an erase")
            if is_cut:
                self._program_half(address, word)
            self._half.discard(address)
            self.flash[address : address + 4] = word
            self._change_flash(address, 4)
            self.words_programmed += 1
            self.stall += PROGRAM_CYCLES
        else:
            raise Strayed(f"flash command 0x{command:02x} at 0x{address:x}")

    def _erase_half(self, address: int) -> None:
        """The power fails in the middle: some words are blank already, in some a few bits are."""
        for at in range(address, address + SECTOR_BYTES, 4):
            old = int.from_bytes(self.flash[at : at + 4], "little")
            blank = self.chance.choice((0, 0xFFFFFFFF, self.chance.getrandbits(32)))
            self.flash[at : at + 4] = (old | blank).to_bytes(4, "little")
        raise PowerCut

    def _program_half(self, address: int, word: bytes) -> None:
        """The power fails in the middle: some of the bits are there, and what is missing may be programmed later."""
        left = self.chance.choice((0, 0xFFFFFFFF, self.chance.getrandbits(32)))
        now = int.from_bytes(self.flash[address : address + 4], "little") & (int.from_bytes(word, "little") | left)
        self.flash[address : address + 4] = now.to_bytes(4, "little")
        self._half.add(address)
        raise PowerCut

    def _change_flash(self, address: int, length: int) -> None:
        """Readers see what is cached until the program clears the cache."""
        self.on_flash(address, length)
        self._stale.append((address, length))

    def _convert(self, channel: int) -> None:
        """The only channel that is looked at is the reference, which needs its buffer; it takes no time."""
        if channel != ADC_BANDGAP or not self.store.get(PMC_REGSC, 0) & 1 or self.store.get(ADC0_CFG1, 0) & 0xC != 4:
            raise Strayed("the converter is asked for what it cannot tell")
        self.store[ADC0_SC1A] = channel | ADC_DONE
        self.store[ADC0_RA] = 4095 * BANDGAP_MV // self.power.mv

    def _write_power(self, offset: int, value: int) -> None:
        self.power.write(offset, value)
        if self.power.too_low:
            self.on_reset(RESET_LOW_VOLTAGE)

    _KNOWN = frozenset(
        {MCG_C1, MCG_C2, MCG_C5, MCG_C6, OSC0_CR, SIM_SOPT2, SIM_CLKDIV1, 0x48034, 0x48038, 0x4803C}
        | {PMC_REGSC, ADC0_SC1A, ADC0_CFG1, ADC0_RA, ADC0_SC3}
        | {SPI0_BR, SPI0_C1, SPI0_C2, RCM_SRS0, FTFA_FSTAT, *range(FTFA_FCCOB, FTFA_FCCOB + 8)}
        | {0x38000 + 0x1000 * timer + register for timer in range(3) for register in (0, 4, 8, 12, 16, 20, 24)}
    )
