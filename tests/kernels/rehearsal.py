"""Calls of every shipped kernel, as commands make them: arguments before and after, and what came back."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any
from unittest import mock

import numpy as np

import curveline
from curveline.fitting.fit import FitRequest
from curveline.fitting.starts import level_rod
from curveline.kernels.kernel import SHIPPED, Kernel
from curveline.replay.trials import TrialsRequest
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.straight import straight_state
from curveline.rod.natural_curvature import NaturalCurvature
from curveline.rod.problem import Bearing, Pose
from curveline.rod.spatial.dynamics import Medium
from curveline.rod.states.planar_states import find_states
from curveline.scene import Profile
from curveline.sections import Rectangle
from curveline.shapes.files import read_display, read_shape
from curveline.simulation.batch import Order, line_of
from curveline.simulation.results import Settings
from curveline.simulation.sweep import Sweep
from curveline.simulation.sweep_run import SweepRun

SHAPES = Path(__file__).parents[2] / "shapes"


@dataclass(frozen=True)
class Call:
    """One call of a kernel."""

    kernel: Kernel
    before: tuple[Any, ...]
    after: tuple[Any, ...]
    result: Any


def shipped_kernels() -> list[Kernel]:
    """All of the package."""
    for module in walk_packages(import_module("curveline.rod").__path__, "curveline.rod."):
        import_module(module.name)
    return list(SHIPPED)


@contextmanager
def recorded(calls: dict[str, Call]) -> Iterator[None]:
    """Note the first call of each shipped kernel."""
    kernels = shipped_kernels()
    for kernel in kernels:
        kernel._run = _noting(kernel, kernel._run, calls)
    yield
    for kernel in kernels:
        kernel._run = kernel._decided


def _noting(kernel: Kernel, run: Callable[..., Any], calls: dict[str, Call]) -> Callable[..., Any]:
    def noted(*arguments: Any, **named: Any) -> Any:
        if kernel.path in calls:
            return run(*arguments, **named)
        before = copy.deepcopy(arguments)
        result = run(*arguments, **named)
        kernel._run = noted
        calls[kernel.path] = Call(kernel, before, copy.deepcopy(arguments), copy.deepcopy(result))
        return result

    return noted


def rehearse() -> None:
    """What calls every shipped kernel."""
    for shape in ("level-up-peak", "roofline", "space/leaning", "space/pushed", "space/twisted"):
        curveline.simulate(SHAPES / f"{shape}.toml")
    curveline.simulate_poses("level-up-peak", [(0.5, 0.0, 0.5, -0.5, 0.6)])
    swept = Sweep("level-up-peak", ["nodes.1.angle_deg=20:30:2"])
    list(SweepRun(swept, Order(Settings(points=5), (line_of,)), 1).stretches())
    scene = read_shape(SHAPES / "level-asymmetric-peak.toml")
    for angle in (-51.0, -48.0):  # near a fold
        nodes = (replace(scene.nodes[0], angle=math.radians(angle)), *scene.nodes[1:])
        segments = (replace(scene.segments[0], length=0.66),)
        curveline.simulate(replace(scene, nodes=nodes, segments=segments))
    past = Pose(0.5, 0.4396361684437719, 0.27157156659462056, 0.27157156659462056, 0.7009933625065874)
    find_states(ClampedRod(past, Bearing(0.0, 0.222, 0.0)), 1e-4)  # past a pitchfork, which coarse edges have later
    curveline.simulate(SHAPES / "level-up-peak.toml", model="spatial")
    heavy = read_shape(SHAPES / "level-up-peak.toml")
    rod = replace(heavy.display.rod, mass_per_length=15.0)
    curveline.simulate(replace(heavy, display=replace(heavy.display, rod=rod)), windings=(0, 1))
    nodes = tuple(replace(node, angle=0.0) for node in heavy.nodes)
    taut = replace(heavy, nodes=nodes, segments=(replace(heavy.segments[0], length=0.5001),))
    curveline.simulate(taut, model="extensible")
    narrow = replace(heavy.display.rod, section=Rectangle(0.002, 0.0024))
    long = replace(heavy.segments[0], length=0.85)
    curveline.simulate(replace(taut, display=replace(heavy.display, rod=narrow), segments=(long,)))  # leaves its plane
    bent = replace(heavy.display.rod, profile=Profile((0.8, 1.2), (0.3, -0.3)))
    for model in ("auto", "spatial"):
        curveline.simulate(replace(heavy, display=replace(heavy.display, rod=bent)), model=model)
    NaturalCurvature(np.array([0.0]), np.array([1.0]))(np.array([0.5]))
    # A straight rod that Newton's method loses, and a softer one leads to.
    tilted = Pose(0.5, -0.03413766025773168, -0.028881427794499703, -0.03279219857682305, 0.5013615927491758)
    straight_state(level_rod(read_display("single")).moved_to(tilted), 1e-4)
    curveline.fit([(0.0, 0.0), (0.25, 0.1), (0.5, 0.0)], request=FitRequest(is_planned=False))
    plan = curveline.plan(SHAPES / "level-asymmetric-peak.toml")
    curveline.monte_carlo(plan, TrialsRequest(runs=3, jobs=1))
    snapped = curveline.load(SHAPES / "level-up-peak.toml")
    with mock.patch("curveline.loading.falling.medium_of", return_value=Medium(internal=0.01)):
        curveline.fall(snapped)
    curveline.load_map(SHAPES / "level-up-peak.toml", points=5)
