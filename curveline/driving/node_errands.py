"""What one node is told to do while it is being tried out: blink, jog an axis, take a zero; and what it says then."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, suppress
from dataclasses import asdict, dataclass
from typing import Any

from curveline.drive_settings import AXES, UNITS, AxisDrive, DriveSettings
from curveline.errors import InvalidInput, LinkError
from curveline.radio.host.errands import Errand, Inquiry, begun, tried
from curveline.radio.host.link import Halted
from curveline.radio.host.scan import ScannedNode, scan_one
from curveline.radio.host.service import halted, report_of
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.interface import Radio
from curveline.radio.protocol.codes import UNHOMED_COUNTS, NodeState
from curveline.radio.protocol.frames import ReportFrame
from curveline.radio.protocol.motion import LEAST_RATE, axes_of, config_hash
from curveline.radio.protocol.service_frames import LINE_DRIVER, MotorFacts, ServiceFrame
from curveline.units import beyond

SLOW = {"mm": 5.0, "deg": 10.0}
"""How fast a jog is at most, by unit of the axis [per s]."""
UNHOMED_MOST = 20.0
"""How far an axis that is not homed is jogged at most [mm or degrees]."""


@dataclass(frozen=True)
class NodePlace:
    """A node that a radio reaches, as everything here needs it."""

    radio: Radio  # open
    drive: DriveSettings  # the display as nodes see it
    number: int  # in the row, from 1

    def tried(self) -> AbstractContextManager[Errand]:
        """A session with the node, for a `with`."""
        return tried(self.radio, self.drive, self.number)

    def axis(self, name: str) -> int:
        """Number of an axis, from 1; InvalidInput for one that there is not."""
        if name not in AXES:
            raise InvalidInput(f"no axis of a node: {name}", f"there are {', '.join(AXES)}")
        return AXES.index(name) + 1

    def report(self) -> ReportFrame:
        """What the node says of itself."""
        return report_of(self.radio, self.drive, self.number)


@dataclass(frozen=True)
class Jogged:
    """What a jog came to, in mm or degrees."""

    axis: str  # its name
    unit: str  # mm or deg
    way: float  # gone
    position: float | None  # where the axis is now, None if it is not homed
    lag: float  # largest following error

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return asdict(self)


@dataclass(frozen=True)
class NodeInfo:
    """Who a node is. What it does not tell is None: the limits of one whose firmware is older, or that is busy."""

    node: int  # in the row, from 1
    address: str  # 5 bytes, hexadecimal
    channel: int  # on which it answers
    data_rate: str  # such as 1Mbps
    chips: tuple[str, ...]  # that answer there, hexadecimal: one, unless two devices have one address
    firmware: int  # of this protocol version
    protocol: int  # version
    boot: int  # how often it was switched on
    limits_fit: bool  # whether it holds those of the display file
    limits: dict[str, tuple[float, float]] | None  # of each axis [mm or degrees]
    bad_tags: int  # frames under another key since it was switched on
    old_frames: int  # frames that came again or too late

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return asdict(self)


@dataclass(frozen=True)
class Watched:
    """What a node says of its motors at a moment."""

    counts: tuple[int, int, int]  # of the encoders
    missed: tuple[int, int, int]  # edges that were missed, since it was switched on
    switches: tuple[bool, bool, bool]  # closed, by axis
    driver_fault: bool  # the drivers pull their pin
    duty: tuple[int, int, int]  # thousandths of full duty
    step: int  # the newest begun
    supply_mv: int | None  # None if the chip cannot tell

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return asdict(self)


def blink(place: NodePlace, seconds: float) -> None:
    """Let the lamp of a node flicker for so long, so that it can be found."""
    if not 0.0 < seconds <= 600.0:
        raise InvalidInput(f"a lamp cannot flicker for {seconds:g} s", "say 0.1 to 600 seconds")
    with place.tried() as errand:
        errand.blink(seconds)


def zero(place: NodePlace) -> ReportFrame:
    """Let extrude count from where it stands, after the rod was threaded; nothing moves. What the node says then."""
    with place.tried() as errand:
        errand.place(1, 0)
    return place.report()


def jog(
    place: NodePlace,
    name: str,
    by: float,
    *,
    unhomed: bool = False,
    viewer: Callable[[MotorFacts], None] = lambda facts: None,
) -> Jogged:
    """Move one axis by `by` [mm or degrees], slowly, as long as this runs; `viewer` is told how it goes.

    InvalidInput for what is beyond its limits, and for an axis that is not homed unless `unhomed` allows that.
    """
    number = place.axis(name)
    axis = place.drive.axes[number - 1]
    _check(place, name, by, unhomed=unhomed)
    with place.tried() as errand:
        gone, facts = errand.jog(wish_of(axis, number, by, unhomed=unhomed), viewer)
        at = errand.motors().counts[number - 1]
    is_homed = place.report().axes[number - 1] == 0
    position = axis.value(at) if is_homed else None
    return Jogged(name, UNITS[number - 1], axis.value(gone), position, axis.value(facts.lag))


def wish_of(axis: AxisDrive, number: int, by: float, *, unhomed: bool) -> ServiceFrame:
    """The order of a jog of axis `number` (from 1) by `by` [mm or degrees]."""
    speed = min(axis.speed, SLOW[UNITS[number - 1]])
    rate = max(LEAST_RATE, min(0xFFFF, round(speed * axis.counts_per_unit)))
    return ServiceFrame(0, 0, 0, axis=number, amount=axis.counts(by), rate=rate, unhomed=unhomed)


def unhomed_most(place: NodePlace, number: int) -> float:
    """How far an axis (from 1) may be jogged that is not homed [mm or degrees]."""
    axis, limits = place.drive.axes[number - 1], axes_of(place.drive)[number - 1]
    counts = min(UNHOMED_COUNTS, (limits.high - limits.low) // 4)
    return min(UNHOMED_MOST, axis.value(counts))


def _check(place: NodePlace, name: str, by: float, *, unhomed: bool) -> None:
    number = place.axis(name)
    axis, unit = place.drive.axes[number - 1], UNITS[number - 1]
    if not abs(by) <= axis.high - axis.low or axis.counts(by) == 0:
        raise InvalidInput(f"{name} cannot be jogged by {by:g} {unit}", f"say a way such as 5, in {unit}")
    report = place.report()
    if report.axes[number - 1]:
        most = unhomed_most(place, number)
        if not unhomed:
            advice = f"home it, or add --unhomed, for {most:.3g} {unit} at most"
            raise InvalidInput(f"node {place.number} does not know where its {name} is", advice)
        if abs(by) > most:
            advice = "home it, and it goes anywhere within its limits"
            raise InvalidInput(f"{name} is not homed: it can be jogged by {most:.3g} {unit} at most", advice)
        return
    end = axis.value(report.position[number - 1]) + by
    if not axis.low <= end <= axis.high:
        there, low, high = beyond(end, axis.low, axis.high)
        raise InvalidInput(f"{name} would go to {there} {unit}", f"its limits are {low} to {high} {unit}")


def info(place: NodePlace) -> NodeInfo:
    """Who a node is, and what it holds; LinkError if it does not answer to its key."""
    report = place.report()
    drive, number = place.drive, place.number
    if report.state is NodeState.BOOT:
        raise halted(place.radio, drive, Halt(Cause.IN_LOADER, number))
    found = ScannedNode(number, drive.addresses[number - 1])
    scan_one(place.radio, found)
    known = place.radio.site.chips[number - 1]
    page = found.pages.get(known) or next(iter(found.pages.values()), None)
    if page is None:
        raise LinkError(f"node {number} answers to its key, but does not say who it is", "ask again", number)
    limits = None
    with suppress(Halted), begun(Inquiry(place.radio, drive, number)) as errand:
        pairs = zip(AXES, drive.axes, strict=True)
        limits = {name: _range(errand, axis, index) for index, (name, axis) in enumerate(pairs, start=1)}
    return NodeInfo(
        node=number,
        address=found.address,
        channel=drive.channel,
        data_rate=drive.data_rate,
        chips=tuple(f"{chip:08x}" for chip in sorted(found.pages)),
        firmware=page.firmware,
        protocol=page.version,
        boot=report.boot,
        limits_fit=page.config_hash == config_hash(axes_of(drive)),
        limits=limits,
        bad_tags=page.bad_tags,
        old_frames=page.old_frames,
    )


def _range(errand: Errand, axis: AxisDrive, number: int) -> tuple[float, float]:
    limits = errand.limits(number)
    return axis.value(limits.low), axis.value(limits.high)


def watch(place: NodePlace, period_s: float = 0.1) -> Iterator[Watched]:
    """What the node says of its motors, ten times a second, for ever."""
    with place.tried() as errand:
        while True:
            motors = errand.motors()
            x, y, z = (errand.axis(number) for number in (1, 2, 3))
            yield Watched(
                counts=motors.counts,
                missed=(x.missed, y.missed, z.missed),
                switches=motors.switches,
                driver_fault=bool(motors.lines & LINE_DRIVER),
                duty=(x.duty, y.duty, z.duty),
                step=x.step,
                supply_mv=motors.supply_mv or None,
            )
            errand.rest(period_s)
