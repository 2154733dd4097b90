"""How a pushed shape falls when it snaps, with its inertia: the push up to there, then the motion until it rests.

The rod is damped from outside, at a rate that is an estimate, and moves in the display's plane, in which a push is
computed. What it falls into is the state in which it comes to rest under the load.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from curveline.errors import Infeasible, InvalidInput
from curveline.loading.pushes import ROUGH, Stand
from curveline.loading.snap_through import LOST, UNKNOWN, Loading, SnapThrough, before
from curveline.notebook import html_of, svg_of
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array
from curveline.rod.spatial.dynamics import FallMotion, Fate, StepControl, fall, kicked, lead, medium_of
from curveline.rod.spatial.energy import Shape, SpatialRod, positions
from curveline.rod.spatial.lifting import lift
from curveline.rod.spatial.relax import RelaxEnding, is_stable, largest_turn, newton
from curveline.rod.states.planar_states import find_states

PUSHES = 40
"""Loads at which the rod is looked at on its way to the snap-through."""
PARTS = PUSHES + 1
"""How many parts `fall_of` reports."""
POINTS = 201
"""Of a curve under one of them."""
EDGES = 96
BEYOND = (1.002, 1.005, 1.01, 1.02, 1.05, 1.1)
"""Loads, over that of snap-through, under which the rod is let go: the first under which one of so many edges falls."""
STILL = 0.3
"""An edge that turns by less than this [rad] as the load is put on is about where it was."""
NUDGE, SEED = 1e-2, 1
"""Speed, in lengths per unit of time, with which a rod leaves a state whose symmetry nothing else would break."""
ACCURACY = 3e-4
LONGEST = 4.0
"""Units of time within which a rod falls, or is let go under a larger load."""
SETTLING = 1.5
"""Units of time for which a rod that has landed is watched as it comes to rest."""
ALIKE = 0.15
"""Largest angle [rad] between the tangents of a rod at rest and of a state that are the same."""


class PushedCurve(NamedTuple):
    """The rod under a load [N], as a `curve (points, 2)` [m] from pivot to pivot in the display's frame."""

    force: float  # [N]
    curve: Array


@dataclass(frozen=True)
class SnapFall:
    """A pushed shape that snaps: how it is `pushed` up to there, then its `motion` under a load of `force` [N].

    `segment` is the rod under that load; `name` is that of the state in which it comes to rest, "unknown" if it does
    not, or in none that a rod in the plane has.
    """

    loading: Loading  # the push that led to it
    pushed: tuple[PushedCurve, ...]
    force: float
    segment: ClampedRod
    motion: FallMotion
    name: str

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.figures.falls:draw", self)

    def _repr_html_(self) -> str:
        head = ("falls under N", "comes to rest in", "how it ends")
        row = (self.force, self.name, self.motion.fate.value)
        return html_of(self.loading.scene.name, [head, row], self._repr_svg_())


def fall_of(loading: Loading, progress: Callable[[int], object] = lambda _: None) -> SnapFall:
    """Let a pushed shape fall where it snaps; `progress` is told how many of `PARTS` are done.

    Infeasible where nothing snaps, or where the push was lost before; InvalidInput for a rod without mass.
    """
    snap = _snap_of(loading)
    pushed = []
    for curve in _pushes(loading, snap.force):
        pushed.append(curve)
        progress(len(pushed))
    force, segment, rod, motion = _let_go(loading, snap.force)
    progress(PARTS)
    name = _name(loading.stand, force, rod, motion.settled)
    return SnapFall(loading, tuple(pushed), force, segment, motion, name)


def _snap_of(loading: Loading) -> SnapThrough:
    """How a pushed shape ends; see `fall_of`."""
    snap = loading.snap
    if snap is None:
        message = f"nothing snaps up to {loading.push.most:g} N: there is no fall to show"
        raise Infeasible(message, "push harder, at another place or in another direction")
    if snap.kind == LOST:
        message = f"the push could be followed to {snap.force:.4g} N only: there is no fall to show"
        raise Infeasible(message, "push at a place nearby")
    bearing = loading.stand.state.rod.bearing
    if bearing.play > 0.0 and bearing.give == 0.0:
        message = "a fall is not computed between bearings that strike at the end of their play"
        raise InvalidInput(message, "give the display file a clamp_stiffness_Nmm_per_deg, how stiff they are there")
    if loading.scene.display.rod.mass_per_length <= 0.0:
        message = "the rod has no mass: nothing tells how fast it falls"
        raise InvalidInput(message, "give the display's rod its mass_g_per_m")
    return snap


def _pushes(loading: Loading, force: float) -> Iterator[PushedCurve]:
    """The rod from no load to just before the `force` [N] of snap-through, the closer the nearer to that."""
    stand = loading.stand
    here = 0.0, stand.state
    for share in np.linspace(0.0, 1.0, PUSHES)[:-1].tolist():
        here = stand.reach(before(force) * (1.0 - (1.0 - share) ** 2), here, ROUGH)
        yield PushedCurve(here[0], np.array(stand.origin) + here[1].curve(POINTS))
    yield PushedCurve(before(force), np.array(stand.origin) + loading.last.curve(POINTS))


def _let_go(loading: Loading, force: float) -> tuple[float, ClampedRod, SpatialRod, FallMotion]:
    """The load [N] under which the rod falls, the segment and the rod under it, and the fall."""
    stand = loading.stand
    for share in BEYOND:
        segment = stand.loaded(share * force)
        rod, shape = lift(segment, loading.last, EDGES)
        if share < BEYOND[-1] and _holds(rod, shape):
            continue
        motion = _fallen(segment, rod, shape)
        if motion.fate is Fate.LANDED:
            break
    return share * force, segment, rod, motion


def _holds(rod: SpatialRod, shape: Shape) -> bool:
    """True if a shape is still about a stable one: edges hold on a little longer than the rod that they stand for."""
    held = newton(rod, shape)
    is_there = held.ending is RelaxEnding.SETTLED and largest_turn(held.shape, shape) < STILL
    return is_there and is_stable(rod, held.shape)


def _fallen(segment: ClampedRod, rod: SpatialRod, shape: Shape) -> FallMotion:
    """The motion from rest in a shape until the rod has landed, and on until it hardly moves."""
    medium = medium_of(segment)
    start = kicked(rod, shape, NUDGE, SEED)
    start = start._replace(velocities=start.velocities * [1.0, 1.0, 0.0])
    motion = fall(rod, start, medium, StepControl(accuracy=ACCURACY, until=LONGEST))
    if motion.fate is not Fate.LANDED:
        return motion
    pace = StepControl(accuracy=ACCURACY, until=float(motion.times[-1]) + SETTLING)
    rest = lead(lambda _: rod, motion.last, medium, pace)
    return replace(
        motion,
        times=np.concatenate([motion.times, rest.times[1:]]),
        places=np.concatenate([motion.places, rest.places[1:]]),
        kinetic=np.concatenate([motion.kinetic, rest.kinetic[1:]]),
        potential=np.concatenate([motion.potential, rest.potential[1:]]),
        last=rest.last,
    )


def _name(stand: Stand, force: float, rod: SpatialRod, settled: Shape | None) -> str:
    """What `simulate` calls the state in which a rod came to rest under a push of `force` [N]."""
    if settled is None:
        return UNKNOWN
    tangents = np.diff(positions(rod, settled), axis=0)[:, :2]
    along = np.arctan2(tangents[:, 1], tangents[:, 0])
    loaded = stand.loaded(force).inextensible()
    nearest = ALIKE, UNKNOWN
    for state in find_states(loaded, ROUGH * loaded.length):
        turns = along - state.start_on(rod.edges)[0]
        nearest = min(nearest, (float(np.max(np.abs(np.arctan2(np.sin(turns), np.cos(turns))))), state.name))
    return nearest[1]
