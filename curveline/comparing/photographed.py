"""Trials from photographs: where the camera stood, the rod traced, and a drawing of what was seen in each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from curveline.cameras.setup import CameraSetup
from curveline.comparing.trial import Trial
from curveline.scene import Scene
from curveline.system.files import AnyPath


@dataclass(frozen=True)
class CameraUse:
    """How photographs were made, and a folder for drawings of what was seen in them, None for no drawings."""

    setup: CameraSetup  # what the camera file says
    overlays: Path | None = None


def trial_in(picture: AnyPath, scene: Scene, camera: CameraUse) -> Trial:
    """What a photograph shows of a display that was sent the shape of `scene`.

    Every reason for which it cannot be used is an outcome; InvalidInput for a file that is no picture.
    """
    raise NotImplementedError
