"""Completion by the shell: what is offered, and how it comes to be."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import shellingham

import standby
from curveline.cli.completion import SCRIPTS

from .conftest import Run, small_plan

CURVELINE = f'#!/bin/sh\nexec {sys.executable} -m curveline "$@"\n'


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home of one's own, with curveline on the path."""
    folder = tmp_path / "home"
    folder.mkdir()
    program = folder / "bin" / "curveline"
    program.parent.mkdir()
    program.write_text(CURVELINE)
    program.chmod(0o755)
    monkeypatch.setenv("HOME", str(folder))
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "ZDOTDIR"):
        monkeypatch.delenv(name, raising=False)
    return folder


def in_shell(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr(shellingham, "detect_shell", lambda: (name, f"/bin/{name}"))


def offered(shell: str, line: str) -> list[str]:
    """What a shell is told when this is typed, as typer and it have agreed."""
    words = line.split(" ")
    asks = {
        "bash": {"COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)},
        "zsh": {"_TYPER_COMPLETE_ARGS": line},
        "fish": {"_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
    }[shell]
    environment = {**os.environ, **asks, "_CURVELINE_COMPLETE": f"complete_{shell}"}
    command = [*standby.python(), "-m", "curveline"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.splitlines()


def test_bash_completes_commands_options_and_names(home: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    in_shell(monkeypatch, "bash")
    assert run("--install-completion").code == 0
    script = """
    source ~/.bashrc
    try() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); _curveline curveline; echo "${COMPREPLY[*]}"; }
    try curveline st
    try curveline display check ""
    try curveline status -d s
    try curveline status --radio m
    try curveline load x.toml --state ""
    try curveline simulate --no-d
    try curveline simulate shapes/x
    complete -p curveline
    """
    done = subprocess.run(["bash", "--norc", "-c", script], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert done.stdout.splitlines() == [
        "status stop",
        "quad single",
        "single",
        "mock",
        "peak valley straight",
        "--no-drawing",
        "",
        "complete -o default -F _curveline curveline",
    ]


@pytest.mark.parametrize("shell", SCRIPTS)
def test_every_shell_is_told(shell: str) -> None:
    assert [line for line in offered(shell, "curveline simulate --expl") if "--explain" in line]
    told = "\n".join(offered(shell, "curveline sto"))
    assert "stop" in told
    if shell != "bash":
        assert "Stop every node of a display, whoever drives it." in told
    assert not any("quad" in line for line in offered(shell, "curveline display check mine"))


def test_runs_are_offered_the_newest_first(run: Run, tmp_path: Path) -> None:
    from curveline.plan_file import write_plan

    assert offered("bash", "curveline runs show ") == ["last"]
    write_plan(small_plan(steps=1), tmp_path / "small.json")
    for radio in ("mock:fresh", "mock:fresh"):
        assert run("send", tmp_path / "small.json", "--radio", radio, "--yes").code == 0
    last, second, first = offered("bash", "curveline send --resume ")
    assert last == "last"
    assert second.startswith("000002-")
    assert first.startswith("000001-")


@pytest.mark.parametrize("shell", SCRIPTS)
def test_installing_twice_is_installing_once(home: Path, run: Run, monkeypatch: pytest.MonkeyPatch, shell: str) -> None:
    in_shell(monkeypatch, shell)
    settings = home / f".{shell}rc"
    settings.write_text("alias ll='ls -l'")
    for _ in range(2):
        code, out, err = run("--install-completion")
        assert (code, err) == (0, "")
    path = Path(out.partition(": ")[0])
    assert home in path.parents
    assert path.read_text() == f"{SCRIPTS[shell]}\n" == run("--show-completion").out
    if shell == "fish":
        assert path == home / ".config" / "fish" / "completions" / "curveline.fish"
        assert settings.read_text() == "alias ll='ls -l'"
    else:
        assert settings.read_text() == f"alias ll='ls -l'\nsource {path}\n"


def test_a_shell_that_is_not_known_is_said(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    in_shell(monkeypatch, "xonsh")
    code, out, err = run("--install-completion")
    assert (code, out) == (2, "")
    assert err.startswith("error: there is no completion for the shell xonsh\nhint: type it in one of bash, zsh, fish")

    def lost() -> None:
        raise shellingham.ShellDetectionFailure

    monkeypatch.setattr(shellingham, "detect_shell", lost)
    monkeypatch.setenv("SHELL", "/usr/bin/zsh")
    assert run("--show-completion").out == f"{SCRIPTS['zsh']}\n"
    monkeypatch.delenv("SHELL")
    assert run("--show-completion").err.startswith("error: it is not known which shell this is\n")


def test_a_shell_is_answered_in_time() -> None:
    before = os.times()
    offered("zsh", "curveline status --radio ")
    after = os.times()
    assert after.children_user + after.children_system - before.children_user - before.children_system < 1.0
