"""What stands around the rod in a synthetic photograph: wall, things on it, rails, nodes, tags, what is in the way."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from curveline.cameras.setup import CameraSetup
from curveline.cameras.synthetic.faults import PictureFaults
from curveline.cameras.synthetic.painted import PaintedPicture
from curveline.cameras.view import Frame, Tag, View
from curveline.scene import Scene
from curveline.units import mm

Array = npt.NDArray[np.float64]

RAIL = mm(12.0)
"""Half of a rail's width."""
RAIL_DEPTH, NODE_DEPTH = mm(-15.0), mm(6.0)
"""Where the fronts of rails and nodes are."""
RAIL_REACH = mm(275.0)
"""How far rails go up and down."""
TAG_CELLS = 8
"""Cells of a tag of 36h11 along an edge, with its black border."""
QUIET = 1.25
"""The white square behind a tag over the black one."""
PAPER, INK = 225.0, 25.0


def in_picture(view: View, corners: Array, depth: float) -> Array:
    """Where corners (n, 2) [m] that lie in a plane of the display are in the picture (n, 2) [px]."""
    return view.pixels(np.column_stack([corners, np.full(len(corners), depth)]))


def rectangle(x: float, y: float, half_width: float, half_height: float) -> Array:
    """The corners (4, 2) of an upright rectangle."""
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    corners: Array = np.array([x, y]) + signs * np.array([half_width, half_height])
    return corners


def hang_clutter(canvas: PaintedPicture, faults: PictureFaults, source: np.random.Generator) -> None:
    """Posters, shelves, cables and lines on the wall."""
    height, width = canvas.greys.shape
    unit = width / 100.0
    for _ in range(faults.clutter):
        kind, level = source.integers(3), float(source.uniform(10.0, 245.0))
        place = source.uniform(0.0, 1.0, 2) * (width, height)
        if kind == 0:
            box = rectangle(0.0, 0.0, *(unit * source.uniform(1.0, 12.0, 2)))
            canvas.paint([_turned(box, source.normal(0.0, 0.2)) + place], [level], 0.9)
        elif kind == 1:
            canvas.paint([_strip(_wave(place, width, source), unit * source.uniform(0.1, 0.6))], [level])
        else:
            box = rectangle(0.0, 0.0, unit * source.uniform(8.0, 60.0), unit * source.uniform(0.08, 0.8))
            canvas.paint([_turned(box, source.uniform(0.0, np.pi)) + place], [level])


def put_things_before(canvas: PaintedPicture, curve: Array, faults: PictureFaults, source: np.random.Generator) -> None:
    """What hides parts of a rod along a `curve (n, 2)` [px], as long in all as faults say, at up to three places."""
    if faults.occlusion <= 0.0:
        return
    count = int(source.integers(1, 4))
    length = float(np.sum(np.hypot(*np.diff(curve, axis=0).T)))
    for place in source.uniform(0.08, 0.92, count):
        middle = curve[int(place * (len(curve) - 1))]
        box = rectangle(0.0, 0.0, 0.5 * faults.occlusion * length / count, length * source.uniform(0.03, 0.2))
        turned = np.arctan2(*(curve[-1] - curve[0])[::-1]) + source.normal(0.0, 0.3)
        canvas.paint([_turned(box, turned) + middle], [float(source.uniform(20.0, 235.0))])


def put_up_rails(canvas: PaintedPicture, scene: Scene, view: View) -> None:
    """The rails, behind rod and nodes."""
    for number in range(len(scene.nodes)):
        x = number * scene.display.span
        corners = rectangle(x, 0.0, RAIL, RAIL_REACH)
        canvas.paint([in_picture(view, corners, RAIL_DEPTH)], [150.0 + 20.0 * np.sin(number)])


def put_on_nodes(canvas: PaintedPicture, scene: Scene, setup: CameraSetup, view: View) -> None:
    """The nodes, which hide the rod that is in them."""
    for number, node in enumerate(scene.nodes):
        x, sizes = number * scene.display.span, (setup.node.half_width, setup.node.half_height)
        outside = in_picture(view, rectangle(x, node.height, *sizes), NODE_DEPTH)
        inside = rectangle(x, node.height, 0.6 * sizes[0], 0.5 * sizes[1])
        canvas.paint([outside, in_picture(view, inside, NODE_DEPTH)], [70.0, 110.0])


def put_on_tags(canvas: PaintedPicture, frame: Frame, view: View, off: Array) -> None:
    """The tags of a frame, each `off (n, 2)` [m] from where it should be."""
    import cv2

    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    for tag, error in zip(frame.tags, off, strict=True):
        cells = cv2.aruco.generateImageMarker(family, tag.number, TAG_CELLS) > 0
        edges = np.linspace(-0.5, 0.5, TAG_CELLS + 1) * frame.size
        squares = [rectangle(0.0, 0.0, 0.5 * QUIET * frame.size, 0.5 * QUIET * frame.size)]
        squares.append(rectangle(0.0, 0.0, 0.5 * frame.size, 0.5 * frame.size))
        for row, column in zip(*np.nonzero(cells), strict=True):
            (left, right), (top, bottom) = edges[column : column + 2], -edges[row : row + 2]
            squares.append(np.array([[left, bottom], [right, bottom], [right, top], [left, top]]))
        levels = [PAPER, INK, *[PAPER] * (len(squares) - 2)]
        canvas.paint([_placed(each, tag, error, frame, view) for each in squares], levels)


def _placed(square: Array, tag: Tag, error: Array, frame: Frame, view: View) -> Array:
    return in_picture(view, _turned(square, tag.turn) + tag.centre + error, frame.depth)


def _turned(corners: Array, angle: float) -> Array:
    cosine, sine = np.cos(angle), np.sin(angle)
    turned: Array = corners @ np.array([[cosine, sine], [-sine, cosine]])
    return turned


def _wave(place: Array, width: int, source: np.random.Generator) -> Array:
    """A cable that hangs or lies about, (n, 2) [px]."""
    along = np.linspace(-0.5, 0.5, 60) * width * source.uniform(0.2, 0.9)
    across = sum(
        width * source.normal(0.0, 0.03) * np.sin(2.0 * np.pi * (k * along / width + source.uniform()))
        for k in (1, 2, 3)
    )
    return _turned(np.column_stack([along, across]), source.uniform(0.0, np.pi)) + place


def _strip(curve: Array, width: float) -> Array:
    """The outline (2 n, 2) of a strip along a curve."""
    slopes = np.gradient(curve, axis=0)
    normals = np.column_stack([-slopes[:, 1], slopes[:, 0]]) / np.hypot(*slopes.T)[:, None]
    return np.concatenate([curve + 0.5 * width * normals, (curve - 0.5 * width * normals)[::-1]])
