"""`curveline display check`: what is wrong with a display file, what the display can do, and what looks odd."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from curveline.cli import completion
from curveline.cli.options import JsonOption
from curveline.cli.printing import screen
from curveline.cli.printing.tables import fitting
from curveline.phrases import wrapped
from curveline.units import to_mm

if TYPE_CHECKING:
    from curveline.displays.capability import Ability, AxisReach, Budget, Leaving
    from curveline.displays.lint import Suspicion
    from curveline.planning.reachability import Access
    from curveline.scene import Display

AXIS_HEAD = ("axis", "from", "to", "unit", "counts", "per unit", "per s", "takes s")
BUDGET_HEAD = ("rod, mm", "a segment", "all of them", "each tail")


def check(
    file: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            help="A display file (.toml), or a built-in display.",
        ),
    ],
    json: JsonOption = False,
) -> None:
    """Check a display file and say what the display can do.

    Every problem of the file is listed, with exit code 2. A file without problems gives the rod's stiffness, the rod
    left for the tails, the reach of the motors in encoder counts, the lengths of rod that they hold between level
    nodes, and a warning for everything that is legal but looks odd.
    """
    from curveline.displays.capability import ability_of
    from curveline.displays.lint import suspicions
    from curveline.shapes.files import given_display

    display = given_display(file)
    screen.announce_compilation()
    ability = ability_of(display)
    checked = _Checked(display, ability, suspicions(display, ability))
    if json:
        screen.emit(checked.document())
    else:
        screen.result("\n".join(checked.lines()))


class _Checked(NamedTuple):
    """A display that was checked."""

    display: Display
    ability: Ability
    odd: list[Suspicion]

    def document(self) -> dict[str, Any]:
        """All that was found as plain data."""
        from curveline._version import __version__
        from curveline.displays.capability import longest_budget, reaches, straight_budget

        display, held = self.display, self.ability.held
        return {
            "curveline": __version__,
            "display": display.name,
            "file": display.path or None,
            "nodes": display.node_count,
            "span_mm": to_mm(display.span),
            "clamp_mm": to_mm(display.clamp),
            "gravity": list(display.down) if display.gravity else None,
            "rod": self._rod(),
            "budget": {
                "straight": _budget_document(straight_budget(display)),
                "longest": _budget_document(longest_budget(display)),
            },
            "axes": [_axis_document(reach) for reach in reaches(display)],
            "level_lengths_mm": [_mm_or_none(held.shortest), _mm_or_none(held.longest)],
            "leaves_plane": [_leaving_document(each) for each in self.ability.leaving],
            "from_home": [_entry_document(entry) for entry in self.ability.departures.entries],
            "radio": {
                "channel": display.radio.channel,
                "data_rate": display.radio.data_rate,
                "addresses": list(display.radio.addresses),
            },
            "warnings": [each._asdict() for each in self.odd],
        }

    def _rod(self) -> dict[str, Any]:
        """The rod as plain data."""
        from curveline.displays.capability import buckling_force

        rod = self.display.rod
        return {
            "section": type(rod.section).__name__.lower(),
            "stiffness_from": rod.stiffness_key,
            **rod.as_given,
            "total_length_mm": to_mm(rod.total_length),
            "bending_stiffness_Nm2": rod.bending_stiffness,
            "lateral_bending_stiffness_Nm2": rod.lateral_bending_stiffness,
            "twisting_stiffness_Nm2": rod.twisting_stiffness,
            "stretching_stiffness_N": rod.stretching_stiffness,
            "weight_N_per_m": rod.weight_per_length if self.display.gravity else 0.0,
            "smallest_radius_mm": to_mm(1.0 / rod.max_curvature),
            "buckling_force_N": buckling_force(self.display),
        }

    def lines(self) -> Iterator[str]:
        """The same as text."""
        display = self.display
        yield screen.paint(display.name, screen.BOLD, sys.stdout)
        yield display.path or "built in"
        across = to_mm((display.node_count - 1) * display.span)
        bearing = f"{to_mm(display.clamp):g} mm of rod in each bearing"
        yield f"{display.node_count} nodes, {to_mm(display.span):g} mm apart, {across:g} mm across; {bearing}"
        yield from self._rod_lines()
        yield from _table(BUDGET_HEAD, list(self._budget_rows()))
        yield from self._axis_lines()
        yield from wrapped(f"level nodes: {self._held_text()}")
        if (entries := self.ability.departures.entries) and all(entry.is_open for entry in entries):
            yield "from home a plan leads to every kind of shape"
        radio = display.radio
        yield f"radio: channel {radio.channel} ({2400 + radio.channel} MHz), {radio.data_rate}, addresses"
        yield from wrapped(" ".join(radio.addresses), 2, hang=0)
        for each in self.odd:
            yield from wrapped(f"warning[{each.code}]: {each.key}: {each.message}")
            yield from wrapped(f"hint: {each.hint}", 2)
        if not self.odd:
            yield "nothing looks odd"

    def _rod_lines(self) -> Iterator[str]:
        rod = self._rod()
        modulus = f"E {rod['youngs_modulus_GPa']:.3g} GPa, G {rod['shear_modulus_GPa']:.3g} GPa"
        source = ", from the bending stiffness as measured" if self.display.rod.is_stiffness_measured else ""
        yield from wrapped(f"{self.display.rod.section}; {modulus}{source}")
        stiffness = (
            f"bending {rod['bending_stiffness_Nm2']:.3g} N m2, twisting {rod['twisting_stiffness_Nm2']:.3g} N m2"
        )
        yield from wrapped(f"stiffness: {stiffness}, stretching {rod['stretching_stiffness_N']:.3g} N")
        weight = f"weight {rod['weight_N_per_m']:.3g} N/m"
        bends = f"bends to a radius of {rod['smallest_radius_mm']:.0f} mm at least"
        yield f"{weight}; {bends}"
        yield f"buckles at {rod['buckling_force_N']:.3g} N when it goes straight from node to node"

    def _budget_rows(self) -> Iterator[tuple[str, ...]]:
        from curveline.displays.capability import longest_budget, straight_budget

        display = self.display
        lengths = (("straight, at home", display.span), ("longest segments", display.limits.length.high))
        budgets = (straight_budget(display), longest_budget(display))
        for (name, length), budget in zip(lengths, budgets, strict=True):
            yield name, *(f"{to_mm(value):.0f}" for value in (length, budget.between, budget.tail))

    def _axis_lines(self) -> Iterator[str]:
        from curveline.displays.capability import reaches

        found = reaches(self.display)
        yield from _table(AXIS_HEAD, list(map(_axis_cells, found)), frozenset({0, 3}))
        if all(reach.fits_target and reach.fits_status for reach in found):
            yield f"counts fit the 24 bits of a target, and a status, which tells {found[0].status_end:.0f} mm at most"
        else:
            yield f"counts do NOT all fit: a target has 24 bits, a status tells {found[0].status_end:.0f} mm at most"

    def _held_text(self) -> str:
        held = self.ability.held
        if held.shortest is None or held.longest is None:
            return "rod and motors stand no length of rod"
        ends = f"rod and motors stand {to_mm(held.shortest):.0f} to {to_mm(held.longest):.0f} mm of rod"
        reasons = (("below", held.below), ("beyond", held.beyond))
        limits = [f"{word}, {reason}" for word, reason in reasons if reason]
        return f"{ends}; {'; '.join(limits)}" if limits else f"{ends} between two, in every state"


def _budget_document(budget: Budget) -> dict[str, float]:
    return {"between_nodes_mm": to_mm(budget.between), "tail_mm": to_mm(budget.tail)}


def _leaving_document(leaving: Leaving) -> dict[str, Any]:
    return {"state": leaving.state, "lengths_mm": [to_mm(leaving.low), to_mm(leaving.high)]}


def _entry_document(entry: Access) -> dict[str, Any]:
    return {
        "shape": entry.kind,
        "states": list(entry.wanted),
        "possible": entry.is_open,
        "reason": entry.reason or None,
    }


def _axis_document(reach: AxisReach) -> dict[str, Any]:
    return {
        "axis": reach.name,
        "unit": reach.unit,
        "range": [reach.low, reach.high],
        "counts": list(reach.counts),
        "counts_per_unit": reach.drive.counts_per_unit,
        "speed_per_s": reach.drive.speed,
        "acceleration_per_s2": reach.drive.acceleration,
        "longest_seconds": reach.seconds,
        "fits_target": reach.fits_target,
        "fits_status": reach.fits_status,
    }


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


def _mm_or_none(length: float | None) -> float | None:
    return None if length is None else to_mm(length)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], left: frozenset[int] = frozenset({0})) -> Iterator[str]:
    yield from screen.headed(fitting([head, *rows], left), head, rows)
