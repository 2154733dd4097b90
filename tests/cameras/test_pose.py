"""Where a camera stood is found by tags to hundredths of a millimetre, or why not is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curveline.cameras.outcomes import TrialOutcome
from curveline.cameras.photographs import Photograph
from curveline.cameras.pose import FoundView, ViewFailure, find_view, view_document, view_of
from curveline.cameras.setup import CameraSetup, SeenNode
from curveline.cameras.view import Frame, Lens, SeenRod, Tag, View
from curveline.errors import InvalidInput

from . import scenes

FRAME = scenes.frame()
LENS = scenes.lens(1440, 1080)
VIEW = scenes.view(LENS, (0.42, 0.21, 1.25), (0.25, 0.02), 0.08)
WALL = scenes.wall(FRAME)


def field() -> np.ndarray:
    """Places of a rod (n, 2) [m]."""
    return np.stack(np.meshgrid(np.linspace(0.0, 0.5, 5), np.linspace(-0.2, 0.2, 5)), axis=-1).reshape(-1, 2)


def errors(found: FoundView, truth: View) -> np.ndarray:
    """By how much (n, 2) [m] places of a rod are taken for others."""
    places = field()
    return found.view.in_plane(truth.pixels(np.column_stack([places, np.zeros(len(places))]))) - places


def seen(picture: np.ndarray, a_frame: Frame = FRAME, a_lens: Lens = LENS) -> FoundView:
    found = find_view(picture, a_lens, a_frame)
    assert isinstance(found, FoundView), found
    return found


def failed(picture: np.ndarray, a_frame: Frame = FRAME) -> ViewFailure:
    found = find_view(picture, LENS, a_frame)
    assert isinstance(found, ViewFailure), found
    return found


def standpoint(seed: int) -> tuple[View, float, float]:
    """A camera somewhere before the display, a blur [px] and noise [grey levels]."""
    rng = np.random.default_rng(seed)
    eye = (0.25 + rng.uniform(-0.4, 0.4), rng.uniform(-0.35, 0.35), rng.uniform(1.15, 1.5))
    look = (0.25 + rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03))
    return scenes.view(LENS, eye, look, rng.uniform(-0.3, 0.3)), rng.uniform(0.5, 2.0), rng.uniform(1.0, 6.0)


def check(seed: int) -> None:
    """Positions are off by hundredths of a millimetre, and by no more than four of what is stated."""
    truth, blur, noise = standpoint(seed)
    found = seen(scenes.photographed(WALL, truth, blur=blur, noise=noise, seed=seed))
    assert len(found.tags) == 6
    off = float(np.abs(errors(found, truth)).max())
    assert off < 0.03e-3
    assert off < 4.0 * found.error
    assert found.view.eye == pytest.approx(truth.eye, abs=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_the_camera_stands_where_it_stood(seed: int) -> None:
    check(seed)


@pytest.mark.campaign
def test_many_cameras_stand_where_they_stood() -> None:
    for seed in range(50_000, 50_060):
        check(seed)


def test_the_blur_is_that_of_the_picture() -> None:
    for blur in (1.0, 2.5):
        found = seen(scenes.photographed(WALL, VIEW, blur=blur))
        width = np.median([each.width for each in found.tags])
        assert width == pytest.approx(2.563 * blur, rel=0.15)


def test_tags_that_are_off_make_the_error_that_is_stated() -> None:
    ratios = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        moved = {tag.number: (*rng.normal(0.0, 0.25e-3, 2), 0.0) for tag in FRAME.tags}
        found = seen(scenes.photographed(scenes.wall(FRAME, moved), VIEW))
        ratios.append(np.square(errors(found, VIEW)).mean() / found.error**2)
    assert 0.3 < np.mean(ratios) < 2.0


def test_one_tag_that_is_elsewhere_is_left_out_and_named() -> None:
    found = seen(scenes.photographed(scenes.wall(FRAME, {2: (4e-3, -3e-3, 0.0)}), VIEW))
    assert [each.tag.number for each in found.left_out] == [2]
    assert "tag 2 is left out, off by 5.0 mm: its middle is at x = 644.0, y = 297.0 mm" in found.notes
    assert np.abs(errors(found, VIEW)).max() < 0.05e-3


def test_a_tag_that_is_turned_is_left_out() -> None:
    found = seen(scenes.photographed(scenes.wall(FRAME, {4: (0.0, 0.0, 0.06)}), VIEW))
    assert [each.tag.number for each in found.left_out] == [4]
    assert "tag 4 is left out, turned" in found.notes[0]


def test_tags_that_disagree_are_named() -> None:
    off = {2: (4e-3, -3e-3, 0.0), 5: (0.0, 9e-3, 0.0)}
    why = failed(scenes.photographed(scenes.wall(FRAME, off), VIEW))
    assert why.outcome is TrialOutcome.TAGS_DISAGREE
    assert "by tags 0, 1, 3, 4, which agree: tag 2 is off by 5.0 mm" in why.reason
    assert "tag 5 is off by 9.0 mm" in why.reason


def test_three_tags_cannot_say_which_is_off() -> None:
    three = replace(FRAME, tags=FRAME.tags[1:4])
    why = failed(scenes.photographed(scenes.wall(three, {2: (6e-3, 0.0, 0.0)}), VIEW), three)
    assert why.outcome is TrialOutcome.TAGS_DISAGREE
    assert why.reason == "tags 1, 2, 3 are not where the camera file has them, and too few agree to say which is off"


def test_too_few_tags() -> None:
    others = replace(FRAME, tags=(*(replace(tag, number=tag.number + 20) for tag in FRAME.tags[:2]), FRAME.tags[3]))
    why = failed(scenes.photographed(WALL, VIEW), others)
    assert why.outcome is TrialOutcome.NO_TAGS
    assert why.reason.startswith("1 tag of 3 found, 2 are needed; the camera file does not have tags 0, 1, 2, 4, 5")
    empty = np.full(LENS.size[::-1], 128, np.uint8)
    assert failed(empty).reason == "0 tags of 6 found, 2 are needed"


def test_a_tag_that_is_there_twice_is_not_used() -> None:
    twice = replace(FRAME, tags=(*FRAME.tags, Tag(1, (0.25, 0.24))))
    found = seen(scenes.photographed(scenes.wall(twice), VIEW))
    assert [each.tag.number for each in found.tags] == [0, 2, 3, 4, 5]
    assert "tag 1 is seen 2 times, and not used" in found.notes


@pytest.mark.parametrize("blur", [5.5, 9.0])
def test_a_blurred_picture_is_called_that(blur: float) -> None:
    why = failed(scenes.photographed(WALL, VIEW, blur=blur))
    assert why.outcome is TrialOutcome.BLURRED


def test_a_dark_picture_and_an_uneven_one_are_used() -> None:
    picture = scenes.photographed(WALL, VIEW).astype(float)
    light = np.linspace(0.35, 1.0, picture.shape[1])
    assert np.abs(errors(seen((picture * 0.15).astype(np.uint8)), VIEW)).max() < 0.1e-3
    assert np.abs(errors(seen((picture * light).astype(np.uint8)), VIEW)).max() < 0.05e-3


def test_a_tag_that_is_partly_hidden_does_not_mislead() -> None:
    picture = scenes.photographed(WALL, VIEW)
    found = seen(picture)
    x, y = found.tags[0].corners.mean(axis=0).astype(int)
    picture[y + 12 : y + 16, :400] = 255
    assert np.abs(errors(seen(picture), VIEW)).max() < 0.05e-3
    assert x > 0


def test_turned_tags_and_a_camera_on_its_head() -> None:
    turned = replace(FRAME, tags=tuple(replace(tag, turn=0.7 * tag.number) for tag in FRAME.tags))
    a_view = scenes.view(LENS, (0.1, -0.1, 1.2), (0.25, 0.0), 3.0)
    found = seen(scenes.photographed(scenes.wall(turned), a_view), turned)
    assert np.abs(errors(found, a_view)).max() < 0.03e-3


def test_a_photograph_that_was_turned_is_looked_at_through_a_turned_lens() -> None:
    from curveline.cameras.orientation import turned as turn

    setup = CameraSetup(LENS, FRAME, SeenRod(2e-3, 1e-2), SeenNode(0.03, 0.03))
    picture = scenes.photographed(WALL, VIEW)
    for orientation in (3, 6):
        found = view_of(Photograph(turn(picture, orientation), "x", orientation=orientation), setup)
        assert isinstance(found, FoundView)
        assert found.view.eye == pytest.approx(VIEW.eye, abs=2e-4)


def test_a_picture_of_another_size_is_refused() -> None:
    with pytest.raises(InvalidInput, match="the picture has 100 x 80 pixels, the lens 1440 x 1080"):
        find_view(np.zeros((80, 100), np.uint8), LENS, FRAME)


def test_what_json_has_of_it() -> None:
    found = seen(scenes.photographed(WALL, VIEW))
    document = view_document(found, FRAME)
    assert document["eye_mm"] == pytest.approx([420.0, 210.0, 1250.0], abs=0.5)
    assert document["off_square_deg"] == pytest.approx(11.6, abs=0.5)
    assert [tag["number"] for tag in document["tags"]] == [0, 1, 2, 3, 4, 5]
    assert max(tag["off_mm"] for tag in document["tags"]) < 0.05
    assert view_document(ViewFailure(TrialOutcome.NO_TAGS, "why"), FRAME) == {"outcome": "no-tags", "reason": "why"}


def test_standard_errors_grow_away_from_the_tags() -> None:
    found = seen(scenes.photographed(WALL, VIEW))
    near, far = found.errors_at(np.array([[0.25, 0.0], [2.0, 0.0]]))
    assert far > 2.0 * near > 0.0
