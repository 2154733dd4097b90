"""Whole numbers where floats are meant, in every description and public function: the same answer, no traceback."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any

import pytest

from clamped_rods import dead
from curveline import scene, sections
from curveline.displays.capability import ability_of, reaches
from curveline.displays.lint import suspicions
from curveline.errors import CurvelineError
from curveline.loading.load_map import load_map
from curveline.loading.pushes import Push
from curveline.loading.results import document as load_document
from curveline.loading.results import map_document
from curveline.loading.snap_through import load
from curveline.plan_file import to_json
from curveline.planning.tours import make_plan
from curveline.rod.states.planar_states import find_states
from curveline.scene import Axis, Display, Drive, Limits, Load, Node, RadioSettings, Range, Rod, Scene, Segment
from curveline.sections import Rectangle
from curveline.simulation import results
from curveline.simulation.results import Settings, ShapeReport
from curveline.simulation.simulate import clamped_rod, scene_rod, simulate

Number = Callable[[int], Any]


def display(number: Number) -> Display:
    """A display of whole metres and radians, whose rod bends like wire: EI = 1 N m^2."""
    # An area of a square metre and this modulus; nobody looks at the rod's thickness but its strain and contact.
    rod = Rod(number(12), Rectangle(number(1), number(1)), number(0), number(9), number(0), number(9), number(5))
    axis = Axis(number(1000), number(1), number(1))
    drive = Drive(axis, axis, axis, number(10**6), number(10**6))
    limits = Limits(*(Range(number(low), number(high)) for low, high in ((-2, 2), (-1, 1), (2, 4), (-1, 1), (-9, 9))))
    radio = RadioSettings(76, "1Mbps", ("C1C1C1C101", "C1C1C1C102"))
    down = (number(0), number(-1), number(0))
    return Display("whole", 2, number(2), number(0), True, rod, limits, drive, radio, down=down)


def shape(number: Number, *nodes: Node, loads: tuple[Load, ...] = ()) -> Scene:
    nodes = nodes or (Node(number(0), number(1)), Node(number(0), number(-1)))
    return Scene("whole", display(number), nodes, (Segment(number(3), "peak"),), loads)


def turned(number: Number) -> Scene:
    return shape(number, Node(number(0), number(1), number(1)), Node(number(0), number(-1), number(0), number(1)))


def pushed(number: Number) -> Scene:
    return shape(number, loads=(Load(0, 0.5, (number(0), number(-1)), number(1)),))


def simulated(scene: Scene, model: str, tolerance: float) -> dict[str, Any]:
    report = ShapeReport(scene, tuple(simulate(scene, tolerance, model=model)), Settings(), 0.0)
    found = results.document(report)
    del found["seconds"]
    return json.loads(json.dumps(found, allow_nan=False))  # type: ignore[no-any-return]


@pytest.mark.parametrize("build", [shape, turned, pushed])
@pytest.mark.parametrize("model", ["auto", "planar", "extensible", "spatial"])
def test_simulate(build: Callable[[Number], Scene], model: str) -> None:
    assert simulated(build(int), model, 1) == simulated(build(float), model, 1.0)


def test_plan_and_check() -> None:
    made = [_planned(shape(number)) for number in (int, float)]
    assert made[0] == made[1]
    assert reaches(display(int)) == reaches(display(float))
    odd = [suspicions(each, ability_of(each)) for each in map(display, (int, float))]
    assert odd[0] == odd[1]


def _planned(scene: Scene) -> str:
    try:
        return to_json(make_plan(scene))
    except CurvelineError as refusal:
        return refusal.message


def test_load_and_map() -> None:
    found = []
    for number in (int, float):
        push = Push(0, 0.5, "0,-1", step=number(1), most=number(100))
        loading, over_all = load(shape(number), push), load_map(shape(number), push, 3)
        documents = [load_document(loading), map_document(over_all)]
        for document in documents:
            del document["seconds"]
        found.append(json.loads(json.dumps(documents, allow_nan=False)))
    assert found[0] == found[1]


def test_rods() -> None:
    nodes = Node(0, 1), Node(0, -1)
    whole = clamped_rod(display(int), nodes, 3, 0, dead(((0.5, 0, -1),)))
    (same, *_) = find_states(whole, 1)
    (state, *_) = find_states(clamped_rod(display(float), nodes, 3.0, 0.0, dead(((0.5, 0.0, -1.0),))), 1.0)
    assert same.energy == state.energy
    assert scene_rod(turned(int), 0) == scene_rod(turned(float), 0)


def test_everything_that_is_measured_is_a_float() -> None:
    """In every description, also one to come: its fields say float, and are."""
    seen = set()

    def look(thing: Any) -> None:
        if isinstance(thing, tuple):
            for each in thing:
                look(each)
        elif is_dataclass(thing) and type(thing).__module__ == scene.__name__:
            seen.add(type(thing).__name__)
            for field in fields(thing):
                value = getattr(thing, field.name)
                if field.type == "float":
                    assert type(value) is float, (type(thing), field.name)
                elif isinstance(value, tuple) and "float" in str(field.type):
                    assert all(type(each) is float for each in value), (type(thing), field.name)
                look(value)

    look(pushed(int))
    look(scene.Profile((0, 1), (2, 3)))
    described = {name for name, kind in vars(scene).items() if is_dataclass(kind) and kind.__module__ == scene.__name__}
    assert seen == described
    assert sections.Rectangle(1, 2).torsion_constant == sections.Rectangle(1.0, 2.0).torsion_constant
