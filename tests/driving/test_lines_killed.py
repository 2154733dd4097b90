"""Runs of several lines whose host is killed, at every stage of the journal: every node does every step once.

A child process sends, or goes on, and kills itself before, in the midst of, or after the writing of a record. What the
nodes did is read from the states of their displays that took effect, over all processes together.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

import curveline
from campaign import only
from curveline.driving.known_states import shown_states
from curveline.driving.runs import RunEnding, read_runs
from curveline.radio.host.journal import FILE_NAME, read_journal
from curveline.radio.mock.store import MockState, Store

from .fatal import NEVER, POINTS, SIGKILLED, in_a_child, put_under_records
from .lines_folder import lines_folder, quick_lines


def host(folder: Path, runs: Path, fatal: int) -> None:
    """One process: go on with the run if there is one that can, or begin it."""
    save = Store.save

    def noted(store: Store, state: MockState) -> None:
        save(store, state)
        progress = [(node.memory.started, node.memory.finished) for node in state.nodes]
        with (runs / "log").open("a") as log:
            log.write(json.dumps([store.path.name, progress]) + "\n")

    Store.save = noted  # type: ignore[method-assign]
    put_under_records(fatal)
    run = next((each for each in read_runs(runs) if each.ending is not RunEnding.NOT_BEGUN), None)
    if run is None:
        curveline.send_lines(folder, runs=runs)
    elif run.ending is not RunEnding.DONE:
        curveline.resume_lines(run.folder, runs=runs)


def progress_of(runs: Path) -> Iterator[tuple[str, list[list[int]]]]:
    """What each display's nodes did in the end, state after state: (started, finished) of each."""
    states: dict[str, list[list[list[int]]]] = {}
    for line in (runs / "log").read_text().splitlines():
        name, progress = json.loads(line)
        states.setdefault(name, []).append(progress)
    for name, seen in states.items():
        for node in range(len(seen[0])):
            for which in (0, 1):
                values = [state[node][which] for state in seen]
                yield name, [now for before, now in pairwise([0, *values]) if now != before]


def check(runs: Path, steps: dict[str, int], told: str) -> None:
    """Every node of every line has begun and ended every step once and in order, and the record says so."""
    for name, done in progress_of(runs):
        assert done == list(range(1, steps[name] + 1)), (told, name)
    run = next(each for each in read_runs(runs) if each.ending is not RunEnding.NOT_BEGUN)
    assert run.ending is RunEnding.DONE, told
    assert [line.ending for line in run.lines] == [RunEnding.DONE] * len(steps)
    for number, count in enumerate(steps.values(), start=1):
        own = [each for each in read_journal(run.folder / FILE_NAME) if each.get("line") == number]
        releases = [each["step"] for each in own if each["type"] == "release"]
        assert sorted(set(releases)) == releases == list(range(1, count + 1)), told


def killed_at(folder: Path, runs: Path, fatal: list[int], steps: dict[str, int]) -> int:
    """Kill one host after the other at these points, then let the last one finish; how many were killed."""
    runs.mkdir()
    killed = 0
    for point in [*fatal, NEVER]:
        code = in_a_child(lambda point=point: host(folder, runs, point))  # type: ignore[misc]
        assert code in (0, SIGKILLED), fatal
        killed += code == SIGKILLED
    check(runs, steps, f"killed at {fatal}")
    return killed


def stages(counts: list[int]) -> int:
    """Points of a run without a kill: the record of all lines, and of each one a start, two per step and an end."""
    return POINTS * (1 + sum(2 + 2 * count for count in counts))


def quick_steps(counts: list[int]) -> dict[str, int]:
    """How many steps each display has, by the file of its state."""
    return {f"mock-line-{line}.json": count for line, count in enumerate(counts, start=1)}


@pytest.mark.parametrize("radios", [["mock", "mock"], ["mock:loss=0.3", "mock:loss=0.3,seed=1"]])
def test_a_kill_at_every_stage_of_the_journal_costs_no_step(radios: list[str], tmp_path: Path) -> None:
    folder, counts = quick_lines(tmp_path / "roof", radios, [1, 2]), [1, 2]
    points = stages(counts)
    for point in range(points):
        assert killed_at(folder, tmp_path / f"runs-{point}", [point], quick_steps(counts)) == 1
    assert killed_at(folder, tmp_path / "unbroken", [points], quick_steps(counts)) == 0


@pytest.mark.parametrize("stride", [5, *only([1])])
def test_hosts_that_go_on_may_be_killed_at_every_stage_too(stride: int, tmp_path: Path) -> None:
    # With a limit one line waits while the other moves, so that they are far apart when it happens.
    counts = [2, 2]
    folder = quick_lines(tmp_path / "roof", ["mock:loss=0.3"] * 2, counts, currents=[1.0, 1.0], limit=1.0)
    for first in range(4, stages(counts), stride):
        for second in range(0, stages(counts) - first, stride):
            killed_at(folder, tmp_path / f"runs-{first}-{second}", [first, second], quick_steps(counts))


@pytest.mark.parametrize("fatal", [[9, 61, 202, 118], *only([[point] for point in range(3, 482, 9)])])
def test_eight_lines_of_five_nodes_end_in_their_shapes_whenever_they_were_killed(
    fatal: list[int], tmp_path: Path
) -> None:
    folder = lines_folder(tmp_path / "roof", ["mock:loss=0.3,seed=7"] * 8, currents=[1.0] * 8, limit=5.0)
    runs = tmp_path / "runs"
    assert killed_at(folder, runs, fatal, quick_steps([14] * 8)) == len(fatal)
    for line in range(1, 9):
        with curveline.connect("mock", folder / f"display-{line}.toml", runs=runs) as session:
            # Nobody has told of a line that was done when its host was killed, but its nodes know their last run.
            shown = shown_states(session.radio, session.drive, session.status().nodes, runs)
        assert shown.states == ("peak",) * 4
