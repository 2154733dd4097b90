"""What a frame's tag costs on the node's processor, counted on the program as it is flashed."""

from __future__ import annotations

import struct

from unicorn import UC_ARCH_ARM, UC_HOOK_CODE, UC_MODE_MCLASS, UC_MODE_THUMB, Uc
from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_SP

from curveline.radio.protocol import keys

from .machine import Image

TAG_CYCLES = 8000
STACK_BYTES = 512
RAM, RAM_SIZE = 0x1FFFF000, 0x3000
TOP = 0x20001000
KEYED, KEY, BODY, TAG = 0x20001000, 0x20001040, 0x20001080, 0x200010C0
RETURN = 0x10000
REGISTERS = (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3)


class Core:
    """The processor alone, running one function at a time and counting what it costs."""

    def __init__(self, image: Image) -> None:
        self._image = image
        self._core = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self._core.mem_map(0, len(image.flash) + 0x1000)
        self._core.mem_write(0, image.flash)
        self._core.mem_map(RAM, RAM_SIZE)
        self._core.hook_add(UC_HOOK_CODE, self._count)

    def write(self, address: int, data: bytes) -> None:
        self._core.mem_write(address, data)

    def read(self, address: int, size: int) -> bytes:
        return bytes(self._core.mem_read(address, size))

    def call(self, name: str, *arguments: int) -> None:
        """Call a function; arguments beyond the fourth go to the stack."""
        self.cycles = 0
        self.lowest = TOP
        self._follows: int | None = None
        stack = b"".join(struct.pack("<I", each) for each in arguments[4:])
        for register, value in zip(REGISTERS, arguments, strict=False):
            self._core.reg_write(register, value)
        self._core.mem_write(TOP - 64, stack)
        self._core.reg_write(UC_ARM_REG_SP, TOP - 64)
        self._core.reg_write(UC_ARM_REG_LR, RETURN | 1)
        self._core.emu_start(self._image.symbols[name] | 1, RETURN, count=100_000)

    def _count(self, core: Uc, address: int, size: int, _: object) -> None:
        """Cycles of a Cortex-M0+ on memory without waits: loads and stores take 2, a taken branch 2, the rest 1."""
        code = struct.unpack("<H", core.mem_read(address, 2))[0]
        self.cycles += cycles_of(code, size) + (self._follows not in (None, address))
        self._follows = address + size
        self.lowest = min(self.lowest, core.reg_read(UC_ARM_REG_SP))


def cycles_of(code: int, size: int) -> int:
    """Cycles of a 16-bit instruction that is no taken branch, or of a 32-bit one."""
    if 0x4800 <= code < 0xA000 or size == 4:
        return 2
    if code & 0xF600 == 0xB400:
        return 1 + (code & 0x1FF).bit_count()
    return 1 + (code & 0xFF).bit_count() if code & 0xF000 == 0xC000 else 1


def test_a_tag_on_the_nodes_processor_is_right_and_quick(image: Image) -> None:
    core = Core(image)
    key, body, nonce = bytes(range(16)), bytes(range(100, 124)), 0x1122334455667788
    core.write(KEY, key)
    core.write(BODY, body)
    core.call("cl_tag_key", KEYED, KEY)
    core.call("cl_tag", KEYED, BODY, nonce & 0xFFFFFFFF, nonce >> 32, ord("H"), TAG)
    assert core.read(TAG, keys.TAG_BYTES) == keys.tag(key, body + nonce.to_bytes(8, "little"), keys.FROM_HOST)
    print(f"a tag takes {core.cycles} cycles and {TOP - core.lowest} bytes of stack")
    assert core.cycles <= TAG_CYCLES
    assert TOP - core.lowest <= STACK_BYTES
