"""Shapes sent with a look at the display after each: what it shows is named, and a wrong state is led back."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curveline._version import __version__
from curveline.comparing.folders import CAMERA
from curveline.displays.of_plan import display_of
from curveline.driving.looking.looks import Look, keep_look, look_at
from curveline.driving.looking.opening import camera_for, source_for
from curveline.driving.looking.standing import scene_at
from curveline.driving.modelled import modelled
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.link import Control, OperatorRequest
from curveline.scene import Scene
from curveline.shapes.inputs import read_input
from curveline.system.files import write_file

if TYPE_CHECKING:
    from curveline.comparing.photographed import CameraUse
    from curveline.driving.looking.picture_sources import PictureSource
    from curveline.driving.run_result import RunResult
    from curveline.driving.session import Session
    from curveline.scene import Display
    from curveline.system.files import AnyPath

MOST_RECOVERIES = 20


def unasked(look: Look) -> bool:
    """Agree to every way back."""
    return True


@dataclass(frozen=True)
class VerifyRequest:
    """How a display is looked at after each shape.

    `source` is a command in which {} stands for the picture, a folder into which a camera puts one, `mock` for the
    camera of a mock display, or a source of one's own; `camera` the camera file, which a mock display needs none of. A
    wrong state is led back, and looked at again, at most `recoveries` times for a shape; before each of them `agrees`
    is asked. Pictures go into the folder of their run, or into `pictures`, by the names of shapes and numbers. With
    `touched` nothing is taken to be known of the rod before the first shape.
    """

    source: str | PictureSource
    camera: AnyPath | CameraUse | None = None
    recoveries: int = 0
    pictures: AnyPath | None = None
    touched: bool = False
    agrees: Callable[[Look], bool] = unasked  # before each way back

    def __post_init__(self) -> None:
        if not 0 <= self.recoveries <= MOST_RECOVERIES:
            raise InvalidInput(f"no shape is recovered {self.recoveries} times", f"choose 0 to {MOST_RECOVERIES}")
        if self.pictures is not None and not os.path.isdir(self.pictures):
            folder = os.fspath(self.pictures)
            raise InvalidInput(f"{folder}: there is no such folder", f"make it first: mkdir -p {shlex.quote(folder)}")


@dataclass(frozen=True)
class VerifiedShape:
    """A shape that was sent and looked at: the runs that led to it, the look after each."""

    scene: Scene  # what is wanted
    runs: tuple[RunResult, ...]  # one more than ways back
    looks: tuple[Look, ...]  # after each run that was not interrupted

    @property
    def is_wanted(self) -> bool:
        """Whether the last look saw what is wanted."""
        return bool(self.looks) and self.looks[-1].is_wanted

    @property
    def is_interrupted(self) -> bool:
        """Whether somebody asked to stop."""
        return self.runs[-1].is_interrupted


@dataclass(frozen=True)
class VerifiedTour:
    """Shapes that were sent one after the other, each looked at; the tour ends with the first that is not as wanted."""

    shapes: tuple[VerifiedShape, ...]  # as far as they were sent
    asked: int  # shapes that were to be sent

    @property
    def is_wanted(self) -> bool:
        """Whether all shapes were seen as wanted."""
        return len(self.shapes) == self.asked and all(each.is_wanted for each in self.shapes)

    @property
    def is_interrupted(self) -> bool:
        """Whether somebody asked to stop."""
        return bool(self.shapes) and self.shapes[-1].is_interrupted

    def document(self) -> dict[str, Any]:
        """What `curveline send --verify --json` prints."""
        return {
            "curveline": __version__,
            "as_wanted": self.is_wanted,
            "shapes_asked": self.asked,
            "shapes": [
                {
                    "shape": each.scene.name,
                    "as_wanted": each.is_wanted,
                    "looks": [look.document() for look in each.looks],
                    "runs": [run.document() for run in each.runs],
                }
                for each in self.shapes
            ],
        }


def send_verified(
    session: Session,
    what: Sequence[AnyPath | Scene | Plan],
    request: VerifyRequest,
    control: Control | None = None,
) -> VerifiedTour:
    """Send shapes, or plans, one after the other, and look at the display after each.

    Where it shows another state than the wanted one, that is what the next plan begins with: it leads through the
    funnel. InvalidInput for a camera that does not exist, NoPicture if it gives none; LinkError as `Session.send`.
    """
    control = control or Control()
    with looked_at(session, what, request) as looking:
        return looking.send(control)


@contextmanager
def looked_at(session: Session, what: Sequence[AnyPath | Scene | Plan], request: VerifyRequest) -> Iterator[Looking]:
    """As `send_verified`, ready to send: what there is to refuse was refused, and nothing has moved."""
    given = [each if isinstance(each, Scene | Plan) else read_input(each) for each in what]
    if not given:
        raise InvalidInput("there is nothing to send and to look at", "name a shape, or a plan")
    display = _display_of(given[0], session)
    use = camera_for(request.source, request.camera, display)
    source = source_for(request.source, use, session, display)
    if request.pictures is not None:
        _keep_camera(Path(request.pictures), use, display)
    yield Looking(session, tuple(given), request, _Eye(source, use))


def _keep_camera(folder: Path, use: CameraUse, display: Display) -> None:
    """Put a camera file beside pictures that have none, so that they can be compared."""
    from curveline.cameras.camera_text import setup_text

    if not (folder / CAMERA).exists():
        write_file(folder / CAMERA, setup_text(display, use.setup).encode())


@dataclass(frozen=True)
class _Eye:
    """A camera that is ready, and how its pictures are made."""

    source: PictureSource
    use: CameraUse


class Looking:
    """Shapes that are sent one after the other, each looked at."""

    def __init__(self, session: Session, what: tuple[Scene | Plan, ...], request: VerifyRequest, eye: _Eye) -> None:
        self.what = what
        self._session = session
        self._request = request
        self._eye = eye
        self._done: list[VerifiedShape] = []

    @property
    def tour(self) -> VerifiedTour:
        """What was sent so far."""
        return VerifiedTour(tuple(self._done), len(self.what))

    def send(self, control: Control) -> VerifiedTour:
        """Send one after the other, up to the first that is not seen as wanted; what came of it."""
        for _ in self.what:
            if not self._send_next(control):
                break
        return self.tour

    def _send_next(self, control: Control) -> bool:
        """Send what is next, and lead it back as often as that is allowed; whether it was seen as wanted."""
        what = self.what[len(self._done)]
        scene = _end_of(what, self._session) if isinstance(what, Plan) else what
        runs: list[RunResult] = []
        looks: list[Look] = []
        touched = self._request.touched and not self._done
        while True:
            runs.append(self._session.send(scene if runs else what, touched=touched and not runs, control=control))
            if control.request is not OperatorRequest.NONE:
                break
            looks.append(self._look_after(runs[-1], scene))
            left = self._request.recoveries - len(runs) + 1
            if looks[-1].is_wanted or left <= 0 or not self._request.agrees(looks[-1]):
                break
            note = f"recovering: planned anew from what was seen, {len(runs)} of {self._request.recoveries}"
            self._session.listener.note(note)
        self._done.append(VerifiedShape(scene, tuple(runs), tuple(looks)))
        return self._done[-1].is_wanted

    def _look_after(self, run: RunResult, scene: Scene) -> Look:
        """Take a picture after a run, name what it shows, and keep that in the record of the run."""
        picture = self._eye.source.take(_place(self._request, run.folder, scene))
        look = look_at(picture, scene, self._eye.use)
        display = modelled(self._session.radio)
        keep_look(run.folder, look, None if display is None else display.disk)
        self._session.listener.note(look.line())
        return look


def _display_of(what: Scene | Plan, session: Session) -> Display:
    """The display that is looked at; InvalidInput if its file is gone."""
    return display_of(what, session.listener) if isinstance(what, Plan) else what.display


def _end_of(plan: Plan, session: Session) -> Scene:
    """The shape in which a plan ends."""
    last = plan.steps[-1].targets if plan.steps else plan.start
    counts = [target.counts for target in last]
    return scene_at(display_of(plan, session.listener), counts, plan.wanted, plan.name)


def _place(request: VerifyRequest, run: Path, scene: Scene) -> Path:
    """Where a picture goes, without its suffix: a number that is free."""
    folder = run if request.pictures is None else Path(request.pictures)
    stem = Path(scene.path).stem or "look"
    taken = {each.stem for each in folder.iterdir()}
    number = next(number for number in range(1, len(taken) + 2) if f"{stem}-{number}" not in taken)
    return folder / f"{stem}-{number}"
