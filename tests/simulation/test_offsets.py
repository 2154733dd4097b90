"""Offsets of a display: what nodes and rod do beside what they are told, wherever a curve is predicted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.errors import InvalidInput
from curveline.fitting.fit import FitRequest, fit_drawing
from curveline.planning.tours import make_plan
from curveline.scene import Offsets, Scene
from curveline.shapes.files import builtin_text, read_display, read_shape
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm

OFFSETS = "\n[offsets]\nangle_deg = [0.5, -1.0]\nlength_mm = [2.0]\n"


@pytest.fixture
def shape(tmp_path: Path) -> Path:
    """The level asymmetric peak on a display that is off."""
    (tmp_path / "mine.toml").write_text(builtin_text("single") + OFFSETS)
    text = (Path(__file__).parents[2] / "shapes" / "level-asymmetric-peak.toml").read_text()
    (tmp_path / "peak.toml").write_text(text.replace('"single"', '"mine.toml"'))
    return tmp_path / "peak.toml"


def told_otherwise(scene: Scene) -> Scene:
    """The shape that a display without offsets must be told to show the same."""
    left, right = scene.nodes
    nodes = replace(left, angle=left.angle + deg(0.5)), replace(right, angle=right.angle - deg(1.0))
    (segment,) = scene.segments
    segments = (replace(segment, length=segment.length + mm(2.0)),)
    return replace(scene, display=scene.display.as_told, nodes=nodes, segments=segments)


def test_a_shape_is_simulated_as_it_comes_out(shape: Path) -> None:
    scene = read_shape(shape)
    assert scene.display.offsets == Offsets((deg(0.5), deg(-1.0)), (mm(2.0),))
    found, expected = simulate(scene)[0].states, simulate(told_otherwise(scene))[0].states
    assert [each.name for each in found] == ["peak", "valley"]
    for one, other in zip(found, expected, strict=True):
        assert one.curve(101) == pytest.approx(other.curve(101), abs=1e-9)
    bare = simulate(replace(scene, display=scene.display.as_told))[0].states
    assert np.abs(found[0].curve(101) - bare[0].curve(101)).max() > mm(1.0)


def test_a_sweep_has_them_too(shape: Path) -> None:
    report = curveline.sweep(shape, {"nodes.2.angle_deg": (10.0, 12.0, 2)})
    scene = read_shape(shape)
    left, right = scene.nodes
    peak = simulate(replace(scene, nodes=(left, replace(right, angle=deg(12.0)))))[0].states[0]
    last = [row for row in report.rows if row["point"] == 2 and row["state"] == "peak"]
    assert last[0]["mean_height_mm"] == pytest.approx(1e3 * peak.mean_height, abs=1e-3)


def test_a_fitted_shape_says_what_to_tell() -> None:
    display = read_display("single")
    off = replace(display, offsets=Offsets((deg(0.5), deg(-1.0)), (mm(2.0),)))
    drawing = curveline.drawing_of_formula("60*sin(pi*x/500)", display.span)
    request = FitRequest(is_planned=False)
    one, other = fit_drawing(drawing, display, request), fit_drawing(drawing, off, request)
    assert other.rms == pytest.approx(one.rms, abs=mm(0.01))
    turned = [b.angle - a.angle for a, b in zip(one.scene.nodes, other.scene.nodes, strict=True)]
    assert turned == pytest.approx([deg(-0.5), deg(1.0)], abs=deg(0.05))
    assert other.scene.segments[0].length - one.scene.segments[0].length == pytest.approx(mm(-2.0), abs=mm(0.05))


def test_plans_take_nodes_to_be_where_they_are_told(shape: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = read_shape(shape)
    bare = replace(scene, display=scene.display.as_told)
    assert make_plan(scene).steps == make_plan(bare).steps
    heard: list[str] = []

    class Ear(curveline.Listener):
        def note(self, text: str) -> None:
            heard.append(text)

    curveline.plan(scene, listener=Ear())
    assert sum("where they are told" in each for each in heard) == 1
    heard.clear()
    curveline.plan(bare, listener=Ear())
    assert heard == []


def test_rod_that_is_missing_by_an_offset_is_told(shape: Path) -> None:
    folder = shape.parent
    (folder / "mine.toml").write_text(builtin_text("single") + "[offsets]\nlength_mm = [-20.0]\n")
    shape.write_text(shape.read_text().replace("700.0", "505.0"))
    with pytest.raises(InvalidInput, match=r"1 problem"):
        read_shape(shape)


def test_the_check_of_a_display_tells_them(shape: Path) -> None:
    from curveline.cli.printing.reports.display_report import describe

    checked = curveline.check_display(shape.parent / "mine.toml")
    assert checked.document()["offsets"] == {"angle_deg": [0.5, -1.0], "length_mm": [2.0]}
    text = "\n".join(describe(checked))
    assert "nodes turn further than they are told by 0.5, -1 deg" in text
    assert "segments have more rod than told by 2 mm" in text
    assert curveline.check_display("single").document()["offsets"] == {}
