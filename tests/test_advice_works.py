"""What an error or a warning advises is applied as it is printed, and what was refused is done."""

from __future__ import annotations

import math
import random
import re
from dataclasses import replace
from pathlib import Path

import pytest

from campaign import only
from clamped_rods import changed, rod_between
from curveline.displays.capability import Ability, Held, departures_of
from curveline.displays.lint import Suspicion, suspicions
from curveline.drive_settings import MAX_EDGES_PER_S, drive_settings
from curveline.errors import Infeasible, InvalidInput
from curveline.loading.pushes import Push, check_place
from curveline.loading.snap_through import check_steps
from curveline.planning.feasibility import check_goal
from curveline.planning.layout import home
from curveline.planning.moves import DisplayState, Travel
from curveline.planning.reachability import nearest_shape
from curveline.planning.sequence import goal_of, travel_to
from curveline.planning.tours import make_plan
from curveline.planning.verification import Refused, Verifier
from curveline.rod.models.choice import SearchRequest
from curveline.rod.models.no_state_reason import why_none
from curveline.rod.states.planar_states import find_states
from curveline.scene import Display, Node, Range, Scene, Segment
from curveline.shapes.files import builtin_text, read_display, read_shape
from curveline.simulation.advice import advice_on
from curveline.simulation.changes import ANGLE, HEIGHT, LENGTH, Quantity
from curveline.simulation.simulate import AUTO, DEFAULT_TOLERANCE, simulate
from curveline.units import deg, mm, to_mm

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
        check_goal(Verifier(asked.display, lambda: None), asked)
    assert (found.value.segment, found.value.node) == (0, node)


@pytest.mark.parametrize("seed", [*range(8), *only(range(8, 40))])
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
    ("single", {"max_strain": "0.001"}),
    ("single", {"length_mm": "[500.0, 505.0]"}),
    ("single", {"total_length_mm": "530.0"}),
    ("quad", {"total_length_mm": "2030.0"}),
    *only(
        [
            ("quad", WEAK),
            ("single", {"max_force_N": "3.0", "max_moment_Nmm": "90.0"}),
            ("single", {"thickness_mm": "0.5"}),
            ("single", {"thickness_mm": "5.0"}),
            ("single", {"angle_deg": "[-10.0, 10.0]"}),
            ("single", {"length_mm": "[650.0, 900.0]"}),
            ("quad", {"max_moment_Nmm": "100.0"}),
            ("quad", {"thickness_mm": "1.0"}),
        ]
    ),
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
        left = no_way(path)
        assert each.message not in [other.message for other in left]
    if len(shut) == 1:
        assert left == []


@pytest.mark.parametrize("seed", [*range(3), *only(range(3, 24))])
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
    entries = departures_of(display).entries
    assert [entry.kind for entry in entries] == (
        ["peak", "valley"] if name == "single" else ["row of peaks", "row of valleys", "row of valleys and peaks"]
    )
    for entry in entries:
        assert entry.is_open
        shape = nearest_shape(Verifier(display, lambda: None), entry.wanted)
        assert make_plan(shape).wanted == entry.wanted


def a_scene(chance: random.Random, extra_mm: tuple[float, float]) -> Scene:
    """A shape of the display `single` whose rod is so much longer than the way from node to node."""
    nodes = tuple(Node(mm(round(chance.uniform(-110, 110), 1)), deg(round(chance.uniform(-70, 70), 1))) for _ in "12")
    way = math.hypot(500.0, to_mm(nodes[1].height - nodes[0].height)) + 20.0
    segment = Segment(mm(round(way + chance.uniform(*extra_mm), 1)), chance.choice(["peak", "valley"]))
    return Scene("lone", read_display("single"), nodes, (segment,))


@pytest.mark.parametrize("seed", range(40))
def test_with_what_is_advised_the_wanted_state_is_there(seed: int) -> None:
    chance = random.Random(f"simulate {seed}")
    asked = a_scene(chance, chance.choice([(0.1, 1.0), (1.0, 20.0), (20.0, 150.0)]))
    found = tuple(simulate(asked))
    advice = advice_on(asked, found, SearchRequest(DEFAULT_TOLERANCE, (0,), AUTO))
    assert len(advice) <= (found[0].wanted is None)
    for sentence in advice:
        better = advised(sentence, asked)
        assert better != asked
        assert simulate(better)[0].wanted is not None


def test_most_missing_states_lead_to_advice() -> None:
    missing = []
    for seed in range(40):
        asked = a_scene(random.Random(f"missing {seed}"), (1.0, 60.0))
        found = tuple(simulate(asked))
        if found[0].wanted is None:
            missing.append(bool(advice_on(asked, found, SearchRequest(DEFAULT_TOLERANCE, (0,), AUTO))))
    assert len(missing) > 10
    assert sum(missing) >= 0.9 * len(missing)


@pytest.mark.parametrize("seed", range(12))
def test_advice_on_a_row_keeps_what_its_neighbours_have(seed: int) -> None:
    chance = random.Random(f"row {seed}")
    lengths = tuple(round(chance.uniform(520, 680), 1) for _ in range(4))
    angles = tuple(round(chance.uniform(-50, 50), 1) for _ in range(5))
    asked = row(lengths, "".join(chance.choice("pv") for _ in range(4)), angles)
    found = tuple(simulate(asked))
    for sentence in advice_on(asked, found, SearchRequest(DEFAULT_TOLERANCE, (0,), AUTO)):
        segment = int(sentence.removeprefix("segment ").partition(":")[0]) - 1
        after = simulate(advised(sentence, asked))
        assert after[segment].wanted is not None
        assert all(new.wanted is not None for old, new in zip(found, after, strict=True) if old.wanted is not None)


@pytest.mark.parametrize("seed", range(30))
def test_a_rod_that_is_too_short_has_a_state_with_what_is_advised(seed: int) -> None:
    chance = random.Random(f"short {seed}")
    clamp = chance.choice([0.0, 0.02, 0.45])
    angles = chance.uniform(-1.2, 1.2), chance.uniform(-1.2, 1.2)
    rod = rod_between((0.5, chance.uniform(-0.3, 0.3)), *angles, chance.uniform(0.05, 0.44), clamp, 0.03, 0.0)
    found = re.search(rf"lengthen it by {NUMBER} mm$", why_none(rod))
    assert found is not None
    assert find_states(changed(rod, length=rod.length + mm(float(found[1]))), DEFAULT_TOLERANCE)


@pytest.mark.parametrize("seed", range(50))
def test_ranges_of_places_include_both_ends_that_are_named(seed: int) -> None:
    chance = random.Random(f"place {seed}")
    single = read_display("single")
    display = replace(single, clamp=mm(round(chance.uniform(0.5, 120.0), chance.choice([0, 1, 3]))))
    segment = Segment(mm(round(chance.uniform(510.0, 890.0), chance.choice([0, 1, 3]))), "peak")
    scene = Scene("lone", display, (Node(0.0, 0.0),) * 2, (segment,))
    with pytest.raises(InvalidInput) as found:
        check_place(scene, Push(at=0.0))
    low, high = re.findall(NUMBER, found.value.hint)
    for at in (low, high):
        check_place(scene, Push(at=float(at)))


@pytest.mark.parametrize("seed", range(50))
def test_the_least_step_of_a_push_is_accepted(seed: int) -> None:
    chance = random.Random(f"step {seed}")
    most = round(10.0 ** chance.uniform(-1.0, 3.0), chance.choice([1, 3, 9]))
    with pytest.raises(InvalidInput) as found:
        check_steps(Push(most=most, step=1e-9 * most))
    check_steps(Push(most=most, step=float(re.findall(r"[\d.e-]*\d", found.value.hint)[0])))


SHAPE = """name = "x"
display = "mine.toml"
nodes = [{{ height_mm = {height}, angle_deg = {angle} }}, {{ height_mm = 0.0, angle_deg = 0.0 }}]
segments = [{{ length_mm = {length}, state = "peak" }}]
loads = [{{ segment = 1, at = {at}, force_N = [0.0, -0.1] }}]
"""


def hints(path: Path) -> list[str]:
    try:
        read_shape(path)
    except InvalidInput as error:
        return [found.hint for found in error.diagnostics]
    return []


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("key", ["height", "angle", "length", "at"])
def test_what_a_shape_file_is_advised_to_say_is_accepted(tmp_path: Path, key: str, seed: int) -> None:
    chance = random.Random(f"{key} {seed}")
    limits = {
        "height_mm": f"[{chance.uniform(-90, -10)!r}, {chance.uniform(10, 90)!r}]",
        "angle_deg": f"[{chance.uniform(-60, -10)!r}, {chance.uniform(10, 60)!r}]",
        "length_mm": f"[{chance.uniform(500, 550)!r}, {chance.uniform(700, 900)!r}]",
        "clamp_mm": f"{chance.uniform(5, 60)!r}",
        "total_length_mm": f"{chance.uniform(2000, 2100)!r}",
    }
    (tmp_path / "mine.toml").write_text(written(limits, builtin_text("single")))
    path = tmp_path / "shape.toml"
    sound = {"height": 0.0, "angle": 0.0, "length": 650.0, "at": 0.5}
    for wrong in {"height": (-400, 400), "angle": (-88, 88), "length": (100, 1200), "at": (0.001, 0.999)}[key]:
        path.write_text(SHAPE.format(**{**sound, key: wrong}))
        (hint, *_) = hints(path)
        numbers = re.findall(NUMBER, hint)
        assert len(numbers) == (1 if "at least" in hint else 2)
        for number in numbers:
            path.write_text(SHAPE.format(**{**sound, key: number}))
            assert not [other for other in hints(path) if other == hint]
            assert hints(path) == [] or key == "length"


@pytest.mark.parametrize("seed", range(20))
def test_taking_so_much_rod_off_is_enough(tmp_path: Path, seed: int) -> None:
    chance = random.Random(f"off {seed}")
    values = {"total_length_mm": f"{chance.uniform(510, 690)!r}", "length_mm": "[500.0, 1e6]"}
    (tmp_path / "mine.toml").write_text(written(values, builtin_text("single")))
    path, length = tmp_path / "shape.toml", chance.uniform(700, 900)
    path.write_text(SHAPE.format(height=0.0, angle=0.0, length=length, at=0.5))
    (hint,) = hints(path)
    path.write_text(
        SHAPE.format(height=0.0, angle=0.0, length=repr(length - float(re.findall(NUMBER, hint)[0])), at=0.5)
    )
    assert hints(path) == []


@pytest.mark.parametrize("seed", range(20))
def test_the_most_counts_per_turn_are_accepted(tmp_path: Path, seed: int) -> None:
    chance = random.Random(f"edges {seed}")
    speeds = {"extrude_mm_per_s": f"{chance.uniform(5, 50)!r}", "bias_deg_per_s": f"{chance.uniform(10, 90)!r}"}
    path = tmp_path / "mine.toml"
    path.write_text(written({**speeds, "counts_per_turn": "8e5"}, builtin_text("single")))
    with pytest.raises(InvalidInput) as found:
        read_display(path)
    (most,) = re.findall(NUMBER, found.value.diagnostics[0].hint)
    path.write_text(written({**speeds, "counts_per_turn": most}, builtin_text("single")))
    axes = drive_settings(read_display(path)).axes
    assert sum(axis.speed * axis.counts_per_unit for axis in axes) <= MAX_EDGES_PER_S
    path.write_text(written({**speeds, "counts_per_turn": f"{1.001 * float(most)}"}, builtin_text("single")))
    with pytest.raises(InvalidInput):
        read_display(path)


@pytest.mark.parametrize("strain", [0.001, 0.002, 0.0037, 0.00455])
def test_gentler_limits_quiet_the_warning_of_a_stiff_rod(strain: float) -> None:
    single = read_display("single")
    stiff = replace(single, rod=replace(single.rod, max_strain=strain))
    (warning,) = (each for each in warnings(stiff) if each.code == "stiff-rod")
    found = re.search(rf"lower limits.angle_deg to {NUMBER} deg", warning.hint)
    if found:
        gentle = Range(-deg(float(found[1])), deg(float(found[1])))
        assert "stiff-rod" not in [
            each.code for each in warnings(replace(stiff, limits=replace(stiff.limits, angle=gentle)))
        ]
    assert bool(found) == (strain > 0.0015)


def warnings(display: Display) -> list[Suspicion]:
    return suspicions(display, Ability(Held(None, None)))


def test_a_prover_with_few_steps_gives_up_and_shares_what_it_knows() -> None:
    display = read_display("single")
    whole = Verifier(display, lambda: None)
    shape = nearest_shape(whole, ("peak",))
    begin = Travel((), DisplayState(home(display), (None,)))
    assert travel_to(whole.like(display, 10), begin, goal_of(shape)).moves
    with pytest.raises(Refused, match="too many steps"):
        travel_to(whole.like(display, 1), begin, goal_of(shape))
    weak = replace(display, drive=replace(display.drive, max_force=3.0))
    with pytest.raises(Refused, match="extruding takes"):
        travel_to(whole.like(weak), begin, goal_of(shape))


@pytest.mark.parametrize("seed", range(20))
def test_lengths_that_a_warning_advises_are_quiet(seed: int) -> None:
    chance = random.Random(f"lengths {seed}")
    span = mm(round(chance.uniform(150.0, 900.0), 4))
    ranges = {"no-home": Range(1.1 * span, 1.8 * span), "little-slack": Range(span, 1.01 * span)}
    for code, allowed in ranges.items():
        single = read_display("single")
        display = replace(single, span=span, limits=replace(single.limits, length=allowed))
        (hint,) = (each.hint for each in warnings(display) if each.code == code)
        number = mm(float(re.findall(NUMBER, hint)[0]))
        better = Range(number, allowed.high) if code == "no-home" else Range(allowed.low, number)
        changed = replace(display, limits=replace(single.limits, length=better))
        assert not {"no-home", "out-of-reach", "little-slack"} & {each.code for each in warnings(changed)}
