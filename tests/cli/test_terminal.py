"""Every command in a terminal of 80 columns, and in others: nothing is wider, and no word is broken."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from campaign import only
from curveline.cli.app import main
from curveline.cli.printing.reports import node_table
from curveline.drive_settings import drive_settings
from curveline.plan_file import write_plan
from curveline.radio.host.node_status import NodeStatus
from curveline.radio.host.peer import LinkTally
from curveline.shapes.files import read_display

from .conftest import BROKEN, SHAPES, Run, small_plan
from .terminals import Shown, here, in_terminal

PEAK = str(SHAPES / "level-up-peak.toml")
VALLEY = str(SHAPES / "level-down-valley.toml")
ROOF = str(SHAPES / "roofline.toml")
PUSHED = str(SHAPES / "space" / "pushed.toml")
RADIO = ("--radio", "mock")

WHOLE = re.compile(r"(\S+|(hint: )?`[^`]*`\S*|curveline .*)")
"""What is not broken, however long: a word, or a command."""

SENTENCES = ("error:", "hint:", "record:", "to go on", "if this is", "passed over", "the newest")
"""How sentences on stderr begin."""


def is_fit(line: str, columns: int) -> bool:
    """Whether a line fits, or cannot be made to."""
    return len(line) <= columns or WHOLE.fullmatch(line.strip()) is not None


def shown(monkeypatch: pytest.MonkeyPatch, *arguments: object, columns: int = 80) -> Shown:
    """A command in a terminal."""
    monkeypatch.setattr(sys, "argv", ["curveline", *map(str, arguments)])
    with here(monkeypatch, columns) as text, pytest.raises(SystemExit) as stop:
        main()
    assert isinstance(stop.value.code, int)
    return Shown(stop.value.code, text[0], 0.0)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_valley: Path) -> Path:
    """A folder with plans, a run that stalled, one that is done, and keys."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "site.json"))
    write_plan(small_plan(), tmp_path / "small.json")
    write_plan(small_plan(steps=14, seconds=0.1), tmp_path / "long.json")
    return tmp_path


COMMANDS = [
    ("simulate", PEAK),
    ("simulate", ROOF, PEAK, "--brief"),
    ("simulate", ROOF, "--explain"),
    ("simulate", PUSHED, "--explain"),
    ("simulate", PUSHED, "--model", "planar"),
    ("simulate", PEAK, "--turns", "3"),
    ("simulate", "no-valley.toml"),
    ("simulate", *sorted(BROKEN.glob("*.toml"))),
    ("simulate", PEAK, "--sweep", "nodes.1.angle_deg=-70:70:15", "--sweep", "segments.1.length_mm=520:700:4"),
    ("simulate", PEAK, "--sweep", "nodes.1.angle_deg=-30:30:5", "--brief"),
    ("simulate", PEAK, "--sweep", "nodes.3.angle_deg=-30:30:5"),
    ("simulate", PEAK, "-o", "/no/such/folder/x.csv"),
    ("plan", PEAK, VALLEY, "--home"),
    ("plan", PEAK, "--brief"),
    ("plan", ROOF),
    ("plan", PEAK, "--monte-carlo", "3", "--jobs", "1"),
    ("plan", "no-valley.toml"),
    ("plan", PUSHED),
    ("plan", "small.json"),
    ("load", PEAK),
    ("load", PEAK, "--brief"),
    ("load", PEAK, "--map", "--points", "5"),
    ("load", PEAK, "--map", "--points", "5", "-b"),
    ("load", ROOF),
    ("send", ROOF, "--radio", "mock:fresh", "--yes"),
    ("send", PEAK, "--radio", "mock:fresh", "--yes", "--brief"),
    ("send", PEAK, "--radio", "mock:fresh", "--dry-run"),
    ("send", "small.json", "--radio", "mock:stall=1@step2", "--yes"),
    ("send", "small.json", "--radio", "mock:reboot=2@step2", "--yes"),
    ("send", "small.json", "--radio", "mock:gone@step1", "--yes"),
    ("send", "--resume", "last", *RADIO, "--yes"),
    ("send", "--home", *RADIO, "--yes"),
    ("send", PEAK),
    ("status", *RADIO),
    ("status", *RADIO, "--brief"),
    ("status", *RADIO, "--display", "quad"),
    ("status", "--radio", "mock:estop=1"),
    ("status", "--radio", "mock:unhomed=1"),
    ("status", "--radio", "mock:loss=0.99"),
    ("status", "--radio", "mock:los=0.3"),
    ("status", "--radio", "mock:weather"),
    ("status", "--radio", "carrier-pigeon"),
    ("status", *RADIO, "--scan"),
    ("status", "--radio", "mock:twin=2,version=1", "--scan"),
    ("status", *RADIO, "--radio-test"),
    ("stop", *RADIO),
    ("stop", "--radio", "mock:loss=0.99"),
    ("node", "status", "1", *RADIO),
    ("node", "status", "2", "--radio", "mock:estop=2"),
    ("node", "clear", "1", *RADIO),
    ("node", "home", "1", "--radio", "mock:absent=bias@1", "--yes"),
    ("node", "home", "9", *RADIO, "--yes"),
    ("runs",),
    ("runs", "--brief"),
    ("runs", "show", "last"),
    ("display", "check", "single"),
    ("display", "check", "quad"),
    ("display", "check", "quadd"),
    ("display", "show", "single"),
    ("keys", "new"),
    ("keys", "show"),
    ("keys", "adopt", "--radio", "mock:keys", "--yes"),
    ("keys", "adopt", *RADIO),
    ("keys", "node", "1", "--hex", "nothing.hex", "-o", "x.hex"),
    ("bench", "--link"),
    ("bench", "--link", "--quick"),
    ("simulate", "--colour"),
    ("simulat",),
    (),
]


@pytest.mark.parametrize(("columns", "part"), [(80, 1), (60, 3), *only([(60, 1)])])
def test_nothing_is_wider_than_the_terminal(
    run: Run, monkeypatch: pytest.MonkeyPatch, place: Path, columns: int, part: int
) -> None:
    """Of all commands one in `part`."""
    wide = []
    for arguments in COMMANDS[::part]:
        told = shown(monkeypatch, *arguments, columns=columns)
        assert "Traceback" not in told.raw
        wide += [(arguments, line) for line in told.lines if not is_fit(line, 80)]
        if columns < 80:
            # Tables need their 80 columns; sentences do not.
            said = [line for line in told.lines if line.startswith(SENTENCES)]
            wide += [(arguments, line) for line in said if not is_fit(line, columns)]
    assert not wide, "\n".join(f"{' '.join(map(str, arguments))}: {line}" for arguments, line in wide)


@pytest.mark.parametrize(
    "arguments",
    [
        ("simulate", BROKEN / "many-problems.toml"),
        ("status", "--radio", "mock:weather"),
        ("send", PEAK),
        ("plan", PUSHED),
        ("keys", "node", "1", "--hex", "x" * 100 + ".hex", "-o", "y.hex"),
    ],
)
def test_a_terminal_shows_the_words_that_a_file_gets(
    run: Run, monkeypatch: pytest.MonkeyPatch, place: Path, arguments: tuple[object, ...]
) -> None:
    run("keys", "new")
    piped = run(*arguments)
    told = shown(monkeypatch, *arguments, columns=50)
    assert " ".join(told.lines).split() == (piped.out + piped.err).split()
    # Nothing is wrapped where a script looks for whole sentences.
    assert any(len(line) > 80 for line in piped.err.splitlines())


def test_a_table_in_colours_is_the_table_of_a_file(run: Run) -> None:
    piped = run("simulate", PEAK, "--no-drawing")
    told = in_terminal("simulate", str(PEAK), "--no-drawing", columns=80)
    assert "\x1b[" in told.raw

    def but_times(lines: list[str]) -> list[str]:
        return [line.rstrip() for line in lines if line.strip() and not line.startswith("display ")]

    assert but_times(told.lines) == but_times(piped.out.splitlines())


def test_a_command_that_is_advised_can_be_copied(monkeypatch: pytest.MonkeyPatch, place: Path) -> None:
    told = shown(monkeypatch, "send", "small.json", "--radio", "mock:stall=1@step2", "--yes", columns=60)
    name = next((place / "runs").glob("0*")).name
    assert f"  curveline send --resume {name}" in told.lines
    assert any("`curveline send --resume last`" in line for line in told.lines)


def test_a_table_of_nodes_fits_whatever_they_say() -> None:
    drive = drive_settings(read_display("quad"))
    link = LinkTally(polls=123456, answered=1, lost=12345, retries=1234567)
    nodes = [
        NodeStatus(
            node=number,
            address=address,
            state=state,
            boot=65535,
            started=14,
            finished=13,
            staged=14,
            counts=(-262_000, -8000, -40_000),
            link=link,
        )
        for (number, address), state in zip(
            enumerate(drive.addresses, start=1),
            ("hold-link", "position-lost", "moving", "fault", "estop"),
            strict=True,
        )
    ]
    lines = node_table.table(nodes, drive)
    assert all(len(line) <= 80 for line in lines), lines
    assert "13 > 14" in lines[2]
    above, head = lines[:2]
    for title, unit in (("feed", "mm"), ("angle", "deg"), ("height", "mm")):
        end = above.index(title) + len(title)
        assert head[:end].endswith(unit)
