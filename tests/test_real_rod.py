"""The page *What a real rod adds*: its numbers are those of `docs/tools/real_rod.py`, and these are right."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import real_rod_budget
import real_rod_figures
import real_rod_limits
from real_rod_leaning import held, leaning_limit, settled
from real_rod_limits import LEVEL, STAGGERED, limit
from real_rod_rods import Change, after, as_it_is, giving, gravity_length, read, state_of

from curveline.calibrating.bent_rod import BentSegment, states_of
from curveline.calibrating.unknowns import Unknowns
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Scene
from curveline.simulation.simulate import simulate
from curveline.units import deg, to_deg

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "real-rod.md").read_text()
LIMITS, BUDGET = re.findall(r"^```console\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def printed(table: str, cause: str, count: int) -> list[float]:
    """The first numbers of a row of a table of the page."""
    (row,) = re.findall(rf"^{re.escape(cause)}  +(.*)$", table, re.MULTILINE)
    return [float(each) for each in row.split()[:count]]


def turned(scene: Scene, right: float) -> Scene:
    return replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=deg(right))))


CHANGES: dict[str, Change] = {
    "the rod of the display file": as_it_is,
    "10min in the peak": after("peak@10min"),
    "1h in the valley": after("valley@1h"),
    "clamps give 20 mm: 25 N mm/deg": giving(20.0),
    "gravity length 300 mm": gravity_length(300.0),
}


@pytest.mark.parametrize("cause", CHANGES)
def test_limits_are_as_printed_and_where_a_search_has_them(cause: str) -> None:
    level, *_, staggered = printed(LIMITS, cause, 2 if cause == next(iter(CHANGES)) else 3)
    for name, told in ((LEVEL, level), (STAGGERED, staggered)):
        scene = CHANGES[cause](read(name))
        end = limit(scene)
        assert end == pytest.approx(told, abs=0.06)
        assert simulate(turned(scene, end - 0.02))[0].wanted
        assert not simulate(turned(scene, end + 0.02))[0].wanted


def test_coarse_edges_end_earlier_as_the_page_says() -> None:
    assert limit(read(LEVEL), 48) == pytest.approx(50.32, abs=0.01)
    assert limit(read(LEVEL)) == pytest.approx(50.47, abs=0.01)


@pytest.mark.parametrize("name", [LEVEL, STAGGERED])
def test_a_rod_of_its_own_ends_where_the_others_do(name: str) -> None:
    assert leaning_limit(read(name), 0.0) == pytest.approx(limit(read(name)), abs=0.01)


def test_a_rod_that_is_harder_to_bend_one_way_ends_as_printed() -> None:
    scene = read(LEVEL)
    for cause, share in real_rod_limits.leanings():
        (told,) = printed(LIMITS, cause, 1)
        assert leaning_limit(scene, share) == pytest.approx(told, abs=0.06), cause


@pytest.mark.parametrize("share", [0.1, -0.1])
def test_such_a_rod_is_as_calibration_has_it(share: float) -> None:
    """A degree before it ends: by Newton's method here, by a natural curvature that follows the curve there."""
    scene = turned(read(LEVEL), 49.0)
    bent = BentSegment(scene, 0, Unknowns(2))
    numbers = Unknowns(2).of_display(scene.display)
    numbers[1:3] = 0.0, share
    there = states_of(bent, numbers)["peak"]
    here = settled(held(scene, deg(49.0), share), (there.angles, there.multipliers))
    assert here is not None
    assert np.max(np.abs(here[0] - there.angles)) < deg(0.01)


def test_all_that_is_changed_has_a_row_on_the_page() -> None:
    for cause, _ in (*real_rod_limits.changes(), *real_rod_limits.leanings()):
        assert f"\n{cause}  " in LIMITS, cause
    for cause, _ in real_rod_budget.causes():
        assert f"\n{cause}  " in BUDGET, cause


QUICK = ("set: 10 % of the other state", "set: 20 % of the other state", "clamps give 10 mm: 49 N mm/deg", "stretch")


@pytest.mark.parametrize("cause", [*QUICK, "clamp length 20 -> 0 mm", "both angles + 1 deg", "1min in the other state"])
def test_the_budget_is_as_printed(cause: str) -> None:
    does = dict(real_rod_budget.causes())[cause]()
    assert printed(BUDGET, cause, 4) == pytest.approx([does.along, does.mean, does.worst, does.height], abs=0.006)


INDEPENDENT = {
    "set: 20 % of the other state": 4.9,
    "clamp length 20 -> 0 mm": 5.4,
    "both angles + 1 deg": 1.6,
    "span + 2 mm": 1.4,
    "length + 1 mm": 0.4,
    "E - 15 %": 0.15,
    "uniform natural curvature of 1 1/m": 0.0,
}
"""Mean over the shapes [mm] as another solver has it."""


def test_means_are_those_of_another_solver() -> None:
    causes = dict(real_rod_budget.causes())
    for cause, told in INDEPENDENT.items():
        assert causes[cause]().mean == pytest.approx(told, abs=0.07), cause
    worst = causes["set: 20 % of the other state"]()
    assert worst.worst == pytest.approx(14.9, abs=0.3)
    assert worst.gone == ("staggered-down-peak", "level-asymmetric-valley")


def test_mixtures_of_the_page_make_the_mean_of_the_paper() -> None:
    words, (_, _, clamps_alone) = next(iter(real_rod_budget.MIXTURES.items()))
    assert printed(BUDGET, words.format(10.1), 4)[3] == real_rod_budget.PAPER_MM
    assert real_rod_budget.by(clamps_alone(10.1)).height == pytest.approx(real_rod_budget.PAPER_MM, abs=0.05)
    mixtures = BUDGET.split("\n\n")[1].splitlines()[1:]
    assert [line.split()[-1] for line in mixtures] == ["6.68"] * len(real_rod_budget.MIXTURES)


def tilts(state: Equilibrium) -> list[float]:
    """By how much both bearings tilt [deg]."""
    ends = (state.vertices_table[0, 2], state.vertices_table[-1, 2])
    return [abs(to_deg(float(end) - held)) for end, held in zip(ends, (state.rod.start, state.rod.end), strict=True)]


def test_clamps_that_give_ten_millimetres_tilt_as_the_page_says() -> None:
    found = [state_of(giving(10.0)(read(name))) for name in real_rod_budget.SHAPES]
    largest = [max(tilts(state)) for state in found if state is not None]
    assert len(largest) == 16
    assert [round(min(largest)), round(max(largest))] == [3, 7]
    level = state_of(giving(10.0)(read(LEVEL)))
    assert level is not None
    assert tilts(level) == pytest.approx([4.0, 4.9], abs=0.1)
    near = state_of(giving(20.0)(turned(read(LEVEL), 50.4)))
    assert near is not None
    assert tilts(near) == pytest.approx([8.1, 5.5], abs=0.05)
    forty = [state_of(giving(40.0)(read(name))) for name in (LEVEL, STAGGERED)]
    assert all(state is not None and max(tilts(state)) > 10.0 for state in forty)


def test_heights_are_compared_over_the_width_that_both_curves_have() -> None:
    one = np.column_stack([np.linspace(0.0, 1.0, 11), np.zeros(11)])
    other = np.column_stack([np.linspace(0.2, 1.4, 7), np.full(7, 0.3)])
    assert real_rod_budget.in_height(one, other) == pytest.approx(0.3)
    for name in real_rod_budget.SHAPES:
        assert np.all(np.diff(real_rod_budget.plain(name)[:, 0]) > 0.0)


@pytest.mark.campaign
def test_figures_are_as_they_are_drawn() -> None:
    for name, drawn in real_rod_figures.pictures().items():
        kept = (ROOT / "docs" / "images" / name).read_text()
        assert re.sub(r"-?\d+\.\d", "", drawn) == re.sub(r"-?\d+\.\d", "", kept)
        numbers = [[float(each) for each in re.findall(r"-?\d+\.\d", text)] for text in (drawn, kept)]
        assert numbers[0] == pytest.approx(numbers[1], abs=0.5)


def test_the_page_has_all_figures() -> None:
    for name in real_rod_figures.FIGURES:
        assert f"](images/{name})" in PAGE
        assert (ROOT / "docs" / "images" / name).read_text().endswith("</svg>\n")
