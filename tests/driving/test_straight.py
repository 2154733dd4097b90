"""Shapes with straight segments, sent to the modelled display: it ends in them, and knows them again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import curveline
from curveline.errors import LinkError
from curveline.shapes.files import read_shape

NODES = "{ height_mm = HEIGHT, angle_deg = ANGLE }"
SEGMENT = '{ length_mm = LENGTH, state = "STATE" }'
Written = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Written:
    """Write a shape of the display `quad`: heights [mm], angles [deg], lengths [mm] and states."""

    def written(name: str, *columns: str) -> Path:
        heights, angles, lengths, states = (each.split() for each in columns)
        nodes = [NODES.replace("HEIGHT", h).replace("ANGLE", a) for h, a in zip(heights, angles, strict=True)]
        segments = [SEGMENT.replace("LENGTH", x).replace("STATE", s) for x, s in zip(lengths, states, strict=True)]
        path = tmp_path / f"{name}.toml"
        listed = f"nodes = [{', '.join(nodes)}]\nsegments = [{', '.join(segments)}]\n"
        path.write_text(f'name = "{name}"\ndisplay = "quad"\n{listed}')
        return path

    return written


@pytest.fixture
def ridge(write: Written) -> Path:
    angles, lengths = "5.71 5.71 -5.71 -5.71 -5.71", "502.5 560 502.5 502.5"
    return write("ridge", "0 50 50 0 -50", angles, lengths, "straight peak straight straight")


@pytest.fixture
def line(write: Written) -> Path:
    return write("line", "0 30 60 90 120", "3.4336 " * 5, "500.9 " * 4, "straight " * 4)


@pytest.fixture
def waves(write: Written) -> Path:
    return write("waves", "0 " * 5, "1.4 -1.4 1.4 -1.4 1.4", "500.05 " * 4, "straight " * 4)


MIXED = ("straight", "peak", "straight", "straight")
ALL = ("straight",) * 4


@pytest.mark.parametrize("spec", ["mock:fresh", "mock:fresh,loss=0.3,spread=0.3,seed=4"])
@pytest.mark.parametrize("name", ["ridge", "line", "waves"])
def test_the_display_ends_in_it(request: pytest.FixtureRequest, tmp_path: Path, name: str, spec: str) -> None:
    path = request.getfixturevalue(name)
    with curveline.connect(spec, "quad", runs=tmp_path / "runs") as session:
        result = session.send(path)
        assert result.playback is not None
        assert result.playback.states == tuple(segment.state for segment in read_shape(path).segments)


def test_it_is_known_again_and_gone_on_from(ridge: Path, line: Path, waves: Path, tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    for path, begin, end in ((ridge, ALL, MIXED), (line, MIXED, ALL), (waves, ALL, ALL), (ridge, ALL, MIXED)):
        with curveline.connect("mock:", "quad", runs=runs) as session:
            result = session.send(path)
            assert result.playback is not None
            assert (result.playback.start, result.playback.states) == (begin, end)
            assert session.status().document()["rod"] == list(end)
    with curveline.connect("mock:", "quad", runs=runs) as session:
        stays = session.rod().stays
        assert [stay.shape for stay in stays] == ["ridge", "line", "waves", "ridge"]
        assert [None if stay.scene is None else [each.state for each in stay.scene.segments] for stay in stays] == [
            list(states) for states in (MIXED, ALL, ALL, MIXED)
        ]
        result = session.send(home=True)
        assert result.playback is not None
        assert result.playback.states == ALL


def test_a_broken_off_run_is_gone_on_with(ridge: Path, tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    with (
        curveline.connect("mock:fresh,stall=2@step6", "quad", runs=runs) as session,
        pytest.raises(LinkError),
    ):
        session.send(ridge)
    with curveline.connect("mock:", "quad", runs=runs) as session:
        result = session.resume()
        assert result.playback is not None
        assert result.playback.states == MIXED
