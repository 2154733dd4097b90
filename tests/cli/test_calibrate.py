"""`curveline calibrate set`: the set of a rod from readings, printed, as JSON, and written into a display file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.material.drum_fit import drum_curvatures
from curveline.material.relaxation import power_law
from curveline.shapes.files import builtin_text

LAW = power_law(1.3, 0.31)
ROWS = [(8, 60), (8, 3600), (8, 28_800), (168, 60), (168, 3600), (168, 86_400)]


@pytest.fixture
def strip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A file of readings that follow a law, in the folder where commands run."""
    monkeypatch.chdir(tmp_path)
    held, after = np.array(ROWS, dtype=float).T
    read = drum_curvatures(LAW, np.full(len(ROWS), 10.0), 3600.0 * held, after)
    rows = [f"100,{h}h,{a}s,{k:.4f}" for (h, a), k in zip(ROWS, read, strict=True)]
    Path("strip.csv").write_text("\n".join(["drum_radius_mm,held,after,curvature_per_m", *rows]))
    Path("mine.toml").write_text(builtin_text("single"))
    return "strip.csv"


def test_the_fit_is_printed_as_lines_to_paste_and_beside_every_reading(run, strip: str) -> None:
    done = run("calibrate", "set", strip)
    assert done.code == 0
    assert "[rod]\nset_strength = 1.3" in done.out
    assert "set_exponent = 0.31" in done.out
    assert "(95 %)" in done.out
    assert "6 readings" in done.out
    assert done.out.count("    100") == 6
    assert "warning" not in done.out


def test_json_has_it_all(run, strip: str) -> None:
    done = run("calibrate", "set", strip, "--json")
    document = json.loads(done.out)
    assert document["set_strength"] == pytest.approx(1.3, rel=1e-2)
    low, high = document["set_exponent_95"]
    assert low < 0.31 < high
    assert document["is_exponent_told"]
    assert len(document["readings"]) == 6


def test_it_is_written_into_a_display_file(run, strip: str) -> None:
    done = run("calibrate", "set", strip, "-o", "mine.toml")
    assert done.code == 0
    assert "wrote set_strength, set_exponent into mine.toml" in done.err
    law = curveline.read_display("mine.toml").rod.relaxation
    assert law is not None
    assert law.modulus(3600.0) == pytest.approx(LAW.modulus(3600.0), abs=2e-3)


def test_python_does_the_same(strip: str) -> None:
    fit = curveline.calibrate_set(strip, "mine.toml")
    assert fit.strength == pytest.approx(1.3, rel=1e-2)
    assert curveline.read_display("mine.toml").rod.relaxation == power_law(*fit.keys.values())
    again = curveline.calibrate_set(fit.readings)
    assert again.strength == fit.strength


def test_what_is_wrong_with_a_file_is_told(run, strip: str) -> None:
    Path(strip).write_text("drum_radius_mm,held,after,curvature_per_m\n100,8,60s,1\n")
    done = run("calibrate", "set", strip)
    assert done.code == 2
    assert "strip.csv:2:1: error[bad-value]: held: '8' has no unit" in done.err


def test_strips_without_a_set_are_an_answer(run, strip: str) -> None:
    Path(strip).write_text("drum_radius_mm,held,after,curvature_per_m\n100,8h,60s,0\n100,8h,1h,0\n100,8h,2h,0\n")
    done = run("calibrate", "set", strip)
    assert done.code == 1
    assert "the strips took no set" in done.err


def test_a_display_that_cannot_be_written_leaves_the_answer(run, strip: str) -> None:
    done = run("calibrate", "set", strip, "-o", "none.toml")
    assert done.code == 2
    assert "none.toml" in done.err
