"""Numbers that a sentence compares read differently, however near they are; small ones keep their digits."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from curveline.displays.capability import Ability, Held, buckling_force
from curveline.displays.lint import suspicions
from curveline.drive_settings import AxisDrive, drive_settings
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.planning.actuator_loads import ClampLoads, overload
from curveline.radio.host.preflight import check_place
from curveline.scene import Display
from curveline.shapes.files import builtin_text, read_display, read_shape
from curveline.units import beyond, decimals_of, plain, told_apart

NUMBER = r"(-?\d[\d.]*(?:e[+-]?\d+)?)"
HAIR = 1.0 + 1e-9
DISPLAY = read_display("single")
numbers = st.floats(allow_nan=False, allow_infinity=False)


@given(one=numbers, other=numbers, digits=st.integers(0, 8), kind=st.sampled_from("fg"))
@example(one=500.0, other=500.0000001, digits=0, kind="f")
@example(one=1e-12, other=5.0, digits=1, kind="f")
@example(one=5e-324, other=1.7e308, digits=0, kind="f")
def test_two_numbers_that_differ_read_so_and_in_their_order(one: float, other: float, digits: int, kind: str) -> None:
    first, second = told_apart(one, other, digits, kind)
    assert (first == second) == (one == other) or {one, other} == {0.0}
    assert (float(first) < float(second)) == (one < other)
    for text, value in ((first, one), (second, other)):
        assert float(text) != 0.0 or value == 0.0 or one == other


def test_numbers_have_no_more_digits_than_it_takes() -> None:
    assert told_apart(612.4, 500.0, 0, "f") == ("612", "500")
    assert told_apart(500.2, 500.0, 0, "f") == ("500.2", "500.0")
    assert told_apart(499.96, 500.0, 1, "f") == ("499.96", "500.00")
    assert told_apart(660.0, 660.0000004, 6) == ("660", "660.0000004")
    assert told_apart(0.0004, 8.0, 1, "f") == ("0.0004", "8.0000")
    assert beyond(75.0000001, -75.0, 75.0) == ("75.0000001", "-75", "75")
    assert beyond(-80.0, -75.0, 75.0) == ("-80", "-75", "75")


def test_decimals_show_digits_of_any_size() -> None:
    assert [decimals_of(size, 4) for size in (0.0, 5000.0, 500.0, 5.0, 0.5, -5e-7, math.inf)] == [0, 0, 1, 3, 4, 10, 0]


def compared(text: str) -> list[str]:
    """The two numbers that come last in a sentence."""
    return re.findall(NUMBER, text)[-2:]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_a_motor_lacks_by_a_hair_is_seen(axis: int) -> None:
    most = (DISPLAY.drive.max_force, DISPLAY.drive.max_force, DISPLAY.drive.max_moment)
    high = np.zeros(6)
    high[axis] = HAIR * most[axis]
    need, have = compared(overload(DISPLAY, (ClampLoads(np.zeros(6), high),)))
    assert float(need) > float(have)


def test_a_bend_that_is_too_tight_by_a_hair_is_seen() -> None:
    demand = ClampLoads(np.zeros(6), np.zeros(6), HAIR * DISPLAY.rod.max_curvature)
    bent, allowed = compared(overload(DISPLAY, (demand,)))
    assert float(bent) < float(allowed)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("clamp_mm = 20.0", "clamp_mm = 500.0000001"),
        ("height_mm = [-220.0, 220.0]", "height_mm = [220.0000001, 220.0]"),
        ("width_mm = 10.0", "diameter_mm = 10.0\ninner_diameter_mm = 10.0000001"),
    ],
)
def test_what_a_display_file_gets_wrong_by_a_hair_is_seen(tmp_path: Path, old: str, new: str) -> None:
    text = builtin_text("single").replace(old, new)
    if "diameter" in new:
        text = text.replace("thickness_mm", "# thickness_mm")
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_display(path)
    one, other = compared(caught.value.diagnostics[0].message)
    assert float(one) > float(other)


@pytest.mark.parametrize(
    ("nodes", "length"),
    [("0.0, angle_deg = 75.0000001", "660"), ("-220.000001, angle_deg = 0", "660"), ("0.0, angle_deg = 0", "500.0")],
)
def test_what_a_shape_gets_wrong_by_a_hair_is_seen(tmp_path: Path, nodes: str, length: str) -> None:
    path = tmp_path / "shape.toml"
    path.write_text(
        f'name = "x"\ndisplay = "single"\nnodes = [{{ height_mm = {nodes} }}, {{ height_mm = 0, angle_deg = 1e-4 }}]\n'
        f'segments = [{{ length_mm = {length}, state = "peak" }}]\n'
    )
    with pytest.raises(InvalidInput) as caught:
        read_shape(path)
    one, other = compared(caught.value.diagnostics[0].message)
    assert abs(float(one)) > abs(float(other)) or float(length) == 500.0
    assert one != other


def test_what_looks_odd_by_a_hair_is_seen() -> None:
    def odd(display: Display) -> dict[str, str]:
        return {each.code: each.message for each in suspicions(display, Ability(Held(0.5, 0.9)))}

    span = DISPLAY.span
    short = replace(DISPLAY, limits=replace(DISPLAY.limits, length=replace(DISPLAY.limits.length, high=span / HAIR)))
    weak = replace(DISPLAY, drive=replace(DISPLAY.drive, max_force=buckling_force(DISPLAY) / HAIR))
    for text in (odd(short)["out-of-reach"], odd(weak)["weak-motor"]):
        one, other = compared(text)
        assert float(one) < float(other)


def test_a_node_that_stands_elsewhere_by_fine_counts_is_seen() -> None:
    table = drive_settings(DISPLAY)
    fine = AxisDrive(1e7, 1.0, 1.0, -1.0, 1.0)
    target = SimpleNamespace(counts=(0, 0, 0))
    plan = cast(Any, SimpleNamespace(start=(target,), drive=replace(table, axes=(fine, fine, fine))))
    halt = check_place(cast(Plan, plan), 1, (40, 0, 0))
    assert halt is not None
    found, wanted = compared(halt.detail)
    assert float(found) > float(wanted) == 0.0


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1e-6, "0.000001"),
        (10.0, "10"),
        (0.0, "0"),
        (100_001, "100001"),
        (1e9, "1000000000"),
        (2**53, "9007199254740992"),
        (-90.0, "-90"),
        (1e-12, "1e-12"),
        (1e30, "1e+30"),
        (0.25, "0.25"),
    ],
)
def test_numbers_are_written_without_exponents_up_to_many_zeros(value: float, text: str) -> None:
    assert plain(value) == text
