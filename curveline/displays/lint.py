"""What is legal in a display file, but hardly meant: each with the key it is about and what to do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from curveline.displays.capability import (
    Ability,
    Departures,
    Held,
    Leaving,
    buckling_force,
    longest_budget,
    reaches,
    straight_budget,
    undrivable,
)
from curveline.drive_settings import EDGE_CYCLES, MAX_EDGES_PER_S, NODE_HZ
from curveline.material.relaxation import REFERENCE_C, power_law
from curveline.plan_file import MAX_STEP_SECONDS
from curveline.planning.funnels import ANGLES
from curveline.scene import DOWN, Display
from curveline.sections import Rectangle
from curveline.shapes.error_keys import ERROR_KEYS
from curveline.shapes.files import builtin_displays, read_display
from curveline.shapes.radians import look_like_radians
from curveline.units import HOUR, gpa, mm, rounded_down, to_deg, to_gpa, to_mm, told_apart

SPANS = (mm(100.0), mm(3000.0))
"""Spans outside of these are more likely a wrong unit than a display."""
SOFTEST_CLAMP = 0.5
"""Part of the span that a bearing gives as much as, from which on it hardly holds the rod's direction."""
LARGEST_CLAMP = 0.2
"""Share of the span from which on a bearing leaves little rod to bend."""
LEAST_EXCESS = 0.02
"""Rod beyond the span, as a fraction of it, below which curves are flat and their states hard to tell apart."""
LEAST_BIAS = min(ANGLES)
"""Angle of nodes below which there is no funnel [rad]."""
COARSE = 0.1
"""Size of an encoder count, in mm or degrees, from which on it is seen in a curve."""
BUSY = 0.5
"""Share of a node's processor beyond which its encoders leave little to control and radio."""
LAST_FREE_CHANNEL = 83
"""The band that is free for all ends at 2483.5 MHz; a channel is a MHz above 2400."""
MODULI = (gpa(1e-3), gpa(1300.0))
"""From the softest rubber to diamond: what lies outside is more likely a wrong unit."""
SETS = (0.05, 0.4)
"""Part of a bend that is set after an hour: outside of these it is hardly that of a rod which springs back."""
ROOM_C = (5.0, 45.0)
"""Temperatures of rooms."""
SMALLEST_PERCENT = 0.5
"""Percent up to which an error hardly matters: it is more likely a part of one."""
ROUNDED = 1e-9
"""Of a number that went to SI and back, as a part."""
FLATTENED = 0.05
"""Share of its bending stiffness that a tube may lose by flattening without a word."""
NO_FUNNEL = "the best of the funnels into one fails"
REFERENCE = "single"
"""The built-in display whose estimates a file of one's own is copied from."""


class Suspicion(NamedTuple):
    """Something odd: a short `code`, the `key` of the file, what is odd about it and what to do."""

    code: str
    key: str
    message: str  # what is odd
    hint: str  # what to do


def suspicions(display: Display, ability: Ability) -> list[Suspicion]:
    """Everything odd about a display whose file is valid; `ability` is what was tried of it."""
    return [
        *_home(display),
        *_departures(ability.departures),
        *_rod_budget(display),
        *_lengths(display, ability.held),
        *_plane(display, ability.leaving),
        *_rod(display, ability.held),
        *_set(display),
        *_geometry(display),
        *_motors(display),
        *_radio(display),
        *_errors(display),
        *_copied(display),
    ]


def _home(display: Display) -> Iterator[Suspicion]:
    """Where every plan begins: level, upright nodes and a straight rod in the plane."""
    limits = display.limits
    how = "every plan passes there: count from where the nodes stand level, with the rod horizontal"
    for key, unit, limit, to in (("height_mm", "mm", limits.height, to_mm), ("angle_deg", "deg", limits.angle, to_deg)):
        if not limit.contains(0.0):
            where = f"{to(limit.low):g} to {to(limit.high):g} {unit} leave out 0"
            yield Suspicion("no-home", f"limits.{key}", where, how)
    if limits.length.low > display.span:
        message = f"the shortest segment, {to_mm(limits.length.low):g} mm, is longer than the straight rod at home"
        yield Suspicion("no-home", "limits.length_mm", message, f"begin at the span, {to_mm(display.span):.10g} mm")
    if display.gravity and display.down != DOWN:
        message = "gravity does not point straight down: shapes can be simulated, in space, but not planned"
        yield Suspicion("no-plan", "gravity", message, "write true if the display stands upright")
    if display.rod.lateral_curvature != 0.0:
        message = "the rod is curved out of the plane: shapes can be simulated, in space, but not planned"
        yield Suspicion("no-plan", "rod.lateral_curvature_per_m", message, "put the rod in with its curve in the plane")


def _departures(departures: Departures) -> Iterator[Suspicion]:
    """Kinds of shapes to which no plan leads from home."""
    for shut, remedy in departures.remedies:
        kinds = "shape" if len(shut) == len(departures.entries) else " and no ".join(entry.kind for entry in shut)
        message = f"from home no {kinds} can be planned; {NO_FUNNEL}: {shut[0].reason}"
        hint = f"with {remedy} a plan leads there"
        otherwise = "no number of motors and limits alone is at fault: take another rod, or other motors"
        key = remedy.partition(" ")[0] or "rod, drive"
        yield Suspicion("no-way", key, message, hint if remedy else otherwise)


def _plane(display: Display, leaving: tuple[Leaving, ...]) -> Iterator[Suspicion]:
    """States that a real rod would leave the plane from."""
    is_strip = isinstance(display.rod.section, Rectangle)
    key, wider = ("width_mm", "rod") if is_strip else ("diameter_mm", "strip")
    for each in leaving:
        lengths = f"{to_mm(each.low):.0f} to {to_mm(each.high):.0f} mm of rod"
        message = f"between level nodes the {each.state} would leave the plane at {lengths}"
        yield Suspicion("leaves-plane", f"rod.{key}", message, f"take a {wider} that is wider across than thick")


def _rod_budget(display: Display) -> Iterator[Suspicion]:
    """Whether the rod reaches across, and for how long segments."""
    total, key = to_mm(display.rod.total_length), "rod.total_length_mm"
    straight, longest = straight_budget(display), longest_budget(display)
    half = 0.5 * display.clamp
    if straight.tail < half:
        message = (
            f"{total:g} mm of rod do not go straight through all nodes, {to_mm(straight.between):g} mm, and bearings"
        )
        yield Suspicion("short-rod", key, message, "take a longer rod: it goes straight at home")
    elif longest.tail < half:
        each = to_mm((display.rod.total_length - display.clamp) / (display.node_count - 1))
        message = f"{total:g} mm of rod leave {each:g} mm for each segment, less than limits.length_mm allows"
        yield Suspicion(
            "short-rod", key, message, "not all segments can be that long at once: mind it, or lower the limit"
        )


def _lengths(display: Display, held: Held) -> Iterator[Suspicion]:
    """Lengths that no rod can have, or hardly bend it, or that the motors do not stand."""
    limits, span, key = display.limits.length, display.span, "limits.length_mm"
    if limits.high <= span:
        longest, across = told_apart(to_mm(limits.high), to_mm(span), 6)
        message = f"even the longest, {longest} mm, does not reach across {across} mm"
        yield Suspicion("out-of-reach", key, message, "no shape is possible: see span_mm")
        return
    if limits.low < span:
        shortest, across = told_apart(to_mm(limits.low), to_mm(span), 6)
        message = f"lengths from {shortest} mm on do not reach across {across} mm"
        yield Suspicion("out-of-reach", key, message, "begin at span_mm")
    if limits.high < span * (1.0 + LEAST_EXCESS):
        message = f"{to_mm(limits.high):g} mm at most leave the rod hardly any length to bend over {to_mm(span):g} mm"
        yield Suspicion("little-slack", key, message, f"allow {to_mm(1.3 * span):.0f} mm or so")
    elif held.shortest is None or held.longest is None:
        message = f"at no length do rod and motors stand a level rod: {held.below or 'it is too short'}"
        yield Suspicion("too-much", key, message, "see [drive] max_force_N, max_moment_Nmm and [rod] max_strain")
    else:
        for length, reason, word in ((held.shortest, held.below, "below"), (held.longest, held.beyond, "beyond")):
            if reason:
                message = f"{word} {to_mm(length):.0f} mm, between level nodes, {reason}"
                yield Suspicion("too-much", key, message, "plans that pass there are refused")


def _rod(display: Display, held: Held) -> Iterator[Suspicion]:
    """Whether the rod may bend as the nodes can ask it to."""
    rod, angle = display.rod, display.limits.angle
    steepest = min(max(abs(angle.low), abs(angle.high)), 0.5 * math.pi)
    arc, allowed = 0.5 * display.span / max(math.sin(steepest), 1e-9), 1.0 / rod.max_curvature
    if allowed > arc:
        may, must = told_apart(to_mm(allowed), to_mm(arc), 0, "f")
        message = f"the rod may bend to a radius of {may} mm, but nodes at {to_deg(steepest):g} deg ask for {must} mm"
        gentle = rounded_down(to_deg(math.asin(min(0.5 * display.span / allowed, 1.0))), 3)
        lower = f"lower limits.angle_deg to {gentle:g} deg either way, or " if gentle >= to_deg(LEAST_BIAS) else ""
        yield Suspicion("stiff-rod", "rod.max_strain", message, f"{lower}take a thinner rod")
    if not MODULI[0] <= rod.youngs_modulus <= MODULI[1]:
        message = f"the rod's material has a modulus of {to_gpa(rod.youngs_modulus):.2g} GPa"
        yield Suspicion("odd-stiffness", f"rod.{rod.stiffness_key}", message, "see the units of stiffness and sizes")
    if (softer := rod.section.softening(rod.max_curvature)) > FLATTENED:
        message = f"bent as far as max_strain allows, the tube flattens and is {100.0 * softer:.0f} % softer"
        hint = "that is not modelled: take a thicker wall, or lower max_strain"
        yield Suspicion("thin-tube", "rod.inner_diameter_mm", message, hint)
    if rod.profile is not None and max(map(abs, rod.profile.values)) > rod.max_curvature:
        message = "the free rod is curved so much somewhere that going straight would strain it beyond max_strain"
        yield Suspicion("curved-rod", "rod.natural_curvature_along", message, "is it in 1/m, and its places in mm?")
    if abs(rod.natural_curvature) > rod.max_curvature:
        message = "the free rod is curved so much that going straight would strain it beyond max_strain"
        yield Suspicion("curved-rod", "rod.natural_curvature_per_m", message, "is it in 1/m?")
    if display.gravity and rod.mass_per_length == 0.0:
        yield Suspicion("no-weight", "rod.mass_g_per_m", "gravity acts on a rod without mass", "weigh the rod")
    needed = buckling_force(display)
    if needed > display.drive.max_force and not held.below:
        gives, takes = told_apart(display.drive.max_force, needed, 3)
        message = f"the motors give {gives} N, and the straight rod buckles at {takes} N"
        yield Suspicion("weak-motor", "drive.max_force_N", message, "extruding may stall before the rod gives way")


def _set(display: Display) -> Iterator[Suspicion]:
    """A set that hardly any rod takes, or one that was not measured."""
    law = display.rod.relaxation
    if law is None:
        return
    after = law.set_after(HOUR, REFERENCE_C)
    if not SETS[0] <= after <= SETS[1]:
        message = f"held in a shape for an hour, at {REFERENCE_C:g} C, the rod keeps {100.0 * after:.2g} % of the bend"
        hint = "times are in seconds, and a strength of 1 is that of acetal: `curveline calibrate set` measures it"
        yield Suspicion("odd-set", "rod.set_strength", message, hint)
    if replace(law, temperature=REFERENCE_C) == power_law():
        message = "what set the rod takes is the estimate for acetal, and may be a third off"
        yield Suspicion("not-measured", "rod.set_strength", message, "measure it with `curveline calibrate set`")
    if not ROOM_C[0] <= law.temperature <= ROOM_C[1]:
        message = f"a display at {law.temperature:g} C stands in no room"
        yield Suspicion("odd-temperature", "rod.temperature_C", message, "is it in degrees Celsius?")


def _geometry(display: Display) -> Iterator[Suspicion]:
    """Numbers that look like those of another unit, or another display."""
    span, clamp = display.span, display.clamp
    angle = display.limits.angle
    ends = [float(f"{to_deg(end):.12g}") for end in (angle.low, angle.high)]
    if look_like_radians(ends):
        message = f"{ends[0]:g} to {ends[1]:g} look like radians, and are taken as degrees"
        hint = f"is it in degrees? {ends[1]:g} rad would be {to_deg(ends[1]):.4g} deg"
        yield Suspicion("radians", "limits.angle_deg", message, hint)
    if not SPANS[0] <= span <= SPANS[1]:
        yield Suspicion("odd-span", "span_mm", f"the nodes stand {to_mm(span):g} mm apart", "is it in mm?")
    if clamp == 0.0:
        message = "the bearings hold no rod: such point clamps are the paper's model, not what a node has"
        yield Suspicion("point-clamp", "clamp_mm", message, "measure how much rod a bearing holds straight")
    elif clamp > LARGEST_CLAMP * span:
        message = f"the bearings hold {to_mm(clamp):g} mm of every {to_mm(span):g} mm straight"
        yield Suspicion(
            "long-clamp", "clamp_mm", message, "count the rod in one bearing, both sides of its pivot together"
        )
    give = display.rod.bending_stiffness / display.clamp_stiffness
    if give > SOFTEST_CLAMP * span:
        message = f"a bearing gives as much as {to_mm(give):.3g} mm of rod, of a span of {to_mm(span):g} mm"
        yield Suspicion("soft-clamp", "clamp_stiffness_Nmm_per_deg", message, "is it in N mm per degree?")


def _motors(display: Display) -> Iterator[Suspicion]:
    """Positions that cannot be sent or told, counts that are coarse, ways that take too long for one step."""
    if fault := undrivable(display):
        yield Suspicion("no-plan", "drive", fault, "correct counts_per_turn, the ways per turn and the speeds")
    edges = math.fsum(reach.drive.counts_per_unit * reach.drive.speed for reach in reaches(display))
    if edges > BUSY * MAX_EDGES_PER_S:
        share = 100.0 * edges * EDGE_CYCLES / NODE_HZ
        message = f"at full speed counting {edges:.0f} edges/s takes {share:.0f} % of a node's processor"
        yield Suspicion(
            "busy-node", "drive.counts_per_turn", message, "count fewer edges per turn, or lower the speeds"
        )
    for reach in reaches(display):
        key = f"drive, {reach.name}"
        farthest = f"{max(abs(reach.low), abs(reach.high)):g} {reach.unit}"
        if not reach.fits_target:
            message = f"{farthest} are {max(map(abs, reach.counts))} counts, which do not fit 24 bits"
            yield Suspicion("out-of-counts", key, message, "lower the limits, or gear the motor differently")
        elif not reach.fits_status:
            message = f"a node can tell of {reach.status_end:.0f} {reach.unit}, but the limits ask for {farthest}"
            yield Suspicion("out-of-status", key, message, "what lies beyond is refused: lower the limits")
        if 1.0 / reach.drive.counts_per_unit > COARSE:
            message = f"one encoder count is {1.0 / reach.drive.counts_per_unit:.2g} {reach.unit}"
            yield Suspicion("coarse-count", key, message, "count turns of the gearbox's output, not of the motor")
        if reach.seconds > MAX_STEP_SECONDS:
            message = (
                f"{reach.way:g} {reach.unit} take {reach.seconds:.0f} s, and a step {MAX_STEP_SECONDS:.1f} s at most"
            )
            yield Suspicion("slow-axis", key, message, "plans that go so far in one step are refused")


def _radio(display: Display) -> Iterator[Suspicion]:
    """Frequencies and addresses that radios may, but should not, be set to."""
    channel = display.radio.channel
    if channel > LAST_FREE_CHANNEL:
        message = f"channel {channel} is {2400 + channel} MHz, beyond the band that is free for all"
        yield Suspicion("off-band", "radio.channel", message, f"choose {LAST_FREE_CHANNEL} or less")
    for node, address in enumerate(display.radio.addresses, start=1):
        if len({address[i : i + 2] for i in range(0, len(address), 2)} - {"00", "FF", "55", "AA"}) == 0:
            message = f"address {address} of node {node} looks like noise or a preamble on the air"
            yield Suspicion("noisy-address", "radio.addresses", message, "take bytes other than 00, 55, AA and FF")


def _errors(display: Display) -> Iterator[Suspicion]:
    """Ranges in another unit than percent, or that leave out what the file itself says."""
    said = {"clamp_stiffness": display.clamp_stiffness, "clamp_play": display.clamp_play, "clamp": display.clamp}
    for field, drawn in display.errors.given.items():
        key, name, unit, _, back = ERROR_KEYS[field]
        low, high = back(drawn.low), back(drawn.high)
        if unit == " %" and 0.0 < max(abs(low), abs(high)) < SMALLEST_PERCENT:
            message = f"{low:g} to {high:g} % is next to nothing"
            hint = f"is it in percent? As parts it would be {100.0 * low:g} to {100.0 * high:g} %"
            yield Suspicion("odd-error", f"errors.{key}", message, hint)
        if field in said and not drawn.low * (1.0 - ROUNDED) <= said[field] <= drawn.high * (1.0 + ROUNDED):
            message = f"{name} is {low:g} to {high:g}{unit} in truth, which leaves out the {back(said[field]):g} above"
            hint = "put that right: plans are made for what the file says, and errors are around it"
            yield Suspicion("off-file", f"errors.{key}", message, hint)


def _copied(display: Display) -> Iterator[Suspicion]:
    """What a display of one's own took over from the built-in one: its name, and what is an estimate there."""
    if not display.path:
        return
    if display.name in builtin_displays():
        message = f"{display.name} is a built-in display, too"
        hint = "give yours a name of its own: plans and mock displays go by it"
        yield Suspicion("builtin-name", "name", message, hint)
    mine, theirs = _measurable(display), _measurable(read_display(REFERENCE))
    same = [key for key, value in mine.items() if key in theirs and math.isclose(value, theirs[key], rel_tol=1e-9)]
    if same:
        message = f"as in the built-in file, where {'they are estimates' if len(same) > 1 else 'it is an estimate'}"
        yield Suspicion("not-measured", ", ".join(same), message, "measure yours, and write down what you measured")


def _measurable(display: Display) -> dict[str, float]:
    """What is to be measured on a display, by its key; to compare, whatever the unit."""
    rod, drive = display.rod, display.drive
    return {
        f"rod.{rod.stiffness_key}": rod.as_given[rod.stiffness_key],
        **{f"rod.{key}": size for key, size in rod.section.sizes_mm.items() if key != "width_mm"},
        "rod.mass_g_per_m": rod.mass_per_length,
        "drive.max_force_N": drive.max_force,
        "drive.max_moment_Nmm": drive.max_moment,
    }
