"""What the commands do, from Python: every public name, on the shapes of the paper and a modelled display."""

from __future__ import annotations

import csv
import json
import sys
import traceback
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numpy as np
import pytest

import curveline
from curveline.driving.session import Session
from curveline.errors import Infeasible, InvalidInput, LinkError, MissingExtra
from curveline.kernels import readiness
from curveline.listening import Listener
from curveline.radio.host.link import Control, OperatorRequest
from driving.lines_folder import quick_lines

SHAPES = Path(__file__).parents[1] / "shapes"
PEAK, VALLEY = SHAPES / "level-up-peak.toml", SHAPES / "level-up-valley.toml"


class Told(curveline.RunListener):
    """Keeps what it hears."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        """See Listener."""
        self.notes.append(text)


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return curveline.connect("mock", "single", runs=tmp_path, listener=Told())


def test_every_public_name_is_shown_and_says_what_it_is() -> None:
    assert set(dir(curveline)) == set(curveline.__all__)
    for name in curveline.__all__:
        if name != "__version__":
            assert getattr(curveline, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'simulated'"):
        curveline.simulated  # noqa: B018


def test_a_shape_is_simulated_and_kept(tmp_path: Path) -> None:
    report = curveline.simulate(PEAK)
    (segment,) = report
    assert [state.name for state in segment.states] == ["peak", "valley"]
    assert len(report) == 1
    assert report[0] is segment
    curveline.write(report, tmp_path / "one.json")
    curveline.write([report, curveline.simulate(curveline.read_shape(VALLEY))], tmp_path / "two.csv")
    assert json.loads((tmp_path / "one.json").read_text())["shape"] == "level-up-peak"
    assert "level-up-valley" in (tmp_path / "two.csv").read_text()
    with pytest.raises(InvalidInput, match="a dict is kept in no file"):
        curveline.write({}, tmp_path / "x.json")


def test_a_sweep_has_a_row_for_every_state_and_tells_what_failed() -> None:
    heard: list[int] = []

    class Counting(Listener):
        def progress(self, what: str, total: int | None) -> Any:
            from contextlib import nullcontext

            return nullcontext(heard.append)

    report = curveline.sweep(PEAK, {"nodes.1.angle_deg": (0.0, 30.0, 3)}, listener=Counting())
    assert heard[-1] == 3
    assert [row["nodes.1.angle_deg"] for row in report.rows if row["state"] == "peak"] == [0.0, 15.0, 30.0]
    assert (report.tally.good, report.failed) == (3, {})
    with pytest.raises(InvalidInput, match="there is no such number"):
        curveline.sweep(PEAK, {"nodes.9.angle_deg": (0.0, 1.0, 2)})


def test_a_range_takes_numbers_of_numpy_and_no_other_number_of_them() -> None:
    third = np.float64(1.0) / 3.0
    rows = curveline.sweep(PEAK, {"nodes.1.angle_deg": (np.float64(0.0), third, np.int64(2))}).rows
    assert {row["nodes.1.angle_deg"] for row in rows} == {0.0, third}
    for numbers in ((0.0, 1.0), (0.0, 1.0, 2, 3)):
        with pytest.raises(InvalidInput, match="is no range") as refused:
            curveline.sweep(PEAK, {"nodes.1.angle_deg": cast(Any, numbers)})
        assert "START:STOP:COUNT" in refused.value.hint


def test_plans_lead_through_shapes_from_what_is_shown_and_home(tmp_path: Path) -> None:
    plan = curveline.plan(PEAK, VALLEY, home=True)
    assert [step.shape for step in plan.steps if step.shape][:2] == ["level-up-peak", "level-up-valley"]
    assert plan.wanted == ("straight",)
    back = curveline.plan(begin=PEAK, home=True)
    assert back.shows == ("peak",)
    curveline.write(plan, tmp_path / "plan.json")
    assert curveline.read_plan(tmp_path / "plan.json") == plan
    with pytest.raises(InvalidInput, match="no shape to plan"):
        curveline.plan()
    with pytest.raises(InvalidInput, match="is a shape of display quad"):
        curveline.plan(PEAK, begin=SHAPES / "roofline.toml")


def test_a_plan_is_played_with_errors() -> None:
    trials = curveline.monte_carlo(curveline.plan(PEAK), curveline.TrialsRequest(runs=5, seed=3))
    assert (trials.share.count, trials.share.runs) == (5, 5)
    assert trials.document()["seed"] == 3


def test_a_shape_is_pushed() -> None:
    loading = curveline.load(PEAK, curveline.Push(at=0.4, step=4.0))
    assert loading.snap is not None
    assert loading.snap.force == pytest.approx(loading.rows[-1][0])
    found = curveline.load_map(PEAK, points=3)
    assert found.weakest is not None


def test_a_session_says_what_it_is(session: Session) -> None:
    assert repr(session) == "<session with display single over mock>"


def test_a_session_sends_goes_on_and_goes_home(session: Session, tmp_path: Path) -> None:
    with session:
        assert session.status().is_well
        result = session.send(PEAK)
        assert result.is_wanted
        assert curveline.status("mock", "single", runs=tmp_path / "elsewhere").rod == ()
        plan = session.plan(VALLEY)
        assert plan.shows == ("peak",)
        control = Control()
        control.ask(OperatorRequest.PAUSE)
        paused = session.send(plan, control=control)
        assert (paused.report.outcome, paused.is_interrupted) == ("paused", True)
        assert session.resume().is_wanted
        assert session.status().rod == ("valley",)
        assert session.home().plan.wanted == ("straight",)
        assert session.stop().is_sure
        endings = [run.ending.value for run in session.runs()]
    assert endings == ["done", "done", "done"]
    assert [run.name for run in curveline.runs(tmp_path)] == [run.name for run in session.runs()]
    assert any(note.startswith("the display shows: valley") for note in session.listener.notes)  # type: ignore[attr-defined]


def test_what_cannot_be_sent_is_refused_and_nothing_moves(session: Session, tmp_path: Path) -> None:
    with session:
        for what, message in (
            ((), "nothing to send"),
            ((3,), "neither a plan nor a shape: int"),
            (("x.txt",), "no such file"),
        ):
            with pytest.raises(InvalidInput, match=message):
                session.send(*what)
        plan = curveline.plan(PEAK)
        with pytest.raises(InvalidInput, match="a plan is taken by itself"):
            session.send(plan, VALLEY)
        session.send(PEAK)
        with pytest.raises(LinkError, match="node 1"):
            session.send(plan)
        with pytest.raises(InvalidInput, match="can go on"):
            session.resume()
        with pytest.raises(InvalidInput, match="no axis of a node: wheel"):
            session.node(1).home(["wheel"])
        assert session.node(1).status(session.node(1).report()).can_move
    far = Path(tmp_path / "far.toml")
    far.write_text(PEAK.read_text().replace("660.0", "1450.0"))
    with pytest.raises((Infeasible, InvalidInput)):
        curveline.plan(far)


def test_a_radio_is_given_back(session: Session, tmp_path: Path) -> None:
    session.status()
    with pytest.raises(LinkError, match="in use"):
        curveline.stop("mock", "single", runs=tmp_path)
    session.close()
    assert curveline.stop("mock", "single", runs=tmp_path).is_sure


def test_results_show_themselves_in_a_notebook(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    report, plan = curveline.simulate(PEAK), curveline.plan(PEAK)
    drawn = [report, plan, curveline.load(PEAK, curveline.Push(step=5.0)), curveline.load_map(PEAK, points=3)]
    with session:
        told = [session.status(), session.send(PEAK), curveline.monte_carlo(plan, curveline.TrialsRequest(runs=2))]
        told += [session.scan(), session.dry_run(VALLEY), session.stop(), report[0]]
    drawn.append(curveline.sweep(PEAK, {"nodes.1.angle_deg": (0.0, 30.0, 2)}))
    for result in drawn:
        assert "<svg" in result._repr_svg_()
        assert "<svg" in result._repr_html_()
    for result in (*drawn, *told):
        html = result._repr_html_()
        assert html.count("<tr>") > 1
        assert html.count("<tr>") == html.count("</tr>")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for result in drawn:
        assert result._repr_svg_() is None
        assert "<table>" in result._repr_html_()


class Handle:
    """A line in a notebook."""

    def __init__(self, shown: list[str]) -> None:
        self.shown = shown

    def update(self, bundle: dict[str, str], raw: bool) -> None:
        """Written over."""
        self.shown.append(bundle["text/plain"])


def test_progress_fits_a_notebook(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "IPython.display", None)
    with pytest.raises(MissingExtra, match="no notebook"):
        curveline.NotebookListener()
    shown: list[str] = []
    display = ModuleType("IPython.display")

    def show(bundle: dict[str, str], raw: bool, display_id: bool = False) -> Handle:
        shown.append(bundle["text/plain"])
        return Handle(shown)

    display.display = show  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    listener = curveline.NotebookListener()
    with curveline.connect("mock", "single", runs=tmp_path, listener=listener) as session:
        session.send(PEAK)
    assert any(line.startswith("planning, steps proven:") for line in shown)
    assert any("step 5 of 5" in line for line in shown)
    assert any(line.startswith("record: ") for line in shown)
    folder = quick_lines(tmp_path / "roof", ["mock", "mock:seed=1"])
    curveline.send_lines(folder, runs=tmp_path, listener=listener)
    assert "2 lines" in shown
    assert any(line.endswith("s  steps: L1 2, L2 2") for line in shown)


def test_everything_that_commands_keep_can_be_kept(tmp_path: Path) -> None:
    report = curveline.simulate(PEAK)
    curveline.write(report, tmp_path / "coarse.json", points=5)
    (segment,) = json.loads((tmp_path / "coarse.json").read_text())["segments"]
    assert len(segment["states"][0]["curve_mm"]) == 5
    swept = curveline.sweep(PEAK, {"nodes.1.angle_deg": (0.0, 30.0, 3), "nodes.2.angle_deg": (-30.0, 0.0, 2)})
    curveline.write(swept, tmp_path / "map.csv")
    with open(tmp_path / "map.csv") as file:
        rows = list(csv.DictReader(file))
    assert [row["state"] for row in rows] == [row["state"] for row in swept.rows]
    assert (rows[0]["wanted"], float(rows[0]["energy_mJ"])) == ("true", swept.rows[0]["energy_mJ"])
    curveline.write(swept, tmp_path / "map.svg")
    assert "nodes.2.angle" in (tmp_path / "map.svg").read_text()
    with pytest.raises(InvalidInput, match="exists"):
        curveline.write(swept, tmp_path / "map.csv")
    deep = curveline.sweep(
        PEAK, {f"nodes.{key}": (0.0, 0.01, 2) for key in ("1.angle_deg", "2.height_mm", "1.height_mm")}
    )
    assert deep._repr_svg_() is None
    with pytest.raises(InvalidInput, match="over one key or two"):
        curveline.write(deep, tmp_path / "deep.svg")


def test_a_shape_that_snaps_falls(tmp_path: Path) -> None:
    fall = curveline.fall(curveline.load(PEAK, curveline.Push(at=0.4, step=4.0)))
    assert fall.name == "valley"
    curveline.write(fall, tmp_path / "fall.svg")
    assert "<svg" in (tmp_path / "fall.svg").read_text()
    with pytest.raises(Infeasible, match="nothing snaps"):
        curveline.fall(curveline.load(PEAK, curveline.Push(at=0.4, step=0.5, most=1.0)))


def test_a_dry_run_is_planned_from_where_the_mock_stands_and_sends_nothing(session: Session) -> None:
    with session:
        session.send(PEAK)
        session.close()
        dry = session.dry_run(VALLEY)
        assert dry.plan.shows == ("peak",)
        assert {frame.step for frame in dry.frames} == {step.number for step in dry.plan.steps}
        assert len(list(session.runs())) == 1
        assert session.status().rod == ("peak",)
    (run,) = session.runs()
    entries = curveline.log(run)
    assert entries[0].what.startswith("begun")
    assert curveline.log(str(run.folder)) == entries
    assert curveline.log("last", session.folder) == curveline.log(run.name, session.folder) == entries
    with pytest.raises(InvalidInput, match="there is no run 'nowhere'"):
        curveline.log("nowhere")


def test_a_node_says_how_it_is_and_is_homed(session: Session) -> None:
    with session:
        node = session.node(1)
        assert node.status() == node.status(node.report())
        assert node.document()["node"]["state"] == "ready"
        assert node.status(node.home(["bias"])).can_move


def test_a_traceback_has_the_hint() -> None:
    with pytest.raises(InvalidInput) as caught:
        curveline.plan()
    assert "hint: name shapes" in "".join(traceback.format_exception(caught.value))


def test_who_listens_is_told_of_kernels_once(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    monkeypatch.setattr(readiness, "is_first_run", lambda: True)
    monkeypatch.setattr(curveline.NotebookListener, "note", lambda self, text: shown.append(text))
    monkeypatch.setitem(sys.modules, "IPython.display", ModuleType("IPython.display"))
    listener = curveline.NotebookListener()
    curveline.simulate(PEAK, listener=listener)
    curveline.simulate(PEAK, listener=listener)
    assert shown == ["compiling kernels, about half a minute, once"]


def test_a_radio_that_does_not_exist_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no radio 'mok'"):
        curveline.connect("mok", "single", runs=tmp_path)
