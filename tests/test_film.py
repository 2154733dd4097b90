"""A fall can be looked at: as a strobe picture, and as a film."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

from curveline.figures import falls
from curveline.figures.common import PIXELS_PER_INCH, WIDTH
from curveline.rod.section import Section
from curveline.rod.spatial.dynamics import (
    FallMotion,
    Fate,
    Medium,
    StepControl,
    at_rest,
    fall,
    kicked,
    medium_of,
    time_unit,
)
from curveline.rod.spatial.energy import SpatialRod, positions
from curveline.rod.spatial.relax import descend
from curveline.rod.spatial.segment import SpatialSegment
from curveline.rod.states.equilibrium import ClampedRod
from rod.motions import arch, flat_shape

SECTION = Section(58800.0, 0.0024, 0.00297, 0.47, 0.49, 0.035)
ROD = ClampedRod((0.5, 0.0), 0.9, -0.9, 0.6, 0.02, 0.028, 0.47)
SEGMENT = SpatialSegment(ROD, SECTION, weight=(0.0, -0.47, 0.0))


def turned(angle: float) -> SpatialRod:
    """The rod with both clamps turned up."""
    return replace(SEGMENT, rod=replace(ROD, start=angle, end=-angle)).spatial_rod(np.full(16, 1.0 / 16))


@pytest.fixture(scope="module")
def film() -> FallMotion:
    """A valley whose clamps are turned up too far: it snaps over."""
    spatial, valley = turned(0.0), arch(turned(0.0), -1.0)
    for angle in (0.3, 0.5, 0.7, 0.75):
        spatial = turned(angle)
        valley = descend(spatial, valley).shape
    assert positions(spatial, valley)[8, 1] < -0.05
    spatial = turned(0.9)
    medium = medium_of(SEGMENT)._replace(external=8.0)
    return fall(spatial, kicked(spatial, valley, 0.1, 1), medium, StepControl(accuracy=1e-3))


def test_samples_are_at_equal_times_and_between_their_steps(film: FallMotion) -> None:
    times, places = film.sampled(7)
    np.testing.assert_allclose(times, np.linspace(0.0, film.times[-1], 7))
    np.testing.assert_array_equal(places[0], film.places[0])
    np.testing.assert_array_equal(places[-1], film.places[-1])
    after = int(np.searchsorted(film.times, times[3]))
    share = (times[3] - film.times[after - 1]) / (film.times[after] - film.times[after - 1])
    between = (1.0 - share) * film.places[after - 1] + share * film.places[after]
    np.testing.assert_allclose(places[3], between, atol=1e-14)


def test_a_strobe_picture_shows_every_flash_and_how_it_ended(film: FallMotion) -> None:
    text = falls.draw_fall(film, SEGMENT, "svg").decode()
    assert text == falls.draw_fall(film, SEGMENT, "svg").decode()
    shades = {part.split(";")[0].split('"')[0] for part in text.split("stroke-opacity: ")[1:]}
    assert len(shades) >= falls.FLASHES - 1
    image = imread(io.BytesIO(falls.draw_fall(film, SEGMENT, "png")))
    assert image.shape[1] == round(WIDTH * PIXELS_PER_INCH)
    assert film.fate is Fate.LANDED


def test_curves_run_from_pivot_to_pivot_in_mm() -> None:
    still = at_rest(SEGMENT.spatial_rod(np.full(16, 1.0 / 16)), flat_shape(np.zeros(16)))
    far = fall(SEGMENT.spatial_rod(np.full(16, 1.0 / 16)), still, Medium(), StepControl(until=1e-4))
    x, y = falls._seen(far.places[0], SEGMENT).T
    assert (x[0], y[0], x[-1], y[-1]) == (0.0, 0.0, 500.0, 0.0)
    assert x[1] == pytest.approx(10.0 * np.cos(0.9))
    assert y[1] == pytest.approx(10.0 * np.sin(0.9))


def test_a_film_has_its_frames_and_runs_slowly(film: FallMotion) -> None:
    data = falls.animate_fall(film, SEGMENT)
    with Image.open(io.BytesIO(data)) as image:
        frames = []
        for index in range(image.n_frames):
            image.seek(index)
            frames.append(np.asarray(image.convert("L"), dtype=float))
            assert image.info["duration"] == falls.FRAME_MS
        assert image.info["loop"] == 0
    seconds = film.times[-1] * time_unit(SEGMENT)
    assert len(frames) * falls.FRAME_MS / 1000.0 == pytest.approx(falls.SLOWER * seconds, abs=0.05)
    heights = [float(np.mean(np.nonzero(frame[30:-60, 120:-40] < 80)[0])) for frame in (frames[0], frames[-1])]
    # Rows count downwards: the rod is higher at the end.
    assert heights[1] < heights[0] - 30.0
