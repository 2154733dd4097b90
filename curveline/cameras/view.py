"""A camera before a display: from points in the display's frame to pixels, and back into a plane of it.

The display's frame has x along the row of nodes from the first node's rail, y up, z towards the viewer, in m; z is 0
where the rod's middle lies. Pixels count from the middle of the one in the upper left corner, x to the right, y down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Grey = npt.NDArray[np.uint8]
MAX_NEWTON = 20
NEAR = 1e-14
"""Steps to take the distortion of a lens out of a direction, and how small the last one is."""


@dataclass(frozen=True)
class Lens:
    """What a camera with a lens at one zoom and focus does: OpenCV's pinhole with five coefficients of distortion.

    It holds for pictures of `size` alone, and of the same focal length, where pictures tell theirs.
    """

    size: tuple[int, int]  # [px] width and height
    focal: tuple[float, float]  # [px] along x and y
    centre: tuple[float, float]  # [px]
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)  # k1, k2, p1, p2, k3
    rms: float = 0.0  # [px] of the corners that it was calibrated on
    focal_length: float | None = None  # [m] as pictures tell it; None if they do not
    equivalent: float | None = None  # [m] the same for a frame of 36 x 24 mm, digital zoom included; None as above

    @property
    def matrix(self) -> Array:
        """The camera matrix (3, 3)."""
        return np.array([[self.focal[0], 0.0, self.centre[0]], [0.0, self.focal[1], self.centre[1]], [0.0, 0.0, 1.0]])

    def pixels(self, rays: Array) -> Array:
        """Where directions `rays (n, 2)`, x and y at z = 1 before the camera, are in the picture: (n, 2) [px]."""
        pixels: Array = self._bent(rays)[0] * self.focal + self.centre
        return pixels

    def rays(self, pixels: Array) -> Array:
        """Directions (n, 2), x and y at z = 1 before the camera, that `pixels (n, 2)` show; Newton's method."""
        bent = (np.asarray(pixels, dtype=float) - self.centre) / self.focal
        rays: Array = bent.copy()
        for _ in range(MAX_NEWTON):
            there, ((xx, xy), (yx, yy)) = self._bent(rays)
            off = bent - there
            step = np.column_stack([yy * off[:, 0] - xy * off[:, 1], xx * off[:, 1] - yx * off[:, 0]])
            rays += step / (xx * yy - xy * yx)[:, None]
            if np.abs(step).max(initial=0.0) < NEAR:
                break
        return rays

    def _bent(self, rays: Array) -> tuple[Array, tuple[tuple[Array, Array], tuple[Array, Array]]]:
        """Where the lens lets directions appear (n, 2), and how that changes with them, ((xx, xy), (yx, yy))."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = rays[:, 0], rays[:, 1]
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * k3))
        slope = 2.0 * (k1 + square * (2.0 * k2 + square * 3.0 * k3))
        across, up = radial * x + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x), radial * y
        up = up + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y
        mixed = slope * x * y + 2.0 * (p1 * x + p2 * y)
        straight = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, radial + slope * y * y + 6.0 * p1 * y
        return np.column_stack([across, up]), ((straight[0], mixed), (mixed, straight[1] + 2.0 * p2 * x))


@dataclass(frozen=True)
class View:
    """A lens and where it is: a point X of the display is at `rotation` X + `translation` before it, z ahead."""

    lens: Lens  # what it looks through
    rotation: Array  # (3, 3)
    translation: Array  # (3,) [m]

    @property
    def eye(self) -> Array:
        """Where the camera is in the display's frame (3,) [m]."""
        eye: Array = -self.rotation.T @ self.translation
        return eye

    def pixels(self, points: Array) -> Array:
        """Where `points (n, 3)` [m], which must be before the camera, are in the picture: (n, 2) [px]."""
        seen = points @ self.rotation.T + self.translation
        return self.lens.pixels(seen[:, :2] / seen[:, 2:])

    def in_plane(self, pixels: Array, depth: float = 0.0) -> Array:
        """Where `pixels (n, 2)` show the plane z = `depth` [m] of the display: x and y (n, 2) [m]."""
        rays = np.column_stack([self.lens.rays(pixels), np.ones(len(pixels))]) @ self.rotation
        eye = self.eye
        found: Array = eye[:2] + rays[:, :2] * ((depth - eye[2]) / rays[:, 2])[:, None]
        return found


@dataclass(frozen=True)
class Tag:
    """A square tag of the family 36h11 on the frame of a display."""

    number: int  # within its family
    centre: tuple[float, float]  # [m] x and y
    turn: float = 0.0  # [rad] counter-clockwise, of its upper edge from +x


@dataclass(frozen=True)
class Frame:
    """The tags on the frame of a display, all in one plane that faces the viewer."""

    tags: tuple[Tag, ...]  # at least two
    size: float  # [m] of the black square of a tag
    depth: float  # [m] z of their plane: negative where the rod's middle is in front of it


@dataclass(frozen=True)
class SeenRod:
    """What of a rod a camera sees, which is not what bends: a back, teeth if it is a rack, and how deep it is.

    The curve that is computed is the rod's neutral fibre, which runs `fibre` beside the middle of the back, towards the
    teeth.
    """

    back: float  # [m] thickness of what has no teeth, in the display's plane
    depth: float  # [m] width of the rod, towards the viewer
    teeth: float = 0.0  # [m] height of the teeth
    pitch: float = 0.0  # [m] from tooth to tooth; 0 without teeth
    side: int = 0  # 1 where the teeth point to the left of the rod's direction (up), -1 to the right; 0 without any
    fibre: float = 0.0  # [m] distance of the neutral fibre from the middle of the back, towards the teeth
