"""Counts the cycles that the node program takes for a tag, a frame, a control step, an encoder edge.

Every instruction is charged what ARM's manual of the core says, with memory that never waits: one cycle, two for a load
or store and for a taken branch, three for a call, one and one per register for several registers. Flash that runs at
half the core's clock adds to that; how much only the chip itself can tell.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from unicorn import UC_HOOK_CODE

from .machine import Machine

FUNCTIONS = {
    "cl_tag": "tag of a frame",
    "cl_node_receive": "frame taken and answered",
    "tick_handler": "control step, 1 kHz",
    "pins_handler": "encoder interrupt",
}
"""What is counted: functions of the program, interrupts that come in between not included."""
EXCEPTION_CYCLES = {"tick_handler": 15 + 12, "pins_handler": 15 + 12}
"""Entry and return of an interrupt."""


@dataclass
class Count:
    """How many cycles the calls of a function took."""

    calls: int = 0
    total: int = 0
    most: int = 0

    def add(self, cycles: int) -> None:
        """One more call."""
        self.calls += 1
        self.total += cycles
        self.most = max(self.most, cycles)

    @property
    def mean(self) -> float:
        """Cycles per call."""
        return self.total / self.calls if self.calls else 0.0


@dataclass
class _Call:
    name: str
    level: int
    back: int
    stack: int
    cycles: int


@dataclass
class Meter:
    """Listens to a machine and keeps the counts."""

    machine: Machine
    counts: dict[str, Count] = field(default_factory=lambda: {name: Count() for name in FUNCTIONS})
    total: int = 0
    _calls: list[_Call] = field(default_factory=list)
    _last: tuple[int, int, int] | None = None

    def __post_init__(self) -> None:
        symbols = self.machine.image.symbols
        self._names = {symbols[name]: name for name in FUNCTIONS}

    def step(self, _: Any, address: int, size: int, __: Any) -> None:
        """An instruction is about to run: the one before is paid for, calls begin and end."""
        level = self.machine.cpu.level
        if self._last is not None:
            self._pay(*self._last, address if level == self._last[2] else -1)
        code = int.from_bytes(self.machine.flash[address : address + 2], "little") if address < 0x10000 else 0
        self._last = (address, code if size == 2 else code | 1 << 16, level)
        name = self._names.get(address)
        self._end_calls(address, level, name)
        if name is not None:
            back, stack = self.machine.cpu.link()
            self._calls.append(_Call(name, level, back, stack, EXCEPTION_CYCLES.get(name, 0)))

    def _pay(self, address: int, code: int, level: int, following: int) -> None:
        cycles = cost(code, taken=following not in (address + 2, address + 4, -1))
        self.total += cycles
        for call in self._calls:
            if call.level == level:
                call.cycles += cycles

    def _end_calls(self, address: int, level: int, begins: str | None) -> None:
        """See which calls are over; where a handler begins, one of the same level has just ended."""
        while self._calls:
            call = self._calls[-1]
            chained = call.name in EXCEPTION_CYCLES and begins in EXCEPTION_CYCLES
            returned = address == call.back or chained
            if level > call.level or (level == call.level and not returned):
                return
            self._calls.pop()
            self.counts[call.name].add(call.cycles)


def cost(code: int, *, taken: bool) -> int:
    """Cycles of an instruction: its first half-word, with bit 16 set for one of two half-words."""
    if code >> 16:
        return 3  # a call, or a barrier
    top = code >> 12
    if top == 0xB and code >> 9 & 3 == 2:  # push, pop
        count = bin(code & 0x1FF).count("1")
        return count + 1 + (2 if code & 0x0900 == 0x0900 else 0)
    if top == 0xC:
        return 1 + bin(code & 0xFF).count("1")
    if top in (5, 6, 7, 8, 9) or code >> 11 == 0b01001:
        return 2
    return 2 if taken else 1


@contextmanager
def metered(machine: Machine) -> Iterator[Meter]:
    """Count what a machine does meanwhile; much slower than letting it run."""
    meter = Meter(machine)
    with machine.cpu.hooked(UC_HOOK_CODE, meter.step):
        yield meter


def describe(meter: Meter) -> str:
    """The counts as lines for a person."""
    lines = []
    for name, what in FUNCTIONS.items():
        count = meter.counts[name]
        us = count.most / 48
        lines.append(
            f"{what}: {count.mean:.0f} cycles on average, {count.most} at most ({us:.0f} us), {count.calls} calls"
        )
    return "\n".join(lines)
