"""What a camera before a display is by its name, for a session with that display or without one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from curveline.comparing.photographed import CameraUse, camera_use
from curveline.driving.looking.picture_sources import PictureSource, is_model, open_source
from curveline.driving.looking.watching import Sighting, watch
from curveline.driving.modelled import modelled
from curveline.driving.run_listener import UNHEARD, RunListener
from curveline.errors import InvalidInput

if TYPE_CHECKING:
    from curveline.driving.session import Session
    from curveline.scene import Display, Scene
    from curveline.system.files import AnyPath


def camera_for(source: str, camera: AnyPath | None, display: Display, overlays: Path | None = None) -> CameraUse:
    """How pictures from a source are made: as a camera file says, or, of a mock display, as its own camera is.

    InvalidInput without a camera file, and as for one that cannot be read.
    """
    if camera is None and is_model(source):
        from curveline.cameras.synthetic.standpoints import default_setup, default_view

        return CameraUse(default_setup(display, default_view(display).lens), overlays)
    if camera is None:
        hint = "make one with `curveline camera calibrate`, and name it with --camera"
        raise InvalidInput("it is not known how these pictures are made", hint)
    return camera_use(camera, overlays)


def source_for(source: str, use: CameraUse, session: Session, display: Display) -> PictureSource:
    """The camera that is named, ready to take pictures; InvalidInput for one that does not exist.

    `mock` is that of the mock display behind the radio of a session.
    """
    if not is_model(source):
        return open_source(source, session.listener.note)
    from curveline.driving.looking.model_camera import ModelCamera, faults_in

    behind = modelled(session.radio)
    if behind is None:
        hint = "name a folder or a command, or use --radio mock"
        raise InvalidInput(f"{source}: only a mock display has a camera that is modelled", hint)
    return ModelCamera(display, behind, use.setup, faults_in(source))


@contextmanager
def open_watch(
    source: str,
    shape: AnyPath | Scene,
    camera: AnyPath | None = None,
    behind: tuple[str, Path] = ("", Path()),
    listener: RunListener = UNHEARD,
) -> Iterator[Callable[[float], Iterator[Sighting]]]:
    """What looks at a display every so often [s]: see `watch`.

    Of a mock display `behind` are its radio and the folder of its runs; other cameras need none.
    """
    from curveline.driving.session import connect
    from curveline.scene import Scene
    from curveline.shapes.files import read_shape

    scene = shape if isinstance(shape, Scene) else read_shape(shape)
    use = camera_for(source, camera, scene.display)
    spec, runs = behind
    if not is_model(source):
        yield partial(watch, open_source(source, listener.note), scene, use)
        return
    with connect(spec, scene.display, runs=runs, listener=listener) as session:
        yield partial(watch, source_for(source, use, session, scene.display), scene, use)
