"""Prints how much flash and RAM a program for the Teensy LC takes; fails if it is more than allowed."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

RAM_BEGIN = 0x1FFFF800
ALLOCATED = 2
NO_BITS = 8


def sections(elf: bytes) -> dict[str, tuple[int, int, int, int]]:
    """Name -> (type, flags, address, size) of the sections of a 32-bit little-endian ELF file."""
    (table,) = struct.unpack_from("<I", elf, 32)
    entry, count, names = struct.unpack_from("<3H", elf, 46)
    rows = [struct.unpack_from("<10I", elf, table + entry * index) for index in range(count)]
    begin = rows[names][4]
    return {elf[begin + row[0] :].split(b"\0", 1)[0].decode(): (row[1], row[2], row[3], row[5]) for row in rows}


def main(path: str, flash_limit: str, ram_limit: str) -> int:
    """Print the sizes; 1 if one of them is beyond its limit."""
    flash = ram = stack = 0
    for name, (kind, flags, address, size) in sections(Path(path).read_bytes()).items():
        if not flags & ALLOCATED:
            continue
        flash += size if kind != NO_BITS else 0
        ram += size if address >= RAM_BEGIN else 0
        stack += size if name == ".stack" else 0
    print(
        f"flash {flash} of {flash_limit} bytes; RAM {ram} of {ram_limit} bytes, {stack} of them reserved for the stack"
    )
    limits = (("flash", flash, int(flash_limit)), ("RAM", ram, int(ram_limit)))
    beyond = [f"{what} {used - limit} bytes beyond its limit" for what, used, limit in limits if used > limit]
    if beyond:
        print(f"{path}: {', '.join(beyond)}", file=sys.stderr)
    return int(bool(beyond))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
