"""Whose turn it is, of several lines that are driven together.

No line begins before all are fit to: what is refused has moved nothing. Under a limit of current a line takes its share
before a step is released, and gives it back once all of its nodes stand again; the others wait in the order in which
they asked, so that none is passed over for ever.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from curveline.radio.host.actions import Phase
from curveline.radio.host.phases import ENDED, UNCLAIMED

ROUNDING = 1e-9
"""By what part of the limit a sum of currents may exceed it: three times 0.1 A are 0.3 A."""


class Rota:
    """Who may begin and move; lines are numbers from 0, and may be driven by several threads."""

    def __init__(self, currents: Sequence[float], limit: float | None, midway: Iterable[int] = ()) -> None:
        """`currents` [A] are those of the lines while they move, `limit` what all may draw together, None for any.

        Lines that are `midway` in a step have their share from the beginning, since they go on at once.
        """
        self._currents = currents
        self._limit = limit
        self._lock = threading.Lock()
        self._fit: set[int] = set()
        self._moving = set(midway)
        self._waiting: list[int] = []

    def of(self, line: int) -> LineTurns:
        """The turns of one line."""
        return LineTurns(self, line)

    def may_begin(self, line: int) -> bool:
        """Whether all lines, with this one, are fit to begin."""
        with self._lock:
            self._fit.add(line)
            return len(self._fit) == len(self._currents)

    def may_move(self, line: int) -> bool:
        """Whether there is current for this line, which then has it."""
        with self._lock:
            if line in self._moving or self._limit is None:
                self._moving.add(line)
                return True
            if line not in self._waiting:
                self._waiting.append(line)
            if self._waiting[0] != line or not self._is_enough(line, self._limit):
                return False
            self._moving.add(self._waiting.pop(0))
            return True

    def _is_enough(self, line: int, limit: float) -> bool:
        drawn = sum(self._currents[each] for each in self._moving)
        return drawn + self._currents[line] <= limit * (1.0 + ROUNDING)

    def note(self, line: int, phase: Phase, *, is_midway: bool) -> None:
        """Where a line stands now, and whether it is in the midst of a step; its share and place in the row follow."""
        with self._lock:
            if phase is not Phase.STAGING and line in self._waiting:
                self._waiting.remove(line)
            if phase in ENDED or not (is_midway or phase in UNCLAIMED):
                self._moving.discard(line)

    def pass_over(self, line: int) -> None:
        """A line cannot ask at present: its place in the row goes to the next."""
        with self._lock:
            if line in self._waiting:
                self._waiting.remove(line)


@dataclass(frozen=True)
class LineTurns:
    """See Turns; those of one line of a rota."""

    rota: Rota
    line: int

    def may_begin(self) -> bool:
        """See Turns."""
        return self.rota.may_begin(self.line)

    def may_move(self) -> bool:
        """See Turns."""
        return self.rota.may_move(self.line)
