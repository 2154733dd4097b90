"""Damaged files never end in a traceback: they are read, or refused with what to do."""

from __future__ import annotations

import contextlib
import io
import random
import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from PIL import Image

from campaign import only
from curveline.drawings.drawing import Drawing
from curveline.drawings.placing import Placing, placed
from curveline.drawings.reading import read_drawing
from curveline.drawings.sketch import HowToRead
from curveline.errors import CurvelineError, InvalidInput
from drawings.test_svg import FIGMA, ILLUSTRATOR, INKSCAPE, SEVERAL, svg

AT_ONCE = 50
EACH_TIME = 2
ALL = 40
LONGEST_S = 20.0

ODD = [b"nan", b"inf", b"-1", b"0", b"1e308", b"-1e-308", b"1e999", b"", b"9" * 400, b"0x5", b"-", b".", b"e5", b"\xff",
       b"\0", b"&b;", b"%", b",", b"z", b"'", b'"', b"<", b"100000000000", b"none", b"\xe2\x88\x92"]  # fmt: skip


def dxf_text() -> bytes:
    """A DXF file with entities of all kinds that are read, and some that are not."""
    document = ezdxf.new("R2010", units=4)
    space = document.modelspace()
    space.add_line((0, 0), (100, 0))
    space.add_lwpolyline([(100, 0, 0, 0, 0.4), (200, 0, 0, 0, 0), (300, 0)])
    space.add_polyline2d([(300, 0, -0.2), (350, 0, 0)], format="xyb")
    space.add_open_spline([(350, 0), (380, 50), (390, -40), (400, 0)])
    space.add_rational_spline([(400, 0), (425, 25), (450, 0)], [1, 2, 1], degree=2)
    space.add_arc((475, 0), 25, 0, 180, dxfattribs={"layer": "roof"})
    space.add_ellipse((550, 0), (50, 0), 0.4, 0.0, np.pi)
    space.add_polyline3d([(600, 0, 1), (700, 0, 1)])
    space.add_text("hill")
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode()


def picture(kind: str, mode: str = "L") -> bytes:
    rows, columns = np.mgrid[0:60, 0:90]
    values = np.where(rows > 30 - 20 * np.sin(columns / 30), 20, 230).astype(np.uint8)
    stream = io.BytesIO()
    Image.fromarray(values).convert(mode).save(stream, kind, dpi=(254, 254))
    return stream.getvalue()


TABLE = b"curve,x_mm,y_mm\nroof,0,1.5\nroof,250,60\nhill,1,1\nroof,500,1.5\nhill,4,4\n"
SHAPES = """<style>.a{display:none} .b,.c{fill:red}</style><g transform="rotate(5) translate(3,4) scale(1,-1)">
<polyline points="0,150 100,50"/><rect x="1" y="2" width="30" height="20" rx="4"/><ellipse cx="5" cy="6" rx="7" ry="3"/>
<svg x="1" y="2" width="30" height="20" viewBox="0 0 3 2"><path id="p" d="M0 0A5 4 30 1 0 3 1S5 5 6 1T8 8Z"/></svg></g>
<symbol id="s"><line x1="1" y1="2cm" x2="3" y2="4"/></symbol><use href="#s" x="5"/><use href="#p"/>"""

WHOLE: dict[str, list[bytes]] = {
    "csv": [TABLE, b"x_mm;y_mm\n0;0,15\n25;6\n50;0,15\n", b'y,"x"\n1.5,"0"\n60,"250"\n'],
    "svg": [
        INKSCAPE.encode(),
        ILLUSTRATOR.replace(b"SIZE", b'width="1500pt" height="400pt"'),
        FIGMA.encode(),
        svg(SEVERAL).encode(),
        svg(SHAPES).encode(),
    ],
    "dxf": [dxf_text()],
    "png": [picture("PNG"), picture("PNG", "P"), picture("PNG", "RGBA"), picture("PNG", "1"), picture("PNG", "I;16")],
    "jpg": [picture("JPEG"), picture("JPEG", "RGB"), picture("JPEG", "CMYK")],
}
HOW = [
    HowToRead(),
    HowToRead(unit="px"),
    HowToRead(width_mm=500.0),
    HowToRead(curve="roof"),
    HowToRead(curve="polyline 1"),
    HowToRead(edge="upper"),
    HowToRead(curve="hill", edge="lower"),
    HowToRead(width_mm=500.0, edge="lower"),
]


def damaged(data: bytes, chance: random.Random) -> bytes:
    """A file with up to six faults of the kinds that copying, editing and attacking make.

    Of what a DXF file has besides its lines it is seldom that anything is damaged.
    """
    begin = data.find(b"ENTITIES\n") + 9
    if begin > 9 and chance.random() < 0.8:
        end = data.index(b"ENDSEC", begin)
        return data[:begin] + damaged(data[begin:end], chance) + data[end:]
    for _ in range(chance.choice([1, 1, 2, 3, 6])):
        at, end = sorted(chance.randrange(len(data) + 1) for _ in range(2))
        end = min(end, at + chance.choice([1, 4, 30, 3000]))
        match chance.randrange(20):
            case 0:
                data = data[:at]
            case 1 | 2:
                data = data[:at] + data[end:]
            case 3 | 4:
                data = data[:end] + data[at:]
            case 5:
                data = data[:at] + chance.randbytes(end - at) + data[end:]
            case 6 | 7 if at < len(data):
                data = data[:at] + bytes([data[at] ^ 1 << chance.randrange(8)]) + data[at + 1 :]
            case 8 | 9:
                data = data[:at] + chance.choice(ODD) + data[at:]
            case _:
                data = odd_number(data, chance)
        if not data:
            break
    return data


def odd_number(data: bytes, chance: random.Random) -> bytes:
    """One word of a text is another one: mostly a number."""
    separators = b" ,\n\"'();<>=\t"
    starts = [k + 1 for k in range(len(data) - 1) if data[k] in separators and data[k + 1] not in separators]
    if not starts:
        return data
    begin = chance.choice(starts)
    end = next((k for k in range(begin, len(data)) if data[k] in separators), len(data))
    return data[:begin] + chance.choice(ODD) + data[end:]


def healed(data: bytes) -> bytes:
    """A damaged PNG whose check sums are right, so that what is damaged is looked at."""
    out, at = data[:8], 8
    while at + 12 <= len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        body = data[at + 4 : at + 8 + size]
        out += struct.pack(">I", max(0, len(body) - 4)) + body + struct.pack(">I", zlib.crc32(body))
        at += 12 + size
    return out


def parameters() -> list[Any]:
    rows = [(kind, seed) for kind in WHOLE for seed in range(ALL)]
    return [row for row in rows if row[1] < EACH_TIME] + only(row for row in rows if row[1] >= EACH_TIME)


@pytest.mark.parametrize(("kind", "seed"), parameters())
def test_damaged_files_are_read_or_refused(kind: str, seed: int, tmp_path: Path) -> None:
    chance = random.Random(f"{kind} {seed}")
    path = tmp_path / f"curve.{kind}"
    read = 0
    for _ in range(AT_ONCE):
        data = damaged(chance.choice(WHOLE[kind]), chance)
        data = healed(data) if kind == "png" and chance.random() < 0.7 else data
        path.write_bytes(data)
        begin = time.process_time()
        read += is_read(path, chance.choice(HOW))
        assert time.process_time() - begin < LONGEST_S
    assert read < AT_ONCE


def is_read(path: Path, how: HowToRead) -> bool:
    """True for a file that is read, False for one that is refused as it should be."""
    drawing: Drawing | InvalidInput
    try:
        drawing = read_drawing(path, how)
    except InvalidInput as error:
        drawing = error
    if isinstance(drawing, InvalidInput):
        assert drawing.message
        assert drawing.hint
        assert drawing.diagnostics
        return False
    assert np.isfinite(drawing.points).all()
    assert drawing.understood
    with contextlib.suppress(CurvelineError):
        placed(drawing, Placing(scale="width"), 0.5)
    return True


@pytest.mark.parametrize("kind", list(WHOLE))
def test_what_is_damaged_was_whole(kind: str, tmp_path: Path) -> None:
    def is_known(data: bytes, how: HowToRead) -> bool:
        path = tmp_path / f"curve.{kind}"
        path.write_bytes(data)
        return is_read(path, how)

    check: Callable[[bytes], bool] = lambda data: any(is_known(data, how) for how in HOW)  # noqa: E731
    assert all(map(check, WHOLE[kind]))
