"""Figures of sweeps: a value of every state over one key, a map of which states exist over two."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from curveline.errors import InvalidInput
from curveline.figures import sweeps
from curveline.figures.common import COLOURS, GREY, THICK, THIN
from curveline.rod.problem import Array
from curveline.scene import Scene
from curveline.simulation.batch import report_on
from curveline.simulation.results import Settings
from curveline.simulation.sweep import Sweep, SweepAxis
from curveline.simulation.sweep_files import COLUMNS
from curveline.simulation.sweep_view import (
    PLOTTED,
    StateMap,
    StateValue,
    SweepView,
    ValueCurves,
    gathering,
    view_of,
)

SHAPES = Path(__file__).parents[2] / "shapes"
PEAK = SHAPES / "level-up-peak.toml"
ROOF = SHAPES / "roofline.toml"
ANGLE, LENGTH = "nodes.1.angle_deg=-60:60:7", "segments.1.length_mm=620:700:3"


def gathered(path: Path, *ranges: str, plot: str = "") -> ValueCurves | StateMap:
    """A sweep, simulated point by point."""
    sweep = Sweep(path, ranges)
    found = gathering(view_of(sweep, plot))
    for task in sweep.tasks():
        assert isinstance(task.scene, Scene)
        found.take(found.make(task, report_on(task.scene, Settings(points=2))))
    return found


@pytest.fixture(scope="module")
def curves() -> ValueCurves:
    found = gathered(PEAK, ANGLE)
    assert isinstance(found, ValueCurves)
    return found


def test_a_key_shows_the_segments_that_it_has_to_do_with() -> None:
    def shown(*ranges: str) -> tuple[int, ...]:
        return view_of(Sweep(ROOF, ranges)).segments

    assert shown("nodes.1.angle_deg=0:20:3") == (0,)
    assert shown("nodes.3.angle_deg=0:20:3") == (1, 2)
    assert shown("nodes.5.angle_deg=-20:0:3") == (3,)
    assert shown("segments.2.length_mm=580:600:3") == (1,)
    assert shown("nodes.1.angle_deg=0:20:3", "nodes.3.angle_deg=0:20:3") == (0, 1, 2)
    view = view_of(Sweep(ROOF, ["nodes.1.angle_deg=20:20:1", "segments.4.length_mm=580:600:3"]))
    assert view.segments == (3,)
    assert view.heading == "roofline, nodes.1.angle_deg = 20"
    assert view.plot == "mean_height_mm"


def test_a_load_shows_its_segment(tmp_path: Path) -> None:
    path = tmp_path / "loaded.toml"
    path.write_text(ROOF.read_text() + "loads = [ { segment = 3, at = 0.5, force_N = [0.0, -0.1] } ]\n")
    assert view_of(Sweep(path, ["loads.1.at=0.2:0.8:3"])).segments == (2,)


def test_what_cannot_be_shown_is_refused() -> None:
    three = ["nodes.1.angle_deg=0:9:2", "nodes.2.angle_deg=0:9:2", "segments.1.length_mm=620:630:2"]
    with pytest.raises(
        InvalidInput, match=r"over one key or two, not 3: nodes\.1\.angle_deg, nodes\.2\.angle_deg, segments"
    ):
        view_of(Sweep(PEAK, three))
    with pytest.raises(InvalidInput, match="over two keys the figure is a map") as caught:
        view_of(Sweep(PEAK, three[:2]), "energy_mJ")
    # The advice works.
    assert "KEY=VALUE:VALUE:1" in caught.value.hint
    assert view_of(Sweep(PEAK, [three[0], "nodes.2.angle_deg=9:9:1"]), "energy_mJ").plot == "energy_mJ"
    with pytest.raises(InvalidInput, match="--plot energy: states have no such number") as caught:
        view_of(Sweep(PEAK, three[:1]), "energy")
    assert caught.value.hint.startswith("did you mean energy_mJ? choose one of mean_height_mm, energy_mJ,")
    assert set(PLOTTED) <= set(COLUMNS)


def test_values_are_those_of_the_states(curves: ValueCurves) -> None:
    assert set(curves.curves) == {(0, "peak"), (0, "valley")}
    peak, valley = (curves.curves[0, name] for name in ("peak", "valley"))
    assert list(peak.points) == [1, 2, 3, 4, 5, 6]
    assert list(valley.points) == [0, 1, 2, 3, 4, 5]
    assert all(peak.stays)
    assert min(peak.values) > 40.0
    assert max(valley.values) < -30.0
    energies = gathered(PEAK, ANGLE, plot="energy_mJ")
    assert isinstance(energies, ValueCurves)
    assert list(energies.curves[0, "peak"].values) != list(peak.values)
    assert min(energies.curves[0, "peak"].values) > 0.0


def test_a_curve_per_state_with_what_is_wanted_thick(curves: ValueCurves) -> None:
    text = sweeps.draw(curves, kind="svg").decode()
    assert text == sweeps.draw(curves, kind="svg").decode()
    for said in ("level-up-peak", "nodes.1.angle [deg]", "mean height [mm]", "peak", "valley", "thick: wanted"):
        assert f">{said}</text>" in text
    assert f"stroke: {COLOURS['peak'].lower()}; stroke-width: {THICK}" in text
    assert f"stroke: {COLOURS['valley'].lower()}; stroke-width: {THIN}" in text
    assert "stroke-dasharray" not in text


def test_segments_have_a_panel_each() -> None:
    found = gathered(ROOF, "nodes.3.angle_deg=5:20:2", plot="left_force_x_N")
    text = sweeps.draw(found, kind="svg").decode()
    assert len(re.findall(r'id="axes_\d+"', text)) == 2
    for said in ("roofline", "segment 2", "segment 3", "left force x [N]"):
        assert f">{said}</text>" in text


def test_curves_end_where_a_state_does_and_change_where_it_ceases_to_stay() -> None:
    def pieces(points: list[int], stays: list[bool], number: list[int]) -> list[tuple[int, int]]:
        return list(sweeps._pieces(np.array(points), np.array(stays), np.array(number)))

    ones = [1] * 5
    assert pieces([0, 1, 2, 3, 4], [True] * 5, ones) == [(0, 5)]
    assert pieces([0, 1, 3, 4, 6], [True] * 5, ones) == [(0, 2), (2, 4), (4, 5)]
    # What stays and what does not meet at a point, so that the curve has no gap there.
    assert pieces([0, 1, 2, 3, 4], [True, True, False, False, True], ones) == [(0, 3), (2, 5), (4, 5)]
    # Of two that become three any may be the first.
    assert pieces([0, 1, 2, 3, 4], [True] * 5, [2, 2, 3, 3, 3]) == [(0, 2), (2, 5)]


def view_over(*axes: SweepAxis, plot: str = "mean_height_mm") -> SweepView:
    return SweepView("made up", axes, (), ("peak",), (0,), plot)


def test_what_does_not_stay_is_dashed_and_what_cannot_be_shown_dotted() -> None:
    found = ValueCurves(view_over(SweepAxis("nodes.1.angle_deg", ("nodes", 0, "angle_deg"), 0.0, 3.0, 4)))
    for number in range(4):
        loop = StateValue(0, "loop-1", 2.0, stays=True, can_be_shown=False)
        found.take((number, [StateValue(0, "buckled-1", float(number), stays=number < 2, can_be_shown=True), loop]))
    text = sweeps.draw(found, kind="svg").decode()
    for said in ("buckled", "dashed: does not stay", "not for a planar display"):
        assert f">{said}</text>" in text
    assert "thick" not in text
    # One solid piece and one dashed, then the line of the legend.
    buckled = [part for part in re.findall(r'style="([^"]*)"', text) if COLOURS["buckled"].lower() in part]
    lines = ["stroke-dasharray" in part for part in buckled if "fill: none" in part]
    assert lines == [False, True, False]
    assert re.search(rf"stroke-dasharray: [^;]*; stroke-dashoffset: 0; stroke: {GREY}; stroke-width: 0.9", text)


def pixels(found: StateMap) -> Array:
    """The colours of the cells of a map (rows, columns, 3), the first row at the bottom."""
    image = imread(io.BytesIO(sweeps.draw(found, "png")))[:, :, :3]
    blue = np.array([int(COLOURS["peak"][place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    rows, columns = np.nonzero(np.abs(image - blue).max(axis=2) < 0.01)
    # The patch of the legend lies below the map, and is far smaller.
    cell = [axis.count for axis in found.view.axes]
    keep = rows < 0.8 * image.shape[0]
    left, right, top, bottom = columns[keep].min(), columns[keep].max(), rows[keep].min(), rows[keep].max()
    across, up = ((right - left) / cell[0], (bottom - top) / cell[1])
    places = [
        [(round(bottom - (row + 0.5) * up), round(left + (column + 0.5) * across)) for column in range(cell[0])]
        for row in range(cell[1])
    ]
    return np.array([[image[place] for place in row] for row in places])


@pytest.mark.parametrize("stop", [(1.0, 2.0), (-1.0, 2.0), (1.0, -2.0)])
def test_the_first_key_runs_to_the_right_and_the_second_up(stop: tuple[float, float]) -> None:
    first = SweepAxis("nodes.1.angle_deg", ("nodes", 0, "angle_deg"), 0.0, stop[0], 2)
    second = SweepAxis("nodes.2.angle_deg", ("nodes", 1, "angle_deg"), 0.0, stop[1], 3)
    found = StateMap(view_over(first, second))
    # All corners are peaks but that of the first point.
    for number, states in enumerate(["valley", "peak", "peak", "peak", "peak, valley", "peak"]):
        found.take((number, [states]))
    shown = pixels(found)
    valley = np.array([0xD5, 0x5E, 0x00]) / 255.0
    places = np.argwhere(np.abs(shown - valley).max(axis=2) < 0.02).tolist()
    assert places == [[2 if stop[1] < 0.0 else 0, 1 if stop[0] < 0.0 else 0]]
    both = np.argwhere(np.abs(shown - 0xD9 / 255.0).max(axis=2) < 0.02).tolist()
    assert both == [[1, 0 if stop[0] < 0.0 else 1]]


def test_a_map_counts_what_there_is_whichever_is_the_higher() -> None:
    found = gathered(PEAK, ANGLE, "nodes.2.angle_deg=-60:60:3")
    assert isinstance(found, StateMap)
    assert set(found.combinations) == {"peak", "valley", "peak, valley"}
    text = sweeps.draw(found, kind="svg").decode()
    assert text == sweeps.draw(found, kind="svg").decode()
    for said in ("peak", "valley", "peak, valley", "nodes.1.angle [deg]", "nodes.2.angle [deg]"):
        assert f">{said}</text>" in text
    assert "not simulated" not in text
    twisted = gathered(SHAPES / "space" / "twisted.toml", "nodes.2.roll_deg=90:100:2", "nodes.1.roll_deg=0:5:2")
    assert isinstance(twisted, StateMap)
    assert all(states.split(", ")[:2] == ["peak", "valley"] for states in twisted.combinations if "peak" in states)


def test_points_that_could_not_be_simulated_are_white_and_rare_combinations_share_a_colour() -> None:
    axes = [SweepAxis(f"nodes.{node}.angle_deg", ("nodes", node - 1, "angle_deg"), 0.0, 9.0, 10) for node in (1, 2)]
    found = StateMap(view_over(*axes))
    for number in range(1, 100):
        found.take((number, [f"peak, kind{min(number // 4, 20)}"]))
    names = [sweeps.FAILED, *found.combinations]
    colours = sweeps._colours(found, names)
    assert colours["peak, kind20"] == sweeps.MIXED[0]
    assert len({colours[name] for name in names}) == len(sweeps.MIXED) + 2
    text = sweeps.draw(found, kind="svg").decode()
    assert ">not simulated</text>" in text
    assert text.count(">other combinations</text>") == 1


def test_a_million_points_stay_small() -> None:
    axes = [SweepAxis(f"nodes.{node}.angle_deg", ("nodes", node - 1, "angle_deg"), 0.0, 9.0, 1000) for node in (1, 2)]
    (cells,) = StateMap(view_over(*axes)).cells
    assert len(cells) * cells.itemsize == 2_000_000
    found = ValueCurves(view_over(axes[0]))
    for number in range(1000):
        found.take((number, [StateValue(0, "peak", 1.0, stays=True, can_be_shown=True)]))
    (curve,) = found.curves.values()
    assert sum(each.itemsize for each in (curve.points, curve.values, curve.stays)) <= 17
    assert len(sweeps.draw(found, "svg")) < 60_000


@pytest.mark.parametrize("kind", ["png", "pdf"])
def test_every_format_is_the_same_every_time(curves: ValueCurves, kind: str) -> None:
    assert sweeps.draw(curves, kind) == sweeps.draw(curves, kind)


@pytest.mark.parametrize(
    ("key", "label"),
    [
        ("mean_height_mm", "mean height [mm]"),
        ("energy_mJ", "energy [mJ]"),
        ("left_moment_Nmm", "left moment [N mm]"),
        ("right_force_y_N", "right force y [N]"),
        ("max_curvature_per_m", "max curvature [1/m]"),
        ("lowest_eigenvalue", "lowest eigenvalue"),
        ("nodes.1.angle_deg", "nodes.1.angle [deg]"),
        ("loads.1.force_N.2", "loads.1.force N.2"),
    ],
)
def test_labels_have_units(key: str, label: str) -> None:
    assert sweeps.label_of(key) == label
