"""Pages to print to scale: filled boxes and a little text in mm, as SVG or as PDF.

What touches within one shape is drawn as one, so that no printer leaves a hair of white between two black squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple
from xml.sax.saxutils import escape

POINTS = 72.0 / 25.4
"""Of a PDF page in a mm."""


class PrintedBox(NamedTuple):
    """A rectangle [mm] from the upper left corner of the page."""

    x: float  # [mm] of its left side
    y: float  # [mm] of its upper side
    width: float  # [mm]
    height: float  # [mm]


@dataclass(frozen=True)
class Ink:
    """Boxes that are filled as one."""

    boxes: tuple[PrintedBox, ...]  # which may touch
    grey: float = 0.0  # 0 black, 1 white


@dataclass(frozen=True)
class Words:
    """A line of text."""

    x: float  # [mm] where it begins
    y: float  # [mm] of its foot
    size: float  # [mm] of the letters
    text: str  # in letters of Western Europe


@dataclass(frozen=True)
class PrintedPage:
    """A page, and what to call its file."""

    name: str  # what is added to the name of its file
    width: float  # [mm]
    height: float  # [mm]
    inks: tuple[Ink, ...]  # in the order in which they are printed
    words: tuple[Words, ...] = ()  # over them


def to_svg(page: PrintedPage) -> bytes:
    """A page as an SVG drawing whose unit is the mm."""
    size = f'width="{_number(page.width)}mm" height="{_number(page.height)}mm"'
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {_number(page.width)} {_number(page.height)}">',
        f"<title>{escape(page.name)}</title>",
        f'<path fill="white" d="{_path([PrintedBox(0.0, 0.0, page.width, page.height)])}"/>',
    ]
    for ink in page.inks:
        level = round(255 * ink.grey)
        lines.append(f'<path fill="rgb({level},{level},{level})" d="{_path(ink.boxes)}"/>')
    for each in page.words:
        place = f'x="{_number(each.x)}" y="{_number(each.y)}" font-size="{_number(each.size)}"'
        lines.append(f'<text {place} font-family="Helvetica, Arial, sans-serif">{escape(each.text)}</text>')
    return "\n".join([*lines, "</svg>", ""]).encode()


def to_pdf(pages: Sequence[PrintedPage]) -> bytes:
    """Pages as a PDF document that asks to be printed in its own size."""
    numbers = [4 + 2 * index for index in range(len(pages))]
    kids = " ".join(f"{number} 0 R" for number in numbers)
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Count {len(pages)} /Kids [{kids}] >>".encode(),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
    ]
    for number, page in zip(numbers, pages, strict=True):
        box = f"[0 0 {page.width * POINTS:.4f} {page.height * POINTS:.4f}]"
        about = f"/Type /Page /Parent 2 0 R /MediaBox {box} /Resources << /Font << /F 3 0 R >> >>"
        content = _content(page)
        objects.append(f"<< {about} /Contents {number + 1} 0 R >>".encode())
        objects.append(b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content))
    return _document(objects)


def _document(objects: Sequence[bytes]) -> bytes:
    data, offsets = b"%PDF-1.7\n", []
    for number, each in enumerate(objects, start=1):
        offsets.append(len(data))
        data += b"%d 0 obj\n%s\nendobj\n" % (number, each)
    table = b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
    count = len(objects) + 1
    end = b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (count, len(data))
    return data + b"xref\n0 %d\n0000000000 65535 f \n%s%s" % (count, table, end)


def _content(page: PrintedPage) -> bytes:
    """What is on a page, in mm from its upper left corner; letters would stand on their heads there."""
    lines = [f"{POINTS:.10f} 0 0 {-POINTS:.10f} 0 {page.height * POINTS:.6f} cm"]
    for ink in page.inks:
        boxes = (
            f"{_number(x)} {_number(y)} {_number(width)} {_number(height)} re" for x, y, width, height in ink.boxes
        )
        lines.append(f"{_number(ink.grey)} g {' '.join(boxes)} f")
    for each in page.words:
        text = each.text.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")
        at = f"1 0 0 -1 {_number(each.x)} {_number(each.y)} Tm"
        lines.append(f"0 g BT /F {_number(each.size)} Tf {at} ({text}) Tj ET")
    return "\n".join(lines).encode("latin-1", "replace")


def _path(boxes: Sequence[PrintedBox]) -> str:
    return " ".join(
        f"M{_number(box.x)} {_number(box.y)}h{_number(box.width)}v{_number(box.height)}h{_number(-box.width)}z"
        for box in boxes
    )


def _number(value: float) -> str:
    """To a tenth of a micrometre, as short as it goes."""
    return f"{value:.4f}".rstrip("0").rstrip(".")
