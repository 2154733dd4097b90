"""What a camera before a display is by its name, and how its pictures are made."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from curveline.comparing.photographed import CameraUse, camera_use
from curveline.driving.looking.picture_sources import PictureSource, is_model, open_source
from curveline.driving.modelled import modelled
from curveline.errors import InvalidInput

if TYPE_CHECKING:
    from curveline.driving.session import Session
    from curveline.scene import Display
    from curveline.system.files import AnyPath


def camera_for(source: str | PictureSource, camera: AnyPath | CameraUse | None, display: Display) -> CameraUse:
    """How pictures from a source are made: as a camera file says, or, of a mock display, as its own camera is.

    InvalidInput without a camera file, and as for one that cannot be read; MissingExtra without OpenCV.
    """
    from curveline.cameras.opencv import opencv

    opencv()
    if isinstance(camera, CameraUse):
        return camera
    if camera is not None:
        return camera_use(camera, display)
    if isinstance(source, str) and is_model(source):
        from curveline.cameras.synthetic.standpoints import default_setup, default_view

        return CameraUse(default_setup(display, default_view(display).lens))
    hint = "make one with `curveline camera calibrate`, and name it with --camera"
    raise InvalidInput("it is not known how these pictures are made", hint)


def source_for(source: str | PictureSource, use: CameraUse, session: Session, display: Display) -> PictureSource:
    """The camera that is named, ready to take pictures; InvalidInput for one that does not exist.

    `mock` is that of the mock display behind the radio of a session.
    """
    if not isinstance(source, str | os.PathLike):
        return source
    if not is_model(source):
        return open_source(source, session.listener.note)
    from curveline.driving.looking.model_camera import ModelCamera, faults_in

    behind = modelled(session.radio)
    if behind is None:
        hint = "name a folder or a command, or use --radio mock"
        raise InvalidInput(f"{source}: only a mock display has a camera that is modelled", hint)
    return ModelCamera(display, behind, use.setup, faults_in(source))
