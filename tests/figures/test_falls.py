"""The fall of a pushed shape can be looked at: as a strobe picture, and as a film."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

from clamped_rods import changed
from curveline.errors import Infeasible, InvalidInput
from curveline.figures import falls
from curveline.figures.common import COLOURS, DARK, FORCE, PIXELS_PER_INCH, WIDTH
from curveline.loading.falling import PARTS, PUSHES, SnapFall, fall_of
from curveline.loading.pushes import Push
from curveline.loading.results import curve_mm
from curveline.loading.snap_through import LOST, UNKNOWN, Loading, load
from curveline.rod.problem import Array
from curveline.rod.spatial.dynamics import Fate, time_unit
from curveline.shapes.files import read_shape
from loading.test_scales import scaled

SHAPES = Path(__file__).parents[2] / "shapes"


def pushed(name: str = "level-up-peak", push: Push = Push(at=0.35)) -> Loading:  # noqa: B008
    return load(read_shape(SHAPES / f"{name}.toml"), push)


@pytest.fixture(scope="module")
def fall() -> SnapFall:
    return fall_of(pushed())


def test_a_push_ends_where_the_rod_snaps_and_the_fall_where_it_lands(fall: SnapFall) -> None:
    snap = fall.loading.snap
    assert snap is not None
    forces = [force for force, _ in fall.pushed]
    assert forces[0] == 0.0
    assert forces[-1] == pytest.approx(snap.force, rel=2e-4)
    assert np.all(np.diff(forces) > 0.0)
    assert len(forces) == PUSHES
    unloaded, snapping = (1e-3 * np.array(curve_mm(fall.loading.stand, state)) for state in (
        fall.loading.stand.state, fall.loading.last,
    ))  # fmt: skip
    np.testing.assert_allclose(fall.pushed[0].curve, unloaded, atol=1e-6)
    np.testing.assert_allclose(fall.pushed[-1].curve, snapping, atol=1e-6)
    assert snap.force < fall.force < 1.11 * snap.force
    assert fall.motion.fate is Fate.LANDED
    assert fall.name == snap.landings[0].name == "valley"
    # It begins where the push ended, and ends where the rod lands by descent, but for the larger load.
    first, last = (1e-3 * falls._seen(fall, fall.motion.places[end]) for end in (0, -1))
    landed = snap.landings[0].state
    assert landed is not None
    for curve, wanted, most in ((first, snapping, 2e-3), (last, landed.curve(201), 5e-3)):
        assert np.max([np.min(np.linalg.norm(wanted - place, axis=1)) for place in curve]) < most
    assert np.all(fall.motion.places[:, :, 2] == pytest.approx(0.0, abs=1e-12))
    # It has come to rest, not only landed.
    assert fall.motion.kinetic[-1] < 1e-4 * np.max(fall.motion.kinetic)


@pytest.fixture(scope="module")
def film(fall: SnapFall) -> tuple[bytes, list[int]]:
    """The film, and the parts that were told of while it was made."""
    heard: list[int] = []
    return falls.animate(fall, heard.append), heard


def test_progress_is_told(fall: SnapFall, film: tuple[bytes, list[int]]) -> None:
    heard: list[int] = []
    fall_of(fall.loading, heard.append)
    assert heard == list(range(1, PARTS + 1))
    assert film[1] == list(range(1, falls.parts_of(fall) + 1))


@pytest.mark.parametrize(
    ("name", "push", "lands"),
    [
        ("level-up-peak", Push(), "valley"),
        ("staggered-down-valley", Push(at=0.3, direction="0,1"), "peak"),
        ("roofline", Push(segment=2), "valley"),
    ],
)
def test_it_falls_where_descent_of_energy_leads(name: str, push: Push, lands: str) -> None:
    """Also off a bifurcation, which edges pass later than the rod, and out of the middle of a row."""
    loading = pushed(name, push)
    found = fall_of(loading)
    assert found.name == lands
    assert found.motion.fate is Fate.LANDED
    assert loading.snap is not None
    assert {landing.name for landing in loading.snap.landings} == {lands}
    x = falls._seen(found, found.motion.places[-1])[:, 0]
    assert (x[0], x[-1]) == pytest.approx((500.0 * push.segment, 500.0 * (push.segment + 1)))


@pytest.mark.parametrize("size", [1e-6, 1e3])
def test_a_fall_is_the_same_at_every_size(fall: SnapFall, size: float) -> None:
    scene = replace(scaled(size), loads=())
    found = fall_of(load(scene, Push(at=0.35)))
    assert found.name == fall.name
    assert found.force / size**2 == pytest.approx(fall.force, rel=1e-6)
    assert found.motion.times[-1] == pytest.approx(fall.motion.times[-1], rel=0.05)


def test_what_does_not_snap_does_not_fall() -> None:
    with pytest.raises(Infeasible, match="nothing snaps up to 1 N: there is no fall to show"):
        fall_of(pushed(push=Push(direction="0,1", most=1.0)))
    loading = pushed()
    assert loading.snap is not None
    with pytest.raises(Infeasible, match="could be followed to"):
        fall_of(replace(loading, snap=replace(loading.snap, kind=LOST)))
    display = loading.scene.display
    light = replace(loading.scene, display=replace(display, rod=replace(display.rod, mass_per_length=0.0)))
    with pytest.raises(InvalidInput, match="the rod has no mass"):
        fall_of(replace(loading, scene=light))


def test_samples_are_at_equal_times_and_between_their_steps(fall: SnapFall) -> None:
    motion = fall.motion
    times, places = motion.sampled(7)
    np.testing.assert_allclose(times, np.linspace(0.0, motion.times[-1], 7))
    np.testing.assert_array_equal(places[0], motion.places[0])
    np.testing.assert_array_equal(places[-1], motion.places[-1])
    after = int(np.searchsorted(motion.times, times[3]))
    share = (times[3] - motion.times[after - 1]) / (motion.times[after] - motion.times[after - 1])
    between = (1.0 - share) * motion.places[after - 1] + share * motion.places[after]
    np.testing.assert_allclose(places[3], between, atol=1e-14)


def test_a_strobe_picture_shows_every_flash_and_how_it_ended(fall: SnapFall) -> None:
    text = falls.draw(fall, kind="svg").decode()
    assert text == falls.draw(fall, kind="svg").decode()
    shades = {part.split(";")[0].split('"')[0] for part in text.split("stroke-opacity: ")[1:]}
    assert len(shades) >= falls.FLASHES - 1
    for said in ("level-up-peak snaps at 4.03 N", "peak, unloaded", "falling", "lands in valley"):
        assert f">{said}</text>" in text
    # The flashes are spread over the fall, whatever the rod does before and after.
    (flash_ms,) = re.findall(r">a flash every ([\d.]+) ms</text>", text)
    whole_ms = 1e3 * fall.motion.times[-1] * time_unit(fall.segment)
    assert (falls.FLASHES - 1) * float(flash_ms) == pytest.approx(1e3 * falls.seconds_of(fall), rel=1e-2)
    assert falls.seconds_of(fall) < 0.4e-3 * whole_ms
    image = imread(io.BytesIO(falls.draw(fall, kind="png")))
    assert image.shape[1] == round(WIDTH * PIXELS_PER_INCH)


def frames_of(data: bytes) -> tuple[list[Array], list[int]]:
    """The frames of a GIF in RGB, and how long each stays [ms]."""
    with Image.open(io.BytesIO(data)) as image:
        assert image.info["loop"] == 0
        frames, durations = [], []
        for index in range(image.n_frames):
            image.seek(index)
            frames.append(np.asarray(image.convert("RGB"), dtype=float))
            durations.append(image.info["duration"])
    return frames, durations


def count_of(frame: Array, colour: str) -> int:
    """Pixels above the legend that have a colour."""
    wanted = [int(colour[place : place + 2], 16) for place in (1, 3, 5)]
    return int(np.count_nonzero(np.abs(frame[40:-60] - wanted).max(axis=2) < 3.0))


def test_a_film_shows_the_push_the_fall_and_the_landing(fall: SnapFall, film: tuple[bytes, list[int]]) -> None:
    frames, durations = frames_of(film[0])
    whole = falls.parts_of(fall) - PUSHES
    seconds = PUSHES * falls.PUSH_MS + 2 * falls.HOLD_MS + (whole - 1) * falls.FRAME_MS + falls.LAST_MS
    assert sum(durations) == pytest.approx(seconds, abs=20)
    assert count_of(frames[0], COLOURS["peak"]) > 100
    assert count_of(frames[len(frames) // 2], COLOURS["peak"]) == count_of(frames[0], COLOURS["valley"]) == 0
    assert count_of(frames[len(frames) // 2], DARK) > count_of(frames[0], DARK) + 500
    assert count_of(frames[-1], COLOURS["valley"]) > 100
    # The load goes with the rod.
    orange = [np.argwhere(np.abs(frame - [0xE6, 0x9F, 0x00]).max(axis=2) < 3.0)[:, 0].mean() for frame in frames]
    assert FORCE == "#E69F00"
    assert orange[-1] > orange[0] + 100


@pytest.mark.campaign
def test_the_whole_film_is_the_same_every_time(fall: SnapFall, film: tuple[bytes, list[int]]) -> None:
    assert film[0] == falls.animate(fall)


def test_a_film_is_slowed_down_so_that_it_can_be_watched(fall: SnapFall) -> None:
    assert falls._pace(fall) == "5 times slower"
    slow, fast = (replace(fall, segment=changed(fall.segment, stiffness=stiffness)) for
        stiffness in (fall.segment.stiffness * 1e-4, fall.segment.stiffness * 1e6))  # fmt: skip
    assert time_unit(slow.segment) == pytest.approx(100.0 * time_unit(fall.segment))
    assert falls._pace(slow) == "20 times faster"
    assert falls._pace(fast) == "5000 times slower"
    for each in (slow, fast):
        assert falls.parts_of(each) == pytest.approx(falls.parts_of(fall), rel=0.6)


def test_a_rod_that_stays_nowhere_is_shown_all_the_same(fall: SnapFall) -> None:
    motion = replace(
        fall.motion, fate=Fate.STUCK, settled=None, times=fall.motion.times[:1], places=fall.motion.places[:1]
    )
    stuck = replace(fall, motion=motion, name=UNKNOWN)
    text = falls.draw(stuck, kind="svg").decode()
    assert "no time step was short enough" in re.sub(r"\s+", " ", text)
    film = falls.animate(stuck)
    assert len(film) > 1000
    assert film == falls.animate(stuck)
