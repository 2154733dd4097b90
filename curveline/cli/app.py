"""The command line: the only package that prints, prompts or exits."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from typing import Annotated, Any

import typer

from curveline import __version__
from curveline.cli.commands import bench, load, plan, send, shapes, simulate, status, stop
from curveline.cli.commands.display import check
from curveline.cli.commands.display import show as show_display
from curveline.cli.commands.keys import adopt, new
from curveline.cli.commands.keys import node as image
from curveline.cli.commands.keys import show as show_keys
from curveline.cli.commands.new import display as new_display
from curveline.cli.commands.new import shape as new_shape
from curveline.cli.commands.node import clear, home
from curveline.cli.commands.node import status as node_status
from curveline.cli.commands.runs import listing
from curveline.cli.commands.runs import show as show_run
from curveline.cli.printing import screen
from curveline.cli.usage import WordedCommands
from curveline.errors import EXIT_INTERRUPTED, EXIT_NO, CurvelineError, LinkError, SystemRefusal
from curveline.system.portable import is_hang_up
from curveline.system.refusals import hint_of, message_of

EPILOG = (
    "Exit codes: 0 done; 1 it ran and the answer is no (no such state, infeasible plan, tolerance not reached, a shape "
    "of a batch failed); 2 usage, an invalid file, or the system refused (no room, no rights); 3 radio or node fault, "
    "or the system refused while a radio was in use; 130 interrupted. Results go to stdout, everything else to stderr."
)

LINKED = (send.send, status.status, stop.stop, adopt.adopt, node_status.status, clear.clear, home.home)
"""Commands that have a radio in use."""

app = typer.Typer(
    name="curveline",
    cls=WordedCommands,
    help="Simulate, plan and drive shape displays made of flexible rods.",
    epilog=EPILOG,
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
            command(*arguments, **options)
        except OSError as error:
            raise refusal(message_of(error), hint_of(error)) from error

    return run


for _command in (simulate.simulate, plan.plan, send.send, status.status, stop.stop, load.load, bench.bench):
    app.command(epilog=EPILOG, no_args_is_help=_command not in (status.status, stop.stop, bench.bench))(
        _reporting(_command)
    )
keys = typer.Typer(help="The keys of a site: make them, load them, learn who the nodes are.", no_args_is_help=True)
for _key_command in (new.new, image.node, adopt.adopt, show_keys.show):
    keys.command(epilog=EPILOG)(_reporting(_key_command))
app.add_typer(keys, name="keys", epilog=EPILOG)
one = typer.Typer(help="One node: how it is, and what brings it back to work.", no_args_is_help=True)
for _node_command in (node_status.status, clear.clear, home.home):
    one.command(epilog=EPILOG, no_args_is_help=True)(_reporting(_node_command))
app.add_typer(one, name="node", epilog=EPILOG)
displays = typer.Typer(
    help="The displays: what is built in, and whether a file of your own is sound.", no_args_is_help=True
)
for _display_command in (check.check, show_display.show):
    displays.command(epilog=EPILOG, no_args_is_help=True)(_reporting(_display_command))
app.add_typer(displays, name="display", epilog=EPILOG)
app.command(epilog=EPILOG)(_reporting(shapes.shapes))
templates = typer.Typer(help="Files to begin with: a shape, or a display of your own.", no_args_is_help=True)
for _new_command in (new_shape.shape, new_display.display):
    templates.command(epilog=EPILOG)(_reporting(_new_command))
app.add_typer(templates, name="new", epilog=EPILOG)

runs = typer.Typer(help="The runs on record: how each ended, how far it came, whether it can go on.")
runs.callback(invoke_without_command=True, epilog=EPILOG)(_reporting(listing.listing))
runs.command(epilog=EPILOG, no_args_is_help=True)(_reporting(show_run.show))
app.add_typer(runs, name="runs", epilog=EPILOG)


def _show_version(wanted: bool) -> None:
    if wanted:
        screen.result(f"curveline {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point: run the command line and leave with the exit code that the design promises."""
    _make_streams_safe()
    try:
        code = _run()
    except KeyboardInterrupt:
        code = EXIT_INTERRUPTED
    sys.exit(_let_go(code))


def _run() -> int:
    try:
        app(prog_name="curveline")
    except CurvelineError as error:
        screen.complain(error)
        return error.exit_code
    except screen.ReaderGone:
        return EXIT_NO
    except OSError as error:
        return _refused(error)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else EXIT_NO
    return 0


def _refused(error: OSError) -> int:
    """Tell what the system refused outside of any command; the exit code."""
    screen.complain(SystemRefusal(message_of(error), hint_of(error)))
    return SystemRefusal.exit_code


def _let_go(code: int) -> int:
    """Write what is still buffered; the exit code, another one if that is what fails first."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
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
