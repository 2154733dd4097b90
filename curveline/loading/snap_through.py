"""Push at a point of a shape's rod, harder and harder, until it snaps through: deflection, snap-through load, landing.

The load is dead and the nodes stay where they are. In the paper's section VI this is done by hand, in steps of 0.5 N.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curveline.errors import InvalidInput
from curveline.kernels.compile_time import clock
from curveline.loading.pushes import MOST_ROWS, ROUGH, TOLERANCE, Push, Stand, most_on, stand_of, step_to
from curveline.notebook import html_of, svg_of
from curveline.rod.branches.arclength import TraceReach, trace
from curveline.rod.branches.continuation import start_along
from curveline.rod.branches.control_path import ControlPath
from curveline.rod.branches.special_points import FallOutcome, SpecialKind, SpecialPoint, critical, falls
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.vertex_table import X, Y
from curveline.rod.models.model_error import lateral
from curveline.rod.planar.richardson import vertex_table
from curveline.rod.problem import make_problem, mesh
from curveline.rod.states.equilibrium import Equilibrium, Outcome, refine
from curveline.rod.states.identity import called
from curveline.rod.states.planar_states import find_states
from curveline.scene import Scene
from curveline.units import rounded_up, to_mm

JUST = 1e-4
"""How long before the snap-through, as a part of its load, the last stable state is shown."""
TRACE_EDGES = 96
SHORT_STEP = 0.03
"""Of the traced branch, for a figure: the root mean square of the edges' turn [rad] and the fraction of the path."""
NEAR = 1e-6
NEAREST = 1e-9
"""Relative error of a snap-through load, and that which fine enough edges for the deflection there come with."""
MOST_FALLS = 5
UNKNOWN = "unknown"
LOST = SpecialKind.LOST.value
LOOKS = 8
"""Loads at which a rod is tried for leaving its plane; where it does is sought between two of them, by `HALVINGS`."""
HALVINGS = 10
FINE = 1e-9
"""Bound on the error of the curves that tell the stiffness, as a part of the rod's length."""
FEEBLE = 0.01
"""A first push, in EI/L^2, that tells how stiff a point is."""
PROBING = 1e-4
"""Deflection, as a part of the length, over which the stiffness is taken."""
GENTLE = 0.02
"""Largest push for that, as a part of the last one."""
FEWEST = 100.0
"""Deflection, over `FINE`, that tells a stiffness."""


class Landing(NamedTuple):
    """Where the rod goes when it snaps: the state it falls into, under the load, by name; where it is once released.

    Names are those that `simulate` gives; "unknown" where none was reached.
    """

    name: str  # of the state under the load
    released: str  # state when the load is gone
    state: Equilibrium | None  # under the load


class Limit(NamedTuple):
    """Where a pushed state ceases to be stable: load and its error [N], the kind of that special point, and the point.

    "lost" is the kind of one that could be followed so far, but neither further nor to a special point. The point is
    one of the path to a push of `far` [N].
    """

    force: float
    error: float
    kind: str
    point: SpecialPoint
    far: float


@dataclass(frozen=True)
class SnapThrough:
    """How a pushed state ends: load [N] and its error [N], "fold", "bifurcation" or "lost", and where the rod goes.

    At a bifurcation the rod leaves to either side: there are two landings if these differ.
    """

    force: float  # [N]
    error: float  # [N]
    kind: str  # fold, bifurcation or lost
    landings: tuple[Landing, ...]  # one, or two that differ


class BranchPoint(NamedTuple):
    """A state of the branch that is pushed: load [N], deflection along it [m], number of unstable directions."""

    force: float  # [N]
    deflection: float  # [m]
    unstable: int  # unstable directions


@dataclass(frozen=True)
class Loading:
    """What came of a push: `rows` of load [N] and deflection along it [m], the last of them the snap-through.

    `stiffness` [N/m] is that of the unloaded point, None if it cannot be told. From `leaves_plane` [N] on the rod would
    not stay in the display's plane; None if it does until it snaps. `error` bounds that of the rows [m]. `last` is the
    state at the end of the rows, or just before the snap-through; `branch` goes on with unstable ones.
    """

    scene: Scene  # what was pushed
    push: Push  # where and how
    stand: Stand  # the rod that is pushed
    rows: tuple[tuple[float, float], ...]
    error: float
    stiffness: float | None
    snap: SnapThrough | None  # None if it does not snap
    leaves_plane: float | None
    last: Equilibrium
    branch: tuple[BranchPoint, ...]
    seconds: float  # [s]

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.figures.loads:draw", self)

    def _repr_html_(self) -> str:
        rows = [("load N", "deflection mm"), *((force, to_mm(deflection)) for force, deflection in self.rows)]
        return html_of(self.scene.name, rows, self._repr_svg_())


def load(scene: Scene, push: Push, progress: Callable[[int], object] = lambda _: None) -> Loading:
    """Push a shape until it snaps through, or to the most; `progress` is told the percentage of the load reached.

    InvalidInput for a push that makes no sense; Infeasible if there is no such state, or not under the file's loads.
    """
    begin = clock()
    stand = stand_of(scene, push)
    push = push._replace(most=push.most or most_on(stand.rod))
    check_steps(push)
    limit = limit_of(stand, push.most, NEAREST)
    push = push._replace(step=push.step or step_to(push.most if limit is None else limit.force, stand.rod))
    states = []
    for force, state in _states(stand, push, limit):
        states.append((force, state))
        progress(round(100.0 * force / (push.most if limit is None else limit.force)))
    rows = [(force, stand.deflection(state)) for force, state in states]
    if limit is not None:
        rows[-1] = limit.force, _deflection_at(stand, limit)
    return Loading(
        scene,
        push,
        stand,
        rows=tuple(rows),
        error=max(state.error for _, state in states),
        stiffness=_stiffness(stand, GENTLE * rows[-1][0]),
        snap=None if limit is None else SnapThrough(*limit[:3], tuple(_landings(stand, limit))),
        leaves_plane=leaves_plane(stand, states[-1][0]),
        last=states[-1][1],
        branch=tuple(_branch(stand, push.most if limit is None else limit.far)),
        seconds=clock() - begin,
    )


def limit_of(stand: Stand, most: float, tolerance: float = NEAR) -> Limit | None:
    """Where the state that is pushed ends, to a relative `tolerance`; None if it is still stable under `most` [N]."""
    # Up to what suits the rod first: on a path that is a million times as long a special point is hard to place.
    for far in sorted({min(most, most_on(stand.rod)), most}):
        path = stand.path(0.0, far)
        point = critical(path, stand.bearing, *start_along(path, stand.state), tolerance)
        if point.kind is SpecialKind.LOST:
            return Limit(point.reached * far, math.inf, point.kind.value, point, far)
        if point.kind is not SpecialKind.NONE:
            return Limit(point.fraction * far, point.error * far, point.kind.value, point, far)
    return None


def check_steps(push: Push) -> None:
    """InvalidInput unless the push grows to its end in steps that can be counted."""
    if not (math.isfinite(push.step) and math.isfinite(push.most)):
        raise InvalidInput(f"{push.most:g} N in steps of {push.step:g} N never ends", "choose finite numbers")
    if 0.0 < push.step * MOST_ROWS < push.most:
        hint = f"take steps of at least {_least_step(push.most):g} N"
        raise InvalidInput(f"{push.most:g} N in steps of {push.step:g} N are more than {MOST_ROWS} rows", hint)


def _least_step(most: float) -> float:
    """The least step [N] in few digits in which a push grows to its `most` in a table that is not too long."""
    step = rounded_up(most / MOST_ROWS, 6)
    return step if step * MOST_ROWS >= most else rounded_up(math.nextafter(step, math.inf), 6)


def _states(stand: Stand, push: Push, limit: Limit | None) -> Iterator[tuple[float, Equilibrium]]:
    """The load [N] and the state under it at every step, then at the snap-through or the most."""
    here = 0.0, stand.state
    yield here
    for number in range(1, math.ceil((push.most if limit is None else limit.force) / push.step)):
        force = number * push.step
        here = stand.reach(force, here)
        if here[0] != force:
            break
        yield here
    yield stand.reach(push.most if limit is None else before(limit.force), here)


def before(force: float) -> float:
    """The last load [N] under which a state is looked at that ends under `force`."""
    return force * (1.0 - JUST)


def _deflection_at(stand: Stand, limit: Limit) -> float:
    """How far the point that is pushed has moved along the push at the special point [m], on its finest level."""
    point = limit.point
    rod = stand.loaded(point.reached * limit.far)
    problem = make_problem(rod.scaled(), point.edges)
    table = vertex_table(problem, point.phi, point.multipliers)
    ends = np.concatenate([[0.0], np.cumsum(point.edges)]) * rod.free_length + 0.5 * rod.clamp
    pushed = rod.free_length * table[np.argmin(np.abs(ends - stand.at * rod.length))]
    return stand.moved((rod.free_start[0] + float(pushed[X]), rod.free_start[1] + float(pushed[Y])))


def _branch(stand: Stand, most: float) -> Iterator[BranchPoint]:
    """The branch of the state that is pushed up to `most` [N], past special points, until it is stable once more."""
    path = stand.path(0.0, most)
    track = trace(path, stand.bearing, *start_along(path, stand.state, TRACE_EDGES), TraceReach(step=SHORT_STEP))
    was_unstable = False
    for number, unstable in enumerate(track.unstable):
        if was_unstable and not unstable:
            break
        was_unstable = bool(unstable)
        force = float(track.fractions[number]) * most
        rod = stand.loaded(force)
        edges = mesh(rod.scaled().at, track.phi.shape[1])
        state = refine(rod, edges, track.phi[number].copy(), track.multipliers[number].copy(), ROUGH * rod.length)
        # Next to a fold of the edges it was traced on a rod of finer ones may have no such state.
        if state.outcome is not Outcome.LOST and state.stable != was_unstable:
            yield BranchPoint(force, stand.deflection(state), int(unstable))


def _stiffness(stand: Stand, most: float) -> float | None:
    """Slope of load over deflection of the unloaded point [N/m], by differences over pushes of at most `most` [N]."""
    rod = stand.rod
    force = min(most, FEEBLE * rod.stiffness / rod.free_length**2)
    move = abs(_compliance(stand, force)) * force
    # As far as moves the point by a little, but no farther than that the curve goes on straight.
    force = min(most, force * PROBING * rod.length / max(move, FINE * rod.length))
    wide, narrow = _compliance(stand, force), _compliance(stand, 0.5 * force)
    compliance = narrow + (narrow - wide) / 3.0
    # What moves by no more than its curve is known to has no stiffness that could be told.
    return 1.0 / compliance if compliance * force > FEWEST * FINE * rod.length else None


def _compliance(stand: Stand, force: float) -> float:
    """Deflection over load [m/N], by central differences over pushes of `force` [N]."""
    there, back = (stand.deflection(stand.near(sign * force, stand.state, FINE)) for sign in (1.0, -1.0))
    return (there - back) / (2.0 * force)


def leaves_plane(stand: Stand, last: float) -> float | None:
    """The load [N] from which on the rod would not stay in its plane, None if it does up to the `last` one."""
    below = here = (0.0, stand.state)
    for number in range(1, LOOKS + 1):
        here = stand.reach(last * number / LOOKS, here, ROUGH)
        if not _stays(here[1]):
            after = here
            for _ in range(HALVINGS):
                middle = stand.reach(0.5 * (below[0] + after[0]), below, ROUGH)
                below, after = (middle, after) if _stays(middle[1]) else (below, middle)
            return after[0]
        below = here
    return None


def _stays(state: Equilibrium) -> bool:
    """True if a state is stable also against leaving the plane."""
    return lateral(state).stays


def _landings(stand: Stand, limit: Limit) -> Iterator[Landing]:
    """Where the rod falls from the end of a branch; of two ways that end alike, one."""
    if limit.kind == LOST:
        return
    known: list[tuple[str, str]] = []
    for fall in _falls(stand, stand.path(0.0, limit.far), limit.point):
        force = fall.at * limit.far
        state = _landed(stand, force, fall)
        there = _released(stand, force, state)
        landing = Landing(_name(state, stand.loaded(force)), _name(there, stand.rod), state)
        if landing[:2] not in known:
            known.append(landing[:2])
            yield landing


def _falls(stand: Stand, path: ControlPath, point: SpecialPoint) -> tuple[FallOutcome, ...]:
    """Both ways off a bifurcation; off a fold there is but the one on which the branch led."""
    found = falls(path, stand.bearing, point)
    return found[:1] if point.kind is SpecialKind.FOLD else found


def _landed(stand: Stand, force: float, fall: FallOutcome) -> Equilibrium | None:
    """The stable state under a push [N] that a fall led to, if it did."""
    if not fall.landed:
        return None
    rod = stand.loaded(force)
    state = refine(rod, fall.edges, fall.phi.copy(), fall.multipliers.copy(), TOLERANCE * rod.length)
    return state if state.stable else None


def _released(stand: Stand, force: float, state: Equilibrium | None) -> Equilibrium | None:
    """What a stable state under a push [N] becomes when that is taken away, falling on where it loses stability."""
    for _ in range(MOST_FALLS):
        if state is None:
            return None
        path = stand.path(force, 0.0)
        point = critical(path, stand.bearing, *start_along(path, state))
        if point.kind is SpecialKind.NONE:
            return stand.reach(0.0, (force, state))[1]
        if point.kind is SpecialKind.LOST:
            return None
        fall = _falls(stand, path, point)[0]
        force *= 1.0 - fall.at
        state = _landed(stand, force, fall)
    return None


def _name(state: Equilibrium | None, loads: ClampedRod) -> str:
    """What a state is called among all of a rod under the same loads; names do not depend on how far it stretches."""
    if state is None:
        return UNKNOWN
    return called(state, find_states(loads.inextensible(), ROUGH * loads.length))
