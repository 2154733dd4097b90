"""OpenCV, where it is installed."""

from __future__ import annotations

from typing import Any

from curveline.errors import MissingExtra


def opencv() -> Any:
    """The module cv2; MissingExtra without it."""
    try:
        import cv2
    except ImportError:
        raise MissingExtra(
            "looking at photographs needs OpenCV, which is not installed", hint="pip install 'curveline[photo]'"
        ) from None
    return cv2
