"""Motors and encoders of a node: the seam through which a node moves, and the model that the mock display uses."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, replace
from typing import Protocol

from curveline.radio.node.motor_model import Bench, Wiring
from curveline.radio.node.settings_flash import FixedSettings, SettingsKeeper
from curveline.radio.node.state import HOMED, with_reason
from curveline.radio.node.workbench import Turn
from curveline.radio.protocol.codes import AXIS_COUNT, Counts, Fault
from curveline.radio.protocol.motion import NodeMove
from curveline.radio.protocol.service_frames import LINE_AWAKE

PER_MILLE = 1000
STALL_MS = 200
"""How long an axis may stand still against its command before a node calls it a stall."""
MUTE_MS = 100
"""How long an encoder may give no counts from a motor that is driven."""
RUNAWAY_COUNTS = 50
"""How far an axis may go against its command."""
LAG_MS = 6
"""How far an axis is behind its set-point in steady motion, by time."""
SEEK_COUNTS_PER_S = 4000
SEEK_LEAST_MS = 400
SEEK_RAMP_MS = 100
"""A search for zeros is a slow way there; longer than `MUTE_MS`, so that it finds out what is absent."""


@dataclass(frozen=True)
class PlantFault:
    """What goes wrong with an axis (from 1), and when."""

    at_ms: int
    fault: Fault
    axis: int


@dataclass(frozen=True)
class Sought:
    """How a search for zeros ends, and when: per axis why it is not homed, 0 if it is; of the sought ones only."""

    at_ms: int
    reasons: tuple[int, int, int]


@dataclass(frozen=True)
class PlantLook:
    """What a plant sees of itself: encoder counts, lines as in a READING, supply; the rest is of one axis.

    Its missed edges, duty now, largest lag of the last move [counts]; of the last turn threshold, samples kept, a few.
    """

    counts: Counts
    lines: int
    supply_mv: int
    missed: int
    duty: int
    lag: int
    threshold: int
    samples: int
    trace: tuple[int, ...]


class Plant(Protocol):
    """What a node needs of its motors and encoders, and where its settings are."""

    settings: SettingsKeeper
    has_loader: bool
    """Whether another program could take this one's place over the air."""

    def follow(self, now_ms: int, start_ms: int, move: NodeMove) -> None:
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

    def seek(self, now_ms: int, axes: int) -> None:
        """Find the zeros of some axes (bit 0 for the first) and go there."""
        ...

    def sought(self) -> Sought | None:
        """How and when the search ends, None if that is not known or there is none."""
        ...

    def give_up(self, now_ms: int) -> None:
        """End the search, or the turn, where it is."""
        ...

    def turn(self, now_ms: int, turn: Turn) -> None:
        """Turn one motor without a loop."""
        ...

    def turned_ms(self) -> int | None:
        """When the turn ends, None if that is not known or there is none."""
        ...

    def place(self, now_ms: int, axis: int, counts: int) -> None:
        """Where an axis (from 1) rests is `counts` from now on."""
        ...

    def look(self, now_ms: int, axis: int, first: int) -> PlantLook:
        """What can be seen of the motors, of one axis (from 1), and of the samples of the last turn from `first` on."""
        ...


@dataclass(frozen=True)
class _AxisRun:
    """One axis following a move at `pace` thousandths of the commanded one, stuck from `stuck_ms` of it on.

    With `runs_away` it goes the other way.
    """

    move: NodeMove
    pace: int
    stuck_ms: int | None = None
    runs_away: bool = False

    def progress(self, elapsed_ms: int) -> int:
        """Where in the move's own time the axis is."""
        at_ms = elapsed_ms * self.pace // PER_MILLE
        return at_ms if self.stuck_ms is None else min(at_ms, self.stuck_ms)

    def at(self, index: int, elapsed_ms: int) -> int:
        """Counts of the axis, which is number `index` (from 0) of the move."""
        counts = self.move.axis_at(index, self.progress(elapsed_ms))
        return 2 * self.move.start[index] - counts if self.runs_away else counts

    def braked(self, elapsed_ms: int) -> _AxisRun:
        """The axis slowing down from where it is, which is behind its command if it is slow; a stuck one stays."""
        return replace(self, move=self.move.braked(self.progress(elapsed_ms)))

    def needs_ms(self) -> int | None:
        """How long after its start the axis comes to rest, None if it will not get to the end."""
        falls_short = self.runs_away or (self.stuck_ms is not None and self.stuck_ms < self.move.end_ms)
        if falls_short and self.move.brake_ms is None:
            return None
        return -(-self.move.end_ms * PER_MILLE // self.pace)

    def reaches_ms(self, at_ms: int) -> int:
        """How long after its start the axis is at `at_ms` of the move."""
        return -(-at_ms * PER_MILLE // self.pace)


@dataclass(frozen=True)
class _MotionStretch:
    """What the axes do from `begin_ms` on, in a move that began at `start_ms`, and the fault it runs into."""

    begin_ms: int
    start_ms: int
    axes: tuple[_AxisRun, _AxisRun, _AxisRun]
    fault: PlantFault | None = None

    def at(self, now_ms: int) -> Counts:
        x, y, z = (run.at(index, now_ms - self.start_ms) for index, run in enumerate(self.axes))
        return x, y, z

    def end_ms(self) -> int | None:
        needed = [run.needs_ms() for run in self.axes]
        known = [each for each in needed if each is not None]
        return self.start_ms + max(known) if len(known) == len(needed) else None


@dataclass(frozen=True)
class _Turned:
    """Counts of every ms of a turn without a loop from `begin_ms` on, or of an axis that was put elsewhere by hand."""

    begin_ms: int
    path: tuple[Counts, ...]
    fault: None = None

    @property
    def start_ms(self) -> int:
        return self.begin_ms

    def at(self, now_ms: int) -> Counts:
        return self.path[max(0, min(now_ms - self.begin_ms, len(self.path) - 1))]

    def end_ms(self) -> int:
        return self.begin_ms + len(self.path) - 1


class MotorPlant:
    """Axes that follow exactly, or slower than told, or into a fault; it remembers all motion since it was made.

    `paces` are the speeds of the axes in thousandths of the commanded ones; `trouble` is what the next move runs into;
    `wiring` is what is wrong with the board. A search for zeros goes straight there.
    What it leaves out: gear play, most of the following error in steady motion, and the rod's forces.
    """

    def __init__(self, counts: Counts, paces: tuple[int, int, int] = (PER_MILLE, PER_MILLE, PER_MILLE)) -> None:
        self.trouble = Fault.NONE
        self.wiring = Wiring()
        self.settings: SettingsKeeper = FixedSettings()
        self.has_loader = False
        self.bench = Bench()
        self._lag = 0
        self._turn_end_ms: int | None = None
        self._search: Sought | None = None
        self._home = counts
        self._paces = paces
        self._past: list[_MotionStretch | _Turned] = []
        self._begins: list[int] = []

    def follow(self, now_ms: int, start_ms: int, move: NodeMove) -> None:
        """See Plant; a slow axis brakes from its own speed and place, not from those it should have."""
        last = self._past[-1] if self._past else None
        if isinstance(last, _MotionStretch) and last.start_ms == start_ms and move.brake_ms is not None:
            x, y, z = (run.braked(now_ms - start_ms) for run in last.axes)
            stretch = _MotionStretch(now_ms, start_ms, (x, y, z), last.fault)
        else:
            stretch = self._set_off(now_ms, start_ms, move)
            self._lag = max(_distance(move, index) for index in range(3)) * LAG_MS // max(1, move.duration_ms)
        self._search = self._turn_end_ms = None
        self._append(stretch)

    def seek(self, now_ms: int, axes: int) -> None:
        """See Plant; a motor that is not there is found out because its encoder stays mute."""
        start = self.positions(now_ms)
        moving = axes & ~self.wiring.mute
        x, y, z = (0 if moving >> index & 1 else at for index, at in enumerate(start))
        longest = max(abs(end - at) for end, at in zip((x, y, z), start, strict=True))
        duration_ms = max(SEEK_LEAST_MS, 1000 * longest // SEEK_COUNTS_PER_S)
        run = _AxisRun(NodeMove(start, (x, y, z), duration_ms, SEEK_RAMP_MS), PER_MILLE)
        self._append(_MotionStretch(now_ms, now_ms, (run, run, run)))
        reasons = with_reason(HOMED, axes & self.wiring.doubtful, Fault.ENCODER)
        reasons = with_reason(reasons, axes & self.wiring.reversed & ~self.wiring.mute, Fault.RUNAWAY)
        self._search = Sought(now_ms + duration_ms, reasons)

    def sought(self) -> Sought | None:
        """See Plant."""
        return self._search

    def give_up(self, now_ms: int) -> None:
        """See Plant."""
        if self._turn_end_ms is not None:
            self.bench.stop(now_ms)
            self._turn_end_ms = None
            self._append(_Turned(now_ms, (self.positions(now_ms),)))
        if self._search is not None:
            self._search = None
            last = self._past[-1]
            assert isinstance(last, _MotionStretch)
            x, y, z = (run.braked(now_ms - last.start_ms) for run in last.axes)
            self._append(replace(last, begin_ms=now_ms, axes=(x, y, z)))

    def turn(self, now_ms: int, turn: Turn) -> None:
        """See Plant."""
        path = self.bench.run(now_ms, turn, self.positions(now_ms), self.wiring)
        self._turn_end_ms = now_ms + len(path) - 1
        self._append(_Turned(now_ms, path))

    def turned_ms(self) -> int | None:
        """See Plant."""
        return self._turn_end_ms

    def place(self, now_ms: int, axis: int, counts: int) -> None:
        """See Plant."""
        x, y, z = (counts if number == axis else each for number, each in enumerate(self.positions(now_ms), start=1))
        self._append(_Turned(now_ms, ((x, y, z),)))

    def look(self, now_ms: int, axis: int, first: int) -> PlantLook:
        """See Plant."""
        turns = (end := self.settles_ms()) is None or now_ms < end
        counts = self.bench.trembling(now_ms, self.positions(now_ms), self.wiring)
        facts = self.bench.facts(now_ms, axis, first)
        lines = self.wiring.stuck_switches | LINE_AWAKE * turns
        return PlantLook(
            counts, lines, self.wiring.supply_mv(turns=turns), facts.missed, facts.duty, self._lag, *facts.kept
        )

    def _append(self, stretch: _MotionStretch | _Turned) -> None:
        self._past.append(stretch)
        self._begins.append(stretch.begin_ms)

    def _set_off(self, now_ms: int, start_ms: int, move: NodeMove) -> _MotionStretch:
        """A new move; what goes wrong with it concerns the axis with the longest way, half of which it does."""
        runs = [_AxisRun(move, pace) for pace in self._paces]
        going = sum(1 << index for index in range(len(runs)) if _distance(move, index))
        if mute := going & self.wiring.mute:
            for index in _bits(mute):
                runs[index] = replace(runs[index], stuck_ms=0)
            x, y, z = runs
            fault = PlantFault(start_ms + MUTE_MS, Fault.ENCODER, _bits(mute)[0] + 1)
            return _MotionStretch(now_ms, start_ms, (x, y, z), fault)
        if backward := going & self.wiring.reversed:
            return self._set_off_whole(now_ms, start_ms, runs, (Fault.RUNAWAY, _bits(backward)[0]))
        if unsure := going & self.wiring.doubtful:
            return self._set_off_whole(now_ms, start_ms, runs, (Fault.ENCODER, _bits(unsure)[0]))
        return self._set_off_whole(now_ms, start_ms, runs, (self.trouble, _longest(move)))

    def _set_off_whole(
        self, now_ms: int, start_ms: int, runs: list[_AxisRun], trouble: tuple[Fault, int]
    ) -> _MotionStretch:
        kind, axis = trouble
        bad = runs[axis]
        move, half_ms = bad.move, bad.move.duration_ms // 2
        fault = None
        if kind in _STICKING:
            runs[axis] = replace(bad, stuck_ms=half_ms)
            at_ms = start_ms + bad.reaches_ms(half_ms) + _STICKING[kind]
            fault = PlantFault(at_ms, kind, axis + 1)
        elif kind is Fault.RUNAWAY:
            runs[axis] = replace(bad, runs_away=True)
            far_ms = bisect_left(range(move.duration_ms), RUNAWAY_COUNTS, key=lambda ms: _way(move, axis, ms))
            fault = PlantFault(start_ms + bad.reaches_ms(far_ms), kind, axis + 1)
        elif kind is not Fault.NONE:
            fault = PlantFault(start_ms + half_ms, kind, 0)
        x, y, z = runs
        return _MotionStretch(now_ms, start_ms, (x, y, z), fault)

    def positions(self, now_ms: int) -> Counts:
        """Encoder counts at any time since the plant was made."""
        index = bisect_right(self._begins, now_ms) - 1
        return self._past[index].at(now_ms) if index >= 0 else self._home

    def settles_ms(self) -> int | None:
        """See Plant."""
        return self._past[-1].end_ms() if self._past else None

    def fault(self) -> PlantFault | None:
        """See Plant."""
        return self._past[-1].fault if self._past else None

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


_STICKING = {Fault.STALL: STALL_MS, Fault.ENCODER: MUTE_MS}
"""Faults of one axis whose counts stand still, and how long it takes until a node calls them so."""


def _bits(axes: int) -> list[int]:
    return [index for index in range(AXIS_COUNT) if axes >> index & 1]


def _distance(move: NodeMove, index: int) -> int:
    return abs(move.target[index] - move.start[index])


def _longest(move: NodeMove) -> int:
    return max(range(len(move.start)), key=lambda index: _distance(move, index))


def _way(move: NodeMove, index: int, at_ms: int) -> int:
    return abs(move.axis_at(index, at_ms) - move.start[index])
