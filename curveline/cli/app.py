"""The command line: the only package that prints, prompts or exits."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from functools import wraps
from inspect import Parameter, signature
from typing import Annotated, Any

import typer

from curveline._version import __version__
from curveline.cli import completion
from curveline.cli.commands import (
    atlas,
    bench,
    compare,
    fit,
    load,
    plan,
    rod,
    send,
    shapes,
    simulate,
    status,
    stop,
    surface,
    watch,
)
from curveline.cli.commands.calibrate import rod as calibrate_rod
from curveline.cli.commands.calibrate import set as set_
from curveline.cli.commands.camera import board, pose
from curveline.cli.commands.camera import calibrate as calibrate_camera
from curveline.cli.commands.display import check
from curveline.cli.commands.display import show as show_display
from curveline.cli.commands.keys import adopt, new
from curveline.cli.commands.keys import node as image
from curveline.cli.commands.keys import show as show_keys
from curveline.cli.commands.new import display as new_display
from curveline.cli.commands.new import shape as new_shape
from curveline.cli.commands.node import blink, clear, home, info, jog, tune, update, zero
from curveline.cli.commands.node import calibrate as node_calibrate
from curveline.cli.commands.node import check as node_check
from curveline.cli.commands.node import settings as node_settings
from curveline.cli.commands.node import status as node_status
from curveline.cli.commands.node import watch as node_watch
from curveline.cli.commands.radio import log as radio_log
from curveline.cli.commands.radio import range as radio_range
from curveline.cli.commands.radio import scan as radio_scan
from curveline.cli.commands.runs import listing
from curveline.cli.commands.runs import show as show_run
from curveline.cli.misuse import misuse_of
from curveline.cli.printing import failures, manner, screen, terminal
from curveline.cli.printing.failures import Interrupted
from curveline.cli.printing.help.help_pages import HelpCommand, HelpGroup, SignedCommand
from curveline.cli.printing.progress.ticker import patience
from curveline.errors import EXIT_INTERRUPTED, EXIT_NO, CurvelineError, LinkError, SystemRefusal
from curveline.system.portable import is_hang_up
from curveline.system.refusals import hint_of, message_of

EPILOG = """
Words: a node's feed (mm), angle (deg) and height (mm) are the extrude, bias and translate of the paper; its motors
feed, turn and lift.

Exit codes: 0 done; 1 it ran and the answer is no (no such state, infeasible plan, tolerance not reached, a shape of a
batch failed); 2 usage, an invalid file, or the system refused (no room, no rights); 3 radio or node fault, or the
system refused while a radio was in use; 130 interrupted. Results go to stdout, everything else to stderr.
""".strip()
HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}

OF_ONE_NODE = (
    *(node_status.status, info.info, clear.clear, home.home, blink.blink, jog.jog, zero.zero, node_watch.watch),
    *(node_check.check, node_calibrate.calibrate, tune.tune, node_settings.settings, update.update),
)
OF_THE_AIR = (radio_scan.scan, radio_range.range, radio_log.log)
LINKED = (send.send, watch.watch, status.status, stop.stop, adopt.adopt, *OF_ONE_NODE, *OF_THE_AIR)
"""Commands that have a radio in use."""

COMPUTING = "Compute"
DRIVING = "Drive a display"
SETTING_UP = "Set up and measure"

app = typer.Typer(
    cls=HelpGroup,
    name="curveline",
    help="Simulate, plan and drive shape displays made of flexible rods.",
    epilog=EPILOG,
    context_settings=HELP_OPTIONS,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _reporting(command: Callable[..., None]) -> Callable[..., None]:
    """A command that tells what the system refused it; typer would take some of that for a closed pipe."""
    refusal = LinkError if command in LINKED else SystemRefusal

    @wraps(command)
    def run(*arguments: Any, **options: Any) -> None:
        try:
            # What is measured is not to be disturbed, and says by itself how long it takes.
            with nullcontext() if command is bench.bench else patience("working"):
                command(*arguments, **options)
        except OSError as error:
            raise refusal(message_of(error), hint_of(error)) from error
        except KeyboardInterrupt:
            failures.answer(Interrupted("interrupted"))
            raise

    return run


def _add(to: typer.Typer, command: Callable[..., None], panel: str | None = None) -> None:
    """Add a command; one that does nothing without arguments explains itself when it has none."""
    is_enough = all(parameter.default is not Parameter.empty for parameter in signature(command).parameters.values())
    needs = not is_enough or command in (plan.plan, send.send)
    kind = SignedCommand if command is jog.jog else HelpCommand
    to.command(cls=kind, epilog=EPILOG, no_args_is_help=needs, rich_help_panel=panel)(_reporting(command))


def _group(name: str, what: str, panel: str, commands: Sequence[Callable[..., None]]) -> typer.Typer:
    """Add a group of commands."""
    group = typer.Typer(cls=HelpGroup, help=what, no_args_is_help=True)
    for command in commands:
        _add(group, command)
    app.add_typer(group, name=name, epilog=EPILOG, rich_help_panel=panel)
    return group


COMMANDS: dict[str, Sequence[Callable[..., None]]] = {
    COMPUTING: (simulate.simulate, fit.fit, surface.surface, plan.plan, load.load, atlas.atlas),
    DRIVING: (send.send, watch.watch, status.status, stop.stop, rod.rod),
    SETTING_UP: (shapes.shapes, compare.compare, bench.bench),
}
for _panel, _commands in COMMANDS.items():
    for _command in _commands:
        _add(app, _command, _panel)
_group(
    "node",
    "One node: how it is, what brings it back to work, and how it is tried out.",
    DRIVING,
    OF_ONE_NODE,
)
_group(
    "radio",
    "The air between a host and its nodes: quiet channels, how well a node is heard, what is said.",
    SETTING_UP,
    OF_THE_AIR,
)
runs = _group(
    "runs",
    "The runs on record: how each ended, how far it came, whether it can go on.",
    DRIVING,
    (show_run.show,),
)
runs.callback(invoke_without_command=True, no_args_is_help=False)(_reporting(listing.listing))
_group(
    "new",
    "Files to begin with: a shape, or a display of your own.",
    SETTING_UP,
    (new_shape.shape, new_display.display),
)
_group(
    "display",
    "The displays: what is built in, and whether a file of your own is sound.",
    SETTING_UP,
    (check.check, show_display.show),
)
_group(
    "camera",
    "Photographs of a display: what to print for them, the lens, where the camera stood.",
    SETTING_UP,
    (board.board, calibrate_camera.calibrate, pose.pose),
)
_group(
    "calibrate",
    "Numbers of a display file from what you measured.",
    SETTING_UP,
    (calibrate_rod.rod, set_.set),
)
_group(
    "keys",
    "The keys of a site: make them, load them, learn who the nodes are.",
    SETTING_UP,
    (new.new, image.node, adopt.adopt, show_keys.show),
)


def _show_version(wanted: bool) -> None:
    if wanted:
        screen.result(f"curveline {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("-V", "--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    install_completion: Annotated[
        bool,
        typer.Option(
            "--install-completion",
            callback=completion.install,
            is_eager=True,
            help="Teach this shell (bash, zsh, fish) to complete commands, options and names, and exit.",
        ),
    ] = False,
    show_completion: Annotated[
        bool,
        typer.Option(
            "--show-completion",
            callback=completion.show,
            is_eager=True,
            help="Show what that would have the shell read, and exit.",
        ),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point: run the command line and leave with the exit code that the design promises."""
    _make_streams_safe()
    manner.begin(sys.argv[1:])
    terminal.begin()
    try:
        code = _run()
        failures.conclude(code)
    except KeyboardInterrupt:
        code = EXIT_INTERRUPTED
    except screen.ReaderGone:
        code = EXIT_NO
    terminal.end()
    sys.exit(_let_go(code))


def _run() -> int:
    completion.answer_shells()
    try:
        return int(app(prog_name="curveline", standalone_mode=False) or 0)
    except CurvelineError as error:
        return _failed(error)
    except typer.TyperException as error:
        misuse = misuse_of(error)
        if misuse.usage:
            screen.note(misuse.usage)
        return _failed(misuse)
    except typer.Abort:
        # What asked for an answer found nobody to give it.
        return EXIT_INTERRUPTED
    except OSError as error:
        return _refused(error)


def _failed(error: CurvelineError) -> int:
    """Tell what went wrong; the exit code."""
    screen.complain(error)
    failures.answer(error)
    return error.exit_code


def _refused(error: OSError) -> int:
    """Tell what the system refused outside of any command; the exit code."""
    return _failed(SystemRefusal(message_of(error), hint_of(error)))


def _let_go(code: int) -> int:
    """Write what is still buffered; the exit code, another one if a result is what cannot be written."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            if stream is sys.stdout:  # notes that nobody can read change no answer
                code = code or (EXIT_NO if is_hang_up(error) else _refused(error))
            # Python would try again on its way out, and change the exit code.
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return code


def _make_streams_safe() -> None:
    """A closed stream swallows or ends, and one that cannot show a character shows a substitute: no tracebacks."""
    # In the order of their numbers: each takes the lowest that is free, and no file gets the number of a stream.
    sys.stdin = sys.stdin or open(os.devnull)  # noqa: SIM115
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
