"""What could make a rod's history say what never was: clocks, runs that rest or are taken away, other radios, lies."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.driving.rod_now import _path, rod_now
from curveline.driving.rod_record import RodRecord
from curveline.errors import Infeasible, InvalidInput, LinkError
from curveline.shapes.files import read_display
from curveline.simulation.dwelling import scene_after
from curveline.units import DAY, HOUR

from .test_rod_now import PEAK, STEEP, VALLEY, Waits, display_of, files, sent, wait

__all__ = ["files", "wait"]
KEPT = "mock-rod-single.json"


def held(files: Path) -> list[tuple[str, float]]:
    """The shapes of the rod by their names, and for how many hours it was held in each."""
    with display_of(files) as session:
        return [(stay.shape, round(stay.seconds / HOUR, 1)) for stay in session.rod().stays]


def broken_off(files: Path) -> None:
    """Send two shapes, of which a motor lets only the first one be reached."""
    with display_of(files, "mock:stall=1@step6") as session, pytest.raises(LinkError):
        session.send(files / VALLEY, files / PEAK)


def test_a_run_that_rested_before_it_was_gone_on_with_held_the_rod_meanwhile(files: Path, wait: Waits) -> None:
    broken_off(files)
    wait(HOUR)
    with display_of(files) as session:
        session.resume()
    wait(2 * HOUR)
    both = "level-up-valley, level-up-peak"
    assert held(files) == [(both, 1.0), (both, 2.0)]
    with display_of(files) as session:
        rods = [session.rod()]
        session.send(files / VALLEY)
        rods.append(session.rod())
        # What is kept goes up to the begin of a run, and none of its rests counts twice.
        assert json.loads((files / "runs" / KEPT).read_text())["run"].startswith("000002-")
        rods.append(session.rod())
    sets = [rod.past.memory.set_curvature for rod in rods]
    # Within seconds in the valley the rod takes a little of that.
    assert np.abs(np.diff(sets, axis=0)).max() < 0.5
    history = f"{files / VALLEY}@1h,{files / PEAK}@2h"
    expected = scene_after(curveline.read_shape(files / PEAK), history, curveline.read_shape).past
    assert expected is not None
    assert np.abs(sets[0] - expected.memory.set_curvature).max() < 0.01


def test_what_is_left_of_a_run_is_gone_on_with_only_if_it_is_safe_for_the_rod_as_it_is(
    files: Path, wait: Waits
) -> None:
    with display_of(files, "mock:stall=1@step6") as session, pytest.raises(LinkError):
        session.send(files / VALLEY, files / STEEP)
    wait(4 * DAY)
    with display_of(files) as session, pytest.raises(Infeasible, match="with the set that the rod has now"):
        session.resume()


def test_a_dry_run_plans_for_the_rod_as_it_is(files: Path, wait: Waits) -> None:
    with display_of(files) as session:
        made = session.plan(files / STEEP)
    sent(files, VALLEY)
    wait(DAY)
    sent(files, "home")
    with display_of(files) as session:
        before = sorted(path.name for path in (files / "runs").iterdir())
        for wish in (files / STEEP, made):
            with pytest.raises(Infeasible):
                session.dry_run(wish)
        assert sorted(path.name for path in (files / "runs").iterdir()) == before


def test_runs_that_were_taken_away_take_what_was_kept_of_them_with_them(files: Path, wait: Waits) -> None:
    for shape in (VALLEY, "home", VALLEY):
        sent(files, shape)
        wait(8 * HOUR)
    with display_of(files) as session:
        session.rod()
    for run in (files / "runs").glob("0*"):
        shutil.rmtree(run)
    sent(files, "home")
    sent(files, PEAK)
    wait(8 * HOUR)
    assert held(files) == [("home", 0.0), ("level-up-peak", 8.0)]
    with display_of(files) as session:
        # A peak alone: nothing is left of valleys, and nothing hides it.
        assert session.rod().past.memory.set_curvature.min() < -1.0


def test_a_clock_that_was_ahead_or_behind_makes_no_shape_last_longer(files: Path, wait: Waits) -> None:
    sent(files, VALLEY)
    wait(5000 * DAY)
    sent(files, "home")
    wait(-5000 * DAY + HOUR)
    sent(files, PEAK)
    wait(-10000 * DAY)
    sent(files, "home")
    wait(10000 * DAY + HOUR)
    assert [hours for _, hours in held(files)] == [1.0, 0.0, 1.0, 1.0]


def test_a_new_rod_by_a_clock_that_was_ahead_is_bent_like_any_other(files: Path, wait: Waits) -> None:
    sent(files, "home")
    wait(5000 * DAY)
    with display_of(files) as session:
        session.new_rod()
    wait(-5000 * DAY)
    sent(files, VALLEY)
    wait(8 * HOUR)
    assert held(files)[-1] == ("level-up-valley", 8.0)
    with display_of(files) as session:
        assert session.rod().past.largest_set > 2.0


def test_what_is_kept_of_a_rod_is_of_one_display_and_one_radio(tmp_path: Path) -> None:
    display = read_display("single")
    names = ("single", "a b", "a_b", "a?b", "Anzeige ä", "Anzeige ö")
    displays = [replace(display, name=name) for name in names]
    specs = ("mock", "serial:/dev/ttyACM0", "serial:/dev/ttyACM1")
    paths = [_path(each, RodRecord(spec, tmp_path)) for each in displays for spec in specs]
    assert len(set(paths)) == len(paths)
    assert paths[0].name == KEPT
    assert all(path.name.isascii() and path.parent == tmp_path for path in paths)
    assert _path(display, RodRecord("mock:loss=0.3", tmp_path)) == paths[0]


LIES: list[Callable[[dict], None]] = [
    lambda told: told.update(run="000999-20990101-000000-never"),
    lambda told: told.update(run=10**9),
    lambda told: told.update(run="../../etc"),
    lambda told: told["memory"].update(bends_per_m=[[9e5] * len(row) for row in told["memory"]["bends_per_m"]]),
    lambda told: told["memory"].update(bends_per_m=[[1e300] * len(row) for row in told["memory"]["bends_per_m"]]),
    lambda told: told["memory"].update(total_length_mm=-2000.0),
]


def test_a_lie_beside_the_runs_is_not_believed(files: Path, wait: Waits) -> None:
    for shape in (VALLEY, "home"):
        sent(files, shape)
        wait(2 * HOUR)
    display, record = read_display(files / "mine.toml"), RodRecord("mock", files / "runs")
    now = curveline.rod_now("mock", files / "mine.toml", runs=files / "runs").stays[-1].end
    path = files / "runs" / KEPT
    truth, text = rod_now(display, record, now), path.read_text()
    for lie in LIES:
        told = json.loads(text)
        lie(told)
        path.write_text(json.dumps(told))
        found = rod_now(display, record, now)
        assert np.abs(found.past.memory.set_curvature - truth.past.memory.set_curvature).max() < 1e-3


def test_what_cannot_be_kept_is_told_of_where_that_matters_and_leaves_nothing_behind(files: Path, wait: Waits) -> None:
    for shape in (VALLEY, "home"):
        sent(files, shape)
        wait(HOUR)
    path = files / "runs" / KEPT
    path.unlink(missing_ok=True)
    path.mkdir()
    with display_of(files) as session:
        assert len(session.rod().stays) == 2
        with pytest.raises(InvalidInput):
            session.new_rod()
    assert not list((files / "runs").glob("*part*"))
