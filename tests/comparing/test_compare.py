"""Trials of shapes beside the model: which state they are in, what counts, what is said of the rest."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.cameras.outcomes import TrialOutcome
from curveline.comparing.agreement import CompareRequest, Comparison
from curveline.comparing.compare import compare
from curveline.comparing.reading import read_trials
from curveline.comparing.results import to_csv
from curveline.errors import InvalidInput
from curveline.scene import Segment
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import simulate
from curveline.trial import ShapeTrials, Trial, TrialCurve
from curveline.units import mm, to_mm
from made_trials import SIXTEEN, curve, write_table, write_trials

PEAK = "level-up-peak"


def trials(*curves: np.ndarray, shape: str = PEAK) -> tuple[ShapeTrials, ...]:
    found = tuple(Trial(str(n), TrialOutcome.SEEN, curves=(TrialCurve(points),)) for n, points in enumerate(curves, 1))
    return (ShapeTrials(read_shape(shape), found),)


def compared(*curves: np.ndarray, shape: str = PEAK, **asked: float) -> Comparison:
    return compare(trials(*curves, shape=shape), CompareRequest(**asked))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    path = tmp_path_factory.mktemp("trials")
    write_trials(path)
    return path


def test_a_folder_of_all_sixteen_shapes(folder: Path) -> None:
    found = curveline.compare(curveline.read_trials([folder]))
    assert [each.scene.name for each in found.shapes] == sorted(SIXTEEN)
    assert found.is_good
    assert len(found.agreeing) == 16
    assert found.msd is not None
    assert 0.3 < to_mm(found.msd) < 1.0
    assert found.rmse is not None
    assert 0.3 < to_mm(found.rmse) < 1.0


def test_lifted_trials_have_the_numbers_that_they_are_lifted_by() -> None:
    points = curve(read_shape(PEAK), points=2000)
    higher = [points + np.array([0.0, mm(by)]) for by in (1.0, 2.0, 6.0)]
    (shape,) = compared(*higher).shapes
    assert shape.rmse == pytest.approx(mm(((1 + 4 + 36) / 3) ** 0.5), rel=1e-2)
    assert shape.msd == pytest.approx(mm(7.0**0.5), rel=1e-6)
    (other,) = compared(*higher, ddof=0).shapes
    assert other.msd == pytest.approx(mm((14.0 / 3.0) ** 0.5), rel=1e-6)
    (part,) = shape.segments
    assert np.allclose(part.mean - compared(points).shapes[0].segments[0].mean, mm(3.0), atol=mm(0.05))


def test_the_wrong_state_is_named_and_does_not_count() -> None:
    scene = read_shape(PEAK)
    found = compared(curve(scene), curve(scene), curve(scene, "valley"))
    (shape,) = found.shapes
    assert [each.states for each in shape.trials] == [("peak",), ("peak",), ("valley",)]
    assert [each.counts for each in shape.trials] == [True, True, False]
    assert shape.rmse is not None
    assert to_mm(shape.rmse) < 0.05
    assert not shape.is_wanted
    assert not found.is_good
    assert found.agreeing == ()


def test_all_in_the_wrong_state_are_measured_against_that() -> None:
    (shape,) = compared(curve(read_shape(PEAK), "valley")).shapes
    assert shape.states == ("valley",)
    assert shape.rmse is not None
    assert to_mm(shape.rmse) < 0.05
    assert [each.name for each in shape.segments[0].misfits] == ["valley", "peak"]


def test_between_two_states_it_is_ambiguous() -> None:
    scene = read_shape(PEAK)
    between = 0.5 * (curve(scene) + curve(scene, "valley"))
    near = replace(scene.segments[0], length=mm(503.0))
    flat = replace(scene, nodes=tuple(replace(node, angle=0.0) for node in scene.nodes), segments=(near,))
    (segment,) = simulate(flat)
    peak, valley = (segment.states[place].curve(300) for place in (0, -1))
    given = (ShapeTrials(flat, (Trial("t", TrialOutcome.SEEN, curves=(TrialCurve(0.45 * peak + 0.55 * valley),)),)),)
    (shape,) = compare(given).shapes
    assert shape.trials[0].trial.outcome is TrialOutcome.AMBIGUOUS
    assert not shape.is_wanted
    (far,) = compared(between).shapes
    assert far.trials[0].trial.outcome is TrialOutcome.NO_STATE


def test_too_short_a_part_tells_nothing() -> None:
    (shape,) = compared(curve(read_shape(PEAK))[:100]).shapes
    assert shape.trials[0].trial.outcome is TrialOutcome.TOO_LITTLE_SEEN
    assert shape.segments == ()
    assert shape.rmse is None


def test_how_near_is_asked_for_decides() -> None:
    off = curve(read_shape(PEAK)) + np.array([0.0, mm(2.0)])
    assert compared(off, max_rmse=mm(2.1)).is_good
    assert not compared(off, max_rmse=mm(1.9)).is_good


def test_percentages_are_of_what_was_said() -> None:
    off = curve(read_shape(PEAK), points=2000) + np.array([0.0, mm(2.2)])
    (shape,) = compared(off, vertical_range=0.22).document()["shapes"]
    assert shape["rmse_percent"] == pytest.approx(1.0, rel=1e-2)
    assert compared(off).document()["shapes"][0]["vertical_range_mm"] == 440.0


def test_a_row_of_segments_is_cut_at_its_nodes(tmp_path: Path) -> None:
    scene = read_shape("roofline")
    span = scene.display.span
    pieces = [
        found.wanted.curve(200) + np.array([place * span, scene.nodes[place].height])
        for place, found in enumerate(simulate(scene))
        if found.wanted is not None
    ]
    write_table(tmp_path / "roofline-1.csv", np.vstack(pieces))
    (shape,) = compare(read_trials([tmp_path])).shapes
    assert shape.is_wanted
    assert len(shape.segments) == len(scene.segments)
    assert shape.across is not None
    assert to_mm(shape.across) < 0.1


def test_a_model_without_the_state_says_what_it_has() -> None:
    scene = read_shape("level-asymmetric-peak")
    left, right = scene.nodes
    gone = replace(
        scene, nodes=(left, replace(right, angle=1.05)), segments=(Segment(scene.segments[0].length, "peak"),)
    )
    trial = Trial("t", TrialOutcome.SEEN, curves=(TrialCurve(curve(scene)),))
    (shape,) = compare((ShapeTrials(gone, (trial,)),)).shapes
    assert not shape.is_wanted


def test_csv_has_every_place_of_every_shape(folder: Path) -> None:
    found = compare(read_trials([PEAK, folder / f"{PEAK}-1.csv", folder / f"{PEAK}-2.csv"]))
    head, *rows = to_csv(found).decode().splitlines()
    assert head == "shape,segment,wanted,state,x_mm,mean_mm,deviation_mm,peak_mm,valley_mm"
    assert len(rows) == 501
    assert json.loads(json.dumps(found.document()))["agrees"] is True


def test_subfolders_and_shapes_beside_trials(tmp_path: Path) -> None:
    points = curve(read_shape(PEAK))
    (tmp_path / PEAK).mkdir()
    write_table(tmp_path / PEAK / "morning.csv", points)
    text = (Path(__file__).parents[2] / "shapes" / f"{PEAK}.toml").read_text()
    (tmp_path / "mine.toml").write_text(text)
    write_table(tmp_path / "mine_2.csv", points)
    found = read_trials([tmp_path])
    assert [(each.scene.path.split("/")[-1], len(each.trials)) for each in found] == [
        (f"{PEAK}.toml", 1),
        ("mine.toml", 1),
    ]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "empty"),
        ("x,y\n1,2\n", "no-unit"),
        ("x_mm,y_mm\n1,2\n3,4\n", "few-points"),
        ("x_mm,y_mm\n1,2\nnan,4\n", "no-point"),
        ("x_m,y_m\n" + "".join(f"{k},0\n" for k in range(20)), "elsewhere"),
        ("x_mm,y_mm,curve\n" + "".join(f"{k},0,{k % 2}\n" for k in range(40)), "curves"),
    ],
)
def test_tables_that_cannot_be_trials(tmp_path: Path, text: str, code: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text)
    with pytest.raises(InvalidInput) as refused:
        read_trials([PEAK, path])
    assert refused.value.diagnostics[0].code == code


@pytest.mark.parametrize("what", [[], [PEAK], ["."], [PEAK, "."], [PEAK, "x.docx"]])
def test_what_cannot_be_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: list[str]) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInput) as refused:
        read_trials(what)
    assert refused.value.hint


def test_trials_of_a_shape_that_is_not_there(tmp_path: Path) -> None:
    write_table(tmp_path / "unknown-1.csv", curve(read_shape(PEAK)))
    with pytest.raises(InvalidInput, match="there is no shape unknown") as refused:
        read_trials([tmp_path])
    assert str(tmp_path / "unknown.toml") in refused.value.hint


@pytest.mark.parametrize("asked", [{"ddof": 2}, {"vertical_range": 0.0}, {"max_rmse": float("nan")}])
def test_requests_that_make_no_sense(asked: dict[str, float]) -> None:
    with pytest.raises(InvalidInput):
        CompareRequest(**asked)  # type: ignore[arg-type]
