"""What a model leaves out of a state, and how far each term could move the curve: computed, with the reason in words.

Stretch and weight: the equilibrium is solved once more with the term, on few edges, and the curves are compared. Out of
the plane: the lowest eigenvalue of the second variation decides whether the rod stays. Contact: the curve's distance
from itself against the rod's thickness.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.closest_approach import nearest_parts
from curveline.rod.planar.approach import fitting_mesh
from curveline.rod.planar.lateral import PRECISION, lateral_pair
from curveline.rod.planar.response import middle_angles, response
from curveline.rod.problem import Array, ScaledRod
from curveline.rod.spatial.energy import Shape, SpatialRod, positions
from curveline.rod.spatial.lifting import lift, relax_in_space, spatial_rod
from curveline.rod.spatial.relax import RelaxEnding, descend
from curveline.rod.states.equilibrium import PLANAR, Equilibrium
from curveline.rod.states.plain_states import Asked
from curveline.units import to_deg, to_mm, told_apart

SAFETY = 1.5
"""Bound over what a solve with the term shows, on few edges; they are off by a fifth at worst, and mostly by 1 %."""
HONESTY = 0.1
"""Error of an extrapolated eigenvalue, over the change it was extrapolated from: a thirtieth, three times over."""
MOST_EDGES = 192
"""Edges to solve once more with; the difference of two curves needs fewer than a curve."""
STRAIGHT = 2.6
"""A curve whose tangents differ by less [rad] goes on in one direction, by over a quarter of its length."""
APART = 4.0
"""Parts nearer than this many thicknesses along the rod are neighbours, not a contact."""
FINE = 8
"""Points per thickness, and their most, with which a distance is measured."""
MOST_POINTS = 4001


@dataclass(frozen=True)
class Bound:
    """How far leaving a term out may displace the curve [m], and why."""

    bound: float  # [m]
    why: str  # in words


class Lateral(NamedTuple):
    """Lowest eigenvalue out of the plane of a planar state, in EI / L^2 of the free rod, and how far it may be off."""

    eigenvalue: float
    uncertainty: float

    @property
    def stays(self) -> bool:
        """True if the rod certainly stays in its plane."""
        return self.eigenvalue > self.uncertainty

    @property
    def leaves(self) -> bool:
        """True if the rod certainly leaves its plane; a neutral one may do neither."""
        return self.eigenvalue < -self.uncertainty


UNKNOWN = Lateral(math.nan, math.inf)
"""Of a state that lies in no plane."""


class Probe(NamedTuple):
    """A planar `state` in units of its free length and EI, ready to be solved once more.

    On its `edges (m,)` the `angles (m,)` and `multipliers (2,)`.
    """

    state: Equilibrium
    edges: Array
    angles: Array
    multipliers: Array

    @property
    def rod(self) -> ScaledRod:
        """The rod whose state it is."""
        return self.state.rod.scaled()

    def moved(self, other: ScaledRod) -> float:
        """Largest distance between the curve of the state and that of an `other` rod's, near it, on few edges [m]."""
        edges, angles = self.edges, self.angles
        if edges.size > MOST_EDGES:
            edges = fitting_mesh(self.rod, MOST_EDGES)
            angles, _ = self.state.start_on(edges)
        found = response(self.rod, other, edges, angles.copy(), self.multipliers.copy())
        return float(found) * self.state.rod.free_length


class Judged(NamedTuple):
    """A state, whether it stays in its plane, and bounds on what its model leaves out, by name."""

    state: Equilibrium
    sideways: Lateral
    bounds: dict[str, Bound]


def probe(state: Equilibrium) -> Probe:
    """A planar or extensible state in units of its free length and EI."""
    angles = middle_angles(state.edges, state.vertices_table)
    return Probe(state, state.edges / state.rod.free_length, angles, state.multipliers)


def judge(state: Equilibrium) -> Judged:
    """A planar or extensible state with what its model leaves out."""
    sideways = lateral(state)
    bounds = {}
    if state.model == PLANAR:
        bounds["stretch"] = stretch_bound(state)
    bounds["twist"] = twist_bound(state, sideways)
    bounds["contact"] = contact_bound(state)
    if _is_weighed(state.rod):
        bounds["gravity"] = gravity_bound(state)
    return Judged(state, sideways, bounds)


def asked_of(rod: ClampedRod, tolerance: float) -> Asked:
    """What `find_states` is to find out of the planar states of `rod`, to `tolerance` [m], for `judge` to tell."""
    stretching = math.nan if rod.is_extensible else rod.stretching_compliance
    return Asked(tolerance, stretching, rod.section.weight if _is_weighed(rod) else math.nan, sideways=True)


def _is_weighed(rod: ClampedRod) -> bool:
    """True for a rod that has a weight which its scene leaves out."""
    return rod.section.weight > 0.0 and rod.weight == 0.0


def lateral(state: Equilibrium) -> Lateral:
    """Whether the rod of a planar state stays in its plane, by Richardson extrapolation from two resolutions."""
    known = state.disturbed
    coarse, fine = (known.coarse_lateral, known.fine_lateral) if known else (math.nan, math.nan)
    if math.isnan(fine):
        coarse, fine = _lateral_pair(probe(state))
    return Lateral(fine + (fine - coarse) / 3.0, HONESTY * abs(fine - coarse) + PRECISION * abs(fine))


def _lateral_pair(probed: Probe) -> tuple[float, float]:
    state, rod = probed.state, probed.state.rod
    bend, twist = rod.bearing.lateral / rod.stiffness, rod.bearing.twisting / rod.stiffness
    forces = probed.multipliers, np.array([bend, twist, rod.natural_curvature * rod.free_length])
    pair: tuple[float, float] = lateral_pair(probed.rod, probed.edges, probed.angles, state.vertices_table, forces)
    return pair


def stretch_bound(state: Equilibrium) -> Bound:
    """How far the rod's stretch would move the curve of a planar state, which is solved once more with it."""
    rod = state.rod
    moved = state.disturbed.stretched if state.disturbed else math.nan
    if math.isnan(moved):
        probed = probe(state)
        moved = probed.moved(probed.rod._replace(compliance=rod.stretching_compliance / rod.free_length**2))
    force = max(math.hypot(*force) for force in state.clamp_force.tolist())
    strain = force / rod.section.stretching_stiffness
    why = f"forces of up to {force:.2g} N strain the rod by {strain:.1g}"
    if math.isfinite(moved):
        return Bound(SAFETY * moved, f"solved again with stretch: {why}")
    return Bound(farthest(rod, strain), f"{why}; with stretch this state was not found again")


def gravity_bound(state: Equilibrium) -> Bound:
    """How far its weight would move the curve of a state of a weightless rod, which is solved once more with it."""
    rod = state.rod
    whole = rod.section.weight * rod.free_length
    moved = state.disturbed.weighed if state.disturbed else math.nan
    if math.isnan(moved):
        probed = probe(state)
        moved = probed.moved(probed.rod._replace(weight=whole * rod.free_length**2 / rod.stiffness))
    if math.isfinite(moved):
        return Bound(SAFETY * moved, f"solved again with the free rod's weight of {whole:.2g} N")
    return Bound(farthest(rod), f"under the free rod's weight of {whole:.2g} N this state was not found again")


def twist_bound(state: Equilibrium, sideways: Lateral) -> Bound:
    """Nothing moves a rod out of a plane in which it is stable; from one where it is not, it may go anywhere."""
    value = sideways.eigenvalue
    if sideways.stays:
        why = f"nothing points out of the plane, where the rod is stable: lowest eigenvalue {value:.3g} EI/L^2"
        return Bound(0.0, why)
    how = "unstable" if sideways.leaves else "hardly stable"
    why = f"in its plane the rod is {how}: lowest eigenvalue {value:.3g} EI/L^2; no rod of its length could go farther"
    return Bound(farthest(state.rod), why)


def contact_bound(state: Equilibrium) -> Bound:
    """By how much a rod without contact overlaps itself; a curve that crosses itself is none that a rod can take."""
    thickness = state.rod.section.thickness
    if state.crosses_itself:
        return Bound(farthest(state.rod), "the curve crosses itself, which a real rod cannot")
    spread = state.disturbed.spread if state.disturbed else float(np.ptp(state.angles))
    if state.space is None and spread < STRAIGHT:
        why = f"its directions differ by {to_deg(spread):.0f} deg at most, too little to come back to itself"
        return Bound(0.0, why)
    count = int(min(max(FINE * state.rod.length / thickness, 201), MOST_POINTS))
    spacing = state.rod.length / (count - 1)
    points = np.column_stack([state.curve(count), state.depth(count)])
    apart = max(4, math.ceil(APART * thickness / spacing))
    enough = 2.0 * max(thickness, spacing)
    distance = float(nearest_parts(points, apart, enough))
    # Points may pass each other by half their spacing.
    nearest = math.sqrt(max(distance**2 - 0.5 * spacing**2, 0.0))
    near, thick = told_apart(to_mm(nearest), to_mm(thickness), 3)
    gap = f"stay at least {near} mm apart" if distance >= enough else f"come as near as {near} mm to each other"
    why = f"its parts {gap}, and the rod is {thick} mm thick"
    return Bound(max(0.0, thickness - nearest), why)


def space_bound(segment: ClampedRod, judged: Judged) -> Bound:
    """How far what points out of the plane moves the curve of a planar state, which is solved once more in space."""
    state, sideways, _ = judged
    flat = segment.part(0.0).weighing(segment.weight)
    rod, relaxed = relax_in_space(segment, state)
    here = relax_in_space(flat, state)[1].shape if sideways.stays else lift(flat, state)[1]
    if relaxed.ending is not RelaxEnding.SETTLED:
        return Bound(farthest(segment), f"in space this state was not found again: {relaxed.ending.value}")
    gap = _apart(segment, positions(rod, relaxed.shape), positions(rod, here))
    return Bound(gap, "solved again in space with all that points out of the plane")


def spatial_left_out(segment: ClampedRod, resting: tuple[SpatialRod, Shape], state: Equilibrium) -> dict[str, Bound]:
    """Every term that the spatial model of `state` leaves out; it was refined from a `resting` shape on few edges."""
    bounds = {"contact": contact_bound(state)}
    if segment.section.weight > 0.0 and not (segment.weight or segment.weight_x or segment.weight_z):
        rod, shape = resting
        heavy = spatial_rod(segment.weighing(segment.section.weight), rod.edges)
        loaded = descend(heavy, shape)
        whole = segment.section.weight * segment.free_length
        bound = Bound(farthest(segment), f"under its weight of {whole:.2g} N this state was not found again")
        if loaded.ending is RelaxEnding.SETTLED:
            gap = _apart(segment, positions(rod, shape), positions(heavy, loaded.shape))
            bound = Bound(gap, f"solved again with the free rod's weight of {whole:.2g} N")
        bounds["gravity"] = bound
    return bounds


def farthest(rod: ClampedRod, strain: float = 0.0) -> float:
    """The most by which any two curves of a rod between these clamps can be apart [m].

    A point s along the rod lies within s of its start and within L - s of its end: in a lens whose diameter is largest
    in the middle, the root of L^2 less the chord squared.
    """
    length = (1.0 + strain) * rod.free_length
    return math.sqrt(max(length**2 - math.hypot(*rod.free_chord) ** 2, 0.0))


def _apart(segment: ClampedRod, one: Array, other: Array) -> float:
    """`SAFETY` times the largest distance between two curves of vertices (n+1, 3), in units of the free length, [m]."""
    return SAFETY * float(np.max(np.linalg.norm(one - other, axis=1))) * segment.free_length
