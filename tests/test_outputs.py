"""Files of results: every kind in every format, whole or not at all, and refused before anything is computed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from curveline.bench.report import BenchReport
from curveline.errors import InvalidInput
from curveline.loading.falling import fall_of
from curveline.loading.load_map import load_map
from curveline.loading.pushes import Push
from curveline.loading.snap_through import load
from curveline.outputs import (
    FALL,
    FILM,
    LOADING,
    PICTURES,
    PLAN,
    SIMULATION,
    SWEEP,
    TRADE,
    ResultKind,
    check_output,
    open_sweep,
    write_output,
)
from curveline.planning.tours import make_plan
from curveline.shapes.files import read_display, read_shape
from curveline.simulation.results import Settings, ShapeReport
from curveline.simulation.simulate import simulate
from curveline.simulation.sweep import Sweep

SHAPE = Path(__file__).parents[1] / "shapes" / "level-up-peak.toml"
KINDS = {"simulation": SIMULATION, "loading": LOADING, "map": LOADING, "fall": FALL, "plan": PLAN, "trade": TRADE}
WRITTEN = [(name, suffix) for name, kind in KINDS.items() for suffix in kind.suffixes if suffix != FILM]
SIGNS = {".svg": b"<?xml", ".png": b"\x89PNG", ".pdf": b"%PDF-", ".json": b"{", ".npz": b"PK", ".csv": b"shape,"}


@pytest.fixture(scope="module")
def contents() -> dict[str, tuple[object, ...]]:
    """Something of every kind."""
    scene = read_shape(SHAPE)
    return {
        "simulation": ([ShapeReport(scene, tuple(simulate(scene)), Settings(points=5), 0.0)],),
        "loading": (load(scene, Push(step=2.0)),),
        "map": (load_map(scene, Push(), 3),),
        "fall": (fall_of(load(scene, Push(at=0.35, step=2.0))),),
        "plan": (make_plan(scene),),
        "trade": (BenchReport([], []),),
    }


@pytest.mark.parametrize(("name", "suffix"), WRITTEN)
def test_writing_is_whole_and_overwrites_nothing_unasked(
    contents: dict[str, tuple[object, ...]], tmp_path: Path, name: str, suffix: str
) -> None:
    kind, content = KINDS[name], contents[name]
    if name == "plan" and suffix in PICTURES:
        content = (*content, read_display("single"), lambda _: None)
    path = tmp_path / f"out{suffix.upper()}"
    check_output(kind, path)
    write_output(kind, path, content)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes().startswith(SIGNS[suffix])
    path.write_bytes(b"mine")
    for refused in (lambda: write_output(kind, path, content), lambda: check_output(kind, path)):
        with pytest.raises(InvalidInput) as caught:
            refused()
        assert caught.value.diagnostics[0].code == "exists"
    assert path.read_bytes() == b"mine"
    check_output(kind, path, force=True)
    write_output(kind, path, content, force=True)
    assert path.read_bytes().startswith(SIGNS[suffix])


@pytest.mark.parametrize("kind", [*KINDS.values(), SWEEP])
@pytest.mark.parametrize("name", ["out", "out.txt", "json", "out.json.gz"])
def test_an_unknown_suffix_is_refused_with_the_known_ones(kind: ResultKind, name: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        check_output(kind, name)
    assert ", ".join(kind.suffixes) in caught.value.hint


def places(tmp_path: Path) -> Sequence[tuple[Path, str]]:
    """Files that could not be made, and the code of why."""
    (tmp_path / "file").write_text("")
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    nowhere = [(tmp_path / "no" / "out.json", "no-such-folder"), (tmp_path / "file" / "out.json", "no-such-folder")]
    return [*nowhere, *([(closed / "out.json", "unwritable")] if os.geteuid() else [])]


@pytest.mark.parametrize("kind", [*KINDS.values(), SWEEP])
def test_a_file_that_could_not_be_made_is_refused_before_anything_is_computed(kind: ResultKind, tmp_path: Path) -> None:
    for path, code in places(tmp_path):
        with pytest.raises(InvalidInput) as caught:
            check_output(kind, path.with_suffix(kind.suffixes[0]))
        assert caught.value.diagnostics[0].code == code


def test_the_file_of_a_sweep_appears_when_it_is_whole(tmp_path: Path) -> None:
    sweep = Sweep(SHAPE, ["nodes.1.angle_deg=0:10:2"])
    for suffix in SWEEP.suffixes:
        path = tmp_path / f"out{suffix}"
        check_output(SWEEP, path)
        with open_sweep(path, sweep, Settings()):
            assert not path.exists()
        assert path.read_bytes()[:4].startswith(SIGNS[suffix][:4] if suffix in (*PICTURES, ".npz") else b"")
        with pytest.raises(InvalidInput, match="exists"), open_sweep(path, sweep, Settings()):
            pass
