"""Where a camera stands, from the corners of tags whose places are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from curveline.cameras.opencv import opencv
from curveline.cameras.view import Array, Frame, Lens, Tag, View
from curveline.units import mm

MAX_STEPS = 30
CONVERGED = 1e-10
"""Of the last step, in radians and in distances to the display."""
TOLERANCE = mm(1.0)
"""[m] by which the corners of a tag may be off, as a root mean square: more than a ruler is."""
LEAST_NOISE = 0.02
"""[px] of a corner that nothing is more exact than: lenses and pixels are not as even as that."""


@dataclass(frozen=True)
class SeenTag:
    """A tag as a picture shows it."""

    tag: Tag  # as the camera file has it
    corners: Array  # (4, 2) [px]
    width: float  # [px] of its edges, from a tenth of the contrast to nine tenths
    noise: float  # [px] standard error of a corner


@dataclass(frozen=True)
class Placed:
    """Where the camera stands by some tags."""

    view: View  # its place and its lens
    tags: tuple[SeenTag, ...]  # by which that was found
    covariance: Array  # (6, 6) of a turn [rad] and a shift [m] of what the camera sees, if tags are where they are told


def corners_of(tag: Tag, frame: Frame) -> Array:
    """The corners (4, 3) [m] of a tag on the display, as it is read: upper left and right, lower right and left."""
    half = 0.5 * frame.size
    square = np.array([[-half, half], [half, half], [half, -half], [-half, -half]])
    turn = np.array([[np.cos(tag.turn), np.sin(tag.turn)], [-np.sin(tag.turn), np.cos(tag.turn)]])
    return np.column_stack([square @ turn + tag.centre, np.full(4, frame.depth)])


def offsets(view: View, seen: SeenTag, frame: Frame) -> Array:
    """By how much (4, 2) [m] the corners of a tag are not where the camera file has them, in the tags' plane."""
    found: Array = view.in_plane(seen.corners, frame.depth) - corners_of(seen.tag, frame)[:, :2]
    return found


def off(view: View, seen: SeenTag, frame: Frame) -> float:
    """How far a tag is off [m], as the root mean square of its corners."""
    return float(np.sqrt(np.square(offsets(view, seen, frame)).sum(axis=1).mean()))


def place(lens: Lens, frame: Frame, tags: Sequence[SeenTag]) -> Placed | None:
    """The camera by all of `tags`, at least two; None where they allow of none before the display."""
    points = np.concatenate([corners_of(each.tag, frame) for each in tags])
    pixels = np.concatenate([each.corners for each in tags])
    sigma = np.repeat([max(each.noise, LEAST_NOISE) for each in tags], 8)
    best: tuple[float, View, Array] | None = None
    for start in _starts(lens, points, pixels):
        view, covariance, cost = refined(start, points, pixels, sigma)
        if view.eye[2] > frame.depth and (best is None or cost < best[0]):
            best = cost, view, covariance
    return None if best is None else Placed(best[1], tuple(tags), best[2])


def consensus(lens: Lens, frame: Frame, tags: Sequence[SeenTag]) -> Placed | None:
    """The camera by as many tags as agree with each other, each pair of them tried; None where no three agree."""
    best: tuple[SeenTag, ...] = ()
    for pair in combinations(tags, 2):
        placed = place(lens, frame, pair)
        for _ in range(3):
            if placed is None:
                break
            view = placed.view
            near = tuple(each for each in tags if off(view, each, frame) < 1.5 * TOLERANCE)
            if len(near) < 3 or near == placed.tags:
                break
            placed = place(lens, frame, near)
        if placed is not None and len(placed.tags) > len(best):
            best = placed.tags
    return place(lens, frame, best) if len(best) >= 3 else None


def _starts(lens: Lens, points: Array, pixels: Array) -> list[View]:
    """Both places from which a plane may look like that, roughly."""
    cv2 = opencv()
    middle = points.mean(axis=0)
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        np.ascontiguousarray(points - middle), lens.rays(pixels), np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
    )
    views = []
    for turn, shift in zip(turns, shifts, strict=True):
        rotation = cv2.Rodrigues(turn)[0]
        translation = np.ravel(shift) - rotation @ middle
        if np.isfinite(rotation).all() and (points @ rotation[2] + translation[2] > 0.0).all():
            views.append(View(lens, rotation, translation))
    return views


def refined(view: View, points: Array, pixels: Array, sigma: Array) -> tuple[View, Array, float]:
    """The view with the least squares of what is left over, its covariance, and those squares; Levenberg's method."""
    damping, cost = 1e-4, _cost(view, points, pixels, sigma)
    change = slopes(view, points) / sigma[:, None]
    for _ in range(MAX_STEPS):
        normal = change.T @ change
        left = ((pixels - view.pixels(points)).ravel() / sigma) @ change
        step = np.asarray(np.linalg.solve(normal + damping * np.diag(np.diag(normal)), left), dtype=float)
        tried = moved(view, step)
        lower = _cost(tried, points, pixels, sigma)
        if lower <= cost:
            view, cost, damping = tried, lower, damping * 0.1
            change = slopes(view, points) / sigma[:, None]
        else:
            damping *= 10.0
        if np.abs(step).max() < CONVERGED:
            break
    return view, np.asarray(np.linalg.inv(change.T @ change), dtype=float), cost


def _cost(view: View, points: Array, pixels: Array, sigma: Array) -> float:
    if (points @ view.rotation[2] + view.translation[2] <= 0.0).any():
        return np.inf
    return float(np.square((pixels - view.pixels(points)).ravel() / sigma).sum())


def slopes(view: View, points: Array) -> Array:
    """How pixels (2 n) change with a turn and a shift (6) of what the camera sees."""
    small = 1e-6
    return np.column_stack(
        [
            (moved(view, step).pixels(points) - moved(view, -step).pixels(points)).ravel() / (2.0 * small)
            for step in small * np.eye(6)
        ]
    )


def moved(view: View, step: Array) -> View:
    """A view with what it sees turned by `step[:3]` [rad] about the camera's axes, and shifted by `step[3:]` [m]."""
    angle = float(np.linalg.norm(step[:3]))
    if angle > 0.0:
        x, y, z = step[:3] / angle
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    else:
        turn = np.eye(3)
    return View(view.lens, turn @ view.rotation, view.translation + step[3:])
