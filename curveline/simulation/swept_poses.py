"""The poses that a sweep runs through, as arrays, where it is over heights, angles and lengths of rod.

Everything else at its points is the same, so that what a point has to do with rules and with the rod is arithmetic on
a few arrays. Sweeps over other numbers are looked at scene by scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from curveline.scene import Scene
from curveline.shapes.toml_location import KeyPath
from curveline.units import deg, mm

Array = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]

IN_SI: Mapping[str, Callable[[float], float]] = {"height_mm": mm, "angle_deg": deg, "length_mm": mm}
"""The keys that move the nodes in their plane, or the rod through them, and what makes SI of their values."""

MARGIN = 1e-9
"""Relative: what comes as near as that to a bound of a rule is left to the rule itself."""


class SweptPoses:
    """Poses, and what goes with them, at points of a sweep, which are numbered from 0, the last axis running fastest.

    The `axes` are the places of the numbers in the file of `scene`, and their values in the file's units.
    """

    def __init__(self, scene: Scene, axes: Sequence[tuple[KeyPath, Sequence[float]]]) -> None:
        self.scene = scene
        self._axes = axes
        self._counts = tuple(len(values) for _, values in axes)
        self._in_si = [np.array([IN_SI[str(path[-1])](value) for value in values]) for path, values in axes]

    @staticmethod
    def fit(scene: Scene, paths: Sequence[KeyPath]) -> bool:
        """True if a sweep over the numbers at `paths` is one over poses of rods whose ends lie in the plane."""
        return all(path[-1] in IN_SI for path in paths) and not any(node.yaw for node in scene.nodes)

    def values(self, numbers: Numbers) -> Array:
        """The swept values (m, axes) at the points `numbers (m,)`, in the file's units."""
        at = np.unravel_index(numbers, self._counts)
        columns = [np.array(values)[index] for (_, values), index in zip(self._axes, at, strict=True)]
        return np.column_stack(columns)

    def poses(self, segment: int, numbers: Numbers) -> Array:
        """What the nodes of a segment impose, (m, 6) as `Pose` has it, with the offsets of their display."""
        offsets = self.scene.display.offsets
        more = (0.0, 0.0, offsets.angle(segment), offsets.angle(segment + 1), offsets.length(segment), 0.0)
        poses: Array = self._told(segment, numbers) + np.array(more)
        return poses

    def _told(self, segment: int, numbers: Numbers) -> Array:
        """The same as the nodes are told, of which rules speak."""
        heights = [self._at("nodes", node, "height_mm", numbers) for node in (segment, segment + 1)]
        angles = [self._at("nodes", node, "angle_deg", numbers) for node in (segment, segment + 1)]
        length = self._at("segments", segment, "length_mm", numbers)
        across = np.full(numbers.size, self.scene.display.span)
        return np.column_stack([across, heights[1] - heights[0], *angles, length, self._begins(segment, numbers)])

    def _begins(self, segment: int, numbers: Numbers) -> Array:
        """Where of the rod's material a segment begins, (m,), as `simulate.begin_of` has it."""
        display = self.scene.display
        begins = np.zeros(numbers.size)
        if display.rod.profile is not None:
            lengths = [self._at("segments", each, "length_mm", numbers) for each in range(len(self.scene.segments))]
            begins += 0.5 * (display.rod.total_length - sum(lengths)) + sum(lengths[:segment])
        return begins

    def pivots(self, segment: int, numbers: Numbers) -> Array:
        """Both pivots of a segment in the display's frame: x and y of the left, then of the right one (m, 4) [m]."""
        span = self.scene.display.span
        left, right = (self._at("nodes", node, "height_mm", numbers) for node in (segment, segment + 1))
        begin, end = np.full(numbers.size, segment * span), np.full(numbers.size, (segment + 1) * span)
        return np.column_stack([begin, left, end, right])

    def reach(self) -> npt.NDArray[np.bool_]:
        """True for every point at which the rod reaches, suffices, and bears its loads outside the bearings.

        False where rounding might decide that, too. It is what rules ask of several numbers of a file at once.
        """
        numbers = np.arange(int(np.prod(self._counts)))
        display = self.scene.display
        good, total = np.ones(numbers.size, dtype=np.bool_), np.zeros(numbers.size)
        for segment in range(len(self.scene.segments)):
            x, y, start, end, length, _ = self.poses(segment, numbers).T
            half = 0.5 * display.clamp
            across = x - half * (np.cos(start) + np.cos(end))
            shortest = np.hypot(across, y - half * (np.sin(start) + np.sin(end))) + display.clamp
            good &= length > shortest * (1.0 + MARGIN)
            length = self._told(segment, numbers)[:, 4]
            total += length
            for load in self.scene.loads:
                if load.segment == segment:
                    nearest = np.minimum(load.at * length, length - load.at * length)
                    good &= nearest > half + MARGIN * length
        good &= total <= display.rod.total_length
        return good

    def _at(self, table: str, index: int, key: str, numbers: Numbers) -> Array:
        """A number of the scene at points, in SI."""
        for (path, _), values, places in zip(
            self._axes, self._in_si, np.unravel_index(numbers, self._counts), strict=True
        ):
            if path == (table, index, key):
                found: Array = values[places]
                return found
        nodes, segments = self.scene.nodes, self.scene.segments
        fixed = segments[index].length if table == "segments" else nodes[index].height
        return np.full(numbers.size, nodes[index].angle if key == "angle_deg" else fixed)
