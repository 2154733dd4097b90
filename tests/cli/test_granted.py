"""States that a plan takes for granted: what is said of them, and where the rod of a mock display begins."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.drive_settings import drive_settings
from curveline.driving import known_states
from curveline.driving.known_states import Shown, check_granted
from curveline.errors import Infeasible
from curveline.plan_file import Plan, sealed, write_plan
from curveline.radio.host.link import read_status
from curveline.radio.interface import open_radio
from curveline.shapes.files import read_display

from .conftest import Run, promising, small_plan

THERE = small_plan(steps=3)
BACK = replace(THERE, start=THERE.steps[-1].targets, steps=THERE.steps[:1])
"""From where THERE ends to where its first step does; all along the rod can be a peak or a valley."""
MOCK = "mock-single.json"


@pytest.fixture
def there(run: Run, tmp_path: Path) -> Callable[[list[str]], Path]:
    """Bring the mock display to where BACK begins, and have it remember some states; its file."""
    runs = tmp_path / "runs"

    def move(remembered: list[str]) -> Path:
        write_plan(THERE, tmp_path / "there.json")
        assert run("send", tmp_path / "there.json", "--radio", "mock", "--yes").code == 0
        shutil.rmtree(next(runs.glob("*-small")))
        content = json.loads((runs / MOCK).read_text())
        assert content["rod"] == ["valley"]
        (runs / MOCK).write_text(json.dumps(content | {"rod": remembered}))
        return runs / MOCK

    return move


def four_segments(shows: tuple[str, ...]) -> Plan:
    """A plan that is never sent: all that counts is where it starts."""
    drive = drive_settings(read_display("quad"))
    return replace(THERE, drive=drive, start=THERE.start[:1] * 5, wanted=("peak",) * 4, shows=shows)


@pytest.mark.parametrize(
    ("granted", "states", "says"),
    [
        (("peak", "", "", ""), ("peak", "", "", ""), "the display shows: peak, 3 x not known (somebody)"),
        (
            ("peak", "", "", "peak"),
            ("", "valley", "valley", "peak"),
            "not known: the display shows peak, 2 x any, peak",
        ),
        (("", "", "peak", "valley"), (), "not known: the display shows 2 x any, peak, valley"),
        (("", "", "peak", ""), ("valley", "valley", "valley", ""), "segment 3 shows valley, but the plan takes peak"),
        (("valley",) * 4, ("", "valley", "", "straight"), "segment 4 shows straight, but the plan takes valley"),
        (("",) * 4, ("peak",) * 4, ""),
        ((), ("peak",) * 4, ""),
    ],
)
def test_every_segment_is_held_against_what_is_known_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, granted: tuple[str, ...], states: tuple[str, ...], says: str
) -> None:
    monkeypatch.setattr(known_states, "shown_states", lambda *_: Shown(states, "somebody"))
    plan = four_segments(granted)
    with closing(open_radio("mock", plan.drive, tmp_path)) as radio:
        nodes = read_status(radio, plan.drive)
        if says.startswith("segment"):
            with pytest.raises(Infeasible, match=says) as refusal:
                check_granted(plan, radio, nodes, tmp_path)
            assert "send the shape" in refusal.value.hint
        else:
            found = check_granted(plan, radio, nodes, tmp_path)
            assert found.endswith(says)
            assert bool(found) is bool(says)


@pytest.mark.parametrize("remembered", [[], ["lost"], [""]])
def test_where_nothing_is_known_the_rod_begins_as_the_plan_takes_for_granted(
    run: Run, tmp_path: Path, there: Callable[[list[str]], Path], remembered: list[str]
) -> None:
    mock = there(remembered)
    saved = mock.read_bytes()
    # Where nothing is granted either, the rod sags.
    for granted, state in ((("peak",), "peak"), ((), "valley"), (("",), "valley")):
        mock.write_bytes(saved)
        write_plan(promising(replace(BACK, shows=granted), state), tmp_path / "back.json", force=True)
        result = run("send", tmp_path / "back.json", "--radio", "mock", "--yes", "--json")
        rod = json.loads(result.out)["rod"]
        assert (result.code, rod["start"], rod["states"], rod["snaps"]) == (0, [state], [state], [])
        assert ("takes for granted what is not known: the display shows peak\n" in result.err) is (state == "peak")


def test_a_run_that_moved_nothing_does_not_make_its_plan_true(
    run: Run, tmp_path: Path, there: Callable[[list[str]], Path]
) -> None:
    mock = there([])
    write_plan(sealed(replace(THERE, shows=("peak",))), tmp_path / "elsewhere.json")
    result = run("send", tmp_path / "elsewhere.json", "--radio", "mock", "--yes")
    assert result.code == 3
    assert "does not stand where the plan starts" in result.err
    assert json.loads(mock.read_text())["rod"] == []


def test_what_a_plan_takes_for_granted_is_rehearsed_and_no_hand_may_have_touched_it(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    write_plan(sealed(replace(THERE, shows=("peak",))), path)
    for command in (("send", path, "--dry-run"), ("plan", path)):
        assert "\ntakes for granted that the display shows: peak\n" in run(*command).out
    assert json.loads(run("send", path, "--dry-run", "--json").out)["shows"] == ["peak"]
    touched = run("send", path, "--radio", "mock", "--yes", "--touched")
    assert (touched.code, touched.out) == (2, "")
    assert "send the shape instead" in touched.err
    assert not (tmp_path / "runs").exists()
