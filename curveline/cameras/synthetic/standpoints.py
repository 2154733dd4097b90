"""Where a synthetic camera stands, and what it looks at."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from curveline.cameras.setup import CameraSetup, SeenNode
from curveline.cameras.view import Frame, Lens, SeenRod, Tag, View
from curveline.scene import Display
from curveline.units import mm

Array = npt.NDArray[np.float64]

RACK = SeenRod(back=mm(2.2), depth=mm(10.0), teeth=mm(2.25), pitch=mm(np.pi), side=1, fibre=mm(0.08))
"""What is seen of the rack that the built-in displays are made with; backing and depth are estimates."""
NODE = SeenNode(half_width=mm(32.0), half_height=mm(28.0))
TAG = mm(60.0)
UP, BEHIND = mm(325.0), mm(25.0)
"""Where the tags of the synthetic frame are: at rails and, of two rails, between them, above and below the rod, behind
it."""
ASIDE, MARGIN = mm(120.0), mm(20.0)
"""What a picture shows beside the rails, and above and below the tags, at least."""
FOCAL = 1.15
"""Focal length of a synthetic lens over the longer side of its picture."""
BESIDE = -0.06, 0.05, 0.0
"""Where a camera stands that nobody placed: see `view_through`."""
SIZES = (1920, 1440), (1920, 1440), (2592, 1944), (3264, 2448), (4032, 3024)
"""Of pictures [px]."""


def default_setup(display: Display, lens: Lens) -> CameraSetup:
    """A frame with two rows of tags, and the rod of the built-in displays, before a camera with a lens."""
    rails = [number * display.span for number in range(display.node_count)]
    columns = rails if len(rails) > 2 else [rails[0], 0.5 * (rails[0] + rails[1]), rails[1]]
    tags = tuple(Tag(number, place) for number, place in enumerate((x, y) for y in (UP, -UP) for x in columns))
    return CameraSetup(lens, Frame(tags, TAG, -BEHIND), RACK, NODE, "synthetic")


def looking_at(lens: Lens, middle: Array, eye: Array, roll: float = 0.0) -> View:
    """A camera at `eye (3,)` that looks at `middle (3,)` [m], turned about its own axis by `roll` [rad]."""
    ahead = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross(ahead, [np.sin(roll), np.cos(roll), 0.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(ahead, right), ahead])
    return View(lens, rotation, -rotation @ eye)


def default_view(display: Display, size: tuple[int, int] = (1920, 1440)) -> View:
    """A camera that sees all of a display, a little from the left and from above."""
    focal = FOCAL * max(size)
    return view_through(Lens(size, (focal, focal), (0.5 * size[0] - 0.5, 0.5 * size[1] - 0.5)), display)


def view_through(lens: Lens, display: Display, beside: tuple[float, float, float] = BESIDE, pixel: float = 0.0) -> View:
    """A camera with a lens that sees all of a display, at `pixel` [m] or more.

    `beside` says how far it is to the right and above, in parts of its distance, and how it rolls [rad].
    """
    width = display.span * (display.node_count - 1)
    need = np.array([width + 2.0 * ASIDE, 2.0 * (UP + 0.625 * TAG + MARGIN)])
    away = float(np.max(np.maximum(need / lens.size, pixel) * lens.focal))
    middle = np.array([0.5 * width, 0.0, 0.0])
    return looking_at(lens, middle, middle + away * np.array([beside[0], beside[1], 1.0]), beside[2])


def standpoint_of(display: Display, seed: int) -> View:
    """A camera as a seed has it: 0.3 to 0.95 mm a pixel, 1920 to 4032 pixels wide, tilted, with a lens that bends."""
    source = np.random.default_rng([seed, 31])
    size = SIZES[int(source.integers(len(SIZES)))]
    pixel = mm(source.uniform(0.3, 0.92))
    right, above, roll = source.normal(0.0, 0.09), source.normal(0.0, 0.09), source.normal(0.0, 0.02)
    bent, focal = source.normal(0.0, 0.06), FOCAL * max(size)
    centre = 0.5 * size[0] - 0.5 + source.normal(0.0, 8.0), 0.5 * size[1] - 0.5 + source.normal(0.0, 8.0)
    lens = Lens(size, (focal, focal), centre, (bent, -0.3 * bent, 0.0, 0.0, 0.0))
    return view_through(lens, display, (right, above, roll), pixel)
