"""What lines have of each other: fair turns on a shared radio, requests, records; and what a program does to them."""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

import curveline
from campaign import only
from curveline.driving.lines.lines_result import LinesHalted
from curveline.driving.run_listener import LineObserver, RunListener
from curveline.driving.runs import RunEnding, read_run, read_runs
from curveline.errors import CurvelineError, InvalidInput
from curveline.plan_file import Plan, read_plan, sealed, write_plan
from curveline.radio.host.actions import Phase
from curveline.radio.host.journal import FILE_NAME, encode_record, read_journal
from curveline.radio.host.link import Control, OperatorRequest, Progress
from curveline.radio.host.rota import Rota

from .lines_folder import display_file, lines_folder, made, quick_lines
from .test_lines_faults import Onlooker, halted, outcomes

SLOW = "250kbps"


# Turns


def test_a_rota_lets_lines_move_in_the_order_in_which_they_asked() -> None:
    rota = Rota([1.0, 2.0, 1.0], 2.0)
    assert rota.may_move(0)
    assert not rota.may_move(1)
    # There would be room for the last one, but the one before would be passed over for ever.
    assert not rota.may_move(2)
    assert rota.may_move(0)
    rota.note(0, Phase.STAGING, is_midway=False)
    assert not rota.may_move(2)
    assert rota.may_move(1)
    rota.note(1, Phase.RELEASED, is_midway=True)
    assert not rota.may_move(2)
    rota.note(1, Phase.HALTED, is_midway=True)
    assert rota.may_move(2)


def test_a_line_that_holds_or_cannot_ask_loses_its_place_in_the_row() -> None:
    rota = Rota([1.0] * 3, 1.0)
    assert rota.may_move(0)
    assert not rota.may_move(1)
    assert not rota.may_move(2)
    rota.note(1, Phase.PAUSING, is_midway=False)
    rota.note(0, Phase.STAGING, is_midway=False)
    assert rota.may_move(2)
    assert not rota.may_move(0)
    assert not rota.may_move(1)
    rota.pass_over(0)
    rota.note(2, Phase.STAGING, is_midway=False)
    assert rota.may_move(1)


def test_lines_that_go_on_in_the_midst_of_a_step_have_their_current_from_the_beginning() -> None:
    rota = Rota([1.0] * 3, 2.0, midway=[1, 2])
    rota.note(1, Phase.DISCOVER, is_midway=False)
    assert not rota.may_move(0)
    rota.note(1, Phase.RELEASED, is_midway=True)
    assert not rota.may_move(0)
    rota.note(1, Phase.STAGING, is_midway=False)
    assert rota.may_move(0)


def test_a_limit_that_is_a_sum_of_tenths_is_not_missed_by_rounding() -> None:
    rota = Rota([0.1] * 3, 0.3)
    assert all(rota.may_move(line) for line in range(3))


def test_no_line_begins_before_all_are_fit_to() -> None:
    rota = Rota([0.0] * 2, None)
    assert not rota.of(0).may_begin()
    assert rota.of(1).may_begin()
    assert rota.of(0).may_begin()


# A shared radio


def slow_lines(folder: Path, count: int, nodes: int) -> Path:
    """So many lines of so many nodes behind one radio, over bad air and at the lowest rate."""
    quick_lines(folder, ["mock:loss=0.3,seed=5"] * count, [3] * count, nodes=nodes)
    for line in range(1, count + 1):
        path = folder / f"line-{line}.json"
        plan = read_plan(path)
        write_plan(sealed(replace(plan, drive=replace(plan.drive, data_rate=SLOW))), path, force=True)
    return folder


@pytest.mark.parametrize(("count", "nodes"), [(12, 6), (16, 8)])
def test_a_slow_radio_with_many_nodes_keeps_all_of_them_going(count: int, nodes: int, tmp_path: Path) -> None:
    result = curveline.send_lines(slow_lines(tmp_path / "roof", count, nodes), runs=tmp_path / "runs")
    assert outcomes(result) == ["done"] * count
    polls = [node.link.polls for line in result for node in line.run.report.nodes]
    assert max(polls) < 1.5 * min(polls)


def test_more_nodes_than_a_radio_can_ask_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"put 129 nodes behind one radio, .* which can ask 128 of them") as caught:
        curveline.send_lines(slow_lines(tmp_path / "roof", 3, 43), runs=tmp_path / "runs")
    assert "another radio" in caught.value.hint
    assert not (tmp_path / "runs").exists()


def test_a_line_that_falls_silent_does_not_keep_the_others_from_their_turns(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock:jam@step2,loss=0.2"] * 6, [40] * 6, nodes=5)
    error = halted(folder, tmp_path / "runs")
    assert (error.line, error.cause) == ("L1", "deaf")
    assert outcomes(error.result) == ["halted", *["paused"] * 5]
    # While it was sought for 6 s, nobody's dead-man time ran out, and they went on.
    assert all(line.run.report.steps_done > 10 for line in error.result.lines[1:])


# Requests


def test_a_program_may_pause_lines_and_go_on(tmp_path: Path) -> None:
    control = Control(waits=True)

    class Patient(RunListener):
        @contextmanager
        def sending_lines(self, plans: Mapping[str, Plan], control: Control) -> Iterator[LineObserver]:
            resting: set[str] = set()

            def heard(line: str, news: Progress) -> None:
                if news.step == 2 and not resting and news.phase is Phase.RELEASED:
                    control.ask(OperatorRequest.PAUSE)
                if news.phase is Phase.PAUSED:
                    resting.add(line)
                    if len(resting) == 3:
                        control.resume()

            yield heard
            assert len(resting) == 3

    folder = quick_lines(tmp_path / "roof", ["mock", "mock", "mock:seed=2"], [4] * 3)
    result = curveline.send_lines(folder, runs=tmp_path / "runs", control=control, listener=Patient())
    assert outcomes(result) == ["done"] * 3
    kinds = [record["type"] for record in read_journal(result.folder / FILE_NAME)]
    assert kinds.count("pause") == 3
    assert kinds.count("resume") == 0


def test_a_program_that_would_go_on_does_not_as_long_as_a_line_is_at_fault(tmp_path: Path) -> None:
    control = Control(waits=True)

    class Hasty(RunListener):
        @contextmanager
        def sending_lines(self, plans: Mapping[str, Plan], control: Control) -> Iterator[LineObserver]:
            yield lambda line, news: control.resume()

    folder = quick_lines(tmp_path / "roof", ["mock", "mock:stall=1@step2"], [40] * 2, seconds=0.2)
    error = halted(folder, tmp_path / "runs", control=control, listener=Hasty())
    assert outcomes(error.result) == ["paused", "halted"]
    assert error.result[0].run.report.steps_done < 40


def test_an_observer_that_fails_ends_all_lines_and_they_can_go_on(tmp_path: Path) -> None:
    def fail() -> None:
        raise ZeroDivisionError

    folder = quick_lines(tmp_path / "roof", ["mock", "mock:realtime"], [3] * 2)
    with pytest.raises(ZeroDivisionError):
        curveline.send_lines(folder, runs=tmp_path / "runs", listener=Onlooker("L1", 2, fail))
    (run,) = read_runs(tmp_path / "runs")
    assert run.can_resume
    assert outcomes(curveline.resume_lines(run.folder, "mock", runs=tmp_path / "runs")) == ["done"] * 2


@pytest.mark.parametrize("radios", [["mock:realtime"] * 2, ["mock:realtime", "mock:realtime,seed=1"]])
def test_an_interrupt_of_a_program_holds_all_lines(radios: list[str], tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", radios, [3] * 2, seconds=5.0)
    interrupt = threading.Timer(0.1, signal.raise_signal, [signal.SIGINT])
    onlooker = Onlooker("L1", 1, interrupt.start)
    result = curveline.send_lines(folder, runs=tmp_path / "runs", listener=onlooker)
    assert outcomes(result) == ["paused"] * 2
    assert result.request is OperatorRequest.HOLD


# Records


def test_what_the_runs_say_of_a_rod_they_say_of_that_of_a_line(tmp_path: Path) -> None:
    folder = made(tmp_path / "roof")
    for line in (1, 2):
        display = display_file(folder, line, 3)
        display.write_text(display.read_text().replace("[rod]", "[rod]\nset_strength = 1.0"))
    lines_folder(folder, ["mock"] * 2, plans=3)
    result = curveline.send_lines(folder, runs=tmp_path / "runs")
    assert result.is_wanted
    rod = curveline.rod_now("mock", folder / "display-2.toml", runs=tmp_path / "runs")
    (stay,) = rod.stays
    assert (stay.run, stay.shape, stay.is_known) == (result.folder.name, "hill-2", True)


def test_what_a_line_shows_is_known_by_its_last_run(tmp_path: Path) -> None:
    folder = lines_folder(tmp_path / "roof", ["mock"] * 2, plans=3)
    result = curveline.send_lines(folder, runs=tmp_path / "runs")
    state = tmp_path / "runs" / "mock-line-2.json"
    # As behind a real radio, where nobody remembers the rod.
    state.write_text(json.dumps({**json.loads(state.read_text()), "rod": [], "rod_at": []}))
    onlooker = Onlooker()
    with curveline.connect("mock", folder / "display-2.toml", runs=tmp_path / "runs", listener=onlooker) as session:
        session.plan(home=True)
    assert f"the display shows: 2 x peak (run {result.folder.name})" in onlooker.notes


def test_a_run_of_lines_is_no_run_of_one_display(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock", "mock:stall=1@step2"], [3] * 2)
    run = halted(folder, tmp_path / "runs").result.folder
    with (
        curveline.connect("mock", folder / "display-1.toml", runs=tmp_path / "runs") as session,
        pytest.raises(InvalidInput, match="is one of several lines") as caught,
    ):
        session.resume("last")
    assert "resume_lines" in caught.value.hint
    result = curveline.resume_lines(run, runs=tmp_path / "runs")
    assert outcomes(result) == ["done"] * 2
    with curveline.connect("mock", folder / "display-1.toml", runs=tmp_path / "runs") as session:
        session.home()
    single = next(read_runs(tmp_path / "runs"))
    with pytest.raises(InvalidInput, match="this run is of one display"):
        curveline.resume_lines(single.folder, runs=tmp_path / "runs")


def test_runs_may_lie_in_a_folder_that_is_called_lines(tmp_path: Path) -> None:
    folder, runs = quick_lines(tmp_path / "roof", ["mock"]), tmp_path / "lines"
    result = curveline.send_lines(folder, runs=runs)
    result.folder.rename(runs / "7")
    with curveline.connect("mock", folder / "display-1.toml", runs=runs) as session:
        session.home()
        assert [run.ending for run in session.runs()] == [RunEnding.DONE] * 2


def record_of(run: Path) -> list[dict[str, object]]:
    return [dict(each) for each in read_journal(run / FILE_NAME)]


def rewritten(run: Path, records: list[dict[str, object]]) -> None:
    lines = b"".join(encode_record(number, record) for number, record in enumerate(records))
    (run / FILE_NAME).write_bytes(lines)


@pytest.fixture
def broken(tmp_path: Path) -> Path:
    """A run of two lines that was broken off."""
    folder = quick_lines(tmp_path / "roof", ["mock", "mock:stall=1@step2"], [3, 3], currents=[1.0, 1.0], limit=2.0)
    return halted(folder, tmp_path / "runs").result.folder


HEADERS: list[dict[str, object]] = [
    {"lines": None},
    {"lines": []},
    {"lines": [None, 3]},
    {"lines": [{"name": "a"}, {"name": "b"}]},
    {"lines": [{}] * 65},
    {"current_limit_A": "much"},
    {"current_limit_A": 0.5},
    {"current_limit_A": -1},
    {"name": None, "lines": [{"name": "a\x07", "radio": "mock"}] * 2},
]


@pytest.mark.parametrize("change", HEADERS)
def test_a_record_whose_head_cannot_be_believed_is_refused(change: dict[str, object], broken: Path) -> None:
    records = record_of(broken)
    rewritten(broken, [{**records[0], **change}, *records[1:]])
    with pytest.raises(InvalidInput) as caught:
        curveline.resume_lines(broken, runs=broken.parent)
    assert caught.value.message.startswith(f"run {broken.name}: ")
    run = read_run(broken)
    json.dumps(run.document())
    json.dumps(curveline.log(broken).document())


def test_plans_that_were_exchanged_are_not_gone_on_with(broken: Path) -> None:
    one, other = (broken / "lines" / number / "plan.json" for number in "12")
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)
    with pytest.raises(InvalidInput, match="not of the plans that are kept beside it"):
        curveline.resume_lines(broken, runs=broken.parent)


@pytest.mark.parametrize("seed", [*range(25), *only(range(25, 500))])
def test_a_record_in_any_disorder_moves_nothing_or_ends_well(seed: int, broken: Path) -> None:
    random, records = Random(seed), record_of(broken)
    for _ in range(random.randint(1, 3)):
        place = random.randrange(1, len(records))
        match random.randrange(5):
            case 0:
                del records[place]
            case 1:
                records.insert(place, random.choice(records))
            case 2:
                records[place]["line"] = random.choice([0, 1, 2, 3, True, "1", None, 1.0])
            case 3:
                records[place]["step"] = random.choice([0, 1, 2, 3, 9, "x", None])
            case _:
                records[place]["type"] = random.choice(["start", "release", "barrier", "halt", "end", "lines", 7])
    rewritten(broken, records)
    json.dumps([run.document() for run in read_runs(broken.parent)])
    json.dumps(curveline.log(broken).document())
    try:
        result = curveline.resume_lines(broken, runs=broken.parent)
    except (CurvelineError, LinesHalted):
        return
    # What is told as done is where it is to be.
    for number, line in enumerate(result, start=1):
        if line.outcome == "done" and line.run.report.nodes:
            state = json.loads((broken.parent / f"mock-line-{number}.json").read_text())
            goal = [list(target.counts) for target in line.run.plan.steps[-1].targets]
            assert [node["counts"] for node in state["nodes"]] == goal
