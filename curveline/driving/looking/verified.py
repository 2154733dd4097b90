"""Shapes sent with a look at the display after each: what it shows is named, and a wrong state is led back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curveline._version import __version__
from curveline.displays.of_plan import display_of
from curveline.driving.looking.looks import Look, keep_look, look_at
from curveline.driving.looking.standing import scene_at
from curveline.driving.modelled import modelled
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.link import Control, OperatorRequest

if TYPE_CHECKING:
    from curveline.comparing.photographed import CameraUse
    from curveline.driving.looking.picture_sources import PictureSource
    from curveline.driving.run_result import RunResult
    from curveline.driving.session import Session
    from curveline.scene import Scene

MOST_RECOVERIES = 20


@dataclass(frozen=True)
class VerifyRequest:
    """How a display is looked at.

    A wrong state is led back, and looked at again, at most `recoveries` times for a shape; before each of them `agrees`
    is asked. Pictures go into the folder of their run, or into `pictures` by the names of shapes and numbers.
    """

    source: PictureSource  # where pictures come from
    camera: CameraUse  # how they were made
    recoveries: int = 0
    pictures: Path | None = None
    touched: bool = False  # nothing is known of the rod before the first shape
    agrees: Callable[[Look], bool] = lambda look: True

    def __post_init__(self) -> None:
        if not 0 <= self.recoveries <= MOST_RECOVERIES:
            raise InvalidInput(f"no shape is recovered {self.recoveries} times", f"choose 0 to {MOST_RECOVERIES}")


@dataclass(frozen=True)
class VerifiedShape:
    """A shape that was sent and looked at: the runs that led to it, the look after each."""

    scene: Scene
    runs: tuple[RunResult, ...]
    looks: tuple[Look, ...]

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

    shapes: tuple[VerifiedShape, ...]
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
    session: Session, what: Sequence[Scene | Plan], request: VerifyRequest, control: Control | None = None
) -> VerifiedTour:
    """Send shapes, or plans, one after the other, and look at the display after each.

    Where it shows another state than the wanted one, that is what the next plan begins with: it leads through the
    funnel. NoPicture if the camera gives none; LinkError as `Session.send`.
    """
    control = control or Control()
    done: list[VerifiedShape] = []
    for each in what:
        done.append(_sent(session, each, replace(request, touched=request.touched and not done), control))
        if not done[-1].is_wanted:
            break
    return VerifiedTour(tuple(done), len(what))


def _sent(session: Session, what: Scene | Plan, request: VerifyRequest, control: Control) -> VerifiedShape:
    scene = _end_of(what) if isinstance(what, Plan) else what
    runs: list[RunResult] = []
    looks: list[Look] = []
    while True:
        touched = request.touched and not runs
        runs.append(session.send(scene if runs else what, touched=touched, control=control))
        if control.request is not OperatorRequest.NONE:
            break
        looks.append(look_after(session, runs[-1], scene, request))
        left = request.recoveries - len(runs) + 1
        if looks[-1].is_wanted or left <= 0 or not request.agrees(looks[-1]):
            break
        session.listener.note(f"recovering: planned anew from what was seen, {len(runs)} of {request.recoveries}")
    return VerifiedShape(scene, tuple(runs), tuple(looks))


def _end_of(plan: Plan) -> Scene:
    """The shape in which a plan ends; InvalidInput if the file of its display is gone."""
    last = plan.steps[-1].targets if plan.steps else plan.start
    return scene_at(display_of(plan), [target.counts for target in last], plan.wanted, plan.name)


def look_after(session: Session, run: RunResult, scene: Scene, request: VerifyRequest) -> Look:
    """Take a picture after a run, name what it shows, and keep that in the record of the run."""
    picture = request.source.take(_place(request, run.folder, scene))
    look = look_at(picture, scene, request.camera)
    display = modelled(session.radio)
    keep_look(run.folder, look, None if display is None else display.disk)
    session.listener.note(look.line())
    return look


def _place(request: VerifyRequest, run: Path, scene: Scene) -> Path:
    """Where a picture goes, without its suffix: a number that is free."""
    folder = request.pictures or run
    stem = Path(scene.path).stem or "look"
    taken = {each.stem for each in folder.iterdir()}
    number = next(number for number in range(1, len(taken) + 2) if f"{stem}-{number}" not in taken)
    return folder / f"{stem}-{number}"
