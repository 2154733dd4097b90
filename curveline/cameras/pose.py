"""From a picture of a display to where its camera stood, by the tags on its frame; or why that cannot be told.

Every corner of every tag counts, by least squares. A tag that was glued elsewhere than the camera file says is told by
the others, if there are enough.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from curveline.cameras.outcomes import TrialOutcome
from curveline.cameras.photographs import Photograph, lens_of
from curveline.cameras.pose_error import covariance_of, errors_at
from curveline.cameras.setup import CameraSetup
from curveline.cameras.tag_detection import MOST_SMEAR, detect_tags, smear
from curveline.cameras.tag_fit import TOLERANCE, Placed, SeenTag, consensus, corners_of, off, place
from curveline.cameras.tag_template import corners_on
from curveline.cameras.view import Array, Frame, Grey, Lens, View
from curveline.errors import InvalidInput
from curveline.phrases import counted
from curveline.units import mm, to_deg, to_mm

LEAST_TAGS = 2
ENOUGH_TO_TELL = 4
"""Tags with which the others say of one that it is off."""
MOST_BLUR = mm(7.5)
"""[m] on the display, from a tenth of an edge's contrast to nine tenths, beyond which a rod is not told any more."""


@dataclass(frozen=True)
class FoundView:
    """Where a camera stood when it took a picture."""

    view: View  # its place and its lens
    tags: tuple[SeenTag, ...]  # by which that was found
    left_out: tuple[SeenTag, ...]  # which are not where the camera file has them
    covariance: Array  # (6, 6) of a turn [rad] and a shift [m] of what the camera sees
    error: float  # [m] standard error of a position in the rod's plane, along x or y, over the field of the tags
    blur: float  # [m] on the display, from a tenth of the contrast of a tag's edge to nine tenths
    notes: tuple[str, ...] = ()  # what is odd, in sentences

    def errors_at(self, points: Array) -> Array:
        """Standard errors (n,) [m], along x or y, of positions `points (n, 2)` [m] in the rod's plane."""
        return errors_at(self.view, self.covariance, points)


@dataclass(frozen=True)
class ViewFailure:
    """Why a picture does not tell where its camera stood."""

    outcome: TrialOutcome  # why, in a word
    reason: str  # why, in a sentence


def view_of(photograph: Photograph, setup: CameraSetup) -> FoundView | ViewFailure:
    """Where the camera of `setup` stood that took a photograph; the view's lens is turned as the photograph is.

    InvalidInput for a photograph that another lens took, as of `lens_of`; MissingExtra without OpenCV.
    """
    return find_view(photograph.grey, lens_of(photograph, setup.lens), setup.frame)


def find_view(grey: Grey, lens: Lens, frame: Frame) -> FoundView | ViewFailure:
    """Where the camera stood that took a picture, grey levels (rows, columns), with `lens` before the tags of `frame`.

    InvalidInput for a picture of another size than the lens was calibrated for; MissingExtra without OpenCV.
    """
    if grey.shape != lens.size[::-1]:
        message = f"the picture has {grey.shape[1]} x {grey.shape[0]} pixels, the lens {lens.size[0]} x {lens.size[1]}"
        raise InvalidInput(message, "calibrate the lens with pictures of this size")
    known = {tag.number: tag for tag in frame.tags}
    detected = detect_tags(grey, known)
    seen, notes = [], []
    for number in sorted(known.keys() & detected.keys()):
        if len(detected[number]) > 1:
            notes.append(f"tag {number} is seen {len(detected[number])} times, and not used")
            continue
        found = corners_on(grey, number, detected[number][0], lens)
        if found is not None:
            seen.append(SeenTag(known[number], found.corners, found.width, found.noise))
    if len(seen) < LEAST_TAGS and smear(grey) > MOST_SMEAR:
        reason = f"{counted(len(seen), 'tag')} of {len(frame.tags)} found, and no edge in the picture is sharp"
        return ViewFailure(TrialOutcome.BLURRED, reason)
    if len(seen) < LEAST_TAGS:
        return ViewFailure(TrialOutcome.NO_TAGS, _too_few(seen, detected, frame, notes))
    blur = float(np.median([_blur(each, frame) for each in seen]))
    if blur > MOST_BLUR:
        width = float(np.median([each.width for each in seen]))
        reason = f"the edges of the tags are {width:.1f} pixels wide, {to_mm(blur):.1f} mm on the display: "
        return ViewFailure(TrialOutcome.BLURRED, f"{reason}at most {to_mm(MOST_BLUR):g} mm can be used")
    placed = _agreeing(lens, frame, seen)
    if isinstance(placed, ViewFailure):
        return placed
    left_out = tuple(each for each in seen if each not in placed.tags)
    notes += [f"tag {each.tag.number} is left out, {_by_how_much(placed.view, each, frame)}" for each in left_out]
    covariance = covariance_of(placed, frame)
    error = float(np.sqrt(np.square(errors_at(placed.view, covariance, _field(frame))).mean()))
    return FoundView(placed.view, placed.tags, left_out, covariance, error, blur, tuple(notes))


def view_document(found: FoundView | ViewFailure, frame: Frame) -> dict[str, Any]:
    """All of it as JSON has it; lengths in mm."""
    if isinstance(found, ViewFailure):
        return {"outcome": found.outcome.value, "reason": found.reason}
    view = found.view
    return {
        "outcome": TrialOutcome.SEEN.value,
        "reason": "",
        "eye_mm": [to_mm(each) for each in view.eye],
        "off_square_deg": to_deg(slant(view)),
        "mm_per_px": to_mm(scale(view, frame)),
        "error_mm": to_mm(found.error),
        "blur_mm": to_mm(found.blur),
        "notes": list(found.notes),
        "tags": [
            {"number": each.tag.number, "used": each in found.tags, "off_mm": to_mm(off(view, each, frame))}
            for each in sorted((*found.tags, *found.left_out), key=lambda each: each.tag.number)
        ],
    }


def slant(view: View) -> float:
    """The angle [rad] between what the camera looks along and a line square to the display."""
    return math.acos(min(1.0, abs(float(view.rotation[2, 2]))))


def scale(view: View, frame: Frame) -> float:
    """The width of a pixel on the rod's plane [m], in the middle of the tags."""
    middle = _field(frame).mean(axis=0)
    pixel = view.pixels(np.array([[*middle, 0.0]]))
    beside = view.in_plane(np.concatenate([pixel, pixel + np.array([1.0, 0.0])]))
    return float(np.hypot(*(beside[1] - beside[0])))


def _agreeing(lens: Lens, frame: Frame, seen: Sequence[SeenTag]) -> Placed | ViewFailure:
    """The camera by all tags, or by all but one that is off; or which are."""
    whole = place(lens, frame, seen)
    if whole is not None and _worst(whole, frame) <= TOLERANCE:
        return whole
    if len(seen) >= ENOUGH_TO_TELL:
        fewer = [place(lens, frame, [other for other in seen if other is not each]) for each in seen]
        able = [each for each in fewer if each is not None]
        best = min(able, key=lambda each: _worst(each, frame), default=None)
        if best is not None and _worst(best, frame) <= TOLERANCE:
            return best
    numbers = ", ".join(str(each.tag.number) for each in seen)
    agreed = consensus(lens, frame, seen) if len(seen) >= ENOUGH_TO_TELL else None
    if agreed is None or len(agreed.tags) == len(seen):
        reason = f"tags {numbers} are not where the camera file has them, and too few agree to say which is off"
        return ViewFailure(TrialOutcome.TAGS_DISAGREE, reason)
    wrong = [each for each in seen if each not in agreed.tags]
    said = "; ".join(f"tag {each.tag.number} is {_by_how_much(agreed.view, each, frame)}" for each in wrong)
    rest = ", ".join(str(each.tag.number) for each in agreed.tags)
    return ViewFailure(TrialOutcome.TAGS_DISAGREE, f"by tags {rest}, which agree: {said}")


def _worst(placed: Placed, frame: Frame) -> float:
    return max(off(placed.view, each, frame) for each in placed.tags)


def _by_how_much(view: View, seen: SeenTag, frame: Frame) -> str:
    """How a tag is off, in words."""
    found = view.in_plane(seen.corners, frame.depth)
    middle = found.mean(axis=0)
    shift = to_mm(float(np.hypot(*(middle - seen.tag.centre))))
    where = f"its middle is at x = {to_mm(middle[0]):.1f}, y = {to_mm(middle[1]):.1f} mm"
    return f"off by {shift:.1f} mm: {where}" if shift >= 1.0 else f"turned or of another size: {where}"


def _blur(seen: SeenTag, frame: Frame) -> float:
    """The width of a tag's edges on the display [m]."""
    sides = np.hypot(*(seen.corners - np.roll(seen.corners, 1, axis=0)).T)
    return seen.width * frame.size / float(sides.mean())


def _field(frame: Frame) -> npt.NDArray[np.float64]:
    """Points (n, 2) [m] all over the field that the tags enclose."""
    corners = np.concatenate([corners_of(tag, frame)[:, :2] for tag in frame.tags])
    low, high = corners.min(axis=0), corners.max(axis=0)
    return np.stack(np.meshgrid(*np.linspace(low, high, 7).T), axis=-1).reshape(-1, 2)


def _too_few(seen: Sequence[SeenTag], detected: dict[int, list[Array]], frame: Frame, notes: Sequence[str]) -> str:
    """What was found in place of enough tags."""
    said = f"{counted(len(seen), 'tag')} of {len(frame.tags)} found, {LEAST_TAGS} are needed"
    others = sorted(detected.keys() - {tag.number for tag in frame.tags})
    if others:
        said += f"; the camera file does not have tags {', '.join(map(str, others[:8]))}, which are seen"
    return "; ".join([said, *notes])
