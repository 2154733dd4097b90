"""Whom a command asks over the radio."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from curveline.plan_file import DriveSettings


class Asked(NamedTuple):
    """Whom to ask, and how."""

    spec: str
    display: str
    drive: DriveSettings
    runs: Path
