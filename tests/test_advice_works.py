"""What an error or a warning advises is applied as it is printed, and what was refused is done."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.capability import Ability, Held, departures_of
from curveline.changes import ANGLE, HEIGHT, LENGTH, Quantity
from curveline.errors import Infeasible
from curveline.planning import make_plan
from curveline.planning.doors import nearest_shape
from curveline.planning.goals import check_goal
from curveline.planning.proof import Prover, Refused
from curveline.scene import Node, Scene, Segment
from curveline.shapefile import builtin_text, read_display
from curveline.suspicions import Suspicion, suspicions
from curveline.units import deg, mm

NUMBER = r"(-?\d+(?:\.\d+)?)"
ADVISED = re.compile(
    rf"({LENGTH}|{ANGLE}|{HEIGHT}) of (?:segment|node) (\d+) (?:is at fault: with|of) {NUMBER} (?:mm|deg) instead of"
)


def advised(hint: str, scene: Scene) -> Scene:
    """The scene with the numbers that a refused plan advises."""
    found = ADVISED.findall(hint)
    assert 1 <= len(found) <= 2, hint
    for kind, place, number in found:
        quantity = Quantity(kind, int(place) - 1)
        scene = quantity.put(scene, quantity.read(float(number)))
    return scene


def refused(scene: Scene) -> Infeasible | None:
    try:
        make_plan(scene)
    except Infeasible as error:
        return error
    return None


def row(lengths_mm: tuple[float, ...], states: str, angles_deg: tuple[float, ...]) -> Scene:
    """A shape of the display `quad` between level nodes; of the states only the initials."""
    names = {"p": "peak", "v": "valley"}
    segments = tuple(Segment(mm(length), names[state]) for length, state in zip(lengths_mm, states, strict=True))
    return Scene("row", read_display("quad"), tuple(Node(0.0, deg(angle)) for angle in angles_deg), segments)


OVERLOADED = [
    (row((580, 580, 660, 660), "vvpp", (20, 10, 0, 10, -10)), 3),
    (row((580, 580, 580, 660), "ppvp", (-20, -30, 0, -30, -30)), 3),
    (row((580, 580, 580, 620), "pvvv", (-10, 0, -10, -10, 10)), 2),
]


@pytest.mark.parametrize(("asked", "node"), OVERLOADED)
def test_an_overloaded_node_of_a_row_leads_to_advice_that_works(asked: Scene, node: int) -> None:
    error = refused(asked)
    assert error is not None
    assert f"at node {node} biasing takes" in error.message
    better = advised(error.hint, asked)
    assert better != asked
    assert refused(better) is None


@pytest.mark.parametrize(("asked", "node"), OVERLOADED)
def test_an_overload_names_the_node(asked: Scene, node: int) -> None:
    with pytest.raises(Refused) as found:
        check_goal(Prover(asked.display, lambda: None), asked)
    assert (found.value.segment, found.value.node) == (0, node)


@pytest.mark.parametrize("seed", range(20))
def test_what_a_refused_plan_advises_can_be_planned(seed: int) -> None:
    chance = random.Random(f"lone {seed}")
    nodes = tuple(Node(mm(round(chance.uniform(-120, 120), 1)), deg(round(chance.uniform(-70, 70), 1))) for _ in "12")
    segment = Segment(mm(round(chance.uniform(580, 700), 1)), chance.choice(["peak", "valley"]))
    asked = Scene("lone", read_display("single"), nodes, (segment,))
    error = refused(asked)
    if error is not None and "works" in error.hint:
        assert refused(advised(error.hint, asked)) is None


def written(values: dict[str, str], text: str) -> str:
    """The text of a display file with other values of keys, whichever table they are in."""
    for key, value in values.items():
        text, count = re.subn(rf"(?m)^{key} = [^#\n]*", f"{key} = {value} ", text)
        assert count == 1, key
    return text


def remedied(hint: str, text: str) -> str:
    """The text of a display file with what a warning advises."""
    found = re.findall(r"\w+\.(\w+) = (\[[^]]*\]|[\d.e+-]+)", hint)
    assert found, hint
    return written(dict(found), text)


def no_way(path: Path) -> list[Suspicion]:
    display = read_display(path)
    ability = Ability(Held(None, None), departures=departures_of(display))
    return [each for each in suspicions(display, ability) if each.code == "no-way"]


WEAK = {"max_force_N": "3.0"}
NO_WAY = [
    ("single", WEAK),
    ("single", {"max_force_N": "3.0", "max_moment_Nmm": "90.0"}),
    ("single", {"max_strain": "0.001"}),
    ("single", {"thickness_mm": "0.5"}),
    ("single", {"thickness_mm": "5.0"}),
    ("single", {"angle_deg": "[-10.0, 10.0]"}),
    ("single", {"length_mm": "[500.0, 505.0]"}),
    ("single", {"length_mm": "[650.0, 900.0]"}),
    ("single", {"total_length_mm": "530.0"}),
    ("quad", WEAK),
    ("quad", {"max_moment_Nmm": "100.0"}),
    ("quad", {"thickness_mm": "1.0"}),
    ("quad", {"total_length_mm": "2030.0"}),
]


@pytest.mark.parametrize(("name", "values"), NO_WAY)
def test_with_what_is_advised_plans_lead_from_home(tmp_path: Path, name: str, values: dict[str, str]) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(written(values, builtin_text(name)))
    shut = no_way(path)
    assert shut
    assert "can be planned" in shut[0].message
    for each in shut:
        path.write_text(remedied(each.hint, written(values, builtin_text(name))))
        assert each.message not in [other.message for other in no_way(path)]
    if len(shut) == 1:
        assert no_way(path) == []


@pytest.mark.parametrize("seed", range(12))
def test_random_displays_are_helped_by_what_is_advised(tmp_path: Path, seed: int) -> None:
    chance = random.Random(f"display {seed}")
    values = {
        "max_force_N": f"{chance.uniform(1.0, 9.0):.2f}",
        "max_moment_Nmm": f"{chance.uniform(50.0, 400.0):.1f}",
        "thickness_mm": f"{chance.uniform(0.8, 3.5):.2f}",
        "max_strain": f"{chance.uniform(0.002, 0.02):.4f}",
    }
    path = tmp_path / "mine.toml"
    path.write_text(written(values, builtin_text("single")))
    for each in no_way(path):
        path.write_text(remedied(each.hint, written(values, builtin_text("single"))))
        assert no_way(path) == []


def test_a_plan_on_such_a_display_points_to_the_check_of_it() -> None:
    single = read_display("single")
    weak = replace(single, drive=replace(single.drive, max_force=3.0), path="lab/weak.toml")
    scene = Scene("lone", weak, (Node(0.0, 0.0),) * 2, (Segment(mm(640.0), "valley"),))
    error = refused(scene)
    assert error is not None
    assert error.hint == (
        "from home no valley can be planned on this display: "
        "`curveline display check lab/weak.toml` says what to change"
    )


@pytest.mark.parametrize("name", ["single", "quad"])
def test_what_is_said_to_be_possible_from_home_is_planned(name: str) -> None:
    display = read_display(name)
    doors = departures_of(display).doors
    assert [door.kind for door in doors] == (
        ["peak", "valley"] if name == "single" else ["row of peaks", "row of valleys", "row of both states"]
    )
    for door in doors:
        assert door.is_open
        shape = nearest_shape(Prover(display, lambda: None), door.wanted)
        assert make_plan(shape).wanted == door.wanted
