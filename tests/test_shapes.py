"""The committed shape files are the paper's sixteen, and say what they show."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from curveline.shapefile import read_shape
from curveline.units import to_deg, to_mm

HERE = Path(__file__).parent
SHAPES = HERE.parent / "shapes"
PAPER = json.loads((HERE / "data" / "paper_shapes.json").read_text())


@pytest.mark.parametrize("state", ["peak", "valley"])
@pytest.mark.parametrize("case", PAPER["cases"])
def test_shape_has_the_boundary_conditions_of_the_paper(case: str, state: str) -> None:
    scene = read_shape(SHAPES / f"{case}-{state}.toml")
    wanted = PAPER["cases"][case]
    (left, right), (segment,) = scene.nodes, scene.segments
    assert scene.name == f"{case}-{state}"
    assert scene.display.name == "single"
    assert to_mm(scene.display.span) == pytest.approx(PAPER["span_mm"], rel=1e-14)
    assert (left.height, to_mm(right.height)) == pytest.approx((0.0, wanted["y_mm"]), rel=1e-14)
    assert [to_deg(left.angle), to_deg(right.angle)] == pytest.approx([wanted["theta1_deg"], wanted["theta2_deg"]])
    assert to_mm(segment.length) == pytest.approx(wanted["length_mm"], rel=1e-14)
    assert segment.state == state
    assert scene.loads == ()


def test_every_file_says_in_its_own_words_what_it_shows() -> None:
    files = sorted(SHAPES.glob("*.toml"))
    assert len(files) >= 16
    comments = [file.read_text(encoding="utf-8").split("\n")[0] for file in files]
    assert all(comment.startswith("# ") and len(comment) > 40 for comment in comments)
    assert len(set(comments)) == len(files)


@pytest.mark.parametrize("file", sorted(SHAPES.glob("*.toml")), ids=lambda file: file.stem)
def test_every_file_is_valid_and_named_for_its_stem(file: Path) -> None:
    assert read_shape(file).name == file.stem
