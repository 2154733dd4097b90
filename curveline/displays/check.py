"""A display that was checked: what its file says, what such a display can do, and what looks odd, as plain data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from curveline._version import __version__
from curveline.displays.capability import (
    Ability,
    AxisReach,
    Budget,
    Leaving,
    ability_of,
    buckling_force,
    longest_budget,
    reaches,
    straight_budget,
)
from curveline.displays.lint import Suspicion, suspicions
from curveline.material.relaxation import Relaxation
from curveline.notebook import html_of
from curveline.planning.reachability import Access
from curveline.scene import Display
from curveline.shapes.error_keys import as_plain
from curveline.units import HOUR, WEEK, deg, to_deg, to_mm, to_nmm

SET_AFTER = (HOUR, 8.0 * HOUR, WEEK)
"""Times in a shape of which a check says how much of the bend they set [s]."""
DIGITS = 9
"""Decimals that are left of a number that went to SI and back."""
KINDS_HEAD = ("from home into", "states", "possible", "reason")


@dataclass(frozen=True)
class DisplayCheck:
    """What a check of a display found; `document` has all numbers, in the units of files."""

    display: Display  # what was checked
    ability: Ability  # what it can do
    warnings: tuple[Suspicion, ...]  # what is legal but looks odd

    def document(self) -> dict[str, Any]:
        """All that was found as plain data."""
        display, held = self.display, self.ability.held
        return {
            "curveline": __version__,
            "display": display.name,
            "file": display.path or None,
            "nodes": display.node_count,
            "span_mm": to_mm(display.span),
            "clamp_mm": to_mm(display.clamp),
            "clamp_stiffness_Nmm_per_deg": clamp_stiffness_as_given(display),
            "clamp_play_deg": to_deg(display.clamp_play),
            "gravity": list(display.down) if display.gravity else None,
            "rod": rod_document(display),
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
            "errors": as_plain(display.errors),
            "offsets": offsets_as_given(display),
            "warnings": [each._asdict() for each in self.warnings],
        }

    def _repr_html_(self) -> str:
        entries = [_entry_document(entry) for entry in self.ability.departures.entries]
        rows = [
            (each["shape"], ", ".join(each["states"]), "yes" if each["possible"] else "no", each["reason"] or "")
            for each in entries
        ]
        remarks = [f"warning[{each.code}]: {each.key}: {each.message}; {each.hint}" for each in self.warnings]
        title = f"{self.display.name}: {self.display.node_count} nodes, {to_mm(self.display.span):g} mm apart"
        return html_of(title, [KINDS_HEAD, *rows], remarks=remarks or ["nothing looks odd"])


def check_of(display: Display) -> DisplayCheck:
    """Work out what a display can do, and look for what is odd in its file."""
    ability = ability_of(display.as_told)
    return DisplayCheck(display, ability, tuple(suspicions(display, ability)))


def clamp_stiffness_as_given(display: Display) -> float | None:
    """Moment with which a bearing tilts by one degree [N mm], None for a rigid one."""
    return None if math.isinf(display.clamp_stiffness) else to_nmm(display.clamp_stiffness * deg(1.0))


def offsets_as_given(display: Display) -> dict[str, list[float]]:
    """What nodes and segments do beside what they are told, by the keys of a display file; empty if nothing is."""
    offsets = display.offsets
    given = {"angle_deg": list(map(to_deg, offsets.angles)), "length_mm": list(map(to_mm, offsets.lengths))}
    return {key: [round(each, DIGITS) for each in values] for key, values in given.items() if values}


def rod_document(display: Display) -> dict[str, Any]:
    """The rod of a display as plain data."""
    rod = display.rod
    return {
        "section": type(rod.section).__name__.lower(),
        "stiffness_from": rod.stiffness_key,
        **rod.as_given,
        "total_length_mm": to_mm(rod.total_length),
        "bending_stiffness_Nm2": rod.bending_stiffness,
        "lateral_bending_stiffness_Nm2": rod.lateral_bending_stiffness,
        "twisting_stiffness_Nm2": rod.twisting_stiffness,
        "stretching_stiffness_N": rod.stretching_stiffness,
        "weight_N_per_m": rod.weight_per_length if display.gravity else 0.0,
        "smallest_radius_mm": to_mm(1.0 / rod.max_curvature),
        "buckling_force_N": buckling_force(display),
        "natural_curvature": {
            "uniform_per_m": rod.natural_curvature,
            "least_along_per_m": min(rod.profile.values) if rod.profile else 0.0,
            "most_along_per_m": max(rod.profile.values) if rod.profile else 0.0,
        },
        "set": _set_document(rod.relaxation),
    }


def _set_document(law: Relaxation | None) -> dict[str, Any] | None:
    """The set that a rod takes, as plain data; None for one that takes none."""
    if law is None:
        return None
    return {
        "times_s": list(law.times),
        "fractions": list(law.fractions),
        "temperature_C": law.temperature,
        "after": [{"held_s": seconds, "fraction": law.set_after(seconds)} for seconds in SET_AFTER],
    }


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


def _mm_or_none(length: float | None) -> float | None:
    return None if length is None else to_mm(length)
