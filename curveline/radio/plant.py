"""Motors and encoders of a node: the seam through which a node moves, and the model that the mock display uses."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from typing import Protocol

from curveline.radio.frames import Counts, Fault
from curveline.radio.motion import Move

PER_MILLE = 1000
STALL_MS = 200
"""How long an axis may stand still against its command before a node calls it a stall."""


@dataclass(frozen=True)
class PlantFault:
    """What goes wrong with an axis (from 1), and when."""

    at_ms: int
    fault: Fault
    axis: int


class Plant(Protocol):
    """What a node needs of its motors and encoders."""

    def follow(self, now_ms: int, start_ms: int, move: Move) -> None:
        """From now on track the set-points of `move`, which began at `start_ms`."""
        ...

    def positions(self, now_ms: int) -> Counts:
        """Encoder counts now."""
        ...

    def settles_ms(self) -> int | None:
        """When all axes will be at rest, None if the present move will never end by itself."""
        ...

    def fault(self) -> PlantFault | None:
        """The fault that the present move will run into."""
        ...


@dataclass(frozen=True)
class _AxisRun:
    """One axis following a move at `pace` thousandths of the commanded one, stuck from `stuck_ms` of it on."""

    move: Move
    pace: int
    stuck_ms: int | None = None

    def progress(self, elapsed_ms: int) -> int:
        """Where in the move's own time the axis is."""
        at_ms = elapsed_ms * self.pace // PER_MILLE
        return at_ms if self.stuck_ms is None else min(at_ms, self.stuck_ms)

    def braked(self, elapsed_ms: int) -> _AxisRun:
        """The axis slowing down from where it is, which is behind its command if it is slow; a stuck one stays."""
        return replace(self, move=self.move.braked(self.progress(elapsed_ms)))

    def needs_ms(self) -> int | None:
        """How long after its start the axis comes to rest, None if it is stuck short of the end."""
        if self.stuck_ms is not None and self.stuck_ms < self.move.end_ms and self.move.brake_ms is None:
            return None
        return -(-self.move.end_ms * PER_MILLE // self.pace)

    def reaches_ms(self, at_ms: int) -> int:
        """How long after its start the axis is at `at_ms` of the move."""
        return -(-at_ms * PER_MILLE // self.pace)


@dataclass(frozen=True)
class _Stretch:
    """What the axes do from `begin_ms` on, in a move that began at `start_ms`."""

    begin_ms: int
    start_ms: int
    axes: tuple[_AxisRun, _AxisRun, _AxisRun]

    def at(self, now_ms: int) -> Counts:
        elapsed = now_ms - self.start_ms
        x, y, z = (run.move.axis_at(index, run.progress(elapsed)) for index, run in enumerate(self.axes))
        return x, y, z

    def end_ms(self) -> int | None:
        needed = [run.needs_ms() for run in self.axes]
        known = [each for each in needed if each is not None]
        return self.start_ms + max(known) if len(known) == len(needed) else None


class MotorPlant:
    """Axes that follow exactly, or slower than told, or get stuck; it remembers all motion since it was made.

    `paces` are the speeds of the axes in thousandths of the commanded ones. What it leaves out: gear play, following
    error in steady motion, and the rod's forces.
    """

    def __init__(self, counts: Counts, paces: tuple[int, int, int] = (PER_MILLE, PER_MILLE, PER_MILLE)) -> None:
        self.sticks = False
        self._home = counts
        self._paces = paces
        self._past: list[_Stretch] = []
        self._begins: list[int] = []

    def follow(self, now_ms: int, start_ms: int, move: Move) -> None:
        """See Plant; a slow axis brakes from its own speed and place, not from those it should have."""
        last = self._past[-1] if self._past else None
        if last is not None and last.start_ms == start_ms and move.brake_ms is not None:
            x, y, z = (run.braked(now_ms - start_ms) for run in last.axes)
        else:
            stuck = self._longest(move) if self.sticks else None
            x, y, z = (
                _AxisRun(move, pace, move.duration_ms // 2 if index == stuck else None)
                for index, pace in enumerate(self._paces)
            )
        self._past.append(_Stretch(now_ms, start_ms, (x, y, z)))
        self._begins.append(now_ms)

    def positions(self, now_ms: int) -> Counts:
        """Encoder counts at any time since the plant was made."""
        index = bisect_right(self._begins, now_ms) - 1
        return self._past[index].at(now_ms) if index >= 0 else self._home

    def settles_ms(self) -> int | None:
        """See Plant."""
        return self._past[-1].end_ms() if self._past else None

    def fault(self) -> PlantFault | None:
        """A stuck axis is noticed a while after it stopped."""
        if self._past:
            stretch = self._past[-1]
            for axis, run in enumerate(stretch.axes, start=1):
                if run.stuck_ms is not None:
                    return PlantFault(stretch.start_ms + run.reaches_ms(run.stuck_ms) + STALL_MS, Fault.STALL, axis)
        return None

    def spans(self) -> list[tuple[int, int]]:
        """When anything moved: begin and end of every stretch [ms], in order."""
        spans = []
        cut: int | None = None
        for stretch in reversed(self._past):
            known = [each for each in (cut, stretch.end_ms()) if each is not None]
            spans.append((stretch.begin_ms, min(known, default=stretch.begin_ms)))
            cut = stretch.begin_ms
        spans.reverse()
        return spans

    @staticmethod
    def _longest(move: Move) -> int:
        distances = [abs(end - begin) for begin, end in zip(move.start, move.target, strict=True)]
        return distances.index(max(distances))
