"""A lens from corners of a chessboard in several pictures, and what is not known of it after that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curveline.cameras.board_pictures import BoardPicture
from curveline.cameras.boards import charuco_board
from curveline.cameras.opencv import opencv
from curveline.cameras.tag_fit import refined
from curveline.cameras.view import Array, Lens, View

GRID = (9, 7)
"""Places of a picture at which the lens is looked at."""


def fit_lens(
    pictures: Sequence[BoardPicture], size: tuple[int, int], start: Lens | None = None
) -> tuple[Lens, list[BoardPicture]]:
    """The lens that took `pictures` of `size`, by least squares of all corners, and how each of them fits."""
    cv2 = opencv()
    square = np.asarray(charuco_board(1.0).getChessboardCorners(), dtype=np.float32)
    objects = [square[each.numbers] for each in pictures]
    corners = [each.corners.astype(np.float32).reshape(-1, 1, 2) for each in pictures]
    matrix, bends, flags = None, None, 0
    if start is not None:
        matrix, bends, flags = start.matrix, np.array(start.distortion), cv2.CALIB_USE_INTRINSIC_GUESS
    rms, matrix, bends, turns, _, _, _, misses = cv2.calibrateCameraExtended(
        objects, corners, size, matrix, bends, flags=flags
    )
    k1, k2, p1, p2, k3 = (float(each) for each in np.ravel(bends)[:5])
    focal, centre = (float(matrix[0, 0]), float(matrix[1, 1])), (float(matrix[0, 2]), float(matrix[1, 2]))
    lens = Lens(size, focal, centre, (k1, k2, p1, p2, k3), float(rms))
    fitted = [
        replace(picture, rms=float(miss), tilt=_tilt(cv2.Rodrigues(turn)[0]))
        for picture, turn, miss in zip(pictures, turns, np.ravel(misses), strict=True)
    ]
    return lens, fitted


def _tilt(rotation: Array) -> float:
    """Angle [rad] between the axis of the camera and a line square to the board."""
    return float(np.arccos(min(1.0, abs(float(rotation[2, 2])))))


def lens_error(lens: Lens, pictures: Sequence[BoardPicture], distance: float) -> float:
    """Standard error [m], along x or y, of positions in a plane `distance` before the camera, over all of the picture.

    Where the camera stands is found anew with each lens that may be the true one, as tags do it. Corners of a picture
    may be off together, on a bent board or a moving one: what single corners leave open counts, and what pictures do.
    """
    normal, scores, squares, count = np.zeros((9, 9)), np.zeros((9, 9)), 0.0, 0
    for each in pictures:
        reduced, score, left = _told_by(lens, each)
        normal += reduced
        scores += np.outer(score, score)
        squares += left
        count += 2 * len(each.corners) - 6
    inverse = np.linalg.inv(normal)
    by_corners = inverse * squares / max(1, count - 9)
    by_pictures = inverse @ scores @ inverse * len(pictures) / max(1, len(pictures) - 1)
    return _spread(lens, by_corners + by_pictures, distance)


def _told_by(lens: Lens, picture: BoardPicture) -> tuple[Array, Array, float]:
    """What a picture tells of the nine numbers of a lens: how firmly (9, 9), its pull (9,), and what is left over."""
    cv2 = opencv()
    square = np.asarray(charuco_board(1.0).getChessboardCorners(), dtype=float)[picture.numbers]
    numbers = lens.matrix, np.array(lens.distortion)
    corners = picture.corners.reshape(-1, 1, 2)
    _, turn, shift = cv2.solvePnP(square, corners, *numbers, flags=cv2.SOLVEPNP_ITERATIVE)
    seen, slopes = cv2.projectPoints(square, turn, shift, *numbers)
    left = (corners - seen).ravel()
    place, own = slopes[:, :6], slopes[:, 6:15]
    free = own - place @ np.linalg.lstsq(place, own, rcond=None)[0]
    return free.T @ free, free.T @ left, float(left @ left)


def _spread(lens: Lens, covariance: Array, distance: float) -> float:
    """Standard error [m] of positions, from the covariance of fx, fy, cx, cy and the distortion."""
    sizes, axes = np.linalg.eigh(covariance)
    numbers = np.array([*lens.focal, *lens.centre, *lens.distortion])
    total = 0.0
    for size, axis in zip(sizes, axes.T, strict=True):
        step = np.sqrt(max(0.0, size)) * axis
        fx, fy, cx, cy, k1, k2, p1, p2, k3 = numbers + step
        other = replace(lens, focal=(fx, fy), centre=(cx, cy), distortion=(k1, k2, p1, p2, k3))
        total += float(np.square(displaced(lens, other, distance)).mean())
    return float(np.sqrt(total))


def displaced(lens: Lens, other: Lens, distance: float) -> Array:
    """By how much (n, 2) [m] another lens has places all over a picture elsewhere, in a plane that faces the camera.

    Both see the outermost of these places, where tags would be, and the camera of the other stands where that fits.
    """
    width, height = lens.size
    x, y = (np.linspace(0.03, 0.97, count) * (side - 1.0) for count, side in zip(GRID, (width, height), strict=True))
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    facing = View(lens, np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, distance]))
    places = facing.in_plane(pixels)
    is_border = np.isin(pixels[:, 0], x[[0, -1]]) | np.isin(pixels[:, 1], y[[0, -1]])
    border = np.column_stack([places[is_border], np.zeros(is_border.sum())])
    start = View(other, facing.rotation, facing.translation)
    found, _, _ = refined(start, border, pixels[is_border], np.ones(2 * len(border)))
    return found.in_plane(pixels) - places
