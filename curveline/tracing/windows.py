"""How far beside a line the rod is, to a part of a pixel: by windows of a few teeth, against its section as it is seen.

What a window shows across the line is taken as a sum: what is behind to the left and to the right, the rod's face and
its skins, each with a grey level of its own, and a slope of what is behind; blurred. Where it fits best the rod is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.cameras.view import SeenRod, View
from curveline.tracing.lines import SeenLine, strip_of
from curveline.tracing.sections import coverage, front, has_teeth, parallax, silhouette
from curveline.units import mm

Array = npt.NDArray[np.float64]

TEETH, SAMPLES = 3, 8
"""Teeth in a window, and samples along each."""
PLAIN = mm(9.0)
"""Length of a window of a rod without teeth."""
ROW = mm(0.2)
FINE = mm(0.1)
"""Steps across the line: of what is measured, and of what a section is counted by."""
BESIDE = mm(4.0)
"""How much of what is beside the rod is looked at."""
SKIN = 0.83
SKIN_SPREAD = 0.08
TOLD = mm(0.7)
"""How bright a skin is, of what the face is, and how sure that is; below which blur a skin is told from the face."""
LEAST_LEVEL = 15.0
"""Grey levels of a black rod, of which its skins may differ by a part."""
USUAL_NOISE = 4.0
"""Grey levels, against which those are weighed."""
SLOPE = 0.06
"""How uneven what is behind usually is within `BESIDE`, as a part of its level."""
PARTS = 5
JUMP, JUMPED = 1.0, mm(2.0)
"""What it costs if the rod is seen somewhere else in the next window, and how far that is."""
EVEN = 0.35
"""Of the contrast on one side of a bar, what it has on the other at least."""
SHIFTED = mm(0.15)
"""By how much a rod is seen shifted whose sides have as different levels as its face has."""
STRANGE = 0.6
STRANGER, LEAST_STRANGE = 0.15, 3.0
"""What it costs if a face has another grey level than usual, by such a part of how it differs from what is beside it,
or by so many levels."""
USUAL_ROUNDS = 8
NEAR = mm(0.8)
"""How far from the likeliest way the rod is sought to a part of a pixel."""


class Windows(NamedTuple):
    """What windows along a line say, each (n,)."""

    places: Array  # [m] arc length of their middles
    off: Array  # [m] how far the rod lies to the left of the line
    sigma: Array  # [m] of that
    likeness: Array  # part of what is to be seen across the line that the rod explains, beyond an edge
    step: Array  # grey levels of the face over what is beside it
    face: Array  # grey level of the face
    alike: Array  # [m] error that all windows may share, since it is not known how bright skins are


@dataclass(frozen=True, eq=False)
class Sight:
    """A picture that is measured in."""

    grey: npt.NDArray[np.uint8]  # (height, width)
    view: View
    seen: SeenRod
    blur: float = 0.0  # [m] in the rod's plane, standard deviation; 0 if it is not known

    @property
    def pixel(self) -> float:
        """Size of a pixel in the middle of the rod's plane [m]."""
        lens = self.view.lens
        return float(self.view.eye[2] / np.mean(lens.focal))


def window_places(seen: SeenRod, low: float, high: float) -> Array:
    """Arc lengths (n, k) [m] of the samples of every window between two."""
    length = TEETH * seen.pitch if has_teeth(seen) else PLAIN
    samples = TEETH * SAMPLES
    count = int((high - low) / length)
    begin = 0.5 * (low + high - count * length)
    return begin + (np.arange(count * samples).reshape(count, samples) + 0.5) * length / samples


def measured(sight: Sight, line: SeenLine, places: Array, reach: float) -> Windows:
    """What windows with samples at `places (n, k)` say where the rod is, if that is within `reach` [m] of the line."""
    middles = line.at(places.mean(axis=1))
    bar = silhouette(sight.seen, sight.view, middles)
    low, high = float(bar.low.min()) - BESIDE, float(bar.high.max()) + BESIDE
    rows = np.arange(np.floor((low - reach) / ROW), np.ceil((high + reach) / ROW) + 1) * ROW
    strip = strip_of(sight.grey, sight.view, line.at(places.ravel()), rows, front(sight.seen))
    profiles = strip.reshape(len(rows), *places.shape).mean(axis=2).T.astype(float)
    count = int(np.ceil((high - low) / ROW)) + 1
    shifts = len(rows) - count + 1
    template = rows[:count] + reach
    parts = section_parts(sight, middles, template)
    within = (template >= bar.low[:, None] - BESIDE) & (template <= bar.high[:, None] + BESIDE)
    known = np.isfinite(profiles).all(axis=1)
    profiles = np.nan_to_num(profiles)
    level = float(np.median(profiles[known])) if known.any() else 0.0
    fits = _fits(profiles, parts, within, max(level, LEAST_LEVEL))
    offsets = (np.arange(shifts) * ROW + rows[0]) - template[0]
    best = _best(fits, offsets, middles.places, known, sight)
    skin, _ = parallax(sight.seen, sight.view, middles)
    blurred = sight.blur**2 / (sight.blur**2 + TOLD**2)
    shared = 0.5 * np.abs(skin) * SKIN_SPREAD * best.face / np.maximum(np.abs(best.step), 1.0) * blurred
    return best._replace(alike=shared)


def section_parts(sight: Sight, middles: SeenLine, across: Array) -> Array:
    """How much is seen of left, right, face, skins (n, m, PARTS) `across (m,)` windows, with the rod on the line."""
    fine = np.arange(across[0] - mm(2.0), across[-1] + mm(2.0) + FINE, FINE)
    face, body = coverage(sight.seen, sight.view, middles, fine)
    left = (1.0 - body) * (fine > 0.0)
    right = (1.0 - body) * (fine <= 0.0)
    slope = (1.0 - body) * fine / BESIDE
    apart = np.stack([left, right, face, np.maximum(body - face, 0.0), slope], axis=2)
    kernel = np.exp(-0.5 * ((across[:, None] - fine[None, :]) / max(sight.blur, FINE)) ** 2)
    kernel /= kernel.sum(axis=1, keepdims=True)
    parts: Array = np.einsum("mf,nfp->nmp", kernel, apart)
    return parts


class _Fits(NamedTuple):
    """By window and shift: sums of squares that are left, (n, j); by window: those without a rod (n,), rows (n,)."""

    left: Array
    flat: Array
    rows: Array
    levels: Array  # (n, j, PARTS) grey levels


def _fits(profiles: Array, parts: Array, within: npt.NDArray[np.bool_], level: float) -> _Fits:
    """How well the parts explain every window at every shift."""
    count = within.shape[1]
    data = np.lib.stride_tricks.sliding_window_view(profiles, count, axis=1)
    weighted = parts * within[:, :, None]
    tie = np.array([0.0, 0.0, -SKIN, 1.0, 0.0]) * USUAL_NOISE / (SKIN_SPREAD * level)
    even = np.diag([0.0, 0.0, 0.0, 0.0, (USUAL_NOISE / (SLOPE * level)) ** 2])
    matrix = np.einsum("nmp,nmq->npq", weighted, weighted) + np.outer(tie, tie) + even + 1e-3 * np.eye(PARTS)
    found = np.einsum("njm,nmp->njp", data, weighted)
    levels = np.einsum("npq,njq->njp", np.linalg.inv(matrix), found)
    squares = np.einsum("njm,nm->nj", data**2, within.astype(float))
    left = np.maximum(squares - np.sum(levels * found, axis=2), 1e-9)
    rows = within.sum(axis=1).astype(float)
    return _Fits(left, _edge_alone(data, within), rows, levels)


def _edge_alone(data: Array, within: npt.NDArray[np.bool_]) -> Array:
    """Sums of squares (n, j) that an edge, light on one side and dark on the other, leaves of every window."""
    weights = within.astype(float)
    ramp = np.sign(np.arange(within.shape[1]) - 0.5 * (within.shape[1] - 1)) * weights
    parts = np.stack([weights, ramp], axis=2)
    matrix = np.einsum("nmp,nmq->npq", parts, parts) + 1e-6 * np.eye(2)
    found = np.einsum("njm,nmp->njp", data, parts)
    levels = np.einsum("npq,njq->njp", np.linalg.inv(matrix), found)
    left: Array = np.maximum(np.einsum("njm,nm->nj", data**2, weights) - np.sum(levels * found, axis=2), 1e-9)
    return left


def _best(fits: _Fits, offsets: Array, places: Array, known: npt.NDArray[np.bool_], sight: Sight) -> Windows:
    """Where every window fits best, between the shifts that were tried."""
    each = np.arange(len(places))
    gain = (1.0 - fits.left / fits.flat) * _barlike(fits.levels)
    way = likeliest(gain)
    tone = _usual(places, fits.levels[each, way, 2], gain[each, way])
    contrast = float(np.median(np.abs(_steps(fits.levels)[each, way])))
    scatter = 1.48 * float(np.median(np.abs(fits.levels[each, way, 2] - tone)))
    allowed = max(STRANGER * contrast, 3.0 * scatter, LEAST_STRANGE)
    gain -= STRANGE * np.minimum(np.abs(fits.levels[:, :, 2] - tone[:, None]) / allowed, 1.0)
    inner = _nearby(fits.left, likeliest(gain))
    before, here, after = (fits.left[each, inner + k] for k in (-1, 0, 1))
    bend = np.maximum(before - 2.0 * here + after, 1e-9)
    part = np.clip(0.5 * (before - after) / bend, -1.0, 1.0)
    at_end = (inner == 1) | (inner == len(offsets) - 2) | ~known
    # Rows are finer than pixels, so that what they show is not independent.
    alike = max(sight.pixel / ROW, 1.0)
    variance = here / np.maximum(fits.rows - PARTS - 1, 1.0) * alike * 2.0 / bend * ROW**2
    step, face = _steps(fits.levels)[each, inner], fits.levels[each, inner, 2]
    # What is behind may have an edge along the rod, which is then seen shifted.
    uneven = (fits.levels[each, inner, 0] - fits.levels[each, inner, 1]) / np.maximum(np.abs(step), 1.0)
    sigma = np.hypot(np.sqrt(variance), SHIFTED * np.minimum(np.abs(uneven), 2.0))
    likeness = np.where(at_end, 0.0, np.maximum(gain[each, inner], 0.0))
    return Windows(places, offsets[inner] + part * ROW, sigma, likeness, step, face, np.zeros(len(places)))


def _steps(levels: Array) -> Array:
    """Grey levels of the face over what is beside it."""
    steps: Array = levels[..., 2] - 0.5 * (levels[..., 0] + levels[..., 1])
    return steps


def _barlike(levels: Array) -> Array:
    """1 where a face is as much lighter, or darker, than both sides; 0 where it is between them, or like one."""
    sides = (levels[..., 2:3] - levels[..., :2]) * np.sign(_steps(levels))[..., None]
    alike: Array = np.clip(sides.min(axis=-1) / np.maximum(sides.max(axis=-1), 1e-6) / EVEN, 0.0, 1.0)
    return alike


def _usual(places: Array, faces: Array, weights: Array) -> Array:
    """The grey level (n,) of the rod's face, as most windows have it, more or less from one end to the other."""
    middle = (places - places.mean()) / max(float(np.ptp(places)), 1e-6)
    table = np.column_stack([np.ones(len(places)), middle])
    level = np.array([float(np.median(faces)), 0.0])
    for _ in range(USUAL_ROUNDS):
        off = faces - table @ level
        spread = max(1.48 * float(np.median(np.abs(off))), 1.0)
        weight = np.maximum(weights, 0.01) / (1.0 + (off / spread) ** 2)
        matrix = (table * weight[:, None]).T @ table + np.diag([0.0, 0.05 * len(places)])
        level = np.linalg.solve(matrix, table.T @ (weight * faces))
    usual: Array = table @ level
    return usual


def likeliest(gain: Array) -> npt.NDArray[np.int64]:
    """Which shift (n,) of every window the likeliest way through all of them goes by, from `gain (n, j)`."""
    count, shifts = gain.shape
    rise = np.abs(np.arange(shifts)[:, None] - np.arange(shifts)[None, :]) * ROW
    cost = JUMP * np.minimum(rise / JUMPED, 1.0)
    score, comes = gain[0].copy(), np.zeros((count, shifts), dtype=np.int64)
    for window in range(1, count):
        onward = score[None, :] - cost
        comes[window] = np.argmax(onward, axis=1)
        score = np.take_along_axis(onward, comes[window][:, None], 1)[:, 0] + gain[window]
    way = np.empty(count, dtype=np.int64)
    place = int(np.argmax(score))
    for window in range(count - 1, -1, -1):
        way[window] = place
        place = int(comes[window, place])
    return way


def _nearby(left: Array, way: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """The shift (n,) near a way that leaves the least."""
    far = np.abs(np.arange(left.shape[1])[None, :] - way[:, None]) * ROW > NEAR
    best = np.argmin(np.where(far, np.inf, left), axis=1)
    inner: npt.NDArray[np.int64] = np.clip(best, 1, left.shape[1] - 2)
    return inner
