"""Histories as text: read as meant, written to be read again, refused with what to write."""

from __future__ import annotations

import math

import pytest

from curveline.errors import InvalidInput
from curveline.material.history import Dwell, duration_text, history_text, parse_duration, parse_history


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("0s", 0.0),
        ("1s", 1.0),
        ("30min", 1800.0),
        ("8h", 28_800.0),
        (" 2.5 d ", 216_000.0),
        ("1w", 604_800.0),
        (".5h", 1800.0),
        ("1e3s", 1000.0),
    ],
)
def test_times_are_read(text: str, seconds: float) -> None:
    assert parse_duration(text) == seconds


@pytest.mark.parametrize("seconds", [0.0, 0.1, 1.0, 59.9, 60.0, 5400.0, 28_800.0, 1e5 / 3.0, 604_800.0, 1e9])
def test_times_are_written_to_be_read_again(seconds: float) -> None:
    assert parse_duration(duration_text(seconds)) == seconds


def test_times_are_written_as_people_say_them() -> None:
    assert [duration_text(each) for each in (40.0, 90.0, 28_800.0, 216_000.0)] == ["40s", "1.5min", "8h", "2.5d"]


def test_a_history_is_read_in_its_order() -> None:
    history = parse_history("shapes/peak.toml@8h, home@30min@40C,a@b@1d")
    assert history == (
        Dwell("shapes/peak.toml", 28_800.0),
        Dwell("home", 1800.0, 40.0),
        Dwell("a@b", 86_400.0),
    )
    assert parse_history(history_text(history)) == history


@pytest.mark.parametrize(
    ("text", "told", "hint"),
    [
        ("", "no shape is named", "peak.toml@8h"),
        ("peak@8h,", "no shape is named", "peak.toml@8h"),
        ("peak", "does not say how long", "peak.toml@8h"),
        ("@8h", "names no shape", "before the @"),
        ("peak@", "is no time", "30min"),
        ("peak@8", "has no unit", "s, min, h, d and w"),
        ("peak@8hours", "no unit of time 'hours'", "write 8h;"),
        ("peak@8m", "no unit of time 'm'", "write 8min;"),
        ("peak@8H", "no unit of time 'H'", "write 8h;"),
        ("peak@8parsec", "no unit of time 'parsec'", "s, min, h, d and w"),
        ("peak@eight", "is no time", "30min"),
        ("peak@1.2.3h", "is no time", "30min"),
        ("peak@-8h", "no time that a rod is held", "from 0"),
        ("peak@1e30h", "no time that a rod is held", "from 0"),
        ("peak@1e999h", "no time that a rod is held", "from 0"),
        ("peak@nanh", "is no time", "30min"),
        ("peak@8h@1.2.3C", "no temperature", "40C"),
        ("peak@8h@900C", "nothing is known", "Celsius"),
        ("peak@40C", "no unit of time 'C'", "s, min, h, d and w"),
        ("peak\x1b[2J@8h,b", "'b' does not say how long", "peak.toml@8h"),
        ("\x1b[2J", "\ufffd", "peak.toml@8h"),
    ],
)
def test_what_cannot_be_read_is_refused_with_what_to_write(text: str, told: str, hint: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        parse_history(text)
    assert told in refusal.value.message
    assert hint in refusal.value.hint
    assert "\x1b" not in refusal.value.message


def test_a_history_without_end_is_refused() -> None:
    with pytest.raises(InvalidInput, match="too many"):
        parse_history(",".join(["a@1s"] * 1001))


@pytest.mark.parametrize(
    ("shape", "seconds", "temperature"), [("", 1.0, None), ("a", math.nan, None), ("a", 1.0, 99.0)]
)
def test_a_dwell_that_makes_no_sense_is_refused(shape, seconds, temperature) -> None:
    with pytest.raises(InvalidInput):
        Dwell(shape, seconds, temperature)
