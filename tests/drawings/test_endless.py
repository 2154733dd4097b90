"""Small files that would take forever, or all memory, are refused soon."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from drawings.curves import refusal
from drawings.test_svg import svg

Write = Callable[[str, str | bytes], Path]

ARCS = "".join(f"A{90000 + k} 90000 0 1 {k % 2} {k % 9} 5" for k in range(3000))
FEW = ARCS[: ARCS.index("A90005")]
BULGES = "".join(f"0\nVERTEX\n8\n0\n10\n{k % 2 * 90000}\n20\n{k}\n42\n{1 + k % 3}\n" for k in range(3000))
POLYLINE = f"0\nSECTION\n2\nENTITIES\n0\nPOLYLINE\n8\n0\n66\n1\n70\n0\n{BULGES}0\nSEQEND\n8\n0\n0\nENDSEC\n0\nEOF\n"


@pytest.mark.parametrize(
    ("name", "text", "code", "how"),
    [
        ("a.svg", svg(f'<path d="M0 0{ARCS}"/>'), "damaged", {}),
        ("a.svg", svg("".join(f'<path d="M{k} 0{FEW}"/>' for k in range(200))), "too-large", {}),
        ("a.svg", svg(f'<path transform="{"rotate(1)" * 5000}" d="M0 0h1"/>'), "damaged", {}),
        ("a.svg", svg(f'<line x1="{"1" * 200_000}x"/>'), "damaged", {}),
        ("a.svg", svg(f"<style>{'a' * 200_000}</style>"), "no-curve", {}),
        ("a.svg", svg('<path d="M0 0h1"/>', f'width="{"1" * 200_000}x"'), "no-unit", {}),
        ("a.dxf", POLYLINE, "damaged", {"unit": "mm"}),
        ("a.csv", "x_mm,y_mm\n" + "1," * 20_000, "too-large", {}),
    ],
    ids=["arcs", "paths", "transform", "length", "style", "width", "bulges", "line"],
)
def test_a_small_file_that_asks_for_much(name: str, text: str, code: str, how: dict[str, object], write: Write) -> None:
    path = write(name, text)
    begin = time.process_time()
    assert refusal(path, **how)[0] == code
    assert time.process_time() - begin < 10.0
