"""A Teensy LC that runs the real node program: unicorn as the processor, `Kl26` as the blocks around it, three motors.

Time is counted in core cycles at 48 MHz. Unicorn counts instructions, not cycles; one instruction is taken for one and
a half cycles, as measured on a cycle-counting model of the core. The processor runs in slices that end where something
is due, so what happens in them is late by a slice at most: 5 us within a handler.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn.arm_const import (
    UC_ARM_REG_LR,
    UC_ARM_REG_PC,
    UC_ARM_REG_PRIMASK,
    UC_ARM_REG_R0,
    UC_ARM_REG_R1,
    UC_ARM_REG_R2,
    UC_ARM_REG_R3,
    UC_ARM_REG_R12,
    UC_ARM_REG_SP,
    UC_ARM_REG_XPSR,
    UC_CPU_ARM_CORTEX_M0,
)
from unicorn.unicorn_const import UC_ERR_EXCEPTION

from .kl26 import (
    CYCLES_PER_US,
    IRQ_PORT_CD,
    PORT_A,
    PORT_B,
    PORT_C,
    PORT_D,
    PORT_E,
    RESET_POWER_ON,
    RESET_WATCHDOG,
    Kl26,
    Strayed,
)
from .motors import STEP_US, Motor

RAM_BEGIN, RAM_END = 0x1FFFF800, 0x20001800
RETURN = 0xFFFFFFF8
"""Where a handler's return lands; bit 0 of the link value is cut off."""
NOWHERE = 0xFFFFFFF0
WFI = b"\x30\xbf"
TICK_SLICE = 256
PINS_SLICE = 64
MASKED_SLICE = 16
HARD_FAULT = 3
MAIN_SLICE_US = 100
LAMP_STEADY = 255
LAMP_WINDOW_US = 1_600_000
LAMP_PAUSE_US = 700_000

PWM_PINS = (
    ((PORT_B, 0, 3, 1, 0), (PORT_B, 1, 3, 1, 1)),
    ((PORT_A, 1, 3, 2, 0), (PORT_A, 2, 3, 2, 1)),
    ((PORT_C, 1, 4, 0, 0), (PORT_C, 2, 4, 0, 1)),
)
NSLEEP, NFAULT = (PORT_D, 7), (PORT_D, 6)
CSN, CE, RADIO_IRQ = (PORT_C, 4), (PORT_C, 3), (PORT_C, 0)
TRANSLATE_SWITCH, ROD_SWITCH, BUTTON = (PORT_B, 3), (PORT_B, 2), (PORT_E, 20)
LAMP = (PORT_E, 30)

STACKED = (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_R12, UC_ARM_REG_LR)


@dataclass(frozen=True)
class Image:
    """A program as the linker wrote it: its bytes from address 0, and where its symbols are."""

    flash: bytes
    symbols: dict[str, int]
    sizes: dict[str, int]


def read_image(elf: Path) -> Image:
    """The loadable parts and the symbols of a 32-bit little-endian ELF file."""
    data = elf.read_bytes()
    program_table, section_table = struct.unpack_from("<2I", data, 28)
    program_entry, program_count, section_entry, section_count = struct.unpack_from("<4H", data, 42)
    flash = bytearray(b"\xff" * 0x10000)
    for index in range(program_count):
        kind, offset, _, physical, size = struct.unpack_from("<5I", data, program_table + program_entry * index)
        if kind == 1 and size and physical < len(flash):
            flash[physical : physical + size] = data[offset : offset + size]
    sections = [struct.unpack_from("<10I", data, section_table + section_entry * each) for each in range(section_count)]
    symbols: dict[str, int] = {}
    sizes: dict[str, int] = {}
    for section in sections:
        if section[1] == 2:
            names = sections[section[6]][4]
            for at in range(section[4], section[4] + section[5], 16):
                name, value, size = struct.unpack_from("<3I", data, at)
                label = data[names + name : data.index(b"\0", names + name)].decode()
                symbols[label], sizes[label] = value & ~1 if data[at + 12] & 0xF == 2 else value, size
    return Image(bytes(flash), symbols, sizes)


class Machine:
    """One node's electronics and mechanics; `switch_at` is where translate closes its switch, if it has one.

    A program that crashes fails the test, unless it `may_crash`: then its fault handler runs.
    """

    def __init__(self, image: Image, *, uid: tuple[int, int, int] = (1, 2, 3), seed: int = 0) -> None:
        self.image = image
        self.flash = bytearray(image.flash)
        self.chip = Kl26(self.flash, uid)
        self.motors = [Motor(), Motor(), Motor()]
        self.boots = 0
        self.watchdog_resets = 0
        self.crashes = 0
        self.may_crash = False
        self.switch_at: float | None = None
        self._random = Random(seed)
        self._radio: Any = None
        self._lamp: deque[tuple[int, int]] = deque(maxlen=64)
        self._edges: list[tuple[int, int, int]] = []
        self._cut: set[int] = set()
        self._motors_next = 0
        self._wants_reset: int | None = None
        self._uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self._uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M0)
        self._map()
        chip = self.chip
        chip.on_pin = self._pin_changed
        chip.on_flash = self._flash_changed
        chip.on_reset = self._ask_reset
        chip.pc = lambda: int(self._uc.reg_read(UC_ARM_REG_PC))
        for pin in (NFAULT, TRANSLATE_SWITCH, ROD_SWITCH, BUTTON, RADIO_IRQ):
            chip.set_pin(*pin, 1)
        self._show_encoders()
        self.power_cycle()

    # Power and wires

    def power_cycle(self) -> None:
        """Power off and on: RAM holds anything, motors lose their drive, the radio forgets."""
        self._uc.mem_write(RAM_BEGIN, self._random.randbytes(RAM_END - RAM_BEGIN))
        if self._radio is not None:
            self._radio.reset()
        for motor in self.motors:
            motor.speed = 0.0
        self.reset(RESET_POWER_ON)

    def reset(self, cause: int) -> None:
        """The reset that `cause` (bits of RCM_SRS0) brings about; RAM stays as it is."""
        self.boots += 1
        self.watchdog_resets += cause == RESET_WATCHDOG
        self.chip.reset(cause)
        if self._radio is not None:
            self._radio.ce = 0
        self._active: list[int] = []
        self._asleep = False
        self._masked_for = 0
        self._uc.mem_write(0, bytes(self.flash))
        self._uc.ctl_flush_tb()  # what was patched in the running program
        stack, start = struct.unpack_from("<2I", self.flash)
        self._uc.reg_write(UC_ARM_REG_PRIMASK, 0)
        self._uc.reg_write(UC_ARM_REG_SP, stack)
        self._uc.reg_write(UC_ARM_REG_PC, start & ~1)
        self._pc = start & ~1

    def write_flash(self, address: int, data: bytes) -> None:
        """What a programmer does to the chip; a reset must follow."""
        self.flash[address : address + len(data)] = data
        self._uc.mem_write(address, bytes(data))

    def connect(self, radio: Any) -> None:
        """Solder a radio on: something with the pins of tests.radio.chip.Chip."""
        self._radio = radio
        self.chip.spi = radio
        radio.on_irq = lambda level: self.chip.set_pin(*RADIO_IRQ, level)
        self.chip.set_pin(*RADIO_IRQ, radio.irq)

    def set_pin(self, pin: tuple[int, int], level: int) -> None:
        """Press a button (0), or let go (1)."""
        self.chip.set_pin(*pin, level)

    def put_ends_at(self, translate: float, bias: float) -> None:
        """Fit a switch for translate and a stop for bias, in counts of the motors as built."""
        self.switch_at = translate
        self.motors[1].low = bias

    def lamp(self) -> int:
        """How often the lamp has gone on in the last pattern: 0 is dark, 255 steady."""
        if not self._lamp or self._lamp[-1][0] < self.now_us - LAMP_WINDOW_US:
            return LAMP_STEADY if self._lamp and self._lamp[-1][1] else 0
        flashes = [when for when, level in self._lamp if level]
        gaps = [later - sooner for sooner, later in pairwise(flashes)]
        pauses = [index for index, gap in enumerate(gaps) if gap > LAMP_PAUSE_US]
        return pauses[-1] - pauses[-2] if len(pauses) > 1 else -1

    def press_button(self, run: Callable[[int], None], us: int) -> None:
        """Hold the button for so long; `run` lets time pass."""
        self.set_pin(BUTTON, 0)
        run(us)
        self.set_pin(BUTTON, 1)

    def cut_encoder(self, axis: int) -> None:
        """Break both channels of an encoder: they stay as they are."""
        self._cut.add(axis)

    @property
    def counts(self) -> tuple[int, ...]:
        """Where the motors truly are."""
        return tuple(int(motor.at // 1) for motor in self.motors)

    @property
    def drivers_on(self) -> bool:
        """Whether the motor drivers are awake."""
        return bool(self.chip.output(*NSLEEP))

    @property
    def now_us(self) -> int:
        """Time since this machine was made."""
        return self.chip.now // CYCLES_PER_US

    def word(self, symbol: str, offset: int = 0) -> int:
        """32 bits of a variable of the program."""
        return int.from_bytes(self._uc.mem_read(self.image.symbols[symbol] + offset, 4), "little")

    def patch(self, symbol: str, code: bytes) -> None:
        """Overwrite the beginning of a function in the running program, not in its flash: a reset mends it."""
        self._uc.mem_write(self.image.symbols[symbol], code)
        self._uc.ctl_flush_tb()

    def stack_used(self) -> int:
        """How deep the stack has been since `paint_stack`."""
        begin, end = self.image.symbols["stack_begin"], self.image.symbols["stack_end"]
        untouched = bytes(self._uc.mem_read(begin, end - begin))
        return len(untouched.lstrip(b"\xa5"))

    def paint_stack(self) -> None:
        """Fill the free part of the stack, to see later how much of it was used."""
        begin = self.image.symbols["stack_begin"]
        self._uc.mem_write(begin, b"\xa5" * max(0, int(self._uc.reg_read(UC_ARM_REG_SP)) - begin))

    # Time

    def run(self, us: int) -> None:
        """Let so much time pass."""
        self.run_to(self.now_us + us)

    def run_to(self, until_us: int) -> None:
        """Let time pass until then."""
        until, chip = until_us * CYCLES_PER_US, self.chip
        while chip.now < until:
            self._events()
            if self._wants_reset is not None:
                cause, self._wants_reset = self._wants_reset, None
                self.reset(cause)
            self._turn(min(until, self._next_event()))

    def quiet_until_us(self) -> int:
        """Nothing that others could notice happens before then, unless they do something: the processor sleeps."""
        return self._next_event() // CYCLES_PER_US if self._asleep and not self._pending() else self.now_us

    def _next_event(self) -> int:
        moments = [self._motors_next]
        if self._edges:
            moments.append(self._edges[0][0])
        if self.chip.systick_next is not None:
            moments.append(self.chip.systick_next)
        if (deadline := self.chip.cop_deadline) is not None:
            moments.append(deadline)
        return max(min(moments), self.chip.now + 1)

    def _events(self) -> None:
        chip = self.chip
        if chip.now >= self._motors_next:
            self._step_motors()
        while self._edges and self._edges[0][0] <= chip.now:
            _, axis, levels = self._edges.pop(0)
            if axis in self._cut:
                continue
            chip.set_pin(PORT_D, 2 * axis, levels & 1)
            chip.set_pin(PORT_D, 2 * axis + 1, levels >> 1)
        if chip.systick_next is not None and chip.systick_next <= chip.now:
            chip.systick_pending = True
            chip.systick_next += chip.systick_period
        if (deadline := chip.cop_deadline) is not None and chip.now >= deadline:
            self._wants_reset = RESET_WATCHDOG

    def _step_motors(self) -> None:
        cycles = STEP_US * CYCLES_PER_US
        self._motors_next = self.chip.now + cycles
        awake = self.drivers_on
        if not awake and not any(motor.speed for motor in self.motors):
            return
        for axis, (motor, (one, two)) in enumerate(zip(self.motors, PWM_PINS, strict=True)):
            duty = self.chip.duty(one) - self.chip.duty(two) if awake else 0.0
            self._edges += [(when, axis, levels) for when, levels in motor.step(duty, self.chip.now, cycles)]
        self._edges.sort()
        if self.switch_at is not None:
            self.set_pin(TRANSLATE_SWITCH, int(self.motors[2].at > self.switch_at))

    def _show_encoders(self) -> None:
        for axis, motor in enumerate(self.motors):
            self.chip.set_pin(PORT_D, 2 * axis, motor.levels & 1)
            self.chip.set_pin(PORT_D, 2 * axis + 1, motor.levels >> 1)

    # The processor

    def _turn(self, until: int) -> None:
        """Run or sleep up to `until`, or to the next point where an interrupt may come in."""
        chip = self.chip
        if chip.stall:
            pause = min(chip.stall, until - chip.now)
            chip.stall -= pause
            chip.now += pause
            return
        pending = self._pending()
        if self._asleep and not pending:
            chip.now = until
            return
        self._asleep = False
        masked = bool(pending) and bool(self._uc.reg_read(UC_ARM_REG_PRIMASK))
        if pending and not masked:
            self._enter_best(pending)
        cycles = until - chip.now
        self._masked_for = self._masked_for + 1 if masked else 0
        if masked:
            cycles = min(cycles, MASKED_SLICE << min(10, self._masked_for // 16))
        elif self._active:
            cycles = min(cycles, TICK_SLICE if self._active[-1] < 0 else PINS_SLICE)
        self._execute(max(1, cycles * 2 // 3))
        chip.now = until if self._asleep and not self._pending() else chip.now + max(1, cycles)

    def _pending(self) -> list[int]:
        pending = [-1] if self.chip.systick_pending else []
        return [*pending, IRQ_PORT_CD] if self.chip.pin_interrupt else pending

    def _enter_best(self, pending: list[int]) -> None:
        irq = min(pending, key=lambda each: (self.chip.priority(each), each))
        if self._active and self.chip.priority(irq) >= self.chip.priority(self._active[-1]):
            return
        if irq < 0:
            self.chip.systick_pending = False
        self._active.append(irq)
        self._enter(15 if irq < 0 else 16 + irq)

    def _enter(self, exception: int) -> None:
        uc = self._uc
        stack = int(uc.reg_read(UC_ARM_REG_SP))
        padding = stack & 4
        stack -= 32 + padding
        status = int(uc.reg_read(UC_ARM_REG_XPSR)) & ~0x200 | 0x01000000 | padding << 7
        frame = [*(int(uc.reg_read(each)) for each in STACKED), self._pc, status]
        uc.mem_write(stack, struct.pack("<8I", *frame))
        uc.reg_write(UC_ARM_REG_SP, stack)
        uc.reg_write(UC_ARM_REG_LR, 0xFFFFFFF9)
        (handler,) = struct.unpack_from("<I", self.flash, 4 * exception)
        self._pc = handler & ~1

    def _leave(self) -> None:
        uc = self._uc
        stack = int(uc.reg_read(UC_ARM_REG_SP))
        *registers, pc, status = struct.unpack("<8I", uc.mem_read(stack, 32))
        for register, value in zip(STACKED, registers, strict=True):
            uc.reg_write(register, value)
        uc.reg_write(UC_ARM_REG_SP, stack + 32 + (status >> 7 & 4))
        uc.reg_write(UC_ARM_REG_XPSR, status & ~0x200)
        self._active.pop()
        self._pc = pc

    def _execute(self, instructions: int) -> None:
        uc = self._uc
        try:
            uc.emu_start(self._pc | 1, NOWHERE, count=instructions)
        except UcError as error:
            self._pc = int(uc.reg_read(UC_ARM_REG_PC)) & ~1
            if error.errno == UC_ERR_EXCEPTION and self._pc == RETURN and self._active:
                self._leave()
            elif self.may_crash:
                self.crashes += 1
                self._enter(HARD_FAULT)
            else:
                raise Strayed(f"{error} at 0x{self._pc:x}") from None
            return
        self._pc = int(uc.reg_read(UC_ARM_REG_PC)) & ~1
        self._asleep = self.flash[self._pc - 2 : self._pc] == WFI and not self._active

    def _map(self) -> None:
        uc, chip = self._uc, self.chip
        uc.mem_map(0, 0x10000)
        uc.mem_map(RAM_BEGIN & ~0xFFF, 0x3000)

        def map_block(base: int, size: int, read: Callable[..., int], write: Callable[..., None]) -> None:
            uc.mmio_map(base, size, lambda _, at, width, __: read(at, width), None, write, None)

        map_block(0x40000000, 0x100000, chip.read, lambda _, at, width, value, __: chip.write(at, width, value))
        map_block(
            0xF8000000,
            0x1000,
            lambda at, _: chip.read_gpio(at),
            lambda _, at, __, value, ___: chip.write_gpio(at, value),
        )
        map_block(
            0xE000E000,
            0x1000,
            lambda at, _: chip.read_system(0xE000 + at),
            lambda _, at, __, value, ___: chip.write_system(0xE000 + at, value),
        )

    # What the blocks tell

    def _pin_changed(self, port: int, pin: int, level: int) -> None:
        if (port, pin) == LAMP:
            self._lamp.append((self.now_us, level))
            return
        if self._radio is not None and (port, pin) == CE:
            self._radio.ce = level
        elif self._radio is not None and (port, pin) == CSN:
            if level:
                self._radio.deselect()
            else:
                self._radio.select()

    def _flash_changed(self, address: int, length: int) -> None:
        if any(abs(motor.speed) > 50 for motor in self.motors):
            raise Strayed("flash is written while a motor turns")
        self._uc.mem_write(address, bytes(self.flash[address : address + length]))

    def _ask_reset(self, cause: int) -> None:
        self._wants_reset = cause
        self._uc.emu_stop()
