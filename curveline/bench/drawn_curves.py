"""Random drawings to be fitted: curves that a display can show, with noise, and curves of many kinds that it cannot."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import numpy.typing as npt

from curveline.drawings.drawing import Drawing
from curveline.fitting.starts import level_rod
from curveline.planning.actuator_loads import actuator_load_of, clamp_loads_of_state
from curveline.rod.branches.continuation import STIFFEST
from curveline.rod.problem import Pose
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states
from curveline.scene import Display

Array = npt.NDArray[np.float64]
Source = np.random.Generator

POINTS = 201
"""Of a drawing, per segment."""
NOISE = 0.5e-3
"""Of each coordinate of a point [m]."""
HIGH, LOW = 0.12, 0.03
"""How high waves and walks are drawn at most and at least [m]."""
STEADY, STRONG = 0.15, 0.85
"""The least margin of a state that is drawn, and the part of what motors give that it asks for at most."""


def reachable(display: Display, seed: int) -> Drawing:
    """A random stable curve of a segment of a display, within its limits, every point with noise."""
    source = np.random.default_rng([11, seed])
    rod, limits = level_rod(display), display.limits
    while True:
        heights = source.uniform(limits.height.low, limits.height.high, 2)
        rise, chord = float(heights[1] - heights[0]), float(np.hypot(display.span, heights[1] - heights[0]))
        if chord * 1.002 > limits.length.high:
            continue
        angles = source.uniform(limits.angle.low, limits.angle.high, 2)
        length = float(source.uniform(max(chord * 1.002, limits.length.low), limits.length.high))
        pose = Pose(display.span, rise, float(angles[0]), float(angles[1]), length)
        found = [state for state in find_states(rod.moved_to(pose), 1e-4) if _is_shown(state, display)]
        if not found:
            continue
        curve = found[source.integers(len(found))].curve(POINTS) + np.array([0.0, heights[0]])
        if curve[1:-1, 0].min() > 0.0 and curve[1:-1, 0].max() < display.span:
            return Drawing(_noisy(curve, display.span, source), "reachable")


def _is_shown(state: Equilibrium, display: Display) -> bool:
    """True for a stable state that leaves room."""
    if not (state.simple and state.stable) or state.lowest_eigenvalue < STEADY * STIFFEST:
        return False
    return actuator_load_of((clamp_loads_of_state(state),)).share(display) < STRONG


def _noisy(curve: Array, span: float, source: Source) -> Array:
    """A curve with noise, from rail to rail all the same."""
    noisy = curve + NOISE * source.standard_normal(curve.shape)
    noisy[1:-1, 0] = np.clip(noisy[1:-1, 0], 1e-5, span - 1e-5)
    noisy[[0, -1], 0] = 0.0, span
    return noisy


def unreachable(span: float, segments: int, seed: int) -> Drawing:
    """A random drawing over some segments that hardly any display shows, of one kind after another."""
    source, name = np.random.default_rng([7, seed]), list(KINDS)[seed % len(KINDS)]
    return Drawing(KINDS[name](source, span * segments, segments), name)


def _places(width: float, segments: int) -> Array:
    return np.linspace(0.0, width, (POINTS - 1) * segments + 1)


def _scaled(y: Array, source: Source) -> Array:
    """Heights as high as a drawing is at random."""
    scaled: Array = y * (source.uniform(LOW, HIGH) / np.abs(y).max())
    return scaled


def _waves(source: Source, width: float, segments: int) -> Array:
    x, order = _places(width, segments), np.arange(1, 2 * segments + 3)[:, None]
    size = source.standard_normal(order.shape) / order**1.2
    phase = source.uniform(0.0, 2.0 * np.pi, order.shape)
    return np.column_stack([x, _scaled((size * np.sin(np.pi * order * x / width + phase)).sum(axis=0), source)])


def _polygon(source: Source, width: float, segments: int) -> Array:
    corners = int(source.integers(2, 4)) * segments
    x = np.concatenate([[0.0], np.sort(source.uniform(0.05, 0.95, corners - 1)) * width, [width]])
    return np.column_stack([x, source.uniform(-0.08, 0.08, corners + 1)])


def _walk(source: Source, width: float, segments: int) -> Array:
    x, window = _places(width, segments), np.hanning(61)
    walked = np.pad(np.cumsum(source.standard_normal(x.size)), 60, mode="edge")
    y = np.convolve(walked, window / window.sum(), "same")[60:-60]
    return np.column_stack([x, _scaled(y - y.mean(), source)])


def _overhanging(source: Source, width: float, segments: int) -> Array:
    """Cubics between rails whose handles are so long that some lean over."""
    span, share = width / segments, np.linspace(0.0, 1.0, POINTS)[:, None]
    heights, parts = source.uniform(-0.06, 0.06, segments + 1), []
    for segment in range(segments):
        begin, end = (np.array([(segment + side) * span, heights[segment + side]]) for side in range(2))
        one, other = (np.array([span * source.uniform(0.3, 1.1), source.uniform(-0.25, 0.25)]) for _ in range(2))
        rest = 1.0 - share
        parts.append(
            rest**3 * begin
            + 3.0 * share * rest**2 * (begin + one)
            + 3.0 * share**2 * rest * (end - other)
            + share**3 * end
        )
    return np.vstack(parts)


def _nearly_flat(source: Source, width: float, segments: int) -> Array:
    x = _places(width, segments)
    waves, phase = segments * int(source.integers(1, 3)), source.choice([0.0, np.pi])
    return np.column_stack([x, source.uniform(0.002, 0.01) * np.sin(np.pi * waves * x / width + phase)])


def _step(source: Source, width: float, segments: int) -> Array:
    """A step at a rail or between two, more or less steep."""
    rail = width / segments * int(source.integers(1, segments)) if segments > 1 else 0.5 * width
    at = float(source.choice([rail, source.uniform(0.2, 0.8) * width]))
    height, run = source.uniform(0.02, 0.1) * source.choice([-1.0, 1.0]), float(source.choice([1e-3, 0.02, 0.05]))
    return np.array([[0.0, 0.0], [at - 0.5 * run, 0.0], [at + 0.5 * run, height], [width, height]])


KINDS: Mapping[str, Callable[[Source, float, int], Array]] = {
    "waves": _waves,
    "polygon": _polygon,
    "walk": _walk,
    "overhanging": _overhanging,
    "nearly flat": _nearly_flat,
    "step": _step,
}
"""What drawings no display shows are made of."""


def drawings(display: Display, kind: str, count: int, seed: int) -> Iterator[Drawing]:
    """So many drawings, "reachable" by a lone segment of a display, or "unreachable" by all of its segments."""
    for number in range(seed, seed + count):
        yield (
            reachable(display, number)
            if kind == "reachable"
            else unreachable(display.span, display.node_count - 1, number)
        )
