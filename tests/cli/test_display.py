"""`curveline display`: what a lab's own display can do, what looks odd in its file, and the built-in ones to copy."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from curveline.cli.printing.progress import compiling
from curveline.displays import capability
from curveline.displays.capability import TOO_HARD, TOO_STIFF, TOO_TIGHT, Ability, Held, held_lengths, leaving, too_much
from curveline.displays.lint import suspicions
from curveline.radio.protocol.codes import POSITION_LIMIT
from curveline.shapes.files import builtin_text, read_display
from curveline.units import mm

from .conftest import Run


@pytest.fixture(autouse=True)
def _computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a display is able to do is computed once where a test has it printed in two ways."""
    monkeypatch.setattr(capability, "ability_of", cache(capability.ability_of))


SINGLE, QUAD = builtin_text("single"), builtin_text("quad")
Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a display file: a built-in one with some of its text replaced."""

    def write(*changes: tuple[str, str], base: str = SINGLE) -> Path:
        text = base
        for old, new in changes:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        path = tmp_path / "mine.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


OWN = (
    ('name = "single"', 'name = "ours"'),
    ("youngs_modulus_GPa = 2.45", "youngs_modulus_GPa = 2.5"),
    ("thickness_mm = 2.4", "thickness_mm = 2.3"),
    ("mass_g_per_m = 48.0", "mass_g_per_m = 47.0"),
    ("max_force_N = 8.0", "max_force_N = 9.0"),
    ("max_moment_Nmm = 500.0", "max_moment_Nmm = 450.0"),
)
"""A display that was measured: nothing looks odd."""


def checked(run: Run, file: Path | str) -> dict[str, Any]:
    code, out, err = run("display", "check", file, "--json")
    assert (code, err) == (0, "")
    assert out.count("\n") == 1
    document: dict[str, Any] = json.loads(out)
    return document


def codes(run: Run, file: Path) -> list[str]:
    return [warning["code"] for warning in checked(run, file)["warnings"]]


@pytest.mark.parametrize("command", ["check", "show"])
def test_every_command_has_help(run: Run, command: str) -> None:
    code, out, err = run("display", command, "--help")
    assert (code, err) == (0, "")
    assert "Exit codes" in out
    assert all(len(line) <= 80 for line in out.splitlines())
    assert command in run("display", "--help").out


@pytest.mark.parametrize("name", ["single", "quad"])
def test_a_built_in_file_can_be_copied_and_then_says_what_was_not_measured(run: Run, tmp_path: Path, name: str) -> None:
    code, out, err = run("display", "show", name)
    assert (code, err) == (0, "")
    copy = tmp_path / "mine.toml"
    copy.write_text(out, encoding="utf-8")
    assert read_display(copy).digest == read_display(name).digest
    warnings = {warning["code"]: warning for warning in checked(run, copy)["warnings"]}
    assert list(warnings) == ["builtin-name", "not-measured"]
    assert warnings["not-measured"]["key"].split(", ") == [
        "rod.youngs_modulus_GPa", "rod.thickness_mm", "rod.mass_g_per_m", "drive.max_force_N", "drive.max_moment_Nmm",
    ]  # fmt: skip


def test_an_unknown_display_is_refused_with_the_known_ones(run: Run) -> None:
    code, out, err = run("display", "show", "singel")
    assert (code, out) == (2, "")
    assert "unknown-display" in err
    assert "did you mean" in err
    assert run("display", "check", "singel").code == 2
    assert run("display", "check", "nowhere.toml").code == 2


def test_every_problem_of_a_file_is_listed_at_once(run: Run, write: Write) -> None:
    path = write(
        ("span_mm = 500.0", "span_mm = -5.0"), ('"C1C1C1C102"]', '"C1C1C1C101"]'), ("channel = 76", "chanel = 76")
    )
    code, out, err = run("display", "check", path)
    assert (code, out) == (2, "")
    assert err.count("error[") == 4
    for text in ("span_mm = -5.0", 'addresses = ["C1C1C1C101", "C1C1C1C101"]'):
        (at,) = (at for at, line in enumerate(path.read_text().splitlines(), start=1) if line.startswith(text))
        assert f"{path}:{at}:" in err


@pytest.mark.parametrize("name", ["single", "quad"])
def test_the_built_in_displays_are_sound_and_fit_a_terminal(run: Run, name: str) -> None:
    code, out, err = run("display", "check", name)
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "nothing looks odd" in out
    assert checked(run, name)["warnings"] == []


def test_numbers_of_the_document(run: Run) -> None:
    found = checked(run, "quad")
    stiffness = 2.45e9 * 0.01 * 0.0024**3 / 12.0
    assert (found["display"], found["file"], found["nodes"]) == ("quad", None, 5)
    assert found["gravity"] == [0.0, -1.0, 0.0]
    assert found["rod"]["bending_stiffness_Nm2"] == pytest.approx(stiffness)
    assert found["rod"]["lateral_bending_stiffness_Nm2"] == pytest.approx(stiffness * (10.0 / 2.4) ** 2)
    assert found["rod"]["stretching_stiffness_N"] == pytest.approx(2.45e9 * 0.01 * 0.0024)
    assert found["rod"]["smallest_radius_mm"] == pytest.approx(2.4 / 2.0 / 0.03)
    assert found["rod"]["buckling_force_N"] == pytest.approx(4.0 * math.pi**2 * stiffness / 0.48**2)
    assert found["budget"] == {
        "straight": {"between_nodes_mm": pytest.approx(2000.0), "tail_mm": pytest.approx(1000.0)},
        "longest": {"between_nodes_mm": pytest.approx(3600.0), "tail_mm": pytest.approx(200.0)},
    }
    extrude, bias, translate = found["axes"]
    per_mm = 8344 / 37.7
    assert extrude["counts_per_unit"] == translate["counts_per_unit"] == pytest.approx(per_mm)
    # Four segments of 400 mm beyond the span, half of it from either side.
    assert extrude["range"] == pytest.approx([-800.0, 800.0])
    assert extrude["counts"] == [-round(800.0 * per_mm), round(800.0 * per_mm)]
    assert bias["counts"] == [-round(75.0 * 8344 / 120.0), round(75.0 * 8344 / 120.0)]
    # Accelerating and braking at the limits takes as long as a fifth of a second more at full speed.
    assert translate["longest_seconds"] == pytest.approx(440.0 / 10.0 + 10.0 / 50.0)
    assert extrude["longest_seconds"] == pytest.approx(800.0 / 20.0 + 20.0 / 100.0)
    assert all(axis["fits_target"] and axis["fits_status"] for axis in found["axes"])
    assert found["level_lengths_mm"] == pytest.approx([500.25, 900.0])
    assert found["radio"]["addresses"][-1] == "C1C1C1C105"


def test_a_tube_of_measured_stiffness_is_told_by_section_and_modulus(run: Run, write: Write) -> None:
    tube = ("width_mm = 10.0 ", "diameter_mm = 6.0 "), ("thickness_mm = 2.4 ", "inner_diameter_mm = 4.5 ")
    path = write(*tube, ("youngs_modulus_GPa = 2.45 ", "bending_stiffness_Nmm2 = 26000 "))
    second_moment = math.pi / 64.0 * (0.006**4 - 0.0045**4)
    rod = checked(run, path)["rod"]
    assert (rod["section"], rod["stiffness_from"]) == ("round", "bending_stiffness_Nmm2")
    assert (rod["diameter_mm"], rod["inner_diameter_mm"]) == (pytest.approx(6.0), pytest.approx(4.5))
    assert rod["youngs_modulus_GPa"] == pytest.approx(0.026e-9 / second_moment)
    assert rod["bending_stiffness_Nmm2"] == pytest.approx(26000.0)
    assert rod["bending_stiffness_Nm2"] == rod["lateral_bending_stiffness_Nm2"] == pytest.approx(0.026)
    assert rod["twisting_stiffness_Nm2"] == pytest.approx(2.0 * 0.026 / 2.7)
    assert rod["smallest_radius_mm"] == pytest.approx(3.0 / 0.03)
    text = " ".join(run("display", "check", path).out.split())
    assert "tube of 6 mm, 4.5 mm inside; E 0.598 GPa, G 0.221 GPa, from the bending stiffness as measured" in text
    assert checked(run, "single")["rod"]["stiffness_from"] == "youngs_modulus_GPa"


def test_a_measured_display_of_ones_own_has_no_warnings(run: Run, write: Write) -> None:
    path = write(*OWN)
    found = checked(run, path)
    assert (found["display"], found["file"], found["warnings"]) == ("ours", str(path), [])


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("height_mm = [-220.0, 220.0]", "height_mm = [20.0, 400.0]", "no-home"),
        ("angle_deg = [-75.0, 75.0]", "angle_deg = [5.0, 75.0]", "no-home"),
        ("length_mm = [500.0, 900.0]", "length_mm = [550.0, 900.0]", "no-home"),
        ("angle_deg = [-75.0, 75.0]", "angle_deg = [-1.309, 1.309]", "radians"),
        ("gravity = true ", "gravity = [0.0, -0.8, 0.6] ", "no-plan"),
        ("total_length_mm = 2000.0", "total_length_mm = 515.0", "short-rod"),
        ("total_length_mm = 2000.0", "total_length_mm = 880.0", "short-rod"),
        ("length_mm = [500.0, 900.0]", "length_mm = [480.0, 900.0]", "out-of-reach"),
        ("length_mm = [500.0, 900.0]", "length_mm = [400.0, 499.0]", "out-of-reach"),
        ("length_mm = [500.0, 900.0]", "length_mm = [500.0, 505.0]", "little-slack"),
        ("max_strain = 0.03", "max_strain = 0.006", "too-much"),
        ("max_strain = 0.03", "max_strain = 0.004", "stiff-rod"),
        ("natural_curvature_per_m = 0.0", "natural_curvature_per_m = 30.0", "curved-rod"),
        ("span_mm = 500.0", "span_mm = 5000.0", "odd-span"),
        ("clamp_mm = 20.0", "clamp_mm = 0.0", "point-clamp"),
        ("clamp_mm = 20.0", "clamp_mm = 150.0", "long-clamp"),
        ("height_mm = [-220.0, 220.0]", "height_mm = [-40e3, 40e3]", "out-of-counts"),
        ("counts_per_turn = 8344", "counts_per_turn = 8e4", "out-of-status"),
        ("counts_per_turn = 8344", "counts_per_turn = 6e4", "busy-node"),
        ("counts_per_turn = 8344", "counts_per_turn = 300", "coarse-count"),
        ("translate_mm_per_s = 10.0", "translate_mm_per_s = 5.0", "slow-axis"),
        ("channel = 76", "channel = 84", "off-band"),
        ('"C1C1C1C102"', '"00ff00ff00"', "noisy-address"),
        ("[radio]", "[errors]\nstiffness_percent = [-0.2, 0.05]\n\n[radio]", "odd-error"),
        ("[radio]", "[errors]\nclamp_mm = [5.0, 10.0]\n\n[radio]", "off-file"),
        ("[radio]", "[errors]\nclamp_stiffness_Nmm_per_deg = [25.0, 50.0]\n\n[radio]", "off-file"),
    ],
)
def test_what_looks_odd_is_warned_of(run: Run, write: Write, old: str, new: str, code: str) -> None:
    path = write(*OWN, (old, new))
    assert code in codes(run, path)
    result = run("display", "check", path)
    assert result.code == 0
    assert f"warning[{code}]" in result.out
    assert "nothing looks odd" not in result.out
    assert all(len(line) <= 80 for line in result.out.splitlines() if str(path) not in line)


def test_errors_around_what_the_file_says_are_told_and_not_odd(run: Run, write: Write) -> None:
    ranges = (
        "[errors]\nstiffness_percent = [-20, 5]\nclamp_stiffness_Nmm_per_deg = [50.0, inf]\nclamp_mm = [10.0, 20.0]\n"
        "clamp_play_deg = [0.0, 0.5]\nset_percent = [0, 10]\n\n[radio]"
    )
    path = write(*OWN, ("[radio]", ranges))
    found = checked(run, path)
    assert found["warnings"] == []
    assert found["errors"] == {
        "stiffness_percent": [-20.0, 5.0],
        "clamp_stiffness_Nmm_per_deg": [50.0, None],
        "clamp_play_deg": [0.0, 0.5],
        "clamp_mm": [10.0, 20.0],
        "set_percent": [0.0, 10.0],
    }
    told = " ".join(run("display", "check", path).out.split())
    assert "in truth, the same in a whole run: stiffness -20 to 5 %, clamp stiffness 50 to inf N mm/deg," in told
    assert checked(run, write(*OWN))["errors"] == {}


def test_no_weight_and_a_weak_motor_are_odd_only_where_they_matter(run: Run, write: Write) -> None:
    light = ("mass_g_per_m = 47.0", "mass_g_per_m = 0.0")
    assert codes(run, write(*OWN, light)) == ["no-weight"]
    assert codes(run, write(*OWN, light, ("gravity = true ", "gravity = false "))) == []
    assert codes(run, write(*OWN, ("max_force_N = 9.0", "max_force_N = 4.0"))) == ["no-way", "too-much"]


def test_what_motors_and_rod_stand_ends_where_a_state_needs_more() -> None:
    from dataclasses import replace

    display = read_display("single")
    whole = held_lengths(display)
    assert whole == Held(pytest.approx(0.50025), pytest.approx(0.9))
    weak = replace(display, drive=replace(display.drive, max_moment=0.25))
    held = held_lengths(weak)
    assert held.longest is not None
    assert (held.below, held.beyond) == ("", TOO_STIFF)
    assert too_much(weak, held.longest) == ""
    assert too_much(weak, held.longest + mm(0.5)) == TOO_STIFF
    slack = replace(display, drive=replace(display.drive, max_force=4.0))
    held = held_lengths(slack)
    assert held.shortest is not None
    assert (held.below, held.beyond) == (TOO_HARD, "")
    assert too_much(slack, held.shortest) == ""
    assert too_much(slack, held.shortest - mm(0.5)) == TOO_HARD
    brittle = replace(display, rod=replace(display.rod, max_strain=0.0005))
    held = held_lengths(brittle)
    assert (held.shortest, held.longest, held.below) == (None, None, TOO_TIGHT)
    assert "too-much" in [each.code for each in suspicions(brittle, Ability(held))]


SQUARE = (
    *(change for change in OWN if "thickness" not in change[0]),
    ("width_mm = 10.0", "width_mm = 2.6"),
)
"""A rod that is about as wide as it is thick, which the peak between level nodes does not stay upright on."""


def test_lengths_at_which_a_level_rod_would_leave_the_plane_are_told(run: Run, write: Write) -> None:
    path = write(*SQUARE)
    found = checked(run, path)
    (warning,) = (each for each in found["warnings"] if each["code"] == "leaves-plane")
    (leaves,) = found["leaves_plane"]
    low, high = leaves["lengths_mm"]
    assert leaves["state"] == "peak"
    assert f"the peak would leave the plane at {low:.0f} to {high:.0f} mm of rod" in warning["message"]
    display = read_display(path)
    assert leaving(display, mm(0.5 * (low + high))) == {"peak"}
    assert leaving(display, mm(low)) == leaving(display, mm(high)) == {"peak"}
    assert 600.0 < low < high == 900.0
    assert leaving(display, mm(low - 0.5)) == frozenset()
    assert checked(run, "single")["leaves_plane"] == []


def test_what_simulate_says_of_the_plane_agrees(run: Run, write: Write, tmp_path: Path) -> None:
    shape = tmp_path / "level.toml"
    shape.write_text(
        f'name = "level"\ndisplay = "{write(*SQUARE)}"\n'
        "nodes = [{ height_mm = 0.0, angle_deg = 0.0 }, { height_mm = 0.0, angle_deg = 0.0 }]\n"
        'segments = [{ length_mm = 800.0, state = "peak" }]\n'
    )
    assert leaving(read_display(write(*SQUARE)), mm(800.0)) == {"peak"}
    assert "would not stay in the plane" in "".join(run("simulate", shape, "--explain", "--model", "planar")[1:])


def test_a_display_whose_nodes_cannot_be_told_how_fast_to_move_can_have_no_plan(run: Run, write: Write) -> None:
    found = checked(run, write(*OWN, ("counts_per_turn = 8344", "counts_per_turn = 300")))
    assert found["from_home"] == []
    (warning,) = (each for each in found["warnings"] if each["code"] == "no-plan")
    assert "nodes can be told 100 to 1000000" in warning["message"]


def test_what_plans_can_reach_from_home_is_told(run: Run, write: Write) -> None:
    found = checked(run, write(*OWN))
    kinds = [(entry["shape"], entry["states"], entry["possible"], entry["reason"]) for entry in found["from_home"]]
    assert kinds == [("peak", ["peak"], True, None), ("valley", ["valley"], True, None)]
    assert "from home a plan leads to every kind of shape" in run("display", "check", write(*OWN)).out
    soft = checked(run, write(*OWN[:2], *OWN[3:], ("thickness_mm = 2.4", "thickness_mm = 0.5")))
    assert [entry["possible"] for entry in soft["from_home"]] == [False, True]
    (warning,) = (each for each in soft["warnings"] if each["code"] == "no-way")
    assert warning["message"].startswith("from home no peak can be planned")
    assert warning["key"] == "rod.thickness_mm"


def test_the_status_range_is_that_of_the_frames() -> None:
    from curveline.displays.capability import STATUS_COUNTS

    assert STATUS_COUNTS == POSITION_LIMIT


def test_kernels_are_announced_before_they_are_compiled(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from curveline.kernels import readiness

    compiling.announce_compilation.cache_clear()
    monkeypatch.setattr(readiness, "is_first_run", lambda: True)
    assert "compiling" in run("display", "check", "single").err
