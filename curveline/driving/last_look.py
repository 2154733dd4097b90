"""What a camera saw after a run, by the record of that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from curveline.radio.host.journal import LOOK


def seen_last(records: Sequence[Mapping[str, Any]], segments: int) -> tuple[str, ...] | None:
    """The states that the last look at a display told by the records of a run, "" where it did not; None without one.

    What is in a record is checked: anything odd tells nothing.
    """
    looks = [record for record in records if record.get("type") == LOOK]
    if not looks:
        return None
    states = looks[-1].get("states")
    if not isinstance(states, list) or len(states) != segments or not all(isinstance(each, str) for each in states):
        return ("",) * segments
    return tuple(states)
