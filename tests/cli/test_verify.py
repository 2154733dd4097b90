"""Shapes that are looked at: `send --verify`, `watch`, and how their answers look."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from .conftest import SHAPES, Run, failure
from .terminals import in_terminal

PEAK = str(SHAPES / "level-up-peak.toml")
MOCK = ("--verify", "mock", "--yes")


def test_a_shape_is_sent_looked_at_and_kept(run: Run, tmp_path: Path) -> None:
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    code, out, err = run("send", PEAK, "--radio", "mock:fresh", *MOCK, "--pictures", pictures)
    assert (code, out) == (0, "level-up-peak: the display shows peak, as wanted\n")
    assert "the display shows peak, as wanted" in err
    assert {each.name for each in pictures.iterdir()} == {"camera.toml", "level-up-peak-1.png"}
    code, out, _ = run("compare", pictures, "--overlays", tmp_path / "seen", "--json")
    assert code == 0
    (shape,) = json.loads(out)["shapes"]
    assert shape["states"] == ["peak"]
    assert shape["rmse_mm"] < 0.5
    assert 0.0 < shape["trials"][0]["sigma_mm"][0] < 0.5
    assert (tmp_path / "seen" / "level-up-peak-1-seen.jpg").stat().st_size > 10_000
    code, out, _ = run("runs", "show", "last")
    assert out.splitlines()[-1].endswith("seen in a picture: peak")


@pytest.mark.parametrize(
    "command", [("send", PEAK, *MOCK), ("watch", "mock", PEAK, "--count", "1")], ids=["send", "watch"]
)
def test_without_opencv_nothing_moves(command: tuple[str, ...], run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    code, out, err = run(*command, "--radio", "mock:fresh")
    assert (code, out) == (2, "")
    assert "needs OpenCV" in err
    assert "pip install 'curveline[photo]'" in err
    assert run("runs")[1] == "no runs\n"


def test_a_wrong_state_is_said_and_led_back_when_that_is_allowed(run: Run) -> None:
    code, out, err = run("send", PEAK, "--radio", "mock:fresh,hand=1", *MOCK, "--json")
    assert code == 1
    document = json.loads(out)
    assert (document["as_wanted"], document["shapes_asked"]) == (False, 1)
    (look,) = document["shapes"][0]["looks"]
    assert (look["states"], look["wanted"], look["as_wanted"]) == (["valley"], ["peak"], False)
    code, out, err = run("send", PEAK, "--radio", "mock:fresh,hand=1", *MOCK, "--recover", "1")
    assert (code, out) == (0, "level-up-peak after 2 runs: the display shows peak, as wanted\n")
    assert "recovering: planned anew from what was seen, 1 of 1" in err


def test_a_way_back_is_offered_to_who_can_be_asked(tmp_path: Path) -> None:
    answers = {"Move the display?": b"y\n", "Lead it back through the funnel?": b"y\n"}

    def answer(text: str, process: object) -> None:
        for question in [each for each in answers if each in text]:
            master_writes(answers.pop(question))

    import os
    import pty

    real = pty.openpty
    ends: list[int] = []

    def opened() -> tuple[int, int]:
        master, slave = real()
        ends.append(master)
        return master, slave

    def master_writes(data: bytes) -> None:
        os.write(ends[-1], data)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pty, "openpty", opened)
        shown = in_terminal(
            "send", PEAK, "--radio", "mock:fresh,hand=1", "--verify", "mock",
            settings={"CURVELINE_RUNS": str(tmp_path)}, heard=answer,
        )  # fmt: skip
    assert shown.code == 0
    assert not answers
    assert "level-up-peak after 2 runs: the display shows peak, as wanted" in shown.left


def test_home_after_what_was_seen(run: Run) -> None:
    code, _, err = run("send", PEAK, "--home", "--radio", "mock:fresh", *MOCK)
    assert code == 0
    assert "home" in err


@pytest.mark.parametrize(
    "arguments",
    [
        ("--recover", "1", "--yes"),
        ("--camera", "x.toml", "--yes"),
        ("--verify", "mock", "--dry-run"),
        ("--verify", "nothing", "--yes"),
        ("--verify", "mock:nice", "--yes"),
        ("--verify", "true {}", "--yes"),
        ("--verify", "true {}", "--camera", "nowhere.toml", "--yes"),
        ("--verify", "mock", "--pictures", "nowhere", "--yes"),
    ],
)
def test_what_cannot_be_looked_at_is_refused_before_anything_moves(run: Run, arguments: tuple[str, ...]) -> None:
    code, _, err = run("send", PEAK, "--radio", "mock:fresh", *arguments)
    assert code == 2
    assert "hint: " in err
    assert json.loads(run("runs", "--json").out)["runs"] == []


def test_home_alone_and_runs_are_not_looked_at(run: Run) -> None:
    assert run("send", "--home", "--radio", "mock:fresh", *MOCK).code == 2
    assert run("send", "--resume", "last", "--radio", "mock:fresh", *MOCK).code == 2


def test_a_camera_that_gives_nothing_fails_after_the_run(run: Run, tmp_path: Path) -> None:
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    assert run("send", PEAK, "--radio", "mock:fresh", *MOCK, "--pictures", pictures).code == 0
    camera = pictures / "camera.toml"
    code, out, err = run(
        "send", PEAK, "--radio", "mock:fresh", "--yes", "--verify", "false {}", "--camera", camera, "--json"
    )
    assert code == 1
    assert failure(out, 1)["code"] == "failed"
    assert "false failed with exit code 1" in err


def test_a_command_shows_another_picture(run: Run, tmp_path: Path) -> None:
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    assert run("send", PEAK, "--radio", "mock:fresh,hand=1", *MOCK, "--pictures", pictures).code == 1
    valley, camera = pictures / "level-up-peak-1.png", pictures / "camera.toml"
    copy = f"cp {valley} {{}}"
    code, out, _ = run("watch", copy, PEAK, "--camera", camera, "--count", "2", "--every-s", "0", "--json")
    assert code == 1
    first, second = map(json.loads, out.splitlines())
    assert (first["states"], second["snapped"]) == (["valley"], [])
    code, out, _ = run("watch", copy, PEAK, "--camera", camera, "--count", "2", "--every-s", "0")
    assert len(out.splitlines()) == 1
    assert out.endswith("the display shows valley, not the wanted peak\n")


@pytest.mark.parametrize("arguments", [("mock", PEAK), ("mock", PEAK, "--every-s", "-1"), ("nothing", PEAK)])
def test_what_cannot_be_watched(run: Run, arguments: tuple[str, ...]) -> None:
    code, _, err = run("watch", *arguments, "--count", "1")
    assert code in (1, 2)
    assert "hint: " in err
