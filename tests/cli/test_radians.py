"""Angles that look like radians are told of, once per file, and taken as the degrees that they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from curveline.shapes.files import read_shape
from curveline.shapes.library import builtin_shapes
from curveline.shapes.radians import remark_on_radians

from .conftest import SHAPES, Run

TEXT = (SHAPES / "level-up-peak.toml").read_text()


def tilted(left: str, right: str, more: str = "") -> str:
    return TEXT.replace("= 30.0 }", f"= {left}{more} }}").replace("= -30.0 }", f"= {right} }}")


ROWS = [
    ("0.52", "-0.52", "", "is angle_deg in radians? it is taken as degrees: 0.52 rad would be 29.79 deg"),
    ("1.5708", "0", "", "1.5708 rad would be 90 deg"),
    ("0.0", "-0.5", "", "-0.5 rad would be -28.65 deg"),
    ("30.0", "-30.0", ", yaw_deg = 0.26", "is yaw_deg in radians?"),
    ("30.0", "-30.0", ", roll_deg = 3.1416", "is roll_deg in radians?"),
    ("0.3", "-0.3", ", roll_deg = 6.2832", "are angle_deg and roll_deg in radians? they are"),
    ("30.0", "-30.0", "", ""),
    ("0.0", "0.0", "", ""),
    ("1.0", "-1.0", "", ""),
    ("0.52", "-20.0", "", ""),
    ("1.7", "-1.7", "", ""),
    ("30.0", "-30.0", ", roll_deg = 10.5", ""),
]


@pytest.mark.parametrize(("left", "right", "more", "said"), ROWS)
def test_what_looks_like_radians(left: str, right: str, more: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(tilted(left, right, more))
    remark = remark_on_radians(read_shape(tmp_path / "x.toml"))
    assert said in remark
    assert bool(said) is bool(remark)


def test_small_angles_are_meant_where_segments_are_straight(tmp_path: Path) -> None:
    low = tilted("0.9", "-0.9").replace("660.0", "500.02").replace('"peak"', '"straight"')
    (tmp_path / "x.toml").write_text(low)
    assert remark_on_radians(read_shape(tmp_path / "x.toml")) == ""
    (tmp_path / "x.toml").write_text(low.replace("-0.9 }", "-0.9, roll_deg = 3.1416 }"))
    assert remark_on_radians(read_shape(tmp_path / "x.toml")).startswith("is roll_deg in radians?")


@pytest.mark.parametrize("path", builtin_shapes().values(), ids=builtin_shapes())
def test_no_shape_of_ours_looks_like_that(path: Path) -> None:
    assert remark_on_radians(read_shape(path)) == ""


@pytest.mark.parametrize(
    "command",
    [
        ("simulate", "x.toml", "--json"),
        ("simulate", "x.toml", "--sweep", "nodes.1.angle_deg=0.5:0.6:2"),
        ("load", "x.toml", "--most-N", "1"),
        ("plan", "x.toml", "x.toml", "--home"),
        ("send", "x.toml", "--dry-run"),
    ],
    ids=lambda command: command[0],
)
def test_it_is_told_once_per_file_and_changes_nothing(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.toml").write_text(tilted("0.52", "-0.52"))
    code, _, err = run(*command)
    assert code == 0, err
    assert err.count("in radians?") == 1
    assert "x.toml: is angle_deg in radians?" in err
