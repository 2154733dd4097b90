"""Plans survive their JSON file bit for bit; a plan that motors must not follow is refused with every reason."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from curveline.drive_settings import DriveSettings, drive_settings
from curveline.errors import Diagnostic, InvalidInput
from curveline.plan_file import (
    MAX_BYTES,
    MAX_COUNT,
    MAX_DIAGNOSTICS,
    NodeTarget,
    Plan,
    Step,
    from_json,
    read_plan,
    seal_of,
    sealed,
    to_json,
    write_plan,
)
from curveline.shapes.files import read_display
from curveline.system.json_records import LARGEST, Decoder

DRIVE = drive_settings(read_display("single"))


def target(extrude: float, bias: float, translate: float, drive: DriveSettings = DRIVE) -> NodeTarget:
    """A target with the counts that belong to it."""
    values = (extrude, bias, translate)
    counts = tuple(axis.counts(value) for axis, value in zip(drive.axes, values, strict=True))
    return NodeTarget(extrude, bias, translate, (counts[0], counts[1], counts[2]))


def step(number: int, *targets: NodeTarget) -> Step:
    """A step with ordinary numbers."""
    return Step(number, "extrude", 3.25, targets, (612.5,), ("peak|valley",), 46.1, 0.3, "fold", 0.011, 2.5, 120.0)


PLAN = sealed(
    Plan(
        name="level-up-peak",
        drive=DRIVE,
        start=(target(0.0, 0.0, 0.0), target(0.0, 0.0, 0.0)),
        steps=(
            step(1, target(0.0, 12.3, 0.0), target(-110.1, -75.0, 1e-3)),
            replace(step(2, target(0.1 + 0.2, 30.0, -220.0), target(-160.0, -30.0, 220.0)), states=("peak",)),
        ),
        wanted=("peak",),
        lengths_mm=(612.5,),
        provenance={"argv": ["plan", "shape.toml"], "seed": 7, "margin": {"fold": 0.1, "none": None, "sure": True}},
    )
)


def document() -> dict[str, Any]:
    """The JSON document of a valid plan, to be broken."""
    data: dict[str, Any] = json.loads(to_json(PLAN))
    return data


def problems(read: Callable[[], object]) -> tuple[Diagnostic, ...]:
    """The diagnostics of a plan that must be refused."""
    with pytest.raises(InvalidInput) as caught:
        read()
    assert caught.value.diagnostics
    assert all(d.hint and d.message.isprintable() for d in caught.value.diagnostics)
    return caught.value.diagnostics


def found_in(data: Any) -> list[tuple[str, str]]:
    """Code and message of everything wrong with a document."""
    return [(d.code, d.message) for d in problems(lambda: from_json(json.dumps(data), "plan.json"))]


def test_round_trip_through_a_file(tmp_path: Path) -> None:
    write_plan(PLAN, tmp_path / "plan.json")
    assert read_plan(tmp_path / "plan.json") == PLAN
    assert next(iter(document())) == "curveline_plan"
    assert PLAN.seconds == 6.5


SIZES = st.floats(-LARGEST, LARGEST)


@settings(derandomize=True, max_examples=200, deadline=None, database=None)
@given(SIZES, SIZES, st.floats(-2000, 2000), st.floats(-75, 75), st.text('aé\U0001f600"\\ ', max_size=8))
@example(5e-324, -0.0, 0.1, 1 / 3, "")
def test_round_trip_keeps_every_bit(a: float, b: float, feed: float, angle: float, text: str) -> None:
    first = replace(
        PLAN.steps[1], number=1, margin=a, max_force_N=b, action=text, targets=(target(feed, angle, 0.0),) * 2
    )
    plan = sealed(replace(PLAN, steps=(first,), provenance={"b": b, "a": [a, text]}))
    again = from_json(to_json(plan), "plan.json")
    assert again == plan
    assert to_json(again) == to_json(plan)
    assert repr(again) == repr(plan)


@pytest.mark.parametrize("shows", [(), ("",), ("peak",), ("middle-1",)])
def test_states_at_the_start_are_one_per_segment_or_none_at_all(shows: tuple[str, ...]) -> None:
    plan = from_json(to_json(sealed(replace(PLAN, shows=shows))), "plan.json")
    assert (plan.shows, plan.granted) == (shows, shows or ("",))
    data = edit(document(), "shows", list(shows))
    if not any(shows):
        del data["shows"]
        assert from_json(json.dumps(data), "plan.json").granted == ("",)


def test_reading_a_plan_loads_neither_numpy_nor_pydantic(tmp_path: Path) -> None:
    write_plan(PLAN, tmp_path / "plan.json")
    code = (
        "import sys; from curveline.plan_file import read_plan; read_plan(sys.argv[1]);"
        "print([m for m in ('numpy', 'scipy', 'numba', 'pydantic') if m in sys.modules])"
    )
    run = [sys.executable, "-c", code, str(tmp_path / "plan.json")]
    assert subprocess.run(run, capture_output=True, text=True, check=True, timeout=60).stdout == "[]\n"


def test_a_plan_file_is_not_overwritten_unless_told(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    path.write_text("precious")
    (found,) = problems(lambda: write_plan(PLAN, path))
    assert (found.code, path.read_text()) == ("exists", "precious")
    write_plan(PLAN, path, force=True)
    assert read_plan(path) == PLAN
    assert os.listdir(tmp_path) == ["plan.json"]


def test_a_failed_write_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> NoReturn:
        raise OSError(28, "No space left on device")

    path = tmp_path / "plan.json"
    path.write_text("precious")
    monkeypatch.setattr(os, "fsync", full)
    (found,) = problems(lambda: write_plan(PLAN, path, force=True))
    assert (found.code, path.read_text(), os.listdir(tmp_path)) == ("unwritable", "precious", ["plan.json"])


def test_a_plan_is_not_written_over_devices_or_into_nothing(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, code in [
        (tmp_path / "pipe", "not-a-file"),
        (tmp_path, "not-a-file"),
        (tmp_path / "no" / "p", "no-such-folder"),
    ]:
        (found,) = problems(lambda path=path: write_plan(PLAN, path, force=True))
        assert found.code == code


def test_a_link_is_written_through(tmp_path: Path) -> None:
    (tmp_path / "real.json").write_text("old")
    (tmp_path / "link.json").symlink_to("real.json")
    write_plan(PLAN, tmp_path / "link.json", force=True)
    assert (tmp_path / "link.json").is_symlink()
    assert read_plan(tmp_path / "real.json") == PLAN


def test_a_plan_with_numbers_that_json_has_not_is_not_written() -> None:
    with pytest.raises(ValueError, match="JSON"):
        sealed(replace(PLAN, lengths_mm=(float("nan"),)))


def test_a_plan_that_was_changed_is_neither_written_nor_lost(tmp_path: Path) -> None:
    changed = replace(PLAN, name="changed")
    for plan in (changed, replace(PLAN, seal="")):
        with pytest.raises(InvalidInput, match="changed after it was proven") as caught:
            write_plan(plan, tmp_path / "plan.json")
        assert "curveline.plan_file.sealed" in caught.value.hint
    assert os.listdir(tmp_path) == []
    write_plan(sealed(changed), tmp_path / "plan.json")
    assert read_plan(tmp_path / "plan.json") == sealed(changed)


def test_a_seal_is_of_what_a_plan_says_and_not_of_how_it_is_written() -> None:
    data = document()
    turned = dict(reversed(data.items()))
    turned["start"] = [{**each, "bias_deg": 0, "extrude_mm": -0.0} for each in data["start"]]
    for text in (json.dumps(turned), json.dumps(turned, indent=8), json.dumps(turned, ensure_ascii=False) + "\n\n"):
        assert from_json(text, "plan.json") == PLAN
    whole = sealed(replace(PLAN, steps=tuple(replace(each, seconds=3) for each in PLAN.steps)))
    assert from_json(to_json(whole), "plan.json") == whole


def test_a_plan_too_large_is_not_parsed(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    path.write_bytes(b" " * (MAX_BYTES + 1))
    (found,) = problems(lambda: read_plan(path))
    assert found.code == "too-large"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", (1, 1, "json-syntax")),
        ('{\n "curveline_plan": 3,\n "name" "x"\n}', (3, 9, "json-syntax")),
        ('{"curveline_plan": 3} {}', (1, 23, "json-syntax")),
        ("[" * 100_000, (1, 1, "too-deep")),
        ('{"curveline_plan": 3, "name": ' + "1" * 5000 + "}", (1, 1, "out-of-range")),
        ("[]", (1, 1, "not-a-plan")),
        ("{}", (1, 1, "not-a-plan")),
        ('{"name": "x", "states": []}', (1, 1, "not-a-plan")),
        ('{"curveline_plan": 2, "name": "x"}', (1, 1, "unsealed")),
        ('{"curveline_plan": 4}', (1, 1, "unknown-format")),
        ('{"curveline_plan": true, "curveline_plan": "1"}', (1, 1, "unknown-format")),
        ("\ufffe", (1, 1, "json-syntax")),
    ],
)
def test_what_is_no_plan(text: str, place: tuple[int, int, str]) -> None:
    assert [(d.line, d.column, d.code) for d in problems(lambda: from_json(text, "plan.json"))] == [place]


def test_the_line_of_a_syntax_error_is_shown() -> None:
    text = '{"a": [\n' + "1, " * 5000 + "x]}"
    (found,) = problems(lambda: from_json(text, "plan.json"))
    assert (found.line, found.column, found.source[found.caret - 1]) == (2, 15001, "x")
    assert len(found.source) <= 120


def resealed(data: Any) -> Any:
    """`data` under the seal that fits it, which anybody can make; as it is if it holds no plan."""
    decoder = Decoder()
    plan = decoder.decode(Plan, {key: value for key, value in data.items() if key != "curveline_plan"}, "")
    return data if decoder.problems else {**data, "seal": seal_of(plan)}


def edit(data: Any, path: str, value: Any) -> Any:
    """`data` with the item at a dotted path replaced, or removed if the value is `...`."""
    *parents, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    inner = data
    for part in parents:
        inner = inner[part]
    if value is ...:
        del inner[last]
    else:
        inner[last] = value
    return data


WRONG: list[tuple[str, Any, str, str]] = [
    ("name", 3, "wrong-type", "name must be a string"),
    ("name", "a\x1b[0m", "bad-value", "name"),
    ("name", ..., "missing-key", "name is missing"),
    ("steps.1.seconds", ..., "missing-key", "steps[1].seconds is missing"),
    ("steps.1.seconds", 66, "out-of-range", "steps[1].seconds is 66 s"),
    ("steps.1.seconds", -0.001, "out-of-range", "steps[1].seconds"),
    ("steps.1.seconds", float("nan"), "not-finite", "steps[1].seconds"),
    ("steps.1.margin", float("-inf"), "not-finite", "steps[1].margin"),
    ("steps.1.margin", 10**400, "not-finite", "steps[1].margin"),
    ("steps.1.seconds", True, "wrong-type", "steps[1].seconds must be a number"),
    ("steps.1.seconds", "3", "wrong-type", "steps[1].seconds must be a number"),
    ("steps.1.number", 3, "step-number", "steps[1].number is 3, but must be 2"),
    ("steps.1.number", 2.0, "wrong-type", "steps[1].number must be a whole number"),
    ("steps.1.number", True, "wrong-type", "steps[1].number must be a whole number"),
    ("steps.0", None, "wrong-type", "steps[0] must be an object"),
    ("steps", [], "step-number", "nothing to send"),
    ("steps", {}, "wrong-type", "steps must be an array"),
    ("steps.0.targets.1", ..., "node-count", "steps[0].targets has 1"),
    ("start.0", ..., "node-count", "start has 1"),
    ("steps.0.targets.1.bias_deg", 75.5, "count-mismatch", "steps[0].targets[1], bias"),
    ("steps.0.targets.1.counts.2", 3, "count-mismatch", "steps[0].targets[1], translate"),
    ("steps.0.targets.1.counts.2", 1 << 23, "out-of-range", "24 bits"),
    ("steps.0.targets.1.counts.2", -(1 << 23) - 1, "out-of-range", "24 bits"),
    ("steps.0.targets.1.counts.2", 10**100, "out-of-range", "24 bits"),
    ("steps.0.targets.1.counts.2", 0.0, "wrong-type", "steps[0].targets[1].counts[2]"),
    ("steps.0.targets.1.counts", [0, 0], "item-count", "steps[0].targets[1].counts has 2 items"),
    ("steps.0.states", [], "segment-count", "steps[0].states"),
    ("steps.0.states.0", 1, "wrong-type", "steps[0].states[0]"),
    ("steps.0.lengths_mm", [1.0, 2.0], "segment-count", "steps[0].lengths_mm"),
    ("steps.0.corners", -1, "out-of-range", "steps[0].corners is -1"),
    ("steps.0.corners", 1.5, "wrong-type", "steps[0].corners must be a whole number"),
    ("steps.0.corners", True, "wrong-type", "steps[0].corners must be a whole number"),
    ("steps.0.shape", None, "wrong-type", "steps[0].shape must be a string"),
    ("steps.0.shape", "a\x1b[0m", "bad-value", "steps[0].shape"),
    ("wanted", [], "segment-count", "wanted"),
    ("lengths_mm", [], "segment-count", "lengths_mm"),
    ("shows", ["peak", "peak"], "segment-count", "shows has 2 items"),
    ("shows", [""] * 100_000, "segment-count", "shows has 100000 items"),
    ("shows", "peak", "wrong-type", "shows must be an array"),
    ("shows", [None], "wrong-type", "shows[0] must be a string"),
    ("shows", ["peak|valley"], "bad-value", "shows[0] is 'peak|valley', which is no name of one state"),
    ("shows", ["none of them"], "bad-value", "shows[0]"),
    ("shows", ["peak\n"], "bad-value", "shows[0]"),
    ("shows", ["p" * 100_000], "bad-value", f"shows[0] is '{'p' * 40}', which"),
    ("shows", ["middle-" + "1" * 100_000], "bad-value", "shows[0]"),
    ("drive.axes.0.counts_per_unit", 0.0, "out-of-range", "drive.axes, extrude"),
    ("drive.axes.1.counts_per_unit", -1.0, "out-of-range", "drive.axes, bias"),
    ("drive.axes.2.speed", 0, "out-of-range", "drive.axes, translate"),
    ("drive.axes.2.acceleration", -5, "out-of-range", "drive.axes, translate"),
    ("drive.axes.1", ..., "item-count", "drive.axes has 2 items"),
    ("drive.channel", 126, "out-of-range", "drive.channel is 126"),
    ("drive.data_rate", "3Mbps", "bad-value", "drive.data_rate"),
    ("drive.addresses.0", "C1C1C1C10", "bad-value", "drive.addresses"),
    ("drive.addresses.0", "C1C1C1C101\n", "bad-value", "drive.addresses"),
    ("drive.addresses.0", "c1c1c1c102", "duplicate-address", "drive.addresses"),
    ("drive.motor", 1, "unknown-key", "'motor' in drive"),
    ("steps.0.comment", "x", "unknown-key", "'comment' in steps[0]"),
    ("provenance.x", float("inf"), "not-finite", "provenance.x"),
    ("provenance.argv.0", "\x1b", "bad-value", "provenance.argv[0]"),
    ("provenance", [], "wrong-type", "provenance must be an object"),
    ("provenance.x", [[[[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]]]], "too-deep", "provenance is nested too deep"),
    ("drive.axes.0.counts_per_unit", 1e-308, "out-of-range", "drive.axes, extrude"),
    ("drive.addresses", [f"{number:010X}" for number in range(129)], "node-count", "has 2 to 128 nodes"),
    ("steps.0.corners", 10**13, "out-of-range", "steps[0].corners is 10000000000000"),
    ("wanted.0", "valley", "end-mismatch", "wanted is 'valley', but the last step ends in 'peak'"),
    ("lengths_mm.0", 612.0, "end-mismatch", "lengths_mm is not what the last step ends with"),
    ("steps.0.margin", 0.31, "broken-seal", "the seal does not fit"),
    ("name", "other", "broken-seal", "the seal does not fit"),
    ("provenance.seed", 8, "broken-seal", "the seal does not fit"),
    ("seal", ..., "unsealed", "seal is missing"),
    ("seal", "", "unsealed", "seal is missing"),
    ("seal", None, "wrong-type", "seal must be a string"),
    ("seal", "0" * 32, "broken-seal", "the seal does not fit"),
]


@pytest.mark.parametrize(("path", "value", "code", "words"), WRONG, ids=[f"{row[0]}={row[1]!s:.12}" for row in WRONG])
def test_wrong_value(path: str, value: Any, code: str, words: str) -> None:
    assert any(code == c and words in message for c, message in found_in(edit(document(), path, value)))


@pytest.mark.parametrize("value", [1e308, -1e308, 1.1e15, 2**63])
def test_no_number_of_a_plan_is_absurd(value: float) -> None:
    """Every number of the schema: what holds only for some of them was found to overflow in others."""
    free = ("curveline_plan", "provenance")
    numbers = [path for path in everywhere(document()) if is_number(document(), path) and not path.startswith(free)]
    assert len(numbers) > 60
    for path in numbers:
        found = found_in(resealed(edit(document(), path, value)))
        assert {"out-of-range", "step-number", "wrong-type"} & {code for code, _ in found}, (path, found)


def is_number(data: Any, path: str) -> bool:
    for part in path.split("."):
        data = data[int(part) if part.isdigit() else part]
    return type(data) in (int, float)


@pytest.mark.parametrize("sign", [-1, 1])
def test_limits_of_an_axis(sign: int) -> None:
    for index, name in enumerate(("extrude_mm", "bias_deg", "translate_mm")):
        axis = DRIVE.axes[index]
        bound = axis.high if sign > 0 else axis.low
        for excess, refused in [(0.0, False), (0.9, False), (1.6, True)]:
            value = bound + sign * excess / axis.counts_per_unit
            data = edit(document(), f"steps.1.targets.0.{name}", value)
            edit(data, f"steps.1.targets.0.counts.{index}", axis.counts(value))
            if refused:
                assert [code for code, _ in found_in(data)] == ["out-of-range"]
            else:
                from_json(json.dumps(resealed(data)), "plan.json")


def test_one_count_of_difference_is_forgiven_and_two_are_not() -> None:
    counts = PLAN.steps[0].targets[0].counts[1]
    from_json(json.dumps(resealed(edit(document(), "steps.0.targets.0.counts.1", counts + 1))), "plan.json")
    found = found_in(edit(document(), "steps.0.targets.0.counts.1", counts + 2))
    assert [code for code, _ in found] == ["count-mismatch"]


def test_a_key_given_twice() -> None:
    text = to_json(PLAN).replace('"number": 1,', '"number": 1, "number": 1,', 1)
    assert "duplicate-key" in [d.code for d in problems(lambda: from_json(text, "plan.json"))]


def test_all_problems_are_reported_at_once() -> None:
    data = edit(edit(document(), "steps.0.seconds", 70), "steps.1.targets.0.counts.1", MAX_COUNT)
    edit(data, "drive.channel", -1)
    codes = [code for code, _ in found_in(data)]
    assert sorted(codes) == ["count-mismatch", "out-of-range", "out-of-range"]
    edit(edit(data, "name", 1), "drive.addresses.0", None)
    assert [code for code, _ in found_in(data)] == ["wrong-type", "wrong-type"]


def test_a_flood_of_problems_is_cut_off() -> None:
    assert len(found_in(edit(document(), "steps", [{}] * 10_000))) == MAX_DIAGNOSTICS


VALUES = [None, True, -1, 0, 10**30, 1e308, -1e-308, "", "x", [], {}, [[]], {"a": 1}, float("nan")]


def everywhere(data: Any, prefix: str = "") -> list[str]:
    """Every dotted path of a document."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else []
    return [path for key, value in items for path in (f"{prefix}{key}", *everywhere(value, f"{prefix}{key}."))]


@pytest.mark.parametrize("value", VALUES, ids=repr)
def test_any_value_anywhere_is_a_plan_or_diagnostics(value: Any) -> None:
    for path in everywhere(document()):
        check_outcome(json.dumps(edit(document(), path, value)))


@settings(derandomize=True, max_examples=300, deadline=None, database=None)
@given(st.data())
def test_damaged_text_is_a_plan_or_diagnostics(data: st.DataObject) -> None:
    text = to_json(PLAN)
    for _ in range(data.draw(st.integers(1, 3))):
        here, length = data.draw(st.integers(0, len(text))), data.draw(st.integers(0, 6))
        text = text[:here] + data.draw(st.text('"{}[]:,-eE.019 \\u\n', max_size=3)) + text[here + length :]
    check_outcome(text)


def check_outcome(text: str) -> None:
    """A plan that survives its round trip, or an InvalidInput that says something."""
    plan, found = None, ()
    try:
        plan = from_json(text, "plan.json")
    except InvalidInput as error:
        found = error.diagnostics
    assert found or plan is not None
    assert plan is None or from_json(to_json(plan), "plan.json") == plan
