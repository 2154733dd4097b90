"""Which files of tests are begun first where several processes share them: what takes longest."""

from __future__ import annotations

from pathlib import Path

HERE = Path(__file__).parent
LONGEST_FIRST = (
    "cli/test_display.py",
    "firmware/test_conformance.py",
)
"""The first compiles kernels while the others do what needs none."""


def place(path: Path) -> int:
    """The place of a file in that order; those that are not named follow as they come."""
    name = path.relative_to(HERE).as_posix() if path.is_relative_to(HERE) else ""
    return LONGEST_FIRST.index(name) if name in LONGEST_FIRST else len(LONGEST_FIRST)
