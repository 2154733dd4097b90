"""A camera before a display: from points in the display's frame to pixels, and back into a plane of it.

The display's frame has x along the row of nodes from the first node's rail, y up, z towards the viewer, in m; z is 0
where the rod's middle lies. Pixels count from the middle of the one in the upper left corner, x to the right, y down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


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

    @property
    def matrix(self) -> Array:
        """The camera matrix (3, 3)."""
        return np.array([[self.focal[0], 0.0, self.centre[0]], [0.0, self.focal[1], self.centre[1]], [0.0, 0.0, 1.0]])


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
        """Where `points (n, 3)` [m] are in the picture: (n, 2) [px]."""
        import cv2

        turned, _ = cv2.Rodrigues(self.rotation)
        found, _ = cv2.projectPoints(
            np.ascontiguousarray(points), turned, self.translation, self.lens.matrix, np.array(self.lens.distortion)
        )
        return np.asarray(found, dtype=float).reshape(-1, 2)

    def in_plane(self, pixels: Array, depth: float = 0.0) -> Array:
        """Where `pixels (n, 2)` show the plane z = `depth` [m] of the display: x and y (n, 2) [m]."""
        import cv2

        straight = cv2.undistortPoints(
            np.ascontiguousarray(pixels, dtype=float).reshape(-1, 1, 2),
            self.lens.matrix,
            np.array(self.lens.distortion),
        ).reshape(-1, 2)
        rays = np.column_stack([straight, np.ones(len(straight))]) @ self.rotation
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
