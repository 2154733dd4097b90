"""Intel HEX: read with suspicion, one sector replaced, all else kept."""

from __future__ import annotations

from random import Random

import pytest

from curveline.errors import InvalidInput
from curveline.radio.protocol.node_settings import node_settings
from curveline.radio.site.intel_hex import SETTINGS_SECTOR, SPARE_SECTOR, with_settings
from hexfile import bytes_of

from .bench import drive_table

SETTINGS = node_settings(bytes(range(1, 17)), drive_table(), 2)
OTHERS = node_settings(bytes(range(2, 18)), drive_table(), 1)


def record(kind: int, address: int, data: bytes) -> str:
    fields = bytes([len(data), address >> 8, address & 255, kind]) + data
    return f":{fields.hex().upper()}{-sum(fields) & 255:02X}\n"


END = record(1, 0, b"")
CODE = record(0, 0, bytes(range(16))) + record(0, 16, b"\xaa\xbb")


def test_settings_are_added_and_all_else_is_kept() -> None:
    merged = with_settings(CODE + END, "node.hex", SETTINGS)
    cells = bytes_of(merged)
    assert {address: cells[address] for address in range(18)} == bytes_of(CODE + END)
    assert bytes(cells[0xF400 + index] for index in range(96)) == SETTINGS.sector()
    assert [cells[address] for address in range(0xF000, 0xF004)] == [0] * 4
    assert len(cells) == 18 + 96 + 4
    assert merged.endswith(END)
    assert merged.count(END) == 1


def test_old_settings_go_even_where_a_record_straddles_the_sector() -> None:
    old = (
        record(0, 0xEFF8, bytes([1] * 16))
        + record(0, 0xF3F8, bytes([2] * 16))
        + record(0, 0xF500, b"\x02")
        + record(0, 0xF7F8, bytes([3] * 16))
    )
    old += record(0, 0xF900, b"\x04\x05")
    cells = bytes_of(with_settings(CODE + old + END, "x", SETTINGS))
    assert [cells[address] for address in range(0xEFF8, 0xF000)] == [1] * 8
    assert [cells[address] for address in range(0xF800, 0xF808)] == [3] * 8
    assert (cells[0xF900], cells[0xF901]) == (4, 5)
    assert {address for address in cells if address in SETTINGS_SECTOR} == {*range(0xF400, 0xF400 + 96)}
    assert {address for address in cells if address in SPARE_SECTOR} == {*range(0xF000, 0xF000 + 4)}
    again = with_settings(with_settings(CODE + old + END, "x", OTHERS), "x", SETTINGS)
    assert bytes_of(again) == cells
    wide = record(0, 0xEFFE, bytes(255)) + record(0, 0xF4FD, bytes(255)) + record(0, 0xF5FC, bytes(255))
    assert len(bytes_of(with_settings(CODE + wide + END, "x", SETTINGS))) == 18 + 2 + 96 + 4


def test_base_addresses_and_start_addresses_are_understood() -> None:
    text = (
        record(4, 0, b"\0\0") + CODE + record(2, 0, b"\x08\0") + record(0, 0x10, b"\x07") + record(5, 0, b"\0\0\1\x95")
    )
    merged = with_settings(text + END, "x", SETTINGS)
    cells = bytes_of(merged)
    assert cells[0x8010] == 7
    assert record(5, 0, b"\0\0\1\x95") in merged


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_lines_may_end_either_way(newline: str) -> None:
    text = (CODE + END).replace("\n", newline)
    assert with_settings(text, "x", SETTINGS) == with_settings(CODE + END, "x", SETTINGS)
    assert with_settings(text.lower(), "x", SETTINGS) == with_settings(CODE + END, "x", SETTINGS)


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("", 1, "no record"),
        ("hello\n" + END, 1, "no record"),
        (CODE + ":00\n" + END, 3, "no record"),
        (CODE + ":0 00000FF\n" + END, 3, "no record"),
        (CODE + ":é0000001FF\n", 3, "no record"),
        (CODE.replace("AABB", "AABC") + END, 2, "checksum"),
        (CODE + record(0, 20, b"\1\2\3").replace(":03", ":02") + END, 3, "checksum"),
        (CODE + record(6, 0, b"") + END, 3, "unknown kind"),
        (CODE + record(4, 0, b"\0") + END, 3, "wrong length"),
        (CODE, 2, "cut"),
        (CODE + END + CODE, 3, "after the end"),
        (CODE + END + END, 3, "after the end"),
        (CODE + record(0, 5, b"\1") + END, 1, "more than once"),
        (CODE + record(4, 0, b"\0\1") + record(0, 0, b"\1") + END, 1, "beyond the 64 kB"),
        (record(0, 16, b"\1") + END, 1, "no image of a node"),
        (END, 1, "no image of a node"),
    ],
)
def test_what_is_no_image_is_refused_by_line_without_quoting_it(text: str, line: int, says: str) -> None:
    with pytest.raises(InvalidInput, match=says) as caught:
        with_settings(text, "node.hex", SETTINGS)
    (found,) = caught.value.diagnostics
    assert (found.line, found.source) == (line, "")


def test_a_count_that_lies_is_refused() -> None:
    fields = bytes([3, 0, 32, 0, 1, 2])
    with pytest.raises(InvalidInput, match="wrong length"):
        with_settings(CODE + f":{fields.hex()}{-sum(fields) & 255:02x}\n" + END, "x", SETTINGS)


def test_no_damage_to_one_character_goes_unseen() -> None:
    good = CODE + END
    random = Random(7)
    for position, letter in enumerate(good):
        other = random.choice([each for each in "0123456789ABCDEF:\n" if each != letter])
        with pytest.raises(InvalidInput):
            with_settings(good[:position] + other + good[position + 1 :], "x", SETTINGS)


def test_a_program_that_would_not_find_its_settings_is_refused() -> None:
    old = record(0, 32, b"..CLN1..")
    with pytest.raises(InvalidInput, match="firmware 3 or before") as caught:
        with_settings(CODE + old + END, "node.hex", SETTINGS)
    assert "make -C firmware" in str(caught.value.hint)
    with_settings(CODE + old + record(0, 48, b"..CLN2..") + END, "node.hex", SETTINGS)
