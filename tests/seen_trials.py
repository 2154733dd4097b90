"""Trials of a display that is not as its file says, as somebody would have measured them: for tests of calibration.

Nodes turn, lift and feed a little otherwise each time, the tracing of a photograph adds a smooth error, and the camera
sees the whole display shifted, turned and larger. Curves of rods that bend alike to both sides are those of `simulate`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from curveline.calibrating.bent_rod import EDGES, BentSegment
from curveline.calibrating.calibrate import calibrated_display
from curveline.calibrating.unknowns import Unknowns
from curveline.cameras.outcomes import TrialOutcome
from curveline.rod.problem import mesh
from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import simulate
from curveline.trial import ShapeTrials, Trial, TrialCurve
from curveline.units import deg, mm

Array = npt.NDArray[np.float64]

EIGHT = tuple(
    f"{shape}-{state}"
    for shape in ("level-neutral", "level-up", "staggered-down", "staggered-asymmetric")
    for state in ("peak", "valley")
)
"""Peaks and valleys of four ways to hold the rod."""
TURNED, FED, LIFTED = deg(0.49), mm(0.49), mm(0.49)
"""What nodes do otherwise each time, standard deviations: trials of a shape then differ by 0.75 mm (MSD)."""
TRACED, ALIKE = mm(0.12), mm(40.0)
"""Error of a traced curve, and the way over which it is alike."""
POINTS = 161


@dataclass(frozen=True)
class Reality:
    """What a display is in truth; `numbers` as of `Unknowns`."""

    numbers: Array
    noise: float = 1.0  # times what is usual

    @classmethod
    def drawn(cls, source: np.random.Generator, nodes: int = 2, *, leaning: bool = False) -> Reality:
        """One of many: gravity length about 400 mm, bearings that give 5 to 15 mm, a camera that is a little off."""
        unknowns = Unknowns(nodes)
        numbers = np.zeros(unknowns.size)
        numbers[0] = source.uniform(0.38, 0.42) ** -3.0
        numbers[1] = mm(source.uniform(5.0, 15.0))
        numbers[2] = source.choice([-1.0, 1.0]) * source.uniform(0.05, 0.1) if leaning else 0.0
        numbers[3 : 3 + nodes] = source.normal(0.0, deg(0.5), nodes)
        numbers[3 + nodes : 2 + 2 * nodes] = source.normal(0.0, mm(0.5), nodes - 1)
        numbers[unknowns.frame] = source.normal(0.0, (mm(0.3), mm(0.3), deg(0.05), 1e-3))
        return cls(numbers)


def trials_of(
    names: tuple[str, ...], reality: Reality, source: np.random.Generator, count: int = 3
) -> tuple[ShapeTrials, ...]:
    """Trials of shapes, without the states' names."""
    return tuple(_trials(read_shape(name), reality, source, count) for name in names)


def _trials(scene: Scene, reality: Reality, source: np.random.Generator, count: int) -> ShapeTrials:
    trials = []
    for number in range(1, count + 1):
        nodes = tuple(
            replace(
                node,
                angle=node.angle + reality.noise * source.normal(0.0, TURNED),
                height=node.height + reality.noise * source.normal(0.0, LIFTED),
            )
            for node in scene.nodes
        )
        segments = tuple(
            replace(each, length=each.length + reality.noise * source.normal(0.0, FED)) for each in scene.segments
        )
        shown = replace(scene, nodes=nodes, segments=segments)
        curves = tuple(TrialCurve(seen(curve, reality, source)) for curve in curves_of(shown, reality))
        trials.append(Trial(f"{scene.name}-{number}.csv", TrialOutcome.SEEN, "", curves))
    return ShapeTrials(scene, tuple(trials))


def curves_of(scene: Scene, reality: Reality) -> list[Array]:
    """The curves (POINTS, 2) [m] of a shape's wanted states in the display's frame."""
    unknowns, numbers = Unknowns(len(scene.nodes)), reality.numbers
    alike = numbers.copy()
    alike[2] = 0.0
    found = []
    display = calibrated_display(scene.display, unknowns, alike)
    for index, states in enumerate(simulate(replace(scene, display=display), mm(0.01), model="planar")):
        state = states.wanted
        assert state is not None, f"{scene.name} is not in the wanted state"
        if numbers[2] == 0.0:
            origin = [index * display.span, scene.nodes[index].height]
            found.append(state.curve(POINTS) + np.array(origin))
            continue
        bent = BentSegment(scene, index, unknowns)
        start = bent.bent(alike, state.start_on(mesh(np.zeros(0), EDGES)))
        assert start is not None
        leaning = bent.bent(numbers, (start.angles, start.multipliers))
        assert leaning is not None, f"{scene.name} is lost"
        found.append(leaning.points[1:-1])
    return found


def seen(curve: Array, reality: Reality, source: np.random.Generator) -> Array:
    """A curve (n, 2) [m] as a camera sees it, and as it was traced."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))])
    spread = np.exp(-0.5 * np.subtract.outer(along, along) ** 2 / ALIKE**2) + 1e-8 * np.eye(along.size)
    error = reality.noise * TRACED * (np.linalg.cholesky(spread) @ source.standard_normal(along.size))
    tangent = np.gradient(curve, axis=0)
    tangent /= np.hypot(*tangent.T)[:, None]
    traced = curve + error[:, None] * np.column_stack([-tangent[:, 1], tangent[:, 0]])
    x, y, turn, scale = reality.numbers[-4:].tolist()
    matrix = (1.0 + scale) * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    shown: Array = traced @ matrix.T + np.array([x, y])
    return shown
