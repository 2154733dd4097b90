"""The Cortex-M0+ of a Teensy LC: unicorn runs the instructions, exceptions are stacked by hand.

Unicorn counts instructions, not cycles; one instruction is taken for one and a half cycles, as measured on a cycle-
counting model of the core, and entry and return of an interrupt for what the core's manual says. The processor runs
in slices that end where something is due, so what happens in them is late by a slice at most: 5 us within a handler.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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

from .image import Image
from .kl26 import IRQ_PORT_CD, Kl26, Strayed

RAM_BEGIN, RAM_END = 0x1FFFF800, 0x20001800
RETURN = 0xFFFFFFF8
"""Where a handler's return lands; bit 0 of the link value is cut off."""
NOWHERE = 0xFFFFFFF0
WFI = b"\x30\xbf"
TICK_SLICE = 256
PINS_SLICE = 64
MASKED_SLICE = 16
HARD_FAULT = 3
ENTRY_CYCLES, RETURN_CYCLES = 15, 12

STACKED = (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_R12, UC_ARM_REG_LR)


class Processor:
    """Core and memory; a program that crashes fails the test, unless it `may_crash`: then its fault handler runs."""

    def __init__(self, image: Image, chip: Kl26) -> None:
        self.symbols = image.symbols
        self.crashes = 0
        self.may_crash = False
        self.asleep = False
        self._chip = chip
        self._pc = 0
        self._masked_for = 0
        self._active: list[int] = []
        self._uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self._uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M0)
        self._map()
        chip.pc = lambda: int(self._uc.reg_read(UC_ARM_REG_PC))

    def reset(self) -> None:
        """Begin where the vector table says; RAM stays as it is."""
        self._active = []
        self.asleep = False
        self._masked_for = 0
        self._uc.mem_write(0, bytes(self._chip.flash))
        self._uc.ctl_flush_tb()  # what was patched in the running program
        stack, start = struct.unpack_from("<2I", self._chip.flash)
        self._uc.reg_write(UC_ARM_REG_PRIMASK, 0)
        self._uc.reg_write(UC_ARM_REG_SP, stack)
        self._pc = start & ~1

    def stop(self) -> None:
        """Let the present slice end here."""
        self._uc.emu_stop()

    def write(self, address: int, data: bytes) -> None:
        """Change memory from outside."""
        self._uc.mem_write(address, data)

    @property
    def level(self) -> int:
        """How many handlers are active."""
        return len(self._active)

    def link(self) -> tuple[int, int]:
        """Where the function that begins now will return to, and its stack pointer."""
        return int(self._uc.reg_read(UC_ARM_REG_LR)) & ~1, int(self._uc.reg_read(UC_ARM_REG_SP))

    @contextmanager
    def hooked(self, kind: int, hook: Callable[..., None]) -> Iterator[None]:
        """Call `hook` for all that unicorn's hook of that kind tells of."""
        handle = self._uc.hook_add(kind, hook)
        self._uc.ctl_flush_tb()  # translated code has no hooks
        yield
        self._uc.hook_del(handle)
        self._uc.ctl_flush_tb()

    def word(self, symbol: str, offset: int = 0) -> int:
        """32 bits of a variable of the program."""
        return int.from_bytes(self._uc.mem_read(self.symbols[symbol] + offset, 4), "little")

    def patch(self, symbol: str, code: bytes) -> None:
        """Overwrite the beginning of a function in the running program, not in its flash: a reset mends it."""
        self._uc.mem_write(self.symbols[symbol], code)
        self._uc.ctl_flush_tb()

    def stack_used(self) -> int:
        """How deep the stack has been since `paint_stack`."""
        begin, end = self.symbols["stack_begin"], self.symbols["stack_end"]
        untouched = bytes(self._uc.mem_read(begin, end - begin))
        return len(untouched.lstrip(b"\xa5"))

    def paint_stack(self) -> None:
        """Fill the free part of the stack, to see later how much of it was used."""
        begin = self.symbols["stack_begin"]
        self._uc.mem_write(begin, b"\xa5" * max(0, int(self._uc.reg_read(UC_ARM_REG_SP)) - begin))

    # Running

    def turn(self, until: int) -> None:
        """Run or sleep up to `until`, or to the next point where an interrupt may come in.

        Interrupts come in, too, where the program waits for the radio's bus, but not where it waits for the flash.
        """
        chip, pending = self._chip, self.pending()
        masked = bool(pending) and bool(self._uc.reg_read(UC_ARM_REG_PRIMASK))
        if chip.stall and not self._active and (masked or not pending):
            pause = min(chip.stall, until - chip.now)
            chip.stall -= pause
            chip.now += pause
            return
        if self.asleep and not pending:
            chip.now = until
            return
        self.asleep = False
        if pending and not masked:
            self._enter_best(pending)
        cycles = until - chip.now
        self._masked_for = self._masked_for + 1 if masked else 0
        if masked:
            cycles = min(cycles, MASKED_SLICE << min(10, self._masked_for // 16))
        elif self._active:
            cycles = min(cycles, TICK_SLICE if self._active[-1] < 0 else PINS_SLICE)
        self._execute(max(1, cycles * 2 // 3))
        chip.now = until if self.asleep and not self.pending() else chip.now + max(1, cycles)

    def pending(self) -> list[int]:
        pending = [-1] if self._chip.systick_pending else []
        return [*pending, IRQ_PORT_CD] if self._chip.pin_interrupt else pending

    def _enter_best(self, pending: list[int]) -> None:
        irq = min(pending, key=lambda each: (self._chip.priority(each), each))
        if self._active and self._chip.priority(irq) >= self._chip.priority(self._active[-1]):
            return
        if irq < 0:
            self._chip.systick_pending = False
        self._active.append(irq)
        self._chip.now += ENTRY_CYCLES
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
        (handler,) = struct.unpack_from("<I", self._chip.flash, self._chip.vectors + 4 * exception)
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
        self._chip.now += RETURN_CYCLES
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
        self.asleep = self._chip.flash[self._pc - 2 : self._pc] == WFI and not self._active

    def _map(self) -> None:
        uc, chip = self._uc, self._chip
        uc.mem_map(0, 0x10000)
        uc.mem_map(RAM_BEGIN & ~0xFFF, 0x3000)

        def map_block(base: int, size: int, read: Callable[..., int], write: Callable[..., None]) -> None:
            uc.mmio_map(base, size, lambda _, at, width, __: read(at, width), None, write, None)

        map_block(0x40000000, 0x100000, chip.read, lambda _, at, width, value, __: chip.write(at, width, value))
        map_block(
            0xF0003000,
            0x1000,
            lambda at, _: chip.read_platform(at),
            lambda _, at, __, value, ___: chip.write_platform(at, value),
        )
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
