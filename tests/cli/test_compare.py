"""`curveline compare` on the command line: its table, its files, its exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from curveline.shapes.files import read_shape
from curveline.units import mm
from made_trials import curve, write_table, write_trials

from .conftest import SHAPES, Run

PEAK = str(SHAPES / "level-up-peak.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("trials")
    write_trials(path, ("level-up-peak", "level-up-valley", "staggered-down-peak"))
    return path


def test_the_table_fits_a_terminal_and_says_what_numbers_are(run: Run, folder: Path) -> None:
    code, out, _ = run("compare", folder)
    assert code == 0
    lines = out.splitlines()
    assert lines[0].split() == ["shape", "trials", "state", "MSD", "mm", "%", "RMSE", "mm", "%", "across", "mm"]
    assert "3 of 3 shapes in the wanted states: MSD " in out
    assert "440 mm, the way of a node up and down" in " ".join(out.split())
    assert max(len(line) for line in lines[:4]) <= 80


def test_every_kind_of_file(run: Run, folder: Path, tmp_path: Path) -> None:
    files = [tmp_path / f"out{suffix}" for suffix in (".svg", ".png", ".pdf", ".csv", ".json")]
    code, out, _ = run("compare", folder, *(part for file in files for part in ("-o", file)), "-o", "-")
    assert code == 0
    assert all(file.stat().st_size > 1000 for file in files)
    assert json.loads(out)["agreeing"] == json.loads(files[-1].read_text())["agreeing"]
    svg = files[0].read_text()
    assert svg.count("MSD") == 3
    assert "level up" in svg
    assert run("compare", folder, "-o", files[0]).code == 2


def test_brief_is_a_line_a_shape(run: Run, folder: Path) -> None:
    lines = run("compare", folder, "--brief").out.splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("level-up-peak: peak, as wanted, RMSE ")


def test_wrong_states_and_distances_are_exit_code_1(run: Run, folder: Path, tmp_path: Path) -> None:
    valley, off = tmp_path / "valley.csv", tmp_path / "off.csv"
    points = curve(read_shape("level-up-peak"))
    write_table(valley, curve(read_shape("level-up-peak"), "valley"))
    write_table(off, points + np.array([0.0, mm(5.0)]))
    code, out, _ = run("compare", PEAK, valley)
    assert code == 1
    assert "in the wrong state: valley, not peak" in " ".join(out.split())
    assert run("compare", PEAK, off).code == 0
    code, out, _ = run("compare", PEAK, off, "--max-rmse-mm", "4")
    assert code == 1
    assert "farther off than --max-rmse-mm allows" in " ".join(out.split())


def test_another_display_is_what_trials_are_held_against(run: Run, folder: Path, tmp_path: Path) -> None:
    soft = tmp_path / "soft.toml"
    text = run("display", "show", "single").out
    soft.write_text(f"clamp_stiffness_Nmm_per_deg = 40\n{text}")
    own = json.loads(run("compare", folder, "--json").out)
    other = json.loads(run("compare", folder, "--display", soft, "--json").out)
    assert other["rmse_mm"] > 3.0 * own["rmse_mm"]
    code, _, err = run("compare", folder, "--display", "quad")
    assert code == 2
    assert "other nodes or another span" in err


def test_photographs_need_a_camera_file(run: Run, tmp_path: Path) -> None:
    (tmp_path / "level-up-peak-1.jpg").write_bytes(b"no picture")
    code, _, err = run("compare", tmp_path)
    assert code == 2
    assert "curveline camera calibrate" in err


@pytest.mark.parametrize("option", ["--range-mm", "--max-rmse-mm"])
@pytest.mark.parametrize("value", ["0", "-3", "nan", "1e9"])
def test_lengths_that_are_none(run: Run, folder: Path, option: str, value: str) -> None:
    code, _, err = run("compare", folder, option, value)
    assert code == 2
    assert "hint: " in err
