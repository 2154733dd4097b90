"""AprilTags of the family 36h11 in a picture."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from curveline.cameras.opencv import opencv
from curveline.cameras.tag_edges import Grey
from curveline.cameras.view import Array

WIDE = 1600
"""[px] of the longer side at which a picture is looked at first: large tags are found there in a tenth of the time."""
ENOUGH = 4
"""Tags after which nothing is tried any more that takes long."""


def detect_tags(grey: Grey, wanted: Collection[int]) -> dict[int, list[Array]]:
    """Rough corners (4, 2) [px] of the tags in a picture by number, each as often as it is seen apart.

    The picture is looked at in several sizes until all that are `wanted` are found, and where these are few, also with
    its contrasts evened out and enlarged.
    """
    found: dict[int, list[Array]] = {}
    for picture, scale, is_last_resort in _versions(grey):
        seen = set(wanted) & found.keys()
        if len(seen) == len(set(wanted)) or (is_last_resort and len(seen) >= ENOUGH):
            break
        for number, corners in _detect(picture):
            _keep(found.setdefault(number, []), (corners + 0.5) / scale - 0.5)
    return found


def _versions(grey: Grey) -> Iterator[tuple[Grey, float, bool]]:
    """The picture in several ways, the scale of each, and whether it takes long."""
    cv2 = opencv()
    longer = max(grey.shape)
    first = min(1.0, WIDE / longer)
    small = _scaled(grey, first)
    yield small, first, False
    if first < 1.0:
        yield grey, 1.0, False
    yield cv2.createCLAHE(4.0, (8, 8)).apply(small), first, True
    yield _scaled(grey, first / 2.0), first / 2.0, True
    if longer <= WIDE:
        yield cv2.resize(grey, None, fx=2.0, fy=2.0, interpolation=cv2.INTER_CUBIC), 2.0, True
    else:
        yield cv2.createCLAHE(4.0, (16, 16)).apply(grey), 1.0, True


def _scaled(grey: Grey, scale: float) -> Any:
    cv2 = opencv()
    return grey if scale == 1.0 else cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)


def _detect(grey: Grey) -> Iterator[tuple[int, Array]]:
    aruco = opencv().aruco
    parameters = aruco.DetectorParameters()
    parameters.adaptiveThreshWinSizeMax = 43
    parameters.minMarkerPerimeterRate = 0.02
    detector = aruco.ArucoDetector(aruco.getPredefinedDictionary(aruco.DICT_APRILTAG_36h11), parameters)
    corners, numbers, _ = detector.detectMarkers(grey)
    if numbers is not None:
        for number, each in zip(np.ravel(numbers), corners, strict=True):
            yield int(number), np.asarray(each, dtype=float).reshape(4, 2)


def _keep(seen: list[Array], corners: Array) -> None:
    """Add a tag, unless it is there already: it is the same where the middle of the one lies within the other."""
    middle = corners.mean(axis=0)
    if all(np.hypot(*(each.mean(axis=0) - middle)) > 0.25 * np.hypot(*(each[2] - each[0])) for each in seen):
        seen.append(corners)
