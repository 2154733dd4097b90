"""The history of a rod from the runs on record: the set that it has, plans with that, and what the model's rod does."""

from __future__ import annotations

import json
import math
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import curveline
from curveline.cli.app import app
from curveline.driving import rod_now
from curveline.driving.session import Session
from curveline.errors import Infeasible, InvalidInput, LinkError
from curveline.shapes.files import builtin_text
from curveline.simulation.dwelling import scene_after
from curveline.units import DAY, HOUR

SHAPES = Path(__file__).parents[2] / "shapes"
VALLEY, PEAK, STEEP = "level-up-valley.toml", "level-up-peak.toml", "steep.toml"
Waits = Callable[[float], None]


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with shapes on a display whose rod takes a set as acetal does; `steep` is near the end of its peak."""
    display = builtin_text("single").replace("[limits]", "set_strength = 1.0\n\n[limits]", 1)
    (tmp_path / "mine.toml").write_text(display)
    for name in (VALLEY, PEAK, "level-asymmetric-peak.toml"):
        text = (SHAPES / name).read_text().replace('"single"', '"mine.toml"')
        (tmp_path / name.replace("level-asymmetric-peak", "steep")).write_text(text.replace("= 10.0", "= 40.0"))
    return tmp_path


@pytest.fixture
def wait(monkeypatch: pytest.MonkeyPatch) -> Waits:
    """Lets time pass [s]."""
    passed, real = [0.0], time.time
    monkeypatch.setattr(time, "time", lambda: real() + passed[0])

    def waits(seconds: float) -> None:
        passed[0] += seconds

    return waits


@contextmanager
def display_of(files: Path, radio: str = "mock") -> Iterator[Session]:
    with curveline.connect(radio, files / "mine.toml", runs=files / "runs") as session:
        yield session


def sent(files: Path, shape: str, radio: str = "mock") -> tuple[str, ...]:
    """The states of the rod after a shape was sent, or home."""
    with display_of(files, radio) as session:
        result = session.home() if shape == "home" else session.send(files / shape)
    assert result.playback is not None
    return tuple(result.playback.states)


def test_what_a_run_left_is_what_the_shape_leaves(files: Path, wait: Waits) -> None:
    assert sent(files, VALLEY) == ("valley",)
    wait(8 * HOUR)
    with display_of(files) as session:
        rod = session.rod()
    (stay,) = rod.stays
    assert (stay.shape, stay.is_known) == ("level-up-valley", True)
    assert stay.seconds == pytest.approx(8 * HOUR, rel=1e-2)
    expected = scene_after(curveline.read_shape(files / PEAK), f"{files / VALLEY}@8h", curveline.read_shape).past
    assert expected is not None
    largest = expected.largest_set
    assert largest > 2.0
    assert np.abs(rod.past.memory.set_curvature - expected.memory.set_curvature).max() < 0.01 * largest


def test_a_shape_that_the_rod_does_not_hold_is_refused_and_what_is_advised_helps(files: Path, wait: Waits) -> None:
    sent(files, VALLEY)
    wait(HOUR)
    with display_of(files) as session:
        before = session.status().nodes[0].counts
        with pytest.raises(Infeasible, match="has no stable peak") as refusal:
            session.send(files / STEEP)
        assert session.status().nodes[0].counts == before
    assert "the rod's set is in the way: hold it at home for 10min" in refusal.value.hint
    sent(files, "home")
    wait(10 * 60)
    assert sent(files, STEEP) == ("peak",)


def test_a_plan_for_a_fresh_rod_is_refused_for_one_with_a_set(files: Path, wait: Waits) -> None:
    with display_of(files) as session:
        fresh = session.plan(files / STEEP)
        session.send(files / VALLEY)
        wait(DAY)
        session.home()
    with display_of(files) as session, pytest.raises(Infeasible, match="with the set that the rod has now"):
        session.send(fresh)


def test_a_plan_that_holds_for_the_rod_as_it_is_goes_through(files: Path, wait: Waits) -> None:
    with display_of(files) as session:
        plan = session.plan(files / PEAK)
        session.send(files / PEAK)
        wait(HOUR)
        session.home()
        assert session.send(plan).playback.states == ("peak",)


def test_the_same_comes_out_without_what_is_kept_beside_the_runs(files: Path, wait: Waits) -> None:
    for shape in (VALLEY, "home", PEAK, VALLEY):
        sent(files, shape)
        wait(2 * HOUR)
    with display_of(files) as session:
        rods = [session.rod()]
        kept = files / "runs" / "mock-rod-single.json"
        assert json.loads(kept.read_text())["run"].startswith("000004-")
        for text in ("", "{", "[1]", '{"format": 1}', '{"format": 1, "run": 2, "since": NaN, "memory": {}}'):
            kept.write_text(text)
            rods.append(session.rod())
        document = json.loads(kept.read_text())
        document["memory"]["bends_per_m"][0][0] = math.inf
        kept.write_text(json.dumps(document))
        rods.append(session.rod())
    for rod in rods[1:]:
        assert len(rod.stays) == 4
        assert np.abs(rod.past.memory.set_curvature - rods[0].past.memory.set_curvature).max() < 3e-3


def test_a_new_rod_and_a_new_display_remember_nothing(files: Path, wait: Waits) -> None:
    sent(files, VALLEY)
    wait(DAY)
    with display_of(files) as session:
        assert session.rod().past.largest_set > 3.0
        session.new_rod()
        assert session.rod().past.largest_set < 0.1
        wait(HOUR)
        assert 1.0 < session.rod().past.largest_set < 3.0
    assert sent(files, PEAK, "mock:fresh") == ("peak",)
    with display_of(files) as session:
        (stay,) = session.rod().stays
        assert stay.shape == "level-up-peak"
        assert session.rod().past.largest_set < 0.2


def test_a_run_that_was_broken_off_leaves_what_its_plan_proves(files: Path, wait: Waits) -> None:
    with display_of(files, "mock:stall=1@step2") as session, pytest.raises(LinkError):
        session.send(files / VALLEY)
    wait(HOUR)
    with display_of(files) as session:
        rod = session.rod()
    (stay,) = rod.stays
    assert not stay.is_known
    assert rod.past.largest_set < 1e-3
    assert "which curve it left is not known" in rod.remarks[0]


def test_records_of_other_displays_and_radios_are_of_other_rods(files: Path, wait: Waits) -> None:
    sent(files, VALLEY)
    wait(HOUR)
    other = (files / "mine.toml").read_text().replace('name = "single"', 'name = "other"')
    (files / "other.toml").write_text(other)
    assert curveline.rod_now("mock", files / "other.toml", runs=files / "runs").stays == ()
    assert curveline.rod_now("serial:/dev/null", files / "mine.toml", runs=files / "runs").stays == ()
    (files / "runs" / "000009-20261129-000000-odd").mkdir()
    assert len(curveline.rod_now("mock", files / "mine.toml", runs=files / "runs").stays) == 1


def test_a_clock_that_was_set_back_takes_no_time_away(files: Path, wait: Waits) -> None:
    sent(files, VALLEY)
    wait(-DAY)
    assert sent(files, PEAK) == ("peak",)
    with display_of(files) as session:
        assert [stay.seconds for stay in session.rod().stays] == [0.0, pytest.approx(0.0, abs=30.0)]


def test_a_display_that_says_nothing_of_a_set_is_sent_as_before(
    tmp_path: Path, wait: Waits, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(rod_now, "rod_now", lambda *_: pytest.fail("nobody asked for the set"))
        for shape in ("level-up-valley", curveline.plan("level-asymmetric-peak", begin="level-up-valley")):
            with curveline.connect("mock", runs=tmp_path) as session:
                session.send(shape)
            wait(8 * HOUR)
    rod = curveline.rod_now("mock", "single", runs=tmp_path)
    assert rod.past.is_estimate
    assert [stay.shape for stay in rod.stays] == ["level-up-valley", "level-asymmetric-peak"]


def test_a_plan_may_take_the_rod_as_it_is(files: Path, wait: Waits, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CURVELINE_RUNS", str(files / "runs"))
    asked = ["plan", str(files / STEEP), "--as-is", "mock"]
    assert CliRunner().invoke(app, asked).exit_code == 0
    sent(files, VALLEY)
    wait(HOUR)
    refused = CliRunner().invoke(app, asked)
    assert (refused.exit_code, refused.stdout) == (1, "")
    assert isinstance(refused.exception, Infeasible)
    assert "hold it at home for 10min" in refused.exception.hint
    for odd in ([*asked, "--after", "home@1h"], [*asked[:-1], "nowhere"]):
        assert isinstance(CliRunner().invoke(app, odd).exception, InvalidInput)


def test_the_command_says_what_there_is(files: Path, wait: Waits) -> None:
    where = ["--radio", "mock", "--display", str(files / "mine.toml"), "--runs", str(files / "runs")]
    assert "its rod remembers nothing" in CliRunner().invoke(app, ["rod", *where]).stdout
    sent(files, VALLEY)
    wait(8 * HOUR)
    text = CliRunner().invoke(app, ["rod", *where]).stdout
    assert re.search(r" 8(\.1)?h ", text)
    assert "level-up-valley" in text
    assert "the rod has a set of up to 2.9 1/m; held straight for 4d it lies flat to 1 mm" in " ".join(text.split())
    document = json.loads(CliRunner().invoke(app, ["rod", *where, "--json"]).stdout)
    assert document["set"]["largest_per_m"] == pytest.approx(2.9, abs=0.1)
    assert document["stays"][0]["held_s"] == pytest.approx(8 * HOUR, rel=1e-2)
    new = CliRunner().invoke(app, ["rod", *where, "--new"])
    assert "level-up-valley" in new.stdout
