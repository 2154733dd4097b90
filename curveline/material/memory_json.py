"""The memory of a rod as JSON: what a record keeps of it, and what is made of it again, if it is whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from curveline.errors import InvalidInput
from curveline.material.memory import MOST_BEND, MOST_PLACES, RodMemory
from curveline.material.relaxation import MOST_TERMS, Relaxation
from curveline.system.json_records import Decoder
from curveline.units import mm, to_mm

VERSION = 1
DIGITS = 9
"""Significant ones of a bend: far beyond what is known of a rod, in half of the characters."""
MOST_BENDS = 1_000_000
"""Numbers that a memory may have."""
AGAIN = "begin again with a rod that remembers nothing, or say what shapes it was held in"


@dataclass(frozen=True)
class _Stored:
    """A memory as JSON has it."""

    version: int
    total_length_mm: float
    times_s: tuple[float, ...]
    bends_per_m: tuple[tuple[float, ...], ...]


def memory_document(memory: RodMemory) -> dict[str, Any]:
    """A memory as plain data; the fractions of its law are those of the display file, which may be measured anew."""
    rounded = [[float(f"{bend:.{DIGITS}g}") for bend in row] for row in memory.bends.tolist()]
    return {
        "version": VERSION,
        "total_length_mm": to_mm(memory.total_length),
        "times_s": list(memory.law.times),
        "bends_per_m": rounded,
    }


def memory_from(document: Any, law: Relaxation, total_length: float) -> RodMemory:
    """The memory that a document holds, of a rod with this law and length [m].

    InvalidInput for anything else: another version, a rod of another length or other times, sizes that do not fit,
    numbers that are none.
    """
    version = document.get("version") if isinstance(document, dict) else None
    if isinstance(version, int) and not isinstance(version, bool) and version != VERSION:
        _refuse(f"it is of version {version}, and this curveline knows {VERSION}", "take the curveline that wrote it")
    _refuse_enormous(document)
    decoder = Decoder()
    stored: _Stored = decoder.decode(_Stored, document, "")
    if decoder.problems:
        _refuse(decoder.problems[0][1], AGAIN)
    if stored.times_s != law.times:
        _refuse("its times are not those of the rod's law", f"the display file has another law now: {AGAIN}")
    if abs(mm(stored.total_length_mm) - total_length) > 1e-9 * total_length:
        there, here = to_mm(total_length), stored.total_length_mm
        _refuse(f"it is of a rod of {here:g} mm, and this one has {there:g} mm", f"for another rod, {AGAIN}")
    rows = stored.bends_per_m
    if len(rows) != len(law.times) or len({len(row) for row in rows}) != 1 or not 2 <= len(rows[0]) <= MOST_PLACES:
        _refuse(f"bends_per_m needs {len(law.times)} rows of the same length", AGAIN)
    bends = np.array(rows)
    if not np.all(np.abs(bends) <= MOST_BEND):
        _refuse("bends_per_m has a bend that no rod has", AGAIN)
    return RodMemory(law, total_length, bends)


def _refuse_enormous(document: Any) -> None:
    """Refuse what would take long to look through."""
    rows = document.get("bends_per_m") if isinstance(document, dict) else None
    if not isinstance(rows, list):
        return
    if len(rows) > MOST_TERMS or sum(len(row) for row in rows if isinstance(row, list)) > MOST_BENDS:
        _refuse(f"bends_per_m has more than {MOST_TERMS} rows or {MOST_BENDS:,} numbers", AGAIN)


def _refuse(why: str, hint: str) -> NoReturn:
    raise InvalidInput(f"this is no memory of the rod: {why}", hint)
