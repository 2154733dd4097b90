"""Plans can be looked at: panels of their steps, a film of the way; curves are the physics' and meet the nodes."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import matplotlib
import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

import curveline
from curveline.drive_settings import drive_settings
from curveline.figures import film, planfilms, plans
from curveline.figures.common import COLOURS, MOTION, PIXELS_PER_INCH, THICK, THIN
from curveline.plan_file import NodeTarget, Plan
from curveline.planning.tours import make_plan
from curveline.replay.plan_animation import Course, moment_count, play, stills
from curveline.replay.playback import Snap
from curveline.rod.problem import Array
from curveline.scene import STRAIGHT, Display, Node
from curveline.shapes.files import read_display
from playing import counts_of, plan, scene

PEAK, VALLEY = "level-up-peak", "staggered-down-valley"
DISPLAY = scene(PEAK).display
QUAD = read_display("quad")
INTERVAL = 0.2
LEGEND = round(0.35 * film.PIXELS_PER_INCH)
"""Rows of a frame, the lowest, that its legend takes."""


def wave() -> Plan:
    """A plan of four segments: rod for all, all nodes turn, then they rise and feed on at once."""
    drive = drive_settings(QUAD)

    def targets(feeds: Sequence[float], angles: Sequence[float], heights: Sequence[float]) -> tuple[NodeTarget, ...]:
        made = []
        for values in zip(feeds, angles, heights, strict=True):
            counts = [axis.counts(value) for axis, value in zip(drive.axes, values, strict=True)]
            made.append(NodeTarget(*values, counts=(counts[0], counts[1], counts[2])))
        return tuple(made)

    flat = (0.0,) * 5
    feeds, more = (80.0, 40.0, 0.0, -40.0, -80.0), (120.0, 60.0, 0.0, -60.0, -120.0)
    angles = (40.0, -40.0, 40.0, -40.0, 40.0)
    some = plan(PEAK).steps[0]
    ends = [(feeds, flat, flat), (feeds, angles, flat), (more, angles, (0.0, 20.0, 0.0, -20.0, 40.0))]
    names = [("peak|valley",) * 4, ("peak", "valley") * 2, ("peak", "valley") * 2]
    steps = [
        replace(some, number=number, seconds=5.0, targets=targets(*end), lengths_mm=(540.0,) * 4, states=states)
        for number, (end, states) in enumerate(zip(ends, names, strict=True), start=1)
    ]
    start = targets(flat, flat, flat)
    return Plan("wave", drive, start, tuple(steps), names[-1], (540.0,) * 4, provenance={"display": "quad"})


def long_plan(repeats: int) -> Plan:
    """A plan that goes through the steps of another over and over, and completes no shape."""
    steps = plan(VALLEY).steps * repeats
    numbered = tuple(replace(step, number=number, shape="") for number, step in enumerate(steps, start=1))
    return replace(plan(VALLEY), steps=numbered)


@pytest.fixture(scope="module")
def course() -> Course:
    return play(plan(PEAK), DISPLAY, INTERVAL)


@pytest.fixture(scope="module")
def svg() -> str:
    return plans.draw(plan(PEAK), DISPLAY, kind="svg").decode()


def drawn(text: str, stem: str) -> list[str]:
    """The names, after their stem, of all curves in a figure of which it begins the name."""
    return re.findall(rf'id="{stem}-([^"]+)"', text)


def assert_held(curve: Array, index: int, nodes: Sequence[Node], display: Display) -> None:
    """A curve goes from pivot to pivot and leaves both the way that the bearings point."""
    left, right = nodes[index], nodes[index + 1]
    span = display.span
    np.testing.assert_allclose(curve[0], (index * span, left.height), atol=1e-12)
    np.testing.assert_allclose(curve[-1], ((index + 1) * span, right.height), atol=1e-12)
    for (across, up), node in ((curve[1] - curve[0], left), (curve[-1] - curve[-2], right)):
        assert np.arctan2(up, across) == pytest.approx(node.angle, abs=1e-6)


@pytest.mark.parametrize("make", [partial(plan, PEAK), partial(plan, VALLEY), wave], ids=[PEAK, VALLEY, "wave"])
def test_curves_of_stills_begin_and_end_in_the_bearings(make: Callable[[], Plan]) -> None:
    made = make()
    display = QUAD if made.name == "wave" else DISPLAY
    pictures = stills(made, display)
    assert len(pictures) == len(made.steps) + 1
    for picture, step in zip(pictures[1:], made.steps, strict=True):
        for index, curves in enumerate(picture.curves):
            assert set(curves) == set(step.states[index].split("|"))
            for curve in curves.values():
                assert_held(curve, index, picture.nodes, display)


def test_at_home_the_rod_is_straight() -> None:
    home = stills(plan(PEAK), DISPLAY)[0]
    assert [set(curves) for curves in home.curves] == [{STRAIGHT}]
    assert np.ptp(home.curves[0][STRAIGHT][:, 1]) == 0.0


def test_every_moment_has_its_curve_between_its_bearings(course: Course) -> None:
    assert [moment.states for moment in course.moments[:1]] == [(STRAIGHT,)]
    for moment in course.moments[1:]:
        assert_held(moment.curves[0], 0, moment.nodes, DISPLAY)


def test_a_plan_out_of_a_known_state_is_played_from_it() -> None:
    """No funnel here: the rod of the first step would stay in whatever it shows."""
    here = counts_of(plan(PEAK).steps[-1].targets)
    direct = make_plan(scene("level-neutral-peak"), here, ("peak",))
    assert direct.steps[0].states == ("peak",)
    assert [set(curves) for curves in stills(direct, DISPLAY)[0].curves] == [{"peak"}]
    played = play(direct, DISPLAY, INTERVAL)
    assert {moment.states for moment in played.moments} == {("peak",)}
    assert played.snaps == ()
    # Through a funnel it does not matter what the display shows first, so that both are there.
    funnel = make_plan(scene("level-neutral-peak"), here)
    assert [set(curves) for curves in stills(funnel, DISPLAY)[0].curves] == [{"peak", "valley"}]


def test_a_plan_that_begins_in_a_state_that_does_not_exist_is_still_drawn_and_played() -> None:
    """Nobody plans that, but a plan is a file."""
    there = replace(plan(VALLEY), start=plan(VALLEY).steps[-2].targets, steps=plan(VALLEY).steps[-1:])
    odd = replace(there, shows=("middle-7",))
    assert stills(odd, DISPLAY)[0].curves == ({},)
    assert drawn(plans.draw(odd, DISPLAY, kind="svg").decode(), "after")[-1] == "1-1-valley"
    assert play(odd, DISPLAY, INTERVAL).moments[-1].states == ("valley",)


def test_the_last_moment_is_the_simulated_shape(course: Course) -> None:
    last = course.moments[-1]
    assert last.states == plan(PEAK).wanted
    wanted = curveline.simulate(scene(PEAK))[0].wanted
    assert wanted is not None
    np.testing.assert_allclose(last.curves[0], wanted.curve(last.curves[0].shape[0]), atol=3e-4)


def test_the_rod_of_a_course_snaps_once_and_is_seen_before_and_after(course: Course) -> None:
    (snap,) = course.snaps
    after = next(moment for moment in course.moments if moment.seconds == snap.seconds)
    before = course.moments[course.moments.index(after) - 1]
    assert (before.states, after.states) == (("valley",), ("peak",))
    middle = before.curves[0].shape[0] // 2
    assert before.curves[0][middle, 1] < -0.03 < 0.1 < after.curves[0][middle, 1]


def test_nodes_leave_and_arrive_slowly_and_together(course: Course) -> None:
    bias = [moment for moment in play(plan(PEAK), DISPLAY, 0.05).moments if moment.step == 2]
    left, right = (np.array([moment.nodes[side].angle for moment in bias]) for side in (0, 1))
    np.testing.assert_allclose(left, -right, atol=1e-12)
    speeds = np.diff(left)
    assert speeds[0] < 0.5 * speeds[len(speeds) // 2] > speeds[-1] > 0.0


def test_moments_are_evenly_spread_and_steps_end_at_them(course: Course) -> None:
    seconds = np.array([moment.seconds for moment in course.moments])
    assert np.all(np.diff(seconds) > 0.0)
    assert np.max(np.diff(seconds)) <= INTERVAL + 2e-3
    ends = np.cumsum([step.seconds for step in plan(PEAK).steps])
    for end in ends:
        assert np.min(np.abs(seconds - end)) < 0.01
    assert len(seconds) == moment_count(plan(PEAK), INTERVAL)


def test_a_panel_for_the_start_and_one_for_every_step_that_moves_something(svg: str) -> None:
    steps = plan(PEAK).steps
    assert steps[-1].targets == steps[-2].targets
    assert len(re.findall(r'id="axes_\d+"', svg)) == 6
    biased = f"bias {steps[1].targets[0].bias_deg:.0f}, \N{MINUS SIGN}{steps[1].targets[0].bias_deg:.0f} deg"
    timed = [f"{step.number} {step.action}, {step.seconds:.1f} s" for step in steps[:-1]]
    # The last step moves nothing, but completes the shape.
    for heading in ("start", *timed, biased, "rod 660 mm", "level-up-peak: peak"):
        assert f">{heading}</text>" in svg
    assert "5 steps, 6.9 s; in 1 of them nothing moves" in svg
    assert "5 translate" not in svg
    assert drawn(svg, "after") == [
        "0-1-straight",
        "1-1-peak",
        "1-1-valley",
        *(f"{step}-1-peak" for step in range(2, 5)),
    ]
    assert drawn(svg, "before") == ["1-1-straight", "2-1-peak", "2-1-valley", *(f"{k}-1-peak" for k in range(3, 5))]


def test_what_is_complete_without_a_move_is_said_where_it_was_moved_last() -> None:
    steps = plan(VALLEY).steps
    again = replace(steps[-1], number=len(steps) + 1, shape="the same", seconds=0.0)
    twice = replace(plan(VALLEY), steps=(*steps, again, replace(again, number=again.number + 1)))
    assert plans._completed(twice) == ["", "", "", "", "", f"{VALLEY}: valley\nthe same: valley"]
    # A plan that begins where its shape is.
    there = replace(plan(VALLEY), start=steps[-1].targets, steps=(again,), shows=("valley",))
    text = plans.draw(there, DISPLAY, kind="svg").decode()
    assert drawn(text, "after") == ["0-1-valley"]
    assert ">the same: valley</text>" in text


def test_what_may_be_either_is_thin_and_what_is_certain_thick(svg: str) -> None:
    for name, either in (("1-1-peak", True), ("1-1-valley", True), ("2-1-peak", False)):
        part = svg.split(f'id="after-{name}"')[1].split("</g>")[0]
        assert f"stroke-width: {THIN if either else THICK}" in part
    assert "stroke-dasharray" not in svg
    assert ">thin: in one of them</text>" in svg


def test_arrows_stand_where_something_moves() -> None:
    count = {
        name: plans.draw(plan(name), DISPLAY, kind="svg").decode().count(MOTION.lower()) for name in (PEAK, VALLEY)
    }
    # Two nodes in four steps, a shaft and a head each, and a line in the legend; one node of the other plan also rises.
    assert count[VALLEY] - count[PEAK] == (count[PEAK] - 1) / 8


def test_panels_of_four_segments_show_all_of_them() -> None:
    text = plans.draw(wave(), QUAD, kind="svg").decode()
    assert len(drawn(text, "after")) == 4 + 8 + 4 + 4
    assert ">wave: peak, valley, peak, valley</text>" in text
    assert ">rod 540 mm</text>" in text


def test_many_states_are_counted_and_many_values_told_by_their_range() -> None:
    assert plans.told(("peak", "valley", "peak")) == "peak, valley, peak"
    assert plans.told(("peak", "valley", "valley", "peak", "valley") * 4) == "8 times peak, 12 times valley"
    assert plans._listed((540.0, 540.04)) == "540"
    assert plans._listed((0.04, -0.04)) == "0"
    assert plans._listed(tuple(range(-6, 4))) == "\N{MINUS SIGN}6 to 3"


def test_the_same_plan_is_the_same_bytes_whatever_the_users_style(svg: str) -> None:
    with matplotlib.rc_context({"axes.facecolor": "red", "lines.linewidth": 9.0, "font.size": 30.0}):
        assert plans.draw(plan(PEAK), DISPLAY, kind="svg").decode() == svg
    assert "<dc:date>" not in svg


def test_a_png_is_as_wide_as_its_panels_and_tells_how_far_it_is() -> None:
    heard: list[int] = []
    image = imread(io.BytesIO(plans.draw(plan(PEAK), DISPLAY, heard.append, kind="png")))
    # How often matplotlib draws a panel is its own affair.
    assert heard == list(range(1, len(heard) + 1))
    assert 2 * 5 <= len(heard) <= plans.parts_of(plan(PEAK)) == 3 * 5
    assert image.shape[1] == round(3 * plans.PANEL_WIDTHS[1] * PIXELS_PER_INCH)


def test_of_many_steps_some_are_shown_and_the_figure_says_so() -> None:
    assert plans.chosen_of(7) == list(range(7))
    chosen = plans.chosen_of(101)
    assert (chosen[0], chosen[-1], len(set(chosen))) == (0, 100, plans.MOST_PANELS)
    assert max(np.diff(chosen)) <= 5
    assert {7, 8, 9} < set(plans.chosen_of(101, [7, 8, 9]))
    assert plans.chosen_of(101, range(1, 100))[:2] == [0, 4]
    text = plans.draw(long_plan(8), DISPLAY, kind="svg").decode()
    assert len(re.findall(r'id="axes_\d+"', text)) == plans.MOST_PANELS
    assert f"{plans.MOST_PANELS - 1} of the steps are shown" in text


def frames_of(data: bytes) -> tuple[list[Array], int]:
    """The frames of a GIF as RGB arrays, and how long they all take [ms]."""
    frames, total = [], 0
    with Image.open(io.BytesIO(data)) as image:
        for index in range(image.n_frames):
            image.seek(index)
            frames.append(np.asarray(image.convert("RGB"), dtype=float))
            total += image.info["duration"]
    return frames, total


def nearest(frame: Array, colour: str) -> Array:
    """Pixels (k, 2) of a frame, above its legend, that have a colour."""
    wanted = [int(colour[place : place + 2], 16) for place in (1, 3, 5)]
    return np.argwhere(np.abs(frame - wanted).max(axis=2)[:-LEGEND] < 3.0)


def test_a_film_takes_as_long_as_the_plan_and_ends_in_the_wanted_colour() -> None:
    heard: list[int] = []
    made = plan(PEAK)
    data = planfilms.animate(made, DISPLAY, heard.append)
    frames, total_ms = frames_of(data)
    assert heard == list(range(1, planfilms.parts_of(made) + 1))
    assert len(frames) <= len(heard) // 2
    assert total_ms == pytest.approx(1e3 * made.seconds + planfilms.FIRST_MS + planfilms.LAST_MS, abs=30)
    assert len(nearest(frames[0], COLOURS["valley"])) == 0
    assert len(nearest(frames[len(frames) // 4], COLOURS["valley"])) > 100
    assert len(nearest(frames[-1], COLOURS["peak"])) > 100
    assert data == planfilms.animate(made, DISPLAY)


def test_a_long_plan_runs_faster_so_that_the_film_stays_short() -> None:
    made = long_plan(40)
    speed = planfilms.speed_of(made)
    assert made.seconds / speed <= planfilms.LONGEST_S
    assert planfilms.speed_of(plan(PEAK)) == 1.0
    assert planfilms.parts_of(made) <= 2 * (planfilms.LONGEST_S * planfilms.FRAMES_PER_SECOND + len(made.steps) + 1)


def test_a_film_of_four_segments_shows_them_all() -> None:
    frames, _ = frames_of(planfilms.animate(wave(), QUAD))
    assert frames[0].shape[1] == round(film.PIXELS_PER_INCH * (planfilms.NARROW + 4 * planfilms.PER_SEGMENT))
    for colour in (COLOURS["peak"], COLOURS["valley"]):
        columns = nearest(frames[-1], colour)[:, 1]
        assert np.ptp(columns) > 0.5 * frames[0].shape[1]


def test_a_rod_that_is_lost_is_not_drawn(monkeypatch: pytest.MonkeyPatch, course: Course) -> None:
    lost = [replace(moment, curves=(np.empty((0, 2)),), states=("lost",)) for moment in course.moments[3:]]
    changed = Course((*course.moments[:3], *lost), (Snap(lost[0].seconds, 1, "valley", "lost"),))
    monkeypatch.setattr(planfilms, "play", lambda *_: changed)
    frames, _ = frames_of(planfilms.animate(plan(PEAK), DISPLAY))
    for colour in (COLOURS["peak"], COLOURS["valley"]):
        assert len(nearest(frames[-1], colour)) == 0
    assert len(nearest(frames[2], COLOURS["valley"])) > 100


def test_a_plan_that_moves_nothing_is_one_panel_and_one_frame() -> None:
    still = replace(plan(PEAK), name="home", steps=(), wanted=(STRAIGHT,))
    frames, total_ms = frames_of(planfilms.animate(still, DISPLAY))
    assert (len(frames), total_ms) == (1, planfilms.LAST_MS)
    assert drawn(plans.draw(still, DISPLAY, kind="svg").decode(), "after") == ["0-1-straight"]
