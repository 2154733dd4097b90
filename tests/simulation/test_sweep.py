"""Sweeps: their grid, and that every point is held against the rules as if it stood in the file."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from curveline.errors import InvalidInput
from curveline.rod.states.equilibrium import Outcome
from curveline.shapes.files import ShapeFile, read_shape
from curveline.simulation.sweep import Digest, Sweep, SweepTally

TEMPLATE = """
name = "loaded"
display = "single"
nodes = [ { height_mm = %r, angle_deg = %r, yaw_deg = %r, roll_deg = %r }, { height_mm = %r, angle_deg = %r } ]
segments = [ { length_mm = %r, state = "peak" } ]
loads = [ { segment = 1, at = %r, force_N = [%r, %r] } ]
"""
NUMBERS = (0, 30.0, 0.0, 10.0, 1.5, -30.0, 660.0, 0.5, 0.0, -1.5)
SHAPE = TEMPLATE % NUMBERS
KEYS = [
    "nodes.1.height_mm",
    "nodes.1.angle_deg",
    "nodes.1.yaw_deg",
    "nodes.1.roll_deg",
    "nodes.2.height_mm",
    "nodes.2.angle_deg",
    "segments.1.length_mm",
    "loads.1.at",
    "loads.1.force_N.1",
    "loads.1.force_N.2",
]


@pytest.fixture
def shape(tmp_path: Path) -> Path:
    path = tmp_path / "loaded.toml"
    path.write_text(SHAPE)
    return path


def test_the_grid_has_every_combination_the_last_key_fastest(shape: Path) -> None:
    sweep = Sweep(shape, ["nodes.1.angle_deg=-10:20:3", "segments.1.length_mm=700:650:2"])
    assert len(sweep) == 6
    tasks = list(sweep.tasks())
    assert [task.number for task in tasks] == [1, 2, 3, 4, 5, 6]
    values = [tuple(value for _, value in task.swept) for task in tasks]
    assert values == [(-10, 700), (-10, 650), (5, 700), (5, 650), (20, 700), (20, 650)]
    assert tasks[0].swept[0][0] == "nodes.1.angle_deg"


@pytest.mark.parametrize("key", KEYS)
def test_a_point_is_the_scene_of_a_file_with_that_number(shape: Path, tmp_path: Path, key: str) -> None:
    stop = {"length_mm": 691.0, "at": 0.7}.get(key.rpartition(".")[2], 4.25)
    start = {"length_mm": 650.0, "at": 0.3}.get(key.rpartition(".")[2], -4.0)
    (first, last) = Sweep(shape, [f"{key}={start}:{stop}:2"]).tasks()
    other = tmp_path / "other.toml"
    at = KEYS.index(key)
    other.write_text(TEMPLATE % (*NUMBERS[:at], stop, *NUMBERS[at + 1 :]))
    expected = read_shape(other)
    assert last.scene == replace(expected, path=str(shape), digest=read_shape(shape).digest)
    assert first.scene != last.scene


def test_the_keys_are_all_quantities_of_the_file(shape: Path) -> None:
    with pytest.raises(InvalidInput) as caught:
        Sweep(shape, ["nodes.1.angel_deg=0:1:2"])
    assert caught.value.hint.startswith("did you mean nodes.1.angle_deg? ")
    assert [key for key in KEYS if key not in caught.value.hint] == []
    assert len(Sweep(shape, ["nodes.2.yaw_deg=-5:5:3"])) == 3
    for key in (
        "loads.1.segment",
        "loads.1.force_N.3",
        "loads.1.force_N",
        "name",
        "segments.1.state",
        "nodes.0.angle_deg",
        "nodes.3.angle_deg",
        "nodes",
        "",
    ):
        with pytest.raises(InvalidInput, match="there is no such number"):
            Sweep(shape, [f"{key}=1:2:2"])


MEANT = {
    "nodes.0.angle_deg": "tables are counted from 1: did you mean nodes.1.angle_deg? ",
    "nodes[0].angle_deg": "tables are counted from 1: did you mean nodes.1.angle_deg? ",
    "segments.0.length_mm": "tables are counted from 1: did you mean segments.1.length_mm? ",
    "loads.1.force_N.0": "tables are counted from 1: did you mean loads.1.force_N.1? ",
    "nodes[2].angle_deg": "did you mean nodes.2.angle_deg? ",
    "nodes.3.angle_deg": "did you mean nodes.2.angle_deg? ",
    "nodes.999999999999.angle_deg": "did you mean nodes.2.angle_deg? ",
    "nodes.2.angel_deg": "did you mean nodes.2.angle_deg? ",
    "node.2.height": "did you mean nodes.2.height_mm? ",
    "Nodes.2.Height_mm": "did you mean nodes.2.height_mm? ",
    "loads.1.force_n.2": "did you mean loads.1.force_N.2? ",
    "angle_deg": "did you mean nodes.1.angle_deg? ",
    "height": "did you mean nodes.1.height_mm? ",
    "display": "this file has ",
    "": "this file has ",
}


@pytest.mark.parametrize(("key", "hint"), MEANT.items())
def test_a_key_that_is_none_leads_to_one_that_is(shape: Path, key: str, hint: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        Sweep(shape, [f"{key}=0.5:0.6:2"])
    assert caught.value.hint.startswith(hint)
    for meant in re.findall(r"did you mean (\S+)\?", caught.value.hint):
        start = "650:651" if "length" in meant else "0.5:0.6"
        assert len(Sweep(shape, [f"{meant}={start}:2"])) == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nodes.1.angle_deg", "is no range"),
        ("nodes.1.angle_deg=1:2", "is no range"),
        ("nodes.1.angle_deg=1:2:3:4", "is no range"),
        ("nodes.1.angle_deg=one:2:3", "must be numbers"),
        ("nodes.1.angle_deg=1:2:3.5", "must be numbers"),
        ("nodes.1.angle_deg=nan:2:3", "must be finite"),
        ("nodes.1.angle_deg=1:inf:3", "must be finite"),
        ("nodes.1.angle_deg=1:2:1", "no 1 value from 1 to 2"),
        ("nodes.1.angle_deg=1:2:0", "no 0 values"),
        ("nodes.1.angle_deg=1:2:-3", "no -3 values"),
        ("nodes.1.angle_deg=1:1:3", "no 3 values from 1 to 1"),
    ],
)
def test_ranges_that_are_none_are_refused_with_the_form(shape: Path, text: str, message: str) -> None:
    with pytest.raises(InvalidInput, match=re.escape(message)) as caught:
        Sweep(shape, [text])
    assert caught.value.hint


def test_a_key_has_one_range_and_a_sweep_an_end(shape: Path) -> None:
    with pytest.raises(InvalidInput, match="is given 2 times"):
        Sweep(shape, ["nodes.1.angle_deg=1:2:3", "nodes.1.angle_deg=1:5:3"])
    with pytest.raises(InvalidInput, match="1,002,001 combinations"):
        Sweep(shape, ["nodes.1.angle_deg=1:2:1001", "nodes.2.angle_deg=1:2:1001"])


@pytest.mark.parametrize(
    ("axis", "words"),
    [
        ("nodes.2.angle_deg=60:80:5", ("at point 5, nodes.2.angle_deg=80", "limit of 75 deg", "1 of 5 points")),
        ("nodes.1.height_mm=-230:0:24", ("point 1, nodes.1.height_mm=-230", "below", "1 of 24 points")),
        ("segments.1.length_mm=495:905:42", ("limit of 500 mm", "2 of 42 points")),
        ("segments.1.length_mm=500:505:6", ("too short", "segments.1.length_mm=500")),
        ("loads.1.at=0.5:0.999:2", ("point 2, loads.1.at=0.999", "inside a node's bearing")),
        ("loads.1.at=0.5:1.0:2", ("loads.1.at=1", "must be below 1")),
        ("loads.1.force_N.2=0:1e9:2", ("loads.1.force_N.2=1e+09", "at most 1000000 N")),
    ],
)
def test_a_point_outside_the_rules_is_named_before_anything_runs(
    shape: Path, axis: str, words: tuple[str, ...]
) -> None:
    seen: list[int] = []
    with pytest.raises(InvalidInput) as caught:
        Sweep(shape, [axis]).check(seen.append)
    for word in words:
        assert word in caught.value.message
    assert caught.value.hint
    assert seen == list(range(1, len(seen) + 1))


def test_a_point_is_refused_where_a_file_would_be(shape: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    file = ShapeFile.at(shape)
    verdicts = []
    for _ in range(200):
        height, length = rng.uniform(-240.0, 240.0), rng.uniform(490.0, 700.0)
        other = tmp_path / "other.toml"
        other.write_text(SHAPE.replace("1.5, a", f"{height}, a").replace("660.0", f"{length}"))
        complaints = []
        for attempt in (
            lambda other=other: read_shape(other),
            lambda h=height, s=length: file.varied({("nodes", 1, "height_mm"): h, ("segments", 0, "length_mm"): s}),
        ):
            try:
                attempt()
                complaints.append([])
            except InvalidInput as error:
                complaints.append([(found.code, found.message, found.hint) for found in error.diagnostics])
        assert complaints[0] == complaints[1]
        verdicts.append(bool(complaints[0]))
    assert 20 < sum(verdicts) < 180


def test_the_file_itself_must_be_sound(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(SHAPE.replace("660.0", "60.0"))
    with pytest.raises(InvalidInput) as caught:
        Sweep(path, ["segments.1.length_mm=600:700:2"])
    assert caught.value.diagnostics[0].line == 5


def test_a_tally_counts_points_and_keeps_extremes() -> None:
    both = Digest("peak, valley", 3.0, 60.0, 1e-5, True, frozenset())
    lone = Digest("valley", 7.0, 7.0, 2e-5, False, frozenset())
    none = Digest("none", math.nan, math.nan, 0.0, False, frozenset())
    coarse = Digest("peak, valley", 1.0, 50.0, 3e-4, True, frozenset({Outcome.COARSE}))
    tally = SweepTally.of(2)
    for point in ([both, both], [both, lone], [coarse, none], [coarse, both]):
        tally.add(point)
    first = tally.groups[0]["peak, valley"]
    assert (first.points, first.lowest, first.highest, first.error) == (4, 1.0, 60.0, 3e-4)
    assert {name: group.points for name, group in tally.groups[1].items()} == {
        "peak, valley": 2,
        "valley": 1,
        "none": 1,
    }
    assert not math.isfinite(tally.groups[1]["none"].highest)
    assert tally.unwanted == [0, 2]
    assert (tally.good, tally.without, tally.short) == (1, 2, {Outcome.COARSE: 2})
