"""A synthetic photograph of a display: its rod, and all that a camera and a laboratory do to the picture of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from curveline.cameras.setup import CameraSetup
from curveline.cameras.synthetic.faults import PictureFaults
from curveline.cameras.synthetic.painted import Greys, PaintedPicture
from curveline.cameras.synthetic.rod_body import body_of
from curveline.cameras.synthetic.stage import (
    hang_clutter,
    in_picture,
    put_on_nodes,
    put_on_tags,
    put_things_before,
    put_up_rails,
)
from curveline.cameras.view import SeenRod, View
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Scene
from curveline.units import mm

Array = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]

POINTS = 401
TAIL = mm(180.0)
DROOP = 0.8
"""Rod that stands out of the first and of the last node, and how it hangs, 1/m."""
SHADOW = np.array([mm(14.0), mm(-22.0)])
"""Where the rod's shadow on the wall is seen from the rod."""
SHADOW_BLUR, SHADOW_PART = 0.002, 6
"""How soft it is, as a part of the picture's width: the lamp is large. It is painted so many times coarser."""
GRAIN = 1.5
"""Grey levels of what is uneven about a wall."""


def curves_of(scene: Scene, states: Sequence[Equilibrium]) -> list[Array]:
    """The curves (n, 2) [m] that a display shows in some states of its segments, in the display's frame."""
    origins = [np.array([index * scene.display.span, node.height]) for index, node in enumerate(scene.nodes)]
    return [state.curve(POINTS) + origin for state, origin in zip(states, origins, strict=False)]


def photograph_of(
    scene: Scene, curves: Sequence[Array], setup: CameraSetup, view: View, faults: PictureFaults
) -> Picture:
    """A grey picture (height, width) of a display whose rod runs along `curves`, each (n, 2) [m]: see `curves_of`.

    Without curves there is no rod in it.
    """
    source = np.random.default_rng([faults.seed, 23])
    canvas = PaintedPicture(view.lens.size, faults.wall)
    hang_clutter(canvas, faults, source)
    _add_grain(canvas.greys, source)
    put_up_rails(canvas, scene, view)
    off = faults.tag_error * source.standard_normal((len(setup.frame.tags), 2))
    put_on_tags(canvas, setup.frame, view, off)
    whole = [_tail(curves[0][::-1]), *curves, _tail(curves[-1])] if curves else []
    _cast_shadow(canvas, whole, setup.rod, view, faults)
    level = float(np.clip(faults.wall + faults.contrast, 4.0, 250.0))
    for number, curve in enumerate(whole):
        # The tail before the first node runs to the left.
        seen = _mirrored(setup.rod) if number == 0 else setup.rod
        canvas.paint(*body_of(curve, seen, view, level))
    put_on_nodes(canvas, scene, setup, view)
    for curve in curves:
        put_things_before(canvas, in_picture(view, curve, 0.0), faults, source)
    return exposed(canvas.greys, faults, source)


def exposed(greys: Greys, faults: PictureFaults, source: np.random.Generator) -> Picture:
    """What a camera makes of greys that it is shown: light, blur, noise, JPEG."""
    import cv2

    height, width = greys.shape
    lit = greys
    if faults.gradient > 0.0:
        way = source.uniform(0.0, 2.0 * np.pi)
        x, y = np.linspace(-0.5, 0.5, width), np.linspace(-0.5, 0.5, height)
        fall = 0.7 * (np.cos(way) * x[None, :] + np.sin(way) * y[:, None]) + 0.6 * (x[None, :] ** 2 + y[:, None] ** 2)
        lit = (greys * (1.0 - faults.gradient * fall)).astype(np.float32)
    blurred = cv2.GaussianBlur(lit, (0, 0), max(faults.blur, 0.3))
    noise = faults.noise * source.standard_normal((height, width), dtype=np.float32)
    taken: Picture = np.clip(np.rint(blurred + noise), 0.0, 255.0).astype(np.uint8)
    if faults.quality == 0:
        return taken
    _, data = cv2.imencode(".jpg", taken, [cv2.IMWRITE_JPEG_QUALITY, faults.quality])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def _add_grain(greys: Greys, source: np.random.Generator) -> None:
    """What is uneven about a wall, slowly."""
    import cv2

    height, width = greys.shape
    coarse = source.standard_normal((12, 16)).astype(np.float32)
    greys += GRAIN * cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)


def _tail(curve: Array) -> Array:
    """The rod that stands out behind the end of a curve, and droops."""
    way = curve[-1] - curve[-2]
    along = np.linspace(0.0, TAIL, 60)[:, None]
    tail: Array = curve[-1] + along * way / np.hypot(*way) - along**2 * np.array([0.0, DROOP])
    return tail


def _mirrored(seen: SeenRod) -> SeenRod:
    """The same rod, seen against its direction."""
    return replace(seen, side=-seen.side)


def _cast_shadow(
    canvas: PaintedPicture, curves: Sequence[Array], seen: SeenRod, view: View, faults: PictureFaults
) -> None:
    """The rod's shadow on the wall."""
    import cv2

    if faults.shadow <= 0.0 or not curves:
        return
    dark = PaintedPicture(view.lens.size, 0.0)
    for curve in curves:
        dark.paint(*body_of(curve + SHADOW, seen, view, 255.0))
    width, height = view.lens.size
    coarse = cv2.resize(dark.greys, (width // SHADOW_PART, height // SHADOW_PART), interpolation=cv2.INTER_AREA)
    soft = cv2.GaussianBlur(coarse, (0, 0), SHADOW_BLUR * width / SHADOW_PART)
    part = cv2.resize(soft, (width, height), interpolation=cv2.INTER_LINEAR)
    canvas.greys *= 1.0 - faults.shadow * np.minimum(part / 255.0, 1.0)
