"""`curveline simulate --after`: the rod with the set that other shapes left."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from curveline.shapes.files import builtin_text
from curveline.shapes.library import builtin_shapes

PEAK, VALLEY = "level-asymmetric-peak", "level-asymmetric-valley"


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both shapes in the current folder, on a display whose rod takes a set that was measured."""
    monkeypatch.chdir(tmp_path)
    lines = "set_strength = 0.8\nset_exponent = 0.31\n"
    Path("mine.toml").write_text(builtin_text("single").replace("total_length", f"{lines}total_length", 1))
    for name in (PEAK, VALLEY):
        text = builtin_shapes()[name].read_text().replace('"single"', '"mine.toml"')
        Path(f"{name}.toml").write_text(text)


def test_the_table_says_what_the_rod_went_through_and_how_long_it_takes_to_forget(run, own: None) -> None:
    done = run("simulate", f"{PEAK}.toml", "--after", f"{VALLEY}.toml@8h", "--no-drawing")
    assert done.code == 0
    said = " ".join(done.out.split())
    assert f"after {VALLEY}.toml@8h the rod has a set of up to" in said
    assert "held straight for" in said
    assert "acetal" not in said
    assert "* peak" in done.out


def test_an_estimate_is_called_so(run) -> None:
    done = run("simulate", PEAK, "--after", f"{VALLEY}@8h", "--no-drawing")
    assert "acetal's estimate: the display file says nothing" in " ".join(done.out.split())


def test_json_has_the_history_the_law_the_set_and_what_was_assumed(run, own: None) -> None:
    done = run("simulate", f"{PEAK}.toml", "--after", f"{VALLEY}.toml@8h@30C,home@30min", "--json")
    after = json.loads(done.out)["after"]
    assert after["history"] == [
        {"shape": f"{VALLEY}.toml", "held_s": 28_800.0, "temperature_C": 30.0},
        {"shape": "home", "held_s": 1800.0, "temperature_C": 23.0},
    ]
    assert len(after["set"]["place_mm"]) == len(after["set"]["curvature_per_m"]) == 401
    assert 0.0 < after["set"]["error_per_m"] < 0.01 * after["set"]["largest_per_m"]
    assert not after["law"]["is_estimate"]
    assert after["assumed"]


def test_a_state_that_is_gone_comes_back_after_the_time_at_home_that_is_advised(run, own: None) -> None:
    done = run("simulate", f"{VALLEY}.toml", "--after", f"{PEAK}.toml@1d")
    assert done.code == 1
    assert "has no valley" in done.err
    (hint,) = [line for line in done.err.splitlines() if line.startswith("hint: it takes ")]
    advised = hint.split("--after ")[1]
    assert advised.startswith(f"{PEAK}.toml@1d,home@")
    assert run("simulate", f"{VALLEY}.toml", "--after", advised).code == 0


def test_every_shape_of_a_batch_comes_after_the_history(run, own: None) -> None:
    done = run("simulate", f"{PEAK}.toml", f"{VALLEY}.toml", "--after", f"{PEAK}.toml@1h", "--json")
    assert [len(json.loads(line)["after"]["history"]) for line in done.out.splitlines()] == [1, 1]


@pytest.mark.parametrize(
    ("history", "code", "told"),
    [
        (VALLEY, 2, "does not say how long"),
        (f"{VALLEY}@8", 2, "has no unit"),
        ("none.toml@8h", 2, "no such file"),
        ("roofline@8h", 2, "shapes of two displays"),
        (f"{PEAK}@1d,{VALLEY}@1h", 1, "cannot be held in"),
    ],
)
def test_a_history_that_cannot_be_is_refused(run, history: str, code: int, told: str) -> None:
    done = run("simulate", PEAK, "--after", history)
    assert done.code == code
    assert told in done.err
    assert not done.out


def test_a_sweep_has_no_history(run) -> None:
    done = run("simulate", PEAK, "--after", f"{VALLEY}@8h", "--sweep", "nodes.1.angle_deg=0:10:3")
    assert done.code == 2
    assert "--after is for shapes" in done.err
