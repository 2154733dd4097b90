"""MuJoCo 4: the discrete elastic rod of a one-dimensional flexcomp, run with the implicit integrator until at rest.

Tuned: edges that straddle the clamps; the pinned vertices moved to their clamps after compilation, which spares soft
`connect` constraints; edges held at their length as stiffly as it goes, as their softness grows with the square of the
time step, hence also a step that shrinks with the square of the edges; damping as much as speeds up coming to rest.
It knows no stretch, so it is held against the inextensible rod.
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
from curveline.rod.states.equilibrium import PLANAR, SPATIAL
from curveline.sections import CrossSection

EDGES = (25.0, 50.0, 100.0)
STEP = 3.75
"""Time step on n edges, times n^2 [s]."""
DAMPING = 3e-3
"""Rayleigh damping [s]."""
CHECK_STEPS = 10
MOST_STEPS = 20_000
MODEL = """<mujoco>
<option timestep="{step!r}" gravity="0 {gravity!r} 0" integrator="discrete" iterations="20" tolerance="1e-10">
<flag contact="disable"/></option>
<worldbody><flexcomp name="rod" type="direct" dim="1" point="{points}" element="{edges}" mass="{mass!r}">
<edge equality="true" solref="-1e10 -2e5" solimp="0.9999 0.9999 0.001"/>
<elasticity young="{young!r}" poisson="0.3" damping="{damping!r}" section="box" sectionsize="{minor!r} {major!r}"/>
<contact selfcollide="none"/>
<pin id="{pins}"/>
</flexcomp></worldbody></mujoco>"""


def solve(case: Case, n: float) -> Solved | None:
    """The case on n edges at rest; None if it does not come to rest."""
    mujoco: Any = import_module("mujoco")
    start = straddling(case, int(n))
    model, data, moving = _model(mujoco, case, start)
    begin = time.perf_counter()
    for _ in range(MOST_STEPS // CHECK_STEPS):
        for _ in range(CHECK_STEPS):
            mujoco.mj_step(model, data)
        speed = float(np.sqrt((data.qvel[moving] ** 2).sum(axis=1)).max())
        if not speed > STILL:
            break
    seconds = time.perf_counter() - begin
    if not speed <= STILL:
        return None
    mujoco.mj_forward(model, data)
    positions = data.flexvert_xpos[start.free].copy()
    return Solved(len(start.vertices), seconds, start.places(case), positions)


def _model(mujoco: Any, case: Case, start: Start) -> tuple[Any, Any, Any]:
    """Model and state at the start, and the velocity indices (k, 3) of the free vertices."""
    section, last = case.section, len(start.angles)
    thickness, width = _box(section.section)
    text = MODEL.format(
        step=STEP / (last - 1) ** 2,
        gravity=-case.rod.weight / section.mass_per_length,
        points=" ".join(f"{i * start.h!r} 0 0" for i in range(last + 1)),
        edges=" ".join(f"{i} {i + 1}" for i in range(last)),
        mass=section.mass_per_length * start.h * last,
        young=section.youngs_modulus,
        damping=DAMPING,
        # The first half-size is the one across the bending in the plane.
        minor=0.5 * thickness,
        major=0.5 * width,
        pins=f"0 1 {last - 1} {last}",
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for i in (0, 1, last - 1, last):
        model.flex_vert[i] = [*start.vertices[i], 0.0]
    bodies = model.flex_vertbodyid[start.free]
    joints = model.body_jntadr[bodies]
    for i, body, joint in zip(range(2, last - 1), bodies, joints, strict=True):
        at = model.jnt_qposadr[joint]
        data.qpos[at : at + 3] = np.array([*start.vertices[i], 0.0]) - model.body_pos[body]
    mujoco.mj_forward(model, data)
    return model, data, model.jnt_dofadr[joints][:, None] + np.arange(3)


def _box(section: CrossSection) -> tuple[float, float]:
    """Thickness and width [m] of the rectangle that bends as the section does, in both directions."""
    flatness = math.sqrt(section.lateral_second_moment / section.second_moment)
    thickness = (12.0 * section.second_moment / flatness) ** 0.25
    return thickness, flatness * thickness


METHODS = (Method("MuJoCo", SPATIAL, EDGES, "edges", solve, package="mujoco", few=True, truth=PLANAR),)
