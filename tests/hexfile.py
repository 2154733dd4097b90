"""What a program's hex file puts into flash, read without the code that writes such files."""

from __future__ import annotations


def bytes_of(text: str) -> dict[int, int]:
    """Byte at every address of an Intel HEX file that stays below 64 kB."""
    cells: dict[int, int] = {}
    for line in text.split():
        record = bytes.fromhex(line.removeprefix(":"))
        count, at, kind, data = record[0], int.from_bytes(record[1:3], "big"), record[3], record[4:-1]
        assert sum(record) & 0xFF == 0, line
        assert count == len(data), line
        assert kind in (0, 1, 3, 5) or (kind == 4 and not any(data)), line
        if kind == 0:
            cells.update(enumerate(data, start=at))
    return cells
