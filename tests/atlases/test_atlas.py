"""An atlas: the states over a grid, the folds between its points, and what is refused."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import curveline
from curveline.atlases.atlas import Atlas
from curveline.atlases.folds import BIFURCATION, FOLD, PRECISE, TAUT, _Edges, _lines
from curveline.atlases.grid import KEYS, AtlasRequest, grid_of, limits_of, parsed_at, parsed_over
from curveline.atlases.results import to_json, to_npz
from curveline.errors import InvalidInput
from curveline.scene import Node, Range, Scene, Segment
from curveline.units import deg, mm

SINGLE, QUAD = curveline.read_display("single"), curveline.read_display("quad")
LEVEL = Scene("level", SINGLE, (Node(0.0, 0.0),) * 2, (Segment(0.6, "peak"),))
ANGLES = AtlasRequest({"left_deg": (-60, 60, 7), "right_deg": (-60, 60, 7)}, {"length_mm": 560})
USUAL = AtlasRequest({"angle_deg": (-60, 60, 9), "length_mm": (500, 640, 8)})


@pytest.fixture(scope="module")
def angles() -> Atlas:
    return curveline.atlas("single", ANGLES)


@pytest.fixture(scope="module")
def usual() -> Atlas:
    return curveline.atlas("single", USUAL)


def counts_at(found: Atlas, places: Any) -> list[int]:
    """How many states there are at values of both axes, independently of the atlas's own rows."""
    poses = grid_of(found.display, found.request).poses_at(*np.asarray(places, dtype=float).T)
    states = curveline.simulate_poses(LEVEL, poses[:, :5])
    return np.bincount(states.pose, minlength=len(poses)).tolist()


@pytest.mark.parametrize("name", ["angles", "usual"])
def test_the_states_are_those_of_their_poses(name: str, request: pytest.FixtureRequest) -> None:
    found: Atlas = request.getfixturevalue(name)
    states = curveline.simulate_poses(LEVEL, found.poses[:, :5])
    assert found.entries["name"].tolist() == states.name.tolist()
    assert found.entries["pose"].tolist() == states.pose.tolist()
    np.testing.assert_allclose(found.entries["lowest_eigenvalue"], states.lowest_eigenvalue, rtol=1e-9)
    assert found.counts.ravel().tolist() == np.bincount(states.pose, minlength=len(states)).tolist()
    # What a node lifts with is what its clamp does to the rod.
    np.testing.assert_allclose(found.entries["loads"][:, [1, 4]], states.clamp_force[:, :, 1], rtol=1e-9, atol=1e-12)


def test_poses_are_as_the_keys_say(usual: Atlas, angles: Atlas) -> None:
    i, j = 3, 5
    angle, length = usual.axes[0].values()[i], usual.axes[1].values()[j]
    expected = [0.5, 0.0, deg(angle), -deg(angle), mm(length), 0.0]
    np.testing.assert_allclose(usual.poses[i * 8 + j], expected, atol=1e-15)
    left, right = angles.axes[0].values()[1], angles.axes[1].values()[4]
    np.testing.assert_allclose(angles.poses[11], [0.5, 0.0, deg(left), deg(right), 0.56, 0.0], atol=1e-15)


def test_kinds_and_values_are_where_the_states_are(usual: Atlas) -> None:
    assert {"peak, valley", "peak", "valley", "none"} <= set(usual.kinds.ravel().tolist())
    force = usual.over_grid("peak", usual.force)
    assert (~np.isnan(force)).tolist() == [["peak" in kinds.split(", ") for kinds in row] for row in usual.kinds]
    assert sum(each.points for each in usual.tallies()) == usual.kinds.size
    assert {each.name: each.points for each in usual.names()}["peak"] == np.count_nonzero(~np.isnan(force))
    assert all(each.force[0] <= each.force[1] and 0.0 <= each.too_much <= 1.0 for each in usual.names())


def test_folds_are_where_states_come_and_go(angles: Atlas) -> None:
    """Counted on either side, nearer than a hundredth of a degree; the searched points are none of the atlas's own."""
    folds = angles.folds
    assert len(folds.places) > 10
    assert set(folds.kinds.tolist()) == {FOLD}
    assert folds.largest_error <= PRECISE
    step = np.array([axis.values()[1] - axis.values()[0] for axis in angles.axes])
    off_grid = np.abs((folds.places + 60.0) / step - np.round((folds.places + 60.0) / step))
    along = np.eye(2)[np.argmax(off_grid, axis=1)]
    below = counts_at(angles, folds.places - 1.5 * PRECISE * along)
    above = counts_at(angles, folds.places + 1.5 * PRECISE * along)
    assert below == folds.before.tolist()
    assert above == folds.after.tolist()


def test_the_fold_of_a_level_rod_is_known(usual: Atlas) -> None:
    """A clamped arch with both ends at an angle buckles sideways: held against halving by the search of states."""
    folds = usual.folds
    assert set(folds.kinds.tolist()) >= {BIFURCATION, TAUT}
    (place,) = (at for at, kind in zip(folds.places, folds.kinds, strict=True) if kind == BIFURCATION and at[0] == 45.0)
    low, high = 560.0, 600.0
    while high - low > 0.002:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if counts_at(usual, [(45.0, middle)]) == [1] else (low, middle)
    assert place[1] == pytest.approx(low, abs=0.01)


def test_a_rod_is_taut_where_its_clamps_leave_it_no_more(usual: Atlas) -> None:
    for (angle, length), kind in zip(usual.folds.places, usual.folds.kinds, strict=True):
        if kind == TAUT and angle in usual.axes[0].values():
            mouths = 0.5 - 0.02 * np.cos(deg(angle))
            assert mm(length) == pytest.approx(mouths * 1.0005 + 0.02, abs=1e-6)


def test_lines_join_folds_of_one_cell(angles: Atlas, usual: Atlas) -> None:
    for found in (angles, usual):
        step = np.array([axis.values()[1] - axis.values()[0] for axis in found.axes])
        ends = found.folds.places[found.folds.lines]
        assert len(ends) > 10
        assert (np.abs(ends[:, 0] - ends[:, 1]) <= step * (1.0 + 1e-12)).all()


def test_lines_of_a_cell_that_all_sides_are_crossed_of_cut_its_corners_off() -> None:
    counts = np.array([[2, 1], [1, 2]])
    lower, axis = np.array([[0, 0], [0, 1], [0, 0], [1, 0]]), np.array([0, 0, 1, 1])
    before = counts[tuple(lower.T)]
    after = counts[1, 0], counts[1, 1], counts[0, 1], counts[1, 1]
    assert _lines(_Edges(lower, axis), (before, np.array(after)), (2, 2)).tolist() == [[0, 2], [1, 3]]


def test_a_rod_without_weight_does_the_same_upside_down() -> None:
    found = curveline.atlas(replace(SINGLE, gravity=False), ANGLES)
    assert found.counts.tolist() == found.counts[::-1, ::-1].tolist()
    peak, valley = (found.over_grid(name, found.force) for name in ("peak", "valley"))
    np.testing.assert_allclose(peak, valley[::-1, ::-1], rtol=1e-6)


def test_processes_find_the_same(angles: Atlas) -> None:
    again = curveline.atlas("single", ANGLES, jobs=2)
    assert again.entries.tobytes() == angles.entries.tobytes()
    assert [each.tobytes() for each in again.folds] == [each.tobytes() for each in angles.folds]
    assert to_npz(again) == to_npz(angles)


def test_files_have_what_was_found(usual: Atlas) -> None:
    document = json.loads(to_json(usual, ("atlas", "single")))
    arrays = np.load(io.BytesIO(to_npz(usual, ("atlas", "single"))), allow_pickle=False)
    assert document["axes"][1] == {"key": "length_mm", "start": 500, "stop": 640, "count": 8}
    assert document["at"] == {"rise_mm": 0.0}
    assert document["provenance"]["argv"] == ["atlas", "single"]
    assert document["kinds"] == usual.kinds.tolist() == arrays["kinds"].tolist()
    assert len(document["states"]) == len(arrays["state"]) == len(usual.entries)
    assert document["states"][7]["force_N"] == arrays["force_N"][7] == usual.force[7]
    assert document["states"][7]["point"] == arrays["point"][7].tolist()
    np.testing.assert_allclose(arrays["curve_mm"][7][-1], [500.0, 0.0], atol=1e-9)
    assert arrays["second"].tolist() == usual.axes[1].values().tolist()
    assert document["folds"][3]["at"] == arrays["fold_at"][3].tolist()
    assert document["lines"] == arrays["fold_lines"].tolist()
    assert json.loads(str(arrays["document"]))["display"] == "single"


def test_limits_are_those_of_the_display() -> None:
    limits = limits_of(SINGLE)
    assert set(limits) == set(KEYS)
    assert limits["rise_mm"] == pytest.approx((-440.0, 440.0))
    assert limits["angle_deg"] == pytest.approx((-75.0, 75.0))
    assert limits["length_mm"] == pytest.approx((500.0, 900.0))
    leaning = replace(SINGLE, limits=replace(SINGLE.limits, angle=Range(deg(-10.0), deg(40.0))))
    assert limits_of(leaning)["angle_deg"] == pytest.approx((-10.0, 10.0))
    grid = grid_of(SINGLE, AtlasRequest({"left_deg": None, "rise_mm": None}))
    assert grid.fixed == pytest.approx({"right_deg": 0.0, "length_mm": 700.0})


def test_texts_are_read() -> None:
    assert parsed_over(["angle_deg,length_mm=510:700:39"]) == {"angle_deg": None, "length_mm": (510.0, 700.0, 39)}
    assert parsed_at(["rise_mm=50", "left_deg=-1e1"]) == {"rise_mm": 50.0, "left_deg": -10.0}
    for text in ("length_mm=", "length_mm=1:2", "length_mm=1:2:3:4", "length_mm=a:b:3", "length_mm=1:2:3.5"):
        with pytest.raises(InvalidInput, match="is no range"):
            parsed_over([text])
    with pytest.raises(InvalidInput, match="twice"):
        parsed_over(["rise_mm", "rise_mm=0:1:2"])
    with pytest.raises(InvalidInput, match="gives no number"):
        parsed_at(["rise_mm"])


@pytest.mark.parametrize(
    ("over", "at", "message"),
    [
        ({"angle_deg": None}, {}, "over two keys, not 1"),
        ({"angle_deg": None, "lenght_mm": None}, {}, "no number 'lenght_mm'"),
        ({"angle_deg": None, "left_deg": None}, {}, "both angles"),
        ({"angle_deg": None, "length_mm": None}, {"left_deg": 3.0}, "both angles"),
        ({"angle_deg": None, "length_mm": None}, {"length_mm": 600.0}, "runs, and stands still"),
        ({"angle_deg": (0, 80, 3), "length_mm": None}, {}, "angle_deg = 80: the display allows"),
        ({"angle_deg": (0, float("nan"), 3), "length_mm": None}, {}, "angle_deg = nan"),
        ({"angle_deg": (10, 10, 3), "length_mm": None}, {}, "does not run"),
        ({"angle_deg": (0, 10, 1), "length_mm": None}, {}, "does not run"),
        ({"angle_deg": (20, 10, 3), "length_mm": None}, {}, "does not run"),
        ({"angle_deg": (0, 10, 2000), "length_mm": (500, 600, 2000)}, {}, "more than 1,000,000"),
        ({"angle_deg": None, "rise_mm": None}, {"length_mm": 2000.0}, "length_mm = 2000: the display allows"),
    ],
)
def test_what_is_no_grid_is_refused(over: Any, at: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        curveline.atlas("single", AtlasRequest(over, at))


def test_other_misuse_is_refused() -> None:
    with pytest.raises(InvalidInput, match="tolerance"):
        AtlasRequest(tolerance=0.0)
    with pytest.raises(InvalidInput, match="processes of this machine"):
        curveline.atlas("single", jobs=2, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(TypeError, match="a display"):
        curveline.atlas(3)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="planar"):
        curveline.atlas(replace(SINGLE, down=(0.0, -0.8, -0.6)))
