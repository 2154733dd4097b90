"""Damped motion of the spatial rod in time: where it falls once its state is gone, and frames of it on the way.

Each step minimises the incremental potential of backward Euler (Gast et al. 2015; for its damping Hairer and Wanner
1996, ch. IV.3): the energy plus what inertia and damping ask of the vertices' places and the edges' spins,

    Phi = E(x) + |x - x_0 - dt v_0|^2_M / (2 dt^2) + c |x - x_0|^2_M / (2 dt) + tau |k - k_0|^2_B / (2 dt)

with masses M of vertices and, about the tangent, of edges, curvatures and twists k and their stiffnesses B. It is
first order in dt and loses energy, least where dt is small. Time is counted in units of sqrt(m L^4 / EI), see
`time_unit`, speed in lengths per that. There is no line search: a step that fails is taken again in halves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array
from curveline.rod.spatial.bands import cholesky, solve_factored, times
from curveline.rod.spatial.energy import Shape, SpatialRod, assemble, energy, moved, positions
from curveline.rod.spatial.inertia import Pull, add_pull, add_viscosity, lumped, spun, strained
from curveline.rod.spatial.relax import RelaxEnding as Rest
from curveline.rod.spatial.relax import descend, is_stable
from curveline.rod.spatial.tilting import Tilts, held_at, is_giving, newton_step
from curveline.units import STANDARD_GRAVITY

CLOSE = 1e-7
"""Turn of an edge [rad] in the last iteration of a step: what is left over is of the order of its square."""
ITERATIONS = 12
EASY = 5
"""Iterations up to which a step may be followed by a longer one."""
LONGEST_TURN = 0.5
"""A step that turns an edge by more [rad], or stretches it by the like, is too long: it could change the branch."""
SHORTEST = 1e-10
ROUNDING = 1e-11
"""Energy that a step may gain by rounding, relative to the energies involved."""
SEATING = (1e-2, 1e-3, 1e-4)
"""Lengths of the step, the first that converges, in which ends that are a little off are brought to their places."""
LOOK = 20
"""Steps between looks at whether the rod has landed."""
LEFT = 0.01
"""Of the energy that the fall sets free, what may be left of the motion where the rod counts as landed."""
NEAR = 0.3
"""Edges of the landed rod differ by less from the state it comes to rest in [rad]: further away it could change."""


class Fate(Enum):
    """How a motion ended; the value is the sentence shown to the user."""

    LANDED = "fallen into a stable state"
    MOVING = "still moving when the time ran out: allow more time or more damping"
    LED = "led by its ends until the time ran out"
    STUCK = (
        "no time step was short enough: start from a rod whose ends are where they are held, lead them more slowly, or "
        "damp the motion more"
    )


class Medium(NamedTuple):
    """What makes a rod of unit mass per length slow.

    `gyration` is the section's polar radius of gyration over L; `external` the rate at which mass times speed is lost,
    per unit time; `internal` the time by which moments of bending and twist lead their curvatures (Kelvin and Voigt).
    """

    gyration: float = 0.01
    external: float = 4.0
    internal: float = 0.0


class StepControl(NamedTuple):
    """How time passes: first and longest step, the local error of a place that a step may make over L, and the end."""

    first: float = 1e-4
    longest: float = 0.05
    accuracy: float = 1e-4
    until: float = 20.0


class Motion(NamedTuple):
    """A moving rod: the time, its shape, `velocities (n+1, 3)` of the vertices and `spins (n,)` of the edges."""

    time: float
    shape: Shape
    velocities: Array
    spins: Array


@dataclass(frozen=True)
class FallMotion:
    """A motion, sampled at every step.

    `times (m,)`, `places (m, n+1, 3)` of the vertices over L, `kinetic (m,)` and `potential (m,)` energies over EI / L,
    the latter with bending, twist, stretch and loads; `last` is where the motion was left and `settled` the stable
    state that it comes to rest in, None unless it has `LANDED`.
    """

    times: Array
    places: Array
    kinetic: Array
    potential: Array
    last: Motion
    fate: Fate
    settled: Shape | None

    def sampled(self, count: int) -> tuple[Array, Array]:
        """Times (count,) at equal distances and places (count, n+1, 3) then, by straight lines between the steps."""
        times = np.linspace(self.times[0], self.times[-1], count)
        columns = self.places.reshape(len(self.times), -1).T
        places = np.array([np.interp(times, self.times, column) for column in columns])
        return times, places.T.reshape(count, *self.places.shape[1:])


def time_unit(segment: ClampedRod) -> float:
    """Seconds per unit of time: sqrt(m L^4 / EI), with the free length L and the section's own mass per length m."""
    return math.sqrt(segment.section.weight / STANDARD_GRAVITY * segment.free_length**4 / segment.stiffness)


def medium_of(segment: ClampedRod) -> Medium:
    """The rotary inertia of a segment's section, with the usual damping."""
    return Medium(gyration=segment.section.gyration / segment.free_length)


def at_rest(rod: SpatialRod, shape: Shape) -> Motion:
    """A rod that does not move, with its ends where they are held, from a `shape` whose last one may be a little off.

    What is off is made good as in a short step: the stiff rod bends instead of stretching, and hardly starts to fall.
    """
    still = _still(shape)
    if rod.held[1] > 0.0 and np.max(np.abs(held_at(rod, shape) - positions(rod, shape)[-1])) > 1e-14:
        for dt in SEATING:
            attempt = step(rod, still, Medium(), dt)
            if attempt is not None:
                return _still(attempt[0].shape)
    return still


def _still(shape: Shape) -> Motion:
    n = shape.strain.size
    return Motion(0.0, shape, np.zeros((n + 1, 3)), np.zeros(n))


def kicked(rod: SpatialRod, shape: Shape, speed: float, seed: int) -> Motion:
    """As `at_rest`, but with smooth random velocities of about `speed`: an imperfection off any symmetry."""
    amplitudes = np.random.default_rng(seed).normal(size=(4, 3))
    arcs = np.concatenate([[0.0], np.cumsum(rod.edges)]) / np.sum(rod.edges)
    waves = np.sin(np.pi * np.outer(arcs, [1.0, 2.0, 3.0, 4.0]))
    waves[-1] = 0.0
    return at_rest(rod, shape)._replace(velocities=0.5 * speed * waves @ amplitudes)


def kinetic_energy(rod: SpatialRod, motion: Motion, medium: Medium) -> float:
    """Kinetic energy of the vertices, and of the edges' spins, over EI / L."""
    moving = lumped(rod.edges) @ np.sum(motion.velocities**2, axis=1)
    return 0.5 * float(moving + medium.gyration**2 * (rod.edges @ motion.spins**2))


def total_energy(rod: SpatialRod, motion: Motion, medium: Medium) -> float:
    """Kinetic energy plus that of bending, twist, stretch and loads, over EI / L."""
    return kinetic_energy(rod, motion, medium) + float(energy(rod, motion.shape))


def step(rod: SpatialRod, motion: Motion, medium: Medium, dt: float) -> tuple[Motion, int] | None:
    """The motion after `dt`, and the iterations that took; None if they did not converge, which a shorter `dt` mends.

    `rod` is as its ends are after the step.
    """
    begin = motion.shape
    before = positions(rod, begin)
    pull = _pull(rod, motion, medium, dt)
    shape = _predicted(rod, motion, dt)
    for iteration in range(1, ITERATIONS + 1):
        gradient, band = assemble(rod, shape)
        add_pull(rod, shape, begin, pull, gradient, band)
        if pull.viscosity > 0.0:
            add_viscosity(rod, shape, pull, gradient, band)
        found = newton_step(rod, shape, gradient, band) if is_giving(rod) else _newton_step(rod, shape, gradient, band)
        if found is None:
            return None
        change, tilts = found
        shape, turn = moved(rod, shape, change, 1.0)
        turn = max(turn, *map(abs, tilts))
        first, last = shape.tilts
        shape = shape._replace(tilts=(first + tilts[0], last + tilts[1]))
        if not turn < LONGEST_TURN:
            return None
        if turn < CLOSE:
            velocities = (positions(rod, shape) - before) / dt
            return Motion(motion.time + dt, shape, velocities, spun(shape, begin) / dt), iteration
    return None


def _pull(rod: SpatialRod, motion: Motion, medium: Medium, dt: float) -> Pull:
    """The quadratic part of the potential of a step: inertia and external damping pull at the same places."""
    weight = (1.0 + medium.external * dt) / dt**2
    coast = dt / (1.0 + medium.external * dt)
    places = positions(rod, motion.shape) + coast * motion.velocities
    inertias = weight * medium.gyration**2 * rod.edges
    bends = strained(rod, motion.shape)
    return Pull(weight * lumped(rod.edges), places, inertias, coast * motion.spins, medium.internal / dt, bends)


def _predicted(rod: SpatialRod, motion: Motion, dt: float) -> Shape:
    """The shape if all went on as it moves; the present one if that is far."""
    change = np.zeros(4 * motion.spins.size + 3)
    for axis in range(3):
        change[axis::4] = dt * motion.velocities[:, axis]
    change[3::4] = dt * motion.spins
    shape, turn = moved(rod, motion.shape, change, 1.0)
    return shape if turn < LONGEST_TURN else motion.shape


def _newton_step(rod: SpatialRod, shape: Shape, gradient: Array, band: Array) -> tuple[Array, Tilts] | None:
    """Newton's step (4n+3,) with the first vertex held and the last one, if the rod holds it, brought to its place.

    Its clamps do not tilt.
    """
    change = np.zeros(gradient.size)
    last = gradient.size - 3
    free = slice(3, gradient.size)
    if rod.held[1] > 0.0:
        free = slice(3, last)
        change[last:] = rod.chord - positions(rod, shape)[-1]
        gradient = gradient + times(band, change)
    factor = cholesky(band[free])
    if factor is None:
        return None
    change[free] = solve_factored(factor, -gradient[free])
    return (change, (0.0, 0.0)) if np.all(np.isfinite(change)) else None


def fall(rod: SpatialRod, start: Motion, medium: Medium, pace: StepControl) -> FallMotion:
    """Let the rod move between ends at rest until it has landed: until less than `LEFT` of what it lost still moves it.

    A step counts only if kinetic plus potential energy does not grow, else it is halved; so the energy falls however
    violent the motion. The state that it comes to rest in is found by descent from the last frame, and not believed
    where the rod is still far from it. The ends of `start` must be where the rod holds them.
    """
    film = _Film(rod, medium, start)
    dt = pace.first
    while True:
        taken, dt = _advanced(film, lambda _: rod, pace, (dt, film.most()))
        if taken is None:
            return film.over(Fate.STUCK, None)
        film.take(rod, taken)
        over = taken.time >= pace.until
        if over or len(film.times) % LOOK == 0:
            settled = film.resting(rod)
            if settled is not None or over:
                return film.over(Fate.MOVING if settled is None else Fate.LANDED, settled)


def _advanced(
    film: _Film, rod_at: Callable[[float], SpatialRod], pace: StepControl, limits: tuple[float, float]
) -> tuple[Motion | None, float]:
    """The next motion of a film, None if no step will do, and how long the step after it may be.

    `limits` are the longest step to try and the energy that it may lead to.
    """
    motion = film.motion
    dt, most = limits
    while dt >= SHORTEST:
        rod = rod_at(motion.time + dt)
        attempt = step(rod, motion, film.medium, dt)
        if attempt is not None:
            taken, iterations = attempt
            # Half the acceleration times dt^2 is what a step of backward Euler misses.
            error = 0.5 * dt * float(np.max(np.abs(taken.velocities - motion.velocities)))
            if error <= 4.0 * pace.accuracy and total_energy(rod, taken, film.medium) <= most:
                growth = min(1.5, 0.9 * math.sqrt(pace.accuracy / max(error, 1e-300)))
                return taken, min(pace.longest, dt * (growth if iterations <= EASY else min(growth, 1.0)))
        dt *= 0.5
    return None, dt


def lead(rod_at: Callable[[float], SpatialRod], start: Motion, medium: Medium, pace: StepControl) -> FallMotion:
    """Move the rod while its ends are led: `rod_at(time)` is the rod with chord, clamps and loads of that time.

    Ends that move do work, so that the energy may grow. Frames, loads and the last vertex can be led: the first vertex
    stays at the origin.
    """
    film = _Film(rod_at(start.time), medium, start)
    dt = pace.first
    while (left := pace.until - film.motion.time) > SHORTEST:
        taken, dt = _advanced(film, rod_at, pace, (min(dt, left), math.inf))
        if taken is None:
            return film.over(Fate.STUCK, None)
        film.take(rod_at(taken.time), taken)
    return film.over(Fate.LED, None)


class _Film:
    """What a motion leaves behind."""

    def __init__(self, rod: SpatialRod, medium: Medium, start: Motion) -> None:
        self.medium = medium
        self.motion = start
        self.times: list[float] = []
        self.places: list[Array] = []
        self.energies: list[tuple[float, float]] = []
        self.take(rod, start)

    def take(self, rod: SpatialRod, motion: Motion) -> None:
        """Keep a frame."""
        self.motion = motion
        self.times.append(motion.time)
        self.places.append(positions(rod, motion.shape))
        self.energies.append((kinetic_energy(rod, motion, self.medium), float(energy(rod, motion.shape))))

    def most(self) -> float:
        """Energy that no later frame may exceed, but for rounding."""
        kinetic, potential = self.energies[-1]
        return kinetic + potential + ROUNDING * (kinetic + abs(potential))

    def resting(self, rod: SpatialRod) -> Shape | None:
        """The stable state in which the rod will come to rest for sure; None where that is still open."""
        shape = self.motion.shape
        if not is_stable(rod, shape):
            return None
        relaxed = descend(rod, shape, ITERATIONS)
        if relaxed.ending is not Rest.SETTLED or float(np.max(np.abs(_turns(relaxed.shape, shape)))) > NEAR:
            return None
        bottom = float(energy(rod, relaxed.shape))
        left, fallen = sum(self.energies[-1]) - bottom, sum(self.energies[0]) - bottom
        return relaxed.shape if left <= LEFT * fallen + ROUNDING * abs(bottom) else None

    def over(self, fate: Fate, settled: Shape | None) -> FallMotion:
        """The film as data."""
        kinetic, potential = np.array(self.energies).T
        return FallMotion(np.array(self.times), np.array(self.places), kinetic, potential, self.motion, fate, settled)


def _turns(after: Shape, before: Shape) -> Array:
    """Angles by which the frames of two shapes differ, (n,) [rad]."""
    cosines = np.abs(np.sum(after.frames * before.frames, axis=1))
    return 2.0 * np.arccos(np.minimum(cosines, 1.0))
