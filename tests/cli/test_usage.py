"""What is said of an option's value is in words and in the unit of the option, and what is allowed is accepted."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from .conftest import SHAPES, Run

SHAPE = SHAPES / "level-up-peak.toml"

ROWS = [
    (("simulate", SHAPE, "--tolerance-mm", "0.0000001"), "0.0000001 mm is not allowed: give 0.000001 to 10 mm"),
    (("simulate", SHAPE, "--tolerance-mm", "nan"), "nan mm is not allowed: give 0.000001 to 10 mm"),
    (("simulate", SHAPE, "--tolerance-mm", "thin"), "'thin' is no number"),
    (("simulate", SHAPE, "--tolerance-mm", "0,1"), "'0,1' is no number: write 0.1"),
    (("simulate", SHAPE, "--tolerance-mm", "0.1mm"), "'0.1mm' is no number: write 0.1, it is in mm"),
    (("simulate", SHAPE, "--tolerance-mm", "1cm"), "'1cm' is no number: give the number of mm alone"),
    (("simulate", SHAPE, "--points", "1"), "1 is not allowed: give 2 to 100001"),
    (("simulate", SHAPE, "--points", "2.5"), "'2.5' is no whole number"),
    (
        ("simulate", SHAPE, "--model", "planer"),
        "--model takes auto, planar, extensible or spatial, not planer; did you mean planar?",
    ),
    (("load", SHAPE, "--segment", "0"), "0 is not allowed: give at least 1"),
    (("load", SHAPE, "--step-N", "3N"), "'3N' is no number: write 3, it is in N"),
    (("plan", SHAPE, "--feed-error-mm", "-1"), "-1 mm is not allowed: give at least 0 mm"),
    (("plan", SHAPE, "--feed-scale-percent", "\u22121"), "'\u22121' is no number: write -1"),
    (("keys", "node", "0", "--hex", "x", "-o", "y"), "0 is not allowed: give at least 1"),
]


@pytest.mark.parametrize(("command", "message"), ROWS, ids=[" ".join(map(str, row[0][-2:])) for row in ROWS])
def test_the_value_of_an_option_is_refused_in_words(run: Run, command: tuple[object, ...], message: str) -> None:
    code, out, err = run(*command)
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    for jargon in ("Input should", "parse", "Value error", "integer"):
        assert jargon not in err


@pytest.mark.parametrize("given", ["1e-9", "99"])
def test_both_ends_of_what_is_allowed_are_accepted(run: Run, tmp_path: Path, given: str) -> None:
    _, _, err = run("simulate", SHAPE, "--tolerance-mm", given)
    ends = re.findall(r"give ([\d.]+) to ([\d.]+) mm", err)
    for end in ends[0]:
        # A file that is missing is looked for only once the options are in order.
        assert "no-such-file" in run("simulate", tmp_path / "none.toml", "--tolerance-mm", end).err
