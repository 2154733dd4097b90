"""AprilTags of the family 36h11 in a picture."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from curveline.cameras.opencv import opencv
from curveline.cameras.view import Array, Grey

WIDE = 1600
"""[px] of the longer side at which a picture is looked at first: large tags are found there in a tenth of the time."""
QUICK = {"adaptiveThreshWinSizeMax": 43, "minMarkerPerimeterRate": 0.02}
SLOW = dict(QUICK)
SHARPENED = {
    "adaptiveThreshWinSizeMin": 23,
    "adaptiveThreshWinSizeMax": 103,
    "adaptiveThreshWinSizeStep": 40,
    "minMarkerPerimeterRate": 0.02,
    "errorCorrectionRate": 1.0,
}
"""What OpenCV's detector is asked for: in a picture as it is, in one that takes long, in one that was blurred."""
LEAST_SLOPE = 8.0
"""Of an edge that is one, as Sobel's operator has it: 1 grey level a pixel."""
MOST_SMEAR = 0.0018
"""Of the longer side of a picture, as a standard deviation: with more, where nothing is found, blur is the reason."""
ENOUGH = 4
"""Tags after which nothing is tried any more that takes long."""


def detect_tags(grey: Grey, wanted: Collection[int]) -> dict[int, list[Array]]:
    """Rough corners (4, 2) [px] of the tags in a picture by number, each as often as it is seen apart.

    The picture is looked at in several sizes until all that are `wanted` are found, and where these are few, also with
    its contrasts evened out, enlarged and sharpened. What is read of such a picture may be no tag: its pattern tells.
    """
    found: dict[int, list[Array]] = {}
    for picture, scale, effort in _versions(grey):
        seen = set(wanted) & found.keys()
        if len(seen) == len(set(wanted)) or (effort is not QUICK and len(seen) >= ENOUGH):
            break
        for number, corners in _detect(picture, effort):
            _keep(found.setdefault(number, []), (corners + 0.5) / scale - 0.5)
    return found


def smear(grey: Grey) -> float:
    """By how much the sharpest edges of a picture are blurred, as a standard deviation and a part of its longer side.

    Edges lose the less of their slope to another blur the more blurred they are. It is 0 where there are none.
    """
    cv2 = opencv()
    small = _scaled(grey, min(1.0, WIDE / max(grey.shape))).astype(np.float32)
    slopes = []
    for blur in (1.5, 6.0):
        soft = cv2.GaussianBlur(small, (0, 0), blur)
        size = np.hypot(cv2.Sobel(soft, cv2.CV_32F, 1, 0), cv2.Sobel(soft, cv2.CV_32F, 0, 1))
        slopes.append(float(np.percentile(size, 99.9)))
    if slopes[0] < LEAST_SLOPE:
        return 0.0
    square = (slopes[0] / max(slopes[1], 1e-6)) ** 2
    sigma = np.sqrt(max(0.0, 36.0 - 2.25 * square) / max(square - 1.0, 1e-3))
    return float(sigma / max(small.shape))


def _versions(grey: Grey) -> Iterator[tuple[Grey, float, dict[str, float]]]:
    """The picture in several ways, the scale of each, and how markers are looked for in it."""
    cv2 = opencv()
    longer = max(grey.shape)
    first = min(1.0, WIDE / longer)
    small = _scaled(grey, first)
    yield small, first, QUICK
    if first < 1.0:
        yield grey, 1.0, QUICK
    soft = cv2.GaussianBlur(small, (0, 0), 1.5)
    yield cv2.addWeighted(soft, 9.0, cv2.GaussianBlur(soft, (0, 0), 6.0), -8.0, 0.0), first, SHARPENED
    yield cv2.createCLAHE(4.0, (8, 8)).apply(small), first, SLOW
    yield _scaled(grey, first / 2.0), first / 2.0, SLOW
    if longer <= WIDE:
        yield cv2.resize(grey, None, fx=2.0, fy=2.0, interpolation=cv2.INTER_CUBIC), 2.0, SLOW
    else:
        yield cv2.createCLAHE(4.0, (16, 16)).apply(grey), 1.0, SLOW


def _scaled(grey: Grey, scale: float) -> Any:
    cv2 = opencv()
    return grey if scale == 1.0 else cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)


def _detect(grey: Grey, effort: dict[str, float]) -> Iterator[tuple[int, Array]]:
    aruco = opencv().aruco
    parameters = aruco.DetectorParameters()
    for name, value in effort.items():
        setattr(parameters, name, value)
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
