"""The help of every command: what it says, how wide it is, and that its words hold."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from typing import Any

import pytest
from typer.core import TyperGroup, TyperOption
from typer.main import get_command

from curveline.cli.app import app
from curveline.cli.printing import terminal
from curveline.cli.printing.help.examples import EXAMPLES

from .conftest import Run

ROOT: Any = get_command(app)
LETTERS = {
    "-V": "--version",
    "-a": "--all",
    "-b": "--brief",
    "-d": "--display",
    "-e": "--explain",
    "-f": "--force",
    "-h": "--help",
    "-j": "--jobs",
    "-m": "--model",
    "-n": "--dry-run",
    "-o": "--output",
    "-p": "--points",
    "-q": "--quick",
    "-r": "--radio",
    "-s": "--segment",
    "-t": "--tolerance-mm",
    "-w": "--watch",
    "-y": "--yes",
}
"""What a letter means, whichever command has it."""


def commands(group: Any = ROOT, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every command and group, and the words that lead to it."""
    yield path, group
    for name, command in (group.commands if isinstance(group, TyperGroup) else {}).items():
        yield from commands(command, (*path, name))


ALL = dict(commands())
each_command = pytest.mark.parametrize("path", ALL, ids=lambda path: " ".join(path) or "curveline")


def at_width(monkeypatch: pytest.MonkeyPatch, columns: int) -> None:
    monkeypatch.setattr(terminal, "size", lambda stream: (columns, 24))


HELPS: dict[tuple[str, ...], str] = {}


def help_of(run: Run, path: tuple[str, ...]) -> str:
    """The help of a command where there is no terminal, printed once for all tests."""
    if path not in HELPS:
        HELPS[path] = run(*path, "-h").out
    return HELPS[path]


def words(text: str) -> list[str]:
    return text.split()


@each_command
def test_a_short_h_is_help_and_says_all_that_a_help_must(run: Run, path: tuple[str, ...]) -> None:
    code, out, err = run(*path, "-h")
    assert (code, err) == (0, "")
    assert out == run(*path, "--help").out
    text = " ".join(out.split())
    assert out.startswith(f"Usage: {' '.join(['curveline', *path])} [OPTIONS]")
    assert "-h, --help" in out
    assert "feed (mm), angle (deg) and height (mm) are the extrude, bias and translate of the paper" in text
    assert "Exit codes: 0 done; 1 it ran" in text
    assert "\nExamples:\n" in out


@each_command
def test_a_help_has_no_types_of_python_and_no_formulas_for_ranges(run: Run, path: tuple[str, ...]) -> None:
    out = help_of(run, path)
    assert not re.search(r"<(int|str|float|bool|list|Path)", out)
    assert "<=x" not in out
    assert "x<=" not in out
    assert "x>=" not in out


@each_command
@pytest.mark.parametrize("columns", [40, 60, 80, 100, 200])
def test_a_help_is_wrapped_at_words_whatever_the_width(
    run: Run, monkeypatch: pytest.MonkeyPatch, path: tuple[str, ...], columns: int
) -> None:
    wide = help_of(run, path)
    at_width(monkeypatch, columns)
    out = run(*path, "-h").out
    assert words(out) == words(wide)
    for line in out.splitlines():
        is_whole = len(line.split()) == 1 or re.match(" *(curveline |-)", line)
        assert len(line) <= min(columns, 100) or is_whole, line
        assert len(line) <= 80 or columns > 80 or line.startswith("  curveline"), line


def test_a_wide_terminal_is_made_use_of(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    at_width(monkeypatch, 100)
    wide = run("simulate", "-h").out
    at_width(monkeypatch, 80)
    assert len(wide.splitlines()) < len(run("simulate", "-h").out.splitlines())


def test_no_summary_is_cut(run: Run) -> None:
    for path, group in ALL.items():
        if isinstance(group, TyperGroup):
            text = " ".join(help_of(run, path).split())
            for command in group.commands.values():
                assert " ".join(command.help.split("\n\n")[0].split()) in text


@each_command
def test_ranges_defaults_and_choices_are_said(run: Run, path: tuple[str, ...]) -> None:
    text = " ".join(help_of(run, path).split())
    for parameter in ALL[path].params:
        low, high = parameter.min, parameter.max
        if low is not None and high is not None:
            assert f"from {low:g} to {high:g}" in text or f"from {low} to {high}" in text, parameter.name
        elif low is not None:
            assert f"at least {low:g}" in text, parameter.name
        if isinstance(parameter.show_default, str):
            assert f"default: {parameter.show_default}]" in text, parameter.name
        elif parameter.default is not None and not isinstance(parameter.default, bool):
            shown = parameter.default.value if hasattr(parameter.default, "value") else parameter.default
            assert f"default: {shown:g}]" if isinstance(shown, float) else f"default: {shown}]" in text
        for choice in parameter.type_descriptor.choices or ():
            assert choice.value in text


def test_a_letter_means_the_same_in_every_command() -> None:
    meanings: dict[str, set[str]] = {}
    for path, command in ALL.items():
        context = command.make_context("x", [], resilient_parsing=True)
        for option in command.get_params(context):
            if isinstance(option, TyperOption):
                long = [name for name in option.opts if name.startswith("--")]
                assert len(long) == 1, (path, option.opts)
                for short in set(option.opts) - set(long):
                    assert re.fullmatch("-[A-Za-z]", short), (path, short)
                    meanings.setdefault(short, set()).add(long[0])
    assert meanings == {letter: {name} for letter, name in LETTERS.items()}


def test_what_is_often_typed_has_a_letter_wherever_it_is() -> None:
    letters = {name: letter for letter, name in LETTERS.items()}
    for path, command in ALL.items():
        for option in command.params:
            for name in option.opts:
                assert name not in letters or letters[name] in option.opts, (path, name)


def test_long_helps_have_sections(run: Run) -> None:
    out = run("plan", "-h").out
    titles = re.findall(r"^(\S.*):$", out, re.MULTILINE)
    assert titles == [
        "Arguments",
        "The way",
        "Results",
        "Many runs with errors (--monte-carlo)",
        "The display in truth (--monte-carlo)",
        "Options",
        "Examples",
    ]
    assert re.findall(r"^(\S.*):$", run("keys", "show", "-h").out, re.MULTILINE) == ["Options", "Examples"]


@pytest.mark.parametrize(
    "line", [command for examples in EXAMPLES.values() for command, _ in examples], ids=lambda line: line[10:60]
)
def test_an_example_is_a_command_that_is_understood(line: str) -> None:
    command: Any = ROOT
    program, *arguments = shlex.split(line.partition(" > ")[0])
    assert program == "curveline"
    while isinstance(command, TyperGroup) and arguments and arguments[0] in command.commands:
        command = command.commands[arguments.pop(0)]
    command.make_context("x", arguments)


def test_every_command_has_examples_of_its_own() -> None:
    assert set(EXAMPLES) == {" ".join(["curveline", *path]) for path in ALL}
    for name, examples in EXAMPLES.items():
        assert any(command.startswith(name) for command, _ in examples)


def test_a_command_without_what_it_needs_explains_itself_on_stderr(run: Run) -> None:
    for path in (("simulate",), ("keys",), ("node", "status"), ()):
        code, out, err = run(*path)
        assert (code, out) == (2, "")
        assert err == run(*path, "-h").out


@pytest.mark.parametrize(
    ("arguments", "message", "hint"),
    [
        (("--colour",), "there is no option --colour", "`curveline -h` explains it"),
        (
            ("simulate", "--explan"),
            "there is no option --explan",
            "did you mean --explain? `curveline simulate -h` explains it",
        ),
        (("simulate", "x.toml", "-p", "1"), "--points: 1 is not allowed: give 2 to 100001", "`curveline sim"),
        (
            ("simulate", "x.toml", "-t", "0"),
            "--tolerance-mm: 0 mm is not allowed: give 0.000001 to 10 mm",
            "`curveline sim",
        ),
        (("simulate", "x.toml", "-m", "flat"), "--model takes auto, planar, extensible or spatial, not flat", "`c"),
        (("node", "status", "two"), "N: 'two' is no whole number", "`curveline node status -h` explains it"),
        (("load", "x.toml", "--step-N", "-3"), "--step-N: -3 N is no load: make it more than 0", "`curveline load"),
        (("keys", "node", "1", "-o", "x"), "--hex is missing", "`curveline keys node -h` explains it"),
        (("simulate", "x.toml", "-p"), "option '-p' requires an argument", "`curveline simulate -h` explains it"),
        (("stop", "now"), "got unexpected extra argument(s) (now)", "`curveline stop -h` explains it"),
        (("simulat",), "no such command 'simulat'. Did you mean 'simulate'?", "`curveline -h` explains it"),
    ],
)
def test_what_cannot_be_understood_is_said_in_our_words(
    run: Run, arguments: tuple[str, ...], message: str, hint: str
) -> None:
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    *usage, error, advice = err.splitlines()
    assert usage[0].startswith("Usage: curveline")
    assert error == f"error: {message}"
    assert advice.startswith(f"hint: {hint}")
