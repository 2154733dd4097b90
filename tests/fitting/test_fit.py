"""From a drawing to a shape and its plan: what is told of it is true."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import curveline
from curveline.bench.drawn_curves import drawings, reachable
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.reports.fit_text import describe
from curveline.drawings.drawing import Drawing
from curveline.errors import Infeasible, InvalidInput
from curveline.fitting.bounds import bounds_of
from curveline.fitting.fit import MARGIN, MAX, THOROUGH, FitRequest, fit_drawing
from curveline.fitting.results import document, to_json, to_shape
from curveline.planning.tours import make_plan
from curveline.rod.branches.continuation import STIFFEST
from curveline.scene import Range
from curveline.shapes.files import read_shape
from tests.fitting.rows import apart, display, drawn, wanted

NO_PLAN = FitRequest(is_planned=False)


@pytest.fixture(autouse=True)
def _at_length(monkeypatch):
    """What is told is not brief, whatever a command asked for before in this process."""
    monkeypatch.setattr(MANNER, "is_brief", False)


def shown(found) -> tuple[np.ndarray, ...]:
    """The curves of a fitted shape in the display's frame, as `simulate` gives them."""
    curves = []
    for place, segment in enumerate(curveline.simulate(found.scene)):
        foot = np.array([place * found.scene.display.span, found.scene.nodes[place].height])
        curves.append(segment.wanted.curve(801) + foot)
    return tuple(curves)


@pytest.mark.parametrize(
    ("formula", "name"),
    [("100*(1-abs(x-250)/250)", "single"), ("where(x>250,100,0)", "single"), ("80*sin(pi*x/900)", "quad")],
)
def test_distances_are_those_of_an_independent_measure(formula, name):
    found = fit_drawing(drawn(formula, name), display(name), NO_PLAN)
    squares, most = [], 0.0
    for curve, piece in zip(shown(found), found.drawn, strict=True):
        sides = []
        for one, other in ((curve, piece), (piece, curve)):
            along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(one, axis=0).T))])
            even = np.linspace(0.0, along[-1], 1501)
            off = apart(np.column_stack([np.interp(even, along, column) for column in one.T]), other)
            sides.append(np.mean(off**2))
            most = max(most, float(apart(one, other).max()))
        squares.append(np.mean(sides))
    assert found.rms == pytest.approx(math.sqrt(np.mean(squares)), abs=5e-5)
    assert found.max == pytest.approx(most, abs=5e-5)
    assert found.worst[0].off <= found.max + 1e-9


def test_corners_of_a_drawing_are_measured():
    found = fit_drawing(Drawing(np.array([[0.0, 0.0], [0.237, 0.1], [0.5, 0.0]])), display(), NO_PLAN)
    corner = min(np.abs(place - np.array([0.237, 0.1])).max() for place in found.drawn[0])
    assert corner < 1e-9
    assert "corner" in found.worst[0].why


def test_a_fit_has_a_plan_that_ends_in_its_shape():
    found = fit_drawing(drawn("60*sin(pi*x/500)"), display(), FitRequest())
    assert found.refusal == ""
    assert found.plan is not None
    assert found.plan.steps[-1].states == (found.scene.segments[0].state,)


def test_most_random_drawings_have_a_plan():
    found = [fit_drawing(each, display(), FitRequest()) for each in drawings(display(), "unreachable", 12, 300)]
    assert sum(each.plan is not None for each in found) >= 11
    assert all((each.plan is None) is bool(each.refusal) for each in found)


@pytest.mark.parametrize(
    ("height", "name"), [(0.0, "single"), (2.0, "single"), (5.0, "single"), (0.0, "quad"), (2.0, "quad"), (3.0, "quad")]
)
def test_flat_drawings_are_within_a_millimetre(height, name):
    found = fit_drawing(drawn(f"{height}*sin(pi*x/500)", name), display(name), FitRequest())
    assert found.rms < 1e-3
    assert found.plan is not None
    if height == 0.0:
        assert {segment.state for segment in found.scene.segments} == {"straight"}


def test_the_largest_distance_is_smaller_where_that_is_minimised():
    target = drawn("100*(1-abs(x-250)/250)")
    mean, most = (fit_drawing(target, display(), replace(NO_PLAN, minimise=each)) for each in ("rms", MAX))
    assert most.max < 0.7 * mean.max
    assert most.rms > mean.rms


def test_thorough_is_never_farther_off():
    target = next(drawings(display(), "unreachable", 1, 306))
    quick, thorough = (fit_drawing(target, display(), replace(NO_PLAN, effort=each)) for each in ("quick", THOROUGH))
    assert thorough.rms <= 1.001 * quick.rms
    assert thorough.starts > quick.starts
    assert thorough.hits <= thorough.starts


def refusing(monkeypatch, count: int) -> None:
    """Have the first so many plans fail."""
    asked = iter(range(count))

    def planned(scene):
        if next(asked, None) is not None:
            raise Infeasible("no way", "none")
        return make_plan(scene)

    monkeypatch.setattr("curveline.fitting.fit.make_plan", planned)


@pytest.mark.parametrize("refused", [0, 1, 2])
def test_what_is_told_is_of_the_shape_that_is_taken_where_nearer_ones_have_no_plan(monkeypatch, refused):
    target = drawn("where(x>250,100,0)")
    nearest = fit_drawing(target, display(), NO_PLAN)
    refusing(monkeypatch, refused)
    found = fit_drawing(target, display(), FitRequest())
    assert found.plan is not None
    lowest = min(segment.wanted.lowest_eigenvalue for segment in curveline.simulate(found.scene))
    assert found.margin == pytest.approx(lowest / STIFFEST, abs=0.01)
    assert found.second_best is None or found.second_best > found.rms
    assert 1 <= found.hits <= found.starts
    if refused == 0:
        assert found.without_plan is None
        return
    assert found.rms > nearest.rms
    assert found.without_plan == nearest.rms
    (margin,) = (limit for limit in found.limits if limit.name == "margin")
    assert margin.value >= found.margin - 0.02
    assert f"{1e3 * nearest.rms:.3g} mm RMS off, has no plan" in " ".join(" ".join(describe(found)).split())


def test_who_asks_for_a_small_margin_gets_what_has_a_plan_at_the_usual_one():
    target = drawn("where(x>250,100,0)")
    usual, small = (fit_drawing(target, display(), FitRequest(margin=margin)) for margin in (MARGIN, 0.05))
    assert small.plan is not None
    assert small.rms <= 1.01 * usual.rms


def test_the_next_best_is_of_the_kind_that_is_minimised():
    found = fit_drawing(drawn("60*sin(4*pi*x/500)"), display(), replace(NO_PLAN, minimise=MAX))
    assert found.second_best is not None
    assert found.second_best > found.max
    assert f"the next best is {1e3 * found.second_best:.3g} mm at most" in " ".join(" ".join(describe(found)).split())


def test_no_limit_costs_more_than_the_distance():
    narrow = replace(display().limits, length=Range(0.7, 0.9))
    found = fit_drawing(drawn("60*sin(pi*x/500)"), replace(display(), limits=narrow), NO_PLAN)
    assert 0.9 * found.rms < found.limits[0].costs <= found.rms


@pytest.mark.parametrize(
    "formula",
    ["20*sin(pi*x/500)", "100*(1-abs(x-250)/250)", "60*sin(pi*x/500) + 25*sin(5*pi*x/500)"],
)
def test_sensitivity_is_what_a_node_that_errs_does(formula):
    found = fit_drawing(drawn(formula), display(), NO_PLAN)
    curve = shown(found)[0]

    def moved(**changes) -> float:
        scene = replace(found.scene, **changes)
        return float(apart(shown(replace(found, scene=scene))[0], curve)[1:-1].max())

    nodes, segments, little = found.scene.nodes, found.scene.segments, 2e-5
    fed = moved(segments=(replace(segments[0], length=segments[0].length + little),))
    turned, lifted = [], []
    for place in range(2):
        both = list(nodes)
        both[place] = replace(nodes[place], angle=nodes[place].angle + little)
        turned.append(moved(nodes=tuple(both)))
        both[place] = replace(nodes[place], height=nodes[place].height + little)
        rise = both[1].height - both[0].height
        chord = math.hypot(0.5, rise) - math.hypot(0.5, nodes[1].height - nodes[0].height)
        lengths = (replace(segments[0], length=segments[0].length + chord),)
        lifted.append(moved(nodes=tuple(both), segments=lengths))
    assert found.sensitivity.feed == pytest.approx(fed / little, rel=0.1)
    assert found.sensitivity.angle == pytest.approx(max(turned) / little, rel=0.1)
    assert found.sensitivity.height == pytest.approx(max(lifted) / little, rel=0.1)


def test_limits_cost_what_the_fit_gains_without_them():
    low = replace(display(), limits=replace(display().limits, height=Range(-0.03, 0.03)))
    target = drawn("80*x/500 + 50*sin(pi*x/500)")
    found = fit_drawing(target, low, NO_PLAN)
    limit = next(each for each in found.limits if each.name == "limits.height_mm")
    free = fit_drawing(target, display(), NO_PLAN)
    assert limit.nodes == (2,)
    assert limit.value == pytest.approx(30.0)
    assert limit.costs == pytest.approx(found.rms - free.rms, rel=0.1)


def test_bounds_hold_and_say_something():
    far = drawn("215 + 2400*(x/500)*(1-x/500)")
    found = fit_drawing(Drawing(far.points, "far"), display(), NO_PLAN)
    assert 0.02 < found.least_possible.rms < found.rms
    assert found.least_possible.rms < found.least_possible.max < found.max
    high = fit_drawing(drawn("300 + 0*x"), display(), NO_PLAN)
    assert high.least_possible.max == pytest.approx(0.08)
    assert high.max >= high.least_possible.max - 1e-12


def test_bounds_are_nothing_for_what_can_be_shown():
    assert bounds_of(wanted("60*sin(pi*x/500)")) == (0.0, 0.0)


def test_a_drawing_that_bends_too_often_is_told_so():
    found = fit_drawing(drawn("30*sin(6*pi*x/500)"), display(), NO_PLAN)
    assert "changes the side it bends to" in found.worst[0].why
    assert "at most 2 times" in found.worst[0].why


@pytest.mark.parametrize(
    ("points", "is_corner"),
    [
        ([[0.0, 0.0], [0.3, 0.06], [0.5, 0.0]], True),
        ([[0.0, 0.0], [0.1, 0.04], [0.3, 0.06], [0.4, 0.055], [0.5, 0.04]], True),
        ([[0.0, 0.0], [0.3, 0.01], [0.5, 0.01]], False),
    ],
)
def test_corners_are_told_from_gentle_bends(points, is_corner):
    found = curveline.fit(points, request=NO_PLAN)
    assert ("a corner of " in found.worst[0].why) is is_corner


def test_noise_is_told_to_be_noise():
    found = fit_drawing(reachable(display(), 3), display(), NO_PLAN)
    assert "rough" in found.worst[0].why


def test_no_stable_curve_is_said_to_be_none():
    none = replace(display(), limits=replace(display().limits, length=Range(0.5, 0.5001), angle=Range(-1e-4, 1e-4)))
    none = replace(none, limits=replace(none.limits, height=Range(-0.22, 0.22)))
    with pytest.raises(Infeasible, match="no stable curve"):
        fit_drawing(drawn("200*sin(pi*x/500)"), replace(none, drive=replace(none.drive, max_force=1e-3)), NO_PLAN)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0.0, 0.0], [0.3, 0.0]], "from 0 to 300 mm"),
        ([[0.0, 0.0], [0.6, 0.0], [0.4, 0.1], [0.7, 0.1]], "3 times"),
        ([[0.0, 0.0], [0.5, math.nan]], "point 2"),
        ([[0.0, 0.0]], "2 to"),
    ],
)
def test_targets_that_are_none_are_refused(points, words):
    with pytest.raises(InvalidInput, match=words) as caught:
        curveline.fit(points)
    assert caught.value.hint


def test_displays_that_are_never_planned_for_are_refused():
    leaning = replace(display(), down=(0.0, -0.9, -0.43))
    with pytest.raises(InvalidInput, match="no plan is possible"):
        fit_drawing(drawn("60*sin(pi*x/500)"), leaning, NO_PLAN)


@pytest.mark.parametrize("wrong", [{"margin": 0.0}, {"effort": "much"}, {"minimise": "mean"}, {"margin": math.nan}])
def test_requests_that_make_no_sense_are_refused(wrong):
    with pytest.raises(InvalidInput):
        FitRequest(**wrong)


def test_a_fit_is_a_shape_file(tmp_path):
    path = tmp_path / "hill.toml"
    found = fit_drawing(drawn("150*exp(-((x-1000)/300)**2)", "quad"), display("quad"), FitRequest(name="hill"))
    path.write_bytes(to_shape(found, path))
    scene = read_shape(path)
    assert scene.name == "hill"
    assert [each.state for each in scene.segments] == [each.state for each in found.scene.segments]
    assert all(segment.wanted is not None for segment in curveline.simulate(path))
    for one, other in zip(scene.nodes, found.scene.nodes, strict=True):
        assert one.height == pytest.approx(other.height, abs=1e-12)
        assert one.angle == pytest.approx(other.angle, abs=1e-12)
    text = path.read_text()
    assert f"{1e3 * found.rms:.3g} mm RMS" in text.replace("\n# ", " ")
    assert "a plan of" in text.replace("\n# ", " ")
    assert max(map(len, text.splitlines())) <= 80


def test_names_from_outside_cannot_break_out_of_the_shape_file(tmp_path):
    evil = 'x\n"\nname = "other"\n\x1b[31m\u202e]]'
    target = Drawing(drawn("60*sin(pi*x/500)").points, evil, understood=evil)
    found = fit_drawing(target, display(), NO_PLAN)
    path = tmp_path / "evil.toml"
    path.write_bytes(to_shape(replace(found, scene=replace(found.scene, name="plain")), path))
    assert read_shape(path).name == "plain"
    assert "\x1b" not in path.read_text()


def test_the_document_says_all_of_it():
    found = fit_drawing(drawn("where(x>250,100,0)"), display(), FitRequest())
    told = document(found, ("fit",))
    assert json.loads(to_json(found, argv=("fit",))) == told
    assert told["distance"]["rms_mm"] == pytest.approx(1e3 * found.rms)
    assert told["distance"]["worst"][0]["why"]
    assert told["least_possible_mm"] <= told["distance"]["rms_mm"]
    assert told["limits"][0]["name"] == "margin"
    assert set(told["global"]) == {"starts", "hits", "second_best_mm", "without_plan_mm"}
    assert set(told["sensitivity"]) == {"mm_per_mm_of_feed", "mm_per_deg", "mm_per_mm_of_height"}
    assert told["plan"]["steps"] == len(found.plan.steps)
    assert told["provenance"]["settings"]["margin"] == 0.12


def test_points_are_taken_as_they_are():
    points = drawn("60*sin(pi*x/500)").points
    assert curveline.fit(points, "single", NO_PLAN).rms < 1e-4
    assert curveline.fit(points[::-1], "single", NO_PLAN).rms < 1e-4
    assert curveline.fit(points.tolist(), display(), NO_PLAN).rms < 1e-4


@pytest.mark.parametrize(
    ("limits", "formula"),
    [
        ({"height": Range(0.0, 0.06666667)}, "0.4*x"),
        ({"height": Range(-0.06666667, 0.0)}, "0.4*x-200"),
        ({"angle": Range(math.radians(-33.3), math.radians(11.111116))}, "0.4*x"),
        ({"length": Range(0.5, 0.505)}, "0.4*x"),
        ({"length": Range(0.5, 0.5051234567)}, "150*sin(pi*x/500)"),
    ],
)
def test_a_fitted_shape_keeps_the_limits_of_its_display(limits, formula):
    narrow = replace(display(), limits=replace(display().limits, **limits))
    found = fit_drawing(drawn(formula), narrow, NO_PLAN)
    within = narrow.limits
    for node in found.scene.nodes:
        assert within.height.low - 1e-12 <= node.height <= within.height.high + 1e-12
        assert within.angle.low - 1e-12 <= node.angle <= within.angle.high + 1e-12
    for segment in found.scene.segments:
        assert within.length.low - 1e-12 <= segment.length <= within.length.high + 1e-12
    assert any(limit.name.startswith("limits.") for limit in found.limits)
    assert len(set(found.limits)) == len(found.limits)
