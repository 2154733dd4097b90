"""Completion of command lines by the shell: how it is installed, and names that it knows."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator
from pathlib import Path

import typer

from curveline.cli.printing import screen
from curveline.errors import InvalidInput

PORTS = ("ttyACM*", "ttyUSB*", "cu.usbmodem*")
"""What the ports of a dongle are called in /dev."""

BASH = """\
_curveline() {
    local IFS=$'\\n'
    COMPREPLY=($(
        env COMP_WORDS="${COMP_WORDS[*]}" COMP_CWORD=$COMP_CWORD _CURVELINE_COMPLETE=complete_bash "$1" 2>/dev/null
    ))
}
complete -o default -F _curveline curveline"""
ZSH = """\
(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }
_curveline() {
    eval "$(_TYPER_COMPLETE_ARGS="${words[1,$CURRENT]}" _CURVELINE_COMPLETE=complete_zsh "$words[1]" 2>/dev/null)"
}
compdef _curveline curveline"""
FISH = """\
function __curveline
    set -lx _TYPER_COMPLETE_ARGS (commandline -cp)
    set -lx _TYPER_COMPLETE_FISH_ACTION $argv[1]
    _CURVELINE_COMPLETE=complete_fish curveline 2>/dev/null
end
complete --command curveline --no-files --condition '__curveline is-args' --arguments '(__curveline get-args)'"""
SCRIPTS = {"bash": BASH, "zsh": ZSH, "fish": FISH}
"""What a shell must have read; the names of variables are those that typer answers to."""


def answer_shells() -> None:
    """Let typer answer when it is a shell that asks, not a person."""
    if "_CURVELINE_COMPLETE" in os.environ:
        from typer.main import get_install_completion_arguments

        # Nobody needs the arguments, but without them typer knows no shell.
        get_install_completion_arguments()


def displays() -> list[str]:
    """The built-in displays; where none of them fits, the shell offers files."""
    from curveline.shapes.files import builtin_displays

    return list(builtin_displays())


def radios() -> Iterator[tuple[str, str]]:
    """Radios, and what they are: those dongles that are plugged in."""
    yield "mock", "a model of the display"
    for pattern in PORTS:
        yield from ((f"serial:{port}", "a dongle") for port in sorted(Path("/dev").glob(pattern)))
    yield "nrf24:22,0", "a radio chip on this board"


def runs() -> list[str]:
    """The newest run, then all that are on record."""
    from curveline.radio.host.journal import runs_folder
    from curveline.radio.host.run_folder import run_names

    return ["last", *run_names(runs_folder())]


def install(is_wanted: bool) -> None:
    """What the option --install-completion does."""
    if not is_wanted:
        return
    shell = _shell()
    script, settings = _places(shell)
    script.parent.mkdir(parents=True, exist_ok=True)
    script.write_text(f"{SCRIPTS[shell]}\n", encoding="utf-8")
    if settings is not None:
        _read_in(settings, script)
    screen.result(f"{script}: completion for {shell}, from the next shell on")
    raise typer.Exit


def show(is_wanted: bool) -> None:
    """What the option --show-completion does."""
    if is_wanted:
        screen.result(SCRIPTS[_shell()])
        raise typer.Exit


def _places(shell: str) -> tuple[Path, Path | None]:
    """Where the script goes, and which file of settings must name it, if the shell does not look there by itself."""
    home = Path.home()
    if shell == "fish":
        base = os.environ.get("XDG_CONFIG_HOME") or home / ".config"
        return Path(base) / "fish" / "completions" / "curveline.fish", None
    base = os.environ.get("XDG_DATA_HOME") or home / ".local" / "share"
    settings = home if shell == "bash" else Path(os.environ.get("ZDOTDIR") or home)
    return Path(base) / "curveline" / f"completion.{shell}", settings / f".{shell}rc"


def _read_in(settings: Path, script: Path) -> None:
    """Have a shell read the script when it starts."""
    line = f"source {shlex.quote(str(script))}"
    before = settings.read_text(encoding="utf-8") if settings.exists() else ""
    if line not in before.splitlines():
        gap = "" if before.endswith("\n") or not before else "\n"
        with settings.open("a", encoding="utf-8") as file:
            file.write(f"{gap}{line}\n")


def _shell() -> str:
    """The shell that this was typed in; InvalidInput if it is none that completion is there for."""
    import shellingham

    try:
        name = str(shellingham.detect_shell()[0])
    except shellingham.ShellDetectionFailure:
        name = Path(os.environ.get("SHELL", "")).name
    if name not in SCRIPTS:
        what = f"there is no completion for the shell {name}" if name else "it is not known which shell this is"
        raise InvalidInput(what, f"type it in one of {', '.join(SCRIPTS)}, or set SHELL to the path of one")
    return name
