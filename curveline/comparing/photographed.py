"""Trials from photographs: where the camera stood, the rod traced, and a drawing of what was seen in each."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from curveline.cameras.setup import CameraSetup
from curveline.scene import Display, Scene
from curveline.system.files import AnyPath, write_file
from curveline.trial import Trial

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from curveline.cameras.photographs import Photograph

OVERLAY_SUFFIX = "-seen.jpg"
"""What the name of a drawing into a picture ends in."""


@dataclass(frozen=True)
class CameraUse:
    """How photographs were made, and a folder for drawings of what was seen in them, None for no drawings."""

    setup: CameraSetup  # what the camera file says
    overlays: Path | None = None  # folder of the drawings


def camera_use(camera: AnyPath, display: Display, overlays: AnyPath | None = None) -> CameraUse:
    """The camera file at a path, for photographs of a display; InvalidInput lists every problem of it."""
    from curveline.cameras.camera_file import read_camera

    return CameraUse(read_camera(camera, display), None if overlays is None else Path(overlays))


def trial_in(picture: AnyPath, scene: Scene, camera: CameraUse) -> Trial:
    """What a photograph shows of a display that was sent the shape of `scene`.

    Every reason for which it does not tell the rod is an outcome. InvalidInput for a file that is no picture, or of
    another lens than the camera file has.
    """
    from curveline.cameras.photographs import lens_of, read_photograph
    from curveline.cameras.pose import ViewFailure, find_view
    from curveline.tracing.overlay import overlay, plain_overlay
    from curveline.tracing.trace import trace

    photograph = read_photograph(picture)
    setup = replace(camera.setup, lens=lens_of(photograph, camera.setup.lens))
    found = find_view(photograph.grey, setup.lens, setup.frame)
    if isinstance(found, ViewFailure):
        _keep(photograph, plain_overlay(photograph.grey, f"{found.outcome}: {found.reason}"), camera)
        return Trial(photograph.source, found.outcome, found.reason)
    traced = trace(photograph.grey, found, scene, setup)
    _keep(photograph, overlay(photograph.grey, traced), camera)
    trial = traced.trial(photograph.source)
    curves = tuple(replace(curve, sigma=math.hypot(curve.sigma, found.error)) for curve in trial.curves)
    return replace(trial, curves=curves)


def _keep(photograph: Photograph, drawn: npt.NDArray[np.uint8], camera: CameraUse) -> None:
    """Write a picture into which was drawn what was seen, if that is wanted."""
    import cv2

    if camera.overlays is None:
        return
    _, data = cv2.imencode(".jpg", drawn)
    stem = os.path.splitext(os.path.basename(photograph.source))[0]
    write_file(camera.overlays / f"{stem}{OVERLAY_SUFFIX}", data.tobytes(), force=True)
