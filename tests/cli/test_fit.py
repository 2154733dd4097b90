"""`curveline fit` from a shell: what it writes, says and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from curveline.errors import EXIT_DONE, EXIT_NO, InvalidInput
from curveline.plan_file import read_plan
from curveline.shapes.files import read_shape

from .conftest import SHAPES, Run, failure

SINE = ("fit", "--formula", "60*sin(pi*x/500)")
DRAWINGS = SHAPES / "drawings"


def test_a_formula_becomes_a_shape_a_figure_and_a_plan(run: Run, tmp_path: Path) -> None:
    names = {suffix: str(tmp_path / f"sine{suffix}") for suffix in (".toml", ".svg", ".json")}
    plan = str(tmp_path / "plan.json")
    outputs = [part for name in names.values() for part in ("-o", name)]
    done = run(*SINE, *outputs, "--plan-file", plan)
    assert done.code == EXIT_DONE
    assert "0.0425 mm RMS" in done.out or "mm RMS" in done.out
    assert "plan: " in done.out
    assert read_shape(names[".toml"]).name == "sine"
    assert read_plan(plan).steps[-1].states == ("peak",)
    assert json.loads(Path(names[".json"]).read_text())["provenance"]["argv"]
    svg = Path(names[".svg"]).read_text()
    for word in ("drawn", "peak", "apart [mm]", "sine: "):
        assert word in svg


def test_what_comes_out_can_be_sent(run: Run, tmp_path: Path) -> None:
    shape = str(tmp_path / "sine.toml")
    assert run(*SINE, "-o", shape).code == EXIT_DONE
    sent = run("send", shape, "--radio", "mock", "--yes", "--runs", str(tmp_path / "runs"))
    assert sent.code == EXIT_DONE
    assert "the rod is in the peak, as wanted" in sent.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((str(DRAWINGS / "hill.svg"), "--curve", "hill"), "curve 'hill'"),
        ((str(DRAWINGS / "roof.dxf"), "--display", "quad"), "DXF in inch"),
        ((str(DRAWINGS / "whale.png"),), "50.8 dots per inch"),
    ],
)
def test_drawings_are_read_and_said_how(run: Run, arguments: tuple[str, ...], words: str) -> None:
    done = run("fit", *arguments)
    assert done.code == EXIT_DONE
    assert words in " ".join(done.out.split())
    assert all(len(line) <= 80 for line in done.out.splitlines())
    assert "nan" not in done.out


def test_brief_is_a_line(run: Run) -> None:
    done = run(*SINE, "--brief")
    (line,) = done.out.splitlines()
    assert line.startswith("60*sin(pi*x/500): 0.04")


def test_json_is_one_document(run: Run) -> None:
    told = json.loads(run(*SINE, "--json").out)
    assert told["distance"]["rms_mm"] < 0.1
    assert told["plan"]["steps"] > 0
    assert told["refusal"] is None


def test_a_distance_that_is_missed_is_a_no(run: Run, tmp_path: Path) -> None:
    shape = tmp_path / "step.toml"
    step = ("fit", "--formula", "where(x>250,100,0)", "--no-plan", "-o", str(shape))
    assert run(*step, "--within-mm", "5").code == EXIT_NO
    assert shape.exists()
    assert run(*step, "--force", "--within-mm", "20").code == EXIT_DONE
    assert run(*step, "--force", "--within-mm", "20", "--minimise", "max").code == EXIT_NO


def test_a_shape_without_a_plan_is_a_no_and_is_written(run: Run, tmp_path: Path) -> None:
    shape, plan, weak = tmp_path / "s.toml", tmp_path / "p.json", tmp_path / "weak.toml"
    text = run("display", "show", "single").out
    weak.write_text(text.replace("max_force_N = 8.0", "max_force_N = 3.0").replace("[500.0, 900.0]", "[560.0, 900.0]"))
    done = run(*SINE, "--display", str(weak), "-o", str(shape), "--plan-file", str(plan))
    assert done.code == EXIT_NO
    assert "no plan: " in done.out
    assert "no plan" in shape.read_text()
    assert not plan.exists()
    assert run(*SINE, "--display", str(weak), "--no-plan").code == EXIT_DONE


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "name one drawing"),
        (("x.csv", "--formula", "x"), "name one drawing"),
        (("--formula", "60*sin(pi*x/500"), "is no formula"),
        (("--formula", "__import__('os')"), "cannot have"),
        (("--formula", "x", "--unit", "mm"), "are for files"),
        (("--formula", "x", "--within-mm", "0"), "no curve is within"),
        (("--formula", "x", "--margin", "0"), "no plan keeps"),
        (("--formula", "x", "-o", "x.gif"), "suffix"),
        (("--formula", "x", "--plan-file", "x.toml"), "ends in .json"),
        (("--formula", "x", "--plan-file", "x.json", "-o", "x.json"), "a file of its own"),
        (("--formula", "x", "--plan-file", "x.json", "-o", "./x.json"), "a file of its own"),
        (("--formula", "x", "-o", "x.toml", "-o", "./x.toml"), "named twice"),
        (("--formula", "x", "--shift-mm", "9"), "leave --shift-mm out"),
        (("--formula", "x", "--plan-file", "x.json", "--no-plan"), "leave one out"),
        (("--formula", "x", "--display", "double"), "double"),
        (("--formula", "x", "--place", "fit", "--shift-mm", "900"), "display"),
        (("nowhere.svg",), "nowhere.svg"),
    ],
)
def test_misuse_is_refused_with_a_hint(run: Run, arguments: tuple[str, ...], words: str) -> None:
    done = run("fit", *arguments)
    assert done.code == InvalidInput.exit_code
    assert words in done.err
    assert "Traceback" not in done.err
    assert done.out == ""


def test_a_drawing_that_is_too_narrow_is_told_in_json(run: Run, tmp_path: Path) -> None:
    short = tmp_path / "short.csv"
    short.write_text("x_mm,y_mm\n0,0\n100,20\n200,0\n")
    told = failure(run("fit", str(short), "--json").out, InvalidInput.exit_code)
    assert "200" in json.dumps(told)
    done = run("fit", str(short), "--scale", "width", "--no-plan")
    assert done.code == EXIT_DONE
    assert "scaled by 2.5" in " ".join(done.out.split())


def test_a_drawing_across_a_rail_twice_is_refused(run: Run, tmp_path: Path) -> None:
    back = tmp_path / "back.csv"
    back.write_text("x_mm,y_mm\n0,0\n600,20\n400,60\n1200,0\n2100,0\n")
    done = run("fit", str(back), "--display", "quad")
    assert done.code == InvalidInput.exit_code
    assert "node 2, at 500 mm, 3 times" in done.err


def test_nothing_is_replaced_without_force(run: Run, tmp_path: Path) -> None:
    shape = tmp_path / "sine.toml"
    shape.write_text("mine")
    assert run(*SINE, "-o", str(shape)).code == InvalidInput.exit_code
    assert shape.read_text() == "mine"


def test_as_few_nodes_as_are_enough_with_their_display(run: Run, tmp_path: Path) -> None:
    shape, plan = tmp_path / "bow.toml", tmp_path / "bow.json"
    bow = ("fit", "--formula", "100*sin(pi*x/2000)", "--display", "quad", "--nodes", "9", "--within-mm", "3")
    done = run(*bow, "-o", str(shape), "--plan-file", str(plan))
    assert done.code == EXIT_DONE
    scene = read_shape(shape)
    assert scene.display.node_count == 3
    assert scene.display.span == pytest.approx(1.0)
    assert "bow-display.toml" in shape.read_text()
    assert "# estimate" in (tmp_path / "bow-display.toml").read_text()
    sent = run("send", str(plan), "--radio", "mock", "--yes", "--runs", str(tmp_path / "runs"))
    assert sent.code == EXIT_DONE


@pytest.mark.parametrize(
    ("options", "words"),
    [(("-o", "x.toml"), "say how near"), (("--within-mm", "2"), "beside its shape"), (("--nodes", "1"), "1")],
)
def test_fewest_nodes_want_a_distance_and_a_place(run: Run, options: tuple[str, ...], words: str) -> None:
    done = run(*SINE, "--nodes", "5", *options)
    assert done.code == InvalidInput.exit_code
    assert words in done.err


def test_a_file_of_any_name_is_shown_and_becomes_a_shape(run: Run, tmp_path: Path) -> None:
    drawing = tmp_path / (40 * "long" + "\x1b[31m\n.csv")
    drawing.write_text("x_mm,y_mm\n0,0\n250,30\n500,0\n")
    shape = tmp_path / ("\x1b[31m" + 40 * "long" + ".toml")
    for outputs in ((), ("-o", str(shape))):
        done = run("fit", str(drawing), "--no-plan", "--brief", *outputs)
        assert done.code == EXIT_DONE
        assert "\x1b" not in done.out
        assert len(done.out.splitlines()) == 1
    assert len(read_shape(shape).name) == 100
