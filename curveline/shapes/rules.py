"""What must hold between the numbers of a shape or display file; each rule runs on whatever part of the file is sound.

Rules record problems in the document. Lengths in mm, angles in degrees, as in the files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from curveline.drive_settings import MAX_EDGES_PER_S
from curveline.phrases import counted
from curveline.scene import STRAIGHT, Display, Range, Vector
from curveline.shapes.key_units import unit_of
from curveline.shapes.profile_rules import check_profile
from curveline.shapes.rod_rules import check_rod
from curveline.shapes.toml_document import Document, shown
from curveline.shapes.toml_location import KeyPath
from curveline.units import TAUT, between, beyond, deg, rounded_down, rounded_up, to_deg, to_mm, told_apart

_SLACK = 1e-9
"""Relative allowance for a limit that went to SI and back."""
DIGITS = 6
"""Significant digits that `:g` prints."""


def check_display(document: Document) -> None:
    """Record what does not fit together in a display file."""
    check_name(document)
    for key in ("height_mm", "angle_deg", "length_mm", "yaw_deg", "roll_deg"):
        _check_limits(document, key)
    _check_gravity(document)
    _check_clamp(document)
    _check_addresses(document)
    _check_edges(document)
    _check_offsets(document)
    check_rod(document)
    check_profile(document)


def check_shape(document: Document, display: Display | None) -> None:
    """Record what does not fit together in a shape file, or does not fit `display` if that is known."""
    check_name(document)
    _check_counts(document, display)
    _check_loads(document, display)
    if display is not None:
        limits = display.limits
        for node in range(_count(document, "nodes")):
            _check_limit(document, ("nodes", node, "height_mm"), limits.height)
            _check_limit(document, ("nodes", node, "angle_deg"), limits.angle)
            _check_limit(document, ("nodes", node, "yaw_deg"), limits.yaw)
            _check_limit(document, ("nodes", node, "roll_deg"), limits.roll)
        for segment in range(_count(document, "segments")):
            _check_limit(document, ("segments", segment, "length_mm"), limits.length)
            _check_reach(document, segment, display)
        _check_total(document, display)


def check_name(document: Document) -> None:
    """Record a name that would make an empty or a garbled line in a report."""
    name = document.get("name")
    if name is None:
        return
    if not name.strip():
        document.problem(("name",), "bad-name", "the name is empty", "give it a name, such as the file's")
    elif not name.isprintable():
        hint = "use letters, digits, spaces and signs, on one line"
        document.problem(("name",), "bad-name", f"the name {shown(name)} has characters that cannot be shown", hint)


def _check_limits(document: Document, key: str) -> None:
    low, high = document.number("limits", key, 0), document.number("limits", key, 1)
    if low is None or high is None or low < high:
        return
    # A node that cannot turn out of the plane or about the rod has [0, 0] there; a motor has some range.
    if low > high or key not in ("yaw_deg", "roll_deg"):
        first, last = told_apart(low, high, 6)
        message = f"{key} starts at {first}{unit_of(key)}, which is not below its end, {last}{unit_of(key)}"
        document.problem(("limits", key), "empty-range", message, "write [lowest, highest]")


def _check_gravity(document: Document) -> None:
    components = [document.number("gravity", axis) for axis in range(3)]
    if components == [0.0, 0.0, 0.0]:
        hint = "write false for no weight, or a direction: [0, -1, 0] is straight down, [0, 0, -1] away from the viewer"
        document.problem(("gravity",), "no-direction", "gravity is [0, 0, 0], which has no direction", hint)


def _check_clamp(document: Document) -> None:
    clamp, span = document.number("clamp_mm"), document.number("span_mm")
    if clamp is not None and span is not None and clamp >= span:
        held, across = told_apart(clamp, span, 6)
        message = f"clamp_mm is {held} mm, which is not below the span of {across} mm"
        document.problem(("clamp_mm",), "out-of-range", message, "neighbouring bearings must leave some rod free")


def _check_addresses(document: Document) -> None:
    nodes, addresses = document.number("nodes"), document.get("radio", "addresses")
    if addresses is None:
        return
    if nodes is not None and len(addresses) != nodes:
        message = f"addresses lists {len(addresses)} for {nodes:g} nodes"
        document.problem(("radio", "addresses"), "address-count", message, "list one address per node, left to right")
    seen: dict[str, int] = {}
    for index in range(len(addresses)):
        address = document.get("radio", "addresses", index)
        if address is None:
            continue
        first = seen.setdefault(address.upper(), index)
        if first != index:
            message = f"address {address} is that of node {first + 1} already"
            path: KeyPath = ("radio", "addresses", index)
            document.problem(path, "duplicate-address", message, "give every node an address of its own")


def _check_edges(document: Document) -> None:
    """A node must be able to count the edges of its three encoders while all motors run at full speed."""
    path: KeyPath = ("drive", "counts_per_turn")
    counts = document.number(*path)
    turns = [_turns_per_second(document, *each) for each in (("extrude", "mm"), ("translate", "mm"), ("bias", "deg"))]
    if counts is None or None in turns:
        return
    fastest = math.fsum(filter(None, turns))
    edges = counts * fastest
    if edges <= MAX_EDGES_PER_S:
        return
    bring, takes = told_apart(edges, MAX_EDGES_PER_S, 6)
    message = f"at full speed the three encoders bring {bring} edges/s together, and a node can count {takes}"
    most = rounded_down(MAX_EDGES_PER_S / fastest, DIGITS)
    hint = f"at these speeds counts_per_turn may be {most:g} at most: count fewer edges per turn, or lower the speeds"
    document.problem(path, "too-many-edges", message, hint)


def _check_offsets(document: Document) -> None:
    nodes = document.number("nodes")
    for key, what, fewer in (("angle_deg", "node", 0), ("length_mm", "segment", 1)):
        given = document.get("offsets", key)
        if nodes is None or given is None or len(given) == int(nodes) - fewer:
            continue
        message = f"{key} lists {len(given)} for {counted(int(nodes) - fewer, what)}"
        document.problem(("offsets", key), "offset-count", message, f"list one per {what}, left to right")


def _turns_per_second(document: Document, axis: str, unit: str) -> float | None:
    """How fast the gearbox of an axis turns at its full speed; None if the file does not say, or not well."""
    speed = document.number("drive", f"{axis}_{unit}_per_s")
    way = document.number("drive", f"{axis}_{unit}_per_turn")
    return None if speed is None or way is None else speed / way


def _check_counts(document: Document, display: Display | None) -> None:
    nodes, segments = document.get("nodes"), document.get("segments")
    if nodes is not None and display is not None and len(nodes) != display.node_count:
        message = f"{counted(len(nodes), 'node')}, but display {display.name} has {display.node_count}"
        hint = f"list {display.node_count} nodes, or choose another display"
        document.problem(("nodes",), "node-count", message, hint)
    if nodes is not None and segments is not None and len(segments) != max(0, len(nodes) - 1):
        message = f"{counted(len(segments), 'segment')} between {counted(len(nodes), 'node')}"
        hint = f"list {max(0, len(nodes) - 1)}: one segment between neighbouring nodes"
        document.problem(("segments",), "segment-count", message, hint)


def _check_limit(document: Document, path: KeyPath, limit: Range) -> None:
    value, key = document.number(*path), str(path[-1])
    if value is None:
        return
    back = to_deg if key.endswith("_deg") else to_mm
    low, high = back(limit.low), back(limit.high)
    slack = _SLACK * max(abs(low), abs(high))
    if low - slack <= value <= high + slack:
        return
    unit = unit_of(key)
    given, least, most = beyond(value, low, high)
    bound = f"below the display's limit of {least}" if value < low else f"above the display's limit of {most}"
    where = f"{str(path[0])[:-1]} {int(path[1]) + 1}"
    hint = f"choose {rounded_up(low, DIGITS):g} to {rounded_down(high, DIGITS):g}{unit}"
    document.problem(path, "out-of-range", f"{where}: {key} is {given}{unit}, {bound}{unit}", hint)


def _check_reach(document: Document, segment: int, display: Display) -> None:
    """The free rod must be longer than the straight line between the faces of its clamps, or as long to be straight."""
    path: KeyPath = ("segments", segment, "length_mm")
    length = document.number(*path)
    start, end = _clamp_face(document, segment, display, 0.5), _clamp_face(document, segment + 1, display, -0.5)
    if length is None or start is None or end is None:
        return
    span, clamp = to_mm(display.span), to_mm(display.clamp)
    shortest = math.hypot(span + end[0] - start[0], end[1] - start[1], end[2] - start[2]) + clamp
    shortest -= to_mm(display.offsets.length(segment))
    state = document.get("segments", segment, "state")
    least = shortest - (0.0 if state not in (STRAIGHT, None) else to_mm(TAUT))
    if length > least:
        return
    # The hint is a length that passes, with one decimal: rounded up, and never onto the bound itself.
    enough = math.floor(shortest * 10.0 + 1.0) / 10.0
    given, straight = told_apart(length, shortest, 6)
    message = f"segment {segment + 1}: {given} mm of rod are too short: {straight} mm go straight from node to node"
    longer = f"make length_mm at least {enough:g} to reach, more to bend, or "
    if state == STRAIGHT:
        longer = f"make length_mm {straight} to go straight, or "
    elif length > shortest - to_mm(TAUT):
        longer = f'{longer[:-3]}write state = "{STRAIGHT}", or '
    hint = f"{longer if enough <= to_mm(display.limits.length.high) else ''}bring heights and angles closer together"
    document.problem(path, "too-short", message, hint)


def _clamp_face(document: Document, node: int, display: Display, side: float) -> Vector | None:
    """Where the rod leaves a node's clamp, seen from the foot of its rail [mm]; `side` counts clamp lengths."""
    height, angle = document.number("nodes", node, "height_mm"), document.number("nodes", node, "angle_deg")
    yaw = document.number("nodes", node, "yaw_deg") or 0.0
    if height is None or angle is None:
        return None
    reach = side * to_mm(display.clamp)
    flat, turned = reach * math.cos(deg(yaw)), deg(angle) + display.offsets.angle(node)
    return flat * math.cos(turned), height + flat * math.sin(turned), reach * math.sin(deg(yaw))


def _check_total(document: Document, display: Display) -> None:
    lengths = [length for _, length in _lengths(document)]
    total, available = math.fsum(lengths), to_mm(display.rod.total_length)
    if total > available * (1.0 + _SLACK):
        taken, there = told_apart(total, available, 6)
        message = (
            f"the segments take {taken} mm of rod together, but the rod is {there} mm long: centred, it would "
            f"leave tails of {0.5 * (available - total):g} mm at both ends"
        )
        hint = (
            f"take {rounded_up(total - available, DIGITS):g} mm off the segments, or choose a display with a longer rod"
        )
        document.problem(("segments",), "too-long", message, hint)


def _check_loads(document: Document, display: Display | None) -> None:
    lengths = dict(_lengths(document))
    segments = document.get("segments")
    for index in range(_count(document, "loads")):
        segment, at = document.number("loads", index, "segment"), document.number("loads", index, "at")
        if segments is not None and segment is not None and segment > len(segments):
            message = (
                f"load {index + 1} is on segment {segment:g}, but the shape has {counted(len(segments), 'segment')}"
            )
            hint = "segments are numbered from 1, from the left"
            document.problem(("loads", index, "segment"), "out-of-range", message, hint)
        elif display is not None and segment is not None and at is not None and int(segment) - 1 in lengths:
            _check_load_is_free(document, index, lengths[int(segment) - 1], display)


def _check_load_is_free(document: Document, index: int, length: float, display: Display) -> None:
    at, clamp = document.number("loads", index, "at"), to_mm(display.clamp)
    if at is None or clamp / 2.0 < at * length < length - clamp / 2.0:
        return
    message = f"load {index + 1} acts {at * length:g} mm along a segment of {length:g} mm, inside a node's bearing"
    free = clamp / 2.0 / length
    low, high = between(free, 1.0 - free, 4)
    hint = f"choose `at` from {low:g} to {high:g}"
    document.problem(("loads", index, "at"), "out-of-range", message, hint)


def _lengths(document: Document) -> Iterator[tuple[int, float]]:
    """Number, from 0, and length of every segment that has one [mm]."""
    for segment in range(_count(document, "segments")):
        length = document.number("segments", segment, "length_mm")
        if length is not None:
            yield segment, length


def _count(document: Document, key: str) -> int:
    items = document.get(key)
    return 0 if items is None else len(items)
