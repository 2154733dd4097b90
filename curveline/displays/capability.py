"""What a display can do, worked out from its file: rod, reach of the motors, what it holds, where plans can lead."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

from curveline.drive_settings import AXES, UNITS, AxisDrive, drive_settings
from curveline.errors import InvalidInput
from curveline.plan_file import MAX_COUNT
from curveline.planning.actuator_loads import actuator_load_of, clamp_loads_of_state
from curveline.planning.layout import middle_begin
from curveline.planning.reachability import Access, entries_of, has_home
from curveline.planning.remedies import remedy
from curveline.planning.verification import Verifier
from curveline.radio.protocol.motion import axes_of
from curveline.rod.models.showable import Showable, showable_states
from curveline.scene import Display, Node
from curveline.simulation.simulate import DEFAULT_TOLERANCE, clamped_rod
from curveline.units import mm, to_mm

STATUS_COUNTS = 262_136
"""Largest position that a node's status can tell, in counts: see docs/radio-protocol.md, STATUS."""

LENGTHS = 17
"""Lengths of rod that are looked at; between two of them the limit is sought to `CLOSE`."""
CLOSE = mm(0.5)
LEAST_EXCESS = 5e-4
"""The shortest rod looked at is this fraction longer than the span: plans begin there, too."""

TOO_TIGHT = "the rod bends tighter than its strain allows"
TOO_HARD = "holding it takes more force than the motors give"
TOO_STIFF = "holding it takes a larger moment than the motors give"


@dataclass(frozen=True)
class Budget:
    """Rod between the outermost nodes, and in each tail if it is centred [m]; negative where it is too short."""

    between: float
    tail: float


@dataclass(frozen=True)
class AxisReach:
    """An axis as a display needs it: lowest and highest position and the farthest way, in mm or degrees."""

    name: str
    unit: str
    low: float
    high: float
    way: float
    drive: AxisDrive

    @property
    def counts(self) -> tuple[int, int]:
        """The ends in encoder counts from home."""
        return self.drive.counts(self.low), self.drive.counts(self.high)

    @property
    def seconds(self) -> float:
        """Time for the farthest way."""
        return self.drive.seconds(self.way)

    @property
    def fits_target(self) -> bool:
        """True if both ends can be sent as a motor's target."""
        return max(map(abs, self.counts)) <= MAX_COUNT

    @property
    def fits_status(self) -> bool:
        """True if a node can tell of both ends in its status; what lies beyond is out of limits."""
        return max(map(abs, self.counts)) <= STATUS_COUNTS

    @property
    def status_end(self) -> float:
        """The farthest position that a status can tell."""
        return self.drive.value(STATUS_COUNTS)


@dataclass(frozen=True)
class Held:
    """What rod and motors stand between two level, upright nodes: lengths of rod [m], and why no others.

    `shortest` and `longest` are None where no length will do; a reason is empty where the limit is the display's own.
    """

    shortest: float | None
    longest: float | None
    below: str = ""  # why no shorter ones
    beyond: str = ""  # why no longer ones


@dataclass(frozen=True)
class Leaving:
    """A state between two level, upright nodes that does not stay in its plane at all lengths that the limits allow.

    It leaves the plane at `low` and at all lengths [m] of some that were looked at, up to `high`.
    """

    state: str  # by name
    low: float
    high: float


@dataclass(frozen=True)
class Departures:
    """Where plans can lead from home: an entry for every kind of shape, none if there is no home.

    `remedies` says of the kinds to which none leads with which numbers of the file one would, as far as any were found.
    """

    entries: tuple[Access, ...] = ()  # one per kind of shape
    remedies: tuple[tuple[tuple[Access, ...], str], ...] = ()


@dataclass(frozen=True)
class Ability:
    """What was tried of a display: the lengths that it holds, those that leave the plane, where plans can lead."""

    held: Held  # lengths of rod that are held
    leaving: tuple[Leaving, ...] = ()  # states that leave the plane
    departures: Departures = Departures()  # where plans lead from home


def ability_of(display: Display) -> Ability:
    """Try what a display can do."""
    return Ability(held_lengths(display), leaving_states(display), departures_of(display))


def undrivable(display: Display) -> str:
    """Why no node can be told how fast to move, or where it may; empty if it can."""
    try:
        axes_of(drive_settings(display))
    except InvalidInput as error:
        return error.message
    return ""


def departures_of(display: Display) -> Departures:
    """Try to plan from home."""
    if undrivable(display) or not has_home(display):
        return Departures()
    verifier = Verifier(display, lambda: None)
    entries = entries_of(verifier)
    shut = tuple(entry for entry in entries if not entry.is_open)
    if not shut or (joint := remedy(verifier, tuple(entry.wanted for entry in shut))) or len(shut) == 1:
        return Departures(entries, ((shut, joint),) if shut else ())
    return Departures(entries, tuple(((entry,), remedy(verifier, (entry.wanted,))) for entry in shut))


def buckling_force(display: Display) -> float:
    """Force [N] at which the straight rod between two nodes buckles, which the motors that feed it must exceed."""
    return 4.0 * math.pi**2 * display.rod.bending_stiffness / (display.span - display.clamp) ** 2


def straight_budget(display: Display) -> Budget:
    """The rod when it goes straight through all nodes."""
    return _budget(display, display.span)


def longest_budget(display: Display) -> Budget:
    """The rod when every segment is as long as the limits allow."""
    return _budget(display, display.limits.length.high)


def _budget(display: Display, length: float) -> Budget:
    between = (display.node_count - 1) * length
    return Budget(between, 0.5 * (display.rod.total_length - between))


def reaches(display: Display) -> tuple[AxisReach, ...]:
    """What each axis must be able to reach for all that the limits allow, in the order of `AXES`.

    A segment takes its rod from both sides; the outermost nodes feed half of what all segments take beyond the span,
    each to its own side.
    """
    limits, axes = display.limits, drive_settings(display).axes
    feed = 0.5 * (display.node_count - 1) * to_mm(max(limits.length.high - display.span, 0.0))
    ends = ((0.0 - feed, feed, feed), *((axis.low, axis.high, axis.high - axis.low) for axis in axes[1:]))
    return tuple(
        AxisReach(name, unit, *each, axis) for name, unit, each, axis in zip(AXES, UNITS, ends, axes, strict=True)
    )


def _lengths(display: Display) -> list[float]:
    """Lengths of rod to look at, from the shortest to the longest [m]; none where none reaches across."""
    limits = display.limits.length
    low = max(limits.low, display.span * (1.0 + LEAST_EXCESS))
    return [low + (limits.high - low) * i / (LENGTHS - 1) for i in range(LENGTHS)] if limits.high > low else []


def held_lengths(display: Display) -> Held:
    """For which lengths rod and motors hold every state between two level, upright nodes."""
    lengths = _lengths(display)
    if not lengths:
        return Held(None, None)
    reasons = [too_much(display, length) for length in lengths]
    good = [i for i, reason in enumerate(reasons) if not reason]
    if not good:
        return Held(None, None, reasons[0], reasons[-1])
    # The run of lengths that hold which begins first; rods that are held again beyond a gap are no use to a plan.
    first = good[0]
    last = next((i for i, after in pairwise(good) if after != i + 1), good[-1])

    def holds(length: float) -> bool:
        return not too_much(display, length)

    shortest = lengths[0] if first == 0 else _boundary(holds, lengths[first], lengths[first - 1])
    longest = lengths[-1] if last == LENGTHS - 1 else _boundary(holds, lengths[last], lengths[last + 1])
    below = "" if first == 0 else reasons[first - 1]
    return Held(shortest, longest, below, "" if last == LENGTHS - 1 else reasons[last + 1])


def _boundary(is_so: Callable[[float], bool], inner: float, outer: float) -> float:
    """The length nearest to `outer`, of which something is not so, for which it still `is_so`, to `CLOSE`."""
    while abs(outer - inner) > CLOSE:
        middle = 0.5 * (inner + outer)
        if is_so(middle):
            inner = middle
        else:
            outer = middle
    return inner


def leaving_states(display: Display) -> tuple[Leaving, ...]:
    """The states between two level, upright nodes that some lengths of rod do not keep in the plane, and those lengths.

    Of each the first run of lengths, its ends to `CLOSE`.
    """
    lengths = _lengths(display)
    leave = [leaving(display, length) for length in lengths]
    return tuple(_leaving(display, name, lengths, leave) for name in sorted(frozenset().union(*leave)))


def _leaving(display: Display, name: str, lengths: list[float], leave: list[frozenset[str]]) -> Leaving:
    def leaves(length: float) -> bool:
        return name in leaving(display, length)

    run = [name in names for names in leave]
    first = run.index(True)
    last = next((i for i in range(first, LENGTHS - 1) if not run[i + 1]), LENGTHS - 1)
    low = lengths[0] if first == 0 else _boundary(leaves, lengths[first], lengths[first - 1])
    high = lengths[-1] if last == LENGTHS - 1 else _boundary(leaves, lengths[last], lengths[last + 1])
    return Leaving(name, low, high)


def leaving(display: Display, length: float) -> frozenset[str]:
    """The states of `length` [m] of rod between level, upright nodes that do not certainly stay in their plane."""
    return frozenset(state.name for state in _level_states(display, length).leaving)


def _level_states(display: Display, length: float) -> Showable:
    rod = clamped_rod(display, (Node(0.0, 0.0), Node(0.0, 0.0)), length, middle_begin(display, length))
    return showable_states(rod, DEFAULT_TOLERANCE)


def too_much(display: Display, length: float) -> str:
    """Why rod or motors do not stand every state of `length` [m] of rod between level, upright nodes; empty if so."""
    for state in _level_states(display, length).planar:
        load = actuator_load_of((clamp_loads_of_state(state),))
        if load.curvature > display.rod.max_curvature:
            return TOO_TIGHT
        if load.force > display.drive.max_force:
            return TOO_HARD
        if load.moment > display.drive.max_moment:
            return TOO_STIFF
    return ""
