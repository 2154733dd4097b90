"""A tag in a picture to a few hundredths of a pixel: its known pattern, blurred and lit, laid onto what is seen of it.

OpenCV finds the corners of a tag to a pixel or some, by its outline alone, and a blur moves outlines. Here all edges of
the pattern count, and how blurred they are is found along with where they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from curveline.cameras.edge_width import TEN_TO_NINETY
from curveline.cameras.opencv import opencv
from curveline.cameras.view import Array, Grey, Lens

Pixels = npt.NDArray[np.float32]

MODULES = 8
"""Squares along a side of a tag of the family 36h11: six of its pattern and the black border on both sides."""
FINE = 16
"""Pixels of the template across a square of the pattern."""
PAD = 3
"""White squares around the template."""
MARGIN = 0.7
"""Squares beyond the tag that are looked at: one is white around a printed tag."""
MOST_SAMPLES = 5000
LEAST_SAMPLES = 100
"""Pixels of a tag that are looked at."""
COARSE = 0.35
"""Squares by which picture and template are blurred at first, so that a guess that is off finds its way."""
MAX_STEPS = 15
NEAR = 2e-4
"""Squares that the last step moves."""
LEAST_SHARE = 0.6
"""Of what varies in the picture of a tag, that its pattern must explain."""
LEAST_CONTRAST = 12.0
"""[grey levels] between black and white."""
OUTLIER = 4.0
"""Typical deviations from the pattern beyond which a pixel shows something else."""


@dataclass(frozen=True)
class TagCorners:
    """Where a tag is in a picture."""

    corners: Array  # (4, 2) [px] upper left, upper right, lower right, lower left, of the tag as it is numbered
    width: float  # [px] of an edge, from a tenth of its contrast to nine tenths
    noise: float  # [px] standard error of a corner


@dataclass(frozen=True)
class _Patch:
    """The pixels around a tag: where they look, scaled to about one, and what they see."""

    at: Array  # (n, 2)
    levels: Array  # (n,)


def corners_on(grey: Grey, number: int, rough: Array, lens: Lens) -> TagCorners | None:
    """The corners of the tag of a `number` that is near `rough (4, 2)` corners [px]; None where its pattern is not."""
    sides = np.hypot(*(rough - np.roll(rough, 1, axis=0)).T)
    module = float(sides.mean()) / MODULES
    if module < 1.5:
        return None
    middle = lens.rays(rough).mean(axis=0)
    size = 0.5 * float(sides.mean()) / lens.focal[0]
    square = MODULES * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    homography = _through((lens.rays(rough) - middle) / size, square)
    blur = COARSE
    for extra in (COARSE, 0.0):
        fitted = _fitted(_patch(grey, lens, (homography, middle, size), extra * module), number, homography, blur)
        if fitted is None:
            return None
        homography, blur, noise = fitted
        blur = max(0.05, float(np.sqrt(max(0.0, blur**2 - extra**2))))
    back = np.column_stack([square, np.ones(4)]) @ np.linalg.inv(homography).T
    corners = lens.pixels(back[:, :2] / back[:, 2:] * size + middle)
    if not np.isfinite(corners).all() or np.abs(corners - rough).max() > 2.0 * module + 2.0:
        return None
    return TagCorners(corners, TEN_TO_NINETY * blur * module, noise * module)


def _through(points: Array, onto: Array) -> Array:
    """The homography (3, 3) that takes four points onto four others."""
    found = opencv().getPerspectiveTransform(points.astype(np.float32), onto.astype(np.float32))
    return np.asarray(found, dtype=float) / float(found[2, 2])


def _patch(grey: Grey, lens: Lens, frame: tuple[Array, Array, float], blur: float) -> _Patch:
    """The pixels within a tag's white margin, those of a picture that is blurred by so many of them."""
    homography, middle, size = frame
    edge = np.array([-MARGIN, MODULES + MARGIN])
    outline = np.array([[x, y, 1.0] for x in edge for y in edge]) @ np.linalg.inv(homography).T
    box = lens.pixels(outline[:, :2] / outline[:, 2:] * size + middle)
    low = np.clip(np.floor(box.min(axis=0)) - 1.0, 0.0, np.subtract(lens.size, 1)).astype(int)
    high = np.clip(np.ceil(box.max(axis=0)) + 2.0, 1.0, lens.size).astype(int)
    part = np.asarray(grey[low[1] : high[1], low[0] : high[0]], dtype=np.float32)
    if blur > 0.3 and part.size:
        part = opencv().GaussianBlur(part, (0, 0), blur)
    stride = max(1, int(np.sqrt(part.size / MOST_SAMPLES)))
    x, y = np.meshgrid(np.arange(low[0], high[0], stride), np.arange(low[1], high[1], stride))
    at = (lens.rays(np.column_stack([x.ravel(), y.ravel()]).astype(float)) - middle) / size
    levels = part[::stride, ::stride].astype(float).ravel()
    place = _placed(homography, at)
    inside = (place > -MARGIN).all(axis=1) & (place < MODULES + MARGIN).all(axis=1)
    return _Patch(at[inside], levels[inside])


def _placed(homography: Array, at: Array) -> Array:
    found = np.column_stack([at, np.ones(len(at))]) @ homography.T
    place: Array = found[:, :2] / found[:, 2:]
    return place


@lru_cache(maxsize=64)
def _pattern(number: int) -> Pixels:
    """The tag, white 1 and black 0, on white."""
    aruco = opencv().aruco
    dictionary = aruco.getPredefinedDictionary(aruco.DICT_APRILTAG_36h11)
    cells = np.asarray(aruco.generateImageMarker(dictionary, number, MODULES)) > 0
    return np.pad(np.kron(cells, np.ones((FINE, FINE))), PAD * FINE, constant_values=1.0).astype(np.float32)


def _fitted(patch: _Patch, number: int, homography: Array, blur: float) -> tuple[Array, float, float] | None:
    """The homography and the blur [squares] that fit best, and the standard error of a corner [squares]."""
    if len(patch.levels) < LEAST_SAMPLES:
        return None
    for count in range(MAX_STEPS):
        found = _step(patch, number, homography, blur)
        place = _placed(homography, patch.at)
        homography = homography + np.append(found.step[:8], 0.0).reshape(3, 3)
        blur = float(np.clip(blur + np.clip(found.step[8], -0.1, 0.1), 0.03, 1.5))
        if not np.isfinite(homography).all():
            return None
        if count > 1 and np.abs(_placed(homography, patch.at) - place).max() < NEAR:
            break
    if found.explained < LEAST_SHARE or found.contrast < LEAST_CONTRAST:
        return None
    return homography, blur, _corner_noise(homography, found.covariance)


@dataclass(frozen=True)
class _Step:
    """A step of Gauss and Newton towards the best fit, and how good it is before that."""

    step: Array  # (9,) of the homography and the blur
    covariance: Array  # (8, 8) of the homography
    explained: float  # part of what varies
    contrast: float  # [grey levels]


def _step(patch: _Patch, number: int, homography: Array, blur: float) -> _Step:
    """One step; how a tag is lit, two planes of grey levels, is found along with it."""
    plane = np.column_stack([np.ones(len(patch.at)), patch.at])
    moving = plane[:, [1, 2, 0]]
    place = _placed(homography, patch.at)
    pattern, slope_x, slope_y, of_blur = _seen(number, place, blur)
    light = np.column_stack([plane, plane * pattern[:, None]])
    known = np.linalg.solve(light.T @ light + 1e-6 * np.eye(6), light.T @ patch.levels)
    contrast, left = plane @ known[3:], patch.levels - light @ known
    # What hides a part of the tag, or shines on it, is none of its pattern.
    weights = (np.abs(left) < OUTLIER * (1.4826 * np.median(np.abs(left)) + 0.5)).astype(float)
    down = moving @ homography[2]
    across, along = ((contrast * slope / down)[:, None] * moving for slope in (slope_x, slope_y))
    falling = -(across * place[:, :1] + along * place[:, 1:])[:, :2]
    slopes = np.column_stack([across, along, falling, contrast * of_blur, light]) * weights[:, None]
    size = np.sqrt(np.square(slopes).sum(axis=0)) + 1e-12
    inverse = np.linalg.inv((slopes / size).T @ (slopes / size) + 1e-6 * np.eye(len(size))) / np.outer(size, size)
    squares = float(np.square(left * weights).sum())
    spread = float(np.square((patch.levels - patch.levels.mean()) * weights).sum())
    variance = squares / max(1.0, float(weights.sum()) - len(size))
    step = inverse @ (slopes.T @ (left * weights))
    return _Step(step[:9], variance * inverse[:8, :8], 1.0 - squares / max(spread, 1e-9), float(np.median(contrast)))


def _corner_noise(homography: Array, covariance: Array) -> float:
    """Standard error of a corner [squares], along x or y, from that of the homography."""
    inverse = np.linalg.inv(homography)
    total = 0.0
    for corner in MODULES * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]):
        at = inverse @ np.append(corner, 1.0)
        x, y = at[:2] / at[2]
        down = float(homography[2] @ [x, y, 1.0])
        moving = np.array([x, y, 1.0]) / down
        zero = np.zeros(3)
        slopes = np.array(
            [
                [*moving, *zero, *(-corner[0] * moving[:2])],
                [*zero, *moving, *(-corner[1] * moving[:2])],
            ]
        )
        total += float(np.trace(slopes @ covariance @ slopes.T))
    return float(np.sqrt(total / 8.0))


def _seen(number: int, place: Array, blur: float) -> tuple[Array, Array, Array, Array]:
    """The blurred pattern at places (n, 2) [squares], and how it changes along x, along y and with the blur."""
    cv2 = opencv()
    more = 1.04 * blur
    near, far = (cv2.GaussianBlur(_pattern(number), (0, 0), max(0.3, FINE * each)) for each in (blur, more))
    at = (place + PAD) * FINE - 0.5
    limit = near.shape[0] - 2.001
    x, y = np.clip(at[:, 0], 1.0, limit), np.clip(at[:, 1], 1.0, limit)
    left, top = x.astype(int), y.astype(int)
    right, low = x - left, y - top

    def sampled(picture: Pixels) -> Array:
        upper = picture[top, left] * (1.0 - right) + picture[top, left + 1] * right
        lower = picture[top + 1, left] * (1.0 - right) + picture[top + 1, left + 1] * right
        return np.asarray(upper * (1.0 - low) + lower * low, dtype=float)

    pattern = sampled(near)
    slopes = [sampled(cv2.Sobel(near, cv2.CV_32F, *way, ksize=3)) * FINE / 8.0 for way in ((1, 0), (0, 1))]
    return pattern, slopes[0], slopes[1], (sampled(far) - pattern) / (more - blur)
