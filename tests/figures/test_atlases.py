"""Figures of an atlas: a map of the states, the lines on which they end, contours of forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import curveline
from curveline.atlases.atlas import Atlas
from curveline.figures import atlases
from curveline.figures.common import COLOURS

REQUEST = curveline.AtlasRequest({"angle_deg": (-60, 60, 13), "length_mm": (500, 640, 8)})


@pytest.fixture(scope="module")
def found() -> Atlas:
    return curveline.atlas("single", REQUEST)


def test_it_is_whole_and_the_same_every_time(found: Atlas) -> None:
    drawn = atlases.draw(found, "svg")
    assert drawn == atlases.draw(found, "svg")
    text = drawn.decode()
    for words in ("stable states", "peak: force of a motor [N]", "valley: force of a motor [N]", "angle [deg]"):
        assert words in text
    for label in ("peak, valley", "none", atlases.END_LABEL):
        assert label in text
    assert atlases.draw(found, "png").startswith(b"\x89PNG")
    assert atlases.draw(found, "pdf").startswith(b"%PDF")


def test_every_point_has_the_colour_of_its_states(found: Atlas) -> None:
    colours = atlases._colours(found)
    assert colours["peak"] == COLOURS["peak"]
    assert colours["valley"] == COLOURS["valley"]
    assert colours["none"] == atlases.EMPTY
    assert len(set(colours.values())) == len(colours)
    assert set(colours) == set(found.kinds.ravel().tolist())


def test_contours_are_at_round_forces() -> None:
    levels = atlases._levels(np.array([[0.13, 5000.0], [1.0, np.nan]]))
    assert levels[:4] == [0.2, 0.5, 1.0, 2.0]
    fine = atlases._levels(np.linspace(1.02, 2.9, 100))
    assert len(fine) >= atlases.FEWEST
    assert {4.0 * each % 1 for each in fine} == {0.0}
    assert atlases._levels(np.full((2, 2), 3.3)) == [3.3]


def test_an_atlas_without_states_or_folds_is_drawn(found: Atlas) -> None:
    none = found.entries[:0]
    folds = found.folds._replace(**{name: getattr(found.folds, name)[:0] for name in found.folds._fields})
    empty = replace(found, entries=none, folds=folds)
    text = atlases.draw(empty, "svg").decode()
    assert "none" in text
    assert "force of a motor" not in text
    one = replace(found, entries=found.entries[:1])
    assert b"svg" in atlases.draw(one, "svg")
