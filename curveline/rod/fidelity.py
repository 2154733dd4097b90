"""What a planar inextensible model leaves out, and how far each term could move the curve.

These are estimates with stated formulas; each is given with the sentence that explains it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from curveline.rod.equilibrium import Equilibrium
from curveline.rod.section import Section

OUT_OF_PLANE_CHORD = 0.4573269026
"""Chord over length below which a clamped first-mode arch of isotropic section with GJ/EI = 2/3 leaves its plane."""


@dataclass(frozen=True)
class Bound:
    """How far leaving a term out may displace the curve [m], and why."""

    bound: float
    why: str


def left_out(state: Equilibrium, section: Section) -> dict[str, Bound]:
    """Every term that the planar inextensible model of `state` leaves out, by name."""
    bounds = {"stretch": _stretch(state, section), "twist": _twist(state, section), "contact": _contact(state, section)}
    if section.weight > 0.0 and state.rod.weight == 0.0:
        bounds["gravity"] = _gravity(state, section)
    return bounds


def _stretch(state: Equilibrium, section: Section) -> Bound:
    """Change of length by the largest axial force, times how far a small change of length moves the curve."""
    rod = state.rod
    force = float(abs(state.clamp_force).max()) * math.sqrt(2.0) + sum(math.hypot(x, y) for _, x, y in rod.loads)
    change = force / section.stretching_stiffness * rod.free_length
    excess = max(rod.free_length - math.hypot(*rod.free_chord), change, 1e-300)
    # A shallow arch of rise H and excess length dL has H ~ sqrt(dL), so dH = H / (2 dL) d(dL).
    rise = float(abs(state.vertices_table[:, 1] - rod.chord[1] / 2.0).max())
    leverage = max(1.0, rise / (2.0 * excess))
    return Bound(change * leverage, "largest axial force over EA, times the length, times the rise per excess length")


def _twist(state: Equilibrium, section: Section) -> Bound:
    """Nothing drives a straight strip between planar clamps out of its plane until the plane itself is unstable."""
    ratio = math.hypot(*state.rod.free_chord) / state.rod.free_length
    if section.width >= section.thickness and ratio > OUT_OF_PLANE_CHORD:
        why = (
            f"no load or clamp leaves the plane, and chord over length {ratio:.3f} is above {OUT_OF_PLANE_CHORD:.3f}, "
            "where even a section as weak sideways as in the plane would stay in it"
        )
        return Bound(0.0, why)
    why = "chord over length or the section does not rule out buckling sideways; the bound is half the length"
    return Bound(0.5 * state.rod.free_length, why)


def _contact(state: Equilibrium, section: Section) -> Bound:
    """Overlap of parts that are closer than the rod is thick; a curve that crosses itself has no such bound."""
    if state.crosses_itself:
        return Bound(state.rod.free_length, "the planar curve crosses itself, which a real rod cannot")
    overlap = max(0.0, section.thickness - state.clearance)
    why = f"smallest distance between parts of the curve less the thickness of {section.thickness:.2g} m"
    return Bound(overlap, why)


def _gravity(state: Equilibrium, section: Section) -> Bound:
    """Linear response: the weight's generalised force on the angles, in L2, over the lowest eigenvalue."""
    rod = state.rod
    length = rod.free_length
    slack = section.weight * length**3 / rod.stiffness
    angle = slack / math.sqrt(3.0) / max(state.lowest_eigenvalue, 1e-9)
    return Bound(min(length * angle, length), "w L^4 / EI over sqrt(3) times the lowest eigenvalue")
