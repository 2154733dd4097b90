"""PyElastica: an explicit Cosserat rod, run with damping until it is at rest.

Tuned: edges that straddle the clamps; stiffnesses of the section put into its matrices, since constructors know solid
round ones only; the inertia against turning raised until the longitudinal waves alone limit the time step, which a
static answer does not notice and which saves nine steps in ten; damping near the one that comes to rest first.
"""

from __future__ import annotations

import math
import time
from importlib import import_module
from typing import Any

import numpy as np

from curveline.bench.methods.cases import Case
from curveline.bench.methods.own import Method, Solved
from curveline.bench.methods.straddling import STILL, Start, straddling
from curveline.rod.states.equilibrium import SPATIAL
from curveline.scene import Rod

EDGES = (25.0, 50.0, 100.0)
POISSON = 0.3
COURANT = 0.8
"""Time step over the time a longitudinal wave takes along an edge; stable below 1."""
DAMPING = 90.0
"""Damping rate over the time in which a bending wave of the rod's own length passes, sqrt(EI / m L^4)."""
CHECK_STEPS = 500
MOST_STEPS = 400_000


def solve(case: Case, n: float) -> Solved | None:
    """The case on n edges at rest; None if it does not come to rest."""
    start = straddling(case, int(n))
    stepper, simulator, rod, step = _model(case, start)
    when = stepper.step(simulator, 0.0, step)  # compiles
    begin = time.perf_counter()
    for _ in range(MOST_STEPS // CHECK_STEPS):
        for _ in range(CHECK_STEPS):
            when = stepper.step(simulator, when, step)
        speed = float(np.sqrt((rod.velocity_collection**2).sum(axis=0)).max())
        if not speed > STILL:
            break
    seconds = time.perf_counter() - begin
    if not speed <= STILL:
        return None
    positions = rod.position_collection.T[start.free]
    return Solved(len(start.vertices), seconds, start.places(case), positions.copy())


def _model(case: Case, start: Start) -> tuple[Any, Any, Any, float]:
    """Stepper, simulator, rod and time step [s]."""
    elastica: Any = import_module("elastica")
    section, h = case.section, start.h
    rod = _rod(elastica, section, start)
    wave = math.sqrt(section.stretching_stiffness / section.mass_per_length)
    step = COURANT * h / wave
    # The shear springs against the inertia of a turning edge are faster than any wave: slow them to one step.
    shear = float(rod.shear_matrix[0, 0, 0]) * h
    inertia = rod.mass_second_moment_of_inertia
    for axis in (0, 1, 2):
        inertia[axis, axis, :] = max(float(inertia[axis, axis].max()), shear * step**2)
        rod.inv_mass_second_moment_of_inertia[axis, axis, :] = 1.0 / inertia[axis, axis]
    rate = DAMPING * math.sqrt(section.bending_stiffness / section.mass_per_length) / case.rod.free_length**2

    bases = (elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping)
    simulator = type("Scene", bases, {})()
    simulator.append(rod)
    last = len(start.angles)
    simulator.constrain(rod).using(
        elastica.FixedConstraint,
        constrained_position_idx=(0, 1, last - 1, last),
        constrained_director_idx=(0, last - 1),
    )
    if case.rod.weight:
        pull = np.array([0.0, -case.rod.weight / section.mass_per_length, 0.0])
        simulator.add_forcing_to(rod).using(elastica.GravityForces, acc_gravity=pull)
    simulator.dampen(rod).using(elastica.AnalyticalLinearDamper, uniform_damping_constant=rate, time_step=step)
    simulator.finalize()
    return elastica.PositionVerlet(), simulator, rod, step


def _rod(elastica: Any, section: Rod, start: Start) -> Any:
    """A straight rod in the bent start; its directors are z, t x z and t."""
    edges = len(start.angles)
    tangents = np.vstack([np.cos(start.angles), np.sin(start.angles), np.zeros(edges)])
    normals = np.tile([[0.0], [0.0], [1.0]], edges)
    directors = np.stack([normals, np.cross(tangents, normals, axis=0), tangents])
    positions = np.vstack([start.vertices.T, np.zeros(edges + 1)])
    area = section.section.area
    rod = elastica.CosseratRod.straight_rod(
        edges,
        positions[:, 0],
        tangents[:, 0],
        normals[:, 0],
        base_length=edges * start.h,
        base_radius=math.sqrt(area / math.pi),
        density=section.mass_per_length / area,
        youngs_modulus=section.youngs_modulus,
        shear_modulus=section.youngs_modulus / (2.0 * (1.0 + POISSON)),
        position=positions,
        directors=directors,
        rest_kappa=np.zeros((3, edges - 1)),
    )
    rod.bend_matrix[0, 0, :] = section.bending_stiffness
    rod.bend_matrix[1, 1, :] = section.lateral_bending_stiffness
    rod.bend_matrix[2, 2, :] = section.bending_stiffness
    return rod


METHODS = (Method("PyElastica", SPATIAL, EDGES, "edges", solve, package="elastica", few=True),)
