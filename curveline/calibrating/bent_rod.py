"""The rod of a segment for numbers that are sought: its curve near one that is known, and how that moves with them.

A rod that bends harder to one side, M = EI (1 + a sgn(k)) k, is in balance where a rod alike to both sides is that is
bent by -a |k| when free: M = EI (k + a |k|). So it is found by taking the curvature of the last curve for that, again
and again; each time what is missed becomes a times as large.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from curveline.calibrating.unknowns import GIVE, LIFT, STEPS, Unknowns, weight_of
from curveline.rod.branches.control_path import counts_along, problem_at, straight_path
from curveline.rod.branches.standing import state_near
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.vertex_table import ANGLE, CURVATURE
from curveline.rod.natural_curvature import NaturalCurvature, curvatures_at
from curveline.rod.planar.richardson import vertex_table
from curveline.rod.problem import Bearing, Pose, mesh
from curveline.rod.states.planar_states import find_states
from curveline.rod.states.slack import is_slack
from curveline.scene import Scene
from curveline.simulation.simulate import scene_rod
from curveline.trial import Array
from curveline.units import mm

EDGES = 192
"""Of a rod: its curve is right to some hundredths of a millimetre."""
TAIL = mm(15.0)
"""Of the straight rod behind a pivot that is part of its curve."""
TOLERANCE = mm(0.1)
"""Of states that are only begun with."""
NO_LOADS = np.zeros(0)
SAME = 1e-7
"""Change of an angle [rad] by which the rod that bends harder to one side has been found."""
ROUNDS = 12


class Bent(NamedTuple):
    """A state of the rod: `angles (n,)` and `multipliers (2,)` of its edges, its curve in the display's frame [m].

    `points (n+5, 2)` lead from behind the left pivot to behind the right one; `curvatures (n+1,)` [1/m] are those of
    the free rod's vertices.
    """

    angles: Array
    multipliers: Array
    points: Array
    curvatures: Array


@dataclass(frozen=True)
class BentSegment:
    """The segment after node `index` of a shape, to be bent by numbers."""

    scene: Scene
    index: int
    unknowns: Unknowns

    @cached_property
    def told(self) -> ClampedRod:
        """The rod as it is told, without offsets."""
        return scene_rod(replace(self.scene, display=self.scene.display.as_told), self.index)

    def rod(self, numbers: Array) -> ClampedRod:
        """The rod that numbers make of what it is told, but for what it bends harder to one side."""
        told = self.told
        weight, give, _, left, right, more = numbers[self.unknowns.places(self.index)].tolist()
        pose, bearing, heavy = told.pose, told.bearing, weight_of(self.scene.display)
        pose = pose._replace(start=pose.start + left, end=pose.end + right, length=pose.length + more)
        share = weight / heavy if heavy else 1.0
        return replace(told, pose=pose, bearing=bearing._replace(weight=share * bearing.weight, give=give))

    def bent(self, numbers: Array, start: tuple[Array, Array]) -> Bent | None:
        """The state for numbers that is near to one of angles and multipliers; None if there is none."""
        rod = self.rod(numbers)
        share = float(numbers[self.unknowns.places(self.index)[2]])
        found = self._near(rod.pose, rod.bearing, start)
        if share == 0.0:
            return found
        for _ in range(ROUNDS):
            if found is None:
                return None
            before = found.angles
            bearing = _leaning(rod, share, found.curvatures)
            found = self._near(rod.pose, bearing, (found.angles, found.multipliers))
            if found is not None and float(np.max(np.abs(found.angles - before))) < SAME:
                return found
        return found

    def moves(self, numbers: Array, here: Bent) -> Array | None:
        """How the points of a curve move with each number that bends it, (7, n+5, 2) per SI unit; None if it is lost.

        The numbers are those at `Unknowns.places`; the last is the height of the right node.
        """
        kinds = [self.unknowns.all[place] for place in self.unknowns.places(self.index)]
        moved = []
        for place, unknown in zip(self.unknowns.places(self.index), kinds, strict=True):
            step = STEPS[unknown.kind]
            other = numbers.copy()
            other[place] += step
            there = self.bent(other, (here.angles, here.multipliers))
            if there is None:
                step, other = -step, numbers.copy()
                other[place] += step
                there = None if unknown.kind == GIVE and other[place] < 0.0 else self.bent(other, here[:2])
            if there is None:
                return None
            moved.append((there.points - here.points) / step)
        lifted = self.lifted(LIFT).bent(numbers, here[:2])
        if lifted is None:
            return None
        moved.append((lifted.points - here.points) / LIFT)
        return np.array(moved)

    def lifted(self, by: float) -> BentSegment:
        """The same segment with its right node higher."""
        nodes = list(self.scene.nodes)
        nodes[self.index + 1] = replace(nodes[self.index + 1], height=nodes[self.index + 1].height + by)
        return replace(self, scene=replace(self.scene, nodes=tuple(nodes)))

    def _near(self, pose: Pose, bearing: Bearing, start: tuple[Array, Array]) -> Bent | None:
        is_there, angles, multipliers = state_near(pose, bearing, *start, 1)
        if not is_there:
            return None
        path = straight_path(pose, pose)
        problem = problem_at(path, bearing, 0.0, counts_along(path, bearing, angles.size))
        table = vertex_table(problem, angles, multipliers)
        free, half = pose.length - bearing.clamp, 0.5 * bearing.clamp
        points = np.empty((len(table) + 4, 2))
        first, last = (np.array([math.cos(angle), math.sin(angle)]) for angle in table[[0, -1], ANGLE].tolist())
        points[2:-2] = half * first + free * table[:, :2]
        chord = np.array([pose.x, pose.y])
        points[0], points[1], points[-2], points[-1] = -TAIL * first, 0.0, chord, chord + TAIL * last
        points += [self.index * self.scene.display.span, self.scene.nodes[self.index].height]
        return Bent(angles, multipliers, points, table[:, CURVATURE] / free)


def states_of(bent: BentSegment, numbers: Array) -> dict[str, Bent]:
    """The states of a segment by their names, as far as a display shows them; none of a rod without any to spare."""
    alike = numbers.copy()
    alike[bent.unknowns.places(bent.index)[2]] = 0.0
    rod = bent.rod(alike)
    if not is_slack(rod):
        return {}
    found = {}
    for state in find_states(rod, TOLERANCE):
        if state.simple and state.stable:
            start = bent.bent(alike, state.start_on(mesh(NO_LOADS, EDGES)))
            there = start and bent.bent(numbers, (start.angles, start.multipliers))
            if there:
                found[state.name] = there
    return found


def _leaning(rod: ClampedRod, share: float, curvatures: Array) -> Bearing:
    """The bearing of a rod that is bent by what it bends harder to one side, at some curvatures."""
    places = rod.pose.begin + 0.5 * rod.clamp + np.linspace(0.0, rod.free_length, curvatures.size)
    values = -share * np.abs(curvatures)
    if rod.is_unevenly_curved:
        values = values + curvatures_at(rod.bearing.profile, places)
    return rod.bearing._replace(profile=NaturalCurvature(places, values).table)
