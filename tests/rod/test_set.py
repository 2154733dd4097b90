"""A shape after another one against collocation, which knows no places, with the set of the closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

import curveline
from curveline.material.relaxation import power_law
from curveline.rod.geometry.vertex_table import CURVATURE
from curveline.rod.profile import NO_PROFILE
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Scene
from curveline.simulation.dwelling import scene_after
from curveline.simulation.simulate import simulate

from .collocation import collocated

EIGHT_HOURS = 28_800.0


def shape(name: str) -> Scene:
    """A shape of the project without weight, whose rod takes acetal's set."""
    scene = curveline.read_shape(name)
    rod = replace(scene.display.rod, relaxation=power_law())
    return replace(scene, display=replace(scene.display, rod=rod, gravity=False))


def wanted(scene: Scene) -> Equilibrium:
    state = simulate(scene, 1e-6)[0].wanted
    assert state is not None
    return state


def test_a_peak_after_its_valley_is_that_of_collocation() -> None:
    # Without weight the valley keeps its curve, and leaves the same part of its curvature everywhere.
    peak, valley = shape("level-asymmetric-peak"), wanted(shape("level-asymmetric-valley"))
    state = wanted(scene_after(peak, "level-asymmetric-valley@8h", shape))
    along = np.concatenate(([0.0], np.cumsum(valley.edges)))
    left = CubicSpline(along, power_law().set_after(EIGHT_HOURS) * valley.vertices_table[:, CURVATURE])
    plain = state.but(rod=replace(state.rod, bearing=state.rod.bearing._replace(profile=NO_PROFILE)))
    exact, _ = collocated(plain, left)
    ours, fresh = (each.curve(7001)[100:6901:68] for each in (state, wanted(peak)))
    moved = np.linalg.norm(fresh - exact, axis=1).max()
    assert moved > 0.02
    # The set ends at the mouths, and is blurred there over 5 mm of rod.
    off = np.linalg.norm(ours - exact, axis=1).max()
    assert off < 0.012 * moved
