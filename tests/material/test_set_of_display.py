"""What a display file says of the set of its rod: from the file to the scene, the check, and what looks odd."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import curveline
from curveline.cli.app import app
from curveline.displays.capability import Ability, Held
from curveline.displays.lint import suspicions
from curveline.material.relaxation import Relaxation, power_law
from curveline.scene import Display
from curveline.shapes.files import builtin_text

SERIES = "relaxation_times_s = [1000, 100000.0]", "relaxation_fractions = [0.1, 0.2]"


def display(folder: Path, *lines: str) -> Display:
    """The display `single` whose rod has these lines besides."""
    text = builtin_text("single").replace("total_length_mm", "\n".join([*lines, "total_length_mm"]), 1)
    (folder / "mine.toml").write_text(text)
    return curveline.read_display(folder / "mine.toml")


def odd(found: Display) -> list[str]:
    return [
        each.code for each in suspicions(found, Ability(Held(0.5, 0.9))) if each.key.startswith(("rod.set", "rod.temp"))
    ]


def test_a_file_says_what_set_the_rod_takes(tmp_path: Path) -> None:
    assert display(tmp_path).rod.relaxation is None
    assert display(tmp_path, "set_strength = 1").rod.relaxation == power_law()
    measured = display(tmp_path, "set_strength = 1.2", "set_exponent = 0.31", "temperature_C = 25")
    assert measured.rod.relaxation == power_law(1.2, 0.31, 25.0)
    assert display(tmp_path, *SERIES).rod.relaxation == Relaxation((1000.0, 100_000.0), (0.1, 0.2))


def test_a_check_says_how_much_of_a_bend_is_set(tmp_path: Path) -> None:
    display(tmp_path, "set_strength = 1.0", "temperature_C = 30.0")
    run = CliRunner().invoke(app, ["display", "check", str(tmp_path / "mine.toml"), "--json"])
    taken = json.loads(run.stdout)["rod"]["set"]
    law = power_law(temperature=30.0)
    assert taken["temperature_C"] == 30.0
    assert [each["held_s"] for each in taken["after"]] == [3600.0, 28_800.0, 604_800.0]
    assert [each["fraction"] for each in taken["after"]] == [law.set_after(s) for s in (3600.0, 28_800.0, 604_800.0)]
    assert taken["fractions"] == list(law.fractions)
    text = CliRunner().invoke(app, ["display", "check", str(tmp_path / "mine.toml")]).stdout
    said = " ".join(text.split())
    assert "of a bend that is held it keeps 16 % after 1h, 27 % after 8h, 49 % after 1w, at 30 C" in said
    assert "warning[not-measured]: rod.set_strength" in said


def test_a_rod_that_takes_no_set_is_checked_as_before(tmp_path: Path) -> None:
    display(tmp_path)
    run = CliRunner().invoke(app, ["display", "check", str(tmp_path / "mine.toml"), "--json"])
    assert json.loads(run.stdout)["rod"]["set"] is None
    assert "it keeps" not in CliRunner().invoke(app, ["display", "check", str(tmp_path / "mine.toml")]).stdout


@pytest.mark.parametrize(
    ("lines", "codes"),
    [
        (("set_strength = 1.0",), ["not-measured"]),
        (("set_strength = 1.1",), []),
        (("set_strength = 0.1",), ["odd-set"]),
        (("set_strength = 9.0",), ["odd-set"]),
        (("set_strength = 1.1", "temperature_C = 60"), ["odd-temperature"]),
        (("set_strength = 1.1", "temperature_C = 30"), []),
        (SERIES, []),
        (("relaxation_times_s = [1.0]", "relaxation_fractions = [0.9]"), ["odd-set"]),
    ],
)
def test_what_hardly_any_rod_does_looks_odd(tmp_path: Path, lines: tuple[str, ...], codes: list[str]) -> None:
    assert odd(display(tmp_path, *lines)) == codes
