"""The benchmark measures what it says; whether a figure is good enough is for people to judge, not for a test."""

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from clamped_rods import rod_between
from curveline.bench import in_space, measuring, plans, quick, report, search, sweeps, trade, yardsticks
from curveline.bench.measurement import Measurement
from curveline.bench.methods import cases, collocation, straddling
from curveline.bench.methods.cases import CaseSet, truth
from curveline.bench.methods.own import OWN, Method, Solved, one_level
from curveline.bench.methods.peers import PEERS
from curveline.bench.processes import ProcessTime
from curveline.bench.report import BenchReport
from curveline.bench.trade import TradePoint
from curveline.bench.trade_figure import draw
from curveline.cli.printing.reports.bench_text import measured
from curveline.cli.printing.reports.trade_table import table
from curveline.rod.planar.elastica import clamped_arch
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR, SPATIAL
from curveline.rod.states.planar_states import find_states
from curveline.shapes.files import read_shape
from curveline.units import to_deg, to_mm

ROOT = Path(__file__).parents[2]
SHAPE = str(ROOT / "shapes" / "level-up-peak.toml")
REFERENCE = json.loads((ROOT / "tests" / "data" / "reference_cases.json").read_text())


@pytest.fixture(scope="module")
def clamps() -> CaseSet:
    return cases.clamps()


def few(method: Method, count: int = 2) -> Method:
    """The method with its first settings only."""
    return Method(**{**vars(method), "settings": method.settings[:count]})


def point(error: float | None, seconds: float | None) -> TradePoint:
    return TradePoint("clamps", PLANAR, "one level", 1.0, "edges", 10, error, seconds, 1e-7, 2.0, cases=1, right=1)


def test_a_state_that_is_not_known_counts_as_missed():
    rod = rod_between((0.5, 0.0), 0.2, -0.2, 0.65, 0.02, 0.028224, 0.4707192)
    heights = [state.mean_height for state in find_states(rod, 1e-4)]
    assert len(heights) == 2
    assert search.missed(rod, heights, np.random.default_rng(1)) == 0
    assert search.missed(rod, heights[:1], np.random.default_rng(1)) == 1
    assert search.missed(rod, [], np.random.default_rng(1)) == 2


def test_shooting_meets_the_closed_form_and_the_stored_stretch(clamps: CaseSet):
    arch = clamped_arch(0.5, 0.6, 1.0)
    places = np.linspace(0.0, 0.6, 41)
    curve = truth(clamps.cases[0], PLANAR)
    assert curve is not None
    assert np.abs(curve.positions(places) - arch.positions(places)).max() < 1e-11
    # How far its real stretch moves either curve, as measured by collocation with another code.
    for case, moved in zip(clamps.cases, (0.0353, 0.0187), strict=True):
        stiff, soft = truth(case, PLANAR), truth(case, EXTENSIBLE)
        assert stiff is not None
        assert soft is not None
        places = np.linspace(0.0, case.rod.length, 201)
        apart = np.hypot(*(stiff.positions(places) - soft.positions(places)).T).max()
        assert to_mm(float(apart)) == pytest.approx(moved, abs=1e-4)


def test_shooting_carries_weight_loads_and_clamps():
    rod = rod_between((0.5, 0.05), 0.3, -0.2, 0.62, 0.02, 0.028, 0.47, loads=((0.3, 0.1, -0.4), (0.7, 0.0, 0.3)))
    for state in find_states(rod, 1e-9):
        curve = cases.exact(state, math.inf)
        assert curve is not None
        places = np.linspace(0.0, rod.length, 101)
        assert np.abs(curve.positions(places) - state.curve(101)).max() < 2e-9


def test_the_eight_boundary_conditions_are_those_of_the_reference():
    for case, (height, left, right, length) in zip(REFERENCE["public"], search.BOUNDARY_CONDITIONS, strict=True):
        stored = (to_mm(case["y"]), to_deg(case["theta1"]), to_deg(case["theta2"]), to_mm(case["L"]))
        assert stored == pytest.approx((height, left, right, length))


def test_the_yardstick_finds_the_same_curve_as_the_rod(clamps: CaseSet):
    from curveline.bench.methods import bare_newton as bare

    for case in (*clamps.cases, *cases.shapes([SHAPE]).cases):
        scaled, _, guess, _ = yardsticks.planar_start(case)
        angles = bare.solve(guess, scaled.chord, scaled.ends, scaled.weight, 96)
        assert angles.size == 96
        steps = case.rod.free_length / 96 * np.column_stack([np.cos(angles), np.sin(angles)])
        own = Solved(97, 1.0, np.zeros(0), np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]) + case.rod.free_start)
        other = one_level(case, PLANAR, 96)
        assert other is not None
        assert np.abs(own.positions - other.positions).max() < 1e-12


def test_every_own_method_measures_every_model(clamps: CaseSet):
    one = CaseSet("clamps", clamps.cases[:1])
    methods = [few(method) for method in OWN]
    points = [point for job in trade.jobs([one], methods) for point in trade.measure(job)]
    assert {point.model for point in points} == set(trade.MODELS)
    for each in points:
        assert each.right == each.cases == 1
        assert each.note == ""
        assert each.vertices is not None
        assert each.seconds is not None
        assert each.seconds_per_vertex == pytest.approx(each.seconds / each.vertices)
        assert each.error_mm is not None
        assert 0.0 < each.error_mm < (each.setting if each.unit == "mm" and each.setting else 3.0)
        if each.method == "one level":
            assert each.order == pytest.approx(2.0, abs=0.2)


def test_a_tolerance_is_kept_by_all_that_refine_to_it():
    shapes = cases.shapes([SHAPE])
    for method in OWN:
        if method.unit == "mm":
            for answer in trade.measure(trade.jobs([shapes], [few(method, 4)])[0]):
                assert answer.error_mm is not None
                assert answer.setting is not None
                assert 0.0 < answer.error_mm < answer.setting


def test_collocation_solves_the_same_rods():
    shapes = cases.shapes([SHAPE])
    job = trade.jobs([shapes], [few(collocation.METHODS[0], 3), few(collocation.METHODS[1], 3)])
    for answer in [point for each in job for point in trade.measure(each)]:
        assert answer.right == 1
        assert answer.error_mm is not None
        assert answer.error_mm < 0.2


def test_the_start_of_other_codes_keeps_clamps_chord_and_length(clamps: CaseSet):
    for case in (*clamps.cases, *cases.shapes([SHAPE]).cases):
        start = straddling.straddling(case, 20)
        rod = case.rod
        assert len(start.vertices) == 22
        steps = np.diff(start.vertices, axis=0)
        assert np.hypot(*steps.T) == pytest.approx(np.full(21, rod.free_length / 20))
        for edge, angle in ((0, rod.start), (-1, rod.end)):
            assert np.arctan2(steps[edge, 1], steps[edge, 0]) == pytest.approx(angle)
        middles = 0.5 * (start.vertices[1:] + start.vertices[:-1])
        assert middles[0] == pytest.approx(np.array(rod.free_start))
        assert middles[-1] == pytest.approx(np.array(rod.free_start) + rod.free_chord)
        places = start.places(case)
        assert len(places) == len(start.vertices[start.free])
        assert places[0] == pytest.approx(0.5 * rod.clamp + 1.5 * start.h)


def test_a_peer_that_is_missing_is_a_row_that_says_so(clamps: CaseSet):
    missing = Method("ghost", SPATIAL, (1.0, 2.0), "edges", lambda case, n: None, package="curveline_ghost", few=True)
    job = trade.jobs([clamps, CaseSet("shapes", clamps.cases)], [missing])
    assert [each.scenes.name for each in job] == ["clamps"]
    told: list[str] = []
    points = trade.measure(job[0], told.append)
    assert len(told) == job[0].steps == 2
    assert [(each.note, each.setting, each.pareto) for each in points] == [("not installed", None, False)]
    assert any("ghost: not installed" in line for line in table(points))
    assert {peer.package for peer in PEERS if peer.few} == {"elastica", "mujoco"}


def test_another_state_and_no_answer_do_not_count_as_answers(clamps: CaseSet):
    def mirrored(case: cases.Case, n: float) -> Solved | None:
        curve = truth(case, PLANAR)
        assert curve is not None
        places = np.linspace(0.0, case.rod.length, 11)
        return Solved(11, 1e-3, places, curve.positions(places) * [1.0, -1.0 if n > 1 else 1.0]) if n < 3 else None

    method = Method("mirrored", PLANAR, (1.0, 2.0, 3.0), "edges", mirrored)
    right, other, none = trade.measure(trade.jobs([clamps], [method])[0])
    assert (right.right, right.error_mm) == (2, 0.0)
    assert (other.right, other.error_mm, other.note) == (0, None, "0 of 2 right")
    assert (none.right, none.seconds) == (0, None)


def test_the_front_holds_what_nothing_else_beats_in_both():
    points = [point(1.0, 1.0), point(0.5, 2.0), point(0.6, 3.0), point(0.5, 2.5), point(None, None), point(0.1, 9.0)]
    assert [each.pareto for each in trade.with_front(points)] == [True, True, False, False, False, True]
    assert [each.pareto for each in trade.with_front([point(1.0, 2.0), point(1.0, 1.0)])] == [False, True]


def test_orders_and_exponents_are_fitted():
    sample = trade._Sample
    slope = [[sample(n, 3.0 * n**-2.0, 1.0), sample(n, 7.0 * n**-2.0, 1.0)] for n in (10, 20, 40)]
    assert trade.fitted_order(slope) == pytest.approx(2.0)
    assert trade.fitted_order([[sample(10, 1.0, 1.0)], [sample(10, 1.0, 1.0)], [None]]) is None
    assert trade.fitted_exponent([10, 100, 1000], [2.0, 20.0, 200.0]) == pytest.approx(1.0)


def test_what_a_peer_needs_for_an_error_is_read_off_its_finest_settings(clamps: CaseSet):
    case = clamps.cases[0]

    def slow(case: cases.Case, n: float) -> Solved:
        curve = truth(case, SPATIAL)
        assert curve is not None
        places = np.array([0.1, 0.3])
        return Solved(2, n**3, places, curve.positions(places) + np.array([n**-2.0, 0.0]))

    method = Method("slow", SPATIAL, (10.0, 100.0, 200.0), "edges", slow)
    assert in_space.time_at(case, method, 400.0**-2.0) == pytest.approx(400.0**3)


def test_the_table_fits_a_terminal(clamps: CaseSet):
    wide = [
        TradePoint(
            "clamps", EXTENSIBLE, "PyElastica", 1e-08, "tol", 100_001, 1.2e-09, 123.4e-6, 123.4e-9, 12.34, True, 2, 2
        ),
        TradePoint(
            "clamps", EXTENSIBLE, "solve_bvp", 1e-04, "mm", 97, 1.2e-05, 12.34, 1.234e-3, 2.0, False, 1, 2, "1 of 2"
        ),
    ]
    for line in table(wide):
        assert len(line) <= 80, line
    assert table(wide)[2].startswith("*  PyElastica  1e-08 tol")
    for row in (*search.all_states([read_shape(SHAPE)]), *plans.many_segments((2, 3))):
        assert all(len(line) <= 80 for line in measured(row)), row


def test_the_document_is_plain_json_and_names_versions_and_machine():
    rows = [Measurement("a figure", 1.0, "ms", "< 2", "how")]
    points = [point(0.1, 1e-3), TradePoint("clamps", SPATIAL, "MuJoCo", None, "edges", note="not installed")]
    document = json.loads(report.to_json(BenchReport(rows, points)))
    assert document["rows"] == [vars(rows[0])]
    assert set(document["rows"][0]) == {
        *("name", "value", "unit", "goal", "how", "spread", "over_bare_newton", "over_solve_bvp"),
    }
    assert document["machine"]["cores"] == len(os.sched_getaffinity(0))
    assert {"python", "numpy", "scipy", "numba", "llvmlite", "pyelastica", "mujoco"} == set(document["versions"])
    fields = (
        "scenes model method setting unit vertices error_mm seconds seconds_per_vertex order pareto right cases note"
    )
    assert all(list(each) == fields.split() for each in document["trade"])
    assert document["trade"][1]["error_mm"] is None


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_the_picture_is_the_same_for_the_same_points(kind: str):
    points = trade.with_front([point(1.0, 1e-3), point(0.5, 2e-3), point(None, None)])
    points.append(TradePoint("shapes", SPATIAL, "new peer", 50.0, "edges", 51, 0.2, 1e-2, 2e-4, 2.0, True, 1, 1))
    picture = draw(BenchReport([], points), kind)
    assert picture[:4] in (b"<?xm", b"\x89PNG", b"%PDF")
    assert picture == draw(BenchReport([], points), kind)


def test_figures_of_a_rod_are_held_against_the_yardsticks(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sweeps, "POSES", 20)
    monkeypatch.setattr(sweeps, "JOBS", 1)
    few = list(cases.random_scenes(2))
    for row in (*sweeps.in_process(), search.of_scenes("random", few, "< 1", np.mean)):
        assert row.value is not None
        assert row.over_bare_newton is not None
        assert row.over_solve_bvp is not None
        assert row.over_bare_newton > 1.0
        assert 0.0 < row.over_solve_bvp < row.over_bare_newton


def test_a_sweep_on_the_command_line_is_measured_without_its_start(monkeypatch: pytest.MonkeyPatch):
    asked: list[list[str]] = []

    def spent(command: list[str], environment: Mapping[str, str]) -> ProcessTime:
        asked.append(list(command))
        return ProcessTime(0.5 + (1.0 if f"{sweeps.POINTS}" in command[-2] + command[-3] + command[-4] else 0.0), 1.0)

    monkeypatch.setattr(sweeps, "spent", spent)
    row = sweeps.on_the_command_line("points", "> 1", ["-o", "sweep.npz", "--force"])
    assert row.value == pytest.approx(sweeps.POINTS - sweeps.FEW)
    assert len(asked) == 2
    assert all(command[-2].endswith("/sweep.npz") for command in asked)


def test_an_exact_goal_can_be_missed():
    assert Measurement("missed by the search", 1.0, "", "= 0", "").is_missed
    assert not Measurement("missed by the search", 0.0, "", "= 0", "").is_missed


@pytest.mark.campaign
def test_everything_is_measured_as_it_is_told():
    """Whatever the figures are: each has its own name, fits a terminal, and was measured."""
    rows = [row for group in quick.quick(measuring.own_shapes()) for row in group.rows()]
    assert len({row.name for row in rows}) == len(rows) > 40
    for row in rows:
        assert row.value is not None, row
        assert math.isfinite(row.value), row
        assert all(len(line) <= 80 for line in measured(row)), row
    assert sum(row.over_solve_bvp is not None for row in rows) > 12
