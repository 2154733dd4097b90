"""`curveline surface` from a shell: the folder, what it says, what it refuses, and that it can be sent."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
from PIL import Image

from curveline.errors import EXIT_DONE, EXIT_NO, Infeasible, InvalidInput
from curveline.fitting import fit
from curveline.fitting.search import RowSearch
from surfaces.meshes_known import box, stl

from .conftest import Run, failure

BOW = ("surface", "--formula", "60*sin(pi*x/500)*cos(pi*(y-40)/900)", "--lines", "2", "--jobs", "1")


def test_a_formula_becomes_a_folder_and_a_figure(run: Run, tmp_path: Path) -> None:
    folder, figure, table = (str(tmp_path / name) for name in ("bow", "bow.svg", "bow.json"))
    done = run(*BOW, "-o", folder, "-o", figure, "-o", table)
    assert done.code == EXIT_DONE
    assert "0.0426 " in done.out or "0.04" in done.out
    for words in ("rod: ", "4 nodes, 12 motors", "current at worst: 7.2 A, 3.6 A a line, 0.6 A a motor", "time: "):
        assert words in " ".join(done.out.split())
    assert all(len(line) <= 80 for line in done.out.splitlines())
    assert sorted(path.name for path in (tmp_path / "bow").iterdir()) == [
        *("display-1.toml", "display-2.toml", "line-1.json", "line-1.toml", "line-2.json", "line-2.toml"),
        *("lines.toml", "surface.json", "surface.svg"),
    ]
    assert json.loads(Path(table).read_text())["argv"]
    svg = Path(figure).read_text()
    for word in ("off the surface [mm]", "asked for", "2 lines, up to", "500 mm"):
        assert word in svg


def test_the_folder_can_be_sent(run: Run, tmp_path: Path) -> None:
    folder = str(tmp_path / "bow")
    assert run(*BOW, "-o", folder).code == EXIT_DONE
    sent = run("send", folder, "--radio", "mock:loss=0.3,seed=5", "--yes", "--runs", str(tmp_path / "runs"))
    assert sent.code == EXIT_DONE
    assert sent.out.count("as wanted") == 2


def test_a_mesh_and_a_picture(run: Run, tmp_path: Path) -> None:
    plate, grey = tmp_path / "plate.stl", tmp_path / "grey.png"
    plate.write_bytes(stl(box((0.0, 0.0, 0.0), (500.0, 200.0, 30.0))))
    Image.new("L", (50, 20), 255).save(grey)
    done = run("surface", str(plate), "--unit", "mm", "--lines", "2", "--no-plan", "-j", "1")
    assert done.code == EXIT_DONE
    assert "STL of 12 faces, 1 unit = 1 mm, 500 x 200 x 30 mm in all" in " ".join(done.out.split())
    done = run("surface", str(grey), "--width-mm", "500", "--height-mm", "0:40", "--lines", "2", "--no-plan", "-j", "1")
    assert done.code == EXIT_DONE
    assert "1 pixel = 10 mm" in " ".join(done.out.split())


def test_brief_is_a_line(run: Run) -> None:
    done = run(*BOW, "--brief", "--no-plan")
    (line,) = done.out.splitlines()
    assert line.startswith("60*sin(pi*x/500)*cos(pi*(y-40)/900): 2 lines, up to 0.04")


def test_json_is_one_document(run: Run) -> None:
    told = json.loads(run(*BOW, "--json", "--no-plan", "--current-A-per-motor", "0.2").out)
    assert [line["line"] for line in told["lines"]] == [1, 2]
    assert told["budget"]["current_A"] == pytest.approx(2.4)
    assert told["budget"]["current_from"] == "as given"
    assert told["budget"]["seconds_together"] is None


def test_a_distance_that_is_missed_is_a_no_and_the_folder_is_there(run: Run, tmp_path: Path) -> None:
    folder = tmp_path / "steps"
    steps = ("surface", "--formula", "where(x>250,100,0)", "--lines", "1", "--no-plan", "-j", "1", "-o", str(folder))
    assert run(*steps, "--within-mm", "5").code == EXIT_NO
    said = tomllib.loads((folder / "lines.toml").read_text())
    assert [line["plan"] for line in said["lines"]] == ["line-1.toml"]
    assert run(*steps).code == InvalidInput.exit_code
    assert run(*steps, "--force", "--within-mm", "20").code == EXIT_DONE


def test_a_line_without_any_stable_curve_is_told(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wave = ("surface", "--formula", "90*sin(pi*x/166)*cos(y/200)", "--lines", "3", "-j", "1", "--no-plan")
    # With these random numbers a quick search meets none.
    assert run("fit", "--formula", "90*sin(pi*x/166)*cos(75/200)", "--seed", "2", "--no-plan").code == EXIT_NO
    assert run(*wave, "--seed", "2").code == EXIT_DONE
    monkeypatch.setattr(fit, "search", lambda *_: RowSearch((), 12))
    done = run(*wave, "-o", str(tmp_path / "wave"))
    assert done.code == EXIT_NO
    assert "line 1: no stable curve of single-1 was met near it" in " ".join(done.err.split())
    assert not (tmp_path / "wave").exists()


def test_a_line_without_a_plan_is_a_no_and_its_shape_is_there(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = fit.make_plan

    def only_first(scene):  # type: ignore[no-untyped-def]
        if scene.name == "line-2":
            raise Infeasible("no way there\nat all")
        return whole(scene)

    monkeypatch.setattr(fit, "make_plan", only_first)
    folder = tmp_path / "bow"
    done = run(*BOW, "-o", str(folder))
    assert done.code == EXIT_NO
    assert "line 2 has no plan: no way there" in done.out
    said = tomllib.loads((folder / "lines.toml").read_text())
    assert [line["plan"] for line in said["lines"]] == ["line-1.json", "line-2.toml"]
    assert json.loads((folder / "surface.json").read_text())["budget"]["seconds_together"] is None


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "name one surface"),
        (("a.stl", "--formula", "x"), "name one surface"),
        (("a.stl", "--unit", "mm"), "no such file"),
        (("a.svg",), "surfaces are not read from .svg files"),
        (("--formula", "x*z"), "a formula cannot have 'z'"),
        (("--formula", "x", "--unit", "mm"), "are for files"),
        (("--formula", "x", "--scale", "width"), "no width"),
        (("--formula", "x", "--lines", "0"), "1 to 64 lines"),
        (("--formula", "x", "--lines", "99"), "1 to 64 lines"),
        (("--formula", "x", "--pitch-mm", "-3"), "mm apart"),
        (("--formula", "x", "--within-mm", "0"), "within"),
        (("--formula", "x", "--current-A-per-motor", "0"), "no motor draws"),
        (("--formula", "x", "--margin", "7"), "margin"),
        (("--formula", "x", "-o", "a", "-o", "b"), "one folder"),
        (("--formula", "x", "-o", "no/such"), "no folder"),
        (("a.png", "--height-mm", "5"), "no heights"),
    ],
)
def test_what_cannot_be_is_refused(run: Run, arguments: tuple[str, ...], words: str) -> None:
    done = run("surface", *arguments)
    assert done.code == InvalidInput.exit_code
    assert words in " ".join(done.err.split())
    assert "hint: " in done.err
    assert "Traceback" not in done.err


def test_a_mesh_without_a_unit_is_refused_in_json(run: Run, tmp_path: Path) -> None:
    plate = tmp_path / "plate.stl"
    plate.write_bytes(stl(box((0.0, 0.0, 0.0), (500.0, 200.0, 30.0))))
    told = failure(run("surface", str(plate), "--json").out, InvalidInput.exit_code)
    assert "unit" in told["message"]
