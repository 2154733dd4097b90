"""Plans for a rod with a set: what is advised first helps, and a plan is proven again for another rod."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

import curveline
from curveline.errors import Infeasible
from curveline.planning.reproof import prove_again
from curveline.planning.set_first import mirrored_shape
from curveline.scene import Profile, Scene
from curveline.shapes.files import read_shape
from curveline.simulation.dwelling import scene_after


def steep(right: float) -> Scene:
    """The asymmetric peak with its right node at so many degrees; with 50.3 deg it ends."""
    scene = read_shape("level-asymmetric-peak")
    return replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=math.radians(right))))


def test_what_is_advised_first_helps() -> None:
    with pytest.raises(Infeasible) as refusal:
        curveline.plan(curveline.after(steep(40.0), "level-up-valley@8h"))
    found = re.fullmatch(
        r"the rod's set is in the way: hold it at home for (\w+) "
        r"or in the mirrored shape of level-up-valley for (\w+) first",
        refusal.value.hint,
    )
    assert found
    home, mirrored = found.groups()
    assert curveline.plan(curveline.after(steep(40.0), f"level-up-valley@8h,home@{home}")).wanted == ("peak",)
    before = curveline.after(steep(40.0), "level-up-valley@8h")
    other = mirrored_shape(read_shape("level-up-valley"))
    after = scene_after(before, f"other@{mirrored}", lambda _: other)
    assert curveline.plan(after).wanted == ("peak",)


def test_without_a_set_the_numbers_of_the_shape_are_advised() -> None:
    with pytest.raises(Infeasible) as refusal:
        curveline.plan(steep(56.0))
    assert "is at fault" in refusal.value.hint


def test_a_mirrored_shape_is_the_shape_upside_down() -> None:
    scene = read_shape("staggered-asymmetric-peak")
    (segment,), (mirrored,) = curveline.simulate(scene), curveline.simulate(mirrored_shape(scene))
    assert mirrored.wanted_name == "valley"
    light = replace(scene, display=replace(scene.display, gravity=False))
    (segment,), (mirrored,) = curveline.simulate(light), curveline.simulate(mirrored_shape(light))
    assert segment.wanted is not None
    assert mirrored.wanted is not None
    gap = segment.wanted.curve(101) * [1.0, -1.0] - mirrored.wanted.curve(101)
    assert abs(gap).max() < 1e-6


class Heard(curveline.Listener):
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        self.notes.append(text)


def test_a_plan_that_holds_only_while_the_set_is_there_says_so() -> None:
    heard = Heard()
    curveline.plan(curveline.after(steep(52.0), "level-asymmetric-peak@8h"), listener=heard)
    assert any("not once that has faded" in note for note in heard.notes)
    heard = Heard()
    curveline.plan(curveline.after(steep(30.0), "level-asymmetric-peak@8h"), listener=heard)
    assert not any("faded" in note for note in heard.notes)


PLANS = {
    "lone": ((), {}),
    "home": (("level-up-peak",), {"home": True}),
    "tour": (("level-up-peak", "level-asymmetric-valley"), {}),
    "from": (("level-up-valley",), {"begin": "level-asymmetric-peak"}),
    "row": (("roofline",), {}),
}


@pytest.mark.parametrize("name", PLANS)
def test_a_plan_is_proven_again_for_the_rod_it_was_made_for(name: str) -> None:
    shapes, options = PLANS[name]
    plan = curveline.plan(*(shapes or ("level-neutral-peak",)), **options)
    display = read_shape((shapes or ("level-up-peak",))[0]).display
    prove_again(plan, display)


def test_a_plan_is_not_proven_for_a_rod_that_ends_elsewhere() -> None:
    scene = steep(45.0)
    plan = curveline.plan(scene)
    (segment,) = curveline.simulate(scene)
    valley = segment.states[-1]
    display = scene.display
    begin = 0.5 * (display.rod.total_length - valley.rod.length)
    places = [begin + 0.01 + part * valley.rod.free_length for part in (0.0, 0.25, 0.5, 0.75, 1.0)]
    for strength, is_safe in ((0.0, True), (3.0, False)):
        bent = Profile(tuple(places), tuple(strength * value for value in (-1.0, 0.3, 1.0, 0.3, -1.0)))
        other = replace(display, rod=replace(display.rod, profile=bent))
        if is_safe:
            prove_again(plan, other)
        else:
            with pytest.raises(Infeasible, match=r"step \d"):
                prove_again(plan, other)


@pytest.mark.parametrize("shapes", [("level-up-valley", "steep"), ("level-up-valley", "steep", "level-neutral-peak")])
def test_a_funnel_from_one_state_to_another_is_proven_again_too(shapes: tuple[str, ...]) -> None:
    scenes = [steep(40.0) if name == "steep" else read_shape(name) for name in shapes[1:]]
    plan = curveline.plan(*scenes, begin=shapes[0])
    prove_again(plan, scenes[0].display)
    # Held in the valley so long that the steep peak is none any more.
    after = curveline.after(scenes[0], "level-up-valley@4d")
    assert [state.name for state in curveline.simulate(after)[0].states] == ["valley"]
    with pytest.raises(Infeasible, match=r"the other state ceases to exist|would end as"):
        prove_again(plan, after.display)
