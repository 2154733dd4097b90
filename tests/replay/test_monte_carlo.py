"""Plans played with errors: none leaves the replay as it is, the funnel stands the usual ones, a short cut does not."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest

from curveline.errors import InvalidInput
from curveline.replay.monte_carlo import LOST, PIECES, Errors, Setup, course_of, draw, play_run, run_trials, summarise
from curveline.replay.outcome import TAUT, Reason, Share, TrialRun
from curveline.replay.playback import replay
from curveline.rod.branches.quasi_static import FELL, Event, State, buckle
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array, Pose
from curveline.shapes.files import read_display
from curveline.units import deg, mm
from playing import by_hand, motion, plan, scene, short_cut

DISPLAY = scene("level-up-peak").display
NONE = Errors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
BOWS = replace(NONE, bow=mm(5.0))
PEAKS = ("level-neutral-peak", "level-up-peak", "staggered-down-peak")


def outcome_of(setup: Setup, count: int, first: int = 1) -> Share:
    return summarise(setup, list(run_trials(setup, range(first, first + count)))).total


def leaning_up(bow: float) -> float:
    """The probability that a rod buckles upwards: that its own bow exceeds its sag, w L^4 / 384 EI."""
    rod = DISPLAY.rod
    sag = rod.weight_per_length * (DISPLAY.span - DISPLAY.clamp) ** 4 / (384.0 * rod.bending_stiffness)
    return 1.0 - NormalDist(sigma=bow).cdf(sag)


@pytest.mark.parametrize("name", [*PEAKS, "level-up-valley"])
def test_without_errors_a_run_is_the_replay(name: str) -> None:
    for made in (plan(name), short_cut(plan(name))):
        expected = replay(DISPLAY, motion(made)).states
        assert {play_run(Setup(DISPLAY, made, NONE), seed).endings for seed in range(3)} == {expected}


@pytest.mark.parametrize("name", PEAKS)
def test_the_funnel_stands_the_usual_errors(name: str) -> None:
    assert outcome_of(Setup(DISPLAY, plan(name)), 40).count == 40


def test_out_of_the_funnel_the_bow_decides() -> None:
    made = short_cut(plan("level-up-peak"))
    share = outcome_of(Setup(DISPLAY, made, BOWS), 400)
    low, high = share.interval
    truth = leaning_up(BOWS.bow)
    assert 0.2 < truth < 0.45
    assert low < truth < high
    # The wider the bows, the less the weight matters: half of them lean up.
    low, high = outcome_of(Setup(DISPLAY, made, replace(BOWS, bow=mm(200.0))), 200).interval
    assert low < 0.5 < high
    # The other errors change which runs fail, and hardly how many.
    assert 0.1 < outcome_of(Setup(DISPLAY, made), 100).value < 0.6


def test_seeds_end_as_they_did_before_displays_had_errors() -> None:
    setup = Setup(DISPLAY, short_cut(plan("level-up-peak")))
    runs = [play_run(setup, seed) for seed in range(40)]
    assert "".join(run.endings[0][0] for run in runs) == "vvvvvpvvpvvpvvpvvvppvvvppppvvpvpvpvvvpvv"
    assert [run.size for run in runs[:3]] == pytest.approx([0.663720105, 0.697594422, 1.143688472], abs=1e-9)
    rough = Setup(DISPLAY, plan("staggered-asymmetric-peak"), Errors(angle=deg(6.0)))
    # Of seed 34 the peak was called lost: see below.
    endings = "".join(play_run(rough, seed).endings[0][0] for seed in range(40))
    assert endings == "ptptptppttpppppttpttpppppptpppppptpptppp"


def test_a_rod_that_falls_lands() -> None:
    # One descent in 3,000 got stuck beside the bottom, and the peak that it was in was called lost.
    for name in ("level-up-peak", "level-neutral-peak", "level-asymmetric-peak"):
        assert play_run(Setup(DISPLAY, plan(name)), 2420).endings == ("peak",)


def test_errors_that_are_too_large_break_a_plan() -> None:
    setup = Setup(DISPLAY, plan("level-up-peak"), Errors(angle=deg(25.0)))
    runs = list(run_trials(setup, range(1, 61)))
    outcome = summarise(setup, runs)
    assert 0 < outcome.total.count < 60
    assert sum(reason.runs for reason in outcome.reasons) == 60 - outcome.total.count
    failed = [run for run in runs if run.endings != ("peak",)]
    assert outcome.worst in failed
    assert outcome.worst is not None
    assert outcome.worst.size == min(run.size for run in failed)
    # Its seed alone plays it again.
    assert play_run(setup, outcome.worst.seed) == outcome.worst


def test_a_seed_stands_for_a_run_whoever_plays_it() -> None:
    setup = Setup(DISPLAY, short_cut(plan("level-up-peak")))
    alone = list(run_trials(setup, range(5, 25)))
    assert list(run_trials(setup, range(5, 25), jobs=2)) == alone
    assert [play_run(setup, seed) for seed in range(15, 25)] == alone[10:]
    assert len({run.size for run in alone}) == 20
    assert len({run.endings for run in alone}) == 2


def test_a_rod_that_is_pulled_between_nodes_out_of_line_is_no_good_way() -> None:
    fed = 60.0
    out, slack = ((fed, 30.0, 0.0), (-fed, -30.0, 0.0)), ((fed, 0.0, 0.0), (-fed, 0.0, 0.0))
    pulled = by_hand(DISPLAY, slack, out, ((0.0, 30.0, 0.0), (0.0, -30.0, 0.0)), out, wanted=("peak",))
    run = play_run(Setup(DISPLAY, pulled, NONE), 1)
    assert run.endings == (TAUT,)
    (reason,) = summarise(Setup(DISPLAY, pulled, NONE), [run]).reasons
    assert str(reason) == "segment 1 is pulled taut between nodes that are out of line"
    # Level nodes may draw the rod straight, also if they are only level as far as they know.
    drawn = by_hand(DISPLAY, slack, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), wanted=("straight",))
    assert play_run(Setup(DISPLAY, drawn, NONE), 1).endings == ("straight",)
    assert outcome_of(Setup(DISPLAY, drawn, Errors(angle=deg(2.0))), 40).count == 40


def test_an_axis_that_lags_matters_only_outside_the_funnel() -> None:
    uneven = replace(NONE, unevenness=1.0)
    for name in PEAKS:
        assert outcome_of(Setup(DISPLAY, plan(name), uneven), 20).count == 20
    # All in one step: whether the rod is biased before it gets slack is a matter of luck.
    made = plan("level-up-peak")
    leap = replace(made, steps=made.steps[-1:])
    assert (
        0 < outcome_of(Setup(DISPLAY, replace(leap, steps=(replace(leap.steps[0], number=1),)), uneven), 60).count < 60
    )


def courses(errors: Errors, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Where the axes are at the barriers of as many runs, (runs, steps+1, nodes, 3), and where they are meant to be."""
    setup = Setup(DISPLAY, plan("staggered-down-peak"), errors)
    runs = [course_of(setup, draw(setup, seed)).values[::PIECES] for seed in range(count)]
    exact = course_of(replace(setup, errors=NONE), draw(setup, 0)).values[::PIECES]
    return np.array(runs), exact


def test_errors_of_calibration_stay_and_play_is_fresh() -> None:
    sizes = replace(NONE, feed=mm(0.4), angle=deg(2.0), height=mm(0.1))
    runs, exact = courses(sizes, 400)
    missed = (runs - exact) / np.array([sizes.feed, sizes.angle, sizes.height])
    spread = np.cov(missed.transpose(1, 0, 2, 3).reshape(len(exact), -1))
    # A normal error of size 1 that all barriers share, and a uniform one between -1 and 1 for each.
    expected = np.ones_like(spread) + np.eye(len(exact)) / 3.0
    assert np.max(np.abs(spread - expected)) < 0.12
    assert np.max(np.abs(missed - missed.mean(axis=1, keepdims=True))) < 2.0


def test_the_scale_of_a_feed_errs_with_what_is_fed() -> None:
    runs, exact = courses(replace(NONE, feed_scale=0.002), 400)
    missed = runs - exact
    assert np.all(missed[..., 1:] == 0.0)
    assert np.all(missed[:, 0] == 0.0)
    parts = missed[:, -1, :, 0] / exact[-1, :, 0]
    assert np.std(parts) == pytest.approx(0.002, rel=0.1)
    assert missed[:, 1, :, 0] / exact[1, :, 0] == pytest.approx(parts)


@pytest.mark.parametrize("unevenness", [0.0, 0.5, 1.0])
def test_every_axis_has_its_own_lag_and_speed(unevenness: float) -> None:
    setup = Setup(DISPLAY, plan("level-up-peak"), replace(NONE, unevenness=unevenness))
    fed = np.array([course_of(setup, draw(setup, seed)).values[: PIECES + 1, :, 0] for seed in range(400)])
    progress = fed / fed[:, -1:]
    assert np.all(np.diff(progress, axis=1) >= 0.0)
    assert np.all(progress[:, 0] == 0.0)
    middle = progress[:, PIECES // 2]
    late, early = np.mean(middle == 0.0), np.mean(middle == 1.0)
    # Half a step late: never if at most that; of all lags up to a whole step, half of them.
    assert late == pytest.approx(0.5 if unevenness == 1.0 else 0.0, abs=0.05)
    assert (early > 0.0) == (unevenness == 1.0)
    assert (np.std(middle) > 0.1) == (unevenness > 0.0)


def test_segments_are_counted_by_themselves_and_together() -> None:
    quad = read_display("quad")
    fed = 60.0
    row = tuple((fed * (2 - node), 0.0, 0.0) for node in range(5))
    wanted = ("peak", "valley", "valley", "peak")
    setup = Setup(quad, by_hand(quad, row, wanted=wanted), BOWS)
    runs = list(run_trials(setup, range(60)))
    outcome = summarise(setup, runs)
    assert [share.count for share in outcome.segments] == [
        sum(run.endings[place] == name for run in runs) for place, name in enumerate(wanted)
    ]
    assert outcome.total.count == sum(run.endings == wanted for run in runs)
    assert outcome.total.count < min(share.count for share in outcome.segments)
    # The bows of neighbours have nothing to do with each other.
    assert len({run.endings for run in runs}) > 8


def test_a_known_state_at_the_start_is_kept() -> None:
    made = plan("level-up-peak")
    there = replace(made, start=made.steps[-1].targets, steps=(replace(made.steps[-1], number=1),))
    for name in ("peak", "valley"):
        assert play_run(Setup(DISPLAY, replace(there, shows=(name,)), NONE), 1).endings == (name,)


def test_reasons_are_told_in_words() -> None:
    assert str(Reason(2, "valley", 1)) == "segment 2 ends as the valley"
    assert str(Reason(1, LOST, 1)) == "segment 1 falls into no state that was found"
    setup = Setup(DISPLAY, plan("level-up-peak"))
    runs = [
        TrialRun(1, ("peak",), 1.0),
        TrialRun(2, (LOST,), 2.0),
        TrialRun(3, ("valley",), 1.5),
        TrialRun(4, ("valley",), 3.0),
    ]
    outcome = summarise(setup, runs)
    assert outcome.reasons == (Reason(1, "valley", 2), Reason(1, LOST, 1))
    assert outcome.worst == runs[2]
    assert summarise(setup, runs[:1]).worst is None


@pytest.mark.parametrize(
    ("count", "runs", "low", "high"), [(8, 10, 0.4902, 0.9433), (0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0)]
)
def test_intervals_are_wilsons(count: int, runs: int, low: float, high: float) -> None:
    assert Share(count, runs).interval == pytest.approx((low, high), abs=5e-5)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    runs, truth = 60, 0.9
    chances = [math.comb(runs, count) * truth**count * (1.0 - truth) ** (runs - count) for count in range(runs + 1)]
    held = 0.0
    for count, chance in enumerate(chances):
        low, high = Share(count, runs).interval
        held += chance if low <= truth <= high else 0.0
    assert 0.93 < held < 0.97


@pytest.mark.parametrize("wrong", [{"feed": -1.0}, {"angle": math.nan}, {"unevenness": 1.5}, {"bow": math.inf}])
def test_sizes_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InvalidInput):
        Errors(**wrong)


def test_a_plan_is_played_on_its_own_display() -> None:
    with pytest.raises(InvalidInput, match="not planned for display quad"):
        Setup(read_display("quad"), plan("level-up-peak"))


@pytest.mark.parametrize(("fed", "ending"), [(60.0, LOST), (0.5, "valley")])
def test_only_a_rod_with_somewhere_to_fall_is_lost(monkeypatch: pytest.MonkeyPatch, fed: float, ending: str) -> None:
    def falling(poses: Array, segment: ClampedRod, start: State | None, bow: float) -> tuple[State | None, list[Event]]:
        return buckle(Pose(*poses[-1]), segment.bearing), [Event(FELL, PIECES, None)]

    monkeypatch.setattr("curveline.replay.monte_carlo.move_through", falling)
    slack = ((fed, 0.0, 0.0), (-fed, 0.0, 0.0))
    setup = Setup(DISPLAY, by_hand(DISPLAY, slack, slack, wanted=("valley",)), NONE)
    assert play_run(setup, 1).endings == (ending,)
