"""Whether a motor, its encoder and its switch are wired as they should be: it is turned a little, and what came of it.

It needs no other axis, no zero and no rod: a motor is turned without a loop, both ways, gently and not far, and only
when that went as it should, closed loop for a moment. What is found is said in words of wires.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import copysign
from typing import Any

from curveline.drive_settings import AXES, UNITS
from curveline.driving.node_errands import NodePlace, wish_of
from curveline.errors import InvalidInput
from curveline.radio.host.errands import Errand, TurnResult
from curveline.radio.host.scan import ScannedNode, scan_one
from curveline.radio.protocol.codes import BootCause, Fault
from curveline.radio.protocol.frames import ReportFrame
from curveline.radio.protocol.motion import axes_of, config_hash
from curveline.radio.protocol.service_frames import ServiceFrame

CHECK_DUTY = 350
CHECK_COUNTS = 300
CHECK_MS = 1200
"""How strongly a motor is turned at most [thousandths], how far, and for how long."""
FREE_COUNTS = 900
"""How far an axis goes from its switch, 4 mm, if that is closed."""
LIFE_COUNTS = 20
"""Fewer counts of an encoder are no motion of its motor."""
MISSED_SHARE = 0.01
MISSED_LEAST = 3
"""Missed edges that are noise: this share of the counts, but at least so many."""
PAUSES = 3
"""Samples of 4 ms without a count, amid others with some, that a turning motor does not have."""
LEAST_MV = 3000
"""Below this encoders and radio are not sure to work."""
METER_SHARE = 0.03
"""By what share the chip's measurement of its supply may be off."""
SPARE_COUNTS = 32
"""How far from where it is told to stand a node may say that it stands."""
LOOK_S = 0.3
PROOF = {"mm": 1.0, "deg": 3.0}
"""How far an axis goes closed loop, by unit."""

DRIVER_PINS = {"extrude": "16 and 17", "bias": "3 and 4", "translate": "22 and 23"}
SWITCH_PIN = "pin 18"
ENCODER_PINS = {"extrude": "2 and 14", "bias": "7 and 8", "translate": "6 and 20"}


@dataclass(frozen=True)
class Finding:
    """Something that is not as it should be: a word for scripts, a sentence, and what to do."""

    code: str  # such as reversed
    text: str  # what was seen
    hint: str  # what helps


@dataclass(frozen=True)
class AxisCheck:
    """What one motor and its encoder showed, both ways; lengths in mm or degrees."""

    axis: str  # its name
    findings: tuple[Finding, ...]  # none if all is well
    forward: tuple[int, int, int]  # counts of every encoder while the motor turned forwards
    backward: tuple[int, int, int]  # and backwards
    missed: int  # edges that its encoder missed meanwhile
    missed_by: tuple[int, int, int]  # edges that every encoder missed meanwhile
    start_duty: tuple[float, float]  # share of full duty that set it going, forwards and backwards
    supply_mv: int | None  # the lowest that was seen, None if the chip cannot tell
    lag: float | None  # largest following error, closed loop; None if it was not tried

    @property
    def is_well(self) -> bool:
        """Whether there is nothing to find fault with."""
        return not self.findings


@dataclass(frozen=True)
class NodeCheck:
    """What a check of a node found, of the node and of each axis that was turned."""

    node: int  # in the row, from 1
    findings: tuple[Finding, ...]  # of the whole node
    axes: tuple[AxisCheck, ...]  # those that were turned

    @property
    def is_well(self) -> bool:
        """Whether there is nothing to find fault with."""
        return not self.findings and all(each.is_well for each in self.axes)

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return {"well": self.is_well, **asdict(self)}


def check(place: NodePlace, names: Sequence[str] = AXES, told: Callable[[str], None] = lambda name: None) -> NodeCheck:
    """Turn the motors of some axes a little, one after the other, and say what is wired wrongly.

    `told` hears the name of each before it turns. LinkError if the node does not answer, or does something else.
    """
    numbers = [place.axis(name) for name in names]
    report = place.report()
    for number in numbers:
        _require_room(place, number, report)
    address = tuple(_of_address(place))
    if any(each.code == "twin" for each in address):
        return NodeCheck(place.number, address, ())
    found = []
    for number, name in zip(numbers, names, strict=True):
        told(name)
        found.append(_axis_check(place, number, report))
    return NodeCheck(place.number, (*address, *_of_node(report, found), *_between(found)), tuple(found))


def _require_room(place: NodePlace, number: int, report: ReportFrame) -> None:
    """InvalidInput for a homed axis that stands too near to an end of its travel to be turned both ways."""
    axis, at, name = place.drive.axes[number - 1], report.position[number - 1], AXES[number - 1]
    room = max(CHECK_COUNTS, axis.counts(PROOF[UNITS[number - 1]])) + SPARE_COUNTS
    low, high = axis.counts(axis.low) + room, axis.counts(axis.high) - room
    if report.axes[number - 1] == 0 and not low <= at <= high:
        way = axis.value(min(max(at, low), high) - at)
        way += copysign(0.1, way)
        hint = f"jog it away from there first: `curveline node jog {place.number} {name} {way:.1f}`"
        raise InvalidInput(f"{name} stands too near to the end of its travel to be turned both ways", hint)


def _of_address(place: NodePlace) -> Iterator[Finding]:
    """What is wrong with the address that a node has, asked without keys."""
    found = ScannedNode(place.number, place.drive.addresses[place.number - 1])
    scan_one(place.radio, found)
    if len(found.pages) > 1:
        chips = " and ".join(f"{chip:08x}" for chip in sorted(found.pages))
        hint = (
            "switch one of them off, and write settings of its own to each node: by a cable, `curveline keys node`, or "
            "to one that is alone on the air, `curveline node settings`"
        )
        yield Finding("twin", f"two devices answer on the address of node {place.number}: chips {chips}", hint)
    wanted = config_hash(axes_of(place.drive))
    if any(page.config_hash != wanted for page in found.pages.values()):
        hint = f"`curveline node settings {place.number}` gives it those of the display file; or correct the file"
        yield Finding("limits", f"node {place.number} holds other limits or speeds than this display", hint)


def _of_node(report: ReportFrame, axes: Sequence[AxisCheck]) -> Iterator[Finding]:
    if report.cause is BootCause.LOW_VOLTAGE or report.fault is Fault.BROWN_OUT:
        yield Finding(
            "supply",
            "the supply had sagged when the node started last",
            "check its supply: cable, connector, current with all motors turning",
        )
    seen = min((each.supply_mv for each in axes if each.supply_mv is not None), default=None)
    if seen is not None and seen * (1.0 - METER_SHARE) < LEAST_MV:
        error = f"give or take {seen * METER_SHARE / 1000:.2f} V"
        maybe = "" if seen * (1.0 + METER_SHARE) < LEAST_MV else ": that may be too low, measure it with a meter"
        yield Finding(
            "supply",
            f"the supply goes down to {seen / 1000:.2f} V while a motor turns, {error}{maybe}",
            "the logic needs 3.0 V at all times: a stronger supply, shorter cables, 10 uF at the radio; feed the "
            "motors apart from the logic",
        )


def _between(axes: Sequence[AxisCheck]) -> Iterator[Finding]:
    """Encoders that miss edges while another motor turns, and none while their own does.

    With one motor plugged in there is nothing to be said of the others.
    """
    if len(axes) < len(AXES):
        return
    for index, name in enumerate(AXES):
        if any(each.code == "noisy" for each in axes[index].findings):
            continue
        for each in axes:
            if each.axis != name and each.missed_by[index] > MISSED_LEAST:
                yield Finding(
                    "crosstalk",
                    f"{name}'s encoder missed {each.missed_by[index]} edges while {each.axis}'s motor turned",
                    f"noise of that motor on these lines: 100 nF across the motor of {each.axis}, its wires twisted, "
                    f"and apart from the encoder wires of {name}",
                )


def _axis_check(place: NodePlace, number: int, report: ReportFrame) -> AxisCheck:
    with place.tried() as errand:
        before = _missed(errand)
        is_closed = errand.motors().switches[number - 1] and AXES[number - 1] == "translate"
        errand.rest(LOOK_S)
        forward = _turn(errand, number, CHECK_DUTY, FREE_COUNTS if is_closed else CHECK_COUNTS)
        stays = is_closed and errand.motors().switches[number - 1]
        backward = _turn(errand, number, -CHECK_DUTY, CHECK_COUNTS)
        x, y, z = (now - then for now, then in zip(_missed(errand), before, strict=True))
        missed = (x, y, z)[number - 1]
        findings = tuple(_judged(number, forward, backward, missed))
        if stays and not any(each.code in ("absent", "swapped", "reversed") for each in findings):
            findings += (_stuck(AXES[number - 1]),)
        lag = None
        if not findings and report.fault is Fault.NONE:
            lag = _proof(place, errand, number, report)
    supplies = [each.least_mv for each in (forward, backward) if each.least_mv]
    starts = forward.facts.threshold / 1000.0, backward.facts.threshold / 1000.0
    return AxisCheck(
        axis=AXES[number - 1],
        findings=findings,
        forward=forward.gone,
        backward=backward.gone,
        missed=missed,
        missed_by=(x, y, z),
        start_duty=starts,
        supply_mv=min(supplies, default=None),
        lag=lag,
    )


def _missed(errand: Errand) -> tuple[int, ...]:
    """Edges that every encoder missed since it was switched on."""
    return tuple(errand.axis(number + 1).missed for number in range(len(AXES)))


def _turn(errand: Errand, number: int, duty: int, counts: int) -> TurnResult:
    return errand.turn(ServiceFrame(0, 0, 0, axis=number, amount=duty, rate=counts, span=CHECK_MS))


def _proof(place: NodePlace, errand: Errand, number: int, report: ReportFrame) -> float | None:
    """The largest following error of a short way there and back; None if the way is not free for it."""
    axis = place.drive.axes[number - 1]
    by = PROOF[UNITS[number - 1]]
    is_homed = report.axes[number - 1] == 0
    lag = 0
    at = axis.value(errand.motors().counts[number - 1])
    if is_homed and at + by > axis.high:
        by = -by
    for way in (by, -by):
        _, facts = errand.jog(wish_of(axis, number, way, unhomed=not is_homed), lambda facts: None)
        lag = max(lag, facts.lag)
    return axis.value(lag)


def _judged(number: int, forward: TurnResult, backward: TurnResult, missed: int) -> Iterator[Finding]:
    """What is wrong with a motor and its encoder, by what both turns came to."""
    name = AXES[number - 1]
    there, back = forward.gone[number - 1], backward.gone[number - 1]
    if forward.driver_fault or backward.driver_fault:
        yield Finding(
            "driver",
            f"the motor driver reports a fault while {name} turns",
            "look for a short circuit in this motor's wires; the driver's supply may be too weak",
        )
    other = _moved_instead(number, forward, backward)
    if other:
        yield _swapped(name, AXES[other - 1])
    elif max(abs(there), abs(back)) < LIFE_COUNTS:
        yield _absent(name)
    elif there < 0 < back:
        yield Finding(
            "reversed",
            f"{name} counts down when its motor is driven forwards",
            "swap the motor's two wires; if the axis then goes the wrong way, swap them back, and swap its "
            "encoder's A and B",
        )
    elif there <= LIFE_COUNTS or back >= -LIFE_COUNTS:
        yield Finding(
            "one-way",
            f"{name} turns only one way: {there:+d} counts forwards, {back:+d} backwards",
            f"free what blocks it, or move it away from its end by hand; else one of the wires at pins "
            f"{DRIVER_PINS[name]} is open",
        )
    if not other:
        yield from _counting(name, forward, backward, missed)


def _counting(name: str, forward: TurnResult, backward: TurnResult, missed: int) -> Iterator[Finding]:
    number = AXES.index(name)
    counts = abs(forward.gone[number]) + abs(backward.gone[number])
    if missed > max(MISSED_LEAST, MISSED_SHARE * counts):
        yield Finding(
            "noisy",
            f"{name}'s encoder missed {missed} edges in {counts} counts",
            "noise on its lines: 100 nF across the motor, encoder wires apart from the motor's, short or shielded, "
            "3.3 V right at the encoder",
        )
    elif max(_pauses(forward.samples), _pauses(backward.samples)) >= PAUSES:
        yield Finding(
            "loose",
            f"{name}'s encoder stops counting now and then while its motor turns",
            "a loose plug or wire, or the magnet slips on the motor's shaft: press the plug home and fix the wires",
        )


def _pauses(samples: Sequence[int]) -> int:
    """Samples without a count, amid others with some, once the motor has come to speed."""
    steps = [abs(after - before) for before, after in pairwise(samples)]
    if not any(steps):
        return 0
    usual = sorted(step for step in steps if step)[len([step for step in steps if step]) // 2]
    last = max(index for index, step in enumerate(steps) if step)
    begin = next(index for index, step in enumerate(steps) if 2 * step >= usual)
    return sum(step == 0 for step in steps[begin:last]) if usual >= 2 else 0


def _moved_instead(number: int, forward: TurnResult, backward: TurnResult) -> int:
    """The axis (from 1) whose encoder gave the counts, if it is another one; else 0."""
    ways = [abs(there) + abs(back) for there, back in zip(forward.gone, backward.gone, strict=True)]
    most = max(range(len(ways)), key=lambda index: ways[index]) + 1
    return most if most != number and ways[most - 1] >= LIFE_COUNTS and ways[number - 1] < LIFE_COUNTS else 0


def _swapped(name: str, other: str) -> Finding:
    return Finding(
        "swapped",
        f"the motor of {name} turns, and the encoder of {other} counts",
        f"their encoders are exchanged, or their motors: {name}'s encoder belongs to pins {ENCODER_PINS[name]}, its "
        f"motor's driver inputs to pins {DRIVER_PINS[name]}",
    )


def _absent(name: str) -> Finding:
    return Finding(
        "absent",
        f"no counts came from {name}, either way",
        f"if its motor did not turn: is it plugged in (driver inputs at pins {DRIVER_PINS[name]}), have the drivers "
        f"their supply, is nSLEEP at pin 5? If it did: its encoder has no 3.3 V, or is not at pins "
        f"{ENCODER_PINS[name]}",
    )


def _stuck(name: str) -> Finding:
    return Finding(
        "switch",
        f"{name}'s switch is closed, and stays so 4 mm further up",
        f"it is stuck, shorted to ground, or an opener where a closer belongs; pressed it must connect {SWITCH_PIN} "
        "to ground, released it must not",
    )
