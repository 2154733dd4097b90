"""docs/bring-up.md as a lab goes through it: boards built wrong are found by its own commands, in its own words."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import printed
import pytest
import typer.main

from curveline.drive_settings import AXES

from .conftest import Result, Run

PAGE = Path(__file__).parents[2] / "docs" / "bring-up.md"
PROGRAM = ":0800000000180020C1000000FF\n:00000001FF\n"
FIRST, LAST = "## 2. The radio alone", "## 8. The other nodes"
ABOUT_NODES = ("status", "keys", "node", "radio range")


class PageStep(NamedTuple):
    """A command of the page as it is printed there, the radio that it is for, and the exit code that the page tells."""

    command: str
    radio: str
    code: int


class WrongBoard(NamedTuple):
    """A row of the page's table: a setting of the mock, the command at which it shows, and words of what is said."""

    setting: str
    shows_at: str
    words: str
    advice: str

    @property
    def kind(self) -> str:
        """The name of the mock's setting, without what it is for."""
        return re.split("[=@]", self.setting)[0]

    def is_named(self, text: str) -> bool:
        return self.words in text and self.advice in text


class Found(NamedTuple):
    """What a command said that did not go as the page tells."""

    command: str
    boards: tuple[WrongBoard, ...]


def steps() -> Iterator[PageStep]:
    """The commands of the page about its first node, in their order."""
    text = PAGE.read_text()
    begin, end = text.index(FIRST), text.index(LAST)
    for block in printed.blocks(PAGE):
        if block.is_run and block.kind == "console" and begin < block.span[0] < end:
            commands = re.findall(r"^\$ curveline (.*)$", block.text, re.MULTILINE)
            for command in commands:
                if command.startswith(ABOUT_NODES):
                    yield PageStep(command, block.radio, block.exit_code if command is commands[-1] else 0)


STEPS = tuple(steps())


def rows() -> Iterator[WrongBoard]:
    """The boards of the page's table, each axis by itself."""
    for line in PAGE.read_text().splitlines():
        match = re.fullmatch(r"\| [^|]+ \| `(\w+=\S+)` \| `([^`]+)`([^|]*) \| ([^|]+) \| ([^|]+) \|", line)
        if match:
            setting, shows_at, first, words, advice = match.groups()
            for axis in AXES if "AXIS" in setting else ("",):
                other = AXES[(AXES.index(axis) + 1) % len(AXES)] if first else axis
                seen = min(axis, other, key=AXES.index) if first else axis
                parts = (setting, shows_at.replace("AXIS", seen), words, advice)
                yield WrongBoard(*(part.replace("AXIS", axis).strip() for part in parts))


BOARDS = tuple(rows())
TWELVE = {
    "reversed",
    "swapped",
    "absent",
    "noisy",
    "gear",
    "switch",
    "supply",
    "channel",
    "key",
    "firmware",
    "twin",
    "loose",
}


TREE = cache(typer.main.get_command)
"""The tree of all commands, made once: what these tests are about is what a command does."""


@pytest.fixture
def _desk(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What the page has made before its second step, and a program in the place of the one that `make` builds."""
    monkeypatch.setattr(typer.main, "get_command", TREE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "site.json"))
    (tmp_path / "firmware" / "build").mkdir(parents=True)
    (tmp_path / "firmware" / "build" / "node.hex").write_text(PROGRAM)
    assert run("keys", "new").code == 0
    assert run("new", "display", "lab").code == 0


class Desk:
    """Somebody who types the commands of the page, and mends what they find."""

    def __init__(self, run: Run, monkeypatch: pytest.MonkeyPatch, boards: Sequence[WrongBoard]) -> None:
        self.wrong = list(boards)
        self.found: list[Found] = []
        self._run = run
        self._monkeypatch = monkeypatch

    def type(self, step: PageStep) -> Result:
        radio = ",".join([step.radio, *(each.setting for each in self.wrong)])
        self._monkeypatch.setenv("CURVELINE_RADIO", radio)
        return self._run(*shlex.split(step.command))

    def go(self) -> None:
        """Type the commands; after one that went otherwise than the page tells, do what it says, and type it again.

        A board with nothing wrong any more goes on as a sound one does, which has a test of its own.
        """
        is_sound = not self.wrong
        for step in STEPS:
            if not self.wrong and not is_sound:
                break
            while (done := self.type(step)).code != step.code:
                text = " ".join((done.out + done.err).split())
                assert "Traceback" not in text
                named = tuple(each for each in self.wrong if each.is_named(text))
                assert named, f"{step.command} ends with {done.code}, and nobody knows why: {text}"
                falsely = {each.kind for each in BOARDS if each.is_named(text)} - {each.kind for each in self.wrong}
                assert not falsely, f"{step.command} says what is not so: {text}"
                for advised in re.findall(r"`curveline (node settings [^`]*)`", text):
                    assert self.type(PageStep(f"{advised} --yes", step.radio, 0)).code == 0
                self.found.append(Found(step.command, named))
                self.wrong = [each for each in self.wrong if each not in named]


def test_the_page_has_every_board_of_the_twelve_and_every_axis() -> None:
    kinds = [each.kind for each in BOARDS]
    assert set(kinds) - {"open", "config"} == TWELVE
    for kind in ("reversed", "swapped", "absent", "noisy", "loose", "gear"):
        assert kinds.count(kind) == len(AXES)
    assert len(STEPS) > 15


@pytest.mark.usefixtures("_desk")
def test_a_sound_board_goes_through_all_steps(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(run, monkeypatch, ())
    desk.go()
    assert desk.found == []


@pytest.mark.usefixtures("_desk")
@pytest.mark.parametrize("board", BOARDS, ids=[each.setting for each in BOARDS])
def test_a_board_that_is_wrong_is_found_where_the_page_says(
    run: Run, monkeypatch: pytest.MonkeyPatch, board: WrongBoard
) -> None:
    desk = Desk(run, monkeypatch, [board])
    desk.go()
    (found,) = desk.found
    assert found.command.startswith(board.shows_at)


def apart(one: WrongBoard, other: WrongBoard) -> bool:
    """Whether a board can be wrong in both ways: the mock takes each setting once."""
    return one.kind != other.kind


PAIRS = [pair for pair in combinations(BOARDS, 2) if apart(*pair)]
FEW = [PAIRS[0], *PAIRS[7 :: len(PAIRS) // 6]]


@pytest.mark.usefixtures("_desk")
@pytest.mark.parametrize(
    "pair",
    [*FEW, *(pytest.param(each, marks=pytest.mark.campaign) for each in PAIRS if each not in FEW)],
    ids=lambda pair: "+".join(each.setting for each in pair),
)
def test_two_things_that_are_wrong_come_to_light_one_after_the_other(
    run: Run, monkeypatch: pytest.MonkeyPatch, pair: tuple[WrongBoard, WrongBoard]
) -> None:
    desk = Desk(run, monkeypatch, pair)
    desk.go()
    assert {each for found in desk.found for each in found.boards} == set(pair)
