"""Several displays in one run: to their shapes over bad air, under a limit of current, over two radios."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import curveline
from curveline.driving.lines import preparing_lines
from curveline.driving.lines.lines_result import LinesResult
from curveline.radio.host.journal import FILE_NAME, read_journal
from curveline.radio.host.link import Control, OperatorRequest
from curveline.radio.mock.display import MockRadio

from .lines_folder import hill_plan, lines_folder, quick_lines
from .test_lines_faults import Onlooker

LOSSY = "mock:loss=0.3,seed=7"
WANTED = ("peak",) * 4


@pytest.fixture
def radios(monkeypatch: pytest.MonkeyPatch) -> list[MockRadio]:
    """The modelled radios that are opened, one per line."""
    opened: list[MockRadio] = []
    original = preparing_lines.opened_together

    @contextmanager
    def spied(*arguments: Any) -> Iterator[Any]:
        with original(*arguments) as found:
            opened.extend(found)
            yield found

    monkeypatch.setattr(preparing_lines, "opened_together", spied)
    return opened


def moves_of(radio: MockRadio) -> list[tuple[int, int]]:
    """When anything of a display moved [ms]."""
    return sorted(span for station in radio._stations for span in station.plant.spans() if span[1] > span[0])


def most_at_once(radios: list[MockRadio]) -> int:
    """How many displays moved at the same time at most."""
    events = []
    for number, radio in enumerate(radios):
        for begin, end in moves_of(radio):
            events += [(begin, 1, number), (end, 0, number)]
    moving: list[int] = []
    most = 0
    for _, begins, number in sorted(events):
        moving.append(number) if begins else moving.remove(number)
        most = max(most, len(set(moving)))
    return most


def check_done(result: LinesResult, radios: list[MockRadio] | None = None) -> None:
    assert result.outcome == "done"
    assert result.is_wanted
    for line in result:
        assert line.run.playback is None or line.run.playback.states == WANTED[: len(line.run.plan.wanted)]
    for radio, line in zip(radios or [], result, strict=bool(radios)):
        for counts, target in zip(radio.positions(), line.run.plan.steps[-1].targets, strict=True):
            assert max(abs(a - b) for a, b in zip(counts, target.counts, strict=True)) <= 22


def test_eight_lines_of_five_nodes_end_in_their_shapes_over_bad_air(tmp_path: Path, radios: list[MockRadio]) -> None:
    result = curveline.send_lines(lines_folder(tmp_path / "roof", [LOSSY] * 8), runs=tmp_path / "runs")
    check_done(result, radios)
    assert [line.name for line in result] == [f"L{number}" for number in range(1, 9)]
    assert most_at_once(radios) == 8
    # All of them at once take hardly longer than one.
    assert result.seconds < 1.3 * hill_plan().seconds
    records = read_journal(result.folder / FILE_NAME)
    assert records[0]["type"] == "lines"
    for number in range(1, 9):
        own = [record for record in records if record.get("line") == number]
        steps = [record["step"] for record in own if record["type"] == "release"]
        assert steps == list(range(1, 15))
        assert own[-1]["type"] == "end"


@pytest.mark.parametrize("spec", [[LOSSY] * 8, [LOSSY] * 4 + ["mock:loss=0.3,seed=8"] * 4])
def test_under_a_limit_of_current_no_more_lines_move_than_it_allows(
    spec: list[str], tmp_path: Path, radios: list[MockRadio]
) -> None:
    folder = lines_folder(tmp_path / "roof", spec, currents=[1.2] * 8, limit=3.7)
    check_done(curveline.send_lines(folder, runs=tmp_path / "runs"), radios)
    assert most_at_once(radios) == 3


def test_a_waiting_line_stands_still_with_all_its_motors_until_its_turn(
    tmp_path: Path, radios: list[MockRadio]
) -> None:
    folder = lines_folder(tmp_path / "roof", [LOSSY] * 3, plans=3, currents=[1.0, 1.0, 2.0], limit=2.0)
    check_done(curveline.send_lines(folder, runs=tmp_path / "runs"), radios)
    # The two small ones may move together, the large one only alone, and it is not passed over for ever.
    assert most_at_once(radios[:2]) == 2
    assert most_at_once([radios[0], radios[2]]) == most_at_once(radios[1:]) == 1


def test_lines_behind_two_radios_end_in_their_shapes(tmp_path: Path, radios: list[MockRadio]) -> None:
    folder = lines_folder(tmp_path / "roof", [LOSSY, "mock:loss=0.3,seed=8"] * 2)
    result = curveline.send_lines(folder, runs=tmp_path / "runs")
    check_done(result, radios)
    assert radios[0]._chip is radios[1]._chip is not radios[2]._chip
    assert most_at_once(radios) == 4


def test_a_line_that_goes_on_in_the_midst_of_a_step_moves_before_any_other_may(
    tmp_path: Path, radios: list[MockRadio]
) -> None:
    control = Control()
    folder = quick_lines(tmp_path / "roof", ["mock"] * 3, [3] * 3, seconds=2.0, currents=[1.0] * 3, limit=1.0)
    hold = Onlooker("L2", 2, lambda: control.ask(OperatorRequest.HOLD))
    held = curveline.send_lines(folder, runs=tmp_path / "runs", control=control, listener=hold)
    # One is in the midst of a step, the others wait for their next ones.
    assert [any(node.started > node.finished for node in line.run.report.nodes) for line in held].count(True) == 1
    radios.clear()
    assert curveline.resume_lines(held.folder, runs=tmp_path / "runs").outcome == "done"
    assert most_at_once(radios) == 1
