"""Plan files that were damaged, edited or forged: a broken seal moves nothing, and a forged one makes no traceback."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from random import Random
from typing import Any

import pytest

from campaign import only
from curveline.cli.printing.reports.plan_text import describe
from curveline.drive_settings import drive_settings
from curveline.errors import InvalidInput
from curveline.plan_file import MARKER, NodeTarget, Plan, Step, from_json, seal_of, sealed, to_json
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.frame_listing import describe_plan_frames
from curveline.radio.host.preflight import check_targets, journal_bytes, run_tag
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import axes_of, config_hash, outside
from curveline.shapes.files import read_display
from curveline.system.files import decode_text
from curveline.system.json_records import LARGEST, Decoder

ABSURD = [0, -1, 1e308, -1e308, 1e-308, 5e-324, 2**63, -(2**63), 10**400, True, None, "", "x", [], {}, [[[1]]], 1e15]
DRIVE = drive_settings(read_display("single"))
POSES = ((20, 0, 0), (20, 25, 0), (80, 25, 0), (80, 30, 0), (80, 30, 40))


def target(*pose: float) -> NodeTarget:
    counts = tuple(axis.counts(value) for axis, value in zip(DRIVE.axes, pose, strict=True))
    return NodeTarget(*pose, counts=(counts[0], counts[1], counts[2]))


def step(number: int, feed: float, angle: float, height: float) -> Step:
    targets = (target(feed, angle, height), target(-feed, -angle, 0.0))
    states = ("peak|valley",) if number == 1 else ("peak",)
    proven = {"lowest_eigenvalue": 46.1, "margin": 0.3, "margin_of": "stability", "max_strain": 0.011}
    return Step(
        number, "move", 3.25, targets, (500.0 + 2 * feed,), states, max_force_N=2.5, max_moment_Nmm=120, **proven
    )


STEPS = tuple(step(number, *pose) for number, pose in enumerate(POSES, start=1))
ORIGINAL = sealed(
    Plan(
        name="five steps",
        drive=DRIVE,
        start=(target(0.0, 0.0, 0.0),) * 2,
        steps=STEPS,
        wanted=("peak",),
        lengths_mm=STEPS[-1].lengths_mm,
        shows=("",),
        provenance={"display": "single", "argv": ["plan", "shape.toml"], "seed": 7, "sure": True},
    )
)
TEXT = to_json(ORIGINAL)


def places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Every container of a document with every key of it."""
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        yield data, key
        if isinstance(value, dict | list):
            yield from places(value)


# What becomes of a document


def absurd(random: Random, data: Any) -> None:
    inside, key = random.choice(list(places(data)))
    inside[key] = random.choice(ABSURD)


def another_number(random: Random, data: Any) -> None:
    numbers = [(inside, key) for inside, key in places(data) if type(inside[key]) in (int, float)]
    inside, key = random.choice(numbers)
    inside[key] = random.choice([inside[key] * random.choice([-1, 10, 1e12, 1e300]), random.choice(numbers)[1], 1e9])


def lost(random: Random, data: Any) -> None:
    inside, key = random.choice(list(places(data)))
    del inside[key]


def swapped(random: Random, data: Any) -> None:
    """Two values of the same name, such as the targets of two steps."""
    inside, key = random.choice(list(places(data)))
    other, same = random.choice([place for place in places(data) if place[1] == key])
    # A value is not put into itself.
    here, there = json.loads(json.dumps([inside[key], other[same]]))
    inside[key] = there
    with suppress(KeyError, IndexError, TypeError):
        other[same] = here


def steps_swapped(random: Random, data: Any) -> None:
    key = random.choice(["targets", "seconds", "states", "lengths_mm", "margin"])
    one, other = random.sample(data["steps"], 2)
    one[key], other[key] = other[key], one[key]


def reordered(random: Random, data: Any) -> None:
    """Steps in another order, some left out or done twice, with right numbers."""
    data["steps"] = [dict(each) for each in random.choices(data["steps"], k=random.randrange(1, 7))]
    for number, each in enumerate(data["steps"], start=1):
        each["number"] = number


def doubled(random: Random, data: Any) -> None:
    rows = [inside[key] for inside, key in places(data) if isinstance(inside[key], list) and inside[key]]
    row = random.choice(rows)
    row.insert(random.randrange(len(row) + 1), random.choice(row))


def nested(random: Random, data: Any) -> None:
    inside, key = random.choice(list(places(data)))
    for _ in range(random.choice([1, 3, 100, 400])):
        inside[key] = random.choice([[inside[key]], {"a": inside[key]}])


def moved(random: Random, data: Any) -> None:
    """A target elsewhere, with the counts that belong to it."""
    goal = random.choice(random.choice(data["steps"])["targets"])
    index, name = random.choice(list(enumerate(("extrude_mm", "bias_deg", "translate_mm"))))
    goal[name] = random.choice([0.0, 1.0, -74.9, 75.1, 219.0, 221.0, 1183.0, 1185.0, 1e6])
    goal["counts"][index] = DRIVE.axes[index].counts(goal[name])


CHANGES = (absurd, another_number, lost, swapped, steps_swapped, reordered, doubled, nested, moved)


def changed_document(random: Random) -> dict[str, Any]:
    data = json.loads(TEXT)
    for _ in range(random.choice([1, 1, 1, 2, 3])):
        with suppress(KeyError, TypeError, IndexError, AttributeError, ValueError, OverflowError):
            random.choice(CHANGES)(random, data)
    return data


# What becomes of the bytes of a file


def changed_bytes(random: Random) -> bytes:
    data = bytearray(TEXT.encode())
    here, there = sorted(random.randrange(len(data) + 1) for _ in range(2))
    length = random.randrange(1, 40)
    kind = random.randrange(5)
    if kind == 0:
        for _ in range(random.choice([1, 1, 2, 8])):
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)
    elif kind == 1:
        del data[here:]
    elif kind == 2:
        del data[here : here + length]
    elif kind == 3:
        data[here:here] = data[there : there + length]
    else:
        lines = TEXT.split("\n")
        lines.insert(random.randrange(len(lines)), random.choice(lines))
        data = bytearray("\n".join(lines).encode())
    return bytes(data)


def read(data: bytes) -> Plan | None:
    """The plan in a file; None if it is refused, and then with what to do."""
    try:
        return from_json(decode_text(data, "plan.json"), "plan.json")
    except InvalidInput as error:
        refusal = error
    assert refusal.hint
    assert refusal.diagnostics
    return None


def resealed(data: dict[str, Any]) -> dict[str, Any]:
    """`data` under the seal that fits it, which anybody can make; as it is if it holds no plan."""
    decoder = Decoder()
    try:
        plan = decoder.decode(Plan, {key: value for key, value in data.items() if key != MARKER}, "")
        return data if decoder.problems else {**data, "seal": seal_of(plan)}
    except RecursionError:
        return data


def mutants(make: Callable[[Random], bytes], count: int) -> Iterator[tuple[int, Plan]]:
    """Seeds and content of those mutants that are accepted."""
    for number in range(count):
        data = make(Random(number))
        plan = read(data)
        if plan is not None:
            yield number, plan


def test_no_damaged_file_is_another_plan() -> None:
    same = list(mutants(changed_bytes, 3000))
    assert [number for number, plan in same if plan != ORIGINAL] == []
    # White space and the like.
    assert 0 < len(same) < 300


@pytest.mark.parametrize("count", [700, *only([2000])])
def test_no_edited_document_is_another_plan(count: int) -> None:
    same = list(mutants(lambda random: json.dumps(changed_document(random)).encode(), count))
    assert [number for number, plan in same if plan != ORIGINAL] == []
    # Equal values exchanged.
    assert 0 < len(same) < count // 5


@pytest.mark.parametrize("count", [1000, *only([3000])])
def test_a_forged_seal_makes_no_traceback_and_leaves_no_limit(count: int) -> None:
    accepted = 0
    for number, plan in mutants(lambda random: json.dumps(resealed(changed_document(random))).encode(), count):
        assert plan.seal == seal_of(plan), number
        accepted += sends_within_limits(plan)
    assert accepted > count // 10


def sends_within_limits(plan: Plan) -> bool:
    """Everything that a send does before it moves; False if a plan is refused by then, with what to do."""
    assert list(describe(plan))
    assert plan.wanted == plan.steps[-1].states
    assert all(abs(number) <= LARGEST for each in plan.steps for number in vars(each).values() if type(number) is float)
    try:
        axes = axes_of(plan.drive)
        check_targets(plan)
    except InvalidInput as error:
        return not error.hint
    assert 0 <= config_hash(axes) < 1 << 16
    Conductor(plan, Site(bytes(16), (1,) * plan.drive.node_count), 0)
    assert 0 <= run_tag(plan) < 1 << 64
    assert journal_bytes(plan) > 0
    frames = describe_plan_frames(plan)
    assert not any(outside(axes, frame.target) for frame in frames)
    assert len(frames) == plan.drive.node_count * len(plan.steps)
    return True


def test_the_targets_of_two_steps_exchanged_are_another_plan() -> None:
    one, *between, four, last = STEPS
    swapped_steps = (replace(one, targets=four.targets), *between, replace(four, targets=one.targets), last)
    document = json.loads(to_json(sealed(replace(ORIGINAL, steps=swapped_steps))))
    text = json.dumps({**document, "seal": ORIGINAL.seal})
    with pytest.raises(InvalidInput) as caught:
        from_json(text, "plan.json")
    assert [found.code for found in caught.value.diagnostics] == ["broken-seal"]
    assert "plan again" in caught.value.hint
