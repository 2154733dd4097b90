"""Builds the node program the way a lab does, with `make`, and reads what came out."""

from __future__ import annotations

import struct
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from .build import FIRMWARE, compiler_environment

BUILD_LIMIT_S = 300
FLASH_BYTES = 0x10000


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
    flash = bytearray(b"\xff" * FLASH_BYTES)
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


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run make in `firmware/` with products in `folder`."""
    command = ["make", "-j2", "-C", str(FIRMWARE), f"PYTHON={sys.executable}", f"BUILD={folder}", *arguments]
    return subprocess.run(
        command, env=compiler_environment(), capture_output=True, text=True, check=False, timeout=BUILD_LIMIT_S
    )


def build_image(folder: Path) -> Image:
    """The node program, built into `folder`."""
    done = make(folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return read_image(folder / "node.elf")
