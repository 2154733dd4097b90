"""What becomes of the other lines when one fails, when an operator asks for something, when a radio goes away."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

import curveline
from curveline.driving.lines.interrupted_lines import find_interrupted_lines
from curveline.driving.lines.lines_result import LinesHalted, LinesResult
from curveline.driving.lines.preparing_lines import LinesSite, prepared_rest
from curveline.driving.run_listener import LineObserver, RunListener
from curveline.driving.runs import RunEnding, read_run
from curveline.errors import InvalidInput, LinkError
from curveline.plan_file import Plan
from curveline.radio.host.actions import Phase
from curveline.radio.host.journal import FILE_NAME, read_journal
from curveline.radio.host.link import Control, OperatorRequest, Progress
from curveline.radio.mock.store import Store

from .lines_folder import quick_lines

GOOD = "mock:loss=0.2"


class Onlooker(RunListener):
    """Hears of all lines, and does something at some news, once."""

    def __init__(self, line: str = "", step: int = 0, act: Callable[[], object] = lambda: None) -> None:
        self.heard: list[tuple[str, Progress]] = []
        self.notes: list[str] = []
        self._when = (line, step)
        self._act: Callable[[], object] | None = act

    def note(self, text: str) -> None:
        """See Listener."""
        self.notes.append(text)

    @contextmanager
    def sending_lines(self, plans: Mapping[str, Plan], control: Control) -> Iterator[LineObserver]:
        """See RunListener."""

        def heard(line: str, news: Progress) -> None:
            self.heard.append((line, news))
            if self._act is not None and (line, news.step) == self._when and news.phase is Phase.RELEASED:
                act, self._act = self._act, None
                act()

        yield heard


def halted(folder: Path, runs: Path, **how: object) -> LinesHalted:
    """How a send was halted."""
    with pytest.raises(LinesHalted) as caught:
        curveline.send_lines(folder, runs=runs, **how)  # type: ignore[arg-type]
    return caught.value


def outcomes(result: LinesResult) -> list[str]:
    return [line.outcome for line in result]


def steps_done(result: LinesResult) -> list[int]:
    return [line.run.report.steps_done for line in result]


def test_a_fault_halts_its_line_and_the_others_hold_at_their_barriers(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", [GOOD, GOOD, "mock:stall=2@step2"], [6, 6, 6], seconds=0.5)
    error = halted(folder, tmp_path / "runs")
    assert (error.code, error.cause, error.node, error.line) == ("halted", "stall", 2, "L3")
    assert error.message.startswith("line L3: node 2 has stalled in step 2")
    assert outcomes(error.result) == ["paused", "paused", "halted"]
    assert steps_done(error.result)[2] == 1
    for line in error.result.lines[:2]:
        # At a barrier: what was begun is done.
        assert all(node.finished == node.started for node in line.run.report.nodes)
        assert 1 <= line.run.report.steps_done < 6
    run = read_run(error.result.folder)
    assert run.ending is RunEnding.HALTED
    assert run.can_resume
    assert "line L3: node 2 has stalled" in run.ended
    result = curveline.resume_lines(error.result.folder, runs=tmp_path / "runs")
    assert outcomes(result) == ["done"] * 3
    assert steps_done(result) == [6, 6, 6]


def test_lines_that_are_done_stay_done(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", [GOOD, GOOD, "mock:stall=1@step5"], [1, 6, 6])
    error = halted(folder, tmp_path / "runs")
    assert outcomes(error.result) == ["done", "paused", "halted"]
    opened = []
    original = Store.open
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "open", lambda store: [opened.append(store.path.name), original(store)][1])
        result = curveline.resume_lines(error.result.folder, runs=tmp_path / "runs")
    assert opened == ["mock-line-2.json", "mock-line-3.json"]
    assert outcomes(result) == ["done"] * 3
    assert steps_done(result) == [1, 6, 6]
    with pytest.raises(InvalidInput, match="all lines have been done"):
        curveline.resume_lines(error.result.folder, runs=tmp_path / "runs")


@pytest.mark.parametrize("fault", ["unhomed=2", "estop=1", "version=1", "busy=1", "chip=2"])
def test_where_one_line_cannot_begin_none_moves(fault: str, tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", [GOOD, f"mock:{fault}", GOOD])
    with pytest.raises(LinkError, match="line L2: node"):
        curveline.send_lines(folder, runs=tmp_path / "runs")
    for state in (tmp_path / "runs").glob("mock-*.json"):
        assert '"counts": [0, 0, 0]' in state.read_text()
        assert '"counts": [1' not in state.read_text()
    # Nothing is in the way of another try.
    again = curveline.send_lines(folder, "mock:fresh", runs=tmp_path / "runs")
    assert outcomes(again) == ["done"] * 3


def test_a_line_that_is_refused_by_its_nodes_when_all_are_taken_over_moves_no_other(tmp_path: Path) -> None:
    # Its nodes answer questions, but belong to another host as soon as they are to be taken.
    folder = quick_lines(tmp_path / "roof", [GOOD, "mock:busy=1", GOOD])
    error = halted(folder, tmp_path / "runs")
    assert (error.line, error.cause) == ("L2", "busy")
    assert outcomes(error.result) == ["halted"] * 3
    others = [line.error for line in error.result if line.name != "L2"]
    assert [each.cause for each in others if isinstance(each, LinkError)] == ["others"] * 2
    kinds = [record["type"] for record in read_journal(error.result.folder / FILE_NAME)]
    assert "start" not in kinds
    assert "release" not in kinds
    assert read_run(error.result.folder).ending is RunEnding.NOT_BEGUN
    with pytest.raises(InvalidInput, match="nothing to resume"):
        curveline.resume_lines(error.result.folder, runs=tmp_path / "runs")


@pytest.mark.parametrize("request_", [OperatorRequest.PAUSE, OperatorRequest.HOLD])
def test_what_an_operator_asks_for_is_asked_of_every_line(request_: OperatorRequest, tmp_path: Path) -> None:
    control = Control()
    folder = quick_lines(tmp_path / "roof", [GOOD, GOOD, "mock:seed=3"], [4, 4, 4], seconds=1.0)
    onlooker = Onlooker("L2", 2, lambda: control.ask(request_))
    result = curveline.send_lines(folder, runs=tmp_path / "runs", control=control, listener=onlooker)
    assert outcomes(result) == ["paused"] * 3
    assert result.is_interrupted
    nodes = [node for line in result for node in line.run.report.nodes]
    assert {node.state for node in nodes} == {"hold"}
    assert any(node.started > node.finished for node in nodes) == (request_ is OperatorRequest.HOLD)
    again = curveline.resume_lines(result.folder, runs=tmp_path / "runs")
    assert outcomes(again) == ["done"] * 3


def test_an_emergency_stop_stops_every_line_that_is_not_done(tmp_path: Path) -> None:
    control = Control()
    folder = quick_lines(tmp_path / "roof", [GOOD, GOOD, "mock:seed=3"], [1, 4, 4])
    error = halted(folder, tmp_path / "runs", control=control, listener=Onlooker("L2", 3, lambda: control.ask(3)))  # type: ignore[arg-type]
    assert error.cause == "estop"
    assert outcomes(error.result) == ["done", "halted", "halted"]
    states = [{node.state for node in line.run.report.nodes} for line in error.result]
    assert states == [{"ready"}, {"estop"}, {"estop"}]


def test_an_emergency_stop_reaches_lines_that_hold_already(tmp_path: Path) -> None:
    control = Control()
    folder = quick_lines(tmp_path / "roof", [GOOD, GOOD], [4, 4], seconds=2.0, currents=[1, 1], limit=1.0)

    class Impatient(Onlooker):
        @contextmanager
        def sending_lines(self, plans: Mapping[str, Plan], control: Control) -> Iterator[LineObserver]:
            def heard(line: str, news: Progress) -> None:
                # One line moves, the other, which waits for its turn, holds as soon as a pause is asked for.
                if news.phase is Phase.RELEASED and news.step == 2:
                    control.ask(OperatorRequest.PAUSE)
                if news.phase is Phase.PAUSED:
                    control.ask(OperatorRequest.ESTOP)

            yield heard

    error = halted(folder, tmp_path / "runs", control=control, listener=Impatient())
    assert {node.state for line in error.result for node in line.run.report.nodes} == {"estop"}


def test_a_radio_that_is_gone_for_good_ends_its_lines_and_the_others_hold(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", [GOOD, "mock:gone@step2", GOOD, "mock:gone@step2"], [6] * 4, seconds=0.5)
    error = halted(folder, tmp_path / "runs")
    assert error.code == "radio-gone"
    assert error.line in ("L2", "L4")
    assert outcomes(error.result) == ["paused", "halted", "paused", "halted"]
    # Another radio takes the place of both, and each line goes on from where it stands.
    assert outcomes(curveline.resume_lines(error.result.folder, "mock", runs=tmp_path / "runs")) == ["done"] * 4


def test_a_display_that_was_new_when_a_run_began_is_not_new_again_when_it_goes_on(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock:fresh", "mock:fresh,stall=1@step2,repower"], [4] * 2)
    error = halted(folder, tmp_path / "runs")
    result = curveline.resume_lines(error.result.folder, runs=tmp_path / "runs")
    assert outcomes(result) == ["done"] * 2
    assert [line.run.spec for line in result] == ["mock", "mock:stall=1@step2"]


def test_a_radio_that_comes_back_goes_on_with_its_lines(tmp_path: Path) -> None:
    onlooker = Onlooker()
    control = Control(tell=onlooker.note)
    folder = quick_lines(tmp_path / "roof", [GOOD, "mock:replug@step2", GOOD, "mock:replug@step2"], [4] * 4)
    result = curveline.send_lines(folder, runs=tmp_path / "runs", control=control, listener=onlooker)
    assert outcomes(result) == ["done"] * 4
    told = [note for note in onlooker.notes if note.startswith("lines L2 and L4: ")]
    assert told[0].endswith("waiting for it to come back")
    assert told[1:] == ["lines L2 and L4: the radio is back"]


def test_a_line_that_waits_for_its_turn_behind_a_radio_that_is_away_is_passed_over(tmp_path: Path) -> None:
    # While the first line moves, the third waits behind the same radio, and is the next when that goes away.
    radios = ["mock:replug@step2", "mock", "mock:replug@step2"]
    folder = quick_lines(tmp_path / "roof", radios, [3, 6, 3], seconds=0.4, currents=[1.0] * 3, limit=2.0)
    result = curveline.send_lines(folder, runs=tmp_path / "runs")
    assert outcomes(result) == ["done"] * 3
    # Away for 2.5 s, in which the second one does most of its steps.
    assert result[1].run.report.seconds < 4.0 < result[0].run.report.seconds


def test_nodes_that_restarted_keep_their_line_from_going_on_and_no_other(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", [GOOD, "mock:stall=1@step2", GOOD], [4] * 3, seconds=0.5)
    error = halted(folder, tmp_path / "runs")
    with curveline.connect("mock:repower", folder / "display-3.toml", runs=tmp_path / "runs") as session:
        session.status()
    onlooker = Onlooker()
    result = curveline.resume_lines(error.result.folder, runs=tmp_path / "runs", listener=onlooker)
    assert outcomes(result) == ["done", "done", "halted"]
    assert "restarted" in str(result[2].error)
    assert not result.is_wanted
    assert any("line L3 does not go on: node 1 has restarted" in note for note in onlooker.notes)


def test_two_hosts_cannot_go_on_with_one_run(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", [GOOD, "mock:stall=1@step2"], [4] * 2)
    run = halted(folder, tmp_path / "runs").result.folder
    broken = find_interrupted_lines(str(run), tmp_path / "runs")
    assert broken is not None
    with (
        prepared_rest(broken, LinesSite(tmp_path / "runs", RunListener())),
        pytest.raises(LinkError, match="another process is sending"),
    ):
        curveline.resume_lines(run, runs=tmp_path / "runs")
