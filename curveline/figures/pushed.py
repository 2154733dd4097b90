"""What figures of a pushed segment share: its nodes, its name, how much of the plane is in sight, and the load."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.figures.common import FORCE, Y_LABEL, PanelFrame, clamp_shown, draw_node, dress, within
from curveline.loading.pushes import Push, Stand
from curveline.rod.problem import Array
from curveline.scene import Scene
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

FLATTEST, STEEPEST = 0.5, 1.2
"""Height over width of what is in sight."""
ROOM = 0.08
"""Beside and above all curves, as a part of the span between nodes."""
ARROW, LETTER = 0.14, 0.08
"""Length of the arrow and of the room for its letter, as parts of the span."""
ASIDE = 9.0
"""From the arrow to the middle of its letter, in points."""


def dress_segment(panel: Axes, scene: Scene, push: Push, places: Array) -> None:
    """The nodes of a pushed segment, its name, labels, and a frame with room around `places (m, 2)` [mm]."""
    for index in (push.segment, push.segment + 1):
        node = scene.nodes[index]
        tangent = math.cos(node.angle), math.sin(node.angle)
        draw_node(panel, (index * scene.display.span, node.height), tangent, clamp_shown(scene.display))
    PanelFrame.around(places.tolist(), ROOM * to_mm(scene.display.span)).within(FLATTEST, STEEPEST).show_in(panel)
    panel.set_title(title_of(scene, push, 3.6))
    dress(panel, Y_LABEL)


def title_of(scene: Scene, push: Push, width: float) -> str:
    """The name of a shape, and which of its segments is pushed, as a title of `width` [inch]."""
    several = f", segment {push.segment + 1}" if len(scene.segments) > 1 else ""
    return f"{within(scene.name, width)}{several}"


def reach_of(stand: Stand, tip: Array, span: float) -> Array:
    """Where an arrow with a `tip (2,)` [mm] begins, and where its letter ends, (2, 2) [mm]."""
    back = to_mm(span) * np.array(stand.toward)
    return np.array([tip - ARROW * back, tip - (ARROW + LETTER) * back])


class LoadArrow:
    """The load on a shape, as an arrow and a letter that can be moved; `artists` are both."""

    def __init__(self, panel: Axes, stand: Stand, span: float) -> None:
        from matplotlib.patches import FancyArrowPatch

        self._stand = stand
        self._span = span
        look: dict[str, Any] = {"arrowstyle": "-|>", "color": FORCE, "linewidth": 2.0, "mutation_scale": 14.0}
        self._arrow = FancyArrowPatch((0.0, 0.0), (0.0, 0.0), **look, shrinkA=0.0, shrinkB=2.0, zorder=4)
        panel.add_patch(self._arrow)
        across, up = stand.toward
        place: dict[str, Any] = {"xytext": (-ASIDE * across, -ASIDE * up), "textcoords": "offset points"}
        style: dict[str, Any] = {"color": FORCE, "ha": "center", "va": "center", "weight": "bold"}
        self._letter = panel.annotate("F", (0.0, 0.0), **place, **style)
        self.artists: list[Artist] = [self._arrow, self._letter]

    def point_at(self, tip: Array) -> None:
        """Have the arrow end at a place (2,) [mm]."""
        tail, _ = reach_of(self._stand, tip, self._span)
        self._arrow.set_positions(tuple(tail.tolist()), tuple(tip.tolist()))
        self._letter.xy = tuple(tail.tolist())
