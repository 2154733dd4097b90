"""Which errors matter: one that alone does is found, whoever shares the work; curves are those of `simulate`."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import curveline
from curveline.errors import InvalidInput
from curveline.replay.error_sizes import sizes_of
from curveline.replay.monte_carlo import Draws, Errors, Setup, course_of, draw, play_run
from curveline.replay.ranking import POINTS, Design, Ranking, curve_of, play_row, rank, with_input
from curveline.replay.ranking_report import ranking_document, ranking_tables
from curveline.replay.real_display import real_display
from curveline.replay.trials import Trials, TrialsRequest, play_trials
from curveline.scene import DisplayErrors, Range
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm, nmm
from playing import FILES, plan, scene, short_cut

DISPLAY = scene("level-up-peak").display
NONE = Errors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SMALL = Errors(mm(0.01), 1e-5, deg(0.01), mm(0.01), mm(0.01), 0.01)
"""Errors of nodes that hardly matter."""


def ranked(setup: Setup, rows: int, seed: int = 1) -> Ranking:
    design = Design(setup)
    return rank(design, [play_row(design, number) for number in range(seed, seed + rows)])


def played(setup: Setup, *, rank: bool, jobs: int = 1, runs: int = 30) -> Trials:
    return play_trials(setup, TrialsRequest(runs, 5, setup.errors, jobs, setup.ranges, rank=rank))


def test_the_one_input_that_moves_the_curve_is_found() -> None:
    ranges = DisplayErrors(clamp=Range(0.0, mm(20.0)), mass=Range(-0.001, 0.001), friction=Range(0.0, mm(0.001)))
    found = ranked(Setup(DISPLAY, plan("level-asymmetric-peak"), SMALL, ranges), 100)
    assert found.curve is not None
    assert found.share is None
    only = found.inputs.index("clamp")
    for effects in (found.curve.first, found.curve.total):
        assert effects.value[only] == pytest.approx(1.0, abs=0.02)
        assert np.all(np.delete(effects.value, only) < 0.01)
    # From 0 to 20 mm a bearing moves a peak by millimetres: `docs/accuracy.md` would be of no use to who has it wrong.
    assert mm(0.5) < found.spread < mm(20.0)
    # What leaves the range's middle where the file is leaves the curve around the plan's.
    assert found.off > found.spread


EACH = DisplayErrors(
    stiffness=Range(-0.3, 0.3),
    mass=Range(-0.6, 0.6),
    clamp_stiffness=Range(nmm(100.0) / deg(1.0), math.inf),
    clamp_play=Range(0.0, deg(1.0)),
    clamp=Range(mm(15.0), mm(20.0)),
    span=Range(mm(-1.0), mm(1.0)),
    friction=Range(0.0, mm(2.0)),
    set_share=Range(0.0, 0.05),
)
"""Of sizes that move a curve about as much as one another."""


def in_the_middle(but: str) -> DisplayErrors:
    """Every error in the middle of its range, one but left as it is."""
    middles = {name: Range(drawn.at(0.5), drawn.at(0.5)) for name, drawn in EACH.given.items()}
    softest = EACH.given["clamp_stiffness"].low
    middles["clamp_stiffness"] = Range(2.0 * softest, 2.0 * softest)
    return DisplayErrors(**{**middles, **{name: drawn for name, drawn in EACH.given.items() if name == but}})


def test_every_input_alone_moves_the_curve_as_it_is_said_to() -> None:
    """Held against runs in which nothing else is drawn: effects of errors that are small hardly mix."""
    made = plan("staggered-asymmetric-peak")
    nodes = Errors(mm(0.5), 0.005, deg(0.3), mm(0.3), 0.0, 0.0)
    found = ranked(Setup(DISPLAY, made, nodes, EACH), 60)
    assert found.curve is not None
    assert set(found.inputs) == {"feed", "feed_scale", "angle", "height", *EACH.given}
    for name, share, total in zip(found.inputs, found.curve.first.value, found.curve.total.value, strict=True):
        only = {} if name in EACH.given else {name: getattr(nodes, name)}
        alone = Setup(DISPLAY, made, replace(NONE, **only), in_the_middle(name))
        curves = [curve_of(alone, course_of(alone, draw(alone, seed))) for seed in range(100)]
        expected = float(np.sum(np.var(np.array(curves), axis=0))) / POINTS / found.curve.variance
        assert expected > 0.015, name
        assert total == pytest.approx(expected, rel=0.6, abs=0.01), name
        assert share == pytest.approx(expected, rel=0.6, abs=0.05), name


def drawn_of(setup: Setup, draws: Draws) -> dict[str, object]:
    """What is drawn, by the names of inputs; feeds, their scale and unevenness are in the axes."""
    real = real_display(setup.display, setup.display_errors, draws.shares, draws.gaps, setup.kept)
    first, rod = real.gaps[0], real.gaps[0].rod
    values = course_of(replace(setup, ranges=DisplayErrors()), draws).values
    return {
        "stiffness": rod.bending_stiffness,
        "mass": rod.mass_per_length,
        "clamp_stiffness": first.clamp_stiffness,
        "clamp_play": first.clamp_play,
        "clamp": first.clamp,
        "span": [each.span for each in real.gaps],
        "friction": real.friction,
        "set_share": rod.profile,
        "bow": draws.bows.tolist(),
        **{axis: values[:, :, place].tolist() for place, axis in enumerate(("feed", "angle", "height"))},
    }


def test_an_input_that_is_drawn_anew_is_that_one_alone() -> None:
    setup = Setup(DISPLAY, plan("staggered-asymmetric-peak"), Errors(), EACH)
    base, other = draw(setup, 1), draw(setup, (1, 1))
    before = drawn_of(setup, base)
    axes = {"feed_scale": {"feed"}, "unevenness": {"feed", "angle", "height"}}
    for name in Design(setup).inputs:
        now = drawn_of(setup, with_input(base, other, name))
        assert {key for key, value in now.items() if value != before[key]} == axes.get(name, {name})
        if name in (*EACH.given, "bow"):
            assert now[name] == drawn_of(setup, other)[name]


def test_the_one_input_that_decides_how_runs_end_is_found() -> None:
    # Out of the funnel the bow decides: see test_monte_carlo.
    made = short_cut(plan("level-up-peak"))
    found = ranked(Setup(DISPLAY, made, replace(SMALL, bow=mm(5.0))), 150)
    assert found.share is not None
    only = found.inputs.index("bow")
    for effects in (found.share.first, found.share.total):
        assert effects.value[only] == pytest.approx(1.0, abs=0.1)
        assert np.all(np.delete(effects.value, only) < 0.05)
    # Two bows drawn one after the other are on both sides of the threshold with 2 p (1 - p).
    assert found.turned[only] == pytest.approx(2.0 * found.share.variance, abs=0.08)
    assert not np.any(np.delete(found.turned, only) > 0.05)
    # The curve that is wanted is there whichever way the rod went.
    assert found.rows == 150
    assert found.curve is not None
    assert found.curve.total.value[only] == 0.0


def test_the_curve_without_errors_is_that_of_simulate() -> None:
    for name in ("level-asymmetric-peak", "roofline"):
        shape = read_shape(FILES[name])
        made = plan(name)
        design = Design(Setup(shape.display, made, SMALL))
        assert design.planned is not None
        curve = design.planned.reshape(-1, POINTS, 2)
        height = shape.nodes[0].height
        for segment, (found, states) in enumerate(zip(curve, simulate(shape), strict=True)):
            assert states.wanted is not None
            expected = states.wanted.curve(POINTS) + np.array(states.origin)
            # Targets are whole counts of the encoders.
            assert np.max(np.abs(found - expected)) < mm(0.1), (segment, height)


def test_a_run_without_the_wanted_state_has_no_curve() -> None:
    made = plan("level-asymmetric-peak")
    setup = Setup(DISPLAY, made, NONE)
    run = course_of(setup, draw(setup, 1))
    assert curve_of(setup, run) is not None
    steep = run.values.copy()
    steep[-1, 1, 1] = deg(70.0)
    assert curve_of(setup, run._replace(values=steep)) is None
    taut = run.values.copy()
    taut[-1, :, 0] = 0.0
    assert curve_of(setup, run._replace(values=taut)) is None


def test_rows_without_a_curve_are_left_out() -> None:
    setup = Setup(DISPLAY, plan("level-asymmetric-peak"), Errors(angle=deg(20.0)))
    design = Design(setup)
    rows = [play_row(design, seed) for seed in range(1, 41)]
    found = rank(design, rows)
    assert 0 < found.rows < 40
    assert found.rows == sum(row.terms is not None for row in rows)
    assert found.share is not None
    assert found.inputs[int(np.argmax(found.share.total.value))] == "angle"


def test_ranking_leaves_the_runs_as_they_are() -> None:
    setup = Setup(DISPLAY, short_cut(plan("level-up-peak")), ranges=DisplayErrors(clamp=Range(0.0, mm(20.0))))
    plainly, ranking = played(setup, rank=False), played(setup, rank=True)
    assert ranking.outcome == plainly.outcome
    assert [play_row(Design(setup), seed).run for seed in (5, 6)] == [play_run(setup, seed) for seed in (5, 6)]
    assert plainly.ranking is None
    assert plainly.document()["ranking"] is None
    assert ranking.plays == 30 * (7 + 2)


def test_the_outcome_does_not_depend_on_the_processes() -> None:
    setup = Setup(DISPLAY, short_cut(plan("level-up-peak")), ranges=DisplayErrors(clamp=Range(0.0, mm(20.0))))
    one, two = (played(setup, rank=True, jobs=jobs).document() for jobs in (1, 2))
    assert json.dumps(one) == json.dumps(two)
    assert one["ranking"]["share"] is not None


def test_a_document_has_the_most_important_error_first() -> None:
    setup = Setup(DISPLAY, short_cut(plan("level-up-peak")), ranges=DisplayErrors(clamp=Range(0.0, mm(20.0))))
    trials = played(setup, rank=True)
    assert trials.ranking is not None
    document = ranking_document(trials.ranking)
    for outcome, more in (("share", "turned"), ("curve", "moves_mm")):
        totals = [each["total"]["share"] for each in document[outcome]["inputs"]]
        assert totals == sorted(totals, reverse=True)
        keys = {each["input"] for each in document[outcome]["inputs"]}
        assert keys == {*(size.key for size in sizes_of(setup.errors)), "clamp_mm"}
        for each in document[outcome]["inputs"]:
            assert each["first"]["low"] <= each["first"]["high"]
            assert each[more] >= 0.0
    best = document["curve"]["inputs"][0]
    assert best["moves_mm"] == pytest.approx(document["curve"]["spread_mm"] * best["total"]["share"] ** 0.5)
    html = trials._repr_html_()
    assert html.count("<table>") == 3
    for title, table in ranking_tables(trials.ranking):
        assert len(table) == 8
        assert f"<b>{title}</b>" in html


def test_where_nothing_varies_there_is_nothing_to_rank() -> None:
    with pytest.raises(InvalidInput, match="nothing to rank") as refusal:
        Design(Setup(DISPLAY, plan("level-up-peak"), NONE, DisplayErrors(clamp=Range(0.01, 0.01))))
    assert refusal.value.hint
    # Neither does a rod that is to be straight have a curve.
    home = curveline.plan(begin=FILES["level-up-peak"], home=True)
    found = ranked(Setup(DISPLAY, home, SMALL), 3)
    assert (found.share, found.curve, found.rows) == (None, None, 0)
    titles = [title for title, _ in ranking_tables(found)]
    assert all(title in played(Setup(DISPLAY, home, SMALL), rank=True, runs=3)._repr_html_() for title in titles)
    assert "all end alike" in titles[0]
    assert "there is none" in titles[1]
