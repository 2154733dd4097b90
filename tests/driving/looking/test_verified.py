"""Shapes that are looked at after they were sent: what is seen decides what is sent next, and is kept."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.cameras.camera_file import read_camera
from curveline.cameras.outcomes import TrialOutcome
from curveline.cameras.synthetic.standpoints import default_setup, default_view
from curveline.comparing.photographed import CameraUse
from curveline.driving.known_states import shown_states
from curveline.driving.last_look import seen_last
from curveline.driving.looking import looks
from curveline.driving.looking.looks import Look
from curveline.driving.looking.verified import VerifiedTour, VerifyRequest, send_verified
from curveline.driving.looking.watching import WatchRequest, watch
from curveline.driving.session import Session
from curveline.errors import InvalidInput
from curveline.radio.host.link import Control, OperatorRequest, read_status
from curveline.scene import Scene
from curveline.trial import Trial, TrialCurve

PEAK, VALLEY = "level-up-peak", "level-up-valley"
SINGLE = curveline.read_display("single")
USE = CameraUse(default_setup(SINGLE, default_view(SINGLE).lens))


class Camera:
    """One whose pictures show what they are told to: the name of a state, or an outcome."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, shows: Sequence[str]) -> None:
        self.shows = list(shows)
        monkeypatch.setattr(looks, "trial_in", self._trial_in)

    def take(self, path: Path) -> Path:
        picture = path.with_name(path.name + ".png")
        picture.write_bytes(b"picture")
        return picture

    def _trial_in(self, picture: Path, scene: Scene, camera: CameraUse) -> Trial:
        shown = self.shows.pop(0)
        if shown in tuple(TrialOutcome):
            return Trial(str(picture), TrialOutcome(shown), "too dark")
        return Trial(str(picture), TrialOutcome.SEEN, curves=(TrialCurve(np.zeros((2, 2)), shown),))


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    with curveline.connect("mock:fresh", runs=tmp_path / "runs") as session:
        yield session


def sent(session: Session, camera: Camera, *shapes: str, **asked: object) -> VerifiedTour:
    request = VerifyRequest(camera, USE, **asked)  # type: ignore[arg-type]
    return send_verified(session, [curveline.read_shape(shape) for shape in shapes], request)


def records(found: VerifiedTour, run: int = 0) -> list[dict[str, object]]:
    return [dict(each) for each in curveline.log(found.shapes[-1].runs[run].folder).records]


def test_what_is_as_wanted_goes_on_to_the_next(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    found = sent(session, Camera(monkeypatch, ["peak", "valley"]), PEAK, VALLEY)
    assert found.is_wanted
    assert [len(each.runs) for each in found.shapes] == [1, 1]
    assert records(found)[-1]["type"] == "look"
    assert records(found)[-1]["states"] == ["valley"]
    assert curveline.log(found.shapes[0].runs[0].folder)[-1].what == "seen in a picture: peak"
    (newest, *_) = curveline.runs(session.folder)
    assert newest.ending.value == "done"


def test_a_wrong_state_ends_the_tour(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    found = sent(session, Camera(monkeypatch, ["valley"]), PEAK, VALLEY)
    assert not found.is_wanted
    assert [each.is_wanted for each in found.shapes] == [False]
    assert "not the wanted peak" in found.shapes[0].looks[0].line()
    assert found.document()["shapes"][0]["looks"][0]["states"] == ["valley"]


def test_a_wrong_state_is_led_back_as_often_as_allowed(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    found = sent(session, Camera(monkeypatch, ["valley", "valley", "peak"]), PEAK, recoveries=2)
    assert found.is_wanted
    assert len(found.shapes[0].runs) == 3
    again = sent(session, Camera(monkeypatch, ["valley"] * 3), PEAK, recoveries=1)
    assert not again.is_wanted
    assert len(again.shapes[0].runs) == 2


def test_nobody_leads_back_who_does_not_want_to(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Look] = []

    def refuses(look: Look) -> bool:
        asked.append(look)
        return False

    found = sent(session, Camera(monkeypatch, ["valley"]), PEAK, recoveries=2, agrees=refuses)
    assert len(asked) == len(found.shapes[0].runs) == 1


def test_what_cannot_be_told_is_not_wanted_and_tried_again(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    found = sent(session, Camera(monkeypatch, ["blurred"]), PEAK)
    (look,) = found.shapes[0].looks
    assert (look.is_wanted, look.is_told) == (False, False)
    assert "too dark" in look.line()
    assert records(found)[-1]["outcome"] == "blurred"
    assert curveline.log(found.shapes[0].runs[0].folder)[-1].what == "cannot tell what the display shows: too dark"


def test_what_was_seen_is_believed_before_the_plan(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    sent(session, Camera(monkeypatch, ["valley"]), PEAK)
    radio, drive = session.radio, session.drive
    statuses = read_status(radio, drive, "single")
    radio.modelled.rod = []  # type: ignore[attr-defined]
    shown = shown_states(radio, drive, statuses, session.folder)
    assert shown.states == ("valley",)
    assert shown.source.startswith("a picture after run")


def test_a_plan_is_looked_at_in_its_end(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = curveline.plan(VALLEY, PEAK)
    request = VerifyRequest(Camera(monkeypatch, ["valley", "peak"]), USE, recoveries=1)
    found = send_verified(session, [plan], request)
    assert found.is_wanted
    assert len(found.shapes[0].runs) == 2
    assert found.shapes[0].scene.segments[0].length == pytest.approx(0.66, abs=1e-3)


def test_pictures_are_named_for_compare(session: Session, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = tmp_path / "pictures"
    folder.mkdir()
    for _ in range(2):
        sent(session, Camera(monkeypatch, ["peak"]), PEAK, pictures=folder)
    assert sorted(each.name for each in folder.iterdir()) == ["camera.toml", f"{PEAK}-1.png", f"{PEAK}-2.png"]
    kept = read_camera(folder / "camera.toml", SINGLE)
    assert kept.rod.pitch == pytest.approx(USE.setup.rod.pitch)
    assert replace(kept.rod, pitch=USE.setup.rod.pitch) == USE.setup.rod


def test_who_asks_to_stop_is_not_photographed(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    control = Control()
    control.ask(OperatorRequest.PAUSE)
    request = VerifyRequest(Camera(monkeypatch, []), USE)
    found = send_verified(session, [curveline.read_shape(PEAK)], request, control)
    assert found.is_interrupted
    assert found.shapes[0].looks == ()


@pytest.mark.parametrize("count", [-1, 21])
def test_recoveries_that_make_no_sense(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    with pytest.raises(InvalidInput):
        VerifyRequest(Camera(monkeypatch, []), USE, count)


@pytest.mark.parametrize("states", [None, "valley", [1], [], ["valley", "peak"]])
def test_odd_records_of_looks_tell_nothing(states: object) -> None:
    assert seen_last([{"type": "look", "states": states}], 1) == ("",)
    assert seen_last([{"type": "end"}], 1) is None


def test_watching_says_when_a_rod_was_snapped_over(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    camera = Camera(monkeypatch, ["peak", "peak", "blurred", "valley", "peak"])
    seen = []
    for sighting in watch(camera, PEAK, WatchRequest(USE, every=0.0, runs=tmp_path)):
        seen.append(sighting)
        if len(seen) == 5:
            break
    assert [each.snapped for each in seen] == [(), (), (), ((1, "peak"),), ((1, "valley"),)]
    assert seen[3].line().endswith("segment 1 snapped from peak to valley")
    assert seen[3].document()["snapped"] == [{"segment": 1, "before": "peak", "after": "valley"}]
