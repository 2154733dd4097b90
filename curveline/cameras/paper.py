"""Sizes of paper."""

from __future__ import annotations

from enum import StrEnum


class Paper(StrEnum):
    """What a board can be printed on."""

    A4 = "a4"
    A3 = "a3"
    LETTER = "letter"


SIZES = {Paper.A4: (210.0, 297.0), Paper.A3: (297.0, 420.0), Paper.LETTER: (215.9, 279.4)}
"""Width and height [mm]."""
