"""`curveline calibrate rod`: a display from trials of its shapes, printed, as JSON, in files, and what is wrong."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import curveline

DATA = Path(__file__).parents[1] / "data" / "trials"
QUICK = ("--asymmetry", "none")


@pytest.fixture
def trials(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A folder of trials of a peak and its valley, where commands run."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(DATA, "trials")
    return "trials"


def test_numbers_and_shapes_are_printed(run, trials: str) -> None:
    done = run("calibrate", "rod", trials, *QUICK)
    assert done.code == 0
    assert "bearings give" in done.out
    assert "intervals at 95 %, by how much 2 shapes disagree" in done.out
    assert "no shape tells EI alone" in done.out
    assert "these shapes do not tell: gravity length" in done.out
    assert "measure " in done.out
    assert "mm before" in done.out
    assert "keep what was found with -o DISPLAY.toml" in done.err
    assert max(map(len, done.out.splitlines())) <= 80


def test_brief_is_one_line(run, trials: str) -> None:
    done = run("calibrate", "rod", trials, *QUICK, "--brief")
    assert done.code == 0
    assert done.out.startswith("single: bearings give ")
    assert len(done.out.splitlines()) == 1
    assert "camera" not in done.out


def test_json_has_it_all(run, trials: str) -> None:
    done = run("calibrate", "rod", trials, *QUICK, "--json")
    document = json.loads(done.out)
    names = [each["name"] for each in document["numbers"]]
    assert names[:2] == ["gravity length", "bearings give"]
    assert document["shapes"] == 2
    assert document["rms_mm"]["after"] < 1.0 < document["rms_mm"]["before"]
    assert document["write"]["rod"]["bending_stiffness_Nmm2"] > 0.0
    assert [row["trials"] for row in document["rows"]] == [2, 2]
    assert document["next"]["shapes"]
    assert document["never_told"] == ["bending stiffness alone", "natural curvature"]


def test_files_are_written_and_never_over_others(run, trials: str) -> None:
    done = run("calibrate", "rod", trials, *QUICK, "-o", "mine.toml", "-o", "mine.svg", "-o", "mine.json")
    assert done.code == 0
    assert "wrote mine.toml" in done.err
    display = curveline.read_display("mine.toml")
    assert len(display.offsets.angles) == 2
    assert "# KHK" not in Path("mine.toml").read_text()
    assert "a KHK DR1-2000 rack" in Path("mine.toml").read_text()
    assert Path("mine.svg").read_text().startswith("<?xml")
    assert json.loads(Path("mine.json").read_text())["has_asymmetry"] is False
    again = run("calibrate", "rod", trials, *QUICK, "-o", "mine.toml")
    assert again.code == 2
    assert "mine.toml" in again.err
    held = run("compare", trials, "--display", "mine.toml", "--max-rmse-mm", "1")
    assert held.code == 0
    once_more = run("calibrate", "rod", trials, *QUICK, "--display", "mine.toml", "-o", "mine.toml", "--force")
    assert once_more.code == 0
    assert curveline.read_display("mine.toml").clamp_stiffness == pytest.approx(display.clamp_stiffness, rel=0.05)


def test_a_droop_test_is_taken_into_account(run, trials: str) -> None:
    done = run("calibrate", "rod", trials, *QUICK, "--droop", "300,14.3,0.3", "--json")
    low, high = json.loads(done.out)["numbers"][0]["interval_95"]
    assert 370.0 < low < 412.0 < high < 450.0


@pytest.mark.parametrize("droop", ["300", "300,a", "1,2,3,4", "300,290", "300,-1", "nan,3"])
def test_what_is_no_droop_test_is_refused(run, trials: str, droop: str) -> None:
    done = run("calibrate", "rod", trials, "--droop", droop)
    assert done.code == 2
    assert "error:" in done.err
    assert "Traceback" not in done.err


def test_a_candidate_is_a_shape(run, trials: str) -> None:
    done = run("calibrate", "rod", trials, *QUICK, "--candidates", "nowhere")
    assert done.code == 2
    assert "there is no such file" in done.err


def test_one_shape_is_too_few(run, trials: str) -> None:
    for path in Path(trials).glob("level-up-valley-*"):
        path.unlink()
    done = run("calibrate", "rod", trials)
    assert done.code == 2
    assert "1 shape with trials that can be used cannot tell how good the numbers are" in done.err


def test_a_display_in_no_plain_form_is_refused_with_its_name(run, trials: str) -> None:
    text = curveline.builtin_text("single")
    inline = text.replace("[radio]", "[radio]").replace('name = "single"', 'name = "odd"')
    begin, end = inline.index("[rod]"), inline.index("[limits]")
    rod = "{ youngs_modulus_GPa = 2.45, width_mm = 10.0, thickness_mm = 2.4, mass_g_per_m = 48.0, max_strain = 0.03, "
    rod += "total_length_mm = 2000.0 }"
    Path("odd.toml").write_text(f"rod = {rod}\n{inline[:begin]}{inline[end:]}")
    done = run("calibrate", "rod", trials, *QUICK, "--display", "odd.toml", "-o", "mine.toml")
    assert done.code in (0, 2)
    if done.code == 2:
        assert "odd.toml" in done.err
        assert "cannot be changed" in done.err
    else:
        assert curveline.read_display("mine.toml").name == "odd"
