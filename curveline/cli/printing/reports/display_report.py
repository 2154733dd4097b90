"""What a check of a display found, as text."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence

from curveline.cli.printing import screen
from curveline.cli.printing.tables import fitting
from curveline.displays.capability import AxisReach, Held, longest_budget, reaches, straight_budget
from curveline.displays.check import DisplayCheck, clamp_stiffness_as_given, offsets_as_given, rod_document
from curveline.material.history import duration_text
from curveline.phrases import wrapped
from curveline.scene import Display
from curveline.shapes.error_keys import in_words
from curveline.units import to_deg, to_mm

AXIS_HEAD = ("axis", "from", "to", "unit", "counts", "per unit", "per s", "takes s")
BUDGET_HEAD = ("rod, mm", "a segment", "all of them", "each tail")


def describe(checked: DisplayCheck) -> Iterator[str]:
    """Lines of text: the row of nodes, its rod, budget, axes, what is held, the radio, and what looks odd."""
    display, ability = checked.display, checked.ability
    yield screen.paint(display.name, screen.BOLD, sys.stdout)
    yield display.path or "built in"
    across = to_mm((display.node_count - 1) * display.span)
    bearing = f"{to_mm(display.clamp):g} mm of rod in each bearing"
    yield f"{display.node_count} nodes, {to_mm(display.span):g} mm apart, {across:g} mm across; {bearing}"
    if stiffness := clamp_stiffness_as_given(display):
        yield f"bearings tilt by one degree under {stiffness:g} N mm"
    if display.clamp_play > 0.0:
        yield f"bearings tilt by {to_deg(display.clamp_play):g} deg either way at no moment"
    if ranges := in_words(display.errors):
        yield from wrapped(f"may be in truth, the same in a whole run: {ranges}")
    yield from _offset_lines(display)
    yield from _rod_lines(display)
    yield from _table(BUDGET_HEAD, list(_budget_rows(display)))
    yield from _axis_lines(display)
    yield from wrapped(f"level nodes: {_held_text(ability.held)}")
    if (entries := ability.departures.entries) and all(entry.is_open for entry in entries):
        yield "from home a plan leads to every kind of shape"
    radio = display.radio
    yield f"radio: channel {radio.channel} ({2400 + radio.channel} MHz), {radio.data_rate}, addresses"
    yield from wrapped(" ".join(radio.addresses), 2, hang=0)
    for each in checked.warnings:
        yield from wrapped(f"warning[{each.code}]: {each.key}: {each.message}")
        yield from wrapped(f"hint: {each.hint}", 2)
    if not checked.warnings:
        yield "nothing looks odd"


def _offset_lines(display: Display) -> Iterator[str]:
    given = offsets_as_given(display)
    if turned := given.get("angle_deg"):
        yield from wrapped(f"nodes turn further than they are told by {', '.join(f'{each:g}' for each in turned)} deg")
    if longer := given.get("length_mm"):
        yield from wrapped(f"segments have more rod than told by {', '.join(f'{each:g}' for each in longer)} mm")


def _rod_lines(display: Display) -> Iterator[str]:
    rod = rod_document(display)
    modulus = f"E {rod['youngs_modulus_GPa']:.3g} GPa, G {rod['shear_modulus_GPa']:.3g} GPa"
    source = ", from the bending stiffness as measured" if display.rod.is_stiffness_measured else ""
    yield from wrapped(f"{display.rod.section}; {modulus}{source}")
    stiffness = f"bending {rod['bending_stiffness_Nm2']:.3g} N m2, twisting {rod['twisting_stiffness_Nm2']:.3g} N m2"
    yield from wrapped(f"stiffness: {stiffness}, stretching {rod['stretching_stiffness_N']:.3g} N")
    weight = f"weight {rod['weight_N_per_m']:.3g} N/m"
    bends = f"bends to a radius of {rod['smallest_radius_mm']:.0f} mm at least"
    yield f"{weight}; {bends}"
    yield f"buckles at {rod['buckling_force_N']:.3g} N when it goes straight from node to node"
    yield from _bent_lines(rod["natural_curvature"])
    if taken := rod["set"]:
        parts = [f"{100.0 * each['fraction']:.0f} % after {duration_text(each['held_s'])}" for each in taken["after"]]
        yield from wrapped(f"of a bend that is held it keeps {', '.join(parts)}, at {taken['temperature_C']:g} C")


def _budget_rows(display: Display) -> Iterator[tuple[str, ...]]:
    lengths = (("straight, at home", display.span), ("longest segments", display.limits.length.high))
    budgets = (straight_budget(display), longest_budget(display))
    for (name, length), budget in zip(lengths, budgets, strict=True):
        yield name, *(f"{to_mm(value):.0f}" for value in (length, budget.between, budget.tail))


def _axis_lines(display: Display) -> Iterator[str]:
    found = reaches(display)
    yield from _table(AXIS_HEAD, list(map(_axis_cells, found)), frozenset({0, 3}))
    if all(reach.fits_target and reach.fits_status for reach in found):
        yield f"counts fit the 24 bits of a target, and a status, which tells {found[0].status_end:.0f} mm at most"
    else:
        yield f"counts do NOT all fit: a target has 24 bits, a status tells {found[0].status_end:.0f} mm at most"


def _held_text(held: Held) -> str:
    if held.shortest is None or held.longest is None:
        return "rod and motors stand no length of rod"
    ends = f"rod and motors stand {to_mm(held.shortest):.0f} to {to_mm(held.longest):.0f} mm of rod"
    reasons = (("below", held.below), ("beyond", held.beyond))
    limits = [f"{word}, {reason}" for word, reason in reasons if reason]
    return f"{ends}; {'; '.join(limits)}" if limits else f"{ends} between two, in every state"


def _axis_cells(reach: AxisReach) -> tuple[str, ...]:
    low, high = reach.counts
    return (
        reach.name,
        f"{reach.low:g}",
        f"{reach.high:g}",
        reach.unit,
        f"{low} to {high}",
        f"{reach.drive.counts_per_unit:.4g}",
        f"{reach.drive.speed:g}",
        f"{reach.seconds:.1f}",
    )


def _bent_lines(bent: Mapping[str, float]) -> Iterator[str]:
    """How the free rod is bent, if it is."""
    least, most = bent["least_along_per_m"], bent["most_along_per_m"]
    if bent["uniform_per_m"]:
        yield f"the free rod is bent by {bent['uniform_per_m']:.3g} 1/m"
    if least or most:
        also = " besides" if bent["uniform_per_m"] else ""
        yield f"along its length the free rod is bent by {least:.3g} to {most:.3g} 1/m{also}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], left: frozenset[int] = frozenset({0})) -> Iterator[str]:
    yield from screen.headed(fitting([head, *rows], left), head, rows)
