"""Nodes with a loader: the image that `make updatable` builds, and a program of one sector."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from random import Random

from curveline.radio.site.intel_hex import flash_of
from curveline.radio.site.program_file import DESCRIPTION_AT, PROGRAM_AT, NodeProgram, program_in

from .fleet import ChipRadio, Fleet, drive_table
from .image import Image, make, read_image
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
    return Updatable(
        Image(flash_of(text, str(path)), program.symbols, program.sizes), program_in(text, str(path)), path
    )


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


def node_with(
    image: Image, *, loss: float = 0.0, seed: int = 1, lacks: tuple[int, ...] = ()
) -> tuple[Fleet, ChipRadio]:
    """A node that was flashed by USB, and a host's radio; of the marks in flash some are blank."""
    fleet = Fleet(image, drive_table(1), loss=loss, seed=seed)
    (machine,) = fleet.machines
    for number in lacks:
        machine.write_flash(MARKS_AT + 4 * number, BLANK)
    machine.power_cycle()
    fleet.run(20_000)
    return fleet, ChipRadio(fleet)
