"""`curveline new`: files to begin with are valid as they are, can be simulated and planned, and replace none."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

from curveline.scene import Display
from curveline.shapes.files import builtin_text, read_display, read_shape
from curveline.simulation.simulate import simulate

from .conftest import SHAPES, Run


@pytest.fixture(autouse=True)
def _here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("state", ["peak", "valley", "straight"])
@pytest.mark.parametrize("display", ["single", "quad"])
def test_a_new_shape_has_the_wanted_states_and_can_be_planned(run: Run, display: str, state: str) -> None:
    code, out, err = run("new", "shape", "arch", "--display", display, "--state", state)
    assert (code, out) == (0, "")
    assert err == "wrote arch.toml; next: curveline simulate arch.toml\n"
    scene = read_shape("arch.toml")
    assert (scene.name, scene.display.name) == ("arch", display)
    for segment in simulate(scene):
        assert segment.wanted is not None
        assert segment.wanted.name == state
    code, out, err = run("plan", "arch.toml", "--json")
    assert code == 0, err
    assert json.loads(out)["wanted"] == [state] * len(scene.segments)


@pytest.mark.parametrize("nodes", [2, 3, 5])
def test_a_new_display_is_sound_and_shows_new_shapes(run: Run, nodes: int) -> None:
    assert run("new", "display", "lab", "--nodes", nodes).code == 0
    display = read_display("lab.toml")
    assert (display.name, display.node_count) == ("lab", nodes)
    code, out, err = run("display", "check", "lab.toml", "--json")
    assert (code, err) == (0, "")
    assert [warning["code"] for warning in json.loads(out)["warnings"]] == ["not-measured"]
    assert run("new", "shape", "arch", "--display", "lab.toml").code == 0
    assert run("simulate", "arch.toml", "--no-drawing").code == 0
    assert run("plan", "arch.toml").code == 0


@pytest.mark.parametrize("nodes", [2, 17, 128])
def test_displays_of_all_sizes_are_valid(run: Run, nodes: int) -> None:
    assert run("new", "display", "lab", "--nodes", nodes).code == 0
    assert read_display("lab.toml").node_count == nodes
    assert run("new", "shape", "arch", "--display", "lab.toml").code == 0
    assert len(read_shape("arch.toml").segments) == nodes - 1


BESIDE = {
    "inner_diameter_mm": ["diameter_mm"],
    "set_exponent": ["set_strength"],
    "relaxation_times_s": ["relaxation_fractions"],
    "relaxation_fractions": ["relaxation_times_s"],
}
"""Keys that need others beside them."""


def test_what_may_be_left_out_is_there_to_be_taken_in(run: Run) -> None:
    """Every line behind a # that has a key is valid without it, in place of what it says that it stands for."""
    Path("rod.csv").write_text("place_mm,curvature_per_m\n0,0.5\n2000,-0.5\n")
    for command, read in (("display", read_display), ("shape", read_shape)):
        text = run("new", command, "-o", "-").out
        lines = re.findall(r"(?m)^# (\w+ = .*)$", text)
        assert lines
        for line in lines:
            instead = re.search(r"instead of (\w+)(?: and (\w+))?:", line)
            changed = text.replace(f"# {line}", line)
            # A round rod has no width.
            for key in ("width_mm", "thickness_mm") if "diameter" in line else (instead.groups() if instead else ()):
                changed = re.sub(rf"(?m)^{key} = .*\n", "", changed)
            # A tube has an outer diameter, an exponent a strength, and a time its fraction.
            for beside in BESIDE.get(line.split(" = ")[0], ()):
                changed = changed.replace(f"# {beside} =", f"{beside} =")
            Path("taken.toml").write_text(changed)
            read("taken.toml")


def test_every_key_of_a_file_is_explained(run: Run) -> None:
    text = run("new", "display", "-o", "-").out
    known = {line.split(" = ")[0] for line in builtin_text("single").splitlines() if " = " in line}
    assert known <= set(re.findall(r"(?m)^(?:# )?(\w+) = ", text))
    lines = text.splitlines()
    for before, line in pairwise(lines):
        if re.match(r"(# )?\w+ = ", line):
            assert "# " in line[3:] or before.startswith("# ")


def test_where_it_goes_and_what_it_is_called(run: Run) -> None:
    Path("lab").mkdir()
    cases = [
        ((), "my-shape.toml", "my-shape"),
        (("arch",), "arch.toml", "arch"),
        (("lab/arch",), "lab/arch.toml", "arch"),
        (("lab/bow.toml",), "lab/bow.toml", "bow"),
        (("-o", "lab/a bow.toml"), "lab/a bow.toml", "a bow"),
        (("Bow", "-o", "lab/b.toml"), "lab/b.toml", "Bow"),
        (('a "bow"', "-o", "lab/q.toml"), "lab/q.toml", 'a "bow"'),
    ]
    for arguments, path, name in cases:
        code, out, err = run("new", "shape", *arguments)
        assert (code, out) == (0, ""), err
        assert read_shape(path).name == name
    code, out, err = run("new", "shape", "arch", "-o", "-")
    assert (code, err) == (0, "")
    Path("piped.toml").write_text(out)
    assert read_shape("piped.toml").name == "arch"


def test_no_file_is_replaced(run: Run) -> None:
    Path("arch.toml").write_text("precious")
    Path("gone.toml").symlink_to("nowhere.toml")
    for command in ("shape", "display"):
        for name in ("arch", "gone"):
            code, out, err = run("new", command, name)
            assert (code, out) == (2, "")
            assert "the file exists already" in err
            assert "--force" not in err
    assert Path("arch.toml").read_text() == "precious"
    assert not Path("nowhere.toml").exists()
    code, _, err = run("new", "shape", "nowhere/arch")
    assert code == 2
    assert "mkdir -p" in err


def test_a_display_is_named_from_where_the_shape_is(run: Run) -> None:
    for folder in ("shapes", "displays"):
        Path(folder).mkdir()
    assert run("new", "display", "displays/lab").code == 0
    assert run("new", "shape", "shapes/arch", "--display", "displays/lab.toml").code == 0
    assert 'display = "../displays/lab.toml"' in Path("shapes/arch.toml").read_text()
    assert read_shape("shapes/arch.toml").display.name == "lab"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("height_mm = [-220.0, 220.0]", "height_mm = [12.3456789, 220.0]"),
        ("angle_deg = [-75.0, 75.0]", "angle_deg = [-7.77777777, 6.66666666]"),
        ("angle_deg = [-75.0, 75.0]", "angle_deg = [25.0, 75.0]"),
        ("length_mm = [500.0, 900.0]", "length_mm = [700.123456789, 900.0]"),
        ("length_mm = [500.0, 900.0]", "length_mm = [500.0, 533.333333333]"),
        ("total_length_mm = 2000.0", "total_length_mm = 561.23456789"),
    ],
)
def test_a_new_shape_keeps_within_the_limits_of_its_display(run: Run, old: str, new: str) -> None:
    text = builtin_text("single")
    assert old in text
    Path("mine.toml").write_text(text.replace(old, new))
    assert run("new", "shape", "arch", "--display", "mine.toml").code == 0
    assert isinstance(read_shape("arch.toml").display, Display)


def test_a_display_without_room_for_a_shape_is_told(run: Run) -> None:
    Path("mine.toml").write_text(builtin_text("single").replace("[500.0, 900.0]", "[400.0, 450.0]"))
    code, out, err = run("new", "shape", "arch", "--display", "mine.toml")
    assert (code, out) == (2, "")
    assert "leaves no room for a simple shape" in err
    assert not Path("arch.toml").exists()
    code, _, err = run("new", "shape", "arch", "--display", "singel")
    assert code == 2
    assert "did you mean single?" in err
    code, _, err = run("new", "shape", "arch", "--display", SHAPES / "level-up-peak.toml")
    assert code == 2
    assert "this is a shape, not a display file" in err
