"""The folders of runs: named by a number that only grows, so that their order outlives a clock that was set back.

A name is `NUMBER-DATE-TIME-LABEL`. Earlier releases gave no number: such runs come first, in the order of their names.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

NUMBERED = re.compile(r"([0-9]{6,})-[0-9]{8}-[0-9]{6}-")
UNNUMBERED = re.compile(r"[0-9]{8}-[0-9]{6}-")
CLAIM = re.compile(r"\.claim-([0-9]{6,})")


def number_of(name: str) -> int:
    """The number in the name of a run's folder, from 1; 0 if it has none."""
    found = NUMBERED.match(name)
    return int(found[1]) if found else 0


def run_names(runs: Path) -> list[str]:
    """Names of all that is named like a run in the runs folder, the newest first."""
    return sorted(filter(_is_run, _entries(runs)), key=_rank, reverse=True)


def folder_names(runs: Path, file: str) -> list[str]:
    """As `run_names`, and the folders of other names that hold `file`."""
    names = (name for name in _entries(runs) if _is_run(name) or os.path.lexists(runs / name / file))
    return sorted(names, key=_rank, reverse=True)


def claim_folder(runs: Path, name: str) -> Path:
    """Make the folder of a new run, with a larger number than all others; OSError if it cannot be made."""
    runs.mkdir(parents=True, exist_ok=True)
    while True:
        number = 1 + max(_taken(runs), default=0)
        claim = runs / f".claim-{number:06}"
        try:
            claim.mkdir()
        except FileExistsError:
            continue
        # Another process may have claimed this number, and made its folder, since the numbers were read.
        if max(map(number_of, _entries(runs)), default=0) >= number:
            claim.rmdir()
            continue
        return claim.rename(runs / f"{number:06}-{name}")


def _taken(runs: Path) -> Iterator[int]:
    for name in _entries(runs):
        claim = CLAIM.fullmatch(name)
        yield int(claim[1]) if claim else number_of(name)


def _entries(runs: Path) -> list[str]:
    """Names of all folders in the runs folder."""
    try:
        with os.scandir(runs) as entries:
            return [entry.name for entry in entries if entry.is_dir()]
    except (OSError, ValueError):  # ValueError: a zero character in its name
        return []


def _is_run(name: str) -> bool:
    return bool(NUMBERED.match(name) or UNNUMBERED.match(name))


def _rank(name: str) -> tuple[int, str]:
    return number_of(name), name
