"""Nodes with a loader: the image that `make updatable` builds, a program of one sector, and power that is cut in the flash."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from random import Random

from curveline.radio.site.intel_hex import flash_of
from curveline.radio.site.program_file import DESCRIPTION_AT, PROGRAM_AT, NodeProgram, program_in

from .fleet import ChipRadio, Fleet, drive_table
from .image import Image, make, read_image
from .kl26 import RESET_POWER_ON
from .machine import Machine

MARKS_AT = DESCRIPTION_AT + 64
WHOLE, TRIED, KEPT = 60, 61, 62
BLANK = b"\xff" * 4


@dataclass(frozen=True)
class Updatable:
    """What the build wrote."""

    image: Image
    program: NodeProgram
    path: Path


def build_updatable(folder: Path) -> Updatable:
    """The loader with the node program behind it, built into `folder`."""
    done = make(folder, "updatable")
    assert done.returncode == 0, done.stdout + done.stderr
    path = folder / "updatable.hex"
    text = path.read_text()
    program = read_image(folder / "program.elf")
    return Updatable(Image(flash_of(text, str(path)), program.symbols, program.sizes), program_in(text, str(path)), path)


def little_program(seed: int = 1, sectors: int = 1) -> NodeProgram:
    """Vectors, a sleep without end, and noise: it starts, feeds no watchdog and is never heard."""
    vectors = struct.pack("<48I", 0x20000000, *(PROGRAM_AT + 0xC1,) * 47)
    body = vectors + b"\x30\xbf\xfd\xe7"
    size = 1024 * sectors - 100
    return NodeProgram(body + Random(seed).randbytes(size - len(body)), 4, 1)


def mark(machine: Machine, number: int) -> bytes:
    """A mark of the loader, as it is in flash."""
    return bytes(machine.flash[MARKS_AT + 4 * number : MARKS_AT + 4 * number + 4])


def stored(machine: Machine, program: NodeProgram) -> bool:
    """Whether the flash holds a program."""
    return bytes(machine.flash[PROGRAM_AT : PROGRAM_AT + len(program.data)]) == program.data


def node_with(image: Image, *, loss: float = 0.0, seed: int = 1, lacks: tuple[int, ...] = ()) -> tuple[Fleet, ChipRadio]:
    """A node that was flashed by USB, and a host's radio; of the marks in flash some are blank."""
    fleet = Fleet(image, drive_table(1), loss=loss, seed=seed)
    (machine,) = fleet.machines
    for number in lacks:
        machine.write_flash(MARKS_AT + 4 * number, BLANK)
    machine.power_cycle()
    fleet.run(20_000)
    return fleet, ChipRadio(fleet)


class Cutter:
    """Cuts the power in the midst of flash operation `at`, counted from 1 from now on; what that leaves is chance."""

    def __init__(self, machine: Machine, at: int, seed: int) -> None:
        self.count = 0
        self.happened = False
        self._at, self._random = at, Random(seed)
        self._machine, self._chip = machine, machine.chip
        self._carry_out = machine.chip._flash_command
        self._chip._flash_command = self._command  # type: ignore[method-assign]
        self._boots = machine.boots

    def _command(self, bytes_: list[int]) -> None:
        if self.happened and self._machine.boots == self._boots:
            return  # the power is away, and the chip has not noticed yet
        self.count += 1
        if self.count != self._at:
            self._carry_out(bytes_)
            return
        self.happened, self._boots = True, self._machine.boots
        address = bytes_[1] << 16 | bytes_[2] << 8 | bytes_[3]
        length = 1024 if bytes_[0] == 0x09 else 4
        old = bytes(self._machine.flash[address : address + length])
        self._carry_out(bytes_)
        new = bytes(self._machine.flash[address : address + length])
        self._machine.write_flash(address, self._mixed(old, new))
        self._machine._ask_reset(RESET_POWER_ON)

    def _mixed(self, old: bytes, new: bytes) -> bytes:
        """Nothing of it, all of it, or some bits."""
        how = self._random.randrange(3)
        noise = self._random.randbytes(len(old)) if how == 2 else bytes([0xFF * how]) * len(old)
        return bytes(a & ~n & 0xFF | b & n for a, b, n in zip(old, new, noise, strict=True))
