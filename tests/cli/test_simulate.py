"""`curveline simulate`: what it prints, writes, refuses and exits with."""

from __future__ import annotations

import csv
import json
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from curveline.cli.commands.simulate import ModelOption
from curveline.kernels import readiness
from curveline.simulation.simulate import MODELS

from .conftest import BROKEN, SHAPES, Run

ROOT = SHAPES.parent
PEAK = SHAPES / "level-up-peak.toml"
PUSHED = SHAPES / "space" / "pushed.toml"
STAGGERED = SHAPES / "staggered-asymmetric-valley.toml"


def test_a_shape_is_shown_as_a_table_and_a_drawing_on_80_columns(run: Run) -> None:
    code, out, err = run("simulate", STAGGERED)
    assert code == 0
    assert err == ""
    assert all(len(line) <= 80 for line in out.splitlines())
    rows = {line.split()[0 if "*" not in line else 1]: line for line in out.splitlines() if line.strip()}
    assert "*" in rows["valley"]
    assert "*" not in rows["peak"]
    assert "-72.93" in rows["valley"]
    assert "left out, at most: stretch 0.02 mm, twist 0 mm, contact 0 mm" in out
    assert "solid: valley, as wanted; dotted: peak" in out
    assert out.count("●") == 2


def test_a_shape_in_space_says_so_and_how_far_it_comes_out(run: Run) -> None:
    code, out, err = run("simulate", PUSHED)
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "segment 1: 660 mm of rod, peak wanted, spatial model" in out
    above, head, wanted = (line.split() for line in out.splitlines()[3:6])
    assert " ".join(above) == "height mm energy error force N moment N mm"
    assert " ".join(head) == "state mean depth mJ mm stability left right left right"
    assert wanted[:2] == ["*", "peak"]
    assert float(wanted[3]) == pytest.approx(8.17, abs=0.05)
    assert out.rstrip().endswith("dotted: valley; seen from the front")


def test_a_model_can_be_asked_for(run: Run) -> None:
    kinds = {}
    for model in ("auto", "planar", "extensible", "spatial"):
        document = json.loads(run("simulate", PEAK, "--model", model, "--json").out)
        assert document["provenance"]["settings"]["model"] == model
        kinds[model] = document["segments"][0]["model"]["kind"]
    assert kinds == {"auto": "planar", "planar": "planar", "extensible": "extensible", "spatial": "spatial"}
    code, out, err = run("simulate", PEAK, "--model", "flat")
    assert (code, out) == (2, "")
    assert "error: --model takes auto, planar, extensible or spatial, not flat\n" in err
    assert [each.value for each in ModelOption] == list(MODELS)


def test_a_model_that_leaves_out_too_much_is_obeyed_and_noted(run: Run) -> None:
    code, out, err = run("simulate", PUSHED, "--model", "planar", "--json")
    assert code == 0
    model = json.loads(out)["segments"][0]["model"]
    assert model["kind"] == "planar"
    bound = model["left_out"]["twist"]["bound_mm"]
    assert 50.0 < bound < 100.0
    assert err == f"{PUSHED}: segment 1: the planar model leaves out twist, which may move it by {bound:.2g} mm\n"
    (free,) = json.loads(run("simulate", PUSHED, "--json").out)["segments"]
    flat = json.loads(out)["segments"][0]
    for state, other in zip(free["states"], flat["states"], strict=True):
        spatial = [(*point, depth) for point, depth in zip(state["curve_mm"], state["depth_mm"], strict=True)]
        planar = [(*point, 0.0) for point in other["curve_mm"]]
        assert max(map(math.dist, spatial, planar)) <= bound


def test_a_rod_that_would_not_stay_in_the_plane_is_said_to_buckle(run: Run, tmp_path: Path) -> None:
    display = (ROOT / "curveline" / "shapes" / "displays" / "single.toml").read_text()
    (tmp_path / "narrow.toml").write_text(display.replace("width_mm = 10.0 ", "width_mm = 1.2 "))
    shape = tmp_path / "narrow-shape.toml"
    shape.write_text(PEAK.read_text().replace('"single"', '"narrow.toml"'))
    code, out, err = run("simulate", shape)
    assert code == 1
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "unstable in the plane, which the rod leaves: buckled-1" in out
    assert "seen from the front" in out
    assert "segment 1 has no peak; its stable states: buckled-1" in err
    code, out, err = run("simulate", shape, "--model", "planar", "--json")
    assert code == 1
    assert {state["outcome"] for state in json.loads(out)["segments"][0]["states"]} == {"buckles"}
    assert "segment 1 has no peak; its stable states: none at all" in err
    assert "segment 1, buckled-1: stable in its plane, but not in space" in err


def test_explaining_fits_80_columns_and_goes_into_the_document(run: Run) -> None:
    code, out, err = run("simulate", PUSHED, "--explain", "--no-drawing")
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    document = json.loads(run("simulate", PUSHED, "--explain", "--json").out)
    told = document["segments"][0]["model"]["explanation"]
    assert told
    assert " ".join(told) in " ".join(out.split())


def test_without_the_drawing(run: Run) -> None:
    result = run("simulate", PEAK, "--no-drawing")
    assert result.code == 0
    assert "●" not in result.out
    assert "solid" not in result.out
    assert "peak" in result.out


def test_json_is_one_document_and_nothing_else(run: Run) -> None:
    code, out, err = run("simulate", PEAK, "--json")
    assert (code, err) == (0, "")
    assert out.count("\n") == 1
    document = json.loads(out)
    assert document["shape"] == "level-up-peak"
    assert document["provenance"]["argv"] == ["simulate", str(PEAK), "--json"]
    assert "-o" not in out


def test_json_of_several_shapes_is_one_document_per_line(run: Run) -> None:
    code, out, err = run("simulate", PEAK, STAGGERED, "--json")
    assert code == 0
    assert [json.loads(line)["shape"] for line in out.splitlines()] == ["level-up-peak", "staggered-asymmetric-valley"]
    assert err == "2 of 2 shapes as asked for\n"


def test_a_batch_goes_on_after_a_bad_file_and_sums_up(run: Run) -> None:
    bad = BROKEN / "many-problems.toml"
    code, out, err = run("simulate", PEAK, bad, STAGGERED, "--json")
    assert code == 1
    first, second, third = map(json.loads, out.splitlines())
    assert (first["shape"], third["shape"]) == ("level-up-peak", "staggered-asymmetric-valley")
    assert second["file"] == str(bad)
    assert [each["code"] for each in second["error"]["diagnostics"]].count("unknown-key") == err.count("[unknown-key]")
    assert f"{bad}:4:1: error[unknown-key]" in err
    assert err.endswith(f"2 of 3 shapes as asked for\n  could not be used: {bad}\n")


def test_a_single_invalid_file_is_shown_with_a_caret_and_a_hint(run: Run) -> None:
    bad = BROKEN / "many-problems.toml"
    code, out, err = run("simulate", bad)
    assert (code, out) == (2, "")
    lines = err.splitlines()
    at = lines.index(f"{bad}:4:1: error[unknown-key]: there is no key `colour` here")
    assert lines[at + 1 : at + 3] == ['  colour = "red"', "  ^"]
    assert lines[at + 3].startswith("hint: ")
    assert "Traceback" not in err


@pytest.mark.parametrize("path", sorted(BROKEN.glob("*.toml")), ids=lambda path: path.stem)
def test_every_broken_file_is_refused_in_words(run: Run, path: Path) -> None:
    code, out, err = run("simulate", path, "--json")
    assert code == 2
    document = json.loads(out)
    assert document["file"] == str(path)
    assert err.count(": error[") == len(document["error"]["diagnostics"]) > 0
    for each in document["error"]["diagnostics"]:
        assert f"{each['path']}:{each['line']}:{each['column']}: error[{each['code']}]: {each['message']}\n" in err
        assert each["hint"]


def test_a_wanted_state_that_does_not_exist_is_the_answer_no(run: Run, no_valley: Path) -> None:
    code, out, err = run("simulate", no_valley)
    assert code == 1
    assert "valley wanted" in out
    told, hint, rest = err.split("\n")
    assert (told, rest) == (f"{no_valley}: segment 1 has no valley; its stable states: peak", "")
    found = re.fullmatch(
        r"hint: segment 1: with length of segment 1 of (\S+) mm instead of 560 mm it has a valley", hint
    )
    assert found is not None
    code, _, err = run("simulate", PEAK, no_valley)
    assert code == 1
    assert err.endswith(f"1 of 2 shapes as asked for\n  not as asked for: {no_valley}\n")
    no_valley.write_text(no_valley.read_text().replace("560.0", found[1]))
    assert run("simulate", no_valley).code == 0


def test_a_tolerance_that_was_not_reached_is_the_answer_no(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from curveline.rod.states import equilibrium, planar_states

    # Of the two ways to a state the one that knows of a limit.
    monkeypatch.setattr(planar_states, "_plain", lambda *_: [])
    monkeypatch.setattr(equilibrium, "MOST_EDGES", 30)
    code, out, err = run("simulate", PEAK, "--tolerance-mm", "1e-6")
    assert code == 1
    assert "peak" in out
    assert "the tolerance was not reached" in err


def test_points_and_tolerance(run: Run) -> None:
    document = json.loads(run("simulate", PEAK, "--json", "--points", "5", "--tolerance-mm", "0.001").out)
    assert document["tolerance_mm"] == 0.001
    states = document["segments"][0]["states"]
    assert all(len(state["curve_mm"]) == 5 for state in states)
    assert all(state["error_mm"] <= 0.001 for state in states)


def test_turns_look_for_loops(run: Run) -> None:
    plain = json.loads(run("simulate", PEAK, "--json").out)["segments"][0]["states"]
    assert {state["winding"] for state in plain} == {0}
    code, out, _ = run("simulate", PEAK, "--turns", "1", "--json")
    assert code == 0
    states = json.loads(out)["segments"][0]["states"]
    loops = [state for state in states if state["winding"]]
    assert {state["winding"] for state in loops} <= {1, -1}
    assert loops
    assert not any(state["wanted"] or state["name"] in ("peak", "valley") for state in loops)
    text = run("simulate", PEAK, "--turns", "1").out
    assert "a planar display cannot show them" in " ".join(text.split())
    assert all(len(line) <= 80 for line in text.splitlines())


@pytest.mark.parametrize(
    "arguments",
    [
        ("--tolerance-mm", "0"),
        ("--tolerance-mm", "nan"),
        ("--tolerance-mm", "inf"),
        ("--tolerance-mm", "wide"),
        ("--points", "1"),
        ("--turns", "-1"),
        ("--unknown",),
    ],
)
def test_options_out_of_range_are_usage_errors(run: Run, arguments: tuple[str, ...]) -> None:
    code, out, err = run("simulate", PEAK, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("Usage: curveline simulate [OPTIONS] SHAPE...\nerror: ")
    assert err.endswith("hint: `curveline simulate -h` explains it\n")
    assert arguments[0] in err
    assert "Input should" not in err
    assert "Traceback" not in err


def test_the_suffix_chooses_the_format(run: Run, tmp_path: Path) -> None:
    files = [tmp_path / f"out{suffix}" for suffix in (".json", ".npz", ".csv", ".svg", ".png")]
    code, out, err = run("simulate", PEAK, *(part for file in files for part in ("-o", file)))
    assert code == 0
    assert "peak" in out
    assert err.splitlines() == [f"wrote {file}" for file in files]
    assert json.loads(files[0].read_text())["shape"] == "level-up-peak"
    with np.load(files[1]) as arrays:
        assert arrays["curve_mm"].shape == (2, 201, 2)
    assert len(list(csv.reader(files[2].read_text().splitlines()))) == 1 + 2 * 201
    assert files[3].read_bytes().startswith(b"<?xml")
    assert files[4].read_bytes().startswith(b"\x89PNG")


def test_a_dash_is_json_on_stdout(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "out.csv"
    code, out, err = run("simulate", PEAK, "-o", "-", "-o", file)
    assert code == 0
    assert json.loads(out)["shape"] == "level-up-peak"
    assert err == f"wrote {file}\n"


def test_an_existing_file_is_kept_unless_forced(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "out.json"
    file.write_text("mine")
    code, out, err = run("simulate", PEAK, "-o", file)
    assert (code, out) == (2, "")
    assert "error[exists]" in err
    assert "--force" in err
    assert file.read_text() == "mine"
    assert run("simulate", PEAK, "-o", file, "--force").code == 0
    assert json.loads(file.read_text())["shape"] == "level-up-peak"


def test_an_unknown_suffix_is_refused_before_any_work(run: Run, tmp_path: Path) -> None:
    code, out, err = run("simulate", PEAK, "-o", tmp_path / "out.txt")
    assert (code, out) == (2, "")
    assert ".json, .npz, .csv, .svg, .png, .pdf" in err
    assert list(tmp_path.glob("out*")) == []


def test_a_folder_that_is_not_there_is_named(run: Run, tmp_path: Path) -> None:
    code, out, err = run("simulate", PEAK, "-o", tmp_path / "no" / "out.json")
    assert (code, out) == (2, "")
    assert "error[no-such-folder]" in err


def test_nothing_is_written_when_every_file_is_invalid(run: Run, tmp_path: Path) -> None:
    code, _, err = run("simulate", BROKEN / "syntax.toml", "-o", tmp_path / "out.json")
    assert code == 2
    assert "wrote" not in err
    assert not (tmp_path / "out.json").exists()


def test_a_figure_without_matplotlib_names_the_extra(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, out, err = run("simulate", PEAK, "-o", tmp_path / "out.png")
    assert (code, out) == (2, "")
    assert "curveline[plot]" in err
    assert not (tmp_path / "out.png").exists()
    assert run("simulate", PEAK, "-o", tmp_path / "out.csv").code == 0


def test_the_first_run_says_why_it_takes_long_and_says_it_once(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(readiness, "is_first_run", lambda: True)
    _, _, err = run("simulate", PEAK, PEAK)
    assert err.splitlines()[0] == "compiling kernels, about 35 s, once"
    assert err.count("compiling") == 1


def test_time_is_that_of_the_answer(run: Run) -> None:
    document = json.loads(run("simulate", PEAK, "--json").out)
    assert 0.0 < document["seconds"] < 60.0
    assert math.isfinite(document["seconds"])
