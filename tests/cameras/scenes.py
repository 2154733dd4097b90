"""Pictures of flat things, as a camera with a known lens takes them: what tests hold the results against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from curveline.cameras.boards import camera_board
from curveline.cameras.tag_fit import corners_of
from curveline.cameras.view import Frame, Lens, Tag, View
from curveline.shapes.files import read_display
from curveline.units import to_mm

FINE = 0.25e-3
"""[m] of a pixel of what is photographed."""
GREY_WALL = 150


def lens(width: int = 1920, height: int = 1440, **others: Any) -> Lens:
    """A lens of an ordinary phone."""
    focal = 0.78 * width
    given = {"distortion": (0.09, -0.16, 0.0008, -0.0005, 0.05), **others}
    return Lens((width, height), (focal, focal * 1.001), (0.503 * width, 0.496 * height), **given)


def view(a_lens: Lens, eye: tuple[float, float, float], at: tuple[float, float], roll: float = 0.0) -> View:
    """A camera at `eye` [m] that looks at a point of the display, turned by `roll` [rad] about what it looks along."""
    ahead = np.array([*at, 0.0]) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    down = np.cross(ahead, right)
    turned = np.array([np.cos(roll) * right + np.sin(roll) * down, -np.sin(roll) * right + np.cos(roll) * down, ahead])
    return View(a_lens, turned, -turned @ eye)


def frame(size: float = 0.07, depth: float = -0.012, span: float = 0.5) -> Frame:
    """Six tags around a display with one segment."""
    places = [(-0.14, 0.30), (0.25, 0.36), (0.64, 0.30), (-0.14, -0.30), (0.25, -0.36), (0.64, -0.30)]
    return Frame(tuple(Tag(n, (x * span / 0.5, y), 0.0) for n, (x, y) in enumerate(places)), size, depth)


@dataclass(frozen=True)
class Flat:
    """Something flat in a plane z = `depth` that faces the viewer: grey levels of `FINE` pixels from its upper left."""

    levels: np.ndarray
    corner: tuple[float, float]  # [m] x and y of the middle of its first pixel
    depth: float


def tag_picture(number: int, size: float, margin: float = 0.15) -> np.ndarray:
    """A tag as it is printed, with a white margin that is so much of it."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    pixels = round(size / FINE)
    edge = round(margin * pixels)
    picture = np.full((pixels + 2 * edge,) * 2, 235, np.uint8)
    tag = cv2.resize(
        cv2.aruco.generateImageMarker(dictionary, number, 8), (pixels, pixels), interpolation=cv2.INTER_NEAREST
    )
    picture[edge : edge + pixels, edge : edge + pixels] = np.where(tag > 0, 235, 25)
    return picture


def wall(a_frame: Frame, moved: dict[int, tuple[float, float, float]] | None = None) -> Flat:
    """The frame of a display with its tags; `moved` ones are off by so much in x and y [m], and turned [rad]."""
    corners = np.concatenate([corners_of(tag, a_frame)[:, :2] for tag in a_frame.tags])
    low, high = corners.min(axis=0) - 0.1, corners.max(axis=0) + 0.1
    columns, rows = np.ceil((high - low) / FINE).astype(int) + 1
    levels = np.full((rows, columns), GREY_WALL, np.uint8)
    for tag in a_frame.tags:
        dx, dy, turn = (moved or {}).get(tag.number, (0.0, 0.0, 0.0))
        put(
            levels,
            tag_picture(tag.number, a_frame.size),
            ((tag.centre[0] + dx - low[0]) / FINE, (high[1] - tag.centre[1] - dy) / FINE),
            tag.turn + turn,
        )
    return Flat(levels, (low[0], high[1]), a_frame.depth)


def put(onto: np.ndarray, picture: np.ndarray, middle: tuple[float, float], turn: float) -> None:
    """Glue a picture onto another, its middle at a pixel, turned counter-clockwise [rad]."""
    rows, columns = picture.shape
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, s, 0.0], [-s, c, 0.0]])
    matrix[:, 2] = np.array(middle) - matrix[:, :2] @ [(columns - 1) / 2.0, (rows - 1) / 2.0]
    x, y = round(middle[0]), round(middle[1])
    half = int(0.75 * max(rows, columns))
    box = slice(max(0, y - half), y + half), slice(max(0, x - half), x + half)
    matrix[:, 2] -= [box[1].start, box[0].start]
    part = onto[box]
    size = part.shape[::-1]
    turned = cv2.warpAffine(picture, matrix, size, flags=cv2.INTER_LINEAR, borderValue=0)
    mask = cv2.warpAffine(np.ones_like(picture), matrix, size, flags=cv2.INTER_NEAREST, borderValue=0)
    part[mask > 0] = turned[mask > 0]


def photographed(flat: Flat, a_view: View, *, blur: float = 0.8, noise: float = 2.0, seed: int = 0) -> np.ndarray:
    """What a camera takes of something flat before a wall: blurred by so many pixels, noise in grey levels."""
    columns, rows = a_view.lens.size
    grid_x, grid_y = np.arange(-16.0, columns + 16.0, 16.0), np.arange(-16.0, rows + 16.0, 16.0)
    pixels = np.stack(np.meshgrid(grid_x, grid_y), axis=-1)
    places = a_view.in_plane(pixels.reshape(-1, 2), flat.depth).reshape(pixels.shape)
    texture_x = (places[..., 0] - flat.corner[0]) / FINE
    texture_y = (flat.corner[1] - places[..., 1]) / FINE
    fine_x, fine_y = (np.arange(2 * size) / 2.0 - 0.25 for size in (columns, rows))
    maps = [np.float32(_hats(fine_y, grid_y) @ coarse @ _hats(fine_x, grid_x).T) for coarse in (texture_x, texture_y)]
    # Pixels of the texture are about as large as these, or smaller: blur it a little against moire.
    soft = cv2.GaussianBlur(flat.levels, (0, 0), 0.6)
    fine = cv2.remap(soft, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=GREY_WALL)
    picture = cv2.resize(fine.astype(np.float32), (columns, rows), interpolation=cv2.INTER_AREA)
    if blur > 0.0:
        picture = cv2.GaussianBlur(picture, (0, 0), blur)
    picture += np.random.default_rng(seed).normal(0.0, noise, picture.shape)
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)


def _hats(at: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Weights (n, m) of linear interpolation between equally spaced nodes."""
    step = nodes[1] - nodes[0]
    return np.maximum(0.0, 1.0 - np.abs(at[:, None] - nodes[None, :]) / step)


def chessboard(square: float = 0.03) -> Flat:
    """The board for the lens as it is printed, with the upper left corner of its page at x = 0 and y = 0."""
    page = camera_board(read_display("single")).pages[0]
    fine = to_mm(FINE) * 0.025 / square
    levels = np.full((round(page.height / fine), round(page.width / fine)), 235, np.uint8)
    for ink in page.inks:
        for x, y, width, height in ink.boxes:
            rows, columns = (slice(round(a / fine), round((a + b) / fine)) for a, b in ((y, height), (x, width)))
            levels[rows, columns] = 25 + 210 * ink.grey
    return Flat(levels, (0.5 * FINE, -0.5 * FINE), 0.0)


def board_views(a_lens: Lens, count: int, seed: int = 0) -> list[View]:
    """Where somebody holds a camera before the board: tilted all ways, the board in all parts of the picture."""
    rng = np.random.default_rng(seed)
    views = []
    for index in range(count):
        round_ = 2.0 * np.pi * index / count + rng.uniform(-0.3, 0.3)
        tilt = rng.uniform(0.25, 0.6)
        distance = rng.uniform(0.36, 0.5)
        middle = np.array([0.126, -0.16])
        eye = (
            middle[0] + distance * np.sin(tilt) * np.cos(round_),
            middle[1] + distance * np.sin(tilt) * np.sin(round_),
            distance * np.cos(tilt),
        )
        look = middle + 0.14 * np.array([np.cos(1.7 * round_), np.sin(1.7 * round_)])
        views.append(view(a_lens, eye, (look[0], look[1]), rng.uniform(-0.3, 0.3) + np.pi / 2.0 * (index % 4)))
    return views
