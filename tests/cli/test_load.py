"""`curveline load`: what it prints, writes, refuses and exits with."""

from __future__ import annotations

import json
import math
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from curveline.cli.printing.reports import load_report
from curveline.figures import falls
from curveline.loading import load_map, snap_through
from curveline.loading.pushes import Push, Stand
from curveline.loading.snap_through import Limit, limit_of, load
from curveline.shapes.files import read_shape

from .conftest import BROKEN, SHAPES, Run, failure

SHAPE = SHAPES / "level-up-peak.toml"


@pytest.fixture(scope="module")
def quad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shape of four segments, all of them neutral peaks."""
    path = tmp_path_factory.mktemp("quad") / "row.toml"
    nodes = ", ".join(["{ height_mm = 0.0, angle_deg = 0.0 }"] * 5)
    segments = ", ".join(['{ length_mm = 580.0, state = "peak" }'] * 4)
    path.write_text(f'name = "row"\ndisplay = "quad"\nnodes = [ {nodes} ]\nsegments = [ {segments} ]\n')
    return path


def said(out: str) -> dict[str, Any]:
    assert out.count("\n") == 1
    found = json.loads(out)
    assert isinstance(found, dict)
    return found


def test_a_push_is_told_on_a_screen_of_80_columns(run: Run) -> None:
    code, out, err = run("load", SHAPE, "--step-N", "0.05")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert all(len(line) <= 80 for line in lines)
    assert len(lines) <= 30
    assert lines[0] == "level-up-peak"
    for word in ("force N", "deflection mm", "stiffness without load", "snaps through at", "lands in valley"):
        assert word in out
    assert "\x1b" not in out


def test_json_is_the_documented_document(run: Run) -> None:
    code, out, err = run("load", SHAPE, "--at", "0.4", "--json")
    assert (code, err) == (0, "")
    found = said(out)
    pushed_once = load(read_shape(SHAPE), Push(at=0.4))
    assert pushed_once.snap is not None
    assert pushed_once.stiffness is not None
    assert found["snap_through_N"] == pushed_once.snap.force
    assert 0.0 < found["snap_through_error_N"] < 1e-3
    assert found["stiffness_N_per_mm"] == pytest.approx(pushed_once.stiffness / 1e3)
    assert (found["kind"], found["lands_in"], found["released_in"]) == ("fold", "valley", "valley")
    assert found["ways"] == [{"lands_in": "valley", "released_in": "valley"}]
    assert found["leaves_plane_N"] is None
    assert (found["shape"], found["segment"], found["state"], found["at"]) == ("level-up-peak", 1, "peak", 0.4)
    assert (found["direction"], found["direction_xy"], found["most_N"]) == ("down", [0.0, -1.0], 20.0)
    forces, deflections = np.array(found["curve"]).T
    assert forces[:-1] == pytest.approx(0.5 * np.arange(len(forces) - 1))
    assert forces[-1] == found["snap_through_N"]
    assert deflections == pytest.approx(1e3 * np.array(pushed_once.rows)[:, 1])
    assert 0.0 < found["curve_error_mm"] < 1e-2
    begin, end = np.array(found["unloaded_mm"]), np.array(found["loaded_mm"])
    assert begin.shape == end.shape == (201, 2)
    assert begin[80] == pytest.approx(found["place_mm"], abs=1e-2)
    assert begin[80, 1] - end[80, 1] == pytest.approx(deflections[-1], rel=0.03)
    branch = np.array(found["branch"])
    assert set(branch[:, 2]) == {0, 1}
    assert np.all(np.diff(branch[:, 2]) >= 0)
    assert branch[0, :2] == pytest.approx([0.0, 0.0], abs=1e-3)
    assert max(branch[:, 0]) < found["snap_through_N"] < max(branch[:, 0]) + 0.1
    assert np.array(found["landed_mm"]).shape == (1, 201, 2)
    assert found["provenance"]["argv"] == sys.argv[1:]
    assert found["provenance"]["settings"]["at"] == 0.4


def test_every_documented_key_is_there_and_no_other(run: Run) -> None:
    text = (SHAPES.parent / "docs" / "contracts.md").read_text()
    push, over_all = text.split("## `load --json`")[1].split("\n## ")[0].split("`--map` pushes")
    for part, options in ((push, ()), (over_all, ("--map", "--points", "3"))):
        keys = {key for row in re.findall(r"^\| (`.*?) \|", part, re.MULTILINE) for key in re.findall(r"`(\w+)", row)}
        assert set(said(run("load", SHAPE, "--json", *options).out)) == keys


def test_no_snap_through_is_null_and_no_failure(run: Run) -> None:
    code, out, err = run("load", SHAPE, "--direction", "0,1", "--json", "--most-N", "2")
    assert (code, err) == (0, "")
    found = said(out)
    for key in ("snap_through_N", "snap_through_error_N", "kind", "lands_in", "released_in"):
        assert found[key] is None
    assert found["ways"] == found["landed_mm"] == []
    assert [force for force, _ in found["curve"]] == [0.0, 0.5, 1.0, 1.5, 2.0]
    code, out, _ = run("load", SHAPE, "--direction", "0,1", "--most-N", "2")
    assert code == 0
    assert "no snap-through up to 2 N" in out


def test_figures_and_json_are_written_and_kept(run: Run, tmp_path: Path) -> None:
    files = [tmp_path / f"push.{kind}" for kind in ("svg", "png", "json")]
    options = [part for file in files for part in ("-o", file)]
    code, out, err = run("load", SHAPE, *options)
    assert code == 0
    assert "snaps through" in out
    assert err == "".join(f"wrote {file}\n" for file in files)
    assert files[0].read_text().startswith("<?xml")
    assert imread(files[1]).shape[1] > 1000
    assert json.loads(files[2].read_text())["kind"] == "bifurcation"
    first = files[0].read_bytes()
    code, out, err = run("load", SHAPE, "-o", files[0])
    assert (code, out) == (2, "")
    assert "error[exists]" in err
    assert run("load", SHAPE, "-o", files[0], "--force").code == 0
    assert files[0].read_bytes() == first


def test_a_dash_is_json_on_stdout(run: Run) -> None:
    code, out, _ = run("load", SHAPE, "-o", "-")
    assert code == 0
    assert said(out)["lands_in"] == "valley"


def test_a_map_is_told_drawn_and_written(run: Run, tmp_path: Path) -> None:
    figure = tmp_path / "map.png"
    arguments = ("load", SHAPE, "--map", "--points", "5", "--direction", "normal")
    code, out, err = run(*arguments, "-o", figure)
    assert (code, err) == (0, f"wrote {figure}\n")
    assert all(len(line) <= 80 for line in out.splitlines())
    for word in ("weakest point", "snaps at N", "withstands 1 N (searching for a target) everywhere"):
        assert word in out
    assert imread(figure).shape[1] > 1000
    code, out, err = run(*arguments, "--json")
    assert (code, err) == (0, "")
    found = said(out)
    assert [point["at"] for point in found["points"]] == pytest.approx(
        list(np.linspace(10.0 / 660.0, 650.0 / 660.0, 7)[1:-1])
    )
    known = [point["snap_through_N"] for point in found["points"] if point["snap_through_N"] is not None]
    assert 0.0 < found["weakest"]["snap_through_N"] <= min(known)
    assert [verdict["force_N"] for verdict in found["withstands"]] == [1.0, 2.0, 5.0]
    assert [verdict["everywhere"] for verdict in found["withstands"]] == [True, True, False]
    assert all(0.0 < a < b < 1.0 for a, b in found["withstands"][2]["yields_between"])


def test_a_fall_is_filmed_or_drawn(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(falls, "FRAME_MS", 10 * falls.FRAME_MS)  # fewer frames: how many there are, others hold
    film, picture = tmp_path / "fall.gif", tmp_path / "fall.pdf"
    code, out, err = run("load", SHAPE, "--at", "0.35", "--film", film)
    assert code == 0
    assert "snaps through" in out
    assert err == f"wrote {film}: falls for 0.398 s, lands in valley\n"
    assert film.read_bytes().startswith(b"GIF89a")
    assert run("load", SHAPE, "--at", "0.35", "--film", picture).code == 0
    assert picture.read_bytes().startswith(b"%PDF")


def test_what_does_not_snap_has_no_film_and_all_else_is_told(run: Run, tmp_path: Path) -> None:
    film, figure = tmp_path / "fall.gif", tmp_path / "push.svg"
    code, out, err = run("load", SHAPE, "--direction", "0,1", "--most-N", "2", "--film", film, "-o", figure)
    assert code == 1
    assert "no snap-through up to 2 N" in out
    assert err.startswith(
        f"wrote {figure}\nerror: nothing snaps up to 2 N: there is no fall to show\nhint: push harder"
    )
    assert figure.exists()
    assert not film.exists()


def test_segments_are_chosen_by_number(run: Run, quad: Path) -> None:
    code, out, err = run("load", quad)
    assert (code, out) == (2, "")
    assert err == "error: the shape has 4 segments\nhint: say which to push, with --segment 1 to 4\n"
    code, out, err = run("load", quad, "--segment", "5")
    assert (code, out) == (2, "")
    assert "there is no segment 5" in err
    code, out, err = run("load", quad, "--segment", "3", "--json")
    assert (code, err) == (0, "")
    found = said(out)
    assert found["segment"] == 3
    assert found["place_mm"][0] == pytest.approx(1250.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--at", "0.01"),
            "error: at 0.01 of its length the rod is inside a node's bearing\nhint: push at 0.01516 to 0.9848",
        ),
        (("--at", "nan"), "error: at nan of its length the rod is inside a node's bearing\n"),
        (("--direction", "up"), "error: a push towards 'up' points nowhere\nhint: say down, normal, or a vector"),
        (("--step-N", "0.0001"), "error: 20 N in steps of 0.0001 N are more than 10000 rows\nhint: take steps of"),
        (("--map", "--at", "0.3"), "error: --at is one point, --map are all\n"),
        (("--points", "7"), "error: --points is for a map\nhint: add --map\n"),
        (("--map", "--most-N", "4"), "error: a map to 4 N does not tell what a finger does to the curve\n"),
        (
            ("-o", "push.gif"),
            "error: push.gif: cannot tell the format from the suffix '.gif'\nhint: a fall is filmed with",
        ),
        (("--film", "push.json"), "error: push.json: cannot tell the format from the suffix '.json'\n"),
        (("--film", "no/push.gif"), "no/push.gif:1:1: error[no-such-folder]: there is no folder to write it to\n"),
        (("--map", "--film", "push.gif"), "error: --film shows one push, --map makes many\n"),
        (("--film", "push.svg", "-o", "push.svg"), "error: push.svg is named by -o and by --film\n"),
        (("--step-N", "0"), "Usage: curveline load"),
        (("--state", "hill"), "Usage: curveline load"),
    ],
)
def test_what_makes_no_sense_is_refused(run: Run, arguments: tuple[str, ...], message: str) -> None:
    code, out, err = run("load", SHAPE, *arguments, "--json")
    assert code == 2
    assert failure(out, 2)["message"].removeprefix("no/push.gif: ") in err
    assert err.startswith(message)


def test_a_state_that_is_not_there_is_exit_1(run: Run, no_valley: Path, tmp_path: Path) -> None:
    code, out, err = run("load", no_valley)
    assert (code, out) == (1, "")
    assert err.startswith(
        "error: no-valley, segment 1 has no stable valley to push; there is peak\nhint: choose another"
    )
    assert run("load", no_valley, "--state", "peak", "--most-N", "1").code == 0
    heavy = tmp_path / "heavy.toml"
    heavy.write_text(SHAPE.read_text() + "loads = [ { segment = 1, at = 0.5, force_N = [0.0, -9.0] } ]\n")
    code, out, err = run("load", heavy)
    assert (code, out) == (1, "")
    assert "the peak does not withstand the loads in the file; under them there is valley" in err


def test_an_invalid_file_and_a_shape_in_space_are_refused(run: Run) -> None:
    code, out, err = run("load", BROKEN / "syntax-no-equals.toml", "--json")
    assert code == 2
    assert failure(out, 2)["diagnostics"]
    assert ": error[" in err
    (code, out, err) = run("load", SHAPES / "space" / "pushed.toml")
    assert (code, out) == (2, "")
    assert "pushing is computed in the plane" in err


def test_a_long_table_is_thinned_to_its_ends_and_between() -> None:
    rows = list(range(101))
    assert load_report.thinned(rows) == list(range(0, 101, 5))
    assert load_report.thinned(rows[:21]) == rows[:21]


def test_a_branch_that_is_lost_is_exit_1_and_no_number_is_made_up(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(stand: Stand, most: float, _: float = 0.0) -> Limit:
        found = limit_of(stand, most)
        assert found is not None
        return Limit(0.8 * found.force, math.inf, snap_through.LOST, found.point, found.far)

    monkeypatch.setattr(snap_through, "limit_of", lost)
    monkeypatch.setattr(load_map, "limit_of", lost)
    code, out, err = run("load", SHAPE, "--json")
    assert code == 1
    assert "could not be followed" in err
    found = said(out)
    assert (found["kind"], found["snap_through_error_N"], found["lands_in"], found["ways"]) == ("lost", None, None, [])
    code, out, err = run("load", SHAPE)
    assert code == 1
    assert "and lost there" in out
    code, out, err = run("load", SHAPE, "--map", "--points", "3", "--json")
    assert code == 1
    assert said(out)["points"][1]["snap_through_error_N"] is None
