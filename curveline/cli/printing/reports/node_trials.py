"""What was found out about one node that is being tried out, as text for terminals of 80 columns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from curveline.calibrating.step_response import BOUNDS, SHIPPED, Tuning
from curveline.cli.printing import screen
from curveline.drive_settings import AXES, UNITS
from curveline.driving.node_calibration import Calibration
from curveline.driving.node_check import AxisCheck, Finding, NodeCheck
from curveline.driving.node_errands import Jogged, NodeInfo, Watched
from curveline.driving.node_switch import SwitchCheck
from curveline.driving.one_node import OneNode
from curveline.phrases import wrapped
from curveline.radio.host.stop_causes import display_option


def describe_info(node: OneNode, info: NodeInfo) -> Iterator[str]:
    """Who a node is."""
    yield f"node {info.node} of display {node.drive.display} over {node.spec}"
    yield f"  address {info.address}, channel {info.channel}, {info.data_rate}"
    yield f"  chip {' and '.join(info.chips)}; firmware {info.firmware}, protocol {info.protocol}, boot {info.boot}"
    if len(info.chips) > 1:
        yield f"  {len(info.chips)} devices answer on this address: switch one off"
    if info.limits is None:
        yield "  limits: it does not tell them"
    for name, unit, ends in zip(AXES, UNITS, (info.limits or {}).values(), strict=False):
        yield f"  {name}: {screen.decimal(ends[0], 1)} to {screen.decimal(ends[1], 1)} {unit}"
    if not info.limits_fit:
        option = display_option(node.display)
        yield "  these are not the limits and speeds of the display file, which it gets by"
        yield f"  `curveline node settings {info.node}{option}`"
    yield f"  frames that it refused: {info.bad_tags} under another key, {info.old_frames} old ones"


def describe_jog(number: int, gone: Jogged) -> Iterator[str]:
    """How far an axis went."""
    place = "" if gone.position is None else f", to {screen.decimal(gone.position)}"
    yield f"node {number}: {gone.axis} went {gone.way:+.2f} {gone.unit}{place}"
    yield f"  at most {gone.lag:.2f} {gone.unit} behind its set-point"


def describe_watched(seen: Watched) -> Iterator[str]:
    """A moment of a node."""
    rows = [("axis", "counts", "missed", "switch", "duty")]
    for index, name in enumerate(AXES):
        switch = "closed" if seen.switches[index] else "open"
        duty = f"{seen.duty[index] / 10:.0f} %"
        rows.append((name, str(seen.counts[index]), str(seen.missed[index]), switch, duty))
    yield from screen.table(rows)
    supply = "not measured" if seen.supply_mv is None else f"{seen.supply_mv / 1000:.2f} V"
    yield f"drivers: {'FAULT' if seen.driver_fault else 'no fault'}; supply: {supply}; step {seen.step}"


def describe_check(node: OneNode, found: NodeCheck) -> Iterator[str]:
    """What a check found."""
    yield f"node {found.node} of display {node.drive.display} over {node.spec}: {_verdict(found)}"
    yield from _findings(found.findings)
    for each in found.axes:
        yield from _axis(each)


def describe_switch(node: OneNode, found: SwitchCheck) -> Iterator[str]:
    """What a switch did."""
    verdict = f"{found.axis}'s switch works" if found.is_well else "one thing is wrong"
    yield f"node {node.number} of display {node.drive.display} over {node.spec}: {verdict}"
    yield f"  {', then '.join('closed' if each else 'open' for each in found.closed)}"
    yield from _findings(found.findings)


def _verdict(found: NodeCheck) -> str:
    count = len(found.findings) + sum(len(each.findings) for each in found.axes)
    return "all is well" if count == 0 else "one thing is wrong" if count == 1 else f"{count} things are wrong"


def _axis(each: AxisCheck) -> Iterator[str]:
    index = AXES.index(each.axis)
    unit = UNITS[index]
    counts = f"{each.forward[index]:+d} and {each.backward[index]:+d} counts"
    yield f"  {each.axis}: {counts}, {each.missed} edges missed"
    yield from _findings(each.findings)
    if each.is_well:
        there, back = (f"{100 * duty:.1f} %" for duty in each.start_duty)
        lag = "" if each.lag is None else f"; closed loop at most {each.lag:.2f} {unit} behind"
        yield f"    starts at {there} and {back} of full duty{lag}"


def _findings(findings: Iterable[Finding]) -> Iterator[str]:
    for each in findings:
        yield from wrapped(f"{each.code}: {each.text}", 4)
        yield from wrapped(f"what to do: {each.hint}", 4)


def describe_calibration(node: OneNode, found: Calibration) -> Iterator[str]:
    """What a ruler said."""
    yield f"node {node.number}: {found.axis}, measured {len(found.measured)} times"
    for way, said in zip(found.ways, found.measured, strict=True):
        yield f"  by its counts {way:.2f} {found.unit}, by the ruler {said:.2f}"
    error = "" if found.error is None else f" +- {found.error:.2g}"
    yield f"  {found.key} = {found.new:g}{error}; the file says {found.old:g}"
    yield from _findings(found.findings)


def describe_tuning(found: Tuning) -> Iterator[str]:
    """What a motor is like."""
    yield f"node {found.node}: the motor of {found.axis}"
    yield f"  {found.gain:.0f} counts/s at full duty, {100 * found.friction:.1f} % of it against friction"
    yield f"  time constant {1000 * found.time_constant:.1f} ms"
    rows = [("gain", "suggested", "shipped", "bounds")]
    for name, value in found.gains.items():
        low, high = BOUNDS[name]
        rows.append((name, f"{value}{'*' if name in found.cut else ''}", str(SHIPPED[name]), f"{low} to {high}"))
    yield from screen.table(rows)
    if found.cut:
        yield "* would lie beyond its bounds: look at the motor, its gear and its supply first"
