"""A display with its rails elsewhere: as many nodes as wanted over the same width, as a display file."""

from __future__ import annotations

import os
import tempfile
import tomllib
from dataclasses import replace
from typing import Any, NamedTuple

from curveline.drive_settings import MAX_NODES
from curveline.errors import InvalidInput
from curveline.scene import Display
from curveline.shapes.changed_display import changed_text, text_of
from curveline.shapes.file_keys import LONGEST_NAME
from curveline.shapes.files import read_display
from curveline.shapes.profile_rules import FILE
from curveline.shapes.toml_location import KeyPath
from curveline.units import to_mm

DIGITS = 6
"""Behind the point, of lengths in mm."""
ADDRESSES = 1 << 40


class Respaced(NamedTuple):
    """A display as a file has it, and the text of that file."""

    display: Display
    text: str


def respaced(display: Display, nodes: int) -> Respaced:
    """A display with so many nodes over the same width, equally spaced; limits of length go with the span.

    Comments of its file are kept, and addresses as far as there are nodes; further ones follow the last. InvalidInput
    for a display that is in no file, whose file cannot be changed so, or for a number of nodes that none has.
    """
    if not 2 <= nodes <= MAX_NODES:
        raise InvalidInput(f"a display has 2 to {MAX_NODES} nodes, not {nodes}", "choose a number in that range")
    text = text_of(display)
    part = (display.node_count - 1) / (nodes - 1)
    limits = display.limits.length
    addresses = list(display.radio.addresses[:nodes])
    while len(addresses) < nodes:
        addresses.append(_next(addresses))
    values: dict[KeyPath, Any] = {
        ("name",): f"{display.name[: LONGEST_NAME - 4]}-{nodes}",
        ("nodes",): nodes,
        ("span_mm",): _mm(display.span * part),
        ("limits", "length_mm"): [_mm(limits.low * part), _mm(limits.high * part)],
        ("radio", "addresses"): addresses,
    }
    if FILE in tomllib.loads(text)["rod"]:
        named = os.path.join(os.path.dirname(display.path), tomllib.loads(text)["rod"][FILE])
        values["rod", FILE] = os.path.abspath(named)
    changed = changed_text(text, values, display.path or display.name)
    return Respaced(_read(changed), changed)


def _mm(length: float) -> float:
    return round(to_mm(length), DIGITS)


def _next(addresses: list[str]) -> str:
    """An address that is none of some: the last one and so many more."""
    number = int(addresses[-1], 16)
    while (found := f"{(number := (number + 1) % ADDRESSES):010X}") in addresses:
        pass
    return found


def _read(text: str) -> Display:
    """What is read of such a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "display.toml")
        with open(path, "w", encoding="utf-8", newline="") as stream:
            stream.write(text)
        return replace(read_display(path), path="")
